"""Points between those of many branches: ``dense_output.py`` for all their segments at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipstick.solve.continuation.corrector import is_near
from slipstick.solve.continuation.dense_output import (
    _CORRECTIONS,
    _MAX_CUBIC_ERROR,
    _NEGLIGIBLE_ERROR,
    _PEAK_LENGTH,
    _STEP_ALLOWANCE,
    at_their_parameter,
    finite,
)  # fmt: skip
from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.lockstep import Correctors, Numbers, Points, Systems, Table
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.continuation.step_control import ContinuationOptions, Span, cubic_distance
from slipstick.typing import Array, BoolArray

_CHUNK = 4096
"""States that are evaluated together: bounds the memory."""


def parted(pieces: NDArray[np.int_]) -> tuple[Numbers, Array]:
    """Numbers of segments and places (k,) on them that divide each segment into a number of equal ``pieces``."""
    inside = pieces - 1
    each = np.repeat(np.arange(pieces.size), inside)
    return each, (np.arange(each.size) - np.repeat(np.cumsum(inside) - inside, inside) + 1) / pieces[each]


@dataclass(kw_only=True)
class Segments(Table):
    """Pairs of neighbouring points, branch after branch, each in order.

    Attributes
    ----------
    first, second
        Numbers of the points.
    owner
        Number of the point stepped from, whose metric applies.
    low, high
        Ends of the part of that step that each is, from 0 to 1.
    apart, smooth
        As of the ``Step`` at the end of each.
    """

    first: Numbers
    second: Numbers
    owner: Numbers
    low: Array
    high: Array
    apart: Array
    smooth: BoolArray


@dataclass(kw_only=True)
class Interpolated(Table):
    """Points of segments: numbers of the segments, places ``u``, states and tangents (k, N + 1).

    ``node`` is the number of a point that was solved for because corrections did not suffice; else -1.
    """

    segment: Numbers
    u: Array
    states: Array
    tangents: Array
    node: Numbers


@dataclass(kw_only=True)
class _Corrected(Table):
    """States at places of segments, corrected once: ``dense_output._Corrected``."""

    segment: Numbers
    u: Array
    cubic: Array
    slopes: Array
    error: Array
    states: Array
    last: Array


class Outputs:
    """Points so close to each other that a line through them looks smooth, of many branches.

    Attributes
    ----------
    nodes
        All points that were solved for so far.
    segments
        The segments between them.
    lost
        Whether branches (n,) have no solution between two points, see ``DenseOutput.lost``.
    """

    def __init__(
        self, systems: Systems, correctors: Correctors, points: Points, span: tuple[float, float],
        options: ContinuationOptions,
    ) -> None:  # fmt: skip
        self._systems, self._correctors, self.nodes, self._span = systems, correctors, points, Span(*span)
        self._step, self._tolerance = _STEP_ALLOWANCE * options.output_step, options.output_tolerance
        self._corrected: dict[str, _Corrected] = {}
        self.lost = np.zeros(correctors.evaluations.size, dtype=bool)
        self.segments = self._halved()

    def cubics(self, segments: Segments) -> tuple[Metric, HermiteSegment]:
        """Metrics and cubics of segments."""
        nodes, metric = self.nodes, self.nodes.metric.at(segments.owner)
        ends = [(nodes.states[i], nodes.tangents[i]) for i in (segments.first, segments.second)]
        return metric, HermiteSegment.of(metric, ends[0], ends[1])

    def _halved(self) -> Segments:
        """``DenseOutput.halves`` of every step."""
        branch = self.nodes.branch
        first = np.flatnonzero(branch[:-1] == branch[1:])
        nothing = np.zeros(first.size)
        todo = Segments(
            first=first, second=first + 1, owner=first, low=nothing, high=nothing + 1.0,
            apart=self.nodes.apart[first + 1], smooth=nothing > 0.0,
        )  # fmt: skip
        ended, parts, count = [todo.at(first[:0])], [], 0
        while todo.first.size:
            metric, cubics = self.cubics(todo)
            todo.smooth = todo.apart <= _NEGLIGIBLE_ERROR * self._tolerance
            pieces = np.ceil(cubics.length / self._step).astype(int)
            coarse = np.flatnonzero(~todo.smooth & (pieces > 1))
            open_ = np.zeros(todo.first.size, dtype=bool)
            middles = Points.joined([self.nodes.at(first[:0])])
            if coarse.size:
                corrected = self._correct(todo, coarse, pieces[coarse], metric, cubics)
                error = np.zeros(todo.first.size)
                np.maximum.at(error, corrected.segment, corrected.error)
                todo.smooth[coarse] = error[coarse] <= _MAX_CUBIC_ERROR * self._tolerance
                wanted = coarse[~todo.smooth[coarse] & (cubics.length[coarse] > self._step)]
                if wanted.size:
                    of = np.flatnonzero(np.isin(corrected.segment, wanted))
                    of = of[np.lexsort((of, -corrected.error[of], corrected.segment[of]))]
                    worst = corrected.at(of[np.unique(corrected.segment[of], return_index=True)[1]])
                    halves, middles, found = self._middles(todo.at(wanted), worst, metric.at(wanted), cubics.at(wanted))
                    open_[wanted[found]] = True
                    self.lost[self.nodes.branch[todo.first[wanted[~found]]]] = True
            over = np.flatnonzero(~open_)
            if coarse.size:
                kept = corrected.at(~open_[corrected.segment])
                number = np.cumsum(~open_) - 1 + count
                kept.segment = number[kept.segment]
                parts.append(kept)
            ended.append(todo.at(over))
            count += over.size
            if not open_.any():
                break
            self.nodes = Points.joined([self.nodes, middles])
            todo = halves
        segments = Segments.joined(ended)
        order = np.lexsort((segments.low, segments.owner))
        place = np.empty(order.size, dtype=int)
        place[order] = np.arange(order.size)
        if parts:
            corrected = _Corrected.joined(parts)
            corrected.segment = place[corrected.segment]
            self._corrected["halved"] = corrected
        return segments.at(order)

    def _correct(
        self, segments: Segments, which: Numbers, pieces: NDArray[np.int_], metric: Metric, cubics: HermiteSegment
    ) -> _Corrected:
        """Corrected states at the places that divide some segments into pieces."""
        number, u = parted(pieces)
        each = which[number]
        here, of = metric.at(each), cubics.at(each)
        cubic, slopes = of.point(u), of.derivative(u)
        sizes = self._sizes(segments, metric)[each]
        off = self._off(segments.second[each], cubic)
        error = here.judged(off, sizes)
        off = at_their_parameter(off, slopes)
        states, last = cubic - finite(off), here.judged(off, sizes)
        return _Corrected(segment=each, u=u, cubic=cubic, slopes=slopes, error=error, states=states, last=last)

    def _sizes(self, segments: Segments, metric: Metric) -> Array:
        return metric.sizes(self.nodes.states[segments.first], self.nodes.states[segments.second])

    def _off(self, near: Numbers, states: Array) -> Array:
        """``Corrector.off`` of states (k, N + 1), by the Jacobians of points nearby."""
        off, branch = np.empty_like(states), self.nodes.branch[near]
        for begin in range(0, len(states), _CHUNK):
            part = slice(begin, begin + _CHUNK)
            residual = self._systems.evaluate(branch[part], states[part])[0]
            off[part] = self._correctors.factors.solve(self.nodes.factors[near[part]], residual)
        work = np.bincount(branch, minlength=self._correctors.evaluations.size)
        self._correctors.evaluations += work
        self._correctors.solves += work
        return np.where(np.isfinite(off), off, np.inf)

    def _middles(
        self, segments: Segments, worst: _Corrected, metric: Metric, cubics: HermiteSegment
    ) -> tuple[Segments, Points, BoolArray]:
        """Both parts of segments divided where the error is largest, the points there, and whether each was found."""
        u, guess, direction = worst.u, worst.cubic, cubics.derivative(worst.u)
        near = is_near(metric, worst.states - guess, cubics.length)
        start = np.where(near[:, None], worst.states, guess)
        middles, found = self._solved(segments, metric, cubics, u, start)
        at, number = np.flatnonzero(found), len(self.nodes.branch) + np.arange(int(found.sum()))
        middles, measured, parts = middles.at(at), metric.at(at), segments.at(at)
        states, tangents = middles.states, middles.tangents

        def apart(way: Array) -> Array:
            return cubic_distance(measured, (states, tangents), (guess[at], direction[at]), way)

        length = cubics.length[at]
        middle = 0.5 * (parts.low + parts.high)
        before = Segments(
            first=parts.first, second=number, owner=parts.owner, low=parts.low, high=middle,
            apart=apart(u[at] * length), smooth=parts.smooth,
        )  # fmt: skip
        after = Segments(
            first=number, second=parts.second, owner=parts.owner, low=middle, high=parts.high,
            apart=apart((u[at] - 1.0) * length), smooth=parts.smooth.copy(),
        )  # fmt: skip
        return Segments.joined([before, after]), middles, found

    def _solved(
        self, segments: Segments, metric: Metric, cubics: HermiteSegment, u: Array, guess: Array
    ) -> tuple[Points, BoolArray]:
        """``DenseOutput._solved`` on each segment: points, and whether each is that of the branch."""
        nodes, branch = self.nodes, self.nodes.branch[segments.first]
        across = np.zeros(u.size, dtype=bool)
        solved = self._correctors.correct(branch, guess, cubics.derivative(u), across, metric, forward=guess)
        expected = cubics.point(u)
        good = solved.found & self._is_expected(
            segments, metric, solved.states, solved.orientation, expected, cubics.length
        )
        rest = np.flatnonzero(~good)
        if rest.size:
            first, second = nodes.states[segments.first[rest]], nodes.states[segments.second[rest]]
            chord = (1.0 - u[rest])[:, None] * first + u[rest][:, None] * second
            value = expected[rest, -1]
            inside = (value - first[:, -1]) * (value - second[:, -1]) < 0.0
            chord[inside, -1] = value[inside]
            here, way = metric.at(rest), second - first
            again = self._correctors.correct(
                branch[rest], chord, way, np.ones(rest.size, dtype=bool), here, forward=way,
                options=self._correctors.patient,
            )  # fmt: skip
            length = np.maximum(cubics.length[rest], _PEAK_LENGTH)
            near = self._is_expected(segments.at(rest), here, again.states, again.orientation, chord, length)
            good[rest] = again.found & near
            solved.put(rest, again)
        arclength = nodes.arclength[segments.first] + metric.length(solved.states - nodes.states[segments.first])
        return Points(
            **solved.columns(slice(None)), branch=branch, factors=self._correctors.factors.add(solved.factors),
            arclength=arclength, apart=np.full(u.size, np.inf), metric=metric,
        ), good  # fmt: skip

    def _is_expected(
        self, segments: Segments, metric: Metric, states: Array, orientation: NDArray[np.int_], expected: Array,
        length: Array,
    ) -> BoolArray:  # fmt: skip
        """``DenseOutput._is_expected``."""
        same_way = orientation * self.nodes.orientation[segments.first] >= 0
        with np.errstate(invalid="ignore"):
            near = is_near(metric, states - expected, length)
        return np.asarray(same_way & near & ~self._span.outside(states[:, -1]))

    def points(self, pieces: Segments, whole: Numbers) -> Interpolated:
        """``DenseOutput.points`` of pieces of segments: pairs of points with the attributes of their segments.

        ``whole`` is the number of the segment where a piece is all of it, else -1: its corrected states are reused.
        """
        metric, cubics = self.cubics(pieces)
        count = np.ceil(cubics.length / self._step).astype(int)
        wanted = (count > 1) & pieces.smooth
        plain = np.flatnonzero(wanted & (pieces.apart <= _NEGLIGIBLE_ERROR * self._tolerance))
        known = np.zeros(pieces.first.size, dtype=bool)
        parts, corrected = [], self._corrected.get("halved")
        if corrected is not None:
            piece = np.full(len(self.segments.first), -1)
            piece[whole[whole >= 0]] = np.flatnonzero(whole >= 0)
            of = piece[corrected.segment]
            keep = (of >= 0) & wanted[of] & (pieces.apart[of] > _NEGLIGIBLE_ERROR * self._tolerance)
            part = corrected.at(keep)
            part.segment = of[keep]
            known[part.segment] = True
            parts.append(part)
        fresh = np.flatnonzero(wanted & ~known & (pieces.apart > _NEGLIGIBLE_ERROR * self._tolerance))
        if fresh.size:
            parts.append(self._correct(pieces, fresh, count[fresh], metric, cubics))
        number, u = parted(count[plain])
        each = plain[number]
        smooth = cubics.at(each)
        found = [Interpolated(
            segment=each, u=u, states=smooth.point(u), tangents=self._unit(metric.at(each), smooth.derivative(u)),
            node=np.full(u.size, -1),
        )]  # fmt: skip
        if parts:
            found.append(self._settled(pieces, _Corrected.joined(parts), metric, cubics))
        return Interpolated.joined(found)

    def _settled(self, pieces: Segments, corrected: _Corrected, metric: Metric, cubics: HermiteSegment) -> Interpolated:
        """States corrected to the tolerance, or solved for where corrections do not suffice."""
        sizes, tolerance = self._sizes(pieces, metric), self._tolerance
        for _ in range(_CORRECTIONS - 1):
            rest = np.flatnonzero((corrected.last > tolerance) & (corrected.last < np.inf))
            if not rest.size:
                break
            of = corrected.segment[rest]
            off = self._off(pieces.second[of], corrected.states[rest])
            off = at_their_parameter(off, corrected.slopes[rest])
            before = corrected.last[rest]
            last = metric.at(of).judged(off, sizes[of])
            corrected.states[rest] -= finite(off)
            corrected.last[rest] = np.where(last > 0.5 * before, np.inf, last)
        tangents, node = self._unit(metric.at(corrected.segment), corrected.slopes), np.full(corrected.u.size, -1)
        rest = np.flatnonzero(~(corrected.last <= tolerance))
        keep = np.ones(corrected.u.size, dtype=bool)
        if rest.size:
            of = corrected.segment[rest]
            here, guess = cubics.at(of), cubics.at(of).point(corrected.u[rest])
            solved, good = self._solved(pieces.at(of), metric.at(of), here, corrected.u[rest], guess)
            keep[rest] = good
            node[rest[good]] = len(self.nodes.branch) + np.arange(int(good.sum()))
            corrected.states[rest], tangents[rest] = solved.states, solved.tangents
            self.nodes = Points.joined([self.nodes, solved.at(good)])
        keep &= ~self._span.outside(corrected.states[:, -1])
        return Interpolated(
            segment=corrected.segment[keep], u=corrected.u[keep], states=corrected.states[keep],
            tangents=tangents[keep], node=node[keep],
        )  # fmt: skip

    def _unit(self, metric: Metric, slopes: Array) -> Array:
        return np.asarray(slopes / metric.length(slopes)[:, None])
