"""How many disturbances grow, counted on the imaginary axis: structures known by receptances alone (THEORY.md (13.8)).

``det D`` has no poles at growing disturbances where the structure itself is stable. The turns of its phase from 0 to
half the principal frequency count its zeros there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import pi

import numpy as np

from slipstick.typing import Array

FIRST = 33
"""Equidistant frequencies that the count begins with."""

_LARGEST_STEP = pi / 3.0
_MOST = 3000
_WHOLE = 0.1
"""A count that is further from a whole number is none."""


def folded(frequencies: Iterable[float], omega: float) -> Array:
    """Where the frequencies stand between 0 and half the principal one, once the multiples of that are taken off."""
    rest = np.mod(np.asarray(list(frequencies), dtype=float), omega)
    return np.minimum(rest, omega - rest)


def count_unstable(sign: Callable[[float], complex], omega: float, near: Iterable[float] = ()) -> int | None:
    """Growing disturbances by ``sign(nu)``, the phase of ``det D(i nu)``; None where the count does not settle.

    ``near`` are frequencies at which the phase may turn fast, such as the folded natural ones. The steps are halved
    until no phase step is above 60 degrees; a grid twice as fine has to give the same number.
    """
    known: dict[float, complex] = {}

    def at(nu: float) -> complex:
        if nu not in known:
            known[nu] = sign(nu)
        return known[nu]

    nodes = np.unique(np.concatenate([np.linspace(0.0, 0.5 * omega, FIRST), np.asarray(list(near), dtype=float)]))
    before: int | None = None
    while True:
        found = _refined(at, nodes.tolist(), 1e-9 * omega, known)
        if found is None:
            return None
        turns, nodes = found
        number = round(-turns / pi)
        if before is not None and number == before:
            whole = number >= 0 and abs(-turns / pi - number) < _WHOLE
            return number if whole else None
        before = number
        nodes = np.sort(np.concatenate([nodes, 0.5 * (nodes[1:] + nodes[:-1])]))


def _refined(
    at: Callable[[float], complex], nodes: list[float], finest: float, known: dict[float, complex]
) -> tuple[float, Array] | None:
    """Change of the phase over the nodes, halved where it turns fast; None beyond all patience or at a zero."""
    turns, out, waiting = 0.0, [nodes[0]], nodes[:0:-1]
    while waiting:
        a, b = out[-1], waiting[-1]
        first, second = at(a), at(b)
        if not (abs(first) > 0.0 and abs(second) > 0.0) or len(known) > _MOST:
            return None
        step = float(np.angle(second / first))
        if abs(step) > _LARGEST_STEP and b - a > finest:
            waiting.append(0.5 * (a + b))
            continue
        turns += step
        out.append(waiting.pop())
    return turns, np.array(out)
