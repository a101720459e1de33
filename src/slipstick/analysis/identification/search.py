"""What is tried where a fit ends far from what was measured: other starts, mistakes in the numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from slipstick.analysis.identification.descent import FAR, Descent, End
from slipstick.analysis.identification.fit_request import FitRequest, spread_starts
from slipstick.analysis.identification.mistakes import Change, Scaled, changes, factor_text, round_factors
from slipstick.errors import SlipstickError
from slipstick.typing import Array

if TYPE_CHECKING:
    pass


ROUNDING = 1e-6
"""Misfit below which what is left is that of the solution, no noise."""
_TRIED, _FURTHER, _WIDE = 16, 3, 10.0
"""Where it ended far away so many other starts are compared, within this factor of the start where there are no bounds,
and the parameters fitted from so many of them."""
_LIKELY = 4
"""Mistakes of the measured numbers that are tried, the likeliest ones."""
_MOST_SOUGHT = 40
"""Evaluations of one descent meanwhile."""
_ENOUGH, _EXACT = 1.0 / 3.0, 1.0 / 8.0
"""Share of the misfit below which a mistake is the reason for it; one with a factor that is not round."""


class Tried(NamedTuple):
    """What is predicted at parameters that were compared."""

    p: Array
    predicted: Array
    cost: float


def compared_starts(request: FitRequest) -> list[Tried]:
    """The start given and others spread around it, those with a motion, the nearest to what was measured first."""
    start = request.starts[0]
    wide = _WIDE * np.where(start != 0.0, np.abs(start), 1.0)
    positive = (start > 0.0) & (request.low >= 0.0)
    low = np.where(positive, np.maximum(request.low, start / _WIDE), np.maximum(request.low, start - wide))
    high = np.minimum(request.high, np.where(positive, _WIDE * start, start + wide))
    low, high = (np.where(np.isfinite(side), side, near) for side, near in ((request.low, low), (request.high, high)))
    low = np.where(positive & (low == 0.0), start / _WIDE, low)
    out = []
    for p in spread_starts(start, low, high, 1 + _TRIED, 0):
        tried = predicted_at(request, p)
        if tried is not None:
            out.append(tried)
    return sorted(out, key=lambda each: each.cost)


def predicted_at(request: FitRequest, p: Array) -> Tried | None:
    """At parameters; None where there is no motion."""
    descent = Descent(request, p)
    try:
        descent.predictor.begin(p)
    except SlipstickError:  # values that the problem cannot have
        return None
    left = descent.left(p / descent.unit)
    assert descent.asked is not None
    return Tried(p, descent.asked[1], float(left @ left)) if np.all(np.isfinite(left)) else None


def further_ends(request: FitRequest, best: End, compared: Sequence[Tried]) -> tuple[list[End], str]:
    """Ends of descents from the nearest of the starts compared; and what was done, in words."""
    ends: list[End] = []
    others = [tried.p for tried in compared if not np.array_equal(tried.p, request.starts[0])]
    for p in others[:_FURTHER]:
        ends.append(Descent(request, p, most=_MOST_SOUGHT).chosen(p))
        if ends[-1].misfit <= FAR:
            ends.append(Descent(request, ends.pop().p).run())
            break
    nearest = min((end for end in ends if end.cost < best.cost), key=lambda end: end.cost, default=None)
    where = "with no motion" if not np.isfinite(best.cost) else f"far from what was measured, misfit {best.misfit:.2g}"
    outcome = "none ends nearer" if nearest is None else f"one ends at misfit {nearest.misfit:.2g} and is the result"
    return ends, (
        f"the fit from the start given ends {where}: {_TRIED} other starts were compared and the fit repeated from "
        f"{len(ends)} of them; {outcome}"
    )


def mistakes_in(request: FitRequest, best: End, compared: Sequence[Tried]) -> list[str]:
    """What in the measured numbers would explain that the fit ends far from them, one sentence."""
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
    for _, p, change, other in sorted(likely, key=lambda each: each[0])[:_LIKELY]:
        free = _fit_scaled(other, p, None)
        if free is None or not free[0].misfit < _ENOUGH * best.misfit:
            continue
        end, factor = free
        words, remedy, certain = change.words, change.remedy, False
        for value, hint in round_factors(factor):
            fixed = _fit_scaled(other, end.p, value)
            if fixed is not None and fixed[0].misfit <= max(2.0 * end.misfit, ROUNDING):
                end, factor, certain = fixed[0], value, True
                remedy = "; ".join(filter(None, (remedy, hint)))
                break
        if (factor == 1.0 and not words) or not (certain or end.misfit < _EXACT * best.misfit):
            continue
        if factor != 1.0:
            words += f"{' and ' if words else ''}divided by {factor_text(factor)}"
        values = ", ".join(f"{name} = {value:.4g}" for name, value in zip(request.names, end.p, strict=True))
        said = f"the measured numbers fit to {100.0 * end.misfit:.2g} % where they are {words}, with {values}"
        found.append((end.misfit, f"{said}: {remedy or 'check their scale and phase'}"))
        if certain and end.misfit <= ROUNDING:
            break  # of amplitudes, which have no phase, another mistake may come near as well
    if found:
        return [min(found)[1]]
    return [
        "no sign, phase, scale, derivative or unit of frequency of the measured numbers explains the misfit: another "
        "law, a parameter that is not sought, or another start may"
    ]


def _fit_scaled(request: FitRequest, start: Array, factor: complex | None) -> tuple[End, complex] | None:
    """The fit of numbers that are a factor times those of the problem, and that factor; None where there is none."""
    scaled = Scaled(request.predictor(), request.measured, factor)
    try:
        end = Descent(request, start, scaled, most=_MOST_SOUGHT).chosen(start)
    except SlipstickError:
        return None
    return (end, scaled.factor) if np.isfinite(end.cost) else None
