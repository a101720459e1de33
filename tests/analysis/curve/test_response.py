"""Response curves of the oscillator: published numbers, located peaks, requested points, units, parameters."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.oscillator import oscillator as rubbed
from helpers.results import corrected

import slipstick as ss
from slipstick.analysis.curve.response import follow, response_options
from slipstick.analysis.events import PointFound, Searching, Started, Stopped, StrategyTried


def oscillator(
    velocity: float = 0.0,
    a: float = 0.0,
    p: float = 100.0,
    orders: Any = range(11),
    length: float = 1.0,
    time: float = 1.0,
) -> ss.Problem:
    """The oscillator of the paper; ``length`` and ``time`` are the sizes of the units, stiffness keeps its number."""
    structure = ss.MatrixStructure(M=[[time**2]], C=[[0.4 * time]], K=[[40.0]], dofs=["x"])
    pair = ss.ContactPair(
        name="damper",
        contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0 * length),
        tangential="x",
        rubbing=ss.RubbingMotion(velocity=velocity * length / time, cos={1: a * length}),
    )
    loads = [ss.Load(dof="x", sin=p * length)]
    return ss.Problem(structure, contacts=[pair], loads=loads, harmonics=ss.Harmonics(orders))


def curve(omega: tuple[float, float] = (2.0, 15.0), **given: Any) -> ss.Branch:
    return ss.forced_response(oscillator(**given), omega=omega)


def test_the_range_by_position_is_that_by_name() -> None:
    by_position, by_name = (
        ss.forced_response(oscillator(), (5.0, 6.0)),
        ss.forced_response(oscillator(), omega=(5.0, 6.0)),
    )
    np.testing.assert_array_equal(by_position.dataset.amplitude, by_name.dataset.amplitude)
    assert ss.linear_response(oscillator(), [5.0]).dataset.omega.values == [5.0]


@pytest.mark.parametrize("velocity, a, p, wanted", [
    (0, 0, 100, (10.78, 3.340)), (1, 0, 100, (10.78, 3.362)), (10, 0, 100, (4.25, 4.820)), (10, 0, 100, (9.84, 3.675)),
    (50, 0, 100, (5.82, 10.034)), (100, 0, 100, (6.14, 18.249)), (250, 0, 100, (6.3182, 39.548)),
    (10, 2, 100, (9.33, 6.148)), (0, 1, 0, (10.63, 3.513)), (0, 2, 0, (9.85, 4.661)),
])  # fmt: skip
def test_published_peaks(velocity: float, a: float, p: float, wanted: tuple[float, float]) -> None:
    """Amplitudes within 0.1 %; the frequencies were tabulated from a grid of 0.05 rad/s."""
    branch = curve(velocity=velocity, a=a, p=p)
    assert branch.outcome is ss.Outcome.COMPLETED
    near = [peak for peak in branch.peaks("x") if abs(peak[0] - wanted[0]) < 0.05]
    assert len(near) == 1
    assert near[0][1] == pytest.approx(wanted[1], rel=1e-3)


@pytest.mark.parametrize("velocity, omega, mean, size", [
    (10, 4.2, -4.857841, 4.815035), (10, 6.0, -4.733646, 2.753332), (1, 8.0, -3.286284, 1.562334),
    (50, 5.8, -5.433751, 10.033222), (100, 6.1, -5.528718, 18.236659), (0, 10.8, 0.0, 3.339879),
])  # fmt: skip
def test_exact_values_at_requested_frequencies(velocity: float, omega: float, mean: float, size: float) -> None:
    branch = ss.forced_response(oscillator(velocity=velocity), omega=(2.0, 15.0), at=[omega, 3.0])
    point = branch.dataset.isel(point=branch.at(omega))
    assert float(point["omega"]) == omega
    assert str(point["kind"].values) == "requested"
    assert float(point["mean"][0]) == pytest.approx(mean, rel=1e-3, abs=1e-9)
    assert float(point["amplitude"][0]) == pytest.approx(size, rel=1e-3)
    assert 3.0 in branch.dataset["omega"].to_numpy()


def test_points_wanted_are_exact_where_solutions_are_refined(monkeypatch) -> None:
    """As of 250 unknowns and more: a solution by refinement keeps the frequency to its error alone."""
    monkeypatch.setattr("slipstick.solve.linear.dense.REFINED_FROM", 2)
    wanted = [3.0, 4.2, 5.8, 6.1, 8.0]
    branch = ss.forced_response(oscillator(velocity=10), omega=(2.0, 15.0), at=wanted)
    assert set(wanted) <= set(branch.dataset.omega.values.tolist())


@pytest.mark.parametrize("velocity", [0.0, 10.0, 100.0])
def test_peaks_are_located_to_a_millionth(velocity: float) -> None:
    branch = curve(velocity=velocity)
    for omega, size in branch.peaks():
        # a parabola through points solved on their own, wide enough that rounding of the amplitude does not show
        step = 1e-3 * omega
        around = omega + step * np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
        fine = ss.forced_response(oscillator(velocity=velocity), omega=(around[0], around[-1]), at=around[1:-1])
        at = [float(fine.dataset["amplitude"][fine.at(w), 0]) for w in around]
        quartic = np.polynomial.Polynomial.fit(around - omega, at, 4)
        roots = quartic.deriv().roots()
        top = min((abs(r) for r in roots if abs(r.imag) < 1e-12), default=np.inf)
        assert top < 1e-6 * omega
        assert size == pytest.approx(float(quartic(0.0)), rel=1e-8)


def test_friction_offset_and_its_lack() -> None:
    fast = curve(velocity=250).dataset
    assert fast["mean"].to_numpy() == pytest.approx(-6.0, abs=1e-9)
    assert fast["stick_fraction"].to_numpy().max() == 0.0
    assert np.abs(curve(velocity=0).dataset["mean"].to_numpy()).max() < 1e-9
    assert np.abs(curve(a=5.0, p=0.0).dataset["mean"].to_numpy()).max() < 1e-9
    slow = ss.forced_response(oscillator(velocity=1), omega=(1.5, 2.0))
    assert float(slow.dataset["mean"][0, 0]) == pytest.approx(-5.04, rel=1e-3)


def test_just_below_the_threshold_there_is_one_stick_interval() -> None:
    at = np.sqrt(40.0)
    branch = ss.forced_response(oscillator(velocity=249.9), omega=(6.0, 7.0), at=[at])
    (states,) = branch.contact_forces(branch.at(at)).states
    assert [name for *_, name in states].count("stick") == 1


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_no_friction_gives_the_linear_curve() -> None:
    problem = oscillator(velocity=10).with_parameter("damper.mu", 0.0)
    branch = ss.forced_response(problem, omega=(2.0, 15.0))
    found = corrected(branch.dataset)
    linear = ss.linear_response(problem, omega=found["omega"].to_numpy())
    assert found["amplitude"].to_numpy() == pytest.approx(linear.dataset["amplitude"].to_numpy(), rel=1e-8)
    assert branch.peaks()[0][0] == pytest.approx(np.sqrt(40.0 - 0.08), rel=1e-8)


@pytest.mark.parametrize("length, time", [(1e3, 1.0), (1e-6, 1.0), (1.0, 1e3), (1e6, 1e-3)])
@pytest.mark.parametrize("velocity", [0.0, 10.0])
def test_units_do_not_matter(velocity: float, length: float, time: float) -> None:
    """The same problem in other units of length and time takes the same steps to the same curve."""
    plain = curve(velocity=velocity).dataset
    other = curve(velocity=velocity, length=length, time=time, omega=(2.0 / time, 15.0 / time)).dataset
    assert other.sizes["point"] == plain.sizes["point"]
    assert other["omega"].to_numpy() * time == pytest.approx(plain["omega"].to_numpy(), rel=1e-6)
    assert other["amplitude"].to_numpy() / length == pytest.approx(plain["amplitude"].to_numpy(), rel=1e-6)
    assert corrected(other)["residual"].to_numpy().max() < 1e-8


def test_backwards_gives_the_same_peaks() -> None:
    up, down = curve(velocity=10).peaks(), curve(velocity=10, omega=(15.0, 2.0)).peaks()
    assert np.array(down[::-1]) == pytest.approx(np.array(up), rel=1e-7)


@pytest.mark.parametrize("name, span", [("damper.velocity", (0.5, 300.0)), ("damper.normal_load", (10.0, 2000.0)),
                                        ("damper.mu", (0.01, 1.0)), ("damper.kt", (20.0, 500.0)), ("load", (0.5, 3.0)),
                                        ("friction", (2.0, 0.1)), ("damper.kn", (2.0, 0.2)),
                                        ("damper.gap", (-100.0, -1000.0))])  # fmt: skip
def test_parameter_curves_meet_frequency_curves(name: str, span: tuple[float, float]) -> None:
    middle = 0.5 * (span[0] + span[1])
    problem = oscillator(velocity=10)
    branch = ss.parameter_response(problem, name, span, omega=5.0, at=[middle])
    assert branch.outcome is ss.Outcome.COMPLETED
    across = ss.forced_response(problem.with_parameter(name, middle), omega=(4.9, 5.0))
    found = branch.dataset.isel(point=branch.at(middle))
    assert float(found["parameter"]) == middle
    assert float(found["amplitude"][0]) == pytest.approx(float(across.dataset["amplitude"][-1, 0]), rel=1e-8)


def test_least_amplitude_needs_more_load_than_most_dissipation() -> None:
    """Without rubbing, at a frequency between the free and the stuck resonance."""
    branch = ss.parameter_response(oscillator(), "damper.normal_load", (1.0, 4000.0), omega=9.0)
    load = branch.dataset["parameter"].to_numpy()
    least = load[np.argmin(branch.dataset["amplitude"].to_numpy()[:, 0])]
    most = load[np.argmax(branch.dataset["dissipated_power"].to_numpy()[:, 0])]
    assert least > most


def test_events_and_generator() -> None:
    told: list[Any] = []
    branch = ss.forced_response(oscillator(velocity=10), omega=(3.0, 5.0), listeners=[told.append])
    kinds = [type(event) for event in told if not isinstance(event, Searching)]  # told where that took long
    assert (kinds[0], kinds[1], kinds[-1]) == (Started, StrategyTried, Stopped)
    points = [event for event in told if isinstance(event, PointFound)]
    assert len(points) == len(branch) == told[-1].points
    assert [event.progress for event in points][-1] == 1.0
    for event, amplitude in zip(points, branch.dataset["amplitude"].to_numpy(), strict=True):
        assert event.values["amplitude"] == pytest.approx(amplitude, rel=1e-13)
    walk = follow(oscillator(velocity=10), omega=(3.0, 5.0))
    assert next(walk).omega == 3.0
    walk.close()


@pytest.mark.parametrize("velocity", [0.0, 10.0])
def test_time_integration_leads_to_a_first_point(velocity: float) -> None:
    """The last rung of the ladder: where the motion settles is a guess that Newton's method accepts."""
    from slipstick.analysis.curve.follow import frequency_request, settled_in_time

    request = frequency_request(oscillator(velocity=velocity), (5.0, 6.0))
    motion = settled_in_time(request)
    assert motion is not None
    branch = ss.forced_response(oscillator(velocity=velocity), omega=(5.0, 6.0), guess=motion)
    first = branch.dataset["contact_tangential"].to_numpy()[0].ravel()
    assert motion == pytest.approx(first, abs=5e-3 * np.linalg.norm(first))


def test_stopping_early_keeps_what_was_found() -> None:
    options = response_options(max_points=10)
    branch = ss.forced_response(oscillator(velocity=10), omega=(2.0, 15.0), options=options)
    assert branch.outcome is ss.Outcome.POINT_LIMIT
    assert len(branch) >= 10

    def interrupt(event: Any) -> None:
        if isinstance(event, PointFound) and event.number == 5:
            raise KeyboardInterrupt

    branch = ss.forced_response(oscillator(velocity=10), omega=(2.0, 15.0), listeners=[interrupt])
    assert branch.outcome is ss.Outcome.INTERRUPTED
    assert len(branch) >= 4


@pytest.mark.parametrize(
    "given, words",
    [({"peaks_of": "y"}, "not among the outputs"), ({"omega": (5.0, 5.0)}, "empty"), ({"at": [7.0]}, "outside")],
)
def test_bad_requests(given: dict[str, Any], words: str) -> None:
    with pytest.raises(ss.InputError, match=words):
        ss.forced_response(oscillator(), **({"omega": (2.0, 3.0)} | given))


def test_a_swept_velocity_is_at_each_frequency_the_constant_one() -> None:
    """The curve goes through the points of constant velocities, in time too, and its velocity is in the results."""

    swept = ss.forced_response(
        rubbed(harmonics=8, velocity=1.0, velocity_per_omega=2.0), omega=(3.5, 6.0), at=[4.0, 5.0]
    )
    assert swept.outcome is ss.Outcome.COMPLETED
    omega = np.asarray(swept.dataset["omega"])
    np.testing.assert_allclose(swept.dataset["rubbing_velocity"].values[:, 0], 1.0 + 2.0 * omega, rtol=1e-14)
    for w in (4.0, 5.0):
        constant = ss.forced_response(rubbed(harmonics=8, velocity=1.0 + 2.0 * w), omega=(w, w + 0.1), at=[w])
        for name in ("displacement", "dissipated_power", "stick_fraction"):
            found = swept.dataset[name].values[swept.at(w)]
            np.testing.assert_allclose(found, constant.dataset[name].values[constant.at(w)], rtol=1e-6, atol=1e-9)
    assert swept.check_in_time(swept.at(4.0)).relative_difference < 0.02


def test_a_static_load_hides_no_error_of_the_vibration():
    """It only shifts the mean of a contact under constant normal load: interpolated points stay as near as without."""
    moved = oscillator(velocity=10.0)
    moved = replace(moved, loads=[*moved.loads, ss.Load(dof="x", harmonic=0, cos=1e5)], told=None)
    data = ss.forced_response(moved, omega=(8.0, 12.0)).dataset
    between = np.flatnonzero(data.kind.values == "interpolated")
    assert between.size > 10
    exact = ss.forced_response(oscillator(velocity=10.0), omega=(8.0, 12.0), at=data.omega.values[between])
    at = [exact.at(w) for w in data.omega.values[between]]
    wanted = exact.dataset.displacement.values[at, 0, 1:]
    off = np.linalg.norm(data.displacement.values[between, 0, 1:] - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
    assert off.max() < 4e-4
