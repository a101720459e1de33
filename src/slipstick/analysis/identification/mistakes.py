"""Mistakes in measured numbers that one change mends: their sign, phase, units, derivative, or those of the frequency.

Where a fit ends far from what was measured, the parameters are fitted again to the numbers as they are after such a
change. A factor is found along: at any parameters it is the one that fits best (variable projection: L. Kaufman, BIT
15, 1975, 49-57).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi, sqrt
from typing import Any

import numpy as np

from slipstick.analysis.identification.kinds import Measured
from slipstick.analysis.identification.predicted import Predictor
from slipstick.quantities import FREQUENCIES
from slipstick.typing import Array

_NEAR = 0.1
"""A factor is taken for a round one within this distance, relative, if that fits as well."""
_ROUND: dict[complex, str] = {
    -1.0: "check the direction of the sensor and of the load",
    1j: "check whether the load is a sine or a cosine, and from where the phase is counted",
    -1j: "check whether the load is a sine or a cosine, and from where the phase is counted",
    2.0: "check whether they are peak-to-peak values",
    0.5: "check whether the load is a peak-to-peak value",
    sqrt(0.5): "check whether they are root-mean-square values",
    sqrt(2.0): "check whether the load is a root-mean-square value",
    9.81: "check whether the units are those of the problem (g)",
    1.0 / 9.81: "check whether the units are those of the problem (g)",
    2.0 * pi: "check whether frequencies in Hz and in rad/s were mixed",
    0.5 / pi: "check whether frequencies in Hz and in rad/s were mixed",
    **{10.0**k: "check whether the units are those of the problem" for k in (-9, -6, -3, -2, -1, 1, 2, 3, 6, 9)},
}


@dataclass(frozen=True, kw_only=True)
class Change:
    """Measured numbers, changed."""

    measured: Measured
    words: str
    """How; empty where they are as they were."""
    remedy: str


def changes(measured: Measured, orders: Array) -> Iterator[Change]:
    """The numbers as they are, and as they would be without each mistake; the simplest first.

    ``orders`` are those of the harmonics > 0.
    """
    if measured.in_time:
        return
    yield Change(measured=measured, words="", remedy="")
    conjugated = measured.conjugated()
    sign = "check the sign of their phase: they are z of Re(z exp(i omega t))"
    if conjugated is not None:
        yield Change(measured=conjugated, words="conjugated", remedy=sign)
    for unit in ("Hz", "rpm"):
        factor = FREQUENCIES[unit]
        if (changed := measured.at_frequencies(factor)) is not None:
            yield Change(
                measured=changed, words=f"taken at frequencies in {unit} instead of rad/s",
                remedy=f'if omega is in {unit}, give it the attribute units "{unit}"',
            )  # fmt: skip
        if (changed := measured.at_frequencies(1.0 / factor)) is not None:
            yield Change(
                measured=changed, words=f"taken at frequencies divided by {factor:.4g}",
                remedy=f"check whether frequencies in rad/s were taken for {unit}",
            )  # fmt: skip
    for order, name in ((1, "velocities"), (2, "accelerations")):
        for one, words, more in ((measured, "", ""), (conjugated, "conjugated and ", f"; {sign}")):
            if one is not None and (changed := one.integrated(orders, order)) is not None:
                yield Change(
                    measured=changed, words=f"{words}taken for {name}",
                    remedy=f"check whether they are {name}: displacements are compared{more}",
                )  # fmt: skip


class Scaled:
    """Another predictor times the factor that fits best, or a given one.

    The factor is complex where one harmonic alone was measured, and real otherwise; of a backbone it is that of the
    amplitude or damping.
    """

    def __init__(self, predictor: Predictor, measured: Measured, factor: complex | None = None) -> None:
        self.predictor, self.measured, self.given = predictor, measured, factor
        self.factor: complex = 1.0 if factor is None else factor
        self._predicted: Array = np.empty(0)

    several = 0

    @property
    def solved(self) -> int:
        """Motions solved for so far."""
        return self.predictor.solved

    def begin(self, p: Array) -> bool:
        """As of the other."""
        return self.predictor.begin(p)

    def values(self, p: Array) -> Array:
        """Scaled."""
        return self.scaled(self.predictor.values(p))

    def scaled(self, predicted: Array) -> Array:
        """A prediction of the other, scaled."""
        self._predicted = predicted
        x, d = self._numbers(predicted), self._numbers(self.measured.values)
        there = np.isfinite(x) & np.isfinite(d)
        power = float(np.sum(np.abs(x[there]) ** 2))
        if self.given is None:
            self.factor = complex(np.vdot(x[there], d[there]) / power) if power else 1.0
        return self._back(self.factor * x, predicted)

    def slopes(self, p: Array) -> Array:
        """Their derivatives, with those of the factor."""
        x, d = self._numbers(self._predicted), self._numbers(self.measured.values)
        there = np.isfinite(x) & np.isfinite(d)
        power = float(np.sum(np.abs(x[there]) ** 2))
        out = []
        for slope in self.predictor.slopes(p):
            rate = self._numbers(slope)
            moved: complex = 0.0
            if self.given is None and power:
                change = 2.0 * float(np.vdot(x[there], rate[there]).real)
                moved = complex((np.vdot(rate[there], d[there]) - self.factor * change) / power)
            out.append(self._back(self.factor * rate + moved * x, slope))
        return np.array(out)

    def _numbers(self, values: Array) -> Any:
        """Those that the factor is of."""
        if self.measured.quantities:
            return values[:, 1]
        if self.measured.one_complex:
            first = values[..., 1::2] - 1j * values[..., 2::2]
            return np.asarray(first)
        return values

    def _back(self, numbers: Any, like: Array) -> Array:
        if self.measured.quantities:
            return np.column_stack([like[:, 0], numbers.real])
        if self.measured.one_complex:
            out = like.copy()
            out[..., 1::2], out[..., 2::2] = numbers.real, -numbers.imag
            return out
        return np.asarray(numbers.real)


def round_factors(factor: complex) -> Iterator[tuple[complex, str]]:
    """Round factors near one, the nearest first, and what they point to."""
    known: dict[complex, str] = {1.0: "", **_ROUND}
    for value, words in _ROUND.items():
        if value.imag == 0.0 and value.real > 0.0:
            known[-value] = f"{_ROUND[-1.0]}, and {words}"
    near = [(abs(factor / value - 1.0), value) for value in known]
    for off, value in sorted(near, key=lambda each: each[0]):
        if off <= _NEAR:
            yield value, known[value]


def factor_text(factor: complex) -> str:
    """A factor as it is read."""
    factor = complex(factor)
    if abs(factor.imag) <= 1e-9 * abs(factor):
        return f"{factor.real:.4g}"
    if abs(factor.real) <= 1e-9 * abs(factor):
        return f"{'-' if factor.imag < 0 else ''}i" if abs(factor.imag) == 1.0 else f"{factor.imag:.4g} i"
    return f"{factor.real:.3g} {'+-'[int(factor.imag < 0.0)]} {abs(factor.imag):.3g} i"
