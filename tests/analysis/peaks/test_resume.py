"""A tracked peak taken up at any of its points finds the same points to come, to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.oscillator import damper, one_mass
from helpers.resumption import Heard

import slipstick as ss
from slipstick.analysis.peaks.tracking import TrackedPeak, tracked_peak
from slipstick.analysis.road.checkpoint import Checkpoint
from slipstick.io.journal import unpacked
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def ended() -> TrackedPeak:
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.38]], K=[[40.0]], dofs=["x"])
    contact = ss.FrictionContact(kt=190.0, mu=0.355, normal_load=300.0)
    pair = ss.ContactPair(name="damper", tangential="x", contact=contact, rubbing=ss.RubbingMotion(velocity=4.0))
    problem = ss.Problem(structure, contacts=[pair], loads=ss.Load(dof="x", sin=100.0), harmonics=range(8))
    return tracked_peak(problem, "damper.normal_load", (300.0, 250.0), (2.0, 4.0), (), None, None)


def heated() -> TrackedPeak:
    """With contact states, which are carried from point to point."""
    curve = ss.FrictionCurve(temperature=[25, 2000], mu=[0.3, 0.2])
    thermal = ss.ThermalModel(curve=curve, background=25.0, resistance=0.01)
    problem = one_mass(damper(normal_load=400.0), thermal=thermal)
    return tracked_peak(problem, "damper.normal_load", (400.0, 500.0), (8.0, 12.0), (), None, None)


def of(
    velocity: float, parameter: str, span: tuple[float, float], omega: tuple[float, float], *at: float
) -> TrackedPeak:
    return tracked_peak(oscillator(velocity=velocity), parameter, span, omega, at, None, None)


REQUESTS: dict[str, Callable[[], TrackedPeak]] = {
    "optimum": lambda: of(0.0, "damper.normal_load", (400.0, 600.0), (2.0, 15.0), 450.0),
    "fold and corners": lambda: of(15.0, "damper.velocity", (12.0, 9.2), (3.0, 6.0)),
    "tie, nothing beyond": lambda: of(20.0, "damper.velocity", (20.5, 30.0), (6.0, 12.0)),
    "ties by symmetry and another peak": lambda: of(0.0, "damper.velocity", (0.0, 60.0), (3.0, 12.0)),
    "corners from the start": lambda: of(9.4, "damper.velocity", (9.4, 9.35), (3.0, 6.0), 9.3712),
    "the peak ends": ended,
    "contact states": heated,
}
LONG = {"fold and corners", "the peak ends", "corners from the start", "ties by symmetry and another peak"}


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.verify] if n in LONG else []) for n in REQUESTS])
def test_points_to_come_are_the_same_to_the_last_bit(name: str) -> None:
    request = REQUESTS[name]()
    whole = Heard(request)
    stood: list[Checkpoint] = [request.checkpoint(unpacked(note)) for note in whole.notes]
    cuts = [number for number, point in enumerate(stood, 1) if point.goes_on]
    assert len(cuts) > len(stood) // 2
    most = 8 if name in LONG else 3
    for cut in dict.fromkeys([cuts[k] for k in np.linspace(0, len(cuts) - 1, most).astype(int)]):
        rest = Heard(replace(REQUESTS[name](), checkpoints=stood[:cut]))
        assert rest.points == whole.points[cut:], cut
        assert rest.end == whole.end


@pytest.mark.parametrize(
    "change", [{"y": np.ones(2)}, {"kind": 1, "work": [1]}, {"notes": None}, {"state": np.ones(3)}]
)
def test_a_damaged_checkpoint_is_refused(change: dict[str, Any]) -> None:
    request = REQUESTS["optimum"]()
    plain = unpacked(Heard(request).notes[2])
    with pytest.raises(ss.InputError, match="a checkpoint in the journal is damaged"):
        request.checkpoint(plain | change)
