"""A nonlinear mode taken up at any of its accepted points finds the same points to come, to the last bit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.resumption import Heard

import slipstick as ss
from slipstick.analysis.modes.nonlinear_modes import ModeRequest, mode_request
from slipstick.io.journal import unpacked

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def request() -> ModeRequest:
    structure = ss.MatrixStructure(
        M=np.eye(2), C=0.02 * np.eye(2), K=[[40.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"]
    )  # fmt: skip
    contact = ss.FrictionContact(kt=10.0, mu=0.3, normal_load=10.0)
    problem = ss.Problem(
        structure, contacts=ss.ContactPair(name="damper", tangential="x", contact=contact),
        loads=ss.Load(dof="x", sin=1.0), harmonics=range(6),
    )  # fmt: skip
    return mode_request(problem, (0.5, 6.0), dof="y", load_factors=[0.5])


@pytest.fixture(scope="module")
def whole() -> Heard:
    return Heard(request())


def resumed(whole: Heard, cuts: list[int]) -> None:
    asked = request()
    stood = [asked.checkpoint(unpacked(note)) for note in whole.notes]
    assert all(stood[cut - 1].goes_on for cut in cuts)
    for cut in cuts:
        rest = Heard(replace(request(), checkpoints=stood[:cut]))
        assert rest.points == whole.points[cut:], cut
        assert rest.end == whole.end


def accepted(whole: Heard) -> list[int]:
    asked = request()
    kept = [asked.checkpoint(unpacked(note)).goes_on for note in whole.notes]
    assert not kept[-1]  # the last amplitude is met exactly, anew
    return [number for number, goes_on in enumerate(kept, 1) if goes_on]


def test_points_to_come_are_the_same_to_the_last_bit(whole: Heard) -> None:
    cuts = accepted(whole)
    assert len(cuts) < len(whole.points) - 1  # corrected points between are no places to go on from
    resumed(whole, [cuts[1], cuts[-2]])


@pytest.mark.verify
def test_from_every_accepted_point(whole: Heard) -> None:
    resumed(whole, accepted(whole))


@pytest.mark.parametrize("change", [{"begin": None}, {"work": [1, 2]}, {"state": np.ones(3)}])
def test_a_damaged_checkpoint_is_refused(whole: Heard, change: dict[str, Any]) -> None:
    with pytest.raises(ss.InputError, match="a checkpoint in the journal is damaged"):
        request().checkpoint(unpacked(whole.notes[0]) | change)
