"""The way round a corner, where no point of the branch lies ahead."""

from __future__ import annotations

from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.predictor import Span
from slipstick.solve.continuation.step import Step
from slipstick.solve.continuation.step_acceptance import BEYOND_CORNER, BEYOND_CORNER_ALONG, CORNER_NEAR, CORNER_PASSED
from slipstick.solve.newton import NewtonResult


def turn(corrector: Corrector, span: Span, last: Step, length: float) -> tuple[Step | None, NewtonResult]:
    """Find the first point beyond the corner next to ``last``; None where there is none.

    Beyond the corner the equations of the next piece hold: their null direction, oriented so that the determinant
    keeps its sign (B. C. Eaves, Mathematical Programming Study 10 (1979) 1), leads on.
    """
    metric = corrector.metric
    unit = last.tangent / metric.length(last.tangent)
    ahead = corrector.tangent_at(last.state + BEYOND_CORNER * length * unit, unit)
    if ahead is None:
        return None, NewtonResult(last.state)
    direction = ahead[0] if ahead[1] == last.orientation else -ahead[0]
    guess = last.state + CORNER_PASSED * length * unit + BEYOND_CORNER_ALONG * length * direction
    new, result = corrector.correct(guess, direction, "regular", name="corner")
    if new is None or new.orientation != last.orientation or span.outside(new.parameter):
        return None, result
    return (new if metric.length(new.state - last.state) <= CORNER_NEAR * length else None), result
