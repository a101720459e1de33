"""A linear system carried through intervals in which it does not change: matrix exponentials times a matrix.

The exponential is never made: its Taylor series acts on the matrix, in steps so short that no digits are lost
[Al-Mohy, Higham, SIAM J. Sci. Comput. 33 (2011) 488].
"""

from __future__ import annotations

import numpy as np

from slipstick.trig.compiled import compiled
from slipstick.typing import Array, IntArray

REACH = 5.0
"""Bound on rate times length of a step."""

_SMALL = 1e-13
_TERMS = 60


@compiled(allocates=True, nogil=True)
def propagate(
    Phi: Array, scale: float, forces: Array, rates: Array, which: IntArray, lengths: Array, targets: IntArray,
    starts: Array,
) -> None:  # fmt: skip
    """Carry ``Phi`` (2 r + n, m) through intervals, in place.

    ``forces`` (k, r, 2 r + n) and ``rates`` (k,) are those of the combinations, ``which`` and ``lengths`` (time) the
    intervals. After interval i row ``2 r + targets[i]`` becomes ``starts[i] Phi``; a target of -1 leaves all as it is.
    """
    r = forces.shape[1]
    term, moved = np.empty_like(Phi), np.empty((r, Phi.shape[1]))
    for i in range(lengths.size):
        steps = max(1, int(np.ceil(rates[which[i]] * lengths[i] / REACH)))
        step = lengths[i] / steps
        for _ in range(steps):
            _advance(Phi, term, moved, forces[which[i]], scale, step)
        if targets[i] >= 0:
            Phi[2 * r + targets[i]] = np.dot(starts[i], Phi)


@compiled(allocates=True, nogil=True)
def _advance(Phi: Array, term: Array, moved: Array, forces: Array, scale: float, step: float) -> None:
    """``Phi = exp(A step) Phi``."""
    r, m = moved.shape
    term[:] = Phi
    size, last = np.abs(Phi).max(), 0.0
    for k in range(1, _TERMS):
        np.dot(forces, term, moved)
        largest = 0.0
        for a in range(r):
            for b in range(m):
                x, y = scale * step / k * term[r + a, b], -step / k * moved[a, b]
                term[a, b], term[r + a, b] = x, y
                Phi[a, b] += x
                Phi[r + a, b] += y
                largest = max(largest, abs(x), abs(y))
        if k == 1:
            term[2 * r :] = 0.0
        if largest + last <= _SMALL * size:
            break
        last = largest
