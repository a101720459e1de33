"""How many disturbances grow, counted on the imaginary axis: structures known by receptances alone (THEORY.md (13.8)).

The turns of the phase of ``det D`` versus frequency count its zeros at growing disturbances, less its poles there. A
structure that takes up power at all its ports has no such poles. Where one gives power, dampers in place of the
contacts tell how many poles there are at least.
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
_MOST = 10_000
_WHOLE = 0.1
"""A count that is further from a whole number is none."""


def folded(frequencies: Iterable[float], omega: float) -> Array:
    """Where the frequencies stand between 0 and half the principal one, once the multiples of that are taken off."""
    rest = np.mod(np.asarray(list(frequencies), dtype=float), omega)
    return np.minimum(rest, omega - rest)


_PER_OMEGA = 8
_FAR = 30.0
_DAMPERS = (0.03, 1.0, 30.0)
"""Over the inverse of the largest mobility."""


def count_unstable(form: HarmonicForm, nodes: Array) -> int | None:
    """Growing disturbances of a harmonic form, by frequencies to begin with; None where that is not known.

    Of a structure that grows by itself they are counted from below: 0 is not known to be so.
    """
    net = net_turns(lambda nu: form.sign(1j * nu), nodes)
    if net is None:
        return None
    if not any(form.feeding(1j * nu) for nu in nodes.tolist()):
        return net if net >= 0 else None
    s = np.abs(np.add.outer(nodes, form.orders * form.omega))[:, :, None, None]
    mobility = max(float((w * np.abs(form.answers(1j * nu))).max()) for nu, w in zip(nodes.tolist(), s, strict=True))
    unpaired = 0
    for size in _DAMPERS:
        turns = net_turns(lambda nu, c=size / mobility: form.damped(1j * nu, c), nodes)  # type: ignore[misc]
        unpaired = max(unpaired, 0 if turns is None else -turns)
    return net + unpaired if net + unpaired > 0 else None


def strip(natural: Iterable[float], omega: float) -> Array:
    """Frequencies to begin with where a disturbance is the same at frequencies that are multiples of omega apart."""
    return np.unique(np.concatenate([np.linspace(0.0, 0.5 * omega, FIRST), folded(natural, omega)]))


def axis(natural: Iterable[float], omega: float, highest: int) -> Array:
    """Frequencies to begin with where each harmonic of a disturbance meets a receptance of its own.

    A disturbance whose frequency is shifted by omega is another one then, of another wave number: all frequencies are
    passed, up to where nothing answers any more.
    """
    frequencies = np.asarray(list(natural), dtype=float)
    near = np.abs(np.subtract.outer(frequencies, np.arange(-highest, highest + 1) * omega)).reshape(-1)
    top = highest * omega + 1.5 * max(frequencies.max(initial=0.0), omega)
    inside = np.linspace(0.0, top, int(_PER_OMEGA * top / omega))
    return np.unique(np.concatenate([inside, near, np.geomspace(top, _FAR * top, FIRST)]))


def net_turns(sign: Callable[[float], complex], nodes: Array) -> int | None:
    """Zeros less poles at growing disturbances by ``sign(nu)``, the phase of ``det D(i nu)``; None if unsettled.

    ``nodes`` are frequencies to begin with, among them those at which the phase may turn fast. The steps are halved
    until no phase step is above 60 degrees; a grid twice as fine has to give the same number.
    """
    known: dict[float, complex] = {}

    def at(nu: float) -> complex:
        if nu not in known:
            known[nu] = sign(nu)
        return known[nu]

    before: int | None = None
    finest = 1e-9 * float(nodes[-1])
    while True:
        refined = _refined(at, nodes.tolist(), finest, known)
        if refined is None:
            return None
        turns, nodes = refined
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
