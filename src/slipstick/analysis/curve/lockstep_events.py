"""Peaks and turning points of curves that are followed side by side.

Where they may be is seen for all segments at once, as ``Locator`` sees it of each. A plain peak is located by secants
for all curves together; what is near to a corner, or several in one segment, curve by curve, by a ``Locator``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from slipstick.analysis.curve.follow import CurveRequest
from slipstick.analysis.peaks.events import _LEVEL, _NOISE, _ROUNDING, kept_up, peak_events
from slipstick.results.besides import Besides
from slipstick.results.measures import amplitude_with_slope
from slipstick.results.record import Outputs
from slipstick.solve.continuation import ArclengthScaling, Step
from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.events import turning_points
from slipstick.solve.continuation.locate import _NEARLY, _PLACES, Locator
from slipstick.solve.continuation.lockstep import Correctors, Cubics, Measures, Numbers, Points, Solved
from slipstick.solve.continuation.lockstep_output import Outputs as DenseOutputs
from slipstick.solve.continuation.maxima import _HIDDEN, _PARTINGS, _SECANTS, _STEADY, TINY
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.newton import NewtonResult
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, BoolArray

_TOO_FAR = 0.5
"""As in ``corrector.py``."""


@dataclass(kw_only=True)
class Located:
    """Points that were located, by the number of their segment, in order: numbers of nodes."""

    nodes: dict[int, list[int]]
    kinds: dict[int, tuple[str, str]]
    """Kind and name by node."""


class Events:
    """Peaks and turning points on the segments of curves that are ``alike``.

    Attributes
    ----------
    besides
        What could not be had where one curve was looked at alone, by its number.
    """

    def __init__(
        self, requests: Sequence[CurveRequest], scalings: Sequence[ArclengthScaling], correctors: Correctors,
        dense: DenseOutputs,
    ) -> None:  # fmt: skip
        self._requests, self._scalings, self._correctors, self._dense = requests, scalings, correctors, dense
        self._first, self._segments = requests[0], dense.segments
        self._measures, self._cubics = dense.cubics(dense.segments)
        outputs = Outputs(self._first.balance, self._first.peaks_of)
        self._names = outputs.names
        ports = [port for port in outputs._ports if port is not None]
        self._ports, self._cosines = [port for port, _ in ports], np.array([cosine for _, cosine in ports])
        self._exact = replace(correctors.patient, tolerance=min(1e-14, self._first.options.newton.tolerance))
        self.besides: dict[int, Besides] = {}

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
        plain = list[tuple[int, Numbers, Array]]()
        if self._names:
            slopes, heights = self._slopes(begins)
            parted = list[tuple[int, Numbers, Array]]()
            for i in range(len(self._names)):
                values = _carried(slopes[:, :, i], begins)
                crossed = (values[:, :-1] > 0.0) & (values[:, 1:] <= 0.0)
                missed = _near_miss(np.column_stack((values[:, :1], slopes[:, 1:, i])))
                alone |= segments.smooth & (missed | (crossed.sum(axis=1) > 1))
                plain.append((i, np.flatnonzero(segments.smooth & (crossed.sum(axis=1) == 1)), values))
                ends = values[:, [0, -1]]
                falls = (ends[:, 0] > 0.0) & (ends[:, 1] <= 0.0)
                tangents = nodes.tangents[segments.first], nodes.tangents[segments.second]
                hidden = ~_plain(ends, heights[:, :, i], self._measures, *tangents, cubics.length)
                alone |= ~segments.smooth & ~hidden & falls
                parted.append((i, np.flatnonzero(~segments.smooth & hidden), ends))
                before.append(values[:, 0])
            for i, which, ends in parted:
                which = which[~alone[which]]
                alone[which[self._falls_between(i, which, ends[which], heights[which, :, i])]] = True
        sought = np.zeros(branch.size, dtype=int)
        for _, which, _ in plain:
            sought[which] += 1
        alone |= sought > 1
        found = Located(nodes={}, kinds={})
        for i, which, values in plain:
            which = which[~alone[which]]
            good = self._by_secants(i, which, values[which], found)
            alone[which[~good]] = True
        self._each(np.flatnonzero(alone), np.array(before), found)
        return found

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
        size, slope = _each_alone(self._first.balance.harmonics, self._motion(z), self._motion(tangents))
        largest = np.maximum(self._moving(z), size.max(axis=1))[:, None]
        slope[(np.abs(slope) <= _ROUNDING * size) | (size <= _NOISE * largest)] = 0.0
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
        size, slope = _each_alone(self._first.balance.harmonics, along, change)
        largest = np.maximum(self._moving(nodes.states)[second], size.max(axis=(1, 2)))[:, None, None]
        slope[(np.abs(slope) <= _LEVEL * size) | (size <= _NOISE * largest)] = 0.0
        slope[begins, 0] = self._at(nodes.states[first[begins]], nodes.tangents[first[begins]])[1]
        return slope, size[:, [0, -1]]

    # seen together

    def _falls_between(self, i: int, which: Numbers, slopes: Array, heights: Array) -> BoolArray:
        """Whether the slope of an output falls through zero somewhere on segments that are not near the branch.

        ``Maxima._parted``: they are halved until slopes and heights at the ends tell what is between.
        """
        nodes, segments = self._dense.nodes, self._segments
        falls = np.zeros(which.size, dtype=bool)
        of, owner = np.arange(which.size), segments.owner[which]
        ends = [(nodes.states[at[which]], nodes.tangents[at[which]]) for at in (segments.first, segments.second)]
        for _ in range(_PARTINGS):
            if not of.size:
                break
            measures = nodes.measures.at(owner[of])
            cubics = Cubics.between(measures, *ends)
            told = _plain(slopes, heights, measures, ends[0][1], ends[1][1], cubics.length)
            np.logical_or.at(falls, of[told], (slopes[told, 0] > 0.0) & (slopes[told, 1] <= 0.0))
            rest = np.flatnonzero(~told)
            if not rest.size:
                return falls
            some, u = cubics.at(rest), np.full(rest.size, 0.5)
            solved, good = self._solved(which[of[rest]], measures.at(rest), some, some.points(u), some.derivatives(u))
            bad = rest[~good]
            np.logical_or.at(falls, of[bad], (slopes[bad, 0] > 0.0) & (slopes[bad, 1] <= 0.0))
            rest, middle = rest[good], (solved.states[good], solved.tangents[good])
            height, slope = (part[:, i] for part in self._at(*middle)) if rest.size else (np.empty(0), np.empty(0))
            slope = np.where(slope == 0.0, np.copysign(TINY, slopes[rest, 0]), slope)
            of = np.append(of[rest], of[rest])
            low, high = ([part[rest] for part in end] for end in ends)
            ends = [
                (np.concatenate((low[0], middle[0])), np.concatenate((low[1], middle[1]))),
                (np.concatenate((middle[0], high[0])), np.concatenate((middle[1], high[1]))),
            ]
            slopes, heights = (
                np.concatenate((np.column_stack((at[rest, 0], between)), np.column_stack((between, at[rest, 1]))))
                for at, between in ((slopes, slope), (heights, height))
            )
        np.logical_or.at(falls, of, (slopes[: of.size, 0] > 0.0) & (slopes[: of.size, 1] <= 0.0))
        return falls

    def _by_secants(self, i: int, which: Numbers, values: Array, found: Located) -> BoolArray:
        """Locate the peak of an output on segments where its slope falls through zero once; whether it was.

        ``Maxima.quickly``, from slopes (n, 9) along each.
        """
        nodes, tolerance = self._dense.nodes, self._first.options.event_tolerance
        measures, cubics = self._measures.at(which), self._cubics.at(which)
        every, place = np.arange(which.size), np.argmax((values[:, :-1] > 0.0) & (values[:, 1:] <= 0.0), axis=1)
        at, step = _PLACES.u[place], float(_PLACES.u[1])
        rate = (values[every, place + 1] - values[every, place]) / step
        u, off = at - values[every, place] / rate, np.zeros((which.size, nodes.states.shape[1]))
        room = np.maximum(0.0, at - step), np.minimum(1.0, at + 2.0 * step)
        known_at, known = np.full(which.size, np.nan), np.zeros(which.size)
        good, live, parts, whose = np.zeros(which.size, dtype=bool), every, list[Points](), list[Numbers]()
        for _ in range(_SECANTS):
            if not live.size:
                break
            some = cubics.at(live)
            guess = some.points(u[live]) + off[live]
            direction = some.derivatives(u[live])
            solved, fine = self._solved(which[live], measures.at(live), some, guess, direction, exact=True)
            live, kept = live[fine], np.flatnonzero(fine)
            value = self._at(solved.states[kept], solved.tangents[kept])[1][:, i] if kept.size else np.empty(0)
            again = ~np.isnan(known_at[live]) & (u[live] != known_at[live])
            with np.errstate(invalid="ignore", divide="ignore"):
                slope = np.where(again, (value - known[live]) / (u[live] - known_at[live]), rate[live])
            right = slope * rate[live] > 0.0
            live, kept, value = live[right], kept[right], value[right]
            rate[live] = slope[right]
            known_at[live], known[live] = u[live], value
            off[live] = solved.states[kept] - cubics.at(live).points(u[live])
            shift = -value / rate[live]
            done = np.abs(shift) * cubics.length[live] < tolerance
            if done.any():
                parts.append(self._as_nodes(solved, kept[done], which[live[done]]))
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
        self, which: Numbers, measures: Measures, cubics: Cubics, guess: Array, direction: Array, *,
        exact: bool = False,
    ) -> tuple[Solved, BoolArray]:  # fmt: skip
        """``Maxima.solved``: solutions on planes across segments, and which of them are those expected."""
        nodes, segments = self._dense.nodes, self._segments
        branch = nodes.branch[segments.first[which]]
        across = np.zeros(which.size, dtype=bool)
        solved = self._correctors.correct(
            branch, guess, direction, across, measures, forward=direction, options=self._exact if exact else None
        )
        with np.errstate(invalid="ignore"):
            near = measures.lengths(solved.states - guess) <= _TOO_FAR * cubics.length
        ways = (nodes.orientation[ends[which]] for ends in (segments.first, segments.second))
        elsewhere = np.logical_and.reduce([solved.orientation * way < 0 for way in ways])
        return solved, np.asarray(solved.found & near & ~elsewhere)

    def _as_nodes(self, solved: Solved, kept: Numbers, which: Numbers) -> Points:
        nodes, first, owner = self._dense.nodes, self._segments.first[which], self._segments.owner[which]
        measures, states = nodes.measures.at(owner), solved.states[kept]
        return Points(
            branch=nodes.branch[first], states=states, tangents=solved.tangents[kept], inverse=solved.inverse[kept],
            orientation=solved.orientation[kept], iterations=solved.iterations[kept],
            arclength=nodes.arclength[first] + measures.lengths(states - nodes.states[first]),
            apart=np.full(kept.size, np.inf), measures=measures,
        )  # fmt: skip

    # one by one

    def _each(self, wanted: Numbers, before: Array, found: Located) -> None:
        """Those on the segments named, as each curve locates them alone."""
        segments, nodes = self._segments, self._dense.nodes
        branch = nodes.branch[segments.first[wanted]]
        steps, owners = list[Step](), list[int]()
        locators: dict[int, tuple[Corrector, Locator]] = {}
        for s, i in zip(wanted.tolist(), branch.tolist(), strict=True):
            if i not in locators:
                locators[i] = self._locator(i)
            corrector, locator = locators[i]
            owner = int(segments.owner[s])
            of = nodes.measures
            corrector.metric.measure = 1.0, float(of.size[owner]), float(of.present[owner]), float(of.largest[owner])
            locator.values = tuple(before[:, s].tolist())
            first, second = (self._step(int(n)) for n in (segments.first[s], segments.second[s]))
            second.smooth = bool(segments.smooth[s])
            for step in locator.between(first, second):
                number = len(nodes.branch) + len(steps)
                found.nodes.setdefault(s, []).append(number)
                found.kinds[number] = step.kind, step.name
                steps.append(step)
                owners.append(owner)
        for i, (corrector, _) in locators.items():
            self._correctors.evaluations[i] += corrector.evaluations
            self._correctors.solves[i] += corrector.solves
        if steps:
            self._dense.nodes = Points.joined([nodes, self._as_points(steps, owners)])

    def _as_points(self, steps: Sequence[Step], owners: Sequence[int]) -> Points:
        nodes, unit = self._dense.nodes, np.eye(len(steps[0].state))
        return Points(
            branch=nodes.branch[owners], states=np.array([s.state for s in steps]),
            tangents=np.array([s.tangent for s in steps]),
            inverse=np.array([s.jacobian.solve(unit) for s in steps if s.jacobian is not None]),
            orientation=np.array([s.orientation for s in steps]), iterations=np.array([s.iterations for s in steps]),
            arclength=np.array([s.arclength for s in steps]), apart=np.full(len(steps), np.inf),
            measures=nodes.measures.at(np.array(owners)),
        )  # fmt: skip

    def _locator(self, i: int) -> tuple[Corrector, Locator]:
        """What locates on one curve."""
        request, options = self._requests[i], self._first.options
        metric = Metric(self._scalings[i], np.ones(request.balance.size), abs(request.stop - request.start))
        corrector = Corrector(request.system, request.balance.size, metric, options.newton)
        self.besides[i] = Besides()
        peaks = peak_events(Outputs(request.balance, ()), request.peaks_of, request.system)
        events = (
            *((turning_points(),) if options.locate_turning_points else ()),
            *kept_up(self.besides[i], "the place of peaks", peaks),
        )
        return corrector, Locator(corrector, events, np.empty(0), options.event_tolerance)

    def _step(self, node: int) -> Step:
        """A node as a step of the curve alone."""
        nodes = self._dense.nodes
        state, tangent = nodes.states[node], nodes.tangents[node]
        step = Step(state, tangent, NewtonResult(state), "regular", "", state.size - 1)
        step.orientation, step.arclength = int(nodes.orientation[node]), float(nodes.arclength[node])
        step.evaluation = SimpleNamespace(detail=None)  # outputs that are contact ports ask for nothing of it
        return step


def _each_alone(harmonics: Harmonics, X: Array, dX: Array) -> tuple[Array, Array]:
    """``amplitude_with_slope`` of motions (..., L), the same bits whatever is beside each: one harmonic is a form of
    its own, which is taken where all rows have it."""
    flat, change = X.reshape(-1, harmonics.size), dX.reshape(-1, harmonics.size)
    single = np.count_nonzero(np.hypot(flat[:, 1::2], flat[:, 2::2]), axis=1) <= 1
    size, slope = np.empty(len(flat)), np.empty(len(flat))
    for rows in (np.flatnonzero(single), np.flatnonzero(~single)):
        if rows.size:
            size[rows], slope[rows] = amplitude_with_slope(harmonics, flat[rows], change[rows])
    return size.reshape(X.shape[:-1]), slope.reshape(X.shape[:-1])


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


def _plain(slopes: Array, heights: Array, measures: Measures, first: Array, second: Array, length: Array) -> BoolArray:
    """``Maxima._plain`` of segments: slopes and heights (n, 2) and tangents (n, N + 1) at both ends, lengths (n,)."""
    before, after = slopes[:, 0] / measures.lengths(first), slopes[:, 1] / measures.lengths(second)
    gain = heights[:, 1] - heights[:, 0]
    hidden = np.minimum(
        np.abs(gain - 0.5 * length * (before + after)), np.maximum(np.abs(before), np.abs(after)) * length
    )
    steady = np.minimum(before * gain, after * gain) > 0.0
    limit = np.maximum(_HIDDEN * heights.max(axis=1), np.where(steady, _STEADY * np.abs(gain), 0.0))
    return np.asarray(hidden <= limit)
