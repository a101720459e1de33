"""Jacobians that are never written out: products, a preconditioner P, and products that are near and cost little."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from slipstick.solve.linear.jacobian import OF_CORRECTIONS, Bordered, Jacobian
from slipstick.typing import Array, ComplexArray

TOLERANCE = 1e-8
"""Relative residual of a solution."""

_NEARLY = 3e-5
"""Relative residual of a solution with what is near to J, where there is such a thing."""

_GAINS = 0.1
"""Part of a residual that a correction may leave; where it leaves more it takes the space of all corrections."""

_SURE = 0.1
"""Part of the tolerance that a residual which is not looked at is expected to be."""

_ALIKE = 30.0
"""By how much what corrections leave differs from one right-hand side, and one Jacobian, to the next (measured: 10)."""

_FOR_SIGNS = 1e-4
"""Eigenvalues apart from the others are found long before the solution is."""

MOST_PRODUCTS = 250
"""Beyond it the preconditioner is no use, and the solution is given up."""

_GIVEN_UP = 1e-3
_SEED = 20120601


class IterativeJacobian(Jacobian):
    """Solved by corrections with what is near to J, all right-hand sides together, or else by GMRES on ``J P^-1``.

    A kind says its products, what stands for ``P``, and its products ``nearby`` where some are had for little.
    ``products`` counts the products that solutions have taken, those with several columns once; ``leaves`` is the
    largest part of a residual that the first correction of a solution was seen to leave, None before there is one.
    """

    products: int = 0
    has_nearby: bool = False
    leaves: float | None = None
    _told: float | None = None

    @abstractmethod
    def precondition(self, x: Array, *, transposed: bool = False) -> Array:
        """``P^-1 @ x`` (N,), or with the transposes."""

    @property
    @abstractmethod
    def preconditioner_sign(self) -> int:
        """Sign of the determinant of P; 0 where it is singular."""

    def nearby(self, x: Array) -> Array:
        """``J @ x`` (N,), nearly, for much less than that costs."""
        raise NotImplementedError

    def take_over(self, other: Jacobian) -> None:
        """What the solutions of one nearby left, and what stands for it where a kind has use for that."""
        if isinstance(other, IterativeJacobian):
            self._told = other._told if other.leaves is None else other.leaves

    def took(self, products: int, tolerance: float) -> bool:
        """Take note of what a solution with what is near took; whether another P stands for J from here on."""
        return False

    def _weighed(self, right: Array, power: int = 1) -> Array:
        """Right-hand sides (N,) or (N, k) in units in which their norms tell what is left; power -1: back."""
        return right

    @property
    def singular(self) -> bool:
        """Whether the preconditioner is exactly singular, without which nothing is solved."""
        return self.preconditioner_sign == 0

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution of ``J @ x = right``, or with its transpose; nan where the iteration does not get there."""
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
        """Solution to a relative error, for right (N,) or (N, k): see ``jacobian.correction``.

        A first correction is all of it, and no product is taken, where those before left far less.
        """
        leaves = self._told if self.leaves is None else self.leaves
        if leaves is None or not _ALIKE * leaves <= to:
            return self._corrected(right, to)
        columns = right if right.ndim == 2 else right[:, None]
        return np.column_stack([self._nearly(b, max(_NEARLY, _SURE * to)) for b in columns.T]).reshape(right.shape)

    def _corrected(self, right: Array, tolerance: float) -> Array:
        """Solution to a relative residual: corrected with what is near to J until another correction is enough.

        A product tells what a correction has left, and so what the next one will leave, which is not looked at.
        """
        b = right if right.ndim == 2 else right[:, None]
        x, size = np.zeros(b.shape), self._sizes(b)
        x[:, ~np.isfinite(size)] = np.nan
        open_ = np.flatnonzero((size > 0.0) & np.isfinite(size))
        left, rest = size, b
        while open_.size:
            x[:, open_] += np.column_stack([self._nearly(column) for column in rest[:, open_].T])
            rest = np.zeros_like(b)
            rest[:, open_] = b[:, open_] - self.multiply(x[:, open_])
            self.products += 1
            before, left = left, self._sizes(rest)
            if before is size:
                self._see(left[open_] / before[open_])
            left[left <= tolerance * size] = 0.0
            for i in open_[~(left[open_] <= _GAINS * before[open_])]:
                if not np.isfinite(left[i]):
                    x[:, i], rest[:, i] = 0.0, b[:, i]
                x[:, i] += self._by_space(rest[:, i], tolerance * size[i])
                left[i] = 0.0
            enough = left[open_] ** 2 <= _SURE * tolerance * size[open_] * before[open_]
            for i in open_[enough & (left[open_] > 0.0)]:
                x[:, i] += self._nearly(rest[:, i], max(_NEARLY, _SURE * tolerance * size[i] / left[i]))
                left[i] = 0.0
            open_ = np.flatnonzero(left > 0.0)
        return x.reshape(right.shape)

    def _see(self, left: Array) -> None:
        """Take note of the parts of residuals that first corrections leave."""
        most = float(left.max())
        if self.leaves is None or not most <= self.leaves:
            self.leaves = most

    def _by_space(self, rest: Array, residual: float) -> Array:
        """What is missing of a solution with some ``rest`` (N,), by GMRES on ``J P^-1`` to the size of a residual."""
        weighed = self._weighed(rest)
        found = self._iterate(self._preconditioned, weighed, residual / float(np.linalg.norm(weighed)))
        return self.precondition(self._weighed(found.x, -1))

    def _sizes(self, right: Array) -> Array:
        return np.asarray(np.linalg.norm(self._weighed(right), axis=0))

    def _nearly(self, right: Array, tolerance: float = _NEARLY) -> Array:
        """``J^-1 right`` (N,), nearly."""
        if not self.has_nearby:
            return self.precondition(right)
        return self._found_nearby(self._weighed(right), tolerance)[0]

    def _found_nearby(self, weighed: Array, tolerance: float) -> tuple[Array, Solved]:
        """The same of a right-hand side in the units in which it is solved for, and how it was found."""
        found = gmres(self._preconditioned_nearby, weighed, tolerance=tolerance, most=MOST_PRODUCTS)
        x = self.precondition(self._weighed(found.x, -1))
        self.took(found.products, tolerance)
        return x, found

    def _preconditioned(self, x: Array) -> Array:
        return self._weighed(self.multiply(self.precondition(self._weighed(x, -1))))

    def _preconditioned_nearby(self, x: Array) -> Array:
        return self._weighed(self.nearby(self.precondition(self._weighed(x, -1))))

    def _iterate(self, apply: Callable[[Array], Array], right: Array, tolerance: float = TOLERANCE) -> Solved:
        solved = gmres(apply, right, tolerance=tolerance, most=MOST_PRODUCTS)
        self.products += solved.products
        if not solved.residual <= max(_GIVEN_UP, tolerance):
            solved.x[...] = np.nan
        return solved

    def sign(self) -> int:
        """Sign of the determinant: that of P, turned for each negative eigenvalue of ``J P^-1``.

        Most eigenvalues are close to 1; those that are not are Ritz values once the solution is found. The right-hand
        side has a part along every eigenvector, which that of a Newton step need not have. With something near to J it
        is that one's sign, and the eigenvalues are those of J with its inverse.
        """
        return self._sign

    @cached_property
    def _sign(self) -> int:
        right = np.random.default_rng(_SEED).standard_normal(self.size)
        sign = self.preconditioner_sign
        if not self.has_nearby:
            return sign * _turned(self._iterate(self._preconditioned, right, _FOR_SIGNS))
        x, near = self._found_nearby(right, _NEARLY)
        left = np.linalg.norm(right - self._weighed(self.multiply(x)))
        self.products += 1
        if left <= _FOR_SIGNS * np.linalg.norm(right):
            return sign * _turned(near)

        def apart(x: Array) -> Array:
            return self._weighed(self.multiply(self._nearly(self._weighed(x, -1))))

        return sign * _turned(near) * _turned(self._iterate(apart, right, _FOR_SIGNS))

    def bordered(self, column: Array, row: Array) -> BorderedIterative:
        """With a further column (N,) and row (N + 1,)."""
        return BorderedIterative(self, column, row)


def _turned(solved: Solved) -> int:
    """-1 where an odd number of eigenvalues is negative, else 1."""
    ritz = solved.ritz
    real = np.abs(ritz.imag) <= 1e-10 * np.abs(ritz)
    return -1 if np.count_nonzero(real & (ritz.real < 0.0)) % 2 else 1


class BorderedIterative(Bordered, IterativeJacobian):
    """With a further column (N,) and row (N + 1,): the preconditioner is bordered likewise."""

    _inner: IterativeJacobian

    def __init__(self, inner: IterativeJacobian, column: Array, row: Array) -> None:
        self._inner, self._column, self._row = inner, column, row
        self.has_nearby = inner.has_nearby

    def take_over(self, other: Jacobian) -> None:
        """Of another one with a border."""
        super().take_over(other)
        if isinstance(other, BorderedIterative):
            self._inner.take_over(other._inner)

    def took(self, products: int, tolerance: float) -> bool:
        """What the border makes of P goes with it."""
        anew = self._inner.took(products, tolerance)
        if anew:
            self.__dict__.pop("_eliminated", None)
        return anew

    @cached_property
    def _eliminated(self) -> tuple[Array, float]:
        """``P^-1 column`` and what is left of the corner."""
        z = self._inner.precondition(self._column)
        return z, float(self._row[-1] - self._row[:-1] @ z)

    @cached_property
    def _weight(self) -> float:
        """What the column makes of a one in the last equation, whose units are not those of the others."""
        weight = float(np.linalg.norm(self._column)) / (abs(self._eliminated[1]) or np.inf)
        return weight if 0.0 < weight < np.inf else 1.0

    def _weighed(self, right: Array, power: int = 1) -> Array:
        """With the last equation in units of the others."""
        out = right.copy()
        out[-1] *= self._weight**power
        return out

    def nearby(self, x: Array) -> Array:
        """With the border as it is."""
        return np.append(self._inner.nearby(x[:-1]) + self._column * x[-1], self._row @ x)

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
