"""Measured receptances between points of a structure, and whether they are what they are taken for.

A driving point of a passive structure is ``A(w) = sum_r R_r / (w_r^2 + 2 i zeta_r w_r w - w^2) + S - m / w^2`` with
``R_r, S, m >= 0``; accelerance is ``-w^2 A``, mobility ``i w A``, and in the other sign of time all is conjugated.
Which of these it is follows from fits with such coefficients (non-negative least squares), with the poles of the table.
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
"""Errors are judged relative to the receptance, and to this share of its size where that is small."""
_PROMINENT = 0.05
"""Decades by which a peak of the sum of all receptances stands out."""
_RECIPROCAL = 0.05
CLEAR = 1.5
"""As many times what noise explains is more than noise."""
_ACTIVE, _SURE = 0.02, 4.0
"""What is suspicious: of reciprocity, of power out of a driving point, and this in deviations of the noise."""
_SHARE = 0.05
"""Accuracy that is asked of a fit that tells what functions are, relative."""
_UNFIT, _BETTER = 0.01, 0.25
"""Functions are not what they are taken for where they fit worse than the first, and something else leaves only the
share of the second; both of the sum of squares."""
_TOLD = 6
"""Driving points that are looked at: the strongest."""
_QUANTITIES = ("receptances", "mobilities", "accelerances")
_CHOICES = tuple((order, sign) for order in range(3) for sign in (1.0, -1.0))
"""What functions may be: how often differentiated, with which sign; first what they are taken for and its negative."""
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
        """Of a pair, in words."""
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
        """What is suspicious in what was measured."""
        for k, _, off, noise in self._differences():
            if off > max(_RECIPROCAL, CLEAR * noise):
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
    """With the mean of what was measured both ways, each pair once."""
    groups: dict[tuple[int, int], list[int]] = {}
    for k, (i, j) in enumerate(zip(measured.rows.tolist(), measured.columns.tolist(), strict=True)):
        groups.setdefault((min(i, j), max(i, j)), []).append(k)
    rows, columns = np.array(list(groups)).T
    values = np.column_stack([measured.values[:, places].mean(axis=1) for places in groups.values()])
    return Receptances(dofs=measured.dofs, omega=measured.omega, values=values, rows=rows, columns=columns)


class _Taken(NamedTuple):
    """What functions may be: conjugated or not, how often differentiated, with which sign; and the misfit."""

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
    points = points[np.argsort(-np.linalg.norm(measured.values[:, points], axis=0))][:_TOLD]
    if not points.size:
        return poles
    left = _misfits(measured, noise, poles, points)
    kinds = [_Taken(False, *choice, float(off)) for choice, off in zip(_CHOICES, left.mean(axis=0), strict=True)]
    own, best = kinds[0], min(kinds, key=lambda kind: kind.misfit)
    if best.misfit > _UNFIT:
        other = replace(measured, values=measured.values.conj())
        turned = _misfits(other, noise, stable_poles(other.omega, other.values, 1.0 / noise), points).mean(axis=0)
        best = min(best, _Taken(True, 0, 1.0, float(turned.min())), key=lambda kind: kind.misfit)
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
    off = f"({100 * np.sqrt(best.misfit):.2g} % off as such, {100 * np.sqrt(own.misfit):.2g} % as receptances)"
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


def _misfits(measured: Receptances, noise: Array, poles: Poles, points: IntArray) -> Array:
    """Of driving points, for all choices of what they may be, (n_points, n_choices): shares of the sum of squares.

    What the noise makes of it is taken off.
    """
    from scipy.optimize import nnls

    w, (wr, zr) = measured.omega[:, None], poles
    left = np.ones((points.size, len(_CHOICES)))
    X = np.hstack([wr**2 / (wr**2 + 2j * zr * wr * w - w**2), np.ones_like(w), -((w[0] / w) ** 2)])
    for rest, point in zip(left, points, strict=True):
        if not wr.size:
            break
        A = measured.values[:, point]
        g = 1.0 / np.hypot(noise[:, point], _SHARE * np.abs(A))
        b, hidden = np.concatenate([(A * g).real, (A * g).imag]), 2.0 * float(np.sum((noise[:, point] * g) ** 2))
        for k, (order, sign) in enumerate(_CHOICES):
            Y = sign * X * (1j * w / w[-1]) ** order * g[:, None]
            left_there = nnls(np.vstack([Y.real, Y.imag]), b)[1] ** 2
            rest[k] = max(left_there - hidden, 0.0) / max(float(b @ b) - hidden, 1e-300)
    return left


def resonances(w: Array, size: Array) -> list[tuple[float, float, float]]:
    """Frequency, damping ratio by the half-power width, and prominence of the resonances seen."""
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
"""Functions that denominators are sought of: the strongest combinations where more were measured."""
_BEYOND = 0.1
"""Poles are sought up to this share of the range above its end."""
_SAME, _SAME_DAMPING = 0.01, 0.2
"""Relative differences of a stable pole from one order to the next, as Ewins has them in his chapter 4."""
_STABLE = 0.3
"""Share of the orders in which a stable pole is found."""
_DAMPED = 0.3
"""Damping ratio up to which a resonance is taken for one."""


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
