"""The linear limits of a case: without contact and with every contact stuck."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipstick.analysis.curve.linear import LinearLimit
from slipstick.errors import InputError
from slipstick.results.measures import amplitude
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.ports import Balance
    from slipstick.results.branch import Branch

_MOST, _LEAST = 401, 61
_SECONDS = 2.0
_DOFS, _TOPS, _ROUNDS, _NEARER = 3, 3, 6, 9


def linear_references(
    balance: Balance, omega: tuple[float, float], *, seconds: float = _SECONDS
) -> Iterator[tuple[str, Branch]]:
    """Label and response of each limit over a range of frequencies; a limit that cannot be computed is left out.

    As many frequencies as the seconds allow, structures that are solved anew at each get fewer; the natural ones
    besides, and more about the highest peaks, so that these do not depend on how many there are.
    """
    for state, label in (("free", "without contact"), ("stuck", "stuck")):
        try:
            limit = LinearLimit(balance, state)
            yield label, limit.branch(*_with_peaks(limit, *_over(limit, min(omega), max(omega), seconds)))
        except InputError:
            continue


def _over(limit: LinearLimit, low: float, high: float, seconds: float) -> tuple[Array, Array]:
    """Frequencies and motion over the range, as many as the time they take allows."""
    first = np.linspace(low, high, _LEAST)
    begin = time.perf_counter()
    motion = limit.motion(first)
    count = int(np.clip(_LEAST * seconds / (time.perf_counter() - begin), _LEAST, _MOST))
    known = np.asarray(limit.balance.problem.structure.natural_frequencies, dtype=float)
    more = np.concatenate([np.linspace(low, high, count), known[(known > low) & (known < high)]])
    return _joined(limit, first, motion, more)


def _with_peaks(limit: LinearLimit, w: Array, motion: Array) -> tuple[Array, Array]:
    """More frequencies between the neighbours of the highest peaks of each of the first dofs, nearer and nearer."""
    for _ in range(_ROUNDS):
        sizes = amplitude(limit.balance.problem.harmonics, motion[:, :_DOFS]).value
        tops = {int(at) for own in sizes.T for at in _tops(own)}
        near = [np.linspace(w[max(k - 1, 0)], w[min(k + 1, w.size - 1)], _NEARER) for k in sorted(tops)]
        w, motion = _joined(limit, w, motion, np.concatenate([w[:0], *near]))
    return w, motion


def _tops(size: Array) -> NDArray[np.intp]:
    """Places of the highest local maxima, the ends among them."""
    padded = np.concatenate([[-np.inf], size, [-np.inf]])
    found = np.flatnonzero((size >= padded[:-2]) & (size >= padded[2:]))
    return found[np.argsort(-size[found], kind="stable")[:_TOPS]]


def _joined(limit: LinearLimit, w: Array, motion: Array, more: Array) -> tuple[Array, Array]:
    """Frequencies (n,) and motion with those of further frequencies, in order."""
    new = np.setdiff1d(more, w)
    if not new.size:
        return w, motion
    together = np.concatenate([w, new])
    order = np.argsort(together)
    return together[order], np.concatenate([motion, limit.motion(new)])[order]
