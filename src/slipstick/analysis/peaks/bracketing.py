"""A peak at a fixed value of the parameter, by bracketing the slope of the curve: it may jump through zero."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipstick.analysis.peaks.system import PeakDetail, PeakSystem
from slipstick.balance.systems import FrequencySystem
from slipstick.solve.continuation.events import BracketedRoot
from slipstick.solve.newton import NewtonOptions, newton
from slipstick.solve.norm import norm, relative
from slipstick.typing import Array

_FIRST, _WIDEST = 2e-4, 0.3
"""Half width of the bracket at first, and at most, of the frequency."""
_NARROW = 1e-11
_TRIALS = 60
_NEWTON = NewtonOptions(max_iterations=20)


class BracketedPeak(NamedTuple):
    """What was found: unknowns and frequency, with the slope there over the sizes of its terms."""

    y: Array
    detail: PeakDetail
    context: Array
    residual: float
    iterations: int
    slope: float


def bracketed_peak(system: PeakSystem, value: float, y: Array, context: Array | None) -> BracketedPeak | None:
    """The maximum of the curve next to ``y`` (N + 1,), for another ``value`` of the parameter; None without one."""
    search = _Search(system, value, context)
    x, omega, half = y[:-1], float(y[-1]), _FIRST
    while half <= _WIDEST:
        sides = [search.slope(omega * (1.0 + side), x) for side in (-half, half)]
        if None in sides:
            return None
        low, high = (float(side) for side in sides if side is not None)
        if low > 0.0 > high:
            return search.narrowed(omega * (1.0 - half), low, omega * (1.0 + half), high)
        # towards the side that rises, so that the bracket walks uphill
        omega *= 1.0 + (half if high > 0.0 else -half)
        half *= 1.6
    return None


class _Search:
    """Solutions of the balance at frequencies asked for, each from the one before."""

    def __init__(self, system: PeakSystem, value: float, context: Array | None) -> None:
        self._system, self._value = system, value
        self._context = None if context is None else np.append(np.nan, context[1:])
        self._balance = FrequencySystem(system.balance, system.at(value)[0])
        self._x: Array | None = None
        self._temperature = None if context is None or context.size == 1 else context[1:]
        self._solved = 0

    def slope(self, omega: float, x: Array | None = None) -> float | None:
        """Slope of the amplitude over the sizes of its terms; None where there is no solution."""
        start = self._x if self._x is not None else x
        assert start is not None
        found = newton(
            lambda z: self._balance.evaluate(z, omega, self._temperature), start, options=_NEWTON,
            scale=norm(start) or 1.0,
        )  # fmt: skip
        self._solved += found.iterations
        self._system.factorisations += found.evaluations
        if not found.converged:
            return None
        self._x = found.x
        here = self._system.slope(np.append(found.x, omega), self._value, self._context)
        return None if here is None else here[1].value / (here[1].size or 1.0)

    def narrowed(self, low: float, at_low: float, high: float, at_high: float) -> BracketedPeak | None:
        """The place where the slope passes zero, smooth or with a jump."""
        root = BracketedRoot(low, at_low, high, at_high)
        for _ in range(_TRIALS):
            if root.width <= _NARROW * high:
                break
            found = self.slope(root.trial)
            if found is None:
                return None
            root.update(root.trial, found, _NARROW * high)
        last = self.slope(root.best)
        if last is None or self._x is None:
            return None
        y = np.append(self._x, root.best)
        value = self._system.evaluate(y, self._value, self._context)
        if not np.all(np.isfinite(value.residual)):
            return None
        terms = value.terms()[:-1] if value.terms else np.ones(y.size - 1)
        residual = relative(value.residual[:-1], terms)
        return BracketedPeak(y, value.detail, value.context, residual, self._solved, abs(last))
