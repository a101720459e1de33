"""Jacobians that are never written out: products, and a preconditioner that stands in for the whole."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property

import numpy as np

from slipstick.solve.linear.gmres import Solved, gmres
from slipstick.typing import Array

TOLERANCE = 1e-8
"""Relative residual of a solution: Newton corrections are right to so many digits."""

_FOR_SIGNS = 1e-4
"""Eigenvalues apart from the others are found long before the solution is."""

MOST_PRODUCTS = 250
"""Beyond it the preconditioner is no use, and the solution is given up."""

_GIVEN_UP = 1e-3
_SEED = 20120601


class IterativeJacobian(ABC):
    """Solved by GMRES on ``J P^-1``; a kind says its products, and what stands for ``P``.

    ``products`` counts the products that solutions have taken.
    """

    products: int = 0

    @property
    @abstractmethod
    def size(self) -> int:
        """N."""

    @abstractmethod
    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x``, or the transpose times x, for x (N,) or (N, k)."""

    @abstractmethod
    def precondition(self, x: Array, *, transposed: bool = False) -> Array:
        """``P^-1 @ x`` (N,), or with the transposes."""

    @property
    @abstractmethod
    def preconditioner_sign(self) -> int:
        """Sign of the determinant of P; 0 where it is singular."""

    @abstractmethod
    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``, or more."""

    @property
    def singular(self) -> bool:
        """Whether the preconditioner is exactly singular, without which nothing is solved."""
        return self.preconditioner_sign == 0

    def solve(self, right: Array, *, transposed: bool = False) -> Array:
        """Solution of ``J @ x = right``, or with its transpose; nan where the iteration does not get there."""
        if right.ndim == 2:
            return np.column_stack([self.solve(column, transposed=transposed) for column in right.T])
        if transposed:
            # the same eigenvalues, the preconditioner on the other side
            found = self._iterate(lambda x: self.precondition(self.multiply(x, transposed=True), transposed=True),
                                  self.precondition(right, transposed=True))  # fmt: skip
            return found.x
        found = self._iterate(lambda x: self.multiply(self.precondition(x)), right)
        return self.precondition(found.x)

    def _iterate(self, apply: Callable[[Array], Array], right: Array, tolerance: float = TOLERANCE) -> Solved:
        found = gmres(apply, right, tolerance=tolerance, most=MOST_PRODUCTS)
        self.products += found.products
        if not found.residual <= _GIVEN_UP:
            found.x[...] = np.nan
        return found

    def sign(self) -> int:
        """Sign of the determinant: that of P, turned for each negative eigenvalue of ``J P^-1``.

        Most eigenvalues are close to 1; those that are not are Ritz values once the solution is found. The right-hand
        side has a part along every eigenvector, which that of a Newton step need not have.
        """
        return self._sign

    @cached_property
    def _sign(self) -> int:
        right = np.random.default_rng(_SEED).standard_normal(self.size)
        ritz = self._iterate(lambda x: self.multiply(self.precondition(x)), right, _FOR_SIGNS).ritz
        real = np.abs(ritz.imag) <= 1e-10 * np.abs(ritz)
        return self.preconditioner_sign * (-1 if np.count_nonzero(real & (ritz.real < 0.0)) % 2 else 1)

    def bordered(self, column: Array, row: Array) -> BorderedIterative:
        """With a further column (N,) and row (N + 1,)."""
        return BorderedIterative(self, column, row)


class BorderedIterative(IterativeJacobian):
    """With a further column (N,) and row (N + 1,): the preconditioner is bordered likewise."""

    def __init__(self, inner: IterativeJacobian, column: Array, row: Array) -> None:
        self._inner, self._column, self._row = inner, column, row

    @property
    def size(self) -> int:
        """N + 1."""
        return self._row.size

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x``, or the transpose times x."""
        first, last = x[:-1], x[-1:]
        if transposed:
            whole = np.multiply.outer(self._row, x[-1])
            whole[:-1] += self._inner.multiply(first, transposed=True)
            whole[-1] += self._column @ first
            return whole
        above = self._inner.multiply(first) + np.multiply.outer(self._column, x[-1])
        return np.concatenate([above, np.reshape(self._row @ x, last.shape)])

    @cached_property
    def _eliminated(self) -> tuple[Array, float]:
        """``P^-1 column`` and what is left of the corner."""
        z = self._inner.precondition(self._column)
        return z, float(self._row[-1] - self._row[:-1] @ z)

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
        own = self._inner.preconditioner_sign
        return own and own * int(np.sign(self._eliminated[1]))

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``, or more."""
        size = np.abs(x)
        return np.append(self._inner.bound(x[:-1]) + np.abs(self._column) * size[-1], np.abs(self._row) @ size)

    def __repr__(self) -> str:
        return f"BorderedIterative({self.size})"
