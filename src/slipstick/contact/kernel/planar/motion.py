"""Motion of a planar element, the arrays of one period, and when the contact is closed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipstick.trig.basis import TWO_PI, Grid, Polynomial, basis
from slipstick.trig.compiled import compiled, part
from slipstick.trig.roots import _roots
from slipstick.typing import Array, IntArray

STAGES = 6
SEPARATION, STICK, SLIP, LAST_SLIP = 0, 1, 2, 3
"""Kinds of pieces. The last slip before a separation is so short that its angle counts as constant."""
NAMES = ("separation", "stick", "slip", "slip")

V1, V2, KT, MU, KN, GAP, F1, F2 = range(8)
"""Columns of the derivatives after the 3 L of the motion."""
COLUMNS = 8

FULL, LOST = -1, -2
"""Failures: more pieces than the arrays hold, or no periodic state."""

BLOCK = 48
"""Nodes whose derivatives are summed by one matrix product."""


class Planar(NamedTuple):
    """One element: motion without its tangential means, and constants."""

    X1: Array
    X2: Array
    Y: Array
    """Its mean is that of the penetration: less the gap."""
    v1: float
    v2: float
    kt: float
    mu: float
    kn: float
    b: float
    """``mu kn``: friction limit over penetration."""
    series: Array
    """For each order the coefficients of the cosine in ``w1', w2', y, y', w1, w2``, then those of the sine (n, 12)."""


class Pieces(NamedTuple):
    """One period, piece by piece."""

    kind: IntArray
    at: Array
    """Start, end, force at the start, angle at the start, end of the panel that was tried (capacity, 6)."""
    theta: Array
    """Angle at the nodes of a panel (capacity, STAGES)."""
    rates: Array
    """``w1', w2', penetration, its rate`` at the nodes (capacity, STAGES, 4)."""


class Workspace(NamedTuple):
    """Arrays that functions overwrite, for one element after the other."""

    c: Array
    s: Array
    jacobian: Array
    residual: Array
    node_cos: Array
    """``cos m_j t`` at the nodes of a panel (STAGES, padded orders), and sines."""
    node_sin: Array
    nodes: Array
    """Rates at the nodes of the panel that is tried (STAGES, 4)."""
    theta: Array
    cos: Array
    """Of the angles at the nodes, as ``sin``, the rate ``g`` of the angle and its derivative ``slope`` by it."""
    sin: Array
    g: Array
    slope: Array
    speed: Array
    """Velocity of slip at the nodes, then coefficients of its polynomial, of that of the angle (3, STAGES)."""
    state: Array
    """Motion at a time: ``w1, w2, w1', w2', penetration, its rate``."""
    rows: Array
    """For ``differentiate``: both forces and their derivatives at nodes (BLOCK, 2 (1 + columns))."""
    weighted: Array
    """And their weights (BLOCK, L)."""


@part
def new_workspace(grid: Grid) -> Workspace:
    """Workspace of one thread."""
    padded, L = grid.orders.size, 2 * grid.n + 1
    return Workspace(
        np.zeros(padded), np.zeros(padded), np.zeros((STAGES, STAGES)), np.zeros(STAGES),
        np.zeros((STAGES, padded)), np.zeros((STAGES, padded)), np.zeros((STAGES, 4)),
        np.zeros(STAGES), np.zeros(STAGES), np.zeros(STAGES), np.zeros(STAGES), np.zeros(STAGES), np.zeros((3, STAGES)),
        np.zeros(6), np.zeros((BLOCK, 2 * (3 * L + COLUMNS + 1))), np.zeros((BLOCK, L)),
    )  # fmt: skip


@part
def new_pieces(capacity: int) -> Pieces:
    """Arrays for the pieces of a period."""
    return Pieces(
        np.zeros(capacity, np.int64), np.zeros((capacity, 6)), np.zeros((capacity, STAGES)),
        np.zeros((capacity, STAGES, 4)),
    )  # fmt: skip


@part
def element(X: Array, par: Array, grid: Grid) -> Planar:
    """One element, without the tangential means, which do not matter."""
    X1, X2, Y = X[0].copy(), X[1].copy(), X[2].copy()
    X1[0], X2[0] = 0.0, 0.0
    Y[0] -= par[5]
    series = np.zeros((grid.n, 12))
    for j in range(grid.n):
        i, m, a = 2 * j + 1, grid.orders[j], series[j]
        a[0], a[1], a[2], a[3], a[4], a[5] = m * X1[i + 1], m * X2[i + 1], Y[i], m * Y[i + 1], X1[i], X2[i]
        a[6], a[7], a[8], a[9], a[10], a[11] = -m * X1[i], -m * X2[i], Y[i + 1], -m * Y[i], X1[i + 1], X2[i + 1]
    return Planar(X1, X2, Y, par[0], par[1], par[2], par[3], par[4], par[3] * par[4], series)


@part
def contact_arcs(p: Planar, grid: Grid) -> tuple[bool, Array]:
    """Whether the contact is closed all period, and its arcs ``(start, end, closed before)``, (k, 3)."""
    total = 0.0
    for j in range(1, p.Y.size):
        total += abs(p.Y[j])
    whole = np.array([[0.0, TWO_PI, 1.0]])
    if total == 0.0 or abs(p.Y[0]) > total:
        return p.Y[0] > 0.0, whole[: 1 if p.Y[0] > 0.0 else 0]
    padded = grid.orders.size
    c, s = np.zeros(padded), np.zeros(padded)
    for j in range(grid.n):
        c[j], s[j] = p.Y[2 * j + 1], p.Y[2 * j + 2]
    count, times, rising = _roots(Polynomial(p.Y[0], c, s), grid, grid.top + 2)
    if count <= 0:
        value = p.Y[0]
        for j in range(grid.n):
            value += c[j]
        return value > 0.0, whole[: 1 if value > 0.0 else 0]
    arcs, k = np.zeros((count // 2 + 1, 3)), 0
    for i in range(count):
        if rising[i]:
            arcs[k, 0] = times[i]
            arcs[k, 1] = times[i + 1] if i + 1 < count else times[0] + TWO_PI
            k += 1
    return False, arcs[:k]


@compiled
def evaluate_motion(p: Planar, t: float, grid: Grid, work: Workspace, out: Array) -> None:
    """``w1, w2, w1', w2', y - gap, y'`` at a time; its basis stays in the workspace."""
    a, c, s = p.series, work.c, work.s
    basis(t, grid, c, s)
    w1, w2, d1, d2, y, dy = p.v1 * t, p.v2 * t, p.v1, p.v2, p.Y[0], 0.0
    for j in range(grid.n):
        cj, sj = c[j], s[j]
        d1 += a[j, 0] * cj + a[j, 6] * sj
        d2 += a[j, 1] * cj + a[j, 7] * sj
        y += a[j, 2] * cj + a[j, 8] * sj
        dy += a[j, 3] * cj + a[j, 9] * sj
        w1 += a[j, 4] * cj + a[j, 10] * sj
        w2 += a[j, 5] * cj + a[j, 11] * sj
    out[0], out[1], out[2], out[3], out[4], out[5] = w1, w2, d1, d2, y, dy


@compiled
def basis_row(t: float, grid: Grid, work: Workspace, H: Array, dH: Array) -> None:
    """``H_-`` and ``H_-'`` at a time, (L,) each."""
    basis(t, grid, work.c, work.s)
    H[0], dH[0] = 1.0, 0.0
    for j in range(grid.n):
        r, m, c, s = 2 * j + 1, grid.orders[j], work.c[j], work.s[j]
        H[r], H[r + 1], dH[r], dH[r + 1] = c, s, -m * s, m * c
