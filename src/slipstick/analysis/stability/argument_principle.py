"""How many disturbances grow, counted on the imaginary axis: structures known by receptances alone (THEORY.md (13.8)).

The turns of the phase of ``det D`` from 0 to half the principal frequency count its zeros at growing disturbances, less
its poles there. A structure that takes up power at all its ports has no such poles. Where one gives power, dampers in
place of the contacts tell how many poles there are at least.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.analysis.stability.harmonic_form import HarmonicForm

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


_DAMPERS = (0.03, 1.0, 30.0)
"""Over the inverse of the largest mobility."""


def count_unstable(form: HarmonicForm, omega: float, near: Iterable[float] = ()) -> int | None:
    """Growing disturbances of a harmonic form; None where that is not known.

    Of a structure that grows by itself they are counted from below: 0 is not known to be so.
    """
    near = list(near)
    net = net_turns(lambda nu: form.sign(1j * nu), omega, near)
    if net is None:
        return None
    nodes = _nodes(omega, near)
    if not any(form.feeding(1j * nu) for nu in nodes.tolist()):
        return net if net >= 0 else None
    s = 1j * np.add.outer(nodes, form.orders * omega)
    mobility = max(
        float(np.abs(w[:, None, None] * form.answers(1j * nu)).max()) for nu, w in zip(nodes, s, strict=True)
    )
    own = 0
    for size in _DAMPERS:
        turns = net_turns(lambda nu, c=size / mobility: form.damped(1j * nu, c), omega, near)  # type: ignore[misc]
        own = max(own, 0 if turns is None else -turns)
    return net + own if net + own > 0 else None


def _nodes(omega: float, near: Iterable[float]) -> Array:
    return np.unique(np.concatenate([np.linspace(0.0, 0.5 * omega, FIRST), np.asarray(list(near), dtype=float)]))


def net_turns(sign: Callable[[float], complex], omega: float, near: Iterable[float] = ()) -> int | None:
    """Zeros less poles at growing disturbances by ``sign(nu)``, the phase of ``det D(i nu)``; None if unsettled.

    ``near`` are frequencies at which the phase may turn fast, such as the folded natural ones. The steps are halved
    until no phase step is above 60 degrees; a grid twice as fine has to give the same number.
    """
    known: dict[float, complex] = {}

    def at(nu: float) -> complex:
        if nu not in known:
            known[nu] = sign(nu)
        return known[nu]

    nodes = _nodes(omega, near)
    before: int | None = None
    while True:
        found = _refined(at, nodes.tolist(), 1e-9 * omega, known)
        if found is None:
            return None
        turns, nodes = found
        number = round(-turns / pi)
        if before is not None and number == before:
            return number if abs(-turns / pi - number) < _WHOLE else None
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
