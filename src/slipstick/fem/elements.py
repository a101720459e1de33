"""The solid elements and their faces, with their quadrature.

Node order is the one of VTK and of CalculiX/Abaqus (C3D8, C3D20, C3D6, C3D15, C3D4, C3D10), which agree: corners of the
bottom, corners of the top, then the middles of the bottom, of the top, of the vertical edges; the middles of
a tetrahedron lie on edges 12, 23, 31, 14, 24, 34; a pyramid has its base first, its apex fifth. In a positive element
the bottom runs counter-clockwise seen from the top. Faces are numbered as CalculiX does (S1, S2, ...) and run
counter-clockwise seen from outside, so that their normals point outwards.

Integration: full (hex8 2x2x2, hex20 3x3x3, wedge15 9, tet10 4 points); mass with the rule that is exact on
straight-sided elements (hex20 27, wedge15 21, tet10 15 points). hex20r is hex20 with 2x2x2 points for the stiffness, as
C3D20R of Abaqus and SOLID186 of Ansys (Theory Reference 13.186) with their mass of 27 points; alone it has six motions
without strain at those points besides the rigid ones (``hourglass_warnings`` in geometry.py). The linear elements lock
in bending: use the quadratic ones for stress and vibration (``quadratic`` in refine.py turns a linear mesh into a
quadratic one).

Two bricks of eight nodes do not lock. hex8r has the mean strain of its volume alone, and a small stiffness against the
twelve hourglass motions that are left (Flanagan and Belytschko, Int. J. Numer. Meth. Eng. 17 (1981) 679). hex8i has
three more shape functions, ``1 - xi^2`` and so on, whose nine amplitudes are condensed in each element (Taylor,
Beresford and Wilson, Int. J. Numer. Meth. Eng. 10 (1976) 1211).

Reference elements: intervals are [-1, 1], triangles and tetrahedra have unit legs, a wedge is triangle x [-1, 1], and a
pyramid has the base [-1, 1]^2 at z = 0 and its apex at z = 1. The weights of a rule sum to the reference measure.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
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
    """Shape functions from a polynomial space and as many nodes (n, dimension): ``N_i(point_j) = delta_ij``.

    The space is that of monomials ``x^a y^b z^c`` by their ``exponents``; pyramids add ``rational`` ones, times
    ``x y / (1 - z)``: they make them conform with the hexahedra and tetrahedra next to them (Bedrosian 1992).

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


Tuples = tuple[tuple[int, ...], ...]


@dataclass(frozen=True, kw_only=True)
class Element:
    """A solid element (dimension 3) or a face (dimension 2): shape functions, rules, edges and faces.

    ``faces`` holds (face type, local nodes) in CalculiX order; ``edges`` the corner pairs in the order of their
    middles. ``mean_strain``: the stiffness is that of the mean strain, and of hourglass motions; ``incompatible``: with
    three more shape functions of its own.
    """

    name: str
    basis: NodalBasis
    n_corners: int
    edges: Tuples
    faces: tuple[tuple[str, tuple[int, ...]], ...] = ()
    rule: Rule
    mass_rule: Rule
    mean_strain: bool = False
    incompatible: bool = False

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.basis.nodes)

    @cached_property
    def at_rule(self) -> tuple[Array, Array]:
        """Shape functions and gradients at the points of ``rule``."""
        return self.basis(self.rule.points)

    @cached_property
    def at_mass_rule(self) -> tuple[Array, Array]:
        """Shape functions and gradients at the points of ``mass_rule``."""
        return self.basis(self.mass_rule.points)


_TRIANGLE = ((0, 0), (1, 0), (0, 1))
_SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_CORNERS = {
    "tri": _TRIANGLE,
    "quad": _SQUARE,
    "tet": ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "hex": tuple((*p, z) for z in (-1, 1) for p in _SQUARE),
    "wedge": tuple((*p, z) for z in (-1, 1) for p in _TRIANGLE),
    "pyramid": (*((*p, 0) for p in _SQUARE), (0, 0, 1)),
}
_EDGES: dict[str, Tuples] = {
    "tri": ((0, 1), (1, 2), (2, 0)),
    "quad": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tet": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "hex": ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
    "wedge": ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    "pyramid": ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
}
_FACES: dict[str, Tuples] = {
    "tri": (),
    "quad": (),
    "tet": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    "hex": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
}


def _with_middles(family: str, face: tuple[int, ...]) -> tuple[int, ...]:
    numbers = {frozenset(edge): len(_CORNERS[family]) + i for i, edge in enumerate(_EDGES[family])}
    around = zip(face, face[1:] + face[:1], strict=True)
    return face + tuple(numbers[frozenset(edge)] for edge in around)


def _element(
    name: str, family: str, degree: int, basis: tuple[tuple[tuple[int, ...], ...], ...], rules: tuple[Rule, Rule]
) -> Element:
    nodes = np.array(_CORNERS[family], dtype=float)
    faces = _FACES[family]
    if degree == 2:
        nodes = np.vstack([nodes, [nodes[list(edge)].mean(axis=0) for edge in _EDGES[family]]])
        faces = tuple(_with_middles(family, face) for face in faces)
    kinds = {3: "tri3", 4: "quad4", 6: "tri6", 8: "quad8"}
    return Element(
        name=name,
        basis=NodalBasis(nodes=nodes, exponents=basis[0], rational=basis[1] if len(basis) > 1 else ()),
        n_corners=len(_CORNERS[family]),
        edges=_EDGES[family],
        faces=tuple((kinds[len(face)], face) for face in faces),
        rule=rules[0],
        mass_rule=rules[1],
    )


ELEMENTS: dict[str, Element] = {
    e.name: e
    for e in (
        _element("hex8", "hex", 1, (serendipity(3, 1),), (gauss(2, 3), gauss(2, 3))),
        replace(_element("hex8r", "hex", 1, (serendipity(3, 1),), (gauss(2, 3), gauss(2, 3))), mean_strain=True),
        replace(_element("hex8i", "hex", 1, (serendipity(3, 1),), (gauss(2, 3), gauss(2, 3))), incompatible=True),
        _element("hex20", "hex", 2, (serendipity(3, 2),), (gauss(3, 3), gauss(3, 3))),
        _element("hex20r", "hex", 2, (serendipity(3, 2),), (gauss(2, 3), gauss(3, 3))),
        _element("tet4", "tet", 1, (total_degree(3, 1),), (tetrahedron(1), tetrahedron(4))),
        _element("tet10", "tet", 2, (total_degree(3, 2),), (tetrahedron(4), tetrahedron(15))),
        _element("wedge6", "wedge", 1, (wedge(1),), (prism(3, 2), prism(3, 2))),
        _element("wedge15", "wedge", 2, (wedge(2),), (prism(3, 3), prism(7, 3))),
        _element("pyramid5", "pyramid", 1, (total_degree(3, 1), ((0, 0, 0),)), (pyramid(2), pyramid(3))),
        _element(
            "pyramid13", "pyramid", 2, (total_degree(3, 2), ((0, 0, 0), (1, 0, 0), (0, 1, 0))), (pyramid(3), pyramid(4))
        ),
    )
}
"""Solid elements by name."""

FACES: dict[str, Element] = {
    e.name: e
    for e in (
        _element("tri3", "tri", 1, (total_degree(2, 1),), (triangle(3), triangle(3))),
        _element("tri6", "tri", 2, (total_degree(2, 2),), (triangle(7), triangle(7))),
        _element("quad4", "quad", 1, (serendipity(2, 1),), (gauss(2, 2), gauss(2, 2))),
        _element("quad8", "quad", 2, (serendipity(2, 2),), (gauss(3, 2), gauss(3, 2))),
    )
}
"""Faces by name."""

LINEAR_TO_QUADRATIC = {
    "hex8": "hex20",
    "tet4": "tet10",
    "wedge6": "wedge15",
    "pyramid5": "pyramid13",
    "hex8r": "hex20",
    "hex8i": "hex20",
}
"""Names of the linear elements and of the quadratic ones with the same corners."""

ALIKE = {"hex20r": "hex20", "hex8r": "hex8", "hex8i": "hex8"}
"""Elements with another stiffness, and those they are like in everything else."""

LOCKING = tuple(kind for kind in LINEAR_TO_QUADRATIC if kind not in ALIKE)
"""Linear elements that are too stiff in bending."""

LINEAR = {quadratic: linear for linear, quadratic in LINEAR_TO_QUADRATIC.items() if linear in LOCKING}
"""Names of the quadratic elements and of the linear ones with the same corners."""
