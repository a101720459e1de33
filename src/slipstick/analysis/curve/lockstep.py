"""Many curves of one form followed side by side: the same points, peaks and warnings as each alone, for less time.

Steps (``solve/continuation/lockstep.py``) and what lies between them (``lockstep_output.py``) are computed for all
curves at once, and so are their peaks and turning points (``lockstep_events.py``) where these are plain. A curve on
which anything is out of the ordinary is left to be followed alone.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from slipstick.analysis.curve.follow import CurveRequest
from slipstick.analysis.curve.lockstep_events import Events, Located
from slipstick.analysis.curve.request import adapted_to
from slipstick.analysis.curve.segments import Segment, joined
from slipstick.analysis.curve.state_continuation import FOLDS, UNSOLVED
from slipstick.balance.batch_evaluation import evaluated_together
from slipstick.balance.many import ManyBalances, same_form
from slipstick.balance.residual import unanswered
from slipstick.balance.scaling import scales
from slipstick.balance.start import FirstPoint
from slipstick.balance.systems import FrequencySystem
from slipstick.branch import Branch
from slipstick.contact.friction_law import is_friction
from slipstick.errors import Outcome
from slipstick.results.record import Outputs, Point
from slipstick.results.schema import LARGEST, attributes_of, make_table
from slipstick.results.truncation import Reaction
from slipstick.solve.continuation.lockstep import Correctors, Measures, Numbers, follow
from slipstick.solve.continuation.lockstep_output import Interpolated, Segments
from slipstick.solve.continuation.lockstep_output import Outputs as DenseOutputs
from slipstick.solve.linear.factorisation import one_blas_thread
from slipstick.typing import Array, BoolArray

MOST_UNKNOWNS = 120
"""Unknowns up to which a curve is followed with others: of more, the work of one fills a processor anyway."""
MOST_CURVES = 256
"""So many are followed side by side: of twice as many each takes hardly less time."""
_ROOM = 25_000_000
"""Numbers that the Jacobians of all points of curves side by side may hold."""
_POINTS = 80
"""Points that a curve is expected to be stepped to."""


def in_lockstep(request: CurveRequest) -> bool:
    """Whether a curve can be followed with others: what is asked besides is found point by point."""
    balance = request.balance
    return (
        isinstance(request.system, FrequencySystem)
        and evaluated_together(balance)
        and all(is_friction(batch.law) for batch in balance.batches)
        and balance.size <= MOST_UNKNOWNS
        and adapted_to(request.options) is None
        and request.stability is None
        and request.guess is None
        and request.departure is None
        and not (request.requested or request.checkpoints or request.largest_of or request.listeners)
        and request.peaks_of != (LARGEST,)
        and not Outputs(balance, balance.problem.outputs or ()).far
    )


def most_together(request: CurveRequest) -> int:
    """How many such curves are followed side by side."""
    return max(1, min(MOST_CURVES, _ROOM // (_POINTS * (request.balance.size + 1) ** 2)))


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


class Lockstep:
    """Curves under way together; they must be ``alike``."""

    def __init__(self, requests: Sequence[CurveRequest]) -> None:
        self._requests, self._first = list(requests), requests[0]
        self._span = self._first.start, self._first.stop
        self._clock = time.perf_counter()

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
        followed = follow(self._correctors, x, self._span, measures, options)
        self._rejected = followed.rejected
        if not followed.points.branch.size:
            return out
        self._dense = DenseOutputs(self._systems, self._correctors, followed.points, self._span, options)
        events = Events(requests, self._scalings, self._correctors, self._dense)
        located, self._besides = events.located(), events.besides
        return self._recorded(located, followed.given_up | self._correctors.doubtful)

    # points and their numbers

    def _recorded(self, located: Located, given_up: BoolArray) -> list[Branch | None]:
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

    def _pieces(self, located: Located) -> tuple[Segments, Numbers, Array]:
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
        self, located: Located, pieces: Segments, place: Array, between: Interpolated
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
        self, order: Sequence[tuple[int, int]], located: Located, pieces: Segments, between: Interpolated
    ) -> tuple[list[Point], Numbers]:
        """Points of all curves, each with what is known of it; whose each is."""
        nodes, segments, requests = self._dense.nodes, self._dense.segments, self._requests
        others = nodes.branch[segments.first][1:] != nodes.branch[segments.first][:-1]
        firsts = set(segments.first[np.append(True, others)].tolist())
        lasts = set(segments.second[np.append(others, True)].tolist())
        inverses: dict[int, _Inverse] = {}
        whose, arclength, rates = (part.tolist() for part in (nodes.branch, nodes.arclength, nodes.tangents[:, -1]))
        ends = list(zip(*(part[between.segment].tolist() for part in (pieces.first, pieces.second)), strict=True))

        def inverse(node: int) -> _Inverse:
            if node not in inverses:
                inverses[node] = _Inverse(nodes.inverse[node])
            return inverses[node]

        def bend(first: int, second: int) -> float:
            length = abs(arclength[second] - arclength[first])
            return float((rates[second] - rates[first]) / length) if length else 0.0

        points, branch, before = list[Point](), list[int](), -1
        for node, number in order:
            if node >= 0:
                i, z, tangent = whose[node], nodes.states[node], nodes.tangents[node]
                kind, name = located.kinds.get(
                    node, ("start" if node in firsts else "end" if node in lasts else "regular", "")
                )
                bent = np.inf if kind in FOLDS else 0.0 if kind == "start" else bend(before, node)
                reaction = Reaction(inverse(node), tangent, bent)  # type: ignore[arg-type]
                before, iterations = node, int(nodes.iterations[node])
            else:
                first, second = ends[number]
                i, z, tangent = whose[first], between.states[number], between.tangents[number]
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
