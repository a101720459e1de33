"""Peaks and turning points of curves that are followed side by side.

Where they may be is seen for all segments at once, as ``Locator`` sees it of each. A peak is located for all curves
together, by secants or, near to a corner, between solutions on both sides; several in one segment, turning points, and
what nearly is one, curve by curve, by a ``Locator``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from slipstick.analysis.curve.follow import CurveRequest
from slipstick.analysis.peaks.events import AMPLITUDE_NOISE, PLATEAU, SLOPE_NOISE, kept_up, peak_events
from slipstick.results.measures import amplitude_with_slope
from slipstick.results.postprocessing import Postprocessing
from slipstick.results.record import Outputs
from slipstick.solve.continuation import ArclengthScaling, Step
from slipstick.solve.continuation.brackets import (
    DIP,
    PARTINGS,
    SECANTS,
    TINY,
    fall,
    is_bottom,
    leads_on,
)  # fmt: skip
from slipstick.solve.continuation.corrector import Corrector, is_near
from slipstick.solve.continuation.events import turning_points
from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.locate import _EXCEEDS, _NEARLY, _PLACES, BOTTOM_SECANTS, Locator, Minimum, shown
from slipstick.solve.continuation.lockstep import Correctors, Numbers, Points, Solved
from slipstick.solve.continuation.lockstep_brackets import Brackets, Ends, Observed
from slipstick.solve.continuation.lockstep_output import Outputs as DenseOutputs
from slipstick.solve.continuation.metric import Measure, Metric
from slipstick.solve.newton import NewtonResult
from slipstick.typing import Array, BoolArray


@dataclass(kw_only=True)
class Located:
    """Points that were located, by the number of their segment, in order: numbers of nodes."""

    nodes: dict[int, list[int]]
    kinds: dict[int, tuple[str, str]]
    """Kind and name by node."""

    def drop(self, alone: BoolArray) -> None:
        """Those on segments that are to be looked at ``alone``."""
        for s in [s for s in self.nodes if alone[s]]:
            for node in self.nodes.pop(s):
                del self.kinds[node]


class Events:
    """Peaks and turning points on the segments of curves that are ``alike``.

    Attributes
    ----------
    postprocessing
        What could not be had where one curve was looked at alone, by its number.
    """

    def __init__(
        self, requests: Sequence[CurveRequest], scalings: Sequence[ArclengthScaling], correctors: Correctors,
        dense: DenseOutputs,
    ) -> None:  # fmt: skip
        self._requests, self._scalings, self._correctors, self._dense = requests, scalings, correctors, dense
        self._first, self._segments = requests[0], dense.segments
        self._metric, self._cubics = dense.cubics(dense.segments)
        outputs = Outputs(self._first.balance, self._first.peaks_of)
        self._names = outputs.names
        ports = [port for port in outputs._ports if port is not None]
        self._ports, self._cosines = [port for port, _ in ports], np.array([cosine for _, cosine in ports])
        self._exact = replace(correctors.patient, tolerance=min(1e-14, self._first.options.newton.tolerance))
        self.postprocessing: dict[int, Postprocessing] = {}

    def located(self) -> Located:
        """Those of every curve."""
        segments, nodes, cubics = self._segments, self._dense.nodes, self._cubics
        branch = nodes.branch[segments.first]
        begins = np.append(True, branch[1:] != branch[:-1])
        before, alone = list[Array](), np.zeros(branch.size, dtype=bool)
        if self._first.options.locate_turning_points:
            rates = (_PLACES.slopes @ cubics.nodes[:, :, -1:])[..., 0] / cubics.length[:, None]
            known = np.append(nodes.tangents[segments.first[:1], -1], rates[:-1, -1])
            known[begins] = nodes.tangents[segments.first[begins], -1]
            rates[:, 0] = known
            a, b = rates[:, :-1], rates[:, 1:]
            alone |= (((a < 0.0) & (b >= 0.0)) | ((a > 0.0) & (b <= 0.0))).any(axis=1) | _near_miss(rates)
            before.append(known)
        found = Located(nodes={}, kinds={})
        if self._names:
            slopes, heights = self._slopes(begins)
            values = np.stack([_carried(part, begins) for part in np.moveaxis(slopes, 2, 0)], axis=2)
            times = ((values[:, :-1] > 0.0) & (values[:, 1:] <= 0.0)).sum(axis=1)
            missed = _near_miss(np.concatenate((values[:, :1], slopes[:, 1:]), axis=1))
            alone |= segments.smooth & (missed | (times > 1)).any(axis=1)
            self._together(values, heights, segments.smooth[:, None] & (times == 1), alone, found)
            for i in range(len(self._names)):
                self._minima(i, values[:, :, i], heights[:, :, i], found, alone)
            found.drop(alone)
            before.extend(values[:, 0].T)
        self._each(np.flatnonzero(alone), np.array(before), found)
        return found

    def _together(self, values: Array, heights: Array, once: BoolArray, alone: BoolArray, found: Located) -> None:
        """Peaks by output: on segments where one is seen ``once``, (n, n_outputs), and on those that are not near the
        branch, with slopes (n, 9, n_outputs) along them and heights (n, 2, n_outputs) at their ends. What is not found
        so is to be located ``alone``."""
        branch, known = self._dense.nodes.branch[self._segments.first], self._correctors.doubtful.copy()
        whole = self._brackets(np.arange(branch.size), values[:, [0, -1]], heights)
        hidden = ~self._segments.smooth[:, None] & (~whole.plain() | whole.falls)
        which = np.flatnonzero(hidden.any(axis=1) & ~alone)
        brackets = list(enumerate(self._parted(whole.at(which), hidden[which])))
        sought = once.sum(axis=1)
        for _, parts in brackets:
            np.add.at(sought, parts.segment, 1)
        alone |= sought > 1
        for i in range(len(self._names)):
            which = np.flatnonzero(once[:, i] & ~alone)
            which = which[~self._by_secants(i, which, values[which, :, i], found)]
            beside = self._beside(i, which, values[which, :, i])
            alone[np.setdiff1d(which, beside.segment)] = True
            brackets.append((i, beside))
        for i, some in brackets:
            self._narrowed(i, some.at(~alone[some.segment]), found)
        self._with_dips(found, values[:, [0, -1]], alone)
        doubted = self._correctors.doubtful & ~known
        self._correctors.doubtful[:] = known
        alone |= doubted[branch] & (once | hidden).any(axis=1)
        found.drop(alone)

    def _minima(self, i: int, values: Array, heights: Array, found: Located, alone: BoolArray) -> None:
        """Points at minima where ``Locator`` puts them, by slopes (n, 9) and heights (n, 2); those on segments where
        more is to be located are left to be found ``alone``."""
        smooth, lengths = self._segments.smooth, self._cubics.length
        which, minima = list[int](), list[Minimum]()
        falls, rises = values[:, 0] < 0.0, values[:, -1] >= 0.0
        flat = np.minimum(np.abs(values[:, 0]), np.abs(values[:, -1])) * lengths <= DIP * heights[:, 1]
        alone |= ~smooth & falls & rises & ~flat
        for s in found.nodes:
            if not smooth[s] and found.kinds[found.nodes[s][0]][1] == self._names[i]:
                alone[s] |= falls[s] | rises[s]
        for s in np.flatnonzero(smooth & ((values[:, :-1] < 0.0) & (values[:, 1:] >= 0.0)).any(axis=1)).tolist():
            (before, after), length = heights[s].tolist(), float(lengths[s])
            for minimum in shown(values[s].tolist()):
                between = falls[s] and rises[s]
                if between and fall(before, minimum.down, after, minimum.up, length) <= DIP * after:
                    continue
                if alone[s] or s in found.nodes or s in which:
                    alone[s] = True
                elif between:
                    which.append(s)
                    minima.append(minimum)
        kept = np.flatnonzero(~alone[which]) if which else np.empty(0, dtype=int)
        if kept.size:
            self._bottoms(i, np.array(which)[kept], [minima[j] for j in kept.tolist()], values, heights, found, alone)

    def _bottoms(
        self, i: int, which: Numbers, minima: Sequence[Minimum], values: Array, heights: Array, found: Located,
        alone: BoolArray,
    ) -> None:  # fmt: skip
        """``Locator._bottom`` of one minimum on each of the segments named, by slopes (n, 9) and heights (n, 2); those
        beside a corner are left to be found ``alone``."""
        brackets, least = self._brackets(which, values[which][:, [0, -1]], heights[which]), heights[which].min(axis=1)
        u, rate, down, up = np.array([(each.u, each.rate, each.down, each.up) for each in minima]).T
        slopes, places = np.column_stack((down, up)), np.tile([0.0, 1.0], (which.size, 1))
        best = brackets.low.at(np.arange(which.size))
        best.heights[:] = np.inf
        live = np.arange(which.size)
        for _ in range(BOTTOM_SECANTS):
            segments = which[live]
            cubics, metric = self._cubics.at(segments), self._metric.at(segments)
            normal = cubics.derivative(u[live])
            solved, good = self._solved(segments, metric, cubics, cubics.point(u[live]), normal)
            live = live[good]
            new = Ends.found(solved, normal, np.flatnonzero(good), self._observed(i))
            side, size = (new.slopes >= 0.0).astype(int), np.abs(new.slopes)
            for end, own in (
                (brackets.low, side == 0),
                (brackets.high, side == 1),
                (best, new.heights < best.heights[live]),
            ):
                end.put(live[own], new.at(own))
            corner = size > 0.5 * slopes[live, side]
            slopes[live, side], places[live, side] = size, u[live]
            here, known = brackets.at(live), best.heights[live]
            low, high = here.low.heights, here.high.heights
            rest = fall(low, slopes[live, 0], high, slopes[live, 1], here.chord.room)
            enough = is_bottom(known, rest, least[live])
            self._as_minima(best.at(live[enough]), which[live[enough]], found)
            u[live] -= new.slopes / rate[live]
            live = live[~enough & ~corner & (places[live, 0] < u[live]) & (u[live] < places[live, 1])]
            if not live.size:
                break
        alone[[s for s in which.tolist() if s not in found.nodes]] = True

    def _as_minima(self, ends: Ends, segments: Numbers, found: Located) -> None:
        """Put ordinary points on the segments named."""
        number = len(self._dense.nodes.branch)
        points = self._as_nodes(ends, np.arange(segments.size), self._kept(ends, segments), segments)
        self._dense.nodes = Points.joined([self._dense.nodes, points])
        for j, s in enumerate(segments.tolist()):
            found.nodes[s], found.kinds[number + j] = [number + j], ("regular", "")

    def _with_dips(self, found: Located, slopes: Array, alone: BoolArray) -> None:
        """Segments of which an end is higher than the peak, or that by slopes (n, 2, n_outputs) at their ends have one
        of another output beside it: minima, and that peak, are found where each is ``alone``."""
        segments = np.array(list(found.nodes), dtype=int)
        if not segments.size:
            return
        peaks = np.array([found.nodes[s][0] for s in segments.tolist()])
        of = np.array([self._names.index(found.kinds[node][1]) for node in peaks.tolist()])
        every, nodes = np.arange(of.size), self._dense.nodes
        at_peaks, *at_ends = (
            self._at(nodes.states[at], nodes.tangents[at])
            for at in (peaks, self._segments.first[segments], self._segments.second[segments])
        )
        size, ends = at_peaks[0][every, of], [sizes[every, of] for sizes, _ in at_ends]
        alone[segments[np.maximum(*ends) > size]] = True
        slope, before, after = at_peaks[1], slopes[segments, 0], slopes[segments, 1]
        falls = ((before > 0.0) & (slope <= 0.0)) | ((slope > 0.0) & (after <= 0.0))
        for sizes, sign, end in ((at_ends[0][0], 1.0, before), (at_ends[1][0], -1.0, after)):
            gain = sign * (at_peaks[0] / np.maximum(sizes, TINY) - 1.0)
            falls |= (end * slope > 0.0) & (gain * slope < 0.0) & (np.abs(gain) > _EXCEEDS)
        falls[every, of] = False
        alone[segments[falls.any(axis=1)]] = True

    def _motion(self, z: Array) -> Array:
        """Motion of the outputs (k, n_outputs, L) that goes with states or their derivatives (k, N + 1)."""
        b = self._first.balance
        return np.asarray(z[:, :-1].reshape(len(z), b.n_ports, b.L)[:, self._ports] / self._cosines[:, None])

    def _moving(self, z: Array) -> Array:
        """Largest varying coefficient (k,) at states (k, N + 1)."""
        b = self._first.balance
        return np.asarray(np.abs(z[:, :-1].reshape(len(z), b.n_ports, b.L)[:, :, 1:]).max(axis=(1, 2)))

    def _at(self, z: Array, tangents: Array) -> tuple[Array, Array]:
        """Amplitudes and their slopes (k, n_outputs) at solutions, as the event functions tell them."""
        size, slope = amplitude_with_slope(self._first.balance.harmonics, self._motion(z), self._motion(tangents))
        largest = np.maximum(self._moving(z), size.max(axis=1))[:, None]
        slope[(np.abs(slope) <= SLOPE_NOISE * size) | (size <= AMPLITUDE_NOISE * largest)] = 0.0
        return size, slope

    def _slopes(self, begins: BoolArray) -> tuple[Array, Array]:
        """Slopes (n, 9, n_outputs) of amplitudes along segments, those of first points as they are there; amplitudes
        (n, 2, n_outputs) at both ends."""
        nodes, segments, cubics = self._dense.nodes, self._segments, self._cubics
        x, dx = self._motion(nodes.states), self._motion(nodes.tangents)
        first, second, (before, after) = segments.first, segments.second, cubics.rates
        ends = np.stack(
            (x[first], x[second], before[:, None, None] * dx[first], after[:, None, None] * dx[second]), axis=1
        )
        flat, shape = ends.reshape(first.size, 4, -1), (first.size, -1, *ends.shape[2:])
        along, change = ((part @ flat).reshape(shape) for part in (_PLACES.shares, _PLACES.slopes))
        change /= cubics.length[:, None, None, None]
        size, slope = amplitude_with_slope(self._first.balance.harmonics, along, change)
        largest = np.maximum(self._moving(nodes.states)[second], size.max(axis=(1, 2)))[:, None, None]
        slope[(np.abs(slope) <= PLATEAU * size) | (size <= AMPLITUDE_NOISE * largest)] = 0.0
        slope[begins, 0] = self._at(nodes.states[first[begins]], nodes.tangents[first[begins]])[1]
        return slope, size[:, [0, -1]]

    # seen together

    def _observed(self, i: int) -> Observed:
        """Amplitude and slope of an output."""

        def observed(states: Array, tangents: Array) -> tuple[Array, Array]:
            size, slope = self._at(states, tangents)
            return size[:, i], slope[:, i]

        return observed

    def _brackets(self, which: Numbers, slopes: Array, heights: Array) -> Brackets:
        """Whole segments, with slopes and heights (k, 2) at both ends."""
        nodes, segments = self._dense.nodes, self._segments
        low, high = (
            Ends.of(nodes, at[which], heights[:, k], slopes[:, k])
            for k, at in enumerate((segments.first, segments.second))
        )
        branch, metric = nodes.branch[segments.first[which]], self._metric.at(which)
        return Brackets(segment=which, branch=branch, metric=metric, low=low, high=high)

    def _parted(self, todo: Brackets, wanted: BoolArray) -> list[Brackets]:
        """By output, parts of segments that are not near the branch over which its slope falls through zero.

        ``Maxima.parted``: they are halved until slopes and heights at the ends tell what is between, for the outputs
        ``wanted`` (k, n_outputs). What is solved for in the middle tells of all.
        """
        parts = [[todo.of_output(i).at(slice(0))] for i in range(wanted.shape[1])]
        for times in range(PARTINGS + 1):
            told = wanted if times == PARTINGS else wanted & todo.plain()
            open_ = wanted & ~told
            some = np.flatnonzero(open_.any(axis=1))
            rest, good = todo.at(some), np.zeros(some.size, dtype=bool)
            if some.size:
                cubics, u = rest.cubics, np.full(some.size, 0.5)
                guess, normal = cubics.point(u), cubics.derivative(u)
                solved, good = self._solved(rest.segment, rest.metric, cubics, guess, normal)
                told[some[~good]] = wanted[some[~good]]
            for i, which in enumerate(told.T):
                parts[i].append(todo.of_output(i).at(which))
            if not good.any():
                break
            rest, wanted = rest.at(good), open_[some[good]]
            middle = Ends.found(solved, normal, np.flatnonzero(good), self._at)
            middle.slopes = np.where(middle.slopes == 0.0, np.copysign(TINY, rest.low.slopes), middle.slopes)
            todo, wanted = (
                Brackets.joined([replace(rest, high=middle), replace(rest, low=middle)]),
                np.tile(wanted, (2, 1)),
            )
        return [_falling(of) for of in parts]

    def _beside(self, i: int, which: Numbers, values: Array) -> Brackets:
        """Solutions on both sides of where the slope of an output falls through zero on segments, as ``Maxima.near``.

        Those of segments where both are there, and tell it.
        """
        place, step = np.argmax((values[:, :-1] > 0.0) & (values[:, 1:] <= 0.0), axis=1), float(_PLACES.u[1])
        nodes, at, good = self._dense.nodes, _PLACES.u[place], np.ones(which.size, dtype=bool)
        ends = [end[which] for end in (self._segments.first, self._segments.second)]
        heights = (
            [self._at(nodes.states[end], nodes.tangents[end])[0][:, i] for end in ends] if which.size else [at, at]
        )
        out = self._brackets(which, values[:, [0, -1]], np.column_stack(heights))
        for end, edge, u in (
            (out.low, 0.0, np.maximum(0.0, at - step)),
            (out.high, 1.0, np.minimum(1.0, at + 2 * step)),
        ):
            inside = np.flatnonzero(u != edge)
            if inside.size:
                here, cubics = self._metric.at(which[inside]), self._cubics.at(which[inside])
                guess, direction = cubics.point(u[inside]), cubics.derivative(u[inside])
                solved, fine = self._solved(which[inside], here, cubics, guess, direction, exact=True)
                end.put(inside[fine], Ends.found(solved, direction, np.flatnonzero(fine), self._observed(i)))
                good[inside[~fine]] = False
        return _falling([out.at(good)])

    def _narrowed(self, i: int, brackets: Brackets, found: Located) -> None:
        """Locate the peak of an output within each bracket."""
        if not brackets.segment.size:
            return
        tolerance, nodes = self._first.options.event_tolerance, self._dense.nodes
        brackets.narrow(self._correctors, self._exact, self._observed(i), tolerance)
        top, known = brackets.tops(tolerance)
        points = self._as_nodes(top, np.arange(known.size), self._kept(top, brackets.segment), brackets.segment)
        for k, (s, certain) in enumerate(zip(brackets.segment.tolist(), known.tolist(), strict=True)):
            number = len(nodes.branch) + k
            found.nodes[s], found.kinds[number] = [number], ("peak" if certain else "near peak", self._names[i])
        self._dense.nodes = Points.joined([nodes, points])

    def _by_secants(self, i: int, which: Numbers, values: Array, found: Located) -> BoolArray:
        """Locate the peak of an output on segments where its slope falls through zero once; which were.

        ``Maxima.by_secants``, from slopes (n, 9) along each.
        """
        nodes, tolerance = self._dense.nodes, self._first.options.event_tolerance
        metric, cubics = self._metric.at(which), self._cubics.at(which)
        every, place = np.arange(which.size), np.argmax((values[:, :-1] > 0.0) & (values[:, 1:] <= 0.0), axis=1)
        at, step = _PLACES.u[place], float(_PLACES.u[1])
        rate = (values[every, place + 1] - values[every, place]) / step
        u, off = at - values[every, place] / rate, np.zeros((which.size, nodes.states.shape[1]))
        room = np.maximum(0.0, at - step), np.minimum(1.0, at + 2.0 * step)
        known_at, known = np.full(which.size, np.nan), np.zeros(which.size)
        good, live, parts, whose = np.zeros(which.size, dtype=bool), every, list[Points](), list[Numbers]()
        for _ in range(SECANTS):
            if not live.size:
                break
            some = cubics.at(live)
            guess = some.point(u[live]) + off[live]
            direction = some.derivative(u[live])
            solved, fine = self._solved(which[live], metric.at(live), some, guess, direction, exact=True)
            live, kept = live[fine], np.flatnonzero(fine)
            value = self._at(solved.states[kept], solved.tangents[kept])[1][:, i] if kept.size else np.empty(0)
            again = ~np.isnan(known_at[live]) & (u[live] != known_at[live])
            with np.errstate(invalid="ignore", divide="ignore"):
                slope = np.where(again, (value - known[live]) / (u[live] - known_at[live]), rate[live])
            right = slope * rate[live] > 0.0
            live, kept, value = live[right], kept[right], value[right]
            rate[live] = slope[right]
            known_at[live], known[live] = u[live], value
            off[live] = solved.states[kept] - cubics.at(live).point(u[live])
            shift = -value / rate[live]
            done = np.abs(shift) * cubics.length[live] < tolerance
            if done.any():
                factors = self._correctors.factors.add(solved.factors, kept[done])
                parts.append(self._as_nodes(solved, kept[done], factors, which[live[done]]))
                whose.append(which[live[done]])
                good[live[done]] = True
            u[live] += shift
            live = live[~done & (u[live] >= room[0][live]) & (u[live] <= room[1][live])]
        if parts:
            numbers = len(self._dense.nodes.branch) + np.arange(sum(len(part.branch) for part in parts))
            self._dense.nodes = Points.joined([self._dense.nodes, *parts])
            for s, number in zip(np.concatenate(whose).tolist(), numbers.tolist(), strict=True):
                found.nodes[s], found.kinds[number] = [number], ("peak", self._names[i])
        return good

    def _solved(
        self, which: Numbers, metric: Metric, cubics: HermiteSegment, guess: Array, direction: Array, *,
        exact: bool = False,
    ) -> tuple[Solved, BoolArray]:  # fmt: skip
        """``Maxima.solved``: solutions on planes across segments, and which of them are those expected."""
        nodes, segments = self._dense.nodes, self._segments
        branch = nodes.branch[segments.first[which]]
        across = np.zeros(which.size, dtype=bool)
        solved = self._correctors.correct(
            branch, guess, direction, across, metric, forward=direction, options=self._exact if exact else None
        )
        with np.errstate(invalid="ignore"):
            near = is_near(metric, solved.states - guess, cubics.length)
        ways = (nodes.orientation[ends[which]] for ends in (segments.first, segments.second))
        return solved, np.asarray(solved.found & near & leads_on(solved.orientation, *ways))

    def _kept(self, ends: Ends, which: Numbers) -> Numbers:
        """Numbers of the factors of ends, on the segments named, that become points."""
        factors, new = ends.factors.copy(), np.flatnonzero(ends.factors < 0)
        if new.size:
            segments = which[new]
            branch = self._dense.nodes.branch[self._segments.first[segments]]
            some = ends.at(new)
            factors[new] = self._correctors.keep(branch, some.states, some.normals, self._metric.at(segments))
        return factors

    def _as_nodes(self, solved: Solved | Ends, kept: Numbers, factors: Numbers, which: Numbers) -> Points:
        """Some of what was solved for, on the segments named."""
        nodes, first, owner = self._dense.nodes, self._segments.first[which], self._segments.owner[which]
        metric, states = nodes.metric.at(owner), solved.states[kept]
        return Points(
            **solved.columns(kept), branch=nodes.branch[first], factors=factors,
            arclength=nodes.arclength[first] + metric.length(states - nodes.states[first]),
            apart=np.full(kept.size, np.inf), metric=metric,
        )  # fmt: skip

    # one by one

    def _each(self, wanted: Numbers, before: Array, found: Located) -> None:
        """Those on the segments named, as each curve locates them alone."""
        segments, nodes = self._segments, self._dense.nodes
        branch = nodes.branch[segments.first[wanted]]
        steps, owners, factors = list[Step](), list[int](), list[int]()
        locators: dict[int, tuple[Corrector, Locator]] = {}
        for s, i in zip(wanted.tolist(), branch.tolist(), strict=True):
            if i not in locators:
                locators[i] = self._locator(i)
            corrector, locator = locators[i]
            owner = int(segments.owner[s])
            _, *sizes = (float(part[owner]) for part in nodes.metric.measure)
            corrector.metric = corrector.metric.measuring(Measure(1.0, *sizes))
            locator.values = tuple(before[:, s].tolist())
            ends = int(segments.first[s]), int(segments.second[s])
            first, second = (self._step(node) for node in ends)
            second.smooth = bool(segments.smooth[s])
            for step in locator.between(first, second):
                number = len(nodes.branch) + len(steps)
                found.nodes.setdefault(s, []).append(number)
                found.kinds[number] = step.kind, step.name
                steps.append(step)
                owners.append(owner)
                factors.append(self._factors(step, ends))
        for i, (corrector, _) in locators.items():
            self._correctors.evaluations[i] += corrector.evaluations
            self._correctors.solves[i] += corrector.solves
        if steps:
            self._dense.nodes = Points.joined([nodes, self._as_points(steps, owners, factors)])

    def _factors(self, step: Step, ends: tuple[int, int]) -> int:
        """The number of the factors at what was located: where that is an end of the segment, the one of its node."""
        if step.jacobian is not None:
            return int(self._correctors.factors.of(step.jacobian.multiply(np.eye(step.state.size))[None])[0])
        nodes = self._dense.nodes
        return int(next(nodes.factors[end] for end in ends if np.array_equal(nodes.states[end], step.state)))

    def _as_points(self, steps: Sequence[Step], owners: Sequence[int], factors: Sequence[int]) -> Points:
        nodes = self._dense.nodes
        return Points(
            branch=nodes.branch[owners], states=np.array([s.state for s in steps]),
            tangents=np.array([s.tangent for s in steps]), factors=np.array(factors),
            orientation=np.array([s.orientation for s in steps]), iterations=np.array([s.iterations for s in steps]),
            arclength=np.array([s.arclength for s in steps]), apart=np.full(len(steps), np.inf),
            metric=nodes.metric.at(np.array(owners)),
        )  # fmt: skip

    def _locator(self, i: int) -> tuple[Corrector, Locator]:
        """What locates on one curve."""
        request, options = self._requests[i], self._first.options
        metric = Metric(self._scalings[i], np.ones(request.balance.size), abs(request.stop - request.start))
        corrector = Corrector(request.system, request.balance.size, metric, options.newton)
        self.postprocessing[i] = Postprocessing()
        peaks = peak_events(Outputs(request.balance, ()), request.peaks_of, request.system)
        events = (
            *((turning_points(),) if options.locate_turning_points else ()),
            *kept_up(self.postprocessing[i], "the place of peaks", peaks),
        )
        return corrector, Locator(corrector, events, np.empty(0), options.event_tolerance)

    def _step(self, node: int) -> Step:
        """A node as a step of the curve alone."""
        nodes = self._dense.nodes
        state, tangent = nodes.states[node], nodes.tangents[node]
        step = Step(state, tangent, NewtonResult(state), "regular", "", state.size - 1)
        step.orientation, step.arclength = int(nodes.orientation[node]), float(nodes.arclength[node])
        step.iterations = int(nodes.iterations[node])
        step.evaluation = SimpleNamespace(detail=None)  # outputs that are contact ports ask for nothing of it
        return step


def _near_miss(values: Array) -> BoolArray:
    """Where values (n, p) of one sign nearly change it between their ends, as in ``Locator._see_to_near_miss``."""
    same, size = (values.min(axis=1) > 0.0) | (values.max(axis=1) < 0.0), np.abs(values)
    nearest = size[:, 1:-1].min(axis=1)
    return np.asarray(same & (nearest < _NEARLY * np.minimum(size[:, 0], size[:, -1])))


def _carried(slopes: Array, begins: BoolArray) -> Array:
    """Slopes (n, p) along segments one after the other, of which plateaus have the sign of what comes before them.

    The first of each is the last of the one before, but where a curve ``begins``.
    """
    start = np.where(slopes[:, 0] == 0.0, TINY, slopes[:, 0])
    chain = np.column_stack((np.where(begins, start, np.nan), slopes[:, 1:])).ravel()
    known = np.where((chain != 0.0) & ~np.isnan(chain), np.arange(chain.size), 0)
    last = chain[np.maximum.accumulate(known)]
    filled = np.where(chain == 0.0, np.copysign(TINY, last), chain).reshape(len(slopes), -1)
    ends = np.append(np.nan, filled[:-1, -1])
    filled[:, 0] = np.where(begins, filled[:, 0], ends)
    return np.asarray(filled)


def _falling(parts: list[Brackets]) -> Brackets:
    """Those between whose ends the slope falls through zero."""
    every = Brackets.joined(parts)
    return every.at(every.falls)
