"""Whether a converged point is the next one of its branch; and the way round a corner, where none lies ahead."""

from __future__ import annotations

from slipstick.errors import Reason
from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.options import StepOptions
from slipstick.solve.continuation.predictor import Span
from slipstick.solve.continuation.step import Step
from slipstick.solve.newton import NewtonResult
from slipstick.typing import Array

_KINK_SHARE = 0.25
_KINK_CORRECTION = 5.0


class Rejection(Reason):
    """Why no next point was found, or one was not believed."""

    NOTHING_AHEAD = "no solution was found ahead"
    OUTSIDE = "the corrected point lies outside of the range"
    ORIENTATION = "the orientation of the branch changes (bifurcation, or another branch)"
    FAR = "the solution found is far from the predicted one"
    DOUBTED = "part of the solution is not as predicted"
    SHARP = "the direction of the branch changes too much"


def reach(options: StepOptions, length: float) -> float:
    """How far from its prediction the solution of a step of ``length`` may lie."""
    corner = length <= _KINK_SHARE * options.max_step
    return max(_KINK_CORRECTION if corner else 0.0, options.max_correction) * length


def objection(
    corrector: Corrector, span: Span, options: StepOptions, last: Step, new: Step, guess: Array, length: float
) -> Rejection | None:
    """Why ``new``, found from ``guess`` by a step of ``length``, is not believed to follow ``last``; None if it is."""
    metric = corrector.metric
    if new.kind != "end" and span.passed(new.parameter) is not None:
        return Rejection.OUTSIDE
    turned = last.orientation * new.orientation < 0
    tiny = length <= options.kink_step
    if turned and tiny:
        new.name = "orientation change"
    elif turned:
        return Rejection.ORIENTATION
    kink = tiny or (length <= _KINK_SHARE * options.max_step and corrector.is_kink(last, new))
    if metric.length(new.state - guess) > (_KINK_CORRECTION if kink else options.max_correction) * length:
        return Rejection.FAR
    if not kink and corrector.angle(last.tangent, new.tangent) > options.max_angle:
        return Rejection.SHARP
    return None


def turn(corrector: Corrector, span: Span, last: Step, length: float) -> tuple[Step | None, NewtonResult]:
    """The first point beyond the corner next to ``last``; None where there is none.

    Beyond the corner the equations of the next piece hold: their null direction, oriented so that the determinant
    keeps its sign (B. C. Eaves, Mathematical Programming Study 10 (1979) 1), leads on.
    """
    metric = corrector.metric
    unit = last.tangent / metric.length(last.tangent)
    ahead = corrector.tangent_at(last.state + 4.0 * length * unit, unit)
    if ahead is None:
        return None, NewtonResult(last.state)
    direction = ahead[0] if ahead[1] == last.orientation else -ahead[0]
    guess = last.state + 1.5 * length * unit + 4.0 * length * direction
    new, result = corrector.correct(guess, direction, "regular", name="corner")
    if new is None or new.orientation != last.orientation or span.passed(new.parameter) is not None:
        return None, result
    near = metric.length(new.state - last.state) <= 10.0 * length
    return (new if near else None), result
