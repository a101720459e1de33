"""A walk taken up from any of its checkpoints finds the points to come to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.benchmarks import benchmark
from helpers.oscillator import damper, one_mass, opening

import slipstick as ss
from slipstick.analysis.curve.follow import CurveRequest, frequency_request, parameter_request
from slipstick.analysis.road.checkpoint import resumable
from slipstick.errors import InputError
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

PLATE = benchmark("many_contacts")
STEEP = ss.FrictionCurve(temperature=[25, 200, 280, 300, 330, 360, 2000], mu=[0.1, 0.1, 0.1, 0.12, 0.35, 0.4, 0.4])
COARSE = {"max_step": 0.05, "first_step": 0.05}


def heated() -> ss.Problem:
    """Contacts that take another thermal equilibrium on the way."""
    thermal = ss.ThermalModel(curve=STEEP, background=25.0, resistance=0.012)
    return one_mass(damper(1900.0, normal_load=100.0), thermal=thermal)


REQUESTS: dict[str, Callable[[], CurveRequest]] = {
    "frequency": lambda: frequency_request(oscillator(velocity=0.5), (2.0, 15.0), (5.0, 7.5), None, COARSE),
    "two parts": lambda: frequency_request(opening(), (2.0, 10.0), (), None, COARSE),
    "two parts that meet": lambda: frequency_request(opening(), (2.0, 15.0), (), None, COARSE),
    "through velocity 0": lambda: parameter_request(
        oscillator(velocity=10.0), "damper.velocity", (-10.0, 20.0), 6.0, (), None, COARSE
    ),
    "thermal fold": lambda: parameter_request(heated(), "damper.velocity", (1900.0, 2400.0), 6.0, (), None, COARSE),
    "stability": lambda: frequency_request(oscillator(velocity=10.0), (2.5, 6.0), (), None, COARSE, (), None, True),
    "iterative Jacobian": lambda: frequency_request(
        PLATE.problem(*PLATE.plate(5, 2, modes=60)), (1650.0, 1800.0), (), None, {**COARSE, "jacobian": "iterative"}
    ),
    "point limit": lambda: frequency_request(oscillator(velocity=0.5), (2.0, 15.0), (), None, {"max_points": 12}),
}


class Listener:
    """Values and checkpoints of every point, and how it ended."""

    def __init__(self) -> None:
        self.values: list[dict[str, Any]] = []
        self.checkpoints: list[dict[str, Any]] = []
        self.end: dict[str, Any] = {}

    def __call__(self, event: Any) -> None:
        if type(event).__name__ == "PointFound":
            self.values.append(dict(event.values))
            self.checkpoints.append(event.checkpoint.plain())
        elif type(event).__name__ == "Stopped":
            self.end = {k: v for k, v in event.attributes.items() if k != "seconds"}


def walked(request: CurveRequest) -> Listener:
    heard = Listener()
    for _ in replace(request, listeners=(heard,)).run().follow():
        pass
    return heard


@cache
def walked_whole(name: str) -> Listener:
    return walked(REQUESTS[name]())


def same(a: list[dict[str, Any]], b: list[dict[str, Any]]) -> None:
    assert len(a) == len(b)
    for one, other in zip(a, b, strict=True):
        for name in set(one) - {"seconds"}:
            assert bits(one[name]) == bits(other[name]), name


def bits(value: Any) -> Any:
    return value.tobytes() if isinstance(value, np.ndarray) else repr(value)


LONG = {"two parts that meet"}


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.verify] if n in LONG else []) for n in REQUESTS])
def test_points_to_come_are_the_same_to_the_last_bit(name: str) -> None:
    request = REQUESTS[name]()
    whole = walked_whole(name)
    checkpoints = [request.checkpoint(p) for p in whole.checkpoints]
    n, parts = len(checkpoints), [c.part for c in checkpoints]
    cuts = {resumable(checkpoints[:k]) for k in (1, n // 2, n - 1, n, parts.count(1), parts.count(1) + 1)}
    for cut in cuts:
        rest = walked(replace(REQUESTS[name](), checkpoints=checkpoints[:cut]))
        same(rest.values, whole.values[cut:])
        same(rest.checkpoints, whole.checkpoints[cut:])
        assert rest.end == whole.end


def test_the_cases_are_what_they_are_called() -> None:
    assert {c["part"] for c in walked_whole("two parts").checkpoints} == {1, 2}
    assert walked_whole("thermal fold").checkpoints[-1]["jumps"]
    assert walked_whole("point limit").end["outcome"] == "POINT_LIMIT"


@pytest.mark.parametrize(
    "change",
    [
        {"state": np.ones(3)}, {"tangent": None}, {"part": 3}, {"part": "x"}, {"ended": [["NOTHING", ""]]},
        {"state": np.array([np.nan])}, {"place_kind": 1, "place_points": "many"}, {"done": [1, 2]},
        {"place_measure": np.ones(3)}, {"place_measure": np.ones(6)},
    ],
)  # fmt: skip
def test_a_damaged_checkpoint_is_refused(change: dict[str, Any]) -> None:
    request = REQUESTS["point limit"]()
    plain = walked_whole("point limit").checkpoints[3]
    with pytest.raises(InputError, match="a checkpoint in the journal is damaged"):
        request.checkpoint(plain | change)


def test_notes_of_journals_written_before_are_read() -> None:
    """They had the tangent of every point, and said neither the value nor whether a run goes on from there, nor
    measured what varies by its own size: the vibration here is larger than the mean, so that it is measured alike."""
    request, heard = REQUESTS["point limit"](), walked_whole("point limit").checkpoints
    added = ("value", "goes_on")
    before = [{name: value for name, value in plain.items() if name not in added} for plain in heard]
    for plain in before:
        plain.setdefault("tangent", np.zeros(plain["state"].size))
        if "place_measure" in plain:
            plain["place_measure"] = plain["place_measure"][:4]
    same([request.checkpoint(plain).plain() for plain in before], [request.checkpoint(p).plain() for p in heard])
