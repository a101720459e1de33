"""Slip: the angle of the friction force by collocation, panel by panel, and where slip begins and ends.

Radau IIA with ``STAGES`` nodes: E. Hairer and G. Wanner, Solving Ordinary Differential Equations II (1996), IV.5.
"""

from __future__ import annotations

from math import comb, pi

import numpy as np
from scipy.special import roots_jacobi

from slipstick.contact.kernel.planar.motion import LAST_SLIP, STAGES, Planar, Workspace, evaluate_motion
from slipstick.trig.basis import Grid, basis, circle
from slipstick.trig.compiled import compiled, inlined
from slipstick.typing import Array

_NEWTON = 14
"""Newton steps of a panel, at most."""
INSTANT = 1e-15
"""Length (rad) that is rounding."""


def radau(stages: int) -> tuple[Array, Array, Array, Array]:
    """Nodes, weights ``A``, those of the last two Legendre coefficients of the polynomial through the nodes, and of all
    coefficients but the constant one of that through the start too (rows: powers 1, 2, ...; columns: values at the
    nodes less the start's)."""
    inner, _ = roots_jacobi(stages - 1, 1.0, 0.0)
    nodes = np.append(0.5 * (inner + 1.0), 1.0)
    vander = np.vander(nodes, stages, increasing=True)
    integrals = np.vander(nodes, stages + 1, increasing=True)[:, 1:] / np.arange(1, stages + 1)
    through_start = np.linalg.inv(vander * nodes[:, None])
    weights = np.ascontiguousarray(np.linalg.solve(vander.T, integrals.T).T)
    last = np.linalg.inv(np.polynomial.legendre.legvander(2.0 * nodes - 1.0, stages - 1))[-2:]
    return nodes, weights, np.ascontiguousarray(last[::-1]) * comb(2 * stages - 2, stages - 1), through_start


NODES, WEIGHTS, TOP, POWERS = radau(STAGES)


def angle_within(first: float, theta: Array, way: Array, kind: int) -> Array:
    """Angles at fractions ``way`` (0 to 1) of a piece of slip: the polynomial through its start and its nodes."""
    if kind == LAST_SLIP:
        return np.full(way.shape, first)
    nodes, angles = np.concatenate([[0.0], NODES]), np.concatenate([[first], theta])
    powers_of = np.vander(nodes, increasing=True)
    return np.asarray(np.vander(way, nodes.size, increasing=True) @ np.linalg.solve(powers_of, angles), dtype=float)


@compiled
def evaluate_nodes(p: Planar, t: float, h: float, grid: Grid, work: Workspace) -> None:
    """Rates and penetration at the nodes of a panel, in ``work.nodes``."""
    a, c, s, nodes = p.series, work.node_cos, work.node_sin, work.nodes
    for i in range(STAGES):
        basis(t + NODES[i] * h, grid, c[i], s[i])
        nodes[i, 0], nodes[i, 1], nodes[i, 2], nodes[i, 3] = p.v1, p.v2, p.Y[0], 0.0
    for j in range(grid.n):
        for i in range(STAGES):
            cj, sj = c[i, j], s[i, j]
            for k in range(4):
                nodes[i, k] += a[j, k] * cj + a[j, 6 + k] * sj


@compiled
def begin_slip(p: Planar, t: float, grid: Grid, work: Workspace) -> tuple[bool, float, float]:
    """Where a contact closes: whether it slips at once, the angle, and its rate."""
    o = work.state
    evaluate_motion(p, t, grid, work, o)
    speed = np.sqrt(o[2] * o[2] + o[3] * o[3])
    if not p.kt * speed > p.b * o[5]:
        return False, 0.0, 0.0
    theta = np.arctan2(o[3], o[2])
    return True, theta, onset_rate(p, speed, theta, o[5], grid, work)


@compiled
def onset_rate(p: Planar, speed: float, theta: float, dy: float, grid: Grid, work: Workspace) -> float:
    """``theta'`` where a contact closes slipping; the workspace holds the basis of that time.

    The angle turns at ``kappa / (1 + kappa)`` of the rate at which the direction of the motion turns.
    """
    a1, a2 = 0.0, 0.0
    for j in range(grid.n):
        i, k = 2 * j + 1, grid.orders[j]
        a1 -= k * k * (p.X1[i] * work.c[j] + p.X1[i + 1] * work.s[j])
        a2 -= k * k * (p.X2[i] * work.c[j] + p.X2[i + 1] * work.s[j])
    kappa = p.kt * speed / (p.b * dy) if dy > 0.0 else 1e300
    turn = (a2 * np.cos(theta) - a1 * np.sin(theta)) / speed
    return turn / (1.0 + 1.0 / kappa)


@compiled
def solve(J: Array, r: Array) -> None:
    """``r = J^-1 r`` of a panel by elimination; both are overwritten."""
    for k in range(STAGES):
        J[k, k] = 1.0 / J[k, k]
        for i in range(k + 1, STAGES):
            q = J[i, k] * J[k, k]
            for j in range(k + 1, STAGES):
                J[i, j] -= q * J[k, j]
            r[i] -= q * r[k]
    for k in range(STAGES - 1, -1, -1):
        total = r[k]
        for j in range(k + 1, STAGES):
            total -= J[k, j] * r[j]
        r[k] = total * J[k, k]


@inlined
def turning(p: Planar, work: Workspace) -> None:
    """``theta'`` at the nodes, and its derivative by theta."""
    for i in range(STAGES):
        d1, d2 = work.nodes[i, 0], work.nodes[i, 1]
        over = p.kt / (p.b * work.nodes[i, 2])
        c, s = circle(work.theta[i])
        work.cos[i], work.sin[i] = c, s
        work.g[i] = over * (d2 * c - d1 * s)
        work.slope[i] = -over * (d1 * c + d2 * s)


@compiled
def collocate(p: Planar, start: float, h: float, small: float, work: Workspace) -> bool:
    """Angles at the nodes of a panel of length ``h`` whose rates are known; ``work.theta`` holds the first guess.

    Newton's steps end below ``small``, whose square is rounding. False: they do not converge.
    """
    theta, J, r = work.theta, work.jacobian, work.residual
    for _ in range(_NEWTON):
        turning(p, work)
        for i in range(STAGES):
            total = theta[i] - start
            for j in range(STAGES):
                total -= h * WEIGHTS[i, j] * work.g[j]
                J[i, j] = -h * WEIGHTS[i, j] * work.slope[j]
            J[i, i] += 1.0
            r[i] = total
        solve(J, r)
        size = 0.0
        for i in range(STAGES):
            theta[i] -= r[i]
            size += abs(r[i])
        if size < small:
            turning(p, work)
            return True
        if not size < 12.0:
            return False
    return False


@inlined
def slip_rate(p: Planar, d1: float, d2: float, dy: float, theta: float) -> float:
    """``lambda``, the velocity of slip."""
    return d1 * np.cos(theta) + d2 * np.sin(theta) - p.b * dy / p.kt


@inlined
def slip_rate_at_end(p: Planar, work: Workspace) -> float:
    """``lambda`` at the last node of a panel."""
    z = STAGES - 1
    along = work.nodes[z, 0] * work.cos[z] + work.nodes[z, 1] * work.sin[z]
    return along - p.b * work.nodes[z, 3] / p.kt


@compiled
def panel(p: Planar, t: float, start: float, h: float, small: float, grid: Grid, work: Workspace) -> bool:
    """Collocation from a time and angle on, over ``h``; ``work.theta`` holds the first guess."""
    evaluate_nodes(p, t, h, grid, work)
    if collocate(p, start, h, small, work):
        return True
    for i in range(STAGES):
        work.theta[i] = start
    return collocate(p, start, h, small, work)


@inlined
def longest_panel(tolerance: float, grid: Grid) -> float:
    """Longest panel (rad) whose nodes integrate the force to a tolerance."""
    return pi / (0.5 * grid.top + 1.0) * min(0.5, max(0.25, 0.55 * (1e8 * tolerance) ** (1.0 / (2 * STAGES - 1))))


@inlined
def polynomial(x: float, first: float, coefficients: Array) -> tuple[float, float]:
    """Value and derivative of a panel's polynomial at the fraction ``x`` of it."""
    value, rate = 0.0, 0.0
    for k in range(STAGES - 1, -1, -1):
        rate = rate * x + value
        value = value * x + coefficients[k]
    return first + x * value, value + x * rate


@compiled
def slip_reversal(p: Planar, first: float, work: Workspace) -> float:
    """Fraction of the panel just computed after which the slip velocity, ``first`` at its start, is negative; or 2.

    It is a root of the polynomial through the nodes, which stays in ``work.speed``.
    """
    speed, coefficients = work.speed[0], work.speed[1]
    for i in range(STAGES):
        along = work.nodes[i, 0] * work.cos[i] + work.nodes[i, 1] * work.sin[i]
        speed[i] = along - p.b * work.nodes[i, 3] / p.kt
    rate = 0.0
    for k in range(STAGES):
        coefficients[k] = 0.0
        for i in range(STAGES):
            coefficients[k] += POWERS[k, i] * (speed[i] - first)
        rate += (k + 1.0) * coefficients[k]
    low, high, at, value = 0.0, 2.0, 0.0, first
    for i in range(-1, STAGES):  # -1 is the start
        if i >= 0 and speed[i] < 0.0:
            low, high = at, NODES[i]
            break
        if i < 0:
            dips = coefficients[0] < 0.0 and speed[0] >= first
        elif i == STAGES - 1:
            dips = speed[i] < value and rate > 0.0
        else:
            dips = speed[i] < value and speed[i] < speed[i + 1]
        if dips:  # the lowest point, by bisection
            left, right = at, NODES[min(i + 1, STAGES - 1)]
            for _ in range(40):
                middle = 0.5 * (left + right)
                _, rises = polynomial(middle, first, coefficients)
                if rises > 0.0:
                    right = middle
                else:
                    left = middle
            least, _ = polynomial(left, first, coefficients)
            if least < 0.0:
                low, high = at, left
                break
        if i >= 0:
            at, value = NODES[i], speed[i]
    if high > 1.0:
        return 2.0
    x = 0.5 * (low + high)
    for _ in range(60):
        value, rate = polynomial(x, first, coefficients)
        if value >= 0.0:
            low = x
        else:
            high = x
        new = x - value / rate if rate < 0.0 else -1.0
        if not low < new < high:
            new = 0.5 * (low + high)
        moved = abs(new - x)
        x = new
        if moved < 1e-14:
            break
    return x


@compiled
def end_of_slip(
    p: Planar, t: float, start: float, h: float, first: float, small: float, grid: Grid, work: Workspace
) -> tuple[float, bool]:
    """Length of slip in the panel just computed, which is collocated again up to its end; and whether slip ends.

    ``first`` is the slip velocity at its start. Force and its rate are continuous at the end: an error of the time
    enters the force by its square.
    """
    x = slip_reversal(p, first, work)
    if x > 1.0:
        return h, False
    if first <= 0.0 and x * h < INSTANT:
        return 0.0, True
    coefficients = work.speed[2]
    for k in range(STAGES):
        coefficients[k] = 0.0
        for i in range(STAGES):
            coefficients[k] += POWERS[k, i] * (work.theta[i] - start)
    for i in range(STAGES):
        work.theta[i], _ = polynomial(NODES[i] * x, start, coefficients)
    last = 1.0
    for _ in range(8):
        if not panel(p, t, start, x * h, small, grid, work):
            break
        _, rate = polynomial(x, first, work.speed[1])
        move = -slip_rate_at_end(p, work) / rate if rate < 0.0 else 0.0
        if abs(move) < 1e-10 or abs(move) > 0.5 * last or not 0.0 < x + move < 1.0:
            break
        last = abs(move)
        x += move
    return x * h, True
