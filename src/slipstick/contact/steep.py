"""Stick intervals of a contact that is steep: ``kt w`` moves far more than the friction limit lets the force change.

There the closed form ``kt W (X + U) + c h`` (THEORY.md section 4) is a small difference of large numbers: of the order
of ``mu N`` while its terms are ``kt |X|``. Such intervals are mostly short, as the motion turns. The force itself,
``f_x(a) + kt (w(tau) - w(a))`` with the motion gained taken as a product, is integrated by Gauss's rule instead: exact
to rounding on pieces of one radian of the highest harmonic, and every value is held within the friction limit.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.trig.basis import basis, rise, value
from slipstick.trig.compiled import compiled

STEEP = 1e4
"""Ratio of the largest rate ``kt w'`` to the largest friction limit from which a contact counts as steep: the closed
form then loses four of its sixteen digits."""

NODES, SHARES = np.polynomial.legendre.leggauss(6)
NODES, SHARES = 0.5 + 0.5 * NODES, 0.5 * SHARES


@compiled
def steep_stick(
    at: Any, par: Any, XU: Any, Y: Any, orders: Any, consecutive: bool, n: int, c: Any, s: Any, half: Any, middle: Any,
    h: Any, vec: Any, dX: Any,
) -> None:  # fmt: skip
    """Add one stick interval ``at`` (start, end, force at start) to the force, its tangent by X and its derivatives by
    ``v`` and ``kt``; ``h`` (L,) receives ``(1/pi) int H_+``.
    """
    v, kt, mukn = par[0], par[1], par[2] * par[3]  # columns and rows as named in contact.kernel
    h[:] = 0.0
    pieces = 1 + int(orders[n - 1] * (at[1] - at[0]))
    step = (at[1] - at[0]) / pieces
    for p in range(pieces):
        for q in range(NODES.size):
            past = (p + NODES[q]) * step
            t = at[0] + past
            gain = rise(at[0], t, v, XU, orders, consecutive, half, middle)
            basis(t, orders, consecutive, c, s)
            limit = mukn * max(value(Y[0], Y[1], Y[2], c, s), 0.0)
            f = min(max(at[2] + kt * gain, -limit), limit)
            share = SHARES[q] * step / np.pi
            for i in range(2 * n + 1):
                a = share * (0.5 if i == 0 else (c[(i - 1) // 2] if i % 2 else s[(i - 1) // 2]))
                h[i] += a
                vec[0, i] += a * f
                vec[2, i] += a * kt * past
                vec[4, i] += a * gain
                for j in range(n):
                    chord = 2.0 * a * kt * half[1, j]
                    dX[i, 2 * j + 1] -= chord * middle[1, j]
                    dX[i, 2 * j + 2] += chord * middle[0, j]
