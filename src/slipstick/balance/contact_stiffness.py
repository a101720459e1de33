"""How hard contacts are beside the body round them: the normal stiffness against what the modes leave out.

Modes alone let the body give nowhere less than they do themselves; what they leave out is mostly the compliance right
at each contact. A contact with ``1/kn`` well below it is as hard as the reduced body can tell.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem

HARD = 0.1
"""1/kn over the compliance left out, below which a contact counts as hard."""

SOFT = 1.0

_ROUNDING = 1e-9
"""Compliance left out, over the whole one, below which there is none."""


def stiffness_shares(problem: Problem) -> tuple[Array, Array]:
    """``1/kn`` over the compliance that the modes leave out along the normal, and that compliance, (n,) each.

    Of the friction contacts with a normal direction and a normal stiffness; empty for structures that are no modes.
    """
    springs = [
        (float(pair.values("kn")[k]), direction)
        for pair in problem.contacts
        if pair.contact.coulomb
        for k in range(len(pair))
        if (direction := pair.direction("normal", k)) and pair.values("kn")[k] > 0.0
    ]
    along = problem.direction_matrix(direction for _, direction in springs) if springs else None
    known = None if along is None else problem.structure.own_compliance(along)
    if known is None:
        return np.empty(0), np.empty(0)
    whole, left_out = known
    there = left_out > _ROUNDING * whole
    kn = np.array([stiffness for stiffness, _ in springs])
    return 1.0 / (kn[there] * left_out[there]), left_out[there]


def stiffness_sentence(problem: Problem) -> str | None:
    """What the normal stiffness is beside the body, and what a hard contact would need; None where nothing tells."""
    shares, left_out = stiffness_shares(problem)
    if not shares.size:
        return None
    low, high = f"{shares.min():.2g}", f"{shares.max():.2g}"
    of = low if low == high else f"{low} to {high}"
    told = f"1/kn is {of} times the compliance that the modes leave out at the contacts"
    unit = problem.units.after("force/length")
    hard = f"a contact is hard from kn = {1.0 / (HARD * left_out.min()):.2g}{unit} on, where that is {HARD:g}"
    if shares.max() <= HARD:
        return f"{told}: much stiffer than the body; a larger kn changes little, but needs more harmonics"
    if shares.max() <= SOFT:
        return f"{told}; {hard}"
    return f"{told}: how far the bodies approach depends on kn; {hard}"
