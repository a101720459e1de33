"""Stability of a travelling wave by wave numbers against the whole ring, which knows nothing of them."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
from helpers.rings import pairs, wave_problem, whole_ring

import slipstick as ss
from slipstick.analysis.stability.floquet import StabilityWatch
from slipstick.analysis.stability.wave_numbers import WaveDisturbances, wave_answers
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.balance.physics_checks import problem_warnings
from slipstick.results.stability import WAVE_COUNT

STUCK, SLIPPING, SEPARATING = 0.05 - 0.3j, 1 - 6j, 2 - 14j
CASES = [
    pytest.param(6, 2, STUCK, 0.0, id="stuck"),
    pytest.param(6, 2, SLIPPING, 0.3, id="slipping"),
    pytest.param(6, -1, SEPARATING, 0.3, id="separating"),
    pytest.param(6, 3, SLIPPING, 0.3, id="standing"),
    pytest.param(12, 4, STUCK, 0.0, id="N = 12, stuck", marks=pytest.mark.verify),
    pytest.param(12, 4, SLIPPING, 0.3, id="N = 12", marks=pytest.mark.verify),
    pytest.param(12, 7, SEPARATING, 0.0, id="N = 12, backward", marks=pytest.mark.verify),
]

SLOW = [CASES[0], *(pytest.param(*case.values, id=case.id, marks=pytest.mark.verify) for case in CASES[1:])]


def judged(problem: ss.Problem, omega: float) -> tuple[Any, Any, StabilityWatch, Balance]:
    """A solution, its evaluation, and what judges it."""
    balance = Balance(problem)
    x = ss.steady_response(problem, omega=[omega]).guess(0).reshape(-1)
    detail = FrequencySystem(balance, problem.inputs).evaluate(x, omega).detail
    return x, detail, StabilityWatch(balance), balance


@pytest.mark.parametrize(("sectors", "engine_order", "force", "velocity"), CASES)
def test_determinants_of_all_wave_numbers_are_that_of_the_ring(
    sectors: int, engine_order: int, force: complex, velocity: float
) -> None:
    """At any exponent (24.7); undamped but for viscous damping, so that both have the same equations in time."""
    given = sectors, engine_order, pairs(proportional=False), force, velocity
    x, detail, watch, balance = judged(wave_problem(*given, loss=0.0), 7.9)
    disturbances = WaveDisturbances(watch.form(x, detail), balance.receptance, 0.0)
    ring_x, ring_detail, ring_watch, _ = judged(whole_ring(*given, loss=0.0), 7.9)
    ring = ring_watch.form(ring_x, ring_detail)
    for exponent in (0.3j, 0.1 + 1.7j, 0.4 - 2.2j):
        phase, size = np.linalg.slogdet(ring.matrix(exponent))
        each = [np.linalg.slogdet(disturbances.matrices(k, np.array([exponent]))) for k in range(sectors)]
        assert sum(own[1][0] for own in each) == pytest.approx(size, abs=1e-8)
        assert abs(np.prod([own[0][0] for own in each]) - phase) < 1e-8
    with_one = [np.linalg.det(disturbances.matrices(k, np.array([0.1 + 1.7j]))[0]) for k in (1, sectors - 1)]
    other = np.linalg.det(disturbances.matrices(1, np.array([0.1 - 1.7j]))[0])
    assert with_one[1] == pytest.approx(other.conjugate(), rel=1e-9)


@pytest.mark.parametrize(("sectors", "engine_order", "force", "velocity"), SLOW)
def test_multipliers_of_the_ring_are_those_of_some_wave_number(
    sectors: int, engine_order: int, force: complex, velocity: float
) -> None:
    """Those of exact pieces in time of the whole ring; the harmonic form is as good as its harmonics (0..9)."""
    given = sectors, engine_order, pairs(proportional=False), force, velocity
    x, detail, watch, balance = judged(wave_problem(*given, loss=0.0, orders=10), 7.9)
    form, period = watch.form(x, detail), 2.0 * np.pi / 7.9
    ring_x, ring_detail, ring_watch, _ = judged(whole_ring(*given, loss=0.0, orders=10), 7.9)
    exact = ring_watch.at(ring_x, ring_detail)
    largest = exact.multipliers[np.abs(exact.multipliers) > 0.5]
    assert largest.size >= sectors
    worst = _furthest(form, balance.receptance, sectors, period, largest)
    assert worst < (1e-9 if force == STUCK and not velocity else 0.02)


def _furthest(form: Any, receptance: Any, sectors: int, period: float, multipliers: Any) -> float:
    """How far the worst of some multipliers is from the nearest one of all wave numbers."""
    forms, worst = [_at(form, receptance, k) for k in range(sectors)], 0.0
    for multiplier in multipliers:
        found = [own.exponent(np.log(multiplier) / period) for own in forms]
        worst = max(worst, min(abs(np.exp(e * period) - multiplier) for e in found if e is not None))
    return worst


def _at(form: Any, receptance: Any, k: int) -> Any:
    from dataclasses import replace

    return replace(form, answers=wave_answers(receptance, form.orders, form.omega, k))


@pytest.mark.parametrize(("sectors", "engine_order", "force", "velocity"), CASES)
def test_a_stable_ring_is_a_stable_wave(sectors: int, engine_order: int, force: complex, velocity: float) -> None:
    """Both say so."""
    given = sectors, engine_order, pairs(proportional=False), force, velocity
    for problem in (wave_problem(*given), whole_ring(*given)):
        x, detail, watch, _ = judged(problem, 7.9)
        found = watch.at(x, detail)
        assert found.unstable == 0
        assert (found.method == WAVE_COUNT) == (problem.structure.dofs[1] == "left")


FED = pytest.mark.filterwarnings("ignore:the structure's damping feeds energy in")


@FED
@pytest.mark.parametrize(
    ("sectors", "engine_order", "number", "force", "fed", "about", "expected"),
    [
        (6, 2, 1, STUCK, 10.0, 9.0, 2), (6, 2, 1, STUCK, 20.0, 9.0, 2), (6, 2, 2, SLIPPING, 20.0, 9.0, 0),
        (6, 2, 2, SLIPPING, 40.0, 9.0, 2), (6, 2, 5, SLIPPING, 40.0, 9.0, 2),
        pytest.param(12, 4, 1, STUCK, 10.0, 9.0, 2, marks=pytest.mark.verify),
        pytest.param(12, 4, 9, STUCK, 20.0, 9.0, 2, marks=pytest.mark.verify),
        pytest.param(12, 4, 5, SLIPPING, 20.0, 16.7, 0, marks=pytest.mark.verify),
        pytest.param(12, 4, 5, SLIPPING, 40.0, 16.7, 2, marks=pytest.mark.verify),
    ],
)  # fmt: skip
def test_a_nodal_diameter_that_the_gas_feeds(
    sectors: int, engine_order: int, number: int, force: complex, fed: float, about: float, expected: int
) -> None:
    """One of all waves, forward or backward: the count is that of the ring in time, its gas as at ``about``, rad/s."""
    plain = wave_problem(sectors, engine_order, pairs(proportional=False), force, 0.0)
    kappa = np.full(sectors, 0.5j)
    kappa[number] = -1j * fed
    sector = plain.structure.sector.with_aerodynamics(kappa, np.diag([1.0, 0.0, 0.0]))  # type: ignore[attr-defined]
    problem = ss.Problem(
        sector.travelling_wave(engine_order), contacts=plain.contacts, loads=plain.loads, harmonics=plain.harmonics
    )
    assert any(f"nodal diameter {min(number, sectors - number)})" in sentence for sentence in problem_warnings(problem))
    x, detail, watch, _ = judged(problem, 7.9)
    found = watch.at(x, detail)
    ring_x, ring_detail, _, balance = judged(sector.mistuned().problem(problem), 7.9)
    exact = StabilityWatch(balance, damping_at=about).at(ring_x, ring_detail)
    assert found.unstable == exact.unstable == expected
    if expected:
        # frequency and wave number are told apart from the next one's by omega and the engine order
        assert 0 in ((found.wave_number - number) % engine_order, (found.wave_number + number) % engine_order)


@FED
@pytest.mark.parametrize(
    ("sectors", "engine_order", "fed", "grows"),
    [
        (6, 2, 0.0, False), (6, 2, 0.45, True), (6, 2, 1.2, True),
        pytest.param(12, 4, 0.0, False, marks=pytest.mark.verify),
        pytest.param(12, 4, 0.45, True, marks=pytest.mark.verify),
        pytest.param(12, 4, 1.2, True, marks=pytest.mark.verify),
    ],
)  # fmt: skip
def test_viscous_damping_below_zero_in_some_nodal_diameters(
    sectors: int, engine_order: int, fed: float, grows: bool
) -> None:
    """Coupled to the neighbours: the same equations for both; what grows is found from all wave numbers."""
    matrices = pairs(proportional=False)
    C0, C1 = matrices["C"]
    matrices["C"] = C0 - 0.8 * fed * np.eye(3), C1 + 0.6 * fed * np.eye(3)
    given = sectors, engine_order, matrices, SLIPPING, 0.3
    wave, ring = wave_problem(*given, loss=0.0), whole_ring(*given, loss=0.0)
    x, detail, watch, balance = judged(wave, 7.9)
    ring_x, ring_detail, ring_watch, _ = judged(ring, 7.9)
    exact, found = ring_watch.at(ring_x, ring_detail), watch.at(x, detail)
    assert found.unstable == exact.unstable
    assert (exact.unstable > 0) == grows
    growing = exact.multipliers[np.abs(exact.multipliers) > 1.0]
    assert growing.size >= exact.unstable
    assert _furthest(watch.form(x, detail), balance.receptance, sectors, 2.0 * np.pi / 7.9, growing) < 0.03


@FED
def test_a_wave_loses_its_symmetry_along_a_branch() -> None:
    """Where its shroud slips friction holds the nodal diameter that the gas feeds; below that the wave is lost.

    The count of the whole ring in time agrees on both sides.
    """
    plain = wave_problem(6, 2, pairs(proportional=False), SLIPPING, 0.0)
    kappa = np.full(6, 0.5j)
    kappa[1] = -10.0j
    sector = plain.structure.sector.with_aerodynamics(kappa, np.diag([1.0, 0.0, 0.0]))  # type: ignore[attr-defined]
    problem = ss.Problem(
        sector.travelling_wave(2), contacts=plain.contacts, loads=plain.loads, harmonics=plain.harmonics
    )
    with pytest.warns(ss.SlipstickWarning) as told:
        branch = ss.parameter_response(problem, "load", (0.32, 0.2), omega=7.9, stability=True)
    data = branch.dataset
    assert set(data.stability_method.values.tolist()) == {"count by wave number"}
    assert int(data.unstable_multipliers[0]) == 0
    assert int(data.unstable_multipliers[-1]) == 2
    assert int(data.wave_number[0]) == -1
    assert int(data.wave_number[-1]) % 2 == 1
    lost = [str(one.message) for one in told if "loses its symmetry" in str(one.message)]
    assert len(lost) == 1
    (point,) = [point for point in branch.bifurcations() if point.kind == "symmetry breaking"]
    assert (point.before, point.after) == (0, 2)
    assert 0.2 < point.value < 0.32
    for load, expected in ((1.003 * point.value, 0), (0.997 * point.value, 2)):
        given = problem.with_parameter("load", load)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ss.SlipstickWarning)  # the loss is told where it is
            near = ss.steady_response(given, omega=[7.9], guess=branch.guess(point.point), stability=True)
        assert int(near.dataset.unstable_multipliers[0]) == expected
    for load in (0.32, 0.2):
        ring = sector.mistuned().problem(problem.with_parameter("load", load))
        x, detail, _, balance = judged(ring, 7.9)
        count = StabilityWatch(balance, damping_at=9.0).at(x, detail).unstable
        assert count == int(data.unstable_multipliers[branch.at(load)])
