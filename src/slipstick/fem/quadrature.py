"""Quadrature on reference elements: points (n, dimension) and weights (n,) whose sum is the reference measure.

Intervals are [-1, 1], triangles and tetrahedra have unit legs, a wedge is triangle x [-1, 1], and a pyramid has the
base [-1, 1]^2 at z = 0 and its apex at z = 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from slipstick.typing import Array


@dataclass(frozen=True, kw_only=True)
class Rule:
    """Quadrature points (n, dimension) and weights (n,)."""

    points: Array
    weights: Array


def gauss(n: int, dimension: int) -> Rule:
    """Tensor Gauss-Legendre rule with ``n`` points each way, exact to degree 2 n - 1."""
    x, w = np.polynomial.legendre.leggauss(n)
    points = np.stack(np.meshgrid(*[x] * dimension, indexing="ij"), axis=-1).reshape(-1, dimension)
    factors = np.stack(np.meshgrid(*[w] * dimension, indexing="ij"), axis=-1).reshape(-1, dimension)
    return Rule(points=points, weights=factors.prod(axis=1))


def triangle(n: int) -> Rule:
    """Symmetric rule of 1, 3 or 7 points, exact to degree 1, 2, 5 (Radon 1948)."""
    root = sqrt(15.0)
    orbits = {
        1: [(1 / 3, 1.0)],
        3: [(1 / 6, 1 / 3)],
        7: [(1 / 3, 9 / 40), ((6 - root) / 21, (155 - root) / 1200), ((6 + root) / 21, (155 + root) / 1200)],
    }[n]
    points, weights = [], []
    for a, weight in orbits:
        corners = {(a, a), (1 - 2 * a, a), (a, 1 - 2 * a)} if abs(a - 1 / 3) > 1e-9 else {(a, a)}
        points += sorted(corners)
        weights += [weight / 2] * len(corners)
    return Rule(points=np.array(points), weights=np.array(weights))


def tetrahedron(n: int) -> Rule:
    """Symmetric rule of 1, 4 or 15 points, exact to degree 1, 2, 5 (Stroud 1971, T3:5-1)."""
    root = sqrt(15.0)
    if n == 1:
        barycentric, weights = [[0.25] * 4], [1.0]
    elif n == 4:
        barycentric, weights = _vertex_orbit((5 - sqrt(5.0)) / 20), [0.25] * 4
    elif n == 15:
        barycentric = [[0.25] * 4, *_vertex_orbit((7 - root) / 34), *_vertex_orbit((7 + root) / 34)]
        barycentric += _edge_orbit((10 - 2 * root) / 40)
        light, heavy = (2665 - 14 * root) / 37800, (2665 + 14 * root) / 37800
        weights = [16 / 135] + [heavy] * 4 + [light] * 4 + [20 / 378] * 6
    else:
        raise KeyError(n)
    return Rule(points=np.array(barycentric)[:, 1:], weights=np.array(weights) / 6.0)


def prism(n_triangle: int, n_height: int) -> Rule:
    """Triangle rule times Gauss rule along the height."""
    flat, tall = triangle(n_triangle), gauss(n_height, 1)
    points = np.hstack([np.tile(flat.points, (n_height, 1)), np.repeat(tall.points, n_triangle, axis=0)])
    return Rule(points=points, weights=np.outer(tall.weights, flat.weights).ravel())


def pyramid(n: int) -> Rule:
    """Conical product rule, n^3 points, exact to degree 2 n - 1: Gauss-Legendre across, Gauss-Jacobi (2, 0) upwards."""
    from scipy.special import roots_jacobi

    flat = gauss(n, 2)
    s, w = roots_jacobi(n, 2.0, 0.0)
    z = (1.0 + np.repeat(s, n * n)) / 2.0
    across = np.tile(flat.points, (n, 1)) * (1.0 - z)[:, None]
    return Rule(points=np.hstack([across, z[:, None]]), weights=np.outer(w / 8.0, flat.weights).ravel())


def _vertex_orbit(a: float) -> list[list[float]]:
    return [[1 - 3 * a if i == j else a for j in range(4)] for i in range(4)]


def _edge_orbit(a: float) -> list[list[float]]:
    b = 0.5 - a
    return [[a if k in (i, j) else b for k in range(4)] for i in range(4) for j in range(i)]
