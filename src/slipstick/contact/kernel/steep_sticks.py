"""Stick intervals of a contact that is steep: ``kt w`` moves far more than the friction limit lets the force change.

There the closed form ``kt W (X + U) + c h`` (THEORY.md (4.3)) is a small difference of large numbers: of the order
of ``mu N`` while its terms are ``kt |X|``. Such intervals are mostly short, as the motion turns. The force itself,
``f_x(a) + kt (w(tau) - w(a))`` with the motion gained taken as a product, is integrated by Gauss's rule instead: exact
to rounding on pieces of one radian of the highest harmonic, and every value is held within the friction limit.
"""

from __future__ import annotations

import numpy as np

from slipstick.contact.kernel.tuples import V_DKT, V_DV, V_FX, ElementMotion, ElementOutputs
from slipstick.trig.basis import Grid, Scratch, basis, rise, value
from slipstick.trig.compiled import compiled
from slipstick.typing import Array

STEEP = 1e4
"""Ratio of the largest rate ``kt w'`` to the largest friction limit from which a contact counts as steep: the closed
form then loses four of its sixteen digits."""

NODES, SHARES = np.polynomial.legendre.leggauss(6)
NODES, SHARES = 0.5 + 0.5 * NODES, 0.5 * SHARES


@compiled
def steep_stick(at: Array, e: ElementMotion, grid: Grid, scratch: Scratch, h: Array, out: ElementOutputs) -> None:
    """Add one stick interval ``at`` (start, end, force at start) to the force, its tangent by X and its derivatives by
    ``v`` and ``kt``; ``h`` (L,) receives ``(1/pi) int H_+``.
    """
    vec, dX, n = out.vectors, out.matrices[0], grid.n
    c, s, half, middle = scratch
    h[:] = 0.0
    pieces = 1 + int(grid.orders[n - 1] * (at[1] - at[0]))
    step = (at[1] - at[0]) / pieces
    for p in range(pieces):
        for q in range(NODES.size):
            past = (p + NODES[q]) * step
            t = at[0] + past
            gain = rise(at[0], t, e.v, e.X, grid, scratch)
            basis(t, grid, c, s)
            limit = e.limit * max(value(e.Y, c, s), 0.0)
            f = min(max(at[2] + e.kt * gain, -limit), limit)
            share = SHARES[q] * step / np.pi
            for i in range(2 * n + 1):
                a = share * (0.5 if i == 0 else (c[(i - 1) // 2] if i % 2 else s[(i - 1) // 2]))
                h[i] += a
                vec[V_FX, i] += a * f
                vec[V_DV, i] += a * e.kt * past
                vec[V_DKT, i] += a * gain
                for j in range(n):
                    chord = 2.0 * a * e.kt * half[1, j]
                    dX[i, 2 * j + 1] -= chord * middle[1, j]
                    dX[i, 2 * j + 2] += chord * middle[0, j]
