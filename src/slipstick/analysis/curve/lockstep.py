"""Many curves of one form followed side by side: the same points, peaks and warnings as each alone, for less time.

Steps (``solve/continuation/lockstep.py``) and what lies between them (``lockstep_output.py``) are computed for all
curves at once; where peaks and turning points may be is seen for all at once too, and those are located curve by curve,
as they are alone. A curve on which anything is out of the ordinary is left to be followed alone.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np

from slipstick.analysis.curve.follow import CurveRequest
from slipstick.analysis.curve.request import adapted_to
from slipstick.analysis.curve.segments import Segment, joined
from slipstick.analysis.curve.state_continuation import FOLDS, UNSOLVED
from slipstick.analysis.peaks.events import _LEVEL, _NOISE, _ROUNDING, kept_up, peak_events
from slipstick.balance.batch_evaluation import evaluated_together
from slipstick.balance.many import ManyBalances, same_form
from slipstick.balance.residual import unanswered
from slipstick.balance.scaling import scales
from slipstick.balance.start import FirstPoint
from slipstick.balance.systems import FrequencySystem
from slipstick.branch import Branch
from slipstick.errors import Outcome
from slipstick.results.besides import Besides
from slipstick.results.measures import amplitude, amplitude_with_slope
from slipstick.results.record import Outputs, Point
from slipstick.results.schema import LARGEST, attributes_of, make_table
from slipstick.results.truncation import Reaction
from slipstick.solve.continuation import Step
from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.events import turning_points
from slipstick.solve.continuation.locate import _NEARLY, _PLACES, Locator
from slipstick.solve.continuation.lockstep import Correctors, Cubics, Measures, Numbers, Points, follow
from slipstick.solve.continuation.lockstep_output import Interpolated, Segments
from slipstick.solve.continuation.lockstep_output import Outputs as DenseOutputs
from slipstick.solve.continuation.maxima import _HIDDEN, _STEADY, TINY
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.linear.factorisation import one_blas_thread
from slipstick.solve.newton import NewtonResult
from slipstick.typing import Array, BoolArray

MOST_UNKNOWNS = 120
"""Unknowns up to which a curve is followed with others: of more, the work of one fills a processor anyway."""


def in_lockstep(request: CurveRequest) -> bool:
    """Whether a curve can be followed with others: what is asked besides is found point by point."""
    balance = request.balance
    return (
        isinstance(request.system, FrequencySystem)
        and evaluated_together(balance)
        and balance.size <= MOST_UNKNOWNS
        and adapted_to(request.options) is None
        and request.stability is None
        and request.guess is None
        and request.departure is None
        and not (request.requested or request.checkpoints or request.largest_of or request.listeners)
        and request.peaks_of != (LARGEST,)
        and not Outputs(balance, balance.problem.outputs or ()).far
    )


def alike(first: CurveRequest, other: CurveRequest) -> bool:
    """Whether two curves can be followed side by side."""
    return (
        same_form(first.balance, other.balance)
        and (first.start, first.stop, first.peaks_of) == (other.start, other.stop, other.peaks_of)
        and first.options == other.options
    )


class _Inverse:
    """An inverse, as a Jacobian that is solved with."""

    def __init__(self, inverse: Array) -> None:
        self._inverse = inverse

    def solve(self, right: Array) -> Array:
        return np.asarray(self._inverse @ right)


@dataclass(kw_only=True)
class _Located:
    """Points that were located, by the number of their segment, in order: numbers of nodes."""

    nodes: dict[int, list[int]]
    kinds: dict[int, tuple[str, str]]
    """Kind and name by node."""


class Lockstep:
    """Curves under way together; they must be ``alike``."""

    def __init__(self, requests: Sequence[CurveRequest]) -> None:
        self._requests, self._first = list(requests), requests[0]
        self._span = self._first.start, self._first.stop
        self._clock = time.perf_counter()
        self._besides: dict[int, Besides] = {}

    def branches(self) -> list[Branch | None]:
        """The branch of each request, its warnings kept with it but not given; None of those to be followed alone."""
        with one_blas_thread():
            return self._branches()

    def _branches(self) -> list[Branch | None]:
        requests = self._requests
        started = [FirstPoint(r.balance, r.inputs, r.omega).find() for r in requests]
        kept = [i for i, x in enumerate(started) if x is not None]
        out: list[Branch | None] = [None] * len(requests)
        if len(kept) < len(requests):
            if kept:
                rest = Lockstep([requests[i] for i in kept])._branches()
                for i, branch in zip(kept, rest, strict=True):
                    out[i] = branch
            return out
        x = np.array(started)
        scaling = [scales(r.balance, r.inputs, r.omega) for r in requests]
        options, span = self._first.options, abs(self._span[1] - self._span[0])
        self._scalings = [one.arclength() for one in scaling]
        self._layout = self._first.recorder().layout
        self._systems = ManyBalances([r.balance for r in requests], [r.inputs for r in requests])
        self._correctors = Correctors(self._systems, len(requests), options.newton)
        measures = Measures.begun(self._scalings[0], np.array([s.displacement for s in scaling]), x, span)
        self._measures = measures
        followed = follow(self._correctors, x, self._span, measures, options)
        self._rejected = followed.rejected
        if not followed.points.branch.size:
            return out
        self._dense = DenseOutputs(self._systems, self._correctors, followed.points, self._span, options)
        located = self._locate()
        return self._recorded(located, followed.given_up | self._correctors.doubtful)

    # where peaks and turning points may be

    def _locate(self) -> _Located:
        """The peaks and turning points of every curve."""
        segments, nodes = self._dense.segments, self._dense.nodes
        measures, cubics = self._dense._cubics(segments)
        branch = nodes.branch[segments.first]
        begins = np.append(True, branch[1:] != branch[:-1])
        before, wanted = [], np.zeros(branch.size, dtype=bool)
        if self._first.options.locate_turning_points:
            rates = (_PLACES.slopes @ cubics.nodes[:, :, -1:])[..., 0] / cubics.length[:, None]
            known = np.append(nodes.tangents[segments.first[:1], -1], rates[:-1, -1])
            known[begins] = nodes.tangents[segments.first[begins], -1]
            rates[:, 0] = known
            a, b = rates[:, :-1], rates[:, 1:]
            wanted |= (((a < 0.0) & (b >= 0.0)) | ((a > 0.0) & (b <= 0.0))).any(axis=1) | _near_miss(rates)
            before.append(known)
        outputs = Outputs(self._first.balance, self._first.peaks_of)
        if len(outputs):
            slopes, sizes = self._slopes(outputs, segments, cubics, begins)
            for i in range(len(outputs)):
                values = _carried(slopes[:, :, i], begins)
                falls = ((values[:, :-1] > 0.0) & (values[:, 1:] <= 0.0)).any(axis=1)
                missed = _near_miss(np.column_stack((values[:, :1], slopes[:, 1:, i])))
                ends = values[:, [0, -1]]
                plain = _plain(ends, sizes[:, :, i], measures, segments, nodes, cubics)
                wanted |= np.where(segments.smooth, falls | missed, ~plain | ((ends[:, 0] > 0.0) & (ends[:, 1] <= 0.0)))
                before.append(values[:, 0])
        return self._located(np.flatnonzero(wanted), np.array(before))

    def _slopes(self, outputs: Outputs, segments: Segments, cubics: Cubics, begins: BoolArray) -> tuple[Array, Array]:
        """Slopes (n, 9, n_outputs) of amplitudes along segments, those of first points as they are there; amplitudes
        (n, 2, n_outputs) at both ends."""
        nodes, b = self._dense.nodes, self._first.balance
        ports = [port for port in outputs._ports if port is not None]
        at, cosines = [port for port, _ in ports], np.array([cosine for _, cosine in ports])

        def motion(z: Array) -> Array:
            return np.asarray(z[:, :-1].reshape(len(z), b.n_ports, b.L)[:, at] / cosines[:, None])

        x, dx = motion(nodes.states), motion(nodes.tangents)
        first, second, (before, after) = segments.first, segments.second, cubics.rates
        ends = np.stack(
            (x[first], x[second], before[:, None, None] * dx[first], after[:, None, None] * dx[second]), axis=1
        )
        flat, shape = ends.reshape(first.size, 4, -1), (first.size, -1, *ends.shape[2:])
        along, change = ((part @ flat).reshape(shape) for part in (_PLACES.shares, _PLACES.slopes))
        change /= cubics.length[:, None, None, None]
        size, slope = np.empty(along.shape[:-1]), np.empty(along.shape[:-1])
        heights = np.empty(x.shape[:-1])
        bounds = np.append(np.flatnonzero(begins), first.size).tolist()
        for one in map(slice, bounds[:-1], bounds[1:]):  # each as it is alone, to the last bit
            size[one], slope[one] = amplitude_with_slope(b.harmonics, along[one], change[one])
            own = np.append(first[one], second[one])
            heights[own] = amplitude(b.harmonics, x[own]).value
        moving = np.abs(nodes.states[:, :-1].reshape(len(nodes.states), b.n_ports, b.L)[:, :, 1:]).max(axis=(1, 2))
        largest = np.maximum(moving[second], size.max(axis=(1, 2)))[:, None, None]
        slope[(np.abs(slope) <= _LEVEL * size) | (size <= _NOISE * largest)] = 0.0
        start = first[begins]
        pairs = [amplitude_with_slope(b.harmonics, x[i : i + 1], dx[i : i + 1]) for i in start.tolist()]
        size_here, slope_here = (np.concatenate(part) for part in zip(*pairs, strict=True))
        largest = np.maximum(moving[start], size_here.max(axis=1))[:, None]
        slope_here[(np.abs(slope_here) <= _ROUNDING * size_here) | (size_here <= _NOISE * largest)] = 0.0
        slope[begins, 0] = slope_here
        return slope, np.stack((heights[first], heights[second]), axis=1)

    def _located(self, wanted: Numbers, before: Array) -> _Located:
        """Those on the segments named, as each curve locates them alone."""
        segments, nodes = self._dense.segments, self._dense.nodes
        branch = nodes.branch[segments.first[wanted]]
        found, kinds = dict[int, list[int]](), dict[int, tuple[str, str]]()
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
            here = locator.between(first, second)
            for step in here:
                number = len(nodes.branch) + len(steps)
                found.setdefault(s, []).append(number)
                kinds[number] = step.kind, step.name
                steps.append(step)
                owners.append(owner)
        for i, (corrector, _) in locators.items():
            self._correctors.evaluations[i] += corrector.evaluations
            self._correctors.solves[i] += corrector.solves
        if steps:
            self._dense.nodes = Points.joined([nodes, self._as_points(steps, owners)])
        return _Located(nodes=found, kinds=kinds)

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
        size = request.balance.size
        metric = Metric(self._scalings[i], np.ones(size), abs(self._span[1] - self._span[0]))
        corrector = Corrector(request.system, size, metric, options.newton)
        self._besides[i] = Besides()
        peaks = peak_events(Outputs(request.balance, ()), request.peaks_of, request.system)
        events = (*((turning_points(),) if options.locate_turning_points else ()),
                  *kept_up(self._besides[i], "the place of peaks", peaks))  # fmt: skip
        return corrector, Locator(corrector, events, np.empty(0), options.event_tolerance)

    def _step(self, node: int) -> Step:
        """A node as a step of the curve alone."""
        nodes = self._dense.nodes
        state, tangent = nodes.states[node], nodes.tangents[node]
        step = Step(state, tangent, NewtonResult(state), "regular", "", state.size - 1)
        step.orientation, step.arclength = int(nodes.orientation[node]), float(nodes.arclength[node])
        step.evaluation = SimpleNamespace(detail=None)
        return step

    # points and their numbers

    def _recorded(self, located: _Located, given_up: BoolArray) -> list[Branch | None]:
        """All points in order, and the numbers of each."""
        pieces, whole, place = self._pieces(located)
        between = self._dense.points(pieces, whole)
        order = self._in_order(located, pieces, place, between)
        points, branch = self._points(order, located, pieces, between)
        values = self._values(points, branch)
        solved = np.array([p.kind != "interpolated" for p in points])
        unsolved = solved & ~(values["residual"] <= UNSOLVED)
        given_up = given_up.copy()
        given_up[branch[unsolved]] = True
        for i, besides in self._besides.items():  # what could not be told is said where a curve is alone
            given_up[i] |= bool(besides.sentences)
        ends = np.searchsorted(branch, np.arange(len(self._requests) + 1))
        seconds = (time.perf_counter() - self._clock) / len(self._requests)
        return [
            None
            if given_up[i] or ends[i] == ends[i + 1]
            else self._branch(i, slice(ends[i], ends[i + 1]), values, seconds)
            for i in range(len(self._requests))
        ]

    def _values(self, points: Sequence[Point], branch: Numbers) -> dict[str, Any]:
        """Every variable of all points, curve by curve: so they are those of each alone, to the last bit."""
        ends = np.append(np.flatnonzero(np.append(True, branch[1:] != branch[:-1])), branch.size).tolist()
        parts = []
        for begin, end in pairwise(ends):
            recorder = self._requests[int(branch[begin])].recorder()
            recorder.besides = self._besides.get(int(branch[begin]), recorder.besides)
            self._besides[int(branch[begin])] = recorder.besides
            parts.append(recorder.values(points[begin:end]))
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def _pieces(self, located: _Located) -> tuple[Segments, Numbers, Array]:
        """Segments parted at located points; of which segment each piece is all (-1: of none), and its place in it."""
        segments = self._dense.segments
        whole, place = np.arange(segments.first.size), np.zeros(segments.first.size)
        parted = np.array(sorted(located.nodes), dtype=int)
        keep = np.ones(whole.size, dtype=bool)
        keep[parted] = False
        pairs = [(s, j, a, b) for s in parted.tolist() for j, (a, b) in enumerate(pairwise(
            [int(segments.first[s]), *located.nodes[s], int(segments.second[s])]))]  # fmt: skip
        parts = segments.at(np.array([s for s, *_ in pairs], dtype=int))
        parts.first, parts.second = (np.array([pair[k] for pair in pairs], dtype=int) for k in (2, 3))
        pieces = Segments.joined([segments.at(keep), parts])
        return (
            pieces, np.append(whole[keep], np.full(len(pairs), -1)),
            np.append(place[keep], np.array([j for _, j, *_ in pairs], dtype=float)),
        )  # fmt: skip

    def _in_order(
        self, located: _Located, pieces: Segments, place: Array, between: Interpolated
    ) -> list[tuple[int, int]]:
        """Every point: (number of its node or -1, number among those between or -1)."""
        segments, nodes = self._dense.segments, self._dense.nodes
        starts = np.flatnonzero(np.append(True, nodes.branch[segments.first][1:] != nodes.branch[segments.first][:-1]))
        parts = [  # owner, low, place in the segment, node, between
            (segments.owner[starts], np.full(starts.size, -1.0), np.zeros(starts.size), segments.first[starts], None),
            (segments.owner, segments.low, np.full(segments.first.size, np.inf), segments.second, None),
            (
                pieces.owner[between.segment], pieces.low[between.segment], place[between.segment] + between.u,
                between.node, np.arange(between.u.size),
            ),
        ]  # fmt: skip
        if located.nodes:
            at = np.array([s for s, many in located.nodes.items() for _ in many])
            number = np.array([j + 1.0 for many in located.nodes.values() for j in range(len(many))])
            nodes_here = np.array([n for many in located.nodes.values() for n in many])
            parts.append((segments.owner[at], segments.low[at], number, nodes_here, None))
        keys = [np.concatenate([part[k] for part in parts]) for k in range(3)]
        node = np.concatenate([part[3] for part in parts])
        number = np.concatenate([np.full(part[3].size, -1) if part[4] is None else part[4] for part in parts])
        order = np.lexsort((keys[2], keys[1], keys[0]))
        return list(zip(node[order].tolist(), number[order].tolist(), strict=True))

    def _points(
        self, order: Sequence[tuple[int, int]], located: _Located, pieces: Segments, between: Interpolated
    ) -> tuple[list[Point], Numbers]:
        """Points of all curves, each with what is known of it; whose each is."""
        nodes, segments, requests = self._dense.nodes, self._dense.segments, self._requests
        others = nodes.branch[segments.first][1:] != nodes.branch[segments.first][:-1]
        firsts = set(segments.first[np.append(True, others)].tolist())
        lasts = set(segments.second[np.append(others, True)].tolist())
        inverses: dict[int, _Inverse] = {}

        def inverse(node: int) -> _Inverse:
            if node not in inverses:
                inverses[node] = _Inverse(nodes.inverse[node])
            return inverses[node]

        def bend(first: int, second: int) -> float:
            length = abs(nodes.arclength[second] - nodes.arclength[first])
            return float(nodes.tangents[second, -1] - nodes.tangents[first, -1]) / length if length else 0.0

        points, branch, before = list[Point](), list[int](), -1
        for node, number in order:
            if node >= 0:
                i, z, tangent = int(nodes.branch[node]), nodes.states[node], nodes.tangents[node]
                kind, name = located.kinds.get(
                    node, ("start" if node in firsts else "end" if node in lasts else "regular", "")
                )
                bent = np.inf if kind in FOLDS else 0.0 if kind == "start" else bend(before, node)
                reaction = Reaction(inverse(node), tangent, bent)  # type: ignore[arg-type]
                before, iterations = node, int(nodes.iterations[node])
            else:
                piece = int(between.segment[number])
                first, second = int(pieces.first[piece]), int(pieces.second[piece])
                i, z, tangent = int(nodes.branch[first]), between.states[number], between.tangents[number]
                kind, name, iterations = "interpolated", "", 0
                reaction = Reaction(inverse(second), tangent, bend(first, second))  # type: ignore[arg-type]
            parameter = float(z[-1])
            points.append(Point.at(
                unanswered(requests[i].inputs, parameter), x=z[:-1], residual=np.nan, iterations=iterations, kind=kind,
                parameter=parameter, peak_of=name if kind == "peak" else "", reaction=reaction,
            ))  # fmt: skip
            branch.append(i)
        return points, np.array(branch)

    def _branch(self, i: int, which: slice, values: Mapping[str, Any], seconds: float) -> Branch:
        """The branch of one request."""
        request, own = self._requests[i], {name: value[which] for name, value in values.items()}
        x = own["omega"]
        segment = Segment(number=1, start=request.start, stop=request.stop, points=len(x), outcome=Outcome.COMPLETED)
        outcome, message = joined([segment])
        said = [*request.warnings, *request.doubts(own)]
        work = {
            "parts": 1, "evaluations": int(self._correctors.evaluations[i]),
            "linear_solves": int(self._correctors.solves[i]), "rejected_steps": int(self._rejected[i]),
        }  # fmt: skip
        attributes = attributes_of(
            request.problem, outcome, message, said, parameter="", **work, peaks_of="\n".join(request.peaks_of),
            largest_of="", seconds=seconds, jacobian=request.balance.backend.name,
        )  # fmt: skip
        return Branch(make_table(self._layout, own, attributes), outcome, request.problem, message)


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


def _plain(
    ends: Array, heights: Array, measures: Measures, segments: Segments, nodes: Points, cubics: Cubics
) -> BoolArray:
    """``Maxima._plain`` of every segment, with the slopes and heights (n, 2) at both ends."""
    before = ends[:, 0] / measures.lengths(nodes.tangents[segments.first])
    after = ends[:, 1] / measures.lengths(nodes.tangents[segments.second])
    gain, length = heights[:, 1] - heights[:, 0], cubics.length
    hidden = np.minimum(
        np.abs(gain - 0.5 * length * (before + after)), np.maximum(np.abs(before), np.abs(after)) * length
    )
    steady = np.minimum(before * gain, after * gain) > 0.0
    limit = np.maximum(_HIDDEN * heights.max(axis=1), np.where(steady, _STEADY * np.abs(gain), 0.0))
    return np.asarray(hidden <= limit)
