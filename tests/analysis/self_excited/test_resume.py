"""Limit cycles taken up at any of their accepted points find the same points to come, to the last bit."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers.resumption import Heard
from helpers.stability import brake

from slipstick.analysis.road.checkpoint import Checkpoint
from slipstick.analysis.self_excited.limit_cycles import SelfExcited, cycles_request
from slipstick.errors import InputError
from slipstick.io.journal import unpacked

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def request() -> SelfExcited:
    return cycles_request(brake(harmonics=4), "pad.mu", (0.4, 0.7), (0.6,), None)


@pytest.fixture(scope="module")
def whole() -> Heard:
    return Heard(request())


def stood(whole: Heard) -> list[Checkpoint]:
    asked = request()
    return [asked.checkpoint(unpacked(note)) for note in whole.notes]


def resumed(whole: Heard, cuts: list[int]) -> None:
    known = stood(whole)
    for cut in cuts:
        rest = Heard(replace(request(), checkpoints=known[:cut]))
        assert rest.points == whole.points[cut:], cut
        assert rest.end == whole.end


def accepted(whole: Heard) -> list[int]:
    cuts = [number for number, point in enumerate(stood(whole), 1) if point.goes_on]
    assert len(cuts) > 4
    return cuts


def test_points_to_come_are_the_same_to_the_last_bit(whole: Heard) -> None:
    cuts = accepted(whole)
    assert {point.part for point in stood(whole)} == {1, 2}
    resumed(whole, [cuts[len(cuts) // 2]])


@pytest.mark.verify
def test_from_every_accepted_point(whole: Heard) -> None:
    resumed(whole, accepted(whole))


def test_a_damaged_checkpoint_is_refused(whole: Heard) -> None:
    plain = unpacked(whole.notes[accepted(whole)[0] - 1])
    with pytest.raises(InputError, match="a checkpoint in the journal is damaged"):
        request().checkpoint(plain | {"place_measure": [1.0]})
