"""First points of a plate that lifts off many of its contacts and slips on others at its resonance."""

from __future__ import annotations

import signal
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.benchmarks import benchmark

import slipstick as ss
from slipstick.balance import evaluation, start
from slipstick.balance.balance import Balance
from slipstick.balance.start import FirstPoint, Searching
from slipstick.interrupts import held
from slipstick.structure.residuals import FullModel

PLATE = benchmark("many_contacts")

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


@cache
def structure(residuals: str) -> tuple[ss.ModalStructure, int]:
    """On a hundred contacts."""
    return PLATE.plate(*PLATE.GRIDS[100], modes=60, residuals=residuals)  # type: ignore[no-any-return]


def plate(residuals: str, load: float = 1.0) -> ss.Problem:
    """With the vibrating part of its loads multiplied."""
    problem = PLATE.problem(*structure(residuals))
    loads = [
        ss.Load(shape=one.shape, harmonic=one.harmonic, cos=(load if one.harmonic else 1.0) * one.cos)
        for one in problem.loads
    ]
    return replace(problem, loads=tuple(loads), told=None)


@pytest.fixture
def work(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Evaluations, and products with residuals that are solved for."""
    counts = {"evaluations": 0, "solutions": 0}

    def counted(of: Callable[..., Any], name: str) -> Callable[..., Any]:
        def run(self: Any, *args: Any) -> Any:
            counts[name] += 1
            return of(self, *args)

        return run

    for system in (evaluation.FrequencySystem, evaluation.ParameterSystem):
        monkeypatch.setattr(system, "evaluate", counted(system.evaluate, "evaluations"))
    monkeypatch.setattr(FullModel, "solutions", counted(FullModel.solutions, "solutions"))
    return counts


def first_point(problem: ss.Problem, omega: float) -> np.ndarray:
    x = FirstPoint(Balance(problem), problem.inputs, omega).find()
    assert x is not None
    return x


def from_far(problem: ss.Problem, start: float, stop: float) -> ss.Branch:
    """The curve from where the contacts hardly move."""
    options = {"max_step": 0.3, "first_step": 0.1, "output_step": 1.0}
    branch = ss.forced_response(problem, omega=(start, stop), options=options)
    assert branch.outcome.ok
    assert branch.dataset.attrs["parts"] == 1
    return branch


def same(x: np.ndarray, branch: ss.Branch) -> None:
    expected = branch.guess(-1).ravel()
    assert np.linalg.norm(x - expected) <= 1e-9 * np.linalg.norm(expected)
    states = branch.dataset.isel(point=-1)
    assert float(states.slip_fraction.mean()) > 0.1
    assert float(states.separation_fraction.mean()) > 0.4


def test_a_hundred_contacts_of_which_many_lift_off(work: dict[str, int]) -> None:
    """The load ramp turns back twice: measured by the load alone its folds took 228 evaluations in all, now 87."""
    problem = plate("written")
    x = first_point(problem, 1830.0)
    assert work["evaluations"] <= 130
    same(x, from_far(problem, 1870.0, 1830.0))


def test_the_near_field_alone_finds_the_way(work: dict[str, int]) -> None:
    """Solutions with the full model are only taken at its end."""
    solved, written = (plate(residuals) for residuals in ("solved", "written"))
    work["solutions"] = 0
    x = first_point(solved, 1830.0)
    assert work["solutions"] <= 12
    expected = first_point(written, 1830.0)
    assert np.linalg.norm(x - expected) <= 1e-8 * np.linalg.norm(expected)


def test_a_long_search_tells_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """After every evaluation, were it not for the pause between two; a ramp goes on from 0 to 1."""
    problem, told = plate("written"), list[Searching]()
    monkeypatch.setattr(start, "_PAUSE", 0.0)
    assert FirstPoint(Balance(problem), problem.inputs, 1830.0, searching=told.append).find() is not None
    assert [event.evaluations for event in told] == list(range(1, len(told) + 1))
    ramp = [event for event in told if event.share is not None]
    assert {event.name.rpartition(": ")[2] for event in ramp} == {"load ramp"}
    assert (ramp[0].share, ramp[-1].share) == (0.0, 1.0)
    assert ramp[-1].parts[0] == "load ramp at 100 %"
    assert told[-1].residual < 1e-10
    assert told[0].residual > 1e-3


def test_a_search_is_interrupted_between_two_evaluations(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, told = plate("written"), list[int]()

    def stop(event: Searching) -> None:
        told.append(event.evaluations)
        signal.raise_signal(signal.SIGINT)

    def search() -> None:
        with held():
            FirstPoint(Balance(problem), problem.inputs, 1830.0, searching=stop).find()

    monkeypatch.setattr(start, "_PAUSE", 0.0)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # tests in the background ignore it
    try:
        with pytest.raises(KeyboardInterrupt):
            search()
    finally:
        signal.signal(signal.SIGINT, before)
    assert told == [1]


@pytest.mark.verify
@pytest.mark.parametrize(
    "load, far, frequencies",
    [(1.0, 1900.0, (1840.0, 1820.0, 1810.0, 1800.0)), (3.0, 1950.0, (1880.0, 1840.0, 1800.0, 1780.0))],
)
def test_first_points_over_the_resonance(
    load: float, far: float, frequencies: tuple[float, ...], work: dict[str, int]
) -> None:
    problem = plate("solved", load)
    for omega in frequencies:
        work["evaluations"] = work["solutions"] = 0
        x = first_point(problem, omega)
        assert work["evaluations"] <= 200
        assert work["solutions"] <= 20
        same(x, from_far(problem, far, omega))
