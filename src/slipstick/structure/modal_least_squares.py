"""Modes of measured receptances by weighted least squares, in units of the noise.

For given poles residues are linear: they are eliminated, and poles are found alone (variable projection, G. H. Golub,
V. Pereyra, SIAM J. Numer. Anal. 10, 1973; Jacobian of L. Kaufman, BIT 15, 1975). Last, poles and shapes are refined
together. Rows of real and imaginary parts are as many as measured numbers; of each pair of dofs only the triangle of
their QR decomposition goes into the solver, which has the same sum of squares and the same normal equations.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slipstick.structure.measured import Poles, Receptances, deviation
from slipstick.typing import Array, ComplexArray, IntArray

BELOW, BEYOND = 0.3, 1.5
"""Range of natural frequencies: over the lowest and over the highest measured frequency."""
LEAST_DAMPING, MOST_DAMPING = 1e-6, 0.5
"""Range of damping ratios."""

_RARE = 5.0
"""Minus the logarithm of the probability that noise of a whole table looks like a mode."""
_UNDER, _ABOVE = np.array([0.2, 0.1]), np.array([0.02, 0.05, 0.1, 0.2])
"""Trial frequencies of modes below and above the range, as distances from its ends over its width."""
_SEARCHED = 16
"""Pairs that are searched for a further mode: those with the largest residuals."""
_WIDTHS = (0.003, 0.01, 0.03)
"""Trial damping ratios of a further mode."""


class Solved(NamedTuple):
    """Of one pair: coefficients (m,), growth of the sum of squares without each (m,), residuals (2 n,)."""

    coefficients: Array
    gains: Array
    left: Array


@dataclass(frozen=True, kw_only=True)
class Shaped:
    """Modes with shapes (n_dofs, n_modes), the compliance of the modes left out (n_pairs,), and the sum of squares.

    ``uncertain`` (2, n_modes): standard deviations of frequencies and damping ratios, relative.
    """

    poles: Poles
    shapes: Array
    above: Array
    squares: float
    uncertain: Array
    held: int = 0


class LeastSquares:
    """Least squares of receptances with noise of the deviation (n, n_pairs) in real and imaginary part each.

    Columns of a pair are ``w_r^2 / (w_r^2 + 2 i zeta_r w_r w - w^2)`` of the modes, 1 for the modes above and
    ``(w_1 / w)^2`` for those below.
    """

    def __init__(self, measured: Receptances, noise: Array) -> None:
        self.measured, self.noise, self.weight = measured, noise, 1.0 / noise
        self.low, self.high = float(measured.omega[0]), float(measured.omega[-1])

    @property
    def size(self) -> int:
        """Number of real measured values."""
        return 2 * self.measured.values.size

    @property
    def worth(self) -> float:
        """Smallest reduction of the sum of squares by a mode that is not noise."""
        return self._chance(self.measured.values.shape[1])

    def _chance(self, pairs: int) -> float:
        """Largest reduction of the squares by noise (B. Laurent, P. Massart, Annals of Statistics 28, 2000, (4.3))."""
        free, rare = pairs + 2, float(np.log(self.size)) + _RARE
        return free + 2.0 * np.sqrt(free * rare) + 2.0 * rare

    def prominence(self, poles: Poles, coefficients: Array) -> Array:
        """Contribution of each mode at its frequency, or the nearest in the range, relative to the receptance there."""
        at = np.argmin(np.abs(self.measured.omega[:, None] - poles[0]), axis=0)
        w = np.clip(poles[0], self.low, self.high)
        D = np.abs(poles[0] ** 2 / (poles[0] ** 2 + 2j * poles[1] * poles[0] * w - w**2))
        there = np.linalg.norm(self.measured.values[at], axis=1)
        return np.asarray(D * np.linalg.norm(coefficients, axis=1) / there)

    def squares(self, poles: Poles) -> float:
        """Sum of squared residuals."""
        return self.coefficients(poles)[2]

    def _modal(self, poles: Poles) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Columns of modes, and their derivatives by frequency and by damping ratio, (n, n_modes) each."""
        w, (wr, zr) = self.measured.omega[:, None], poles
        D = wr**2 / (wr**2 + 2j * zr * wr * w - w**2)
        by_w, by_z = D * (2.0 / wr - D * (2.0 * wr + 2j * zr * w) / wr**2), -(D**2) * 2j * w / wr
        return np.asarray(D, dtype=complex), np.asarray(by_w, dtype=complex), np.asarray(by_z, dtype=complex)

    def _columns(self, poles: Poles) -> ComplexArray:
        w = self.measured.omega[:, None]
        return np.asarray(np.hstack([self._modal(poles)[0], np.ones_like(w), (self.low / w) ** 2]), dtype=complex)

    def _decomposed(self, X: ComplexArray) -> Iterator[tuple[int, Array, Array, Array]]:
        """For each pair its index, the QR decomposition of weighted columns, and its weighted values (2 n,)."""
        for pair, (values, g) in enumerate(zip(self.measured.values.T, self.weight.T, strict=True)):
            Q, R = np.linalg.qr(parts(X * g[:, None]))
            yield pair, Q, R, parts(values * g)

    def solved(self, poles: Poles) -> Iterator[Solved]:
        """Best coefficients of each pair."""
        from scipy.linalg import solve_triangular

        for _, Q, R, b in self._decomposed(self._columns(poles)):
            inverse = solve_triangular(R + 1e-300 * np.eye(len(R)), np.eye(len(R)))
            along = Q.T @ b
            c = inverse @ along
            yield Solved(c, c**2 / np.sum(inverse**2, axis=1), b - Q @ along)

    def coefficients(self, poles: Poles) -> tuple[Array, Array, float]:
        """Coefficients and gains (m, n_pairs), and the sum of squared residuals."""
        found = list(self.solved(poles))
        squares = float(sum(one.left @ one.left for one in found))
        return np.array([one.coefficients for one in found]).T, np.array([one.gains for one in found]).T, squares

    def reweighted(self, poles: Poles) -> LeastSquares:
        """The problem with the noise of the residuals at these poles."""
        X, n = self._columns(poles), self.measured.omega.size
        model = X @ self.coefficients(poles)[0]
        squares = np.abs(model - self.measured.values) ** 2 * (2 * n / max(2 * n - X.shape[1] - 1, 1))
        return LeastSquares(self.measured, deviation(self.measured.omega, self.measured.values, squares, np.abs(model)))

    def _triangles(self, poles: Poles) -> tuple[Array, Array]:
        """Residuals, and their derivatives by ``w / w_n`` and damping ratios, in the rows of QR decompositions."""
        n, (_, by_w, by_z) = len(poles[0]), self._modal(poles)
        rows, left = [], []
        for pair, Q, R, b in self._decomposed(self._columns(poles)):
            along = Q.T @ b
            c = np.linalg.lstsq(R, along, rcond=None)[0][:n]
            J = parts(
                np.asarray(np.hstack([by_w * self.high * c, by_z * c]) * self.weight[:, pair, None], dtype=complex)
            )
            J -= Q @ (Q.T @ J)
            T = _triangle(np.column_stack([J, Q @ along - b]))
            rows.append(T[:, :-1])
            left.append(T[:, -1])
        return np.concatenate(left), np.vstack(rows)

    def uncertain(self, poles: Poles) -> Array:
        """Standard deviations of frequencies and damping ratios, relative, (2, n_modes)."""
        found = _deviations(self._triangles(poles)[1]).reshape(2, -1)
        return np.asarray(found / np.array([poles[0] / self.high, poles[1]]))

    def refined(self, poles: Poles, steps: int = 30) -> Poles:
        """Frequencies and damping ratios of the least squares."""
        from scipy.optimize import least_squares

        n, unit = len(poles[0]), self.high
        if not n:
            return poles

        last: list[tuple[Array, tuple[Array, Array]]] = []

        def known(z: Array) -> tuple[Array, Array]:
            if not last or not np.array_equal(last[0][0], z):
                last[:] = [(z.copy(), self._triangles((z[:n] * unit, z[n:])))]
            return last[0][1]

        low = np.concatenate([np.full(n, BELOW * self.low / unit), np.full(n, LEAST_DAMPING)])
        high = np.concatenate([np.full(n, BEYOND), np.full(n, MOST_DAMPING)])
        start = np.clip(np.concatenate([poles[0] / unit, poles[1]]), low * (1 + 1e-6), high * (1 - 1e-6))
        scale = np.maximum(start[n:], 1e-4)
        z = least_squares(
            lambda z: known(z)[0], start, lambda z: known(z)[1], bounds=(low, high),
            x_scale=np.concatenate([scale * start[:n], scale]), max_nfev=steps, xtol=1e-12, ftol=1e-7, gtol=1e-12,
        ).x  # fmt: skip
        order = np.argsort(z[:n])
        return z[:n][order] * unit, z[n:][order]

    def missing(self, poles: Poles) -> Poles:
        """Missing modes: frequencies and damping ratios that would reduce the squares by clearly more than noise."""
        from scipy.signal import find_peaks

        span = self.high - self.low
        inside = np.linspace(self.low, self.high, int(np.clip(self.measured.omega.size, 100, 400)))
        outside = np.concatenate([self.low - _UNDER * min(self.low, span), self.high + span * _ABOVE])
        outside = outside[(outside > BELOW * self.low) & (outside < BEYOND * self.high)]
        left = np.array([one.left for one in self.solved(poles)])
        pairs = np.argsort(-np.sum(left**2, axis=1))[:_SEARCHED]
        enough = self._chance(pairs.size)
        gain = np.array([self._gains((inside, np.full(inside.size, z)), left, pairs) for z in _WIDTHS])
        best = np.concatenate([[0.0], gain.max(axis=0), [0.0]])
        places, about = find_peaks(best, height=enough, prominence=0.0)
        places = places[about["prominences"] > 0.5 * best[places]] - 1
        w, z = inside[places], np.array(_WIDTHS)[np.argmax(gain[:, places], axis=0)]
        if outside.size:
            beyond = self._gains((outside, np.full(outside.size, _WIDTHS[1])), left, pairs, self._columns(poles))
            if beyond.max() > max(enough, best.max()):
                w, z = outside[[int(np.argmax(beyond))]], np.array([_WIDTHS[1]])  # others may only compensate it
        return w, z

    def _gains(self, poles: Poles, left: Array, pairs: IntArray, beside: ComplexArray | None = None) -> Array:
        """Reduction of the residuals (n_pairs, 2 n) by single further modes; without ``beside`` a lower bound."""
        modes, g, n = self._modal(poles)[0], self.weight[:, pairs], self.measured.omega.size
        along = (modes.conj().T @ (g * (left[pairs, :n] + 1j * left[pairs, n:]).T)).real
        size = (np.abs(modes) ** 2).T @ g**2
        rest = size.copy()
        if beside is not None:
            for k, weight in enumerate(g.T[:, :, None]):
                Q, _ = np.linalg.qr(parts(beside * weight))
                rest[:, k] -= np.sum((Q.T @ parts(modes * weight)) ** 2, axis=0)
        return np.asarray(np.sum(np.where(rest > 1e-6 * size, along**2 / np.maximum(rest, 1e-300), 0.0), axis=1))

    def shaped(self, poles: Poles, shapes: Array, held: int, above: bool, steps: int = 40) -> Shaped:
        """Poles and shapes together, the first ``held`` poles as they are; ``above``: with modes above the range."""
        from scipy.optimize import least_squares

        measured, n, unit = self.measured, len(poles[0]), self.high
        N, size = len(measured.dofs), np.maximum(np.abs(shapes).max(axis=0), 1e-300)
        moved = np.arange(held, n)
        m = moved.size

        def unpacked(z: Array) -> tuple[Poles, Array]:
            wr, zr = poles[0].copy(), poles[1].copy()
            wr[moved], zr[moved] = z[:m] * unit, z[m : 2 * m]
            return (wr, zr), z[2 * m :].reshape(N, n) * size

        def triangles(z: Array) -> tuple[Array, Array, Array]:
            at, phi = unpacked(z)
            D, by_w, by_z = self._modal(at)
            by_w, by_z = by_w / at[0] ** 2 - 2.0 * D / at[0] ** 3, by_z / at[0] ** 2
            D = D / at[0] ** 2
            blocks, stands = [], np.zeros(measured.rows.size)
            for pair, (i, j, g) in enumerate(zip(measured.rows, measured.columns, self.weight.T, strict=True)):
                R = phi[i] * phi[j]
                pieces = [by_w[:, moved] * R[moved] * unit, by_z[:, moved] * R[moved], D * phi[j] * size]
                places = [np.arange(2 * m + n * i, 2 * m + n * (i + 1))]
                if i == j:
                    pieces[-1] = 2.0 * pieces[-1]
                else:
                    pieces.append(D * phi[i] * size)
                    places.append(np.arange(2 * m + n * j, 2 * m + n * (j + 1)))
                pieces.append((D @ R - measured.values[:, pair])[:, None])
                J = parts(np.hstack(pieces) * g[:, None])
                if above:
                    one = np.concatenate([g, np.zeros_like(g)])
                    norm = float(one @ one)
                    share = one @ J / norm
                    stands[pair] = -share[-1]
                    J -= np.outer(one, share)
                T = _triangle(J)
                row = np.zeros((T.shape[0], z.size + 1))
                row[:, np.concatenate([np.arange(2 * m), *places])] = T[:, :-1]
                row[:, -1] = T[:, -1]
                blocks.append(row)
            T = np.vstack(blocks)
            if len(T) > 2 * T.shape[1]:
                T = _triangle(T)
            return T[:, -1], T[:, :-1], stands

        last: list[tuple[Array, tuple[Array, Array, Array]]] = []

        def known(z: Array) -> tuple[Array, Array, Array]:
            if not last or not np.array_equal(last[0][0], z):
                last[:] = [(z.copy(), triangles(z))]
            return last[0][1]

        start = np.concatenate([poles[0][moved] / unit, poles[1][moved], (shapes / size).ravel()])
        low, high = np.full(start.size, -np.inf), np.full(start.size, np.inf)
        low[:m], high[:m] = 0.5 * BELOW * self.low / unit, 1.1 * BEYOND
        low[m : 2 * m], high[m : 2 * m] = 0.5 * LEAST_DAMPING, 1.1 * MOST_DAMPING
        damping = np.maximum(poles[1][moved], 1e-4)
        found = least_squares(
            lambda z: known(z)[0], start, lambda z: known(z)[1], bounds=(low, high),
            x_scale=np.concatenate([damping * start[:m], damping, np.ones(shapes.size)]),
            max_nfev=steps, xtol=1e-13, ftol=1e-13, gtol=1e-13,
        )  # fmt: skip
        at, phi = unpacked(found.x)
        uncertain = np.full((2, n), np.inf)
        uncertain[:, moved] = _deviations(known(found.x)[1])[: 2 * m].reshape(2, m) / np.array(
            [found.x[:m], found.x[m : 2 * m]]
        )
        return Shaped(
            poles=at, shapes=phi, above=known(found.x)[2], squares=2.0 * float(found.cost), uncertain=uncertain
        )


def _triangle(matrix: Array) -> Array:
    """Triangle of a QR decomposition: columns with the same products in fewer rows."""
    return np.asarray(np.linalg.qr(matrix, mode="r"), dtype=float)


def _deviations(J: Array) -> Array:
    """Standard deviations of unknowns whose noise is one in each row; infinite where the data do not determine them."""
    size = np.sqrt(np.sum(J**2, axis=0))
    size = np.where(size > 0.0, size, 1e-300)
    _, s, V = np.linalg.svd(J / size, full_matrices=False)
    known = s > 1e-9 * s[0]
    out = np.sqrt(np.sum((V[known] / s[known, None]) ** 2, axis=0)) / size
    return np.where(np.sum(V[~known] ** 2, axis=0) > 1e-3, np.inf, out)


def parts(values: ComplexArray) -> Array:
    """Real above imaginary rows."""
    return np.concatenate([values.real, values.imag])
