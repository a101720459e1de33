"""Harmonics by need: the curve of all harmonics within the accuracy asked for, with fewer of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from helpers.cases import oscillator as oscillator_case
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.analysis.curve.follow import frequency_request
from slipstick.analysis.curve.harmonic_selection import driven_orders, harmonic_ladder
from slipstick.analysis.events import PointFound
from slipstick.analysis.road.checkpoint import resumable

WANTED = tuple(np.linspace(2.5, 14.5, 13))
STEEP = ss.FrictionCurve(temperature=[25, 200, 280, 300, 330, 360, 2000], mu=[0.1, 0.1, 0.1, 0.12, 0.35, 0.4, 0.4])

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def oscillator(velocity: float, highest: int = 15, load: float = 800.0) -> ss.Problem:
    return one_mass(damper(velocity, normal_load=load), harmonics=range(highest + 1))


def blade_like(contacts: int = 6, highest: int = 9) -> ss.Problem:
    """A chain with a contact on each mass that slips and lifts off, one mass also seen from afar."""
    K = (
        np.diag(np.full(contacts + 1, 60.0))
        - np.diag(np.full(contacts, 20.0), 1)
        - np.diag(np.full(contacts, 20.0), -1)
    )
    names = [f"x{i}" for i in range(contacts + 1)]
    structure = ss.MatrixStructure(M=np.eye(contacts + 1), C=0.5 * np.eye(contacts + 1), K=K, dofs=names)
    pairs = [
        ss.ContactPair(
            name=f"c{i}", contact=ss.FrictionContact(kt=40.0, mu=0.3, normal_load=20.0 + 5.0 * i), tangential=f"x{i}",
            rubbing=ss.RubbingMotion(velocity=0.3 * i),
        )
        for i in range(contacts)
    ]  # fmt: skip
    return ss.Problem(structure, contacts=pairs, loads=[ss.Load(dof="x0", sin=60.0)], harmonics=range(highest + 1))


@cache
def with_all(velocity: float) -> ss.Branch:
    return ss.forced_response(oscillator(velocity), omega=(2.0, 15.0), at=WANTED)


@pytest.mark.parametrize("accuracy", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("velocity", [0.0, 10.0, 100.0])
def test_the_curve_of_all_harmonics_within_the_accuracy(velocity: float, accuracy: float) -> None:
    whole = with_all(velocity)
    found = ss.forced_response(whole.problem, omega=(2.0, 15.0), at=WANTED, options={"adapt_harmonics": accuracy})
    assert found.outcome.ok
    amplitudes = [b.dataset.amplitude.to_numpy()[[b.at(w) for w in WANTED], 0] for b in (whole, found)]
    assert np.max(np.abs(amplitudes[1] / amplitudes[0] - 1.0)) < accuracy
    top = [max(b.peaks("x"), key=lambda peak: peak[1]) for b in (whole, found)]
    assert top[1] == pytest.approx(top[0], rel=accuracy)
    used = found.dataset["harmonics_in_use"].to_numpy()
    assert used.min() < 16
    assert used.mean() < (15.9 if accuracy < 1e-3 else 13.0)
    assert np.all(found.dataset.truncation.to_numpy()[used < 16] < accuracy)  # with all there are no more to be had
    assert found.dataset.attrs["adapt_harmonics"] == accuracy
    assert np.all(whole.dataset["harmonics_in_use"] == 16)


def test_coefficients_not_in_use_are_zero_and_forces_are_those_of_the_motion() -> None:
    data = ss.forced_response(oscillator(10.0), omega=(2.0, 15.0), options={"adapt_harmonics": 1e-3}).dataset
    used = data["harmonics_in_use"].to_numpy()
    for name in ("displacement", "friction_force"):
        values = data[name].to_numpy()[:, 0]
        for n, own in zip(used, values, strict=True):
            assert np.all(own[2 * n - 1 :] == 0.0)


def test_several_contacts_need_fewer() -> None:
    problem = blade_like(highest=12)
    whole = ss.forced_response(problem, omega=(2.0, 11.0), at=(5.0, 7.0), options={"max_step": 0.05})
    options = {"max_step": 0.05, "adapt_harmonics": 5e-3}
    found = ss.forced_response(problem, omega=(2.0, 11.0), at=(5.0, 7.0), options=options)
    for w in (5.0, 7.0):
        np.testing.assert_allclose(
            found.dataset.amplitude[found.at(w)], whole.dataset.amplitude[whole.at(w)],
            atol=5e-3 * float(whole.dataset.amplitude[whole.at(w)].max()),
        )  # fmt: skip
    used = found.dataset["harmonics_in_use"].to_numpy()
    assert np.median(used) <= 8
    assert used.min() <= 6
    # the shallowest one stands out by less than the accuracy asked for: it is located, listed or not
    located = [int(np.sum(b.dataset.peak_dof == b.dof_index("x0"))) for b in (found, whole)]
    assert located[0] == located[1] == len(whole.peaks("x0"))


def test_along_a_parameter_and_through_velocity_zero() -> None:
    problem = oscillator(10.0)
    given = {"at": (-5.0, 1.0, 15.0)}
    whole = ss.parameter_response(problem, "damper.velocity", (-10.0, 20.0), omega=6.0, **given)
    found = ss.parameter_response(
        problem, "damper.velocity", (-10.0, 20.0), omega=6.0, options={"adapt_harmonics": 1e-3}, **given
    )
    assert found.outcome.ok
    for value in given["at"]:
        own, other = (b.dataset.displacement.to_numpy()[b.at(value), 0] for b in (found, whole))
        np.testing.assert_allclose(own, other, atol=1e-3 * np.abs(other).max())
    assert found.dataset["harmonics_in_use"].to_numpy().min() < 16


def test_heat_is_handed_on_too() -> None:
    thermal = ss.ThermalModel(curve=STEEP, background=25.0, resistance=0.012)
    problem = replace(oscillator(1900.0, 6, load=100.0), thermal=thermal)
    span = (1900.0, 2400.0)
    whole = ss.parameter_response(problem, "damper.velocity", span, omega=6.0)
    found = ss.parameter_response(problem, "damper.velocity", span, omega=6.0, options={"adapt_harmonics": 1e-3})
    assert found.outcome == whole.outcome
    np.testing.assert_allclose(found.dataset.temperature[-1], whole.dataset.temperature[-1], rtol=1e-3)
    assert ("another one" in found.message) == ("another one" in whole.message)


def test_a_walk_taken_up_again_finds_the_same_points_to_the_last_bit() -> None:
    def task(**more: object):
        return frequency_request(oscillator(10.0), (2.0, 15.0), (5.0,), None, {"adapt_harmonics": 1e-3}, (), None)

    def walked(own):
        heard: list[PointFound] = []
        listen = lambda event: heard.append(event) if isinstance(event, PointFound) else None  # noqa: E731
        for _ in replace(own, listeners=(listen,)).run().follow():
            pass
        return heard

    whole = walked(task())
    checkpoints = [task().checkpoint(e.checkpoint.plain()) for e in whole]
    for cut in (resumable(checkpoints[:k]) for k in (1, len(whole) // 2)):
        rest = walked(replace(task(), checkpoints=checkpoints[:cut]))
        assert len(rest) == len(whole) - cut
        for one, other in zip(rest, whole[cut:], strict=True):
            assert one.point.x.tobytes() == other.point.x.tobytes()
            assert one.values["harmonics_in_use"] == other.values["harmonics_in_use"]
            assert one.values["truncation"] == other.values["truncation"]


def test_too_few_harmonics_for_the_accuracy_are_told() -> None:
    problem = oscillator(10.0, 4)
    with pytest.warns(ss.SlipstickWarning, match=r"more than 0\.1 % at .*keep more harmonics"):
        branch = ss.forced_response(problem, omega=(2.0, 15.0), options={"adapt_harmonics": 1e-3})
    assert branch.dataset["harmonics_in_use"].to_numpy().max() == 5
    assert any("keep more harmonics" in sentence for sentence in branch.warnings)


@pytest.mark.parametrize("value", [0.0, 1.0, -1e-3, "1e-3", True])
def test_what_is_no_accuracy_is_refused(value: object) -> None:
    with raises_fault("options, adapt_harmonics", says="expected a number between 0 and 1"):
        ss.forced_response(oscillator(10.0), omega=(2.0, 15.0), options={"adapt_harmonics": value})


def test_sets_rise_and_hold_what_is_driven() -> None:
    loads = [ss.Load(dof="x", sin=1.0, harmonic=3)]
    problem = one_mass(damper(cos={2: 1.0}), loads=loads, harmonics=[0, 1, 2, 3, 5, 6, 9, 12], period_ratio=(3, 1))
    assert driven_orders(problem) == {1, 3, 6}
    levels = harmonic_ladder(problem)
    assert levels[-1] == problem.harmonics
    assert all({0, 1, 3, 6} <= set(h.orders) for h in levels)
    assert all(set(a.orders) < set(b.orders) for a, b in pairwise(levels))


def test_by_the_case_file(tmp_path) -> None:
    from slipstick.case.case import Case

    text = oscillator_case(
        head='harmonics = "0..15"\n', rubbing="velocity = 10.0", response="from = 2\nto = 15\nadapt_harmonics = 1e-3\n"
    )
    case = Case.from_text(text)
    assert case.options().adapt_harmonics == 1e-3
    assert float(case.run().dataset["harmonics_in_use"].min()) < 16
