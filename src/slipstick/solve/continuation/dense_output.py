"""Points of the branch between corrected points: on the cubic through these, corrected, or on halves of it."""

from __future__ import annotations

from functools import lru_cache
from math import ceil, isfinite
from typing import Protocol

import numpy as np

from slipstick.solve.continuation.corrector import Corrector, Step
from slipstick.solve.continuation.hermite_segment import HermiteBasis, HermiteSegment
from slipstick.solve.continuation.step_control import Span, cubic_distance
from slipstick.typing import Array, BoolArray


class Observables(Protocol):
    """Quantities computed from states; evaluates many states together."""

    @property
    def any(self) -> bool:
        """Whether there are quantities other than the unknowns."""
        ...

    def narrow(self, low: float, high: float) -> Array:
        """Values (n,) of the parameter between both, ascending, around which an observable may have a narrow peak."""
        ...

    def between(self, first: Step, second: Step, states: Array) -> Between:
        """States (n, N + 1) between two solutions, evaluated."""
        ...


class Between(Protocol):
    """Evaluated states between two solutions; changes are relative to the size of each observable nearby."""

    residuals: Array
    """(n, N)."""

    def changes(self, dx: Array) -> Array:
        """Largest change (n,) of any observable for changes (n, N) of the unknowns."""
        ...

    def bent(self, dx: Array, segment: HermiteSegment, places: HermiteBasis) -> Array:
        """Largest distance (n,) of any observable, at unknowns changed by ``dx``, from the cubic through both ends."""
        ...


# Errors of cubics, over ``output_tolerance``.
_MAX_CUBIC_ERROR = 5.0
"""Error of a cubic that is not halved: its points are corrected, and points located along it are solved for."""
_NEGLIGIBLE_ERROR = 0.25
"""Distance of two cubics at their middle below which the error is not computed; beside the middle it may be larger."""
_CORRECTIONS = 3
"""Corrections of a point on a cubic; where these do not suffice it is solved for."""

# Lengths of segments.
_STEP_ALLOWANCE = 1.1
"""Spacing of points over ``output_step``: segments are a little longer than the steps taken along them."""
_SHORTEST = 1e-6
"""Scaled length of a segment that is not halved for the observables."""
_PEAK_LENGTH = 0.04
"""Scaled length of a segment, at least, by which solutions at a narrow peak are accepted."""
_END_SHARE = 0.02
"""Part of a segment next to its ends in which no peak is resolved."""


class _Corrected:
    """States (n, N + 1) at places of a segment, corrected once, and by ``settle`` to a tolerance.

    Attributes
    ----------
    unknowns_error, observables_error
        Relative errors of the cubics of both at each place (n,).
    cubic, slopes
        States on the cubic, and its derivatives by ``u``.
    states, last
        Corrected states, and the sizes (n,) of their last corrections.
    """

    def __init__(
        self,
        corrector: Corrector,
        observables: Observables,
        segment: HermiteSegment,
        ends: tuple[Step, Step],
        places: HermiteBasis,
    ) -> None:
        self._corrector, self._observables, self._ends = corrector, observables, ends
        self._sizes = corrector.metric.sizes(*(end.state for end in ends))
        self.cubic, self.slopes = segment.points(places), segment.derivatives(places)
        between, off = self._off(self.cubic)
        self.unknowns_error = corrector.metric.judged(off, self._sizes)
        self.observables_error = np.zeros(len(off))
        if observables.any:
            self.observables_error = _or_inf(between.bent(-finite(off)[:, :-1], segment, places))
        off = at_their_parameter(off, self.slopes)
        self.states, self.last = self.cubic - finite(off), self._size(between, off)

    def _off(self, states: Array) -> tuple[Between, Array]:
        """Evaluated states and their distances from the branch."""
        self._corrector.evaluations += len(states)
        between = self._observables.between(*self._ends, states)
        return between, self._corrector.off(between.residuals, self._ends[1])

    def _size(self, between: Between, off: Array) -> Array:
        """Relative sizes (n,) of corrections, the observables included."""
        sizes = self._corrector.metric.judged(off, self._sizes)
        if self._observables.any:
            sizes = np.maximum(sizes, _or_inf(between.changes(finite(off)[:, :-1])))
        return sizes

    def settle(self, count: int, tolerance: float) -> tuple[Array, BoolArray]:
        """The first states after further corrections, and whether each meets the tolerance."""
        for _ in range(_CORRECTIONS - 1):
            rest = np.flatnonzero((self.last[:count] > tolerance) & (self.last[:count] < np.inf))
            if not rest.size:
                break
            between, off = self._off(self.states[rest])
            off = at_their_parameter(off, self.slopes[rest])
            before, self.last[rest] = self.last[rest], self._size(between, off)
            self.states[rest] -= finite(off)
            self.last[rest[self.last[rest] > 0.5 * before]] = np.inf
        return self.states[:count], self.last[:count] <= tolerance


def at_their_parameter(off: Array, slopes: Array) -> Array:
    """Corrections (n, N + 1) at the parameter of each state, from those across the branch and its ``slopes``.

    Where the branch is steep a state close to it may be far from the solution at the state's own parameter.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        corrections = off - (off[:, -1] / slopes[:, -1])[:, None] * slopes
    corrections[:, -1] = 0.0
    return np.asarray(corrections)


def finite(off: Array) -> Array:
    """Corrections, zero where they are not finite."""
    return off if isfinite(off.sum()) else np.where(np.isfinite(off), off, 0.0)


def _or_inf(sizes: Array) -> Array:
    return np.where(np.isfinite(sizes), sizes, np.inf)


class DenseOutput:
    """Points so close to each other that a line through them looks smooth.

    Parameters
    ----------
    step
        Scaled arclength between two of them.
    tolerance
        Largest relative error of their unknowns and observables, by the last of a few corrections with the Jacobian of
        the next point. Where these do not suffice the point is solved for.
    observables
        Quantities computed from the states.

    Where the error of the cubic between two points is too large at one of these places, a corrected point is inserted:
    the corrections start from the cubic, and events are located along it.

    Attributes
    ----------
    lost
        Whether there is no solution between the last neighbours, or between halves of their segment, where one is
        expected: the branch may take another path there, as around two turning points.
    """

    def __init__(
        self, corrector: Corrector, span: Span, step: float, tolerance: float, observables: Observables | None
    ) -> None:
        self._corrector, self._span, self._step, self._tolerance = corrector, span, _STEP_ALLOWANCE * step, tolerance
        self._observables: Observables = _Unknowns(corrector) if observables is None else observables
        self._corrected: list[tuple[Step, Step, _Corrected]] = []
        self.lost = False

    def halves(self, first: Step, second: Step, apart: float) -> list[Step]:
        """Corrected points between two neighbours, both left out, so that the cubics are accurate enough.

        ``apart`` is the distance of the cubic from another one at the middle, see ``cubic_distance``.
        """
        self._corrected.clear()
        self.lost = False
        return self._halves(first, second, apart, finely=False)

    def _halves(self, first: Step, second: Step, apart: float, *, finely: bool) -> list[Step]:
        """``finely``: also where no point of the result is between."""
        segment, second.apart = self._corrector.segment(first, second), apart
        second.smooth = apart <= _NEGLIGIBLE_ERROR * self._tolerance
        if second.smooth and not self._observables.any:
            return []
        places = self._places(first, second, segment, finely)
        if places is None:
            return []
        corrected = _Corrected(self._corrector, self._observables, segment, (first, second), places)
        limit = _MAX_CUBIC_ERROR * self._tolerance
        error = np.maximum(corrected.unknowns_error, corrected.observables_error)
        second.smooth = bool(error.max() <= limit)
        if second.smooth or segment.length <= (_SHORTEST if corrected.observables_error.max() > limit else self._step):
            self._corrected.append((first, second, corrected))  # the points of the segment start from these states
            return []
        worst = int(np.argmax(error))
        at, guess, direction = (
            float(places.u[worst]),
            corrected.cubic[worst],
            segment.derivative(float(places.u[worst])),
        )
        start = (
            corrected.states[worst] if self._corrector.near(corrected.states[worst] - guess, segment.length) else guess
        )
        middle = self._solved(segment, at, start, (first, second))
        if middle is None:
            self.lost |= segment.length > self._step
            return []
        middle.arclength = first.arclength + self._corrector.metric.length(middle.state - first.state)
        before, after = (
            cubic_distance(self._corrector.metric, (middle.state, middle.tangent), (guess, direction), way)
            for way in (at * segment.length, (at - 1.0) * segment.length)
        )
        finely = finely or bool(corrected.observables_error.max() > limit)
        return [
            *self._halves(first, middle, before, finely=finely),
            middle,
            *self._halves(middle, second, after, finely=finely),
        ]

    def _places(self, first: Step, second: Step, segment: HermiteSegment, finely: bool) -> HermiteBasis | None:
        """Places of the points to come, then those of narrow peaks; None where there are none."""
        count = ceil(segment.length / self._step)
        if not self._observables.any:
            return _evenly(count) if count > 1 else None
        low, high = sorted((first.parameter, second.parameter))
        width = high - low
        narrow = self._observables.narrow(low - width, high + width)
        if count < 2 and not (finely or narrow.size):
            return None
        even = _evenly(max(2, count))
        inside = [segment.where(p, 0.0, 1.0) for p in narrow.tolist() if low < p < high]
        inside = [u for u in inside if _END_SHARE < u < 1.0 - _END_SHARE]
        return HermiteBasis(np.append(even.u, inside)) if inside else even

    def _corrected_states(self, first: Step, second: Step, segment: HermiteSegment, places: HermiteBasis) -> _Corrected:
        """The states of ``halves``, corrected again where a located point was inserted since."""
        for before, after, corrected in self._corrected:
            if before is first and after is second:
                return corrected
        return _Corrected(self._corrector, self._observables, segment, (first, second), places)

    def _solved(self, segment: HermiteSegment, u: float, guess: Array, ends: tuple[Step, Step]) -> Step | None:
        """The solution on the plane across the segment through ``guess``, None where it is not that of the branch.

        At a narrow peak the plane would cut its sides. The solution at that parameter is then found from the chord, at
        a distance that may be larger than the segment.
        """
        corrector, (first, second) = self._corrector, ends
        step, _ = corrector.correct(guess.copy(), segment.derivative(u), "regular")
        if not self._is_expected(step, first, segment.point(u), segment.length):
            chord, parameter = (1.0 - u) * first.state + u * second.state, segment.parameter(u)
            if (parameter - first.parameter) * (parameter - second.parameter) < 0.0:
                chord[-1] = parameter
            change = second.state - first.state
            step, _ = corrector.correct(chord.copy(), None, "regular", forward=change, options=corrector.patient)
            if not self._is_expected(step, first, chord, max(segment.length, _PEAK_LENGTH)):
                return None
        return step

    def _is_expected(self, step: Step | None, first: Step, expected: Array, length: float) -> bool:
        if step is None or step.orientation * first.orientation < 0:
            return False
        return self._corrector.near(step.state - expected, length) and not self._span.outside(step.parameter)

    def points(self, first: Step, second: Step, end: Step) -> list[Step]:
        """Points between two neighbours on a segment that ends at ``end``."""
        segment, metric = self._corrector.segment(first, second), self._corrector.metric
        count = ceil(segment.length / self._step)
        if count < 2 or not end.smooth:
            return []
        places = _evenly(count)
        if end.apart <= _NEGLIGIBLE_ERROR * self._tolerance and not self._observables.any:
            states, good, slopes = segment.points(places), np.ones(count - 1, dtype=bool), segment.derivatives(places)
        else:
            corrected = self._corrected_states(first, second, segment, places)
            states, good = corrected.settle(count - 1, self._tolerance)
            slopes = corrected.slopes[: count - 1]
        rates, chords = metric.length(np.array((slopes, states - first.state)))
        tangents, arclengths = slopes / rates[:, None], (first.arclength + chords).tolist()
        made = []
        for i, at in enumerate(places.u.tolist()):
            if good[i]:
                step = Step.interpolated(states[i], tangents[i], (first, second, segment, at), arclengths[i])
            else:
                solved = self._solved(segment, at, segment.point(at), (first, second))
                if solved is None:
                    continue
                step = solved
                step.arclength = first.arclength + metric.length(step.state - first.state)
            if not self._span.outside(step.parameter):
                made.append(step)
        return made


class _Unknowns:
    """No observables; states are evaluated one by one."""

    any = False

    def __init__(self, corrector: Corrector) -> None:
        self._corrector = corrector

    def narrow(self, low: float, high: float) -> Array:
        """None."""
        return np.empty(0)

    def between(self, first: Step, second: Step, states: Array) -> Between:
        """Residuals alone."""
        return _Residuals(self._corrector.residuals(states))


class _Residuals(Between):
    def __init__(self, residuals: Array) -> None:
        self.residuals = residuals

    def changes(self, dx: Array) -> Array:
        """None."""
        return np.zeros(len(dx))

    def bent(self, dx: Array, segment: HermiteSegment, places: HermiteBasis) -> Array:
        """None."""
        return np.zeros(len(dx))


@lru_cache(maxsize=64)
def _evenly(count: int) -> HermiteBasis:
    """Places that divide a segment into ``count`` equal parts."""
    return HermiteBasis(np.arange(1, count) / count)
