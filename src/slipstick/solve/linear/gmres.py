"""GMRES for large systems given by their products alone (Y. Saad, M. H. Schultz, SIAM J. Sci. Stat. Comput. 7, 1986).

Besides the solution it returns the Ritz values of the space that was searched: eigenvalues of the matrix that lie apart
from the others are among them, which is what tells the sign of a determinant.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from slipstick.typing import Array, ComplexArray


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
