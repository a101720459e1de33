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
from slipstick.structure.measurement_noise import deviation
from slipstick.structure.modal_poles import Poles, stable_poles
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
