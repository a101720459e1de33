"""A block Krylov basis of ``A^-1 M``, orthonormal in M, and the projection of the operator on it.

Full reorthogonalisation keeps the basis clean (R. G. Grimes, J. G. Lewis, H. D. Simon, SIAM J. Sparse Anal. Appl. 15,
228, 1994), thick restarts bound the memory (K. Wu, H. Simon, SIAM J. Sparse Anal. Appl. 22, 602, 2000).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from slipstick.errors import InputError
from slipstick.typing import Array, Sparse


class KrylovBasis:
    """Columns ``V`` (n, m) with ``V^T M V = 1``, ``H = V^T M A^-1 M V``, and the block ``Q`` that comes after them.

    Always ``A^-1 M V = V H + Q coupling E^T``, E picking the last columns of V: what is left of a Ritz vector is
    ``coupling`` times its last entries.
    """

    def __init__(self, solve: Callable[[Array], Array], M: Sparse, block: int, start: Array | None = None) -> None:
        self.solve, self.M, self.n = solve, M, M.shape[0]
        self.block = min(block, self.n)
        self.random = np.random.default_rng(20120101)
        self.V = np.zeros((self.n, 0), order="F")
        self.H = np.zeros((0, 0))
        self.m = 0
        first = self._random_block() if start is None else np.array(start, dtype=float)
        self.Q, self.MQ, _ = self._orthonormalise(first)
        self.coupling = np.zeros((self.Q.shape[1], 0))

    def step(self) -> None:
        """Take the next block into the basis and make the one after it."""
        Q, m, width = self.Q, self.m, self.Q.shape[1]
        self.V[:, m : m + width] = Q
        self.m = m + width
        W = self.solve(self.MQ)
        C = self._remove(W, self.M @ W)
        H = np.zeros((self.m, self.m))
        H[:m, :m] = self.H
        H[:, m:] = C
        H[m:, :m] = C[:m].T
        H[m:, m:] = 0.5 * (C[m:] + C[m:].T)
        self.H = H
        self.Q, self.MQ, self.coupling = self._orthonormalise(W)

    def ritz(self) -> tuple[Array, Array, Array]:
        """Ritz values (largest first), vectors in the basis, and relative residuals."""
        theta, Y = np.linalg.eigh(self.H)
        theta, Y = theta[::-1], Y[:, ::-1]
        last = self.coupling.shape[1]
        error = np.linalg.norm(self.coupling @ Y[self.m - last :], axis=0) if self.m < self.n else np.zeros(self.m)
        return theta, Y, error / np.maximum(np.abs(theta), np.finfo(float).tiny)

    def make_room(self, limit: int, keep: int) -> None:
        """Room for the next block: a restart, or columns that take memory only when they are written."""
        if self.m + self.Q.shape[1] > limit:
            self._restart(keep)
        if limit > self.V.shape[1]:
            grown = np.zeros((self.n, limit), order="F")
            grown[:, : self.m] = self.V[:, : self.m]
            self.V = grown

    def _restart(self, keep: int) -> None:
        """Keep the best Ritz vectors and the next block: the invariants of the iteration still hold."""
        theta, Y, _ = self.ritz()
        keep = min(keep, self.m - self.coupling.shape[1])
        for rows in np.array_split(np.arange(self.n), max(1, self.n // 8192)):
            part = slice(rows[0], rows[-1] + 1)
            self.V[part, :keep] = self.V[part, : self.m] @ Y[:, :keep]
        self.m, self.H = keep, np.diag(theta[:keep])

    def add_random(self) -> None:
        """Widen the next block by random directions: for modes the start had no part of."""
        width = self.Q.shape[1]
        Q, MQ, R = self._orthonormalise(np.hstack([self.Q, self._random_block()]))
        self.Q, self.MQ, self.coupling = Q, MQ, R[:, :width] @ self.coupling

    def _random_block(self) -> Array:
        """Random unit vectors; one application of the operator damps what the high modes put into them."""
        block = self.solve(self.M @ self.random.standard_normal((self.n, self.block)))
        self._remove(block, self.M @ block)
        energy = np.abs(np.einsum("ij,ij->j", block, self.M @ block))
        return np.asarray(block / np.sqrt(np.maximum(energy, np.finfo(float).tiny)))

    def _remove(self, W: Array, MW: Array) -> Array:
        """Take the basis out of W (n, width) in place, ``MW`` being ``M W``; the coefficients (m, width)."""
        V = self.V[:, : self.m]
        C = V.T @ MW
        W -= V @ C
        return np.asarray(C)

    def _orthonormalise(self, W: Array) -> tuple[Array, Array, Array]:
        """M-orthonormal block Q outside the basis, ``M Q``, and R with ``W = Q R``; dead directions become random ones.

        Normalised through the eigenvectors of the Gram matrix, whose small eigenvalues are noise and held up (A.
        Stathopoulos, K. Wu, SIAM J. Sci. Comput. 23, 2165, 2002); the basis is taken out again after each scaling.
        """
        room = min(W.shape[1], self.n - self.m)
        R, MW = np.eye(W.shape[1]), self.M @ W
        for turn in range(10 if room else 0):
            values, vectors = self._gram(W, MW)
            values, vectors = values[-room:], vectors[:, -room:]
            floor = max(1e-14 * values[-1], np.finfo(float).tiny)
            root = np.sqrt(np.maximum(values, floor))
            W, MW, R = W @ (vectors / root), MW @ (vectors / root), (root[:, None] * vectors.T) @ R
            if turn and values[0] > 0.25:  # unit vectors that lost less than half to the basis
                return W, MW, R
            dead = values <= floor
            if turn and dead.any():
                W[:, dead] = self.random.standard_normal((self.n, int(dead.sum())))
                R[dead] = 0.0
                self._remove(W, self.M @ W)
            else:
                self._remove(W, MW)
            MW = self.M @ W
        return W[:, :room], MW[:, :room], R[:room]

    def _gram(self, Q: Array, MQ: Array) -> tuple[Array, Array]:
        G = Q.T @ MQ
        values, vectors = np.linalg.eigh(0.5 * (G + G.T))
        if values[0] < -1e-8 * max(values[-1], np.finfo(float).tiny):
            raise InputError("the mass matrix is indefinite: a motion has negative kinetic energy")
        return values, vectors
