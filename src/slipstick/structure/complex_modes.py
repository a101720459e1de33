"""Complex modes of ``(pole^2 M + pole C + K) v = 0`` with their left vectors, C and K symmetric or not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipstick.typing import AnyArray, Array, ComplexArray

_INFINITE = 1e9
"""Eigenvalue over the scale of the pencil that counts as infinite."""
_ON_AXIS = 1e-7
"""Real part of a resonance by rounding, over the size of the eigenvalue."""


class ComplexModes(NamedTuple):
    """``(s^2 M + s C + K)^-1 = sum_k right_k left_k^T / (s - pole_k)`` over all 2 n poles.

    Right and left vectors are normalised so that ``left^T (2 pole M + C) right = 1``. Where two poles meet with one
    vector (critical damping) there are no such modes, and close to it the sum loses its digits.
    """

    poles: ComplexArray
    """(2 n,), 1/time: upper half plane first, by ascending imaginary part."""
    right: ComplexArray
    """(n, 2 n)."""
    left: ComplexArray
    """(n, 2 n)."""

    @property
    def upper(self) -> ComplexModes:
        """The n of each conjugate pair whose imaginary part is not negative; of real poles every second one."""
        n = len(self.right)
        return ComplexModes(self.poles[:n], self.right[:, :n], self.left[:, :n])


def complex_modes(M: Array, C: Array, K: AnyArray) -> ComplexModes:
    """All complex modes of dense matrices (n, n); M regular, K complex where its damping is hysteretic.

    Left vectors that do not exist are nan.

    By the companion matrix in displacements and velocities, whose inverse eigenvector matrix holds the left vectors
    [L. Meirovitch, Principles and Techniques of Vibrations, 1997].
    """
    n = len(M)
    scale = float(np.sqrt(np.abs(np.linalg.solve(M, K)).sum(axis=1).max(initial=0.0))) or 1.0
    solved = np.linalg.solve(M, np.hstack([K, C, np.eye(n)]))
    companion = np.zeros((2 * n, 2 * n), dtype=solved.dtype)
    companion[:n, n:] = np.eye(n)
    companion[n:, :n], companion[n:, n:] = -solved[:, :n] / scale**2, -solved[:, n : 2 * n] / scale
    poles, vectors = np.linalg.eig(companion)
    order = _paired(poles)
    poles, vectors = poles[order], vectors[:, order]
    try:
        inverse = np.linalg.inv(vectors)
    except np.linalg.LinAlgError:
        inverse = np.full(vectors.shape, np.nan, dtype=complex)
    return ComplexModes(
        poles=poles * scale, right=vectors[:n].astype(complex),
        left=np.asarray((inverse[:, n:] @ solved[:, 2 * n :]).T / scale, dtype=complex),
    )  # fmt: skip


def critical_modes(M: Array, G: Array, S: Array, K: Array, *, singular: bool = False) -> ComplexModes:
    """Resonances of ``K + i w (S + w G) - w^2 M``: speed and frequency are tied, M and K symmetric, S and G skew.

    The pencil ``K - w^2 (M - i G) + i w S`` is Hermitian, so that left vectors are conjugates. Only the frequencies
    w > 0 are returned, ascending: with gyroscopic stiffening there may be fewer than degrees of freedom.
    """
    n = len(M)
    mass = M - 1j * G
    if singular:
        return _critical_of_free(mass, S, K)
    solved = np.linalg.solve(K, np.hstack([mass, S.astype(complex)]))
    scale = float(np.sqrt(np.abs(solved[:, :n]).sum(axis=1).max())) or 1.0
    companion = np.zeros((2 * n, 2 * n), dtype=complex)  # in the inverse of the pole, for M - i G may be singular
    companion[:n, n:] = np.eye(n)
    companion[n:, :n], companion[n:, n:] = -solved[:, :n] / scale**2, -solved[:, n:] / scale
    inverse, vectors = np.linalg.eig(companion)
    met = np.flatnonzero((-inverse.imag > 1e-9) & (np.abs(inverse.real) <= _ON_AXIS * np.abs(inverse)))
    met = met[np.argsort(inverse.imag[met])]
    poles = 1.0 / (1j * inverse.imag[met] * scale)
    return _critical(poles, vectors[:n, met], mass, S)


def _critical_of_free(mass: ComplexArray, S: Array, K: Array) -> ComplexModes:
    """``critical_modes`` of a singular K, without the zero frequencies."""
    from scipy.linalg import eig

    n, zero, unit = len(K), np.zeros_like(mass), np.eye(len(K))
    scale = float(np.sqrt(np.abs(K).max() / np.abs(mass).max())) or 1.0
    first = np.block([[zero, unit], [-K / scale**2, -S / scale]])
    values, vectors = eig(first, np.block([[unit + zero, zero], [zero, mass]]))
    known = np.isfinite(values) & (np.abs(values) < _INFINITE)
    values, vectors = values[known], vectors[:, known]
    met = np.flatnonzero((values.imag > 1e-6) & (np.abs(values.real) <= _ON_AXIS * np.abs(values)))
    met = met[np.argsort(values.imag[met])]
    return _critical(1j * values.imag[met] * scale, vectors[:n, met], mass, S)


def _critical(poles: ComplexArray, right: ComplexArray, mass: ComplexArray, S: Array) -> ComplexModes:
    weight = np.einsum("ik,ij,jk->k", right.conj(), 2.0 * mass, right) * poles
    weight += np.einsum("ik,ij,jk->k", right.conj(), S, right)
    return ComplexModes(poles=poles, right=right, left=right.conj() / weight)


def _paired(poles: ComplexArray) -> Array:
    """Order of the poles: one of each pair, then the others; real poles are paired with their neighbours in size."""
    real = np.flatnonzero(np.abs(poles.imag) <= 1e-12 * np.abs(poles).max(initial=0.0))
    real = real[np.argsort(np.abs(poles[real]), kind="stable")]
    above, below = (np.setdiff1d(np.flatnonzero(part > 0.0), real) for part in (poles.imag, -poles.imag))
    above, below = (part[np.argsort(np.abs(poles[part].imag), kind="stable")] for part in (above, below))
    return np.concatenate([real[::2], above, real[1::2], below])
