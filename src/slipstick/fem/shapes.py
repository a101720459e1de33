"""Shape functions on reference elements, from the polynomial space and the nodes that define them.

Every element here is *nodal*: a space of functions and as many points, ``N_i(point_j) = delta_ij``. The space is a
list of exponents of monomials ``x^a y^b z^c``; the pyramids add ``x y / (1 - z)`` times a polynomial, the rational term
which makes them conform with the hexahedra and tetrahedra next to them (Bedrosian 1992).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from slipstick.typing import Array

Exponents = tuple[tuple[int, ...], ...]


def total_degree(dimension: int, degree: int) -> Exponents:
    """Exponents of all monomials of total degree up to ``degree`` (simplices)."""
    return tuple(e for e in product(range(degree + 1), repeat=dimension) if sum(e) <= degree)


def serendipity(dimension: int, degree: int) -> Exponents:
    """Exponents of superlinear degree up to ``degree`` (powers of one do not count): quadrilaterals, hexahedra."""
    every = product(range(degree + 1), repeat=dimension)
    return tuple(e for e in every if sum(power for power in e if power > 1) <= degree)


def wedge(degree: int) -> Exponents:
    """Exponents of the triangular prism, linear (6) or serendipity quadratic (15)."""
    flat = [(*e, c) for e in total_degree(2, degree) for c in (0, 1)]
    return tuple(flat + [(*e, 2) for e in total_degree(2, 1) if degree == 2])


@dataclass(frozen=True, kw_only=True)
class NodalBasis:
    """Space of ``exponents`` (and ``rational`` ones, times ``x y / (1 - z)``) with nodes (n, dimension).

    >>> line = NodalBasis(nodes=np.array([[-1.0], [1.0]]), exponents=((0,), (1,)))
    >>> values, gradients = line(np.array([[0.0], [1.0]]))
    >>> values
    array([[0.5, 0.5],
           [0. , 1. ]])
    """

    nodes: Array
    exponents: Exponents
    rational: Exponents = ()

    def __call__(self, points: Array) -> tuple[Array, Array]:
        """Values (n_points, n_nodes) and gradients (n_points, n_nodes, dimension) at points (n_points, dimension)."""
        values, gradients = self._space(points)
        coefficients = self._coefficients()
        return values @ coefficients, np.einsum("qfd,fn->qnd", gradients, coefficients)

    def _coefficients(self) -> Array:
        """Coefficients of each shape function; dyadic fractions, so rounding to 1/64 removes the inversion's noise."""
        return np.round(np.linalg.inv(self._space(self.nodes)[0]) * 64.0) / 64.0

    def _space(self, points: Array) -> tuple[Array, Array]:
        values, gradients = _monomials(points, self.exponents)
        if not self.rational:
            return values, gradients
        factor, slope = _pyramid_term(points)
        extra, extra_slope = _monomials(points, self.rational)
        product_slope = extra_slope * factor[:, None, None] + extra[:, :, None] * slope[:, None, :]
        return np.hstack([values, extra * factor[:, None]]), np.concatenate([gradients, product_slope], axis=1)


def _monomials(points: Array, exponents: Exponents) -> tuple[Array, Array]:
    powers = np.asarray(exponents)
    values = np.prod(points[:, None, :] ** powers, axis=2)
    gradients = np.empty((len(points), *powers.shape))
    for axis in range(powers.shape[1]):
        lowered = powers.copy()
        lowered[:, axis] = np.maximum(powers[:, axis] - 1, 0)
        gradients[:, :, axis] = powers[:, axis] * np.prod(points[:, None, :] ** lowered, axis=2)
    return values, gradients


def _pyramid_term(points: Array) -> tuple[Array, Array]:
    """``x y / (1 - z)`` and its gradient; both taken as zero at the apex, where x = y = 0."""
    x, y, z = points.T
    height = np.where(z < 1.0, 1.0 - z, 1.0)
    return x * y / height, np.stack([y / height, x / height, x * y / height**2], axis=1)
