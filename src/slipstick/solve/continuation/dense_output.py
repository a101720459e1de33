"""The branch between corrected points: from the cubic through them, corrected; halved where that is not good enough."""

from __future__ import annotations

from functools import lru_cache
from math import ceil, isfinite
from typing import Protocol

import numpy as np

from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.hermite_segment import HermiteBasis, HermiteSegment
from slipstick.solve.continuation.predictor import Span
from slipstick.solve.continuation.step import Step
from slipstick.solve.continuation.step_acceptance import cubic_distance
from slipstick.typing import Array, BoolArray


class Observables(Protocol):
    """Knows how states are read, and evaluates many of them in one go."""

    @property
    def any(self) -> bool:
        """Whether anything is read off that is no unknown."""
        ...

    def narrow(self, low: float, high: float) -> Array:
        """Values (n,) of the parameter in between, ascending, near which a reading may have a narrow peak."""
        ...

    def between(self, first: Step, second: Step, states: Array) -> Between:
        """States (n, N + 1) between two solutions, evaluated."""
        ...


class Between(Protocol):
    """Evaluated states between two solutions; all sizes are relative to those of each reading nearby."""

    residuals: Array
    """(n, N)."""

    def changes(self, dx: Array) -> Array:
        """Largest change (n,) of any reading for changes (n, N) of the unknowns."""
        ...

    def bent(self, dx: Array, segment: HermiteSegment, places: HermiteBasis) -> Array:
        """Largest distance (n,) of any reading, at unknowns changed by ``dx``, from the cubic through both ends."""
        ...


_LONGER = 1.1
"""Segments are a little longer than the steps that were taken along them."""
_BENT = 5.0
"""Tolerances by which the cubics may be off where points are corrected: what is sought along them is solved for."""
_SURE = 0.25
"""Tolerances by which a cubic may differ from another in the middle where no place is looked at: at a kink beside the
middle it is further off."""
_CORRECTIONS = 3
_FINEST = 1e-6
"""Scaled length of a segment that is not halved for what is read off it."""
_PEAK = 0.04
"""Scaled length of a segment near to which solutions are believed that stand out of shorter ones."""
_END = 0.02
"""Share of a segment next to its ends in which nothing is looked for."""


class _Seen:
    """States (n, N + 1) at places of a segment, corrected once and then, by ``settle``, to a tolerance.

    Attributes
    ----------
    unknowns_bent, observables_bent
        How far the cubics of both are off at each place (n,), over their own sizes.
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
        self.unknowns_bent = corrector.metric.judged(off, self._sizes)
        self.observables_bent = np.zeros(len(off))
        if observables.any:
            self.observables_bent = _or_inf(between.bent(-finite(off)[:, :-1], segment, places))
        off = at_their_parameter(off, self.slopes)
        self.states, self.last = self.cubic - finite(off), self._size(between, off)

    def _off(self, states: Array) -> tuple[Between, Array]:
        """States evaluated, and how far they are off the branch."""
        self._corrector.evaluations += len(states)
        between = self._observables.between(*self._ends, states)
        return between, self._corrector.off(between.residuals, self._ends[1])

    def _size(self, between: Between, off: Array) -> Array:
        """Sizes (n,) of corrections, of what is read off the states too."""
        sizes = self._corrector.metric.judged(off, self._sizes)
        if self._observables.any:
            sizes = np.maximum(sizes, _or_inf(between.changes(finite(off)[:, :-1])))
        return sizes

    def settle(self, count: int, tolerance: float) -> tuple[Array, BoolArray]:
        """The first states, and which of them are known to the tolerance after further corrections."""
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
    """Corrections (n, N + 1) across the branch, with the way along it that leads back to the parameter of each state.

    Where the branch is steep a state near to it may be far from the solution at its own parameter.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        corrections = off - (off[:, -1] / slopes[:, -1])[:, None] * slopes
    corrections[:, -1] = 0.0
    return np.asarray(corrections)


def finite(off: Array) -> Array:
    """Corrections, none where they are not known."""
    return off if isfinite(off.sum()) else np.where(np.isfinite(off), off, 0.0)


def _or_inf(sizes: Array) -> Array:
    return np.where(np.isfinite(sizes), sizes, np.inf)


class DenseOutput:
    """Points so near to each other that a line through them looks smooth.

    Parameters
    ----------
    step
        Scaled arclength between two of them.
    tolerance
        Largest error of what is stored of them over its own size: the last of a few corrections by the Jacobian of the
        next point, at every place. Where these do not get there the place is solved for.
    observables
        What is read off the states besides.

    Where the cubics between two points, from which the corrections start and along which events are sought, are too far
    off at one of these places, a point comes between.

    Attributes
    ----------
    lost
        Whether the last neighbours asked for, or a half of what is between them, have no solution between them where
        one is expected: the branch may go another way there, as round two turning points.
    """

    def __init__(
        self, corrector: Corrector, span: Span, step: float, tolerance: float, observables: Observables | None
    ) -> None:
        self._corrector, self._span, self._step, self._tolerance = corrector, span, _LONGER * step, tolerance
        self._observables: Observables = _Unknowns(corrector) if observables is None else observables
        self._looked_at: list[tuple[Step, Step, _Seen]] = []
        self.lost = False

    def halves(self, first: Step, second: Step, apart: float) -> list[Step]:
        """Corrected points between two neighbours, so that the cubics are near enough; both ends left out.

        ``apart`` is the distance of the cubic from another one in the middle, see ``cubic_distance``.
        """
        self._looked_at.clear()
        self.lost = False
        return self._halves(first, second, apart, closely=False)

    def _halves(self, first: Step, second: Step, apart: float, *, closely: bool) -> list[Step]:
        """``closely``: also where no point of the result comes between."""
        segment, second.apart = self._corrector.segment(first, second), apart
        second.smooth = apart <= _SURE * self._tolerance
        if second.smooth and not self._observables.any:
            return []
        places = self._places(first, second, segment, closely)
        if places is None:
            return []
        seen = _Seen(self._corrector, self._observables, segment, (first, second), places)
        limit = _BENT * self._tolerance
        bent = np.maximum(seen.unknowns_bent, seen.observables_bent)
        second.smooth = bool(bent.max() <= limit)
        if second.smooth or segment.length <= (_FINEST if seen.observables_bent.max() > limit else self._step):
            self._looked_at.append((first, second, seen))  # what is recorded of the segment starts from it
            return []
        worst = int(np.argmax(bent))
        at, guess, direction = float(places.u[worst]), seen.cubic[worst], segment.derivative(float(places.u[worst]))
        near = seen.states[worst] if self._corrector.near(seen.states[worst] - guess, segment.length) else guess
        middle = self._solved(segment, at, near, (first, second))
        if middle is None:
            self.lost |= segment.length > self._step
            return []
        middle.arclength = first.arclength + self._corrector.metric.length(middle.state - first.state)
        before, after = (
            cubic_distance(self._corrector.metric, (middle.state, middle.tangent), (guess, direction), way)
            for way in (at * segment.length, (at - 1.0) * segment.length)
        )
        closely = closely or bool(seen.observables_bent.max() > limit)
        return [
            *self._halves(first, middle, before, closely=closely),
            middle,
            *self._halves(middle, second, after, closely=closely),
        ]

    def _places(self, first: Step, second: Step, segment: HermiteSegment, closely: bool) -> HermiteBasis | None:
        """Places to look at: those of the points to come, and then those of narrow peaks; None where there are none."""
        count = ceil(segment.length / self._step)
        if not self._observables.any:
            return _evenly(count) if count > 1 else None
        low, high = sorted((first.parameter, second.parameter))
        width = high - low
        narrow = self._observables.narrow(low - width, high + width)
        if count < 2 and not (closely or narrow.size):
            return None
        even = _evenly(max(2, count))
        inside = [segment.where(p, 0.0, 1.0) for p in narrow.tolist() if low < p < high]
        inside = [u for u in inside if _END < u < 1.0 - _END]
        return HermiteBasis(np.append(even.u, inside)) if inside else even

    def _seen(self, first: Step, second: Step, segment: HermiteSegment, places: HermiteBasis) -> _Seen:
        """Those that were looked at on the way here; anew where a located point came between since."""
        for before, after, seen in self._looked_at:
            if before is first and after is second:
                return seen
        return _Seen(self._corrector, self._observables, segment, (first, second), places)

    def _solved(self, segment: HermiteSegment, u: float, guess: Array, ends: tuple[Step, Step]) -> Step | None:
        """The solution on the plane across the segment through ``guess``, if it is the one that is expected.

        At a narrow peak, whose sides the plane would cut, it is the one at that parameter, sought from the chord: it
        may be further off than short segments are long.
        """
        corrector, (first, second) = self._corrector, ends
        step, _ = corrector.correct(guess.copy(), segment.derivative(u), "regular")
        if not self._believed(step, first, segment.point(u), segment.length):
            chord, parameter = (1.0 - u) * first.state + u * second.state, segment.parameter(u)
            if (parameter - first.parameter) * (parameter - second.parameter) < 0.0:
                chord[-1] = parameter
            way = second.state - first.state
            step, _ = corrector.correct(chord.copy(), None, "regular", forward=way, options=corrector.patient)
            if not self._believed(step, first, chord, max(segment.length, _PEAK)):
                return None
        return step

    def _believed(self, step: Step | None, first: Step, expected: Array, length: float) -> bool:
        if step is None or step.orientation * first.orientation < 0:
            return False
        return self._corrector.near(step.state - expected, length) and not self._span.outside(step.parameter)

    def points(self, first: Step, second: Step, end: Step) -> list[Step]:
        """Points between two neighbours on the segment that leads to ``end``."""
        segment, metric = self._corrector.segment(first, second), self._corrector.metric
        count = ceil(segment.length / self._step)
        if count < 2 or not end.smooth:
            return []
        places = _evenly(count)
        if end.apart <= _SURE * self._tolerance and not self._observables.any:
            states, good, slopes = segment.points(places), np.ones(count - 1, dtype=bool), segment.derivatives(places)
        else:
            seen = self._seen(first, second, segment, places)
            states, good = seen.settle(count - 1, self._tolerance)
            slopes = seen.slopes[: count - 1]
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
    """No observables: states are evaluated one by one."""

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
    """Places that part a segment into ``count`` pieces."""
    return HermiteBasis(np.arange(1, count) / count)
