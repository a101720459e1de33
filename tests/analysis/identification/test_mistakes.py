"""Fits that end far from what was measured: what is said, other starts, and the mistakes that are named."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.analysis.identification.descent import Descent
from slipstick.analysis.identification.fit_request import fit_request
from slipstick.analysis.identification.identification import result_of
from slipstick.analysis.identification.measured import read_measured
from slipstick.analysis.identification.predicted import predictor_of
from slipstick.analysis.identification.search import Scaled, changes, factor_text, round_factors

TRUE = {"damper.kt": 100.0, "damper.mu": 0.3}
START = {"damper.kt": 85.0, "damper.mu": 0.26}
FREQUENCIES = np.linspace(6.0, 12.0, 8)


def problem(**contact: float) -> ss.Problem:
    return one_mass(damper(**({"normal_load": 300.0} | contact)), harmonics=range(6))


@cache
def response() -> np.ndarray:
    c, s = ss.steady_response(problem(), omega=FREQUENCIES).dataset.displacement.values[:, 0, 1:3].T
    return c - 1j * s


def measured(z: np.ndarray, omega: np.ndarray = FREQUENCIES) -> xr.Dataset:
    return xr.Dataset({"displacement": (("omega", "dof"), z[:, None])}, coords={"omega": omega, "dof": ["x"]})


MISTAKES = {
    "conjugated": (lambda z: z.conj(), "conjugated, with", "sign of their phase"),
    "sign": (lambda z: -z, "divided by -1, with", "direction of the sensor"),
    "quarter": (lambda z: 1j * z, "divided by i, with", "sine or a cosine"),
    "millimetres": (lambda z: 1e3 * z, "divided by 1000, with", "units are those of the problem"),
    "peak to peak": (lambda z: 2.0 * z, "divided by 2, with", "peak-to-peak"),
    "accelerations": (lambda z: -(FREQUENCIES**2) * z, "taken for accelerations, with", "displacements are compared"),
    "velocities": (
        lambda z: (1e3j * FREQUENCIES * z).conj(), "conjugated and taken for velocities and divided by 1000", "units",
    ),
}  # fmt: skip


def explained(z: np.ndarray, words: str, hint: str, omega: np.ndarray = FREQUENCIES, names: str = "kt mu") -> None:
    """A fit that is refused, with a sentence that names the mistake and the parameters without it."""
    start = {name: START[name] for name in (f"damper.{each}" for each in names.split())}
    with pytest.warns(ss.SlipstickWarning) as caught:
        found = ss.identify(problem(), measured(z, omega), start)
    assert not found.converged
    assert found.message.startswith(f"the fit ends far from what was measured: misfit {found.misfit:.2g}")
    assert not any(np.isfinite(error) for error in found.standard_errors.values())
    assert found.refused in found.warnings
    assert [str(each.message) for each in caught] == [*found.warnings, found.message]
    (sentence,) = [each for each in found.warnings if each.startswith("the measured numbers fit")]
    assert words in sentence
    assert hint in sentence
    assert ", ".join(f"{name} = {TRUE[name]:g}" for name in start) in sentence
    assert sentence in found.summary()
    assert sentence in found.dataset.attrs["warnings"]


@pytest.mark.verify
@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_mistake_is_named(mistake: str) -> None:
    change, words, hint = MISTAKES[mistake]
    explained(change(response()), words, hint)


@pytest.mark.verify
def test_hertz_taken_for_radians() -> None:
    explained(response(), "frequencies in Hz instead of rad/s", 'attribute units "Hz"', FREQUENCIES / (2.0 * np.pi))


def test_a_conjugated_response_is_refused_and_named() -> None:
    change, words, hint = MISTAKES["conjugated"]
    explained(change(response()), words, hint, names="mu")


@pytest.mark.verify
@pytest.mark.parametrize(
    ("change", "words"),
    [(lambda a, w: 1e3 * a, "divided by 1000, with"), (lambda a, w: a * w, "taken for velocities, with")],
)
def test_a_mistake_in_amplitudes_is_not_taken_for_one_that_comes_near(change, words: str) -> None:
    """Without phases accelerations over 9.81 come within 8 % of displacements in millimetres, of velocities 6 %."""
    omega = np.linspace(6.0, 12.0, 13)
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.6]], K=[[55.0]], dofs=["x"])
    law = ss.FrictionContact(kt=50.0, mu=0.35, normal_load=20.0)
    pair = ss.ContactPair(name="joint", tangential="x", contact=law)
    joint = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=10.0), harmonics=[0, 1, 3])
    amplitude = ss.steady_response(joint, omega=omega).dataset.amplitude.values
    data = xr.Dataset({"amplitude": (("omega", "dof"), change(amplitude, omega[:, None]))})
    with pytest.warns(ss.SlipstickWarning) as caught:
        ss.identify(joint, data.assign_coords(omega=omega, dof=["x"]), {"joint.kt": 35.0, "joint.mu": 0.5})
    (sentence,) = [str(each.message) for each in caught if str(each.message).startswith("the measured numbers fit")]
    assert f"{words} joint.kt = 50, joint.mu = 0.35" in sentence


def test_a_start_far_away_is_left_for_another() -> None:
    """From sticking at all times, where friction has no effect."""
    with pytest.warns(ss.SlipstickWarning, match="16 other starts were compared") as caught:
        found = ss.identify(problem(), measured(response()), {"damper.kt": 600.0, "damper.mu": 2.0})
    assert [*found.values.values()] == pytest.approx([*TRUE.values()], rel=1e-8)
    assert found.converged
    assert "is the result" in str(caught[0].message)


def test_changes_are_undone_exactly() -> None:
    """Numbers with each mistake are among those that are tried as what they are without it."""
    truth = read_measured(problem(), measured(response()))
    for name, (change, *_rest) in MISTAKES.items():
        wrong = read_measured(problem(), measured(change(response())))
        best = np.inf
        for each in changes(wrong, np.arange(1.0, 6.0)):
            scaled = Scaled(predictor_of(problem(), ["damper.mu"], wrong), each.measured)
            left = scaled.scaled(truth.values) - each.measured.values
            if np.array_equal(each.measured.omega, FREQUENCIES):
                best = min(best, float(np.nanmax(np.abs(left))) / np.nanmax(np.abs(each.measured.values)))
        assert best < 1e-12, name


@pytest.mark.parametrize("factor", [None, -2.0, 1.0 - 2.0j])
def test_slopes_of_scaled_predictions_are_exact(factor: complex | None) -> None:
    """Against central differences, with the factor that fits best at each of the parameters."""
    data = read_measured(problem(), measured((0.4 - 0.7j) * response()))
    scaled, p = Scaled(predictor_of(problem(), list(TRUE), data), data, factor), np.array([90.0, 0.33])
    scaled.begin(p)
    scaled.values(p)
    slopes = scaled.slopes(p)
    for k, h in enumerate(1e-5 * p):
        up, down = (scaled.values(p + sign * h * np.eye(2)[k]) for sign in (1.0, -1.0))
        error = np.nanmax(np.abs((up - down) / (2.0 * h) - slopes[k])[..., 1:])
        assert error < 1e-6 * np.nanmax(np.abs(slopes[k]))


def test_round_factors() -> None:
    assert next(round_factors(1.02e3 + 1.0j))[0] == 1e3
    assert next(round_factors(0.98))[0] == 1.0
    assert next(round_factors(-0.97 + 0.02j))[0] == -1.0
    assert not list(round_factors(5.0))
    assert [factor_text(each) for each in (-1.0, 1j, -1j, 1e3, 0.3 - 2.0j)] == ["-1", "i", "-i", "1000", "0.3 - 2 i"]


@pytest.mark.parametrize("value", [np.inf, -1e300, 1e101j])
def test_numbers_that_nothing_measured_are_refused(value: complex) -> None:
    z = response()
    z = np.where(np.arange(z.size) == 3, value, z)
    with pytest.raises(ss.InputError, match=r"displacement: found .* at omega = 8\.57143, dof = x; expected a number"):
        read_measured(problem(), measured(z))


def test_a_missing_number_is_none_of_these() -> None:
    z = response()
    z = np.where(np.arange(z.size) == 3, np.nan, z)
    assert ss.identify(problem(), measured(z), {"damper.mu": START["damper.mu"]}).values["damper.mu"] == pytest.approx(
        TRUE["damper.mu"], rel=1e-6
    )


def test_nothing_but_zeros_is_no_vibration() -> None:
    with pytest.raises(ss.InputError, match="measured numbers are 0"):
        ss.identify(problem(), measured(0.0 * response()), {"damper.mu": 0.3})


def test_a_dof_that_does_not_move_is_told() -> None:
    structure = ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=[[40.0, -5.0], [-5.0, 40.0]], dofs=["x", "y"])
    two = ss.Problem(structure, loads=ss.Load(dof="x", sin=100.0), harmonics=[0, 1])
    values = np.column_stack([response(), 0.0 * response()])
    data = xr.Dataset({"displacement": (("omega", "dof"), values)}, coords={"omega": FREQUENCIES, "dof": ["x", "y"]})
    assert read_measured(two, data).notes == (
        "all that was measured at y is 0: leave it out if its sensor was not connected",
    )


def test_a_misfit_that_is_no_number_is_far_away() -> None:
    """Whatever the search says of its end."""
    request = fit_request(problem(), measured(response()), {"damper.mu": 0.3}, None, None, None, 1, 0)
    end = Descent(request, request.starts[0]).run()
    assert not end.far
    assert end._replace(misfit=np.nan).far
    found = result_of(request, end._replace(misfit=np.nan, cost=np.nan), [np.nan], None, [])
    assert not found.converged
    assert "far from what was measured" in found.message
