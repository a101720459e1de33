"""The oscillator of Petrov 2012 (Eq. 53) and its exact values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from slipstick.contact.friction import FrictionContact
from slipstick.contact.rubbing import RubbingMotion
from slipstick.structure.matrices import MatrixStructure
from slipstick.trig.harmonics import Harmonics

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem

MASS, DAMPING, STIFFNESS, LOAD = 1.0, 0.4, 40.0, 100.0
TANGENTIAL_STIFFNESS, NORMAL_LOAD, FRICTION = 100.0, 800.0, 0.3
SLIP_OFFSET = -FRICTION * NORMAL_LOAD / STIFFNESS

EXACT_OSCILLATOR: Mapping[tuple[float, float], tuple[float, float]] = {
    (10.0, 4.2): (-4.857841, 4.815035),
    (10.0, 6.0): (-4.733646, 2.753332),
    (1.0, 8.0): (-3.286284, 1.562334),
    (50.0, 5.8): (-5.433751, 10.033222),
    (100.0, 6.1): (-5.528718, 18.236659),
    (0.0, 10.8): (0.0, 3.339879),
}
"""(velocity, omega) -> (mean, amplitude), without harmonic truncation (exact piecewise linear integration)."""


def oscillator(
    *,
    velocity: float = 0.0,
    harmonics: Iterable[int] = range(11),
    load: float = LOAD,
    cos: Mapping[int, float] | None = None,
    normal_load: float = NORMAL_LOAD,
) -> Problem:
    """The oscillator under ``p sin(omega t)`` with a rubbing friction damper under constant normal load."""
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.loads import Load
    from slipstick.balance.problem import Problem

    contact = FrictionContact(kt=TANGENTIAL_STIFFNESS, mu=FRICTION, kn=1.0, gap=-normal_load)
    rubbing = RubbingMotion(velocity=velocity, cos=dict(cos or {}))
    return Problem(
        MatrixStructure(M=[[MASS]], C=[[DAMPING]], K=[[STIFFNESS]], dofs=["x"]),
        contacts=[ContactPair(name="damper", contact=contact, tangential={"x": 1.0}, rubbing=rubbing)],
        loads=[Load(dof="x", harmonic=1, sin=load)],
        harmonics=Harmonics(harmonics),
        title="oscillator with a rubbing friction damper",
        told=None,  # too few harmonics, on purpose in some rows
    )
