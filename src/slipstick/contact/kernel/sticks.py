"""Stick intervals of one element: the constant ``c h`` of the force and its derivatives (THEORY.md (5.1), (5.2))."""

from __future__ import annotations

import numpy as np

from slipstick.contact.kernel.steep_sticks import steep_stick
from slipstick.contact.kernel.tuples import (
    SEPARATION,
    SLIP_PLUS,
    STICK,
    V_DKN,
    V_DKT,
    V_DMU,
    V_DV,
    V_FX,
    ElementMotion,
    ElementOutputs,
    Stick,
    StickRows,
    Workspace,
)
from slipstick.trig.basis import Grid, basis, values
from slipstick.trig.compiled import compiled, inlined
from slipstick.trig.integrals import fill_vectors
from slipstick.typing import Array


@inlined
def add_outer(factor: float, a: Array, b: Array, out: Array) -> None:
    """``out += factor a b^T``."""
    for i in range(a.size):
        f = factor * a[i]
        for j in range(b.size):
            out[i, j] += f * b[j]


@inlined
def add_stick(stick: Stick, rows: StickRows, e: ElementMotion, out: ElementOutputs) -> None:
    """Add the part of one stick interval that moves with its start: ``c h`` and its derivatives."""
    h, hv, vec = rows.h, rows.hv, out.vectors
    over_mu = stick.load / e.mu if e.mu > 0.0 else 0.0
    over_kn = stick.load / e.kn if e.kn > 0.0 else 0.0
    for i in range(h.size):
        hi, vi = h[i], hv[i]
        vec[V_FX, i] += stick.c * hi + e.kt * e.v * vi
        vec[V_DV, i] += e.kt * vi
        vec[V_DMU, i] += over_mu * hi
        vec[V_DKN, i] += over_kn * hi
        vec[V_DKT, i] += stick.by_kt * hi + e.v * vi
    add_outer(stick.by_X, h, rows.H, out.matrices[0])
    add_outer(stick.by_Y, h, rows.H, out.matrices[1])


@compiled
def stuck(e: ElementMotion, grid: Grid, k: Workspace, out: ElementOutputs) -> None:
    """Add the constant part of a contact stuck all period: the mean of the sticks led to by ``lo`` and ``hi``."""
    L, clamps, c, s = 2 * grid.n + 1, k.clamps, k.scratch.c, k.scratch.s
    h, hv, H = k.rows[0, :L], k.rows[1, :L], k.rows[2, :L]
    h[:], hv[:] = 0.0, 0.0
    h[0], bounds = 1.0, 0.0
    for r in range(2):
        share = 0.5 if e.v == 0.0 else (1.0 if (e.v > 0.0) == (r == 1) else 0.0)
        H[:] = 0.0
        H[0] = 1.0
        if clamps[r, 0] >= 0.0:
            basis(clamps[r, 0], grid, c, s)
            for j in range(grid.n):
                H[2 * j + 1], H[2 * j + 2] = c[j], s[j]
        slope = share * np.sign(clamps[r, 1]) * e.mu * e.kn
        bounds += share * clamps[r, 1]  # both first, which are far larger than the motion where the contact is glued
        moved = -share * clamps[r, 2]
        stick = Stick(e.kt * moved, moved, share * clamps[r, 1], -share * e.kt, slope)
        add_stick(stick, StickRows(h, hv, H), e, out)
    out.vectors[V_FX, 0] += bounds


@compiled
def sum_sticks(total: int, e: ElementMotion, grid: Grid, k: Workspace, out: ElementOutputs) -> None:
    """Add all stick intervals that begin within the period (THEORY.md section 5, table)."""
    kt, orders, c, s = e.kt, grid.orders, k.scratch.c, k.scratch.s
    at, code = k.intervals.at, k.intervals.code
    L = 2 * grid.n + 1
    h, hv, H = k.rows[0, :L], k.rows[1, :L], k.rows[2, :L]
    H[0] = 1.0
    for i in range(total):
        if code[i, 0] != STICK:
            continue
        after = i + 1 if i + 1 < total else 0
        start, end = k.sums.edge[i], k.sums.edge[after]
        for j in range(grid.n):
            m = int(orders[j]) - 1
            c[j], s[j] = start[0, m], start[1, m]
            H[2 * j + 1], H[2 * j + 2] = start[0, m], start[1, m]
        x, x1, _x2 = values(e.X, orders, c, s)
        f = at[i, 2]
        if code[i, 1] == SEPARATION:
            _y, y1, _y2 = values(e.Y, orders, c, s)
            slope = kt * (x1 + e.v) / y1 if y1 > 0.0 else 0.0
        else:
            slope = e.limit if code[i, 1] == SLIP_PLUS else -e.limit
        if e.steep:
            steep_stick(at[i], e, grid, k.scratch, h, out)
            hv[:] = 0.0
            add_stick(Stick(0.0, 0.0, f, 0.0, slope), StickRows(h, hv, H), e, out)
            continue
        fill_vectors(at[i, 1] - at[i, 0], start, end, grid, h, hv)
        add_stick(Stick(f - kt * x, -x, f, -kt, slope), StickRows(h, hv, H), e, out)
