"""One contact element: critical times, periodic states, interval integrals, then forces and derivatives (THEORY.md
sections 3 to 6)."""

from __future__ import annotations

import numpy as np

from slipstick.contact.kernel.critical_times import critical_times, padded
from slipstick.contact.kernel.periodic_states import march, motion, periodic_start
from slipstick.contact.kernel.steep_sticks import STEEP
from slipstick.contact.kernel.sticks import stuck, sum_sticks
from slipstick.contact.kernel.tuples import (
    NONE,
    P_GAP,
    P_KN,
    P_KT,
    P_MU,
    P_V,
    S_HIGH,
    S_LOW,
    S_SEPARATION,
    S_SLIP,
    S_STICK,
    S_WORK,
    SLIP_MINUS,
    SLIP_PLUS,
    STICK,
    V_DKN,
    V_DKT,
    V_DMU,
    V_DV,
    V_FX,
    V_FY,
    V_YKN,
    ElementInputs,
    ElementMotion,
    ElementOutputs,
    Intervals,
    Sums,
    Workspace,
)
from slipstick.trig.basis import TWO_PI, Grid, powers
from slipstick.trig.compiled import compiled, inlined
from slipstick.trig.integrals import add_boundary, fill_matrix
from slipstick.trig.roots import FULL
from slipstick.typing import Array


@inlined
def find_states(inputs: ElementInputs, grid: Grid, k: Workspace) -> tuple[int, ElementMotion]:
    """Intervals of one element in ``k.intervals``; returns their number (or ``FULL``) and the element.

    Rows of ``k.clamps`` receive, for the clamps behind ``lo`` and ``hi``: time (-1 where the motion is constant), bound
    with sign, periodic tangential motion there, and the constant ``f - kt w`` of the stick they lead to.
    """
    par = inputs.parameters
    v, kt, mu, kn = par[P_V], par[P_KT], par[P_MU], par[P_KN]
    X, Y = padded(inputs.X, 0.0, k.parts[:2]), padded(inputs.Y, inputs.Y[0] - par[P_GAP], k.parts[2:])
    count, rate, limit = critical_times(ElementMotion(X, Y, v, kt, mu, kn, mu * kn, False), grid, k)
    e = ElementMotion(X, Y, v, kt, mu, kn, mu * kn, rate > STEEP * limit)
    if count == FULL:
        return FULL, e
    segments, clamps = k.segments, k.clamps
    motion(count, segments, e, grid, k.scratch)
    start, side, _lo, lo_at, lo_side, _hi, hi_at, hi_side = periodic_start(count, kt, v, segments)
    total = march(start, side, count, segments, e, grid, k.scratch, k.intervals)
    for r in range(2):
        i, sign = (lo_at, lo_side) if r == 0 else (hi_at, hi_side)
        clamps[r, 0] = -1.0 if segments.kind[0] == NONE else segments.time[i]
        clamps[r, 1] = sign * segments.b[i]
        clamps[r, 2] = segments.w[i] - v * (segments.time[i] - segments.time[0])
        clamps[r, 3] = clamps[r, 1] - kt * clamps[r, 2]
    return total, e


@compiled
def weights(state: int) -> tuple[float, float, float]:
    """Weight of a state in the stick, signed slip and contact integrals."""
    if state == STICK:
        return 1.0, 0.0, 1.0
    if state == SLIP_PLUS:
        return 0.0, 1.0, 1.0
    if state == SLIP_MINUS:
        return 0.0, -1.0, 1.0
    return 0.0, 0.0, 0.0


@compiled
def accumulate(total: int, intervals: Intervals, top: int, out: Sums) -> None:
    """Powers at every interval start and the accumulated primitives of stick, slip and contact."""
    at, code = intervals.at, intervals.code
    edge, sums, lengths, ends = out.edge, out.primitives, out.lengths, out.ends
    for k in range(6):
        for i in range(top):
            sums[k, i] = 0.0
    for k in range(3):
        lengths[k], ends[k] = 0.0, 0
    for i in range(total):
        a, b = weights(code[i - 1 if i > 0 else total - 1, 0]), weights(code[i, 0])
        length = at[i, 1] - at[i, 0]
        for k in range(3):
            lengths[k] += b[k] * length
        powers(at[i, 0], top, edge[i, 0], edge[i, 1])
        for k in range(3):
            if a[k] != b[k]:
                ends[k] += 1
                add_boundary(a[k] - b[k], edge[i, 0], edge[i, 1], sums[2 * k], sums[2 * k + 1], top)
    for i in range(top):
        r = 1.0 / (i + 1.0)
        for k in range(6):
            sums[k, i] *= r


@inlined
def product(W: Array, x: Array, out: Array) -> None:
    """``out = W @ x``."""
    for i in range(x.size):
        total = 0.0
        for j in range(x.size):
            total += W[i, j] * x[j]
        out[i] = total


@compiled
def integral(i: int, grid: Grid, sums: Sums, W: Array) -> None:
    """``W`` of stick (0), signed slip (1) or contact (2); a multiple of the identity for a state without ends."""
    if sums.ends[i] > 0:
        fill_matrix(sums.lengths[i], sums.primitives[2 * i], sums.primitives[2 * i + 1], grid, W)
        return
    share = sums.lengths[i] / TWO_PI
    for a in range(2 * grid.n + 1):
        for b in range(2 * grid.n + 1):
            W[a, b] = 0.0
        W[a, a] = share


@inlined
def finite(inputs: ElementInputs) -> bool:
    """Whether all inputs are finite: zero times each is zero."""
    total = 0.0
    for i in range(inputs.X.size):
        total += 0.0 * inputs.X[i] + 0.0 * inputs.Y[i]
    for i in range(inputs.parameters.size):
        total += 0.0 * inputs.parameters[i]
    return total == 0.0


@inlined
def states_alone(inputs: ElementInputs, grid: Grid, k: Workspace) -> int:
    """Number of intervals of one element, which ``k.intervals`` holds then; as ``evaluate`` returns it."""
    if not finite(inputs):
        return 0
    total, _ = find_states(inputs, grid, k)
    return total


@inlined
def evaluate(inputs: ElementInputs, grid: Grid, k: Workspace, out: ElementOutputs) -> int:
    """Forces, tangents and sensitivities of one element; returns the number of its intervals, or ``FULL`` where they
    cannot be found. Inputs that are nan or infinite give nan, and no intervals.
    """
    if not finite(inputs):
        out.vectors[:], out.matrices[:], out.scalars[:] = np.nan, np.nan, np.nan
        return 0
    total, e = find_states(inputs, grid, k)
    if total == FULL:
        return FULL
    accumulate(total, k.intervals, grid.top, k.sums)
    orders, n, lengths = grid.orders, grid.n, k.sums.lengths
    vec, mat, scalar = out.vectors, out.matrices, out.scalars
    kt, kn, limit = e.kt, e.kn, e.limit
    L, stick = 2 * n + 1, lengths[0]
    x, y, q, r, z = k.rows[3, :L], k.rows[4, :L], k.rows[5, :L], k.rows[6, :L], k.rows[7, :L]
    for i in range(L):
        x[i], y[i] = inputs.X[i], inputs.Y[i]
    x[0] = 0.0
    y[0] -= inputs.parameters[P_GAP]
    whole = total == 1 and k.intervals.code[0, 0] == STICK
    if e.steep and not whole:
        lengths[0], k.sums.ends[0] = 0.0, 0  # integrated piece by piece instead
    for i in range(3):
        integral(i, grid, k.sums, mat[i])
    product(mat[0], x, q)
    product(mat[1], y, r)
    product(mat[2], y, z)
    for i in range(L):
        vec[V_FX, i] = kt * q[i] + limit * r[i]
        vec[V_FY, i] = kn * z[i]
        vec[V_DV, i] = 0.0
        vec[V_DMU, i] = kn * r[i]
        vec[V_DKT, i] = q[i]
        vec[V_DKN, i] = e.mu * r[i]
        vec[V_YKN, i] = z[i]
        for j in range(L):
            mat[0, i, j] *= kt
            mat[1, i, j] *= limit
            mat[2, i, j] *= kn
    if whole:
        stuck(e, grid, k, out)
    elif stick > 0.0:
        sum_sticks(total, e, grid, k, out)
    work = e.v * vec[V_FX, 0]
    for j in range(n):
        work += (
            0.5 * orders[j] * (inputs.X[2 * j + 2] * vec[V_FX, 2 * j + 1] - inputs.X[2 * j + 1] * vec[V_FX, 2 * j + 2])
        )
    scalar[S_WORK] = work
    scalar[S_STICK] = stick / TWO_PI
    scalar[S_SLIP] = max(lengths[2] - stick, 0.0) / TWO_PI
    scalar[S_SEPARATION] = max(1.0 - lengths[2] / TWO_PI, 0.0)
    scalar[S_LOW], scalar[S_HIGH] = vec[V_FX, 0], vec[V_FX, 0]
    if whole and e.v == 0.0:
        scalar[S_LOW], scalar[S_HIGH] = k.clamps[0, 3], k.clamps[1, 3]
    return total
