"""Forces of a marched period from its pieces, and the exact derivatives of the collocation."""

from __future__ import annotations

from math import pi

import numpy as np

from slipstick.contact.kernel.planar.motion import (
    BLOCK,
    COLUMNS,
    F1,
    F2,
    GAP,
    KN,
    KT,
    LAST_SLIP,
    MU,
    STAGES,
    STICK,
    V1,
    V2,
    Pieces,
    Planar,
    Workspace,
    basis_row,
    evaluate_motion,
)
from slipstick.contact.kernel.planar.slip import NODES, WEIGHTS, onset_rate
from slipstick.trig.basis import Grid, circle, powers
from slipstick.trig.compiled import inlined, part
from slipstick.trig.integrals import fill_matrix, fill_vectors
from slipstick.typing import Array


@part
def normal_force(p: Planar, arcs: Array, grid: Grid, F: Array, dF: Array) -> float:
    """Normal force (L,) and its derivatives (L, columns); returns the length of contact."""
    L = 2 * grid.n + 1
    q = 3 * L
    W, edge = np.zeros((L, L)), np.zeros((2, 2, grid.top + 4))
    C, S, length = np.zeros(grid.top + 4), np.zeros(grid.top + 4), 0.0
    for k in range(arcs.shape[0]):
        length += arcs[k, 1] - arcs[k, 0]
        if arcs[k, 2] < 0.5:
            for end in range(2):
                powers(arcs[k, end], grid.top, edge[end, 0], edge[end, 1])
            for i in range(grid.top):
                C[i] += (edge[1, 1, i] - edge[0, 1, i]) / (i + 1.0)
                S[i] += (edge[0, 0, i] - edge[1, 0, i]) / (i + 1.0)
    if length == 0.0:
        return 0.0
    fill_matrix(length, C, S, grid, W)
    for i in range(L):
        for j in range(L):
            dF[i, 2 * L + j] = p.kn * W[i, j]
            dF[i, q + KN] += W[i, j] * p.Y[j]
        F[i] = p.kn * dF[i, q + KN]
        dF[i, q + GAP] = -p.kn * W[i, 0]
    return length


@inlined
def force_row(p: Planar, depth: float, c: float, s: float, H: Array, angle: Array, row: Array) -> None:
    """Both forces while slipping and their derivatives, from those of the angle: two rows (1 + columns), joined."""
    L, limit = H.size, p.b * depth
    columns = 3 * L + COLUMNS
    for r in range(2):
        start = r * (columns + 1)
        along, across = (c, -limit * s) if r == 0 else (s, limit * c)
        row[start] = limit * along
        for j in range(columns):
            row[start + 1 + j] = across * angle[j]
        first = start + 1 + 2 * L
        for j in range(L):
            row[first + j] += p.b * along * H[j]
        first = start + 1 + 3 * L
        row[first + MU] += limit / p.mu * along
        row[first + KN] += limit / p.kn * along
        row[first + GAP] -= p.b * along


@inlined
def divide(J: Array, B: Array) -> None:
    """``B = J^-1 B`` of a panel, (STAGES, STAGES + 1); both are overwritten."""
    for k in range(STAGES):
        J[k, k] = 1.0 / J[k, k]
        for i in range(k + 1, STAGES):
            q = J[i, k] * J[k, k]
            for j in range(k + 1, STAGES):
                J[i, j] -= q * J[k, j]
            for j in range(STAGES + 1):
                B[i, j] -= q * B[k, j]
    for k in range(STAGES - 1, -1, -1):
        for i in range(k + 1, STAGES):
            for j in range(STAGES + 1):
                B[k, j] -= J[k, i] * B[i, j]
        for j in range(STAGES + 1):
            B[k, j] *= J[k, k]


@part
def differentiate(
    p: Planar, pieces: Pieces, count: int, arcs: Array, grid: Grid, work: Workspace
) -> tuple[Array, Array, Array]:
    """Friction force (2, L) of a period, its derivatives (2, L, columns), those of the force at its end (2, columns).

    The last two columns are those of the force at the start of the period.
    """
    L, z = 2 * grid.n + 1, STAGES - 1
    columns, q = 3 * L + COLUMNS, 3 * L
    F, dF = np.zeros((2, L)), np.zeros((2, L, columns))
    D = np.zeros((2, columns))
    D[0, q + F1], D[1, q + F2] = 1.0, 1.0
    turn = np.zeros(columns)
    H, dH, bases, o = np.zeros(L), np.zeros(L), np.zeros((STAGES, L)), work.state
    edge = np.zeros((2, 2, grid.top + 4))
    h, hv, W = np.zeros(L), np.zeros(L), np.zeros((L, L))
    C, S, moved = np.zeros(grid.top + 4), np.zeros(grid.top + 4), np.zeros((2, columns))
    stick = 0.0
    # slip: rows of both forces with their derivatives at BLOCK nodes, summed with their weights by one product
    wide = columns + 1
    rows, weighted = work.rows, work.weighted
    sums, angles = np.zeros((L, 2 * wide)), np.zeros((STAGES, columns))
    rates, J, B = np.zeros((STAGES, columns)), np.zeros((STAGES, STAGES)), np.zeros((STAGES, STAGES + 1))
    filled, was_slip, opened = 0, False, arcs.shape[0] == 0 or arcs[0, 2] < 0.5
    for piece in range(count):
        kind, a, b = pieces.kind[piece], pieces.at[piece, 0], pieces.at[piece, 1]
        f1, f2 = pieces.at[piece, 2], pieces.at[piece, 3]
        fresh = opened and (piece == 0 or pieces.at[piece - 1, 1] < a - 1e-15 or pieces.kind[piece - 1] == LAST_SLIP)
        if fresh:
            D[:] = 0.0
            basis_row(a, grid, work, H, dH)
            evaluate_motion(p, a, grid, work, o)
            if kind == STICK:
                for r in range(2):
                    over = p.kt * o[2 + r] / o[5]
                    for j in range(L):
                        D[r, 2 * L + j] = over * H[j]
                    D[r, q + GAP] = -over
        if kind == STICK:
            powers(a, grid.top, edge[0, 0], edge[0, 1])
            powers(b, grid.top, edge[1, 0], edge[1, 1])
            fill_vectors(b - a, edge[0], edge[1], grid, h, hv)
            for i in range(grid.top):
                C[i] += edge[1, 1, i] - edge[0, 1, i]
                S[i] += edge[0, 0, i] - edge[1, 0, i]
            stick += b - a
            basis_row(a, grid, work, H, dH)
            evaluate_motion(p, a, grid, work, o)
            x1, x2 = o[0] - p.v1 * a, o[1] - p.v2 * a
            for r in range(2):
                for j in range(columns):
                    moved[r, j] = D[r, j]
                for j in range(1, L):
                    moved[r, r * L + j] -= p.kt * H[j]
                moved[r, q + KT] -= x1 if r == 0 else x2
                constant = (f1 - p.kt * x1) if r == 0 else (f2 - p.kt * x2)
                v = p.v1 if r == 0 else p.v2
                for i in range(L):
                    F[r, i] += constant * h[i] + p.kt * v * hv[i]
                    dF[r, i, q + V1 + r] += p.kt * hv[i]
                    dF[r, i, q + KT] += v * hv[i]
                    for j in range(columns):
                        dF[r, i, j] += h[i] * moved[r, j]
            basis_row(b, grid, work, H, dH)
            evaluate_motion(p, b, grid, work, o)
            for r in range(2):
                for j in range(columns):
                    D[r, j] = moved[r, j]
                for j in range(1, L):
                    D[r, r * L + j] += p.kt * H[j]
                v = p.v1 if r == 0 else p.v2
                D[r, q + V1 + r] += p.kt * (b - a)
                D[r, q + KT] += o[r] - v * b + v * (b - a)
            was_slip = False
            continue
        theta = pieces.at[piece, 4]
        if kind == LAST_SLIP:
            basis_row(0.5 * (a + b), grid, work, H, dH)
            angles[0] = 0.0
            force_row(p, pieces.rates[piece, 0, 2], np.cos(theta), np.sin(theta), H, angles[0], rows[filled])
            for j in range(L):
                weighted[filled, j] = (b - a) / pi * H[j]
            filled += 1
            was_slip = False
            D[:] = 0.0
        else:
            if fresh:
                speed = np.sqrt(o[2] * o[2] + o[3] * o[3])
                c, s = np.cos(theta), np.sin(theta)
                rate = onset_rate(p, speed, theta, o[5], grid, work)
                over = rate * p.b / (p.kt * speed)
                turn[:] = 0.0
                for j in range(L):
                    turn[j], turn[L + j], turn[2 * L + j] = -s * dH[j] / speed, c * dH[j] / speed, -over * H[j]
                turn[q + V1], turn[q + V2], turn[q + GAP] = -s / speed, c / speed, over
            elif not was_slip:
                c, s = np.cos(theta), np.sin(theta)
                evaluate_motion(p, a, grid, work, o)
                over = 1.0 / (p.b * o[4])
                for j in range(columns):
                    turn[j] = over * (c * D[1, j] - s * D[0, j])
            length = b - a
            for i in range(STAGES):
                basis_row(a + NODES[i] * length, grid, work, bases[i], dH)
                work.theta[i] = pieces.theta[piece, i]
                work.nodes[i] = pieces.rates[piece, i]
                work.cos[i], work.sin[i] = circle(work.theta[i])
                c, s, depth = work.cos[i], work.sin[i], work.nodes[i, 2]
                over = p.kt / (p.b * depth)
                g = over * (work.nodes[i, 1] * c - work.nodes[i, 0] * s)
                slope = -over * (work.nodes[i, 0] * c + work.nodes[i, 1] * s)
                by1, by2, by3 = -over * s, over * c, -g / depth
                for j in range(STAGES):
                    J[j, i] = -length * WEIGHTS[j, i] * slope
                    B[i, j] = length * WEIGHTS[i, j]
                B[i, STAGES] = 1.0
                for j in range(L):
                    rates[i, j], rates[i, L + j], rates[i, 2 * L + j] = by1 * dH[j], by2 * dH[j], by3 * bases[i, j]
                rates[i, q + V1], rates[i, q + V2] = by1, by2
                rates[i, q + KT], rates[i, q + MU], rates[i, q + KN] = g / p.kt, -g / p.mu, -g / p.kn
                rates[i, q + GAP] = -by3
            for i in range(STAGES):
                J[i, i] += 1.0
            divide(J, B)
            for i in range(STAGES):  # angles = J^-1 (1 turn + length A rates)
                for j in range(columns):
                    total = B[i, STAGES] * turn[j]
                    for k in range(STAGES):
                        total += B[i, k] * rates[k, j]
                    angles[i, j] = total
                force_row(p, work.nodes[i, 2], work.cos[i], work.sin[i], bases[i], angles[i], rows[filled])
                weight = length * WEIGHTS[z, i] / pi
                for j in range(L):
                    weighted[filled, j] = weight * bases[i, j]
                filled += 1
            for j in range(columns):
                turn[j], D[0, j], D[1, j] = angles[z, j], rows[filled - 1, 1 + j], rows[filled - 1, wide + 1 + j]
            was_slip = True
        if filled > BLOCK - STAGES:
            sums += np.dot(weighted[:filled].T, rows[:filled])
            filled = 0
    if filled > 0:
        sums += np.dot(weighted[:filled].T, rows[:filled])
    sums[0] *= 0.5
    for i in range(grid.top):
        C[i] /= i + 1.0
        S[i] /= i + 1.0
    fill_matrix(stick, C, S, grid, W)
    for r in range(2):
        X = p.X1 if r == 0 else p.X2
        for i in range(L):
            moves = 0.0
            for j in range(1, L):
                moves += W[i, j] * X[j]
                dF[r, i, r * L + j] += p.kt * W[i, j]
            F[r, i] += p.kt * moves + sums[i, r * wide]
            dF[r, i, q + KT] += moves
            for j in range(columns):
                dF[r, i, j] += sums[i, r * wide + 1 + j]
    return F, dF, D
