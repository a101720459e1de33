"""The compiled batch of contact elements: forces, tangents and sensitivities of many elements at once.

One element goes through: critical times (contact.critical), periodic states (contact.states), interval integrals
(trig.integrals), then forces and derivatives (THEORY.md sections 4 to 6). Nothing is allocated inside.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from slipstick.contact.critical import critical_times, triple
from slipstick.contact.states import (
    NONE,
    SEPARATION,
    SLIP_MINUS,
    SLIP_PLUS,
    STICK,
    march,
    motion,
    periodic_start,
)
from slipstick.contact.steep import STEEP, steep_stick
from slipstick.trig.basis import TWO_PI, basis, powers, values
from slipstick.trig.compiled import compiled, inlined
from slipstick.trig.integrals import add_boundary, fill_matrix, fill_vectors
from slipstick.trig.roots import FULL, STACK

V_FX, V_FY, V_DV, V_DMU, V_DKT, V_DKN, V_YKN = range(7)
"""Rows of the vector output: Fx, Fy, dFx/dv, dFx/dmu, dFx/dkt, dFx/dkn, dFy/dkn."""

S_WORK, S_STICK, S_SLIP, S_SEPARATION, S_LOW, S_HIGH = range(6)
"""Columns of the scalar output: work per radian, state fractions, interval of the mean friction force."""

P_V, P_KT, P_MU, P_KN, P_GAP = range(5)
"""Columns of the parameter input."""

DONE = -1
"""What a run returns when every element was computed."""


@inlined
def find_states(X: Any, Yin: Any, par: Any, tables: Any, k: Any) -> tuple[int, bool, Any, Any]:
    """Intervals of one element in ``k.at``, ``k.code``; returns their number (or ``FULL``), whether the contact is
    steep (see ``contact.steep``) and the two triples of the motion, the tangential one without its mean, which does
    not matter to the law and would cost digits.

    Rows of ``k.info`` receive, for the clamps behind ``lo`` and ``hi``: time (-1 where the motion is constant), bound
    with sign, periodic tangential motion there, and the constant ``f - kt w`` of the stick they lead to.
    """
    v, kt, mukn = par[P_V], par[P_KT], par[P_MU] * par[P_KN]
    XU, Y = triple(X, 0.0, k.parts[:2]), triple(Yin, Yin[0] - par[P_GAP], k.parts[2:])
    orders, _cos, _sin, consecutive = tables
    count = critical_times(XU, Y, v, kt, mukn, tables, k)
    steep = k.scale[0] > STEEP * k.scale[1]
    if count == FULL:
        return FULL, steep, XU, Y
    motion(
        count, v, mukn, k.time, k.kind, XU, Y, orders, consecutive, steep, k.c, k.s, k.half, k.middle, k.w, k.dw, k.b
    )  # fmt: skip
    start, side, _lo, lo_at, lo_side, _hi, hi_at, hi_side = periodic_start(count, kt, v, k.dw, k.b, k.contact)
    total = march(
        start, side, count, kt, v, mukn, k.time, k.w, k.dw, k.b, k.contact, k.plus, k.minus, XU, Y, orders, consecutive,
        steep, k.c, k.s, k.half, k.middle, k.at, k.code,
    )  # fmt: skip
    for r in range(2):
        i, sign = (lo_at, lo_side) if r == 0 else (hi_at, hi_side)
        k.info[r, 0] = -1.0 if k.kind[0] == NONE else k.time[i]
        k.info[r, 1] = sign * k.b[i]
        k.info[r, 2] = k.w[i] - v * (k.time[i] - k.time[0])
        k.info[r, 3] = k.info[r, 1] - kt * k.info[r, 2]
    return total, steep, XU, Y


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
def accumulate(total: int, at: Any, code: Any, top: int, edge: Any, sums: Any, lengths: Any, ends: Any) -> None:
    """Powers at every interval start and the accumulated primitives of stick, slip and contact.

    ``ends`` counts the interval ends of each: without any the state lasts all period, or never is.
    """
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
def product(W: Any, x: Any, out: Any) -> None:
    """``out = W @ x``."""
    for i in range(x.size):
        total = 0.0
        for j in range(x.size):
            total += W[i, j] * x[j]
        out[i] = total


@compiled
def integral(i: int, orders: Any, n: int, lengths: Any, ends: Any, sums: Any, W: Any) -> None:
    """``W`` of stick (0), signed slip (1) or contact (2); a multiple of the identity for a state without ends."""
    if ends[i] > 0:
        fill_matrix(lengths[i], sums[2 * i], sums[2 * i + 1], orders, n, W)
        return
    share = lengths[i] / TWO_PI
    for a in range(2 * n + 1):
        for b in range(2 * n + 1):
            W[a, b] = 0.0
        W[a, a] = share


@inlined
def add_outer(factor: float, a: Any, b: Any, out: Any) -> None:
    """``out += factor a b^T``."""
    for i in range(a.size):
        f = factor * a[i]
        for j in range(b.size):
            out[i, j] += f * b[j]


@inlined
def add_stick(
    h: Any, hv: Any, c0: float, dkt: float, dload: float, cx: float, cy: float, H: Any, kt: float, mu: float,
    kn: float, v: float, vec: Any, dX: Any, dY: Any,
) -> None:  # fmt: skip
    """Add the part of one stick interval that moves with its start: ``c h`` and its derivatives.

    ``c0`` is ``c``; ``dload`` is ``f_x(a)``; ``cx``, ``cy`` multiply ``H_-(a)`` in ``dc/dX`` and ``dc/dY``.
    """
    over_mu = dload / mu if mu > 0.0 else 0.0
    over_kn = dload / kn if kn > 0.0 else 0.0
    for i in range(h.size):
        hi, vi = h[i], hv[i]
        vec[V_FX, i] += c0 * hi + kt * v * vi
        vec[V_DV, i] += kt * vi
        vec[V_DMU, i] += over_mu * hi
        vec[V_DKN, i] += over_kn * hi
        vec[V_DKT, i] += dkt * hi + v * vi
    add_outer(cx, h, H, dX)
    add_outer(cy, h, H, dY)


@compiled
def stuck(par: Any, tables: Any, n: int, k: Any, vec: Any, dX: Any, dY: Any) -> None:
    """Add the constant part of a contact stuck all period: the mean of the sticks led to by ``lo`` and ``hi``."""
    orders, _cos, _sin, consecutive = tables
    v, kt, mu, kn = par[P_V], par[P_KT], par[P_MU], par[P_KN]
    L = 2 * n + 1
    h, hv, H = k.rows[0, :L], k.rows[1, :L], k.rows[2, :L]
    h[:], hv[:] = 0.0, 0.0
    h[0] = 1.0
    for r in range(2):
        share = 0.5 if v == 0.0 else (1.0 if (v > 0.0) == (r == 1) else 0.0)
        H[:] = 0.0
        H[0] = 1.0
        if k.info[r, 0] >= 0.0:
            basis(k.info[r, 0], orders, consecutive, k.c, k.s)
            for j in range(n):
                H[2 * j + 1], H[2 * j + 2] = k.c[j], k.s[j]
        slope = share * np.sign(k.info[r, 1]) * mu * kn
        add_stick(
            h, hv, share * k.info[r, 3], -share * k.info[r, 2], share * k.info[r, 1], -share * kt, slope, H,
            kt, mu, kn, 0.0, vec, dX, dY,
        )  # fmt: skip


@compiled
def sum_sticks(
    total: int, steep: bool, par: Any, XU: Any, Y: Any, tables: Any, n: int, k: Any, vec: Any, dX: Any, dY: Any
) -> None:  # fmt: skip
    """Add all stick intervals that begin within the period (THEORY.md section 5, table)."""
    v, kt, mu, kn = par[P_V], par[P_KT], par[P_MU], par[P_KN]
    orders = tables[0]
    L = 2 * n + 1
    h, hv, H = k.rows[0, :L], k.rows[1, :L], k.rows[2, :L]
    H[0] = 1.0
    for i in range(total):
        if k.code[i, 0] != STICK:
            continue
        after = i + 1 if i + 1 < total else 0
        start, end = k.edge[i], k.edge[after]
        for j in range(n):
            m = int(orders[j]) - 1
            k.c[j], k.s[j] = start[0, m], start[1, m]
            H[2 * j + 1], H[2 * j + 2] = start[0, m], start[1, m]
        x, x1, _x2 = values(XU[0], XU[1], XU[2], orders, k.c, k.s)
        f = k.at[i, 2]
        if k.code[i, 1] == SEPARATION:
            _y, y1, _y2 = values(Y[0], Y[1], Y[2], orders, k.c, k.s)
            slope = kt * (x1 + v) / y1 if y1 > 0.0 else 0.0
        else:
            slope = mu * kn if k.code[i, 1] == SLIP_PLUS else -mu * kn
        if steep:
            steep_stick(
                k.at[i], par, XU, Y, orders, tables[3], n, k.c, k.s, k.half, k.middle, h, vec, dX
            )  # fmt: skip
            hv[:] = 0.0
            add_stick(h, hv, 0.0, 0.0, f, 0.0, slope, H, kt, mu, kn, v, vec, dX, dY)
            continue
        fill_vectors(k.at[i, 1] - k.at[i, 0], start[0], start[1], end[0], end[1], orders, n, h, hv)
        add_stick(h, hv, f - kt * x, -x, f, -kt, slope, H, kt, mu, kn, v, vec, dX, dY)


@inlined
def element(X: Any, Y: Any, par: Any, tables: Any, n: int, top: int, k: Any, vec: Any, mat: Any, scalar: Any) -> int:
    """Forces, tangents and sensitivities of one element into ``vec`` (7, L), ``mat`` (3, L, L), ``scalar`` (6,).

    Returns the number of its intervals, or ``FULL`` where they cannot be found.
    """
    orders = tables[0]
    total, steep, XU, Yg = find_states(X, Y, par, tables, k)
    if total == FULL:
        return FULL
    accumulate(total, k.at, k.code, top, k.edge, k.sums, k.lengths, k.ends)
    v, kt, mu, kn = par[P_V], par[P_KT], par[P_MU], par[P_KN]
    L, stick = 2 * n + 1, k.lengths[0]
    x, y, q, r, z = k.rows[3, :L], k.rows[4, :L], k.rows[5, :L], k.rows[6, :L], k.rows[7, :L]
    for i in range(L):
        x[i], y[i] = X[i], Y[i]
    x[0] = 0.0
    y[0] -= par[P_GAP]
    whole = total == 1 and k.code[0, 0] == STICK
    steep = steep and not whole
    if steep:
        k.lengths[0], k.ends[0] = 0.0, 0  # integrated piece by piece instead
    for i in range(3):
        integral(i, orders, n, k.lengths, k.ends, k.sums, mat[i])
    product(mat[0], x, q)
    product(mat[1], y, r)
    product(mat[2], y, z)
    for i in range(L):
        vec[V_FX, i] = kt * q[i] + mu * kn * r[i]
        vec[V_FY, i] = kn * z[i]
        vec[V_DV, i] = 0.0
        vec[V_DMU, i] = kn * r[i]
        vec[V_DKT, i] = q[i]
        vec[V_DKN, i] = mu * r[i]
        vec[V_YKN, i] = z[i]
        for j in range(L):
            mat[0, i, j] *= kt
            mat[1, i, j] *= mu * kn
            mat[2, i, j] *= kn
    if whole:
        stuck(par, tables, n, k, vec, mat[0], mat[1])
    elif stick > 0.0:
        sum_sticks(total, steep, par, XU, Yg, tables, n, k, vec, mat[0], mat[1])
    work = v * vec[V_FX, 0]
    for j in range(n):
        work += 0.5 * orders[j] * (X[2 * j + 2] * vec[V_FX, 2 * j + 1] - X[2 * j + 1] * vec[V_FX, 2 * j + 2])
    scalar[S_WORK] = work
    scalar[S_STICK] = stick / TWO_PI
    scalar[S_SLIP] = max(k.lengths[2] - stick, 0.0) / TWO_PI
    scalar[S_SEPARATION] = max(1.0 - k.lengths[2] / TWO_PI, 0.0)
    scalar[S_LOW], scalar[S_HIGH] = vec[V_FX, 0], vec[V_FX, 0]
    if whole and v == 0.0:
        scalar[S_LOW], scalar[S_HIGH] = k.info[0, 3], k.info[1, 3]
    return total


class Work(NamedTuple):
    """Workspace of one thread."""

    g: Any
    p: Any
    parts: Any
    scale: Any
    c: Any
    s: Any
    half: Any
    middle: Any
    stack: Any
    lists: Any
    rising: Any
    counts: Any
    signs: Any
    skip: Any
    margin: Any
    time: Any
    kind: Any
    up: Any
    w: Any
    dw: Any
    b: Any
    contact: Any
    plus: Any
    minus: Any
    at: Any
    code: Any
    info: Any
    edge: Any
    sums: Any
    lengths: Any
    ends: Any
    rows: Any


@compiled(allocates=True)
def workspace(padded: int, cells: int, n: int, top: int) -> Any:
    """Room for the worst case: every polynomial with all its ``2 m_n`` roots, a slip onset in every segment."""
    room = top + 2
    many = 3 * room + 1
    return Work(
        np.empty((9, cells)), np.empty((6, padded)), np.empty((4, padded)), np.empty(2), np.empty(padded),
        np.empty(padded), np.empty((2, padded)), np.empty((2, padded)),
        np.empty((STACK, 2)), np.empty((3, room)), np.empty((3, room), np.bool_),
        np.empty(3, np.int64), np.empty(3, np.int64), np.empty(cells, np.bool_), np.empty(cells),
        np.empty(many), np.empty(many, np.int64), np.empty(many, np.bool_), np.empty(many), np.empty(many),
        np.empty(many), np.empty(many, np.bool_), np.empty(many), np.empty(many), np.empty((2 * many, 3)),
        np.empty((2 * many, 2), np.int64), np.empty((2, 4)), np.empty((2 * many, 2, top + 4)), np.empty((6, top + 4)),
        np.empty(3), np.empty(3, np.int64), np.empty((8, 2 * n + 1)),
    )  # fmt: skip


@compiled(allocates=True, nogil=True)
def chunk(
    first: int, last: int, X: Any, Y: Any, par: Any, orders: Any, cos: Any, sin: Any, consecutive: bool, n: int,
    top: int, vec: Any, mat: Any, scalar: Any, totals: Any, at: Any, code: Any,
) -> int:  # fmt: skip
    """A run of elements with one workspace; other threads may run theirs at the same time.

    Where ``totals`` (elements,) is not empty, ``at`` (elements, room, 3) receives the intervals (start, end, force at
    start) of each element, ``code`` (elements, room, 2) their state and origin, and ``totals`` their number.

    Returns ``DONE``, or the number of an element that cannot be computed, where the run ends.
    """
    k = workspace(orders.size, cos.shape[1], n, top)
    tables = (orders, cos, sin, consecutive)
    for e in range(first, last):
        total = element(X[e], Y[e], par[e], tables, n, top, k, vec[e], mat[e], scalar[e])
        if total == FULL:
            return e
        if totals.size:
            totals[e] = total
            for i in range(total):
                at[e, i, 0], at[e, i, 1], at[e, i, 2] = k.at[i, 0], k.at[i, 1], k.at[i, 2]
                code[e, i, 0], code[e, i, 1] = k.code[i, 0], k.code[i, 1]
    return DONE


def most_intervals(top: int) -> int:
    """Room for the intervals of one element."""
    return 2 * (3 * (top + 2) + 1)
