"""Batches of planar elements: forces and derivatives of all, and the pieces of one."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.contact.kernel.planar.derivatives import differentiate, normal_force
from slipstick.contact.kernel.planar.march import march, periodic
from slipstick.contact.kernel.planar.motion import (
    COLUMNS,
    FULL,
    KT,
    LOST,
    STICK,
    Pieces,
    Planar,
    Workspace,
    contact_arcs,
    element,
    evaluate_motion,
    new_pieces,
    new_workspace,
)
from slipstick.contact.kernel.planar.resting import resting_mean
from slipstick.trig.basis import TWO_PI, Grid
from slipstick.trig.compiled import compiled, part
from slipstick.typing import Array


@part
def periodic_pieces(
    p: Planar,
    whole: bool,
    arcs: Array,
    tolerance: float,
    grid: Grid,
    work: Workspace,
    pieces: Pieces,
    old: Pieces,
    P: Array,
) -> tuple[int, float, float, Array, Array]:
    """The periodic state in ``pieces``: their number, ``FULL`` or ``LOST``; the residual of ``periodic``.

    A contact that never slips has one piece, the whole period, with the mean force in place of that at the start. That
    indeterminate mean is returned with its derivatives (2,), (2, columns); other contacts return empty arrays.
    """  # fmt: skip
    none, nothing = np.zeros(0), np.zeros((0, 0))
    if not whole:
        count, _, _ = march(p, 0.0, 0.0, arcs, tolerance, grid, work, old, 0, pieces, P)
        return count, 0.0, 0.0, none, nothing
    o, f1, f2 = work.state, 0.0, 0.0
    evaluate_motion(p, 0.0, grid, work, o)
    limit, speed = p.b * o[4], np.sqrt(p.v1 * p.v1 + p.v2 * p.v2)
    if speed > 0.0:
        f1, f2 = limit * p.v1 / speed, limit * p.v2 / speed
    else:
        w1, w2 = o[0], o[1]
        least, c1, c2, dc = resting_mean(p, grid, work)
        f1, f2 = c1 + p.kt * w1, c2 + p.kt * w2
        if least <= 0.0:
            pieces.kind[0] = STICK
            pieces.at[0, 0], pieces.at[0, 1], pieces.at[0, 2], pieces.at[0, 3] = 0.0, TWO_PI, f1, f2
            return 1, 0.0, 0.0, np.array([c1, c2]), dc
        size = np.sqrt(f1 * f1 + f2 * f2)
        if size > limit:
            f1, f2 = f1 * limit / size, f2 * limit / size
    count, r1, r2 = periodic(p, arcs, f1, f2, tolerance, grid, work, pieces, old, P)
    return count, r1, r2, none, nothing


@compiled(allocates=True, nogil=True)
def run_planar(
    first: int, last: int, X: Array, par: Array, tables: Any, tolerance: float, capacity: int, outputs: Any
) -> int:
    """Elements from ``first`` to ``last``: motion (n, 3, L), parameters ``v1 v2 kt mu kn gap`` (n, 6).

    Outputs: forces (n, 3, L), derivatives (n, 3, L, 3 L + 6), scalars (n, 4): fractions of stick, slip, separation, and
    whether the mean is indeterminate. Returns -1, the element whose pieces do not fit, or ``-2 - e`` for an element e
    without a periodic state. Motion that is not finite gives nan.
    """
    grid = Grid(*tables)
    forces, derivatives, scalars = outputs
    L, q = 2 * grid.n + 1, 3 * (2 * grid.n + 1)
    kept = q + COLUMNS - 2
    work, pieces, old, P = new_workspace(grid), new_pieces(capacity), new_pieces(capacity), np.zeros((2, 2))
    for e in range(first, last):
        F, dF = forces[e], derivatives[e]
        if not (np.isfinite(X[e]).all() and np.isfinite(par[e]).all()):
            F[:], dF[:], scalars[e] = np.nan, np.nan, np.nan
            continue
        F[:], dF[:], scalars[e] = 0.0, 0.0, 0.0
        p = element(X[e], par[e], grid)
        whole, arcs = contact_arcs(p, grid)
        length = normal_force(p, arcs, grid, F[2], dF[2])
        scalars[e, 2] = 1.0 - length / TWO_PI
        if arcs.shape[0] == 0 or p.mu == 0.0 or p.kt == 0.0:
            scalars[e, 1] = length / TWO_PI
            continue
        count, r1, r2, mean, dc = periodic_pieces(p, whole, arcs, tolerance, grid, work, pieces, old, P)
        if count == FULL:
            return e
        if count == LOST:
            return -2 - e
        if mean.size > 0:
            for r in range(2):
                x = p.X1 if r == 0 else p.X2
                F[r, 0] = mean[r]
                for i in range(1, L):
                    F[r, i] = p.kt * x[i]
                    dF[r, i, r * L + i] = p.kt
                    dF[r, i, q + KT] = x[i]
                for j in range(kept):
                    dF[r, 0, j] = dc[r, j]
            scalars[e, 0], scalars[e, 3] = 1.0, 1.0
            continue
        G, dG, D = differentiate(p, pieces, count, arcs, grid, work)
        a, b, c, d = 1.0 - D[0, kept], -D[0, kept + 1], -D[1, kept], 1.0 - D[1, kept + 1]
        det = a * d - b * c
        for j in range(kept):
            s1, s2 = 0.0, 0.0
            if whole and det != 0.0:
                s1, s2 = (d * D[0, j] - b * D[1, j]) / det, (a * D[1, j] - c * D[0, j]) / det
            for r in range(2):
                for i in range(L):
                    dF[r, i, j] = dG[r, i, j] + dG[r, i, kept] * s1 + dG[r, i, kept + 1] * s2
        s1, s2 = 0.0, 0.0
        if whole and det != 0.0:
            s1, s2 = (d * r1 - b * r2) / det, (a * r2 - c * r1) / det
        for r in range(2):
            for i in range(L):
                F[r, i] = G[r, i] + dG[r, i, kept] * s1 + dG[r, i, kept + 1] * s2
        stick = 0.0
        for i in range(count):
            if pieces.kind[i] == STICK:
                stick += pieces.at[i, 1] - pieces.at[i, 0]
        scalars[e, 0] = stick / TWO_PI
        scalars[e, 1] = max(length - stick, 0.0) / TWO_PI
    return -1


@compiled(allocates=True, nogil=True)
def trace(X: Array, par: Array, tables: Any, tolerance: float, capacity: int) -> Any:
    """Pieces of an element's period (motion (3, L), parameters (6,)): their number, kinds, ``at``, angles at the nodes.

    An open contact, or one without friction, has no pieces. The arcs of contact come last.
    """
    grid = Grid(*tables)
    p = element(X, par, grid)
    whole, arcs = contact_arcs(p, grid)
    pieces, count = new_pieces(capacity), 0
    if arcs.shape[0] > 0 and p.mu > 0.0 and p.kt > 0.0:
        old, P = new_pieces(capacity), np.zeros((2, 2))
        count, _, _, _, _ = periodic_pieces(p, whole, arcs, tolerance, grid, new_workspace(grid), pieces, old, P)
    return count, pieces.kind, pieces.at[:, :5], pieces.theta, arcs
