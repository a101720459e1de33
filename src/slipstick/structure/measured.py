"""Measured receptances between points of a structure: checks of what was measured, their poles and their noise.

A driving point of a passive structure is ``A(w) = sum_r R_r / (w_r^2 + 2 i zeta_r w_r w - w^2) + S - m / w^2`` with
``R_r, S, m >= 0``. Accelerance is ``-w^2 A``, mobility ``i w A``, and with the time dependence ``exp(-i w t)`` all are
conjugated. Fits with such coefficients (non-negative least squares) and the poles of the table tell which one it is.

Poles are those of the least-squares complex frequency method. All receptances have one denominator,
``A(w) = B(z) / a(z)`` with ``z = exp(i T (w - w_a))``: polynomials in ``z`` are well conditioned at any order. The
numerators are eliminated, the denominator follows by linear least squares (P. Guillaume, P. Verboven, S. Vanlanduit,
Proc. ISMA 23, 1998; B. Cauberghe, thesis, Vrije Universiteit Brussel, 2004). Physical poles stay where they are while
the order grows; poles of noise move, and most of them are unstable.

The variance of the noise of a receptance is ``a + b (w_1 / w)^4 + c |A|^2``: the floor of a sensor of displacement,
that of one of acceleration (whose receptance is divided by ``w^2``), and errors in proportion to the receptance. The
three are found by maximum likelihood from the squares of deviations.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import Fault, InputError
from slipstick.typing import Array, ComplexArray, IntArray

FLOOR = 0.02
"""Errors are relative to the receptance, or to this fraction of its size where the receptance is smaller."""
_PROMINENT = 0.05
"""Prominence of a resonance in the sum of all receptances, decades."""

CLEAR = 1.5
"""Factor on the noise above which a deviation is no noise."""
_ASYMMETRIC = 0.05
"""Relative difference of reciprocal receptances above which a warning is given."""
_ACTIVE, _SURE = 0.02, 4.0
"""Fraction of the receptance, and deviations of the noise, above which power out of a driving point is suspicious."""

_FIT_ERROR = 0.05
"""Relative accuracy of the fits that tell what kind of function was measured."""
_UNFIT, _BETTER = 0.01, 0.25
"""Fractions of the sum of squares. Functions are of another kind where as receptances they leave more than the first,
and as that kind less than the second of what they leave as receptances."""
_MOST_POINTS = 6
"""Driving points that these fits use: the strongest."""
_QUANTITIES = ("receptances", "mobilities", "accelerances")
_CHOICES = tuple((order, sign) for order in range(3) for sign in (1.0, -1.0))
"""Kinds of functions: number of time derivatives, and sign; first receptances and their negatives."""
_MOVES = ("displacement", "velocity", "acceleration")


@dataclass(frozen=True, kw_only=True)
class Receptances:
    """Receptances (n, n_pairs), length/force, at frequencies (n,), rad/s, of pairs of dofs.

    ``rows`` and ``columns`` (n_pairs,) number the dof that moves and the one that is forced.
    """

    dofs: tuple[str, ...]
    omega: Array
    values: ComplexArray
    rows: IntArray
    columns: IntArray

    @property
    def driving(self) -> NDArray[np.bool_]:
        """Which pairs are driving points, (n_pairs,)."""
        return np.asarray(self.rows == self.columns)

    def name(self, pair: int) -> str:
        """Description of a pair in messages."""
        return f"'{self.dofs[self.rows[pair]]}' by a force on '{self.dofs[self.columns[pair]]}'"

    @property
    def reciprocity(self) -> float:
        """Largest difference of receptances measured both ways, relative to their size; nan where none was."""
        return float(max((off for *_, off, _ in self._differences()), default=np.nan))

    def _differences(self) -> Iterator[tuple[int, int, float, float]]:
        """Pairs measured both ways, how much they differ, relative, and what of it is noise."""
        for k, j in self._both_ways():
            both = self.values[:, [k, j]]
            size, noise = np.linalg.norm(both[:, 0]), np.linalg.norm(np.sqrt(2.0) * deviation(self.omega, both))
            yield k, j, float(np.linalg.norm(both[:, 0] - both[:, 1]) / size), float(noise / size)

    def _both_ways(self) -> Iterator[tuple[int, int]]:
        place = {(int(i), int(j)): k for k, (i, j) in enumerate(zip(self.rows, self.columns, strict=True))}
        yield from ((k, place[j, i]) for (i, j), k in place.items() if i < j and (j, i) in place)

    def warnings(self, unit: str) -> Iterator[str]:
        """Sentences on suspicious measurements."""
        for k, _, off, noise in self._differences():
            if off > max(_ASYMMETRIC, CLEAR * noise):
                yield (
                    f"reciprocity: {self.name(k)} and the other way round differ by {100 * off:.2g} %; "
                    "their mean is taken"
                )
        points = np.flatnonzero(self.driving)
        deviations = deviation(self.omega, self.values[:, points])
        for k, uncertain in zip(points.tolist(), deviations.T, strict=True):
            active = self.values[:, k].imag > np.maximum(_ACTIVE * np.abs(self.values[:, k]), _SURE * uncertain)
            if active.any():
                low, high = self.omega[active][[0, -1]]
                yield (
                    f"passivity: at '{self.dofs[self.rows[k]]}' power comes out of the driving point at "
                    f"{int(active.sum())} of {active.size} frequencies, from {low:.5g} to {high:.5g} {unit} (Im > 0): "
                    "check sign and direction of force and sensor"
                )


def reciprocal(measured: Receptances) -> Receptances:
    """Receptances of each pair once: the mean where a pair was measured both ways."""
    groups: dict[tuple[int, int], list[int]] = {}
    for k, (i, j) in enumerate(zip(measured.rows.tolist(), measured.columns.tolist(), strict=True)):
        groups.setdefault((min(i, j), max(i, j)), []).append(k)
    rows, columns = np.array(list(groups)).T
    values = np.column_stack([measured.values[:, places].mean(axis=1) for places in groups.values()])
    return Receptances(dofs=measured.dofs, omega=measured.omega, values=values, rows=rows, columns=columns)


class _Kind(NamedTuple):
    """Kind of functions: conjugated or not, number of time derivatives, sign; and the misfit."""

    conjugated: bool
    order: int
    sign: float
    misfit: float


def checked(measured: Receptances) -> Poles:
    """Poles that many orders agree on, of functions that look like receptances.

    Raises
    ------
    InputError
        Where driving points are those of accelerance, mobility or of the conjugate, or of a sensor the wrong way round.
    """
    noise = deviation(measured.omega, measured.values)
    poles = stable_poles(measured.omega, measured.values, 1.0 / noise)
    points = np.flatnonzero(measured.driving)
    points = points[np.argsort(-np.linalg.norm(measured.values[:, points], axis=0))][:_MOST_POINTS]
    if not points.size:
        return poles
    left = _misfits(measured, noise, poles, points)
    kinds = [_Kind(False, *choice, float(off)) for choice, off in zip(_CHOICES, left.mean(axis=0), strict=True)]
    own, best = kinds[0], min(kinds, key=lambda kind: kind.misfit)
    if best.misfit > _UNFIT:
        other = replace(measured, values=measured.values.conj())
        turned = _misfits(other, noise, stable_poles(other.omega, other.values, 1.0 / noise), points).mean(axis=0)
        best = min(best, _Kind(True, 0, 1.0, float(turned.min())), key=lambda kind: kind.misfit)
    for point, (right, reversed_) in zip(points, left[:, :2], strict=True):
        if reversed_ < _BETTER * right and right > _UNFIT and best[:2] == (False, 0):
            raise InputError(
                Fault(
                    "receptances",
                    f"their residue at the driving point '{measured.dofs[measured.rows[point]]}' is negative: energy "
                    "would come out of it",
                    remedy="check the sign and direction of force and sensor",
                )
            )
    if own.misfit < _UNFIT or best.misfit > _BETTER * own.misfit:
        return poles
    off = f"(modes fit them to {_percent(best.misfit)} as such, to {_percent(own.misfit)} as receptances)"
    if best.conjugated:
        raise InputError(
            Fault(
                "receptances", f"turn the wrong way round: they are conjugated {off}",
                expected="lags, A(w) of exp(+i w t) with Im <= 0 at driving points", remedy="give complex conjugates",
            )
        )  # fmt: skip
    if best.order:
        raise InputError(
            Fault(
                "receptances", f"look like {_QUANTITIES[best.order]} {off}", expected="displacement over force",
                remedy=f'say quantity="{_MOVES[best.order]}"',
            )
        )  # fmt: skip
    return poles


def _percent(share: float) -> str:
    """The root of a share of the sum of squares, in words."""
    return f"{max(100.0 * np.sqrt(share), 0.1):.1f} %"


def _misfits(measured: Receptances, noise: Array, poles: Poles, points: IntArray) -> Array:
    """Misfits of driving points as each kind of function, (n_points, n_choices): fractions of the sum of squares.

    The part of the noise is subtracted.
    """
    from scipy.optimize import nnls

    w, (wr, zr) = measured.omega[:, None], poles
    left = np.ones((points.size, len(_CHOICES)))
    X = np.hstack([wr**2 / (wr**2 + 2j * zr * wr * w - w**2), np.ones_like(w), -((w[0] / w) ** 2)])
    for rest, point in zip(left, points, strict=True):
        if not wr.size:
            break
        A = measured.values[:, point]
        g = 1.0 / np.hypot(noise[:, point], _FIT_ERROR * np.abs(A))
        b, hidden = np.concatenate([(A * g).real, (A * g).imag]), 2.0 * float(np.sum((noise[:, point] * g) ** 2))
        for k, (order, sign) in enumerate(_CHOICES):
            Y = sign * X * (1j * w / w[-1]) ** order * g[:, None]
            left_there = nnls(np.vstack([Y.real, Y.imag]), b)[1] ** 2
            rest[k] = max(left_there - hidden, 0.0) / max(float(b @ b) - hidden, 1e-300)
    return left


def resonances(w: Array, size: Array) -> list[tuple[float, float, float]]:
    """Frequency, damping ratio by the half-power width, and prominence of the resonances."""
    from scipy.signal import find_peaks

    places, about = find_peaks(np.log10(size), prominence=_PROMINENT)
    out = []
    for k, prominence in zip(places.tolist(), about["prominences"].tolist(), strict=True):
        below = size < size[k] / np.sqrt(2.0)
        left = k - int(np.argmax(below[k::-1])) if below[:k].any() else 0
        right = k + int(np.argmax(below[k:])) if below[k:].any() else len(w) - 1
        width = float(w[right] - w[left]) / (2.0 * float(w[k]))
        out.append((float(w[k]), float(np.clip(width, 1e-4, 0.2)), prominence))
    return out


# poles

Poles = tuple[Array, Array]
"""Natural frequencies and damping ratios, (n_modes,) each."""

_ORDERS = (60, 150)
"""Highest order of the denominator, usual and at most."""
_COLUMNS = 16
"""Functions for which a common denominator is fitted: the strongest combinations where more were measured."""
_BEYOND = 0.1
"""Poles are found up to this fraction of the range above its end."""
_SAME, _SAME_DAMPING = 0.01, 0.2
"""Relative differences of a stable pole from one order to the next (D. J. Ewins, Modal Testing, 2000, chapter 4)."""
_STABLE = 0.3
"""Fraction of the orders that have to agree on a stable pole."""
_DAMPED = 0.3
"""Highest damping ratio of a resonance."""


def stable_poles(omega: Array, values: ComplexArray, weight: Array, *, many: int = 0) -> Poles:
    """Poles of receptances (n, n_pairs) that many orders agree on, ascending; ``many`` modes are expected, at least."""
    found, orders = _by_order(omega, values, weight, many)
    if not found:
        return np.zeros(0), np.zeros(0)
    w, z, order = (np.array(part) for part in zip(*found, strict=True))
    good = (z > 1e-6) & (z < _DAMPED)
    w, z, order = w[good], z[good], order[good]
    steady = np.zeros(w.size, dtype=bool)
    for k in range(w.size):
        before = order == order[k] - 1
        near = np.abs(w[before] / w[k] - 1.0) < np.minimum(_SAME, np.maximum(z[k], 1e-4))
        steady[k] = bool(np.any(near & (np.abs(z[before] / z[k] - 1.0) < _SAME_DAMPING)))
    w, z, order = w[steady], z[steady], order[steady]
    poles = []
    while w.size:
        near = [np.abs(w / w[k] - 1.0) < np.minimum(_SAME, 0.5 * z[k]) for k in range(w.size)]
        count = [np.unique(order[group]).size for group in near]
        best = int(np.argmax(count))
        if count[best] < max(_STABLE * orders, 3):
            break
        group = near[best]
        poles.append((float(np.median(w[group])), float(np.median(z[group]))))
        w, z, order = w[~group], z[~group], order[~group]
    poles.sort()
    return np.array([p[0] for p in poles]), np.array([p[1] for p in poles])


def _by_order(
    omega: Array, values: ComplexArray, weight: Array, many: int
) -> tuple[list[tuple[float, float, int]], int]:
    """Frequency, damping ratio and number of the order of all poles in the range, and how many orders there are."""
    low, high = float(omega[0]), float(omega[-1])
    start = 0.0 if low < 0.3 * high else low - 0.03 * (high - low)
    T = np.pi / (high + _BEYOND * (high - low) - start)
    n = int(min(max(_ORDERS[0], 6 * many), _ORDERS[1], omega.size // 4))
    Z = np.exp(1j * T * (omega - start))[:, None] ** np.arange(n + 1)
    if values.shape[1] > _COLUMNS:
        common = np.sqrt(np.mean(weight**2, axis=1))[:, None]
        U, s, _ = np.linalg.svd(values * common, full_matrices=False)
        values, weight = U[:, :_COLUMNS] * s[:_COLUMNS] / common, np.broadcast_to(common, (omega.size, _COLUMNS))
    normal = np.zeros((n + 1, n + 1))
    for function, g in zip(values.T, weight.T, strict=True):
        X = Z * g[:, None]
        Q, _ = np.linalg.qr(np.vstack([X.real, X.imag]))
        Y = X * function[:, None]
        Y2 = np.vstack([Y.real, Y.imag])
        Y2 -= Q @ (Q.T @ Y2)
        normal += Y2.T @ Y2
    found, orders = [], range(4, n + 1, 2)
    for number, order in enumerate(orders):
        part = normal[: order + 1, : order + 1]
        a = np.append(np.linalg.lstsq(part[:-1, :-1], -part[:-1, -1], rcond=None)[0], 1.0)
        roots = np.roots(a[::-1])
        roots = roots[(roots.imag > 0.0) & (np.abs(roots) > 1e-6)]
        s = np.log(roots) / T + 1j * start
        w = np.abs(s)
        inside = (w > low) & (w < high + _BEYOND * (high - low))
        found += [(float(x), float(-p.real / x), number) for x, p in zip(w[inside], s[inside], strict=True)]
    return found, len(orders)


# noise

_STEPS = 200
"""Steps towards the largest likelihood, at most."""
_LIKELIER = 15.0
"""Gain of log-likelihood that three terms need over one; fourth differences of neighbours are not independent."""
_SMALLEST = 1e-13
"""Deviation of rounding, relative to the size of a function."""
_NEARBY = 5
"""Lines whose median size stands for the size without noise, except at antiresonances."""
_AROUND, _GROWS = 9, 8.0
"""Lines over which squares are averaged, and growth with the stride from which on they are no noise (smooth: 256)."""
FEWEST_NOISY = 0.2
"""Fraction of lines that have to show noise."""


def noise_squares(values: ComplexArray) -> tuple[Array, NDArray[np.bool_]]:
    """Squared deviations of functions (n, n_pairs) from smooth ones, by fourth differences, and where they are noise.

    The mean of the squares is the variance of the noise. Where the lines are too coarse for the function, squares with
    every second line are many times larger; those of noise stay the same.
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
        Squares of deviations (n, n_pairs); by default those of fourth differences.
    size
        Sizes without noise, (n, n_pairs), by default the medians of neighbours, where these are smaller.
    """
    from scipy.ndimage import median_filter

    if size is None:
        size = np.minimum(np.abs(values), median_filter(np.abs(values), (_NEARBY, 1), mode="nearest"))
    used = np.ones(values.shape, dtype=bool)
    if squares is None:
        squares, used = noise_squares(values)
        used = used | (used.mean(axis=0) < FEWEST_NOISY)
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

    One term alone where all together are hardly likelier: else a trace of another would rule where the first is small.
    Multiplicative steps that never decrease the likelihood (C. Fevotte, N. Bertin, J.-L. Durrieu, Neural Computation
    21, 2009).
    """
    factors = np.full(terms.shape[1], float(np.mean(squares))) / np.mean(terms, axis=0) / terms.shape[1]
    alone = np.maximum(terms, 1e-300)
    single = np.mean(squares[:, None] / alone, axis=0)
    unlikely = [_negative_log_likelihood(alone[:, k] * factor, squares) for k, factor in enumerate(single)]
    for _ in range(_STEPS):
        inverse = 1.0 / (terms @ factors)
        step = np.sqrt(((squares * inverse**2) @ terms) / (inverse @ terms))
        factors = factors * step
        if np.all(np.abs(step - 1.0) < 1e-3):
            break
    best = int(np.argmin(unlikely))
    if unlikely[best] < _negative_log_likelihood(terms @ factors, squares) + _LIKELIER:
        factors = np.where(np.arange(len(single)) == best, single, 0.0)
    return np.asarray(factors)


def _negative_log_likelihood(variance: Array, squares: Array) -> float:
    """Negative logarithm of the likelihood of squares (n,)."""
    return float(np.sum(np.log(variance) + squares / variance))
