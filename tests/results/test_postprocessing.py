"""Points that were found stay, whatever fails that is computed about them."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.cases import oscillator
from helpers.command import slipstick
from helpers.oscillator import with_law

import slipstick as ss
from slipstick.analysis.curve.follow import frequency_request
from slipstick.analysis.modes import nonlinear_modes as modes_module
from slipstick.analysis.peaks import events as peaks_module
from slipstick.analysis.road import request
from slipstick.analysis.stability import floquet, subharmonics
from slipstick.results import record
from slipstick.results.postprocessing import Postprocessing

FRICTION = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=200.0)


def problem(contact: Any = FRICTION, port: str = "tangential") -> ss.Problem:
    return with_law(contact, name="damper", port=port, force=100.0)


def fails(*_: Any, **__: Any) -> Any:
    raise ZeroDivisionError("on purpose")


def told(compute: Callable[[], Any]) -> tuple[Any, str]:
    """What comes out, and all that was warned of, a line each."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = compute()
    return found, "\n".join(str(w.message) for w in caught)


def after(calls: int, function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which fails after so many calls."""
    count = 0

    def asked(*given: Any, **named: Any) -> Any:
        nonlocal count
        count += 1
        return fails() if count > calls else function(*given, **named)

    return asked


def test_take_each_and_said() -> None:
    postprocessing = Postprocessing()
    assert postprocessing.attempt("a", lambda: 1, 2) == 1
    assert postprocessing.attempt("b", lambda: 1 // 0, 2) == 2
    halves = postprocessing.attempt_each("c", lambda at: np.array([1 / i for i in at]), 3, ())
    np.testing.assert_array_equal(halves, [np.nan, 1.0, 0.5])
    assert postprocessing.warnings(lambda: ["too few"]) == [
        "b is not known at 1 place, where computing it failed: ZeroDivisionError: integer division or modulo by zero",
        "c is not known at 1 place, where computing it failed: ZeroDivisionError: division by zero",
        "too few",
    ]
    with pytest.raises(KeyboardInterrupt):
        postprocessing.attempt("d", lambda: (_ for _ in ()).throw(KeyboardInterrupt), None)


@pytest.fixture(scope="module")
def sound() -> ss.Branch:
    return ss.forced_response(problem(), omega=(8.0, 12.0), stability=True)


BESIDE = {
    "truncation": (record, "truncation", ("truncation",)),
    "amplitude": (record, "amplitude", ("amplitude",)),
    "stability": (floquet.StabilityWatch, "difference", ("multiplier", "multiplier_max", "hill_pw_difference")),
    "what contacts do at interpolated points": (record, "Together", None),
    "stick_fraction": (record, "_detail_of", None),
    "what is suspicious in the results": (request, "result_warnings", ()),
}
"""What fails: where it is computed, and the variables that are then not known."""


@pytest.mark.parametrize("what", BESIDE)
def test_a_curve_stays_where_something_beside_it_fails(
    sound: ss.Branch, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    where, name, unknown = BESIDE[what]
    monkeypatch.setattr(where, name, (lambda _: fails) if name == "_detail_of" else fails)
    branch, said = told(lambda: ss.forced_response(problem(), omega=(8.0, 12.0), stability=what == "stability"))
    assert re.search(f"^{what} is not known at .*ZeroDivisionError: on purpose", said, re.MULTILINE)
    assert (branch.outcome, len(branch)) == (ss.Outcome.COMPLETED, len(sound))
    assert f"{what} is not known" in branch.dataset.attrs["warnings"]
    np.testing.assert_allclose(branch.dataset["omega"], sound.dataset["omega"], rtol=1e-12)
    solved = branch.dataset["kind"].to_numpy() != "interpolated"
    for variable in ("displacement", "contact_tangential", "friction_force"):
        a, b = (b.dataset[variable].to_numpy()[solved] for b in (branch, sound))
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9)
    for variable in unknown or ():
        assert np.isnan(branch.dataset[variable].to_numpy()).any()


def test_stability_that_fails_all_along(sound: ss.Branch, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its test functions too: the curve goes on without special points."""
    monkeypatch.setattr(floquet.StabilityWatch, "at", after(12, floquet.StabilityWatch.at))
    branch, said = told(lambda: ss.forced_response(problem(), omega=(8.0, 12.0), stability=True))
    assert "where stability changes is not known at" in said
    assert "\nstability is not known at" in said
    assert branch.outcome is ss.Outcome.COMPLETED
    assert set(branch.dataset["stable"].to_numpy()) == {-1, 1}
    assert branch.peaks("x") == pytest.approx(sound.peaks("x"), rel=1e-9)


def test_peaks_that_cannot_be_sought(sound: ss.Branch, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peaks_module, "amplitude_with_slope", after(9, peaks_module.amplitude_with_slope))
    with pytest.warns(ss.SlipstickWarning, match="^the place of peaks is not known at .*on purpose"):
        branch = ss.forced_response(problem(), omega=(8.0, 12.0))
    assert branch.outcome is ss.Outcome.COMPLETED
    assert branch.peaks("x") == []
    assert np.interp(10.0, branch.dataset["omega"], branch.dataset["amplitude"][:, 0]) == pytest.approx(
        np.interp(10.0, sound.dataset["omega"], sound.dataset["amplitude"][:, 0]), rel=1e-3
    )


def test_largest_amplitudes_that_cannot_be_sought(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many outputs the largest alone is located: where that fails between two points the curve goes on."""
    K = 40.0 * (2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1))
    structure = ss.MatrixStructure(M=np.eye(3), C=0.01 * K, K=K, dofs=["a", "b", "c"])
    pair = ss.ContactPair(name="damper", contact=FRICTION, tangential="b")
    chain = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="a", sin=100.0), harmonics=range(4))
    request = replace(frequency_request(chain, (4.0, 12.0)), peaks_of=(), largest_of=("a", "b", "c"))
    whole = request.solutions()
    monkeypatch.setattr(peaks_module._Slopes, "at", fails)
    branch, said = told(request.solutions)
    assert re.search("^the place of the largest amplitudes is not known at .*on purpose", said, re.MULTILINE)
    assert branch.outcome is ss.Outcome.COMPLETED
    kinds = [b.dataset["kind"].to_numpy() for b in (branch, whole)]
    assert kinds[0][-1] == "end"
    assert np.count_nonzero(kinds[0] == "interpolated") > 0


def spring(x: Any, velocity: Any, k: Any) -> Any:
    return k * x**3


def test_the_documented_minimum_of_samples_is_enough() -> None:
    """(degree + 1) m_n + 1 times; what the harmonics left out would add takes more, as many as it needs."""
    few, many = (
        ss.forced_response(
            problem(ss.SampledLaw(force=spring, parameters={"k": 0.5}, ports=("x",), samples=n), "x"),
            omega=(9.0, 12.0),
        )
        for n in (4 * 3 + 1, 400)
    )
    assert few.outcome is ss.Outcome.COMPLETED
    np.testing.assert_allclose(few.dataset["truncation"], many.dataset["truncation"], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(few.dataset["amplitude"], many.dataset["amplitude"], rtol=1e-9)


def breaking(at: float) -> ss.SampledLaw:
    """A law that knows nothing of motion beyond a size."""

    def force(x: Any, velocity: Any, k: Any) -> Any:
        if np.max(np.abs(np.real(x))) > at:
            raise ValueError("the table ends")
        return k * x

    return ss.SampledLaw(force=force, parameters={"k": 1.0}, ports=("x",))


@pytest.mark.filterwarnings("ignore:.*not the slope of its force")
def test_a_law_that_fails_on_the_way_leaves_the_points_before() -> None:
    branch = ss.forced_response(problem(breaking(8.0), "x"), omega=(2.0, 9.0))
    assert branch.outcome is ss.Outcome.FAILED
    assert len(branch) > 5
    assert branch.message.startswith("failed: ValueError: the table ends; every point found is kept; the last of ")
    assert float(branch.dataset["amplitude"].max()) < 8.0
    with pytest.raises(ValueError, match="the table ends"):  # no point, nothing to keep
        ss.forced_response(problem(breaking(1e-3), "x"), omega=(2.0, 9.0))


def test_other_roads_stay_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(record, "truncation", fails)
    locus, said = told(lambda: ss.track_peak(problem(), "damper.normal_load", (200.0, 220.0), omega=(6.0, 12.0)))
    assert said.startswith("truncation is not known")
    assert len(locus) > 1
    mode, said = told(lambda: ss.nonlinear_modes(problem(), amplitude=(1.0, 2.0)))
    assert said.startswith("truncation is not known")
    assert len(mode) > 1
    assert np.isfinite(mode.dataset["modal_damping"]).all()
    monkeypatch.setattr(modes_module.ModeSystem, "evaluate", after(5, modes_module.ModeSystem.evaluate))
    with pytest.raises(ZeroDivisionError, match="on purpose"):  # on the way to its first amplitude, where it slips
        ss.nonlinear_modes(problem(), amplitude=(1.0, 2.0))
    monkeypatch.undo()
    monkeypatch.setattr(modes_module.ModeSystem, "evaluate", after(40, modes_module.ModeSystem.evaluate))
    mode, _ = told(lambda: ss.nonlinear_modes(problem(), amplitude=(1.0, 2.0)))
    assert mode.outcome is ss.Outcome.FAILED
    assert "ZeroDivisionError: on purpose" in mode.message


def test_a_curve_stays_where_its_subharmonics_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subharmonics, "subharmonics_of", fails)
    with pytest.warns(ss.SlipstickWarning, match="^motion of twice the period is not known at 1 place"):
        branch = ss.forced_response(problem(), omega=(10.0, 10.5), follow="subharmonic")
    assert len(branch) > 1
    assert branch.subharmonics == ()


CASE = oscillator(head='harmonics = "0..3"\n', rubbing="", response="from = 8.0\nto = 9.0\n").replace("800", "200")


def test_a_run_goes_on_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(record, "truncation", fails)
    (tmp_path / "case.toml").write_text(CASE)
    done = slipstick("run", tmp_path / "case.toml", "-o", tmp_path / "out", "--no-report")
    assert done.exit_code == 0, done.output
    assert "warning: truncation is not known at" in done.output
    data = ss.load(tmp_path / "out" / "results.nc").dataset
    assert np.isnan(data["truncation"]).all()
    assert "truncation is not known at" in data.attrs["warnings"]
