"""Noise of measured functions, seen in the functions themselves: a floor, and a share of what is measured.

The variance of a complex receptance is ``a + b (w_1 / w)^4 + c |A|^2``: the floor of a sensor of displacement, that of
one of acceleration (whose receptance is divided by ``w^2``), and errors that grow with what is measured. The three are
found by maximum likelihood from the squares of what deviates.
"""

from __future__ import annotations

import numpy as np

from slipstick.typing import Array, ComplexArray

_STEPS = 200
_SMALLEST = 1e-9
"""Deviation below which noise is rounding, relative to the size of a function."""
_NEARBY = 5
"""Lines whose mean size stands for the size without noise."""


def seen(values: ComplexArray) -> Array:
    """Squares (n - 4, n_pairs) of the deviation of functions (n, n_pairs) from smooth ones, by fourth differences.

    In the mean they are the variance of the noise; where a resonance is as narrow as a few lines they are larger.
    """
    return np.asarray(np.abs(np.diff(values, 4, axis=0)) ** 2 / 70.0)


def deviation(omega: Array, values: ComplexArray, squares: Array | None = None, size: Array | None = None) -> Array:
    """Standard deviation of real and imaginary part each, (n, n_pairs).

    Parameters
    ----------
    omega
        Frequencies (n,).
    values
        Functions (n, n_pairs).
    squares
        Squares of deviations (n, n_pairs); by default those that fourth differences show.
    size
        Sizes without noise, (n, n_pairs), by default the mean size of neighbours.
    """
    if size is None:
        size = _local_mean(np.abs(values))
    if squares is None:
        squares = np.pad(seen(values), ((2, 2), (0, 0)), mode="edge")
    mean = np.mean(np.abs(values) ** 2, axis=0)
    out = np.empty(values.shape)
    low = (omega[0] / omega) ** 4
    for pair in range(values.shape[1]):
        unit = float(mean[pair]) or 1.0
        terms = np.column_stack([np.ones_like(low), low, size[:, pair] ** 2 / unit])
        s = squares[:, pair] / unit + _SMALLEST**2
        out[:, pair] = np.sqrt(0.5 * unit * (terms @ _likeliest(terms, s)))
    return out


def _likeliest(terms: Array, squares: Array) -> Array:
    """Factors >= 0 of terms (n, n_terms) whose sum is the variance of which exponential ``squares`` (n,) are samples.

    Multiplicative steps that never lose likelihood (C. Fevotte, N. Bertin, J.-L. Durrieu, Neural Computation 21, 2009).
    """
    factors = np.full(terms.shape[1], float(np.mean(squares))) / np.mean(terms, axis=0) / terms.shape[1]
    for _ in range(_STEPS):
        inverse = 1.0 / (terms @ factors)
        step = np.sqrt(((squares * inverse**2) @ terms) / (inverse @ terms))
        factors = factors * step
        if np.all(np.abs(step - 1.0) < 1e-3):
            break
    return np.asarray(factors)


def _local_mean(size: Array) -> Array:
    from scipy.ndimage import uniform_filter1d

    return np.asarray(np.sqrt(uniform_filter1d(size**2, _NEARBY, axis=0, mode="nearest")))
