"""Noise of measured functions, seen in the functions themselves: a floor, and a share of what is measured.

The variance of a complex receptance is ``a + b (w_1 / w)^4 + c |A|^2``: the floor of a sensor of displacement, that of
one of acceleration (whose receptance is divided by ``w^2``), and errors that grow with what is measured. The three are
found by maximum likelihood from the squares of what deviates.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slipstick.typing import Array, ComplexArray

_STEPS = 200
_LIKELIER = 15.0
"""By how much three terms have to be likelier than one; fourth differences of neighbours are not independent."""
_SMALLEST = 1e-13
"""Deviation below which noise is rounding, relative to the size of a function."""
_NEARBY = 5
"""Lines whose median size stands for the size without noise, except at antiresonances."""
_AROUND, _GROWS = 9, 8.0
"""Lines over which squares are compared, and from which factor on they do not stem from noise (256 where smooth)."""
FEW = 0.2
"""Share of lines that have to show noise."""


def seen(values: ComplexArray) -> tuple[Array, NDArray[np.bool_]]:
    """Squares of what functions (n, n_pairs) deviate from smooth ones, by fourth differences, and where this is noise.

    In the mean the squares are the variance of the noise. Where lines are too coarse for the function they are not:
    then they are many times larger with every second line, while those of noise stay.
    """
    from scipy.ndimage import convolve1d, maximum_filter1d

    near, far = (_differences(values, stride) for stride in (1, 2))
    means = (convolve1d(part, np.full(_AROUND, 1.0 / _AROUND), axis=0, mode="nearest") for part in (near, far))
    grows = next(means) * _GROWS < next(means)
    return near, ~maximum_filter1d(grows, 2 * _AROUND - 1, axis=0, mode="nearest")


def _differences(values: ComplexArray, stride: int) -> Array:
    n = len(values) - 4 * stride
    parts = [values[k * stride : k * stride + n] * factor for k, factor in enumerate((1.0, -4.0, 6.0, -4.0, 1.0))]
    return np.pad(np.abs(sum(parts)) ** 2 / 70.0, ((2 * stride, 2 * stride), (0, 0)), mode="edge")


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
        Sizes without noise, (n, n_pairs), by default the medians of neighbours, where these are smaller.
    """
    from scipy.ndimage import median_filter

    if size is None:
        size = np.minimum(np.abs(values), median_filter(np.abs(values), (_NEARBY, 1), mode="nearest"))
    used = np.ones(values.shape, dtype=bool)
    if squares is None:
        squares, used = seen(values)
        used = used | (used.mean(axis=0) < FEW)
    mean = np.mean(np.abs(values) ** 2, axis=0)
    out = np.empty(values.shape)
    low = (omega[0] / omega) ** 4
    for pair in range(values.shape[1]):
        unit = float(mean[pair]) or 1.0
        terms = np.column_stack([np.ones_like(low), low, size[:, pair] ** 2 / unit])
        s, lines = squares[:, pair] / unit + _SMALLEST**2, used[:, pair]
        out[:, pair] = np.sqrt(0.5 * unit * (terms @ _likeliest(terms[lines], s[lines])))
    return out


def _likeliest(terms: Array, squares: Array) -> Array:
    """Factors >= 0 of terms (n, n_terms) whose sum is the variance of which exponential ``squares`` (n,) are samples.

    One term alone, where all together are hardly likelier: a trace of another would stand where the first is small.
    Multiplicative steps that never lose likelihood (C. Fevotte, N. Bertin, J.-L. Durrieu, Neural Computation 21, 2009).
    """
    factors = np.full(terms.shape[1], float(np.mean(squares))) / np.mean(terms, axis=0) / terms.shape[1]
    alone = np.maximum(terms, 1e-300)
    single = np.mean(squares[:, None] / alone, axis=0)
    unlikely = [_unlikely(alone[:, k] * factor, squares) for k, factor in enumerate(single)]
    for _ in range(_STEPS):
        inverse = 1.0 / (terms @ factors)
        step = np.sqrt(((squares * inverse**2) @ terms) / (inverse @ terms))
        factors = factors * step
        if np.all(np.abs(step - 1.0) < 1e-3):
            break
    best = int(np.argmin(unlikely))
    if unlikely[best] < _unlikely(terms @ factors, squares) + _LIKELIER:
        factors = np.where(np.arange(len(single)) == best, single, 0.0)
    return np.asarray(factors)


def _unlikely(variance: Array, squares: Array) -> float:
    """Negative logarithm of the likelihood of squares (n,)."""
    return float(np.sum(np.log(variance) + squares / variance))
