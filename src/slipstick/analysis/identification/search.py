"""Remedies tried where a fit ends far from the measured numbers: other starts, and mistakes in the numbers.

A mistake is one that a single change mends: sign, phase, units, a derivative, or the units of the frequency. The
parameters are fitted again to the changed numbers. An unknown factor is eliminated: at any parameters it is the one
that fits best (variable projection: L. Kaufman, BIT 15, 1975, 49-57).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from slipstick.analysis.identification.descent import Descent, End
from slipstick.analysis.identification.fit_request import FitRequest, spread_starts
from slipstick.analysis.identification.kinds import Measured
from slipstick.analysis.identification.predicted import Predictor
from slipstick.errors import SlipstickError
from slipstick.quantities import FREQUENCIES
from slipstick.typing import Array

_ROUND_DISTANCE = 0.1
"""Relative distance up to which a factor is replaced by a round one that fits as well."""
_ROUND_FACTORS: dict[complex, str] = {
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


ROUNDING = 1e-6
"""Misfit up to which residuals are errors of the solution, not noise."""
_STARTS, _FITTED_STARTS, _SPREAD = 16, 3, 10.0
"""Number of other starts that are compared after a fit that ends far away, number from which it is repeated, and
their largest factor on the start without bounds."""
_FITTED_CHANGES = 4
"""Number of changes of the measured numbers, the likeliest ones, to which the parameters are fitted."""
_MOST_EVALUATIONS = 40
"""Largest number of evaluations in each of these descents."""
_EXPLAINED, _EXPLAINED_SCALED = 1.0 / 3.0, 1.0 / 8.0
"""Share of the misfit below which a change explains it: without a factor or with a round one, and with another one."""


@dataclass(frozen=True, kw_only=True)
class Change:
    """A change of the measured numbers."""

    measured: Measured
    words: str
    """Description of the change; empty without one."""
    remedy: str


def changes(measured: Measured, orders: Array) -> Iterator[Change]:
    """The unchanged numbers, and changes that correct a possible mistake each, the simplest first.

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
    for order, name, quantity in ((1, "velocities", "velocity"), (2, "accelerations", "acceleration")):
        for one, words, more in ((measured, "", ""), (conjugated, "conjugated and ", f"; {sign}")):
            if one is not None and (changed := one.integrated(orders, order)) is not None:
                yield Change(
                    measured=changed, words=f"{words}taken for {name}",
                    remedy=f'displacements are compared: if they are {name}, say quantity = "{quantity}"{more}',
                )  # fmt: skip


class Scaled:
    """A predictor times the factor that fits best, or a given one.

    The factor is complex if only one harmonic was measured, else real. Of a backbone it multiplies the amplitude or
    damping ratio.
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
        """Choose the motions of the predictor."""
        return self.predictor.begin(p)

    def values(self, p: Array) -> Array:
        """Scaled predictions."""
        return self.scaled(self.predictor.values(p))

    def scaled(self, predicted: Array) -> Array:
        """Scaled values of a prediction."""
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
    known: dict[complex, str] = {1.0: "", **_ROUND_FACTORS}
    for value, words in _ROUND_FACTORS.items():
        if value.imag == 0.0 and value.real > 0.0:
            known[-value] = f"{_ROUND_FACTORS[-1.0]}, and {words}"
    near = [(abs(factor / value - 1.0), value) for value in known]
    for off, value in sorted(near, key=lambda each: each[0]):
        if off <= _ROUND_DISTANCE:
            yield value, known[value]


def factor_text(factor: complex) -> str:
    """A factor as it is read."""
    factor = complex(factor)
    if abs(factor.imag) <= 1e-9 * abs(factor):
        return f"{factor.real:.4g}"
    if abs(factor.real) <= 1e-9 * abs(factor):
        return f"{'-' if factor.imag < 0 else ''}i" if abs(factor.imag) == 1.0 else f"{factor.imag:.4g} i"
    return f"{factor.real:.3g} {'+-'[int(factor.imag < 0.0)]} {abs(factor.imag):.3g} i"


class Tried(NamedTuple):
    """Prediction at compared parameters."""

    p: Array
    predicted: Array
    cost: float


def compared_starts(request: FitRequest) -> list[Tried]:
    """Starts with a motion, the given one and others around it, sorted by their distance from the measurement."""
    start = request.starts[0]
    wide = _SPREAD * np.where(start != 0.0, np.abs(start), 1.0)
    positive = (start > 0.0) & (request.low >= 0.0)
    low = np.where(positive, np.maximum(request.low, start / _SPREAD), np.maximum(request.low, start - wide))
    high = np.minimum(request.high, np.where(positive, _SPREAD * start, start + wide))
    low, high = (np.where(np.isfinite(side), side, near) for side, near in ((request.low, low), (request.high, high)))
    low = np.where(positive & (low == 0.0), start / _SPREAD, low)
    out = []
    for p in spread_starts(start, low, high, 1 + _STARTS, 0):
        tried = predicted_at(request, p)
        if tried is not None:
            out.append(tried)
    return sorted(out, key=lambda each: each.cost)


def predicted_at(request: FitRequest, p: Array) -> Tried | None:
    """Prediction at parameters; None where there is no motion."""
    descent = Descent(request, p)
    try:
        descent.predictor.begin(p)
    except SlipstickError:  # values that the problem cannot have
        return None
    left = descent.left(p / descent.unit)
    assert descent.latest is not None
    return Tried(p, descent.latest[1], float(left @ left)) if np.all(np.isfinite(left)) else None


def further_ends(request: FitRequest, best: End, compared: Sequence[Tried]) -> tuple[list[End], str]:
    """Ends of descents from the best compared starts, and a sentence about them."""
    ends: list[End] = []
    others = [tried.p for tried in compared if not np.array_equal(tried.p, request.starts[0])]
    for p in others[:_FITTED_STARTS]:
        ends.append(Descent(request, p, most=_MOST_EVALUATIONS).choose_and_descend(p))
        if not ends[-1].far:
            ends.append(Descent(request, ends.pop().p).run())
            break
    nearest = min((end for end in ends if end.cost < best.cost), key=lambda end: end.cost, default=None)
    where = "with no motion" if not np.isfinite(best.cost) else f"far from what was measured, misfit {best.misfit:.2g}"
    outcome = "none ends nearer" if nearest is None else f"one ends at misfit {nearest.misfit:.2g} and is the result"
    return ends, (
        f"the fit from the start given ends {where}: {_STARTS} other starts were compared and the fit repeated from "
        f"{len(ends)} of them; {outcome}"
    )


def mistakes_in(request: FitRequest, best: End, compared: Sequence[Tried]) -> list[str]:
    """A sentence about the mistake in the measured numbers that explains the misfit, or that none does."""
    orders = np.array(request.problem.harmonics.orders[1:], dtype=float)
    likely: list[tuple[float, Array, Change, FitRequest]] = []
    for change in changes(request.measured, orders):
        other = replace(
            request, measured=change.measured, noise=None, relative=None, absolute=None, found=False, kept=[]
        )
        seen: Sequence[Tried | None] = compared
        if not np.array_equal(change.measured.omega, request.measured.omega):
            seen = [predicted_at(other, request.starts[0])]
        scaled = Scaled(other.predictor(), change.measured)
        near = [(other.misfit(other.left(scaled.scaled(tried.predicted))), tried.p) for tried in seen if tried]
        if near:
            likely.append((*min(near, key=lambda each: each[0]), change, other))
    found: list[tuple[float, str]] = []
    for _, p, change, other in sorted(likely, key=lambda each: each[0])[:_FITTED_CHANGES]:
        free = _fit_scaled(other, p, None)
        if free is None or not free[0].misfit < _EXPLAINED * best.misfit:
            continue
        end, factor = free
        words, remedy, certain = change.words, change.remedy, False
        for value, hint in round_factors(factor):
            fixed = _fit_scaled(other, end.p, value)
            if fixed is not None and fixed[0].misfit <= max(2.0 * end.misfit, ROUNDING):
                end, factor, certain = fixed[0], value, True
                remedy = "; ".join(filter(None, (remedy, hint)))
                break
        if (factor == 1.0 and not words) or not (certain or end.misfit < _EXPLAINED_SCALED * best.misfit):
            continue
        if factor != 1.0:
            words += f"{' and ' if words else ''}divided by {factor_text(factor)}"
        values = ", ".join(f"{name} = {value:.4g}" for name, value in zip(request.names, end.p, strict=True))
        said = f"the measured numbers fit to {100.0 * end.misfit:.2g} % where they are {words}, with {values}"
        found.append((end.misfit, f"{said}: {remedy or 'check their scale and phase'}"))
        if certain and end.misfit <= ROUNDING:
            break  # amplitudes have no phase: further changes may fit nearly as well
    if found:
        return [min(found)[1]]
    return [
        "no sign, phase, scale, derivative or unit of frequency of the measured numbers explains the misfit: another "
        "law, a parameter that is not sought, or another start may"
    ]


def _fit_scaled(request: FitRequest, start: Array, factor: complex | None) -> tuple[End, complex] | None:
    """Fit of the predictions times a factor, and that factor; None where the fit fails."""
    scaled = Scaled(request.predictor(), request.measured, factor)
    try:
        end = Descent(request, start, scaled, most=_MOST_EVALUATIONS).choose_and_descend(start)
    except SlipstickError:
        return None
    return (end, scaled.factor) if np.isfinite(end.cost) else None
