"""Matrix-free Jacobians: products, a preconditioner P, and cheap approximate products."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from slipstick.solve.linear.jacobian import OF_CORRECTIONS, Bordered, Jacobian
from slipstick.typing import Array, ComplexArray

# Solutions, by corrections with the approximation of J; all are relative residuals or ratios of residuals. A residual r
# is measured by ``P^-1 r``, the error of the solution as far as P is J: beside stiff contacts r itself tells nothing.
TOLERANCE = 1e-8
"""Residual of a solution."""
_APPROXIMATE = 3e-5
"""Residual of a solution with the approximation of J, whose own error is larger."""
_MIN_CONTRACTION = 0.1
"""Largest ratio of residuals after and before a correction; with a larger one GMRES on J itself takes over."""
_SAFETY = 0.1
"""Ratio to the tolerance of an expected residual that is not computed."""
_VARIATION = 30.0
"""Ratio of residuals after corrections of different right-hand sides and Jacobians (measured: 10)."""

# GMRES.
MOST_PRODUCTS = 250
"""Largest number of products: with more the preconditioner is useless, and the solution fails."""
_FAILED = 1e-3
"""Relative residual above which the solution failed."""
_SIGN_TOLERANCE = 1e-4
"""Relative residual for signs of determinants: outlying eigenvalues converge long before the solution does."""
_REAL = 1e-10
"""Imaginary part of a Ritz value over its magnitude that is rounding."""
_SEED = 20120601
"""Seed of the right-hand side of ``sign``: results repeat."""


class IterativeJacobian(Jacobian):
    """Solved by corrections with an approximation of J for all right-hand sides, or by GMRES on ``P^-1 J``.

    A subclass defines products, the preconditioner ``P``, and approximate products ``nearby`` where these are cheap.

    Attributes
    ----------
    products
        Products taken by solutions so far; those with several columns count once.
    leaves
        Largest ratio of residuals after and before the first correction of a solution; None before the first one.
    """

    products: int = 0
    has_nearby: bool = False
    leaves: float | None = None
    _neighbour_leaves: float | None = None

    @abstractmethod
    def precondition(self, x: Array, *, transposed: bool = False) -> Array:
        """``P^-1 @ x`` (N,), or with the transposes."""

    @property
    @abstractmethod
    def preconditioner_sign(self) -> int:
        """Sign of the determinant of P; 0 where it is singular."""

    def nearby(self, x: Array) -> Array:
        """An approximation of ``J @ x`` (N,) that costs much less."""
        raise NotImplementedError

    @property
    def departing(self) -> NDArray[np.intp] | None:
        """Numbers (m,) of the only unknowns by which the approximation of J departs from P; None: any.

        ``P^-1`` times the approximation is ``I + B D``, D depending on these unknowns alone; it is known by
        ``departure`` and ``spread`` in place of ``nearby``, and solved for m unknowns.
        """
        return None

    def departure(self, x: Array) -> Array:
        """``D x`` (m,) for the departing unknowns."""
        raise NotImplementedError

    def spread(self, d: Array, *, alone: bool = False) -> Array:
        """``B d`` (N,), or its part at the departing unknowns ``alone`` (m,)."""
        raise NotImplementedError

    def spread_transposed(self, x: Array) -> Array:
        """``B^T x`` (m,)."""
        raise NotImplementedError

    def take_over(self, other: Jacobian) -> None:
        """Take over ``leaves`` of a neighbouring Jacobian, and its preconditioner where a subclass uses it."""
        if isinstance(other, IterativeJacobian):
            self._neighbour_leaves = other._neighbour_leaves if other.leaves is None else other.leaves

    def took(self, products: int, tolerance: float) -> bool:
        """Record the products of an approximate solution; whether P was replaced."""
        return False

    def _weighed(self, x: Array, power: int = 1) -> Array:
        """Unknowns (N,) or (N, k) in units in which their norm measures an error; power -1: the inverse."""
        return x

    @property
    def singular(self) -> bool:
        """Whether the preconditioner is exactly singular, without which nothing is solved."""
        return self.preconditioner_sign == 0

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution of ``J @ x = right``, or with its transpose; nan where the iteration fails."""
        if transposed:
            if right.ndim == 2:
                return np.column_stack([self.solve(column, transposed=True) for column in right.T])
            # the same eigenvalues, the preconditioner on the other side
            right = self.precondition(right, transposed=True)
            return self._iterate(
                lambda x: self.precondition(self.multiply(x, transposed=True), transposed=True), right
            ).x
        return self._corrected(right, TOLERANCE)

    def solve_correction(self, right: Array, to: float = OF_CORRECTIONS) -> Array:
        """Solution to a relative error, for right (N,) or (N, k): see ``Jacobian.solve_correction``.

        The first correction suffices, without a product of J, where those before left far less.
        """
        leaves = self._neighbour_leaves if self.leaves is None else self.leaves
        if leaves is None or not _VARIATION * leaves <= to:
            return self._corrected(right, to)
        columns = right if right.ndim == 2 else right[:, None]
        to = max(_APPROXIMATE, _SAFETY * to)
        x = np.column_stack([self._approximate(rest, to) for rest in self._errors(columns).T])
        self._record_products()
        return x.reshape(right.shape)

    def _corrected(self, right: Array, tolerance: float) -> Array:
        """Solution to a relative residual, corrected with the approximation of J until one more correction suffices.

        A product gives the residual after a correction, and so the expected residual after the next one, which is not
        computed.
        """
        b = right if right.ndim == 2 else right[:, None]
        rest = self._errors(b)
        x, size = np.zeros(b.shape), self._sizes(rest)
        x[:, ~np.isfinite(size)] = np.nan
        open_ = np.flatnonzero((size > 0.0) & np.isfinite(size))
        left = size
        while open_.size:
            x[:, open_] += np.column_stack([self._approximate(column) for column in rest[:, open_].T])
            rest = np.zeros_like(b)
            rest[:, open_] = self._errors(b[:, open_] - self.multiply(x[:, open_]))
            self.products += 1
            before, left = left, self._sizes(rest)
            if before is size:
                self._record_leaves(left[open_] / before[open_])
            left[left <= tolerance * size] = 0.0
            for i in open_[~(left[open_] <= _MIN_CONTRACTION * before[open_])]:
                if not np.isfinite(left[i]):
                    x[:, i], rest[:, i] = 0.0, self._errors(b[:, i])
                x[:, i] += self._by_gmres(rest[:, i], tolerance * size[i])
                left[i] = 0.0
            enough = left[open_] ** 2 <= _SAFETY * tolerance * size[open_] * before[open_]
            for i in open_[enough & (left[open_] > 0.0)]:
                x[:, i] += self._approximate(rest[:, i], max(_APPROXIMATE, _SAFETY * tolerance * size[i] / left[i]))
                left[i] = 0.0
            open_ = np.flatnonzero(left > 0.0)
        self._record_products()
        return x.reshape(right.shape)

    def _record_leaves(self, left: Array) -> None:
        """Record ratios of residuals after and before first corrections."""
        most = float(left.max())
        if self.leaves is None or not most <= self.leaves:
            self.leaves = most

    def _by_gmres(self, rest: Array, residual: float) -> Array:
        """Correction of a solution with ``P^-1 r = rest`` (N,), by GMRES on ``P^-1 J`` to the size of a residual."""
        weighed = self._weighed(rest)
        found = self._iterate(self._preconditioned, weighed, residual / float(np.linalg.norm(weighed)))
        if not self.has_nearby:
            self._taken.append((found.products, max(found.residual, TOLERANCE)))
        return self._weighed(found.x, -1)

    def _record_products(self) -> None:
        """Tell ``took`` what the solutions since the last time cost: P is the same all through a solution."""
        for products, tolerance in self._taken:
            if self.took(products, tolerance):
                break
        self._taken.clear()

    @cached_property
    def _taken(self) -> list[tuple[int, float]]:
        """Products of approximate solutions and the residuals they were asked for."""
        return []

    def _errors(self, residuals: Array) -> Array:
        """``P^-1 r`` of residuals (N,) or (N, k)."""
        if residuals.ndim == 1:
            return self.precondition(residuals)
        return np.column_stack([self.precondition(column) for column in residuals.T])

    def _sizes(self, errors: Array) -> Array:
        return np.asarray(np.linalg.norm(self._weighed(errors), axis=0))

    def _approximate(self, rest: Array, tolerance: float = _APPROXIMATE) -> Array:
        """An approximation of ``J^-1 r`` (N,), from ``P^-1 r``."""
        if not self.has_nearby:
            return rest
        x, found = self._found_nearby(rest, tolerance)
        self._taken.append((found.products, tolerance))
        return x

    def _found_nearby(self, rest: Array, tolerance: float) -> tuple[Array, Solved]:
        """The same with the result of GMRES."""
        if self.departing is not None:
            return self._found_departing(rest, tolerance, self.departing)
        found = gmres(self._preconditioned_nearby, self._weighed(rest), tolerance=tolerance, most=MOST_PRODUCTS)
        return self._weighed(found.x, -1), found

    def _found_departing(self, rest: Array, tolerance: float, at: NDArray[np.intp]) -> tuple[Array, Solved]:
        """Likewise, for the departing unknowns; the others follow."""

        def apply(x: Array) -> Array:
            return x + self.spread(self.departure(x), alone=True)

        whole, part = float(np.linalg.norm(self._weighed(rest))), float(np.linalg.norm(rest[at]))
        share = part / whole if part else 1.0
        found = gmres(apply, rest[at], tolerance=tolerance / share, most=MOST_PRODUCTS)
        x = rest - self.spread(self.departure(found.x))
        x[at] = found.x
        return x, replace(found, residual=found.residual * share)

    def _preconditioned(self, x: Array) -> Array:
        return self._weighed(self.precondition(self.multiply(self._weighed(x, -1))))

    def _preconditioned_nearby(self, x: Array) -> Array:
        return self._weighed(self.precondition(self.nearby(self._weighed(x, -1))))

    def _iterate(self, apply: Callable[[Array], Array], right: Array, tolerance: float = TOLERANCE) -> Solved:
        solved = gmres(apply, right, tolerance=tolerance, most=MOST_PRODUCTS)
        self.products += solved.products
        if not solved.residual <= max(_FAILED, tolerance):
            solved.x[...] = np.nan
        return solved

    def sign(self) -> int:
        """Sign of the determinant: that of P, turned for each negative eigenvalue of ``P^-1 J``.

        Most eigenvalues are close to 1; the others are Ritz values once the solution is found. The right-hand side has
        a part along every eigenvector, which that of a Newton step need not have. With an approximation of J the sign
        is that of the approximation, and the eigenvalues are those of J times its inverse.
        """
        return self._sign

    @cached_property
    def _sign(self) -> int:
        right = np.random.default_rng(_SEED).standard_normal(self.size)
        sign = self.preconditioner_sign
        if not self.has_nearby:
            return sign * _turned(self._iterate(self._preconditioned, right, _SIGN_TOLERANCE))
        rest = self.precondition(right)
        x, near = self._found_nearby(rest, _APPROXIMATE)
        if near.residual > _APPROXIMATE:  # what is not solved is no linear map, and has no eigenvalues
            return sign * _turned(self._iterate(self._preconditioned, right, _SIGN_TOLERANCE))
        left = self._sizes(self.precondition(right - self.multiply(x))) / self._sizes(rest)
        self.products += 1
        if left <= _SIGN_TOLERANCE:
            return sign * _turned(near)
        if not left <= _MIN_CONTRACTION:
            return sign * _turned(self._iterate(self._preconditioned, rest, _SIGN_TOLERANCE))

        def apart(x: Array) -> Array:
            rest = self.precondition(self.multiply(self._weighed(x, -1)))
            return self._weighed(self._found_nearby(rest, _APPROXIMATE)[0])

        return sign * _turned(near) * _turned(self._iterate(apart, right, _SIGN_TOLERANCE))

    def bordered(self, column: Array, row: Array) -> BorderedIterative:
        """With a further column (N,) and row (N + 1,)."""
        return BorderedIterative(self, column, row)


def _turned(solved: Solved) -> int:
    """-1 where an odd number of eigenvalues is negative, else 1."""
    ritz = solved.ritz
    real = np.abs(ritz.imag) <= _REAL * np.abs(ritz)
    return -1 if np.count_nonzero(real & (ritz.real < 0.0)) % 2 else 1


class BorderedIterative(Bordered, IterativeJacobian):
    """With a further column (N,) and row (N + 1,); the preconditioner is bordered too."""

    _inner: IterativeJacobian

    def __init__(self, inner: IterativeJacobian, column: Array, row: Array) -> None:
        self._inner, self._column, self._row = inner, column, row
        self.has_nearby = inner.has_nearby

    def take_over(self, other: Jacobian) -> None:
        """Take over from another bordered Jacobian."""
        super().take_over(other)
        if isinstance(other, BorderedIterative):
            self._inner.take_over(other._inner)

    def took(self, products: int, tolerance: float) -> bool:
        """See ``IterativeJacobian.took``; the eliminated border is computed again with a new P."""
        anew = self._inner.took(products, tolerance)
        if anew:
            for name in ("_eliminated", "_weight", "_pulled"):
                self.__dict__.pop(name, None)
        return anew

    @cached_property
    def _eliminated(self) -> tuple[Array, float]:
        """``P^-1 column`` and the Schur complement of the corner."""
        z = self._inner.precondition(self._column)
        return z, float(self._row[-1] - self._row[:-1] @ z)

    @cached_property
    def _weight(self) -> float:
        """How far the last unknown moves the others, whose units differ from its own."""
        weight = float(np.linalg.norm(self._eliminated[0]))
        return weight if 0.0 < weight < np.inf else 1.0

    def _weighed(self, x: Array, power: int = 1) -> Array:
        """With the last unknown in units of the others."""
        out = x.copy()
        out[-1] *= self._weight**power
        return out

    def nearby(self, x: Array) -> Array:
        """With the border as it is."""
        return np.append(self._inner.nearby(x[:-1]) + self._column * x[-1], self._row @ x)

    @property
    def departing(self) -> NDArray[np.intp] | None:
        """Those of the inner one: the border is the same in P."""
        return self._inner.departing

    def departure(self, x: Array) -> Array:
        """That of the inner one."""
        return self._inner.departure(x)

    def spread(self, d: Array, *, alone: bool = False) -> Array:
        """With the last unknown, so that the last equation holds."""
        z, corner = self._eliminated
        y, inner = -(self._pulled @ d) / corner, self._inner.spread(d, alone=alone)
        return inner - y * z[self.departing] if alone else np.append(inner - y * z, y)

    def spread_transposed(self, x: Array) -> Array:
        """The transpose."""
        z, corner = self._eliminated
        return np.asarray(self._inner.spread_transposed(x[:-1]) - (x[-1] - x[:-1] @ z) / corner * self._pulled)

    @cached_property
    def _pulled(self) -> Array:
        """The last equation by what departs, (m,)."""
        return self._inner.spread_transposed(self._row[:-1])

    def precondition(self, x: Array, *, transposed: bool = False) -> Array:
        """``P^-1 @ x`` by block elimination of the border."""
        z, corner = self._eliminated
        if transposed:
            y = (x[-1] - z @ x[:-1]) / corner
            return np.append(self._inner.precondition(x[:-1] - y * self._row[:-1], transposed=True), y)
        first = self._inner.precondition(x[:-1])
        y = (x[-1] - self._row[:-1] @ first) / corner
        return np.append(first - y * z, y)

    @property
    def preconditioner_sign(self) -> int:
        """Sign of the determinant of P: that of the inner one times that of the corner left over."""
        sign = self._inner.preconditioner_sign
        return sign and sign * int(np.sign(self._eliminated[1]))


@dataclass(frozen=True, kw_only=True, slots=True)
class Solved:
    """A solution ``x`` (N,), its relative residual, the products it took, and the Hessenberg matrix of the space."""

    x: Array
    residual: float
    products: int
    hessenberg: Array

    @property
    def ritz(self) -> ComplexArray:
        """Ritz values (products,)."""
        return np.asarray(np.linalg.eigvals(self.hessenberg), dtype=complex)


def gmres(apply: Callable[[Array], Array], right: Array, *, tolerance: float, most: int) -> Solved:
    """Solve ``apply(x) = right`` (N,) to a relative residual, without restart, in at most ``most`` products.

    GMRES (Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7, 1986). Besides the solution it returns the Ritz values
    of the space that was searched: eigenvalues of the matrix that lie apart from the others are among them, which is
    what tells the sign of a determinant.

    >>> A = np.diag([1.0, 2.0, -4.0])
    >>> found = gmres(lambda x: A @ x, np.array([1.0, 2.0, 4.0]), tolerance=1e-12, most=10)
    >>> found.x.round(12), found.products, np.sort(found.ritz.real).round(9)
    (array([ 1.,  1., -1.]), 3, array([-4.,  1.,  2.]))
    """
    size = float(np.linalg.norm(right))
    most = min(most, right.size)
    if not 0.0 < size < np.inf:
        x = np.full(right.shape, 0.0 if size == 0.0 else np.nan)
        return Solved(x=x, residual=0.0, products=0, hessenberg=np.empty((0, 0)))
    basis = np.empty((most + 1, right.size))
    basis[0] = right / size
    H, R, rest = np.zeros((most + 1, most)), np.zeros((most + 1, most)), np.zeros(most + 1)
    rotations: list[tuple[float, float]] = []
    rest[0] = size
    for k in range(most):
        w = apply(basis[k])
        for _ in range(2):  # once more, so that the basis stays orthogonal to rounding
            part = basis[: k + 1] @ w
            w = w - part @ basis[: k + 1]
            H[: k + 1, k] += part
        H[k + 1, k] = np.linalg.norm(w)
        R[: k + 2, k] = H[: k + 2, k]
        _rotate(R[:, k], rest, rotations, k)
        done = not abs(rest[k + 1]) > tolerance * size
        if done or H[k + 1, k] == 0.0:
            break
        basis[k + 1] = w / H[k + 1, k]
    n = k + 1
    x = solve_triangular(R[:n, :n], rest[:n], check_finite=False) @ basis[:n]
    return Solved(x=x, residual=abs(float(rest[n])) / size, products=n, hessenberg=H[:n, :n])


def _rotate(column: Array, rest: Array, rotations: list[tuple[float, float]], k: int) -> None:
    """Turn column k of the Hessenberg matrix into one of a triangular matrix, and the right-hand side with it."""
    for i, (c, s) in enumerate(rotations):
        column[i], column[i + 1] = c * column[i] + s * column[i + 1], c * column[i + 1] - s * column[i]
    size = float(np.hypot(column[k], column[k + 1])) or 1.0
    c, s = float(column[k]) / size, float(column[k + 1]) / size
    rotations.append((c, s))
    column[k], column[k + 1] = size, 0.0
    rest[k], rest[k + 1] = c * rest[k], -s * rest[k]
