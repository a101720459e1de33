"""Many curves of one form followed together: the same points, peaks and warnings as each alone, in less time.

Steps (``solve/continuation/lockstep.py``) and what lies between them (``lockstep_output.py``) are computed for all
curves at once, and so are their peaks and turning points (``lockstep_events.py``) where these are plain. A curve on
which anything is out of the ordinary is left to be followed alone.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from slipstick.analysis.curve.follow import CurveRequest
from slipstick.analysis.curve.lockstep_events import Events, Located
from slipstick.analysis.curve.segments import Segment, joined
from slipstick.analysis.curve.state_continuation import FOLDS, UNSOLVED
from slipstick.balance.evaluation import FrequencySystem, evaluated_together
from slipstick.balance.many import ManyBalances, same_form
from slipstick.balance.scaling import scales
from slipstick.balance.start import FirstPoint
from slipstick.contact.friction_law import is_friction
from slipstick.errors import Outcome
from slipstick.results.record import Columns, Outputs
from slipstick.results.schema import LARGEST, POINT_KINDS, attributes_of, make_table
from slipstick.results.solutions import Solutions
from slipstick.results.truncation import at_their_parameter
from slipstick.solve.continuation.lockstep import Correctors, Factors, Numbers, follow
from slipstick.solve.continuation.lockstep_output import Interpolated, Segments
from slipstick.solve.continuation.lockstep_output import Outputs as DenseOutputs
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.linear.factorisation import one_blas_thread
from slipstick.typing import Array, BoolArray, IntArray

MOST_UNKNOWNS = 70
"""Number of unknowns up to which a curve is followed with others; the number of contacts matters little.

The limit does not depend on the number of curves: last digits of a case would depend on the workers that share the
cases. Processor time in lockstep over that of each alone, of chains of oscillators with one contact each
(``benchmarks/ensembles.py sizes``):

========  ========  ========  ========  ========  =========  =========
unknowns  contacts  2 curves  4 curves  8 curves  16 curves  64 curves
========  ========  ========  ========  ========  =========  =========
21        1         0.89      0.56                0.28       0.19
42        2         0.97      0.84                0.44
49        7                   0.88                0.67
55        5                                       0.66
63        3         1.32      0.85      0.72      0.69       0.60
84        4                   1.17      1.03      0.81
105       5                                       1.05       0.92
168       8                                       1.34
========  ========  ========  ========  ========  =========  =========
"""
MOST_CURVES = 256
"""Largest number of curves together: each of twice as many takes hardly less time."""
_JACOBIAN_ENTRIES = 25_000_000
"""Largest number of entries in the Jacobians of all points of curves together."""
_EXPECTED_POINTS = 80
"""Expected number of steps of a curve."""
_RECORDED_TOGETHER = 1000
"""Number of points whose contact variables are computed together: they need much memory."""
_KINDS = f"U{max(map(len, POINT_KINDS))}"


def in_lockstep(request: CurveRequest) -> bool:
    """Whether a curve can be followed with others; further requests need each point by itself."""
    balance = request.balance
    return (
        isinstance(request.system, FrequencySystem)
        and evaluated_together(balance)
        and all(is_friction(batch.law) for batch in balance.batches)
        and balance.size <= MOST_UNKNOWNS
        and request.options.adapt_harmonics is None
        and request.stability is None
        and request.guess is None
        and request.starting_point is None
        and not (request.requested or request.checkpoints or request.largest_of or request.listeners)
        and request.peaks_of != (LARGEST,)
        and not Outputs(balance, balance.problem.outputs or ()).far
    )


def most_together(request: CurveRequest) -> int:
    """Largest number of such curves together."""
    return max(1, min(MOST_CURVES, _JACOBIAN_ENTRIES // (_EXPECTED_POINTS * (request.balance.size + 1) ** 2)))


def alike(first: CurveRequest, other: CurveRequest) -> bool:
    """Whether two curves can be followed together."""
    return (
        same_form(first.balance, other.balance)
        and (first.start, first.stop, first.peaks_of) == (other.start, other.stop, other.peaks_of)
        and first.options == other.options
    )


@dataclass(frozen=True, kw_only=True)
class _Reactions:
    """A ``Reaction`` of each point: numbers of ``factors`` (n,), tangents (n, N + 1) and bends (n,)."""

    factors: Factors
    near: Numbers
    tangents: Array
    bends: Array

    @property
    def known(self) -> BoolArray:
        return np.ones(self.near.size, dtype=bool)

    def at(self, which: Any) -> _Reactions:
        return replace(self, near=self.near[which], tangents=self.tangents[which], bends=self.bends[which])

    def across(self, which: IntArray, residuals: Array) -> Array:
        k, N, r = residuals.shape
        right = residuals.swapaxes(1, 2).reshape(k * r, N)
        z = self.factors.solve(np.repeat(self.near[which], r), right)[:, :-1]
        return z.reshape(k, r, N).swapaxes(1, 2)

    def answers(self, which: IntArray, residuals: Array) -> Array:
        z = self.factors.solve(self.near[which], residuals)
        return at_their_parameter(z, self.tangents[which], self.bends[which])


class Lockstep:
    """Runs of curves together; they must be ``alike``."""

    def __init__(self, requests: Sequence[CurveRequest]) -> None:
        self._requests, self._first = list(requests), requests[0]
        self._span = self._first.start, self._first.stop
        self._clock = time.perf_counter()

    def branches(self) -> list[Solutions | None]:
        """The solutions of each request, with warnings that are not issued; None for curves to be followed alone."""
        with one_blas_thread():
            return self._branches()

    def _branches(self) -> list[Solutions | None]:
        requests = self._requests
        started = [FirstPoint(r.balance, r.inputs, r.omega).find() for r in requests]
        kept = [i for i, x in enumerate(started) if x is not None]
        out: list[Solutions | None] = [None] * len(requests)
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
        self._correctors = Correctors(self._systems, len(requests), x.shape[1], options.newton)
        together = replace(self._scalings[0], x=None)
        metric = Metric(together, x, span, np.array([s.displacement for s in scaling]))
        followed = follow(self._correctors, x, self._span, metric, options)
        self._rejected = followed.rejected
        if not followed.points.branch.size:
            return out
        self._dense = DenseOutputs(self._systems, self._correctors, followed.points, self._span, options)
        events = Events(requests, self._scalings, self._correctors, self._dense)
        located, self._postprocessing = events.located(), events.postprocessing
        return self._recorded(located, followed.given_up | self._correctors.doubtful | self._dense.lost)

    # points and their numbers

    def _recorded(self, located: Located, given_up: BoolArray) -> list[Solutions | None]:
        """Solutions from all points in order."""
        pieces, whole, place = self._pieces(located)
        between = self._dense.points(pieces, whole)
        points = self._points(*self._in_order(located, pieces, place, between), located, pieces, between)
        ends = np.searchsorted(points.inputs.which, np.arange(len(self._requests) + 1)).tolist()
        given_up = given_up.copy()
        for i, postprocessing in self._postprocessing.items():  # a curve that is followed alone names the failure
            given_up[i] |= bool(postprocessing.failures)
        values = [value for curves in self._portions(ends) for value in self._values(points, curves, ends)]
        seconds = (time.perf_counter() - self._clock) / len(self._requests)
        return [
            None if given_up[i] or own is None or not len(own["kind"]) else self._branch(i, own, seconds)
            for i, own in enumerate(values)
        ]

    def _portions(self, ends: Sequence[int]) -> Iterator[range]:
        """Groups of successive curves of one structure, with about a thousand points each."""
        structure, first = self._systems.structure.tolist(), 0
        for i in range(1, len(structure) + 1):
            if (
                i == len(structure)
                or structure[i] != structure[first]
                or ends[i + 1] - ends[first] > _RECORDED_TOGETHER
            ):
                yield range(first, i)
                first = i

    def _values(self, points: Columns, curves: range, ends: Sequence[int]) -> list[dict[str, Any] | None]:
        """Every variable of successive curves; None for curves with a failure or a point that is no solution.

        No value depends on the grouping.
        """
        begin, end = ends[curves[0]], ends[curves[-1] + 1]
        recorder = self._requests[curves[0]].recorder()
        values = recorder.values_of(points.at(np.arange(begin, end)))
        if recorder.postprocessing.failures:
            return [None] if len(curves) == 1 else [self._values(points, range(i, i + 1), ends)[0] for i in curves]
        unsolved = (values["kind"] != "interpolated") & ~(values["residual"] <= UNSOLVED)
        parts = [slice(ends[i] - begin, ends[i + 1] - begin) for i in curves]
        return [
            None if unsolved[part].any() else {name: value[part] for name, value in values.items()} for part in parts
        ]

    def _pieces(self, located: Located) -> tuple[Segments, Numbers, Array]:
        """Pieces of segments between located points, and of each the segment that it is (-1: a part) and its place."""
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
    ) -> tuple[Numbers, Numbers]:
        """Number of the node of every point or -1, and its number among interpolated points or -1."""
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
        return node[order], number[order]

    def _points(
        self, node: Numbers, number: Numbers, located: Located, pieces: Segments, between: Interpolated
    ) -> Columns:
        """Columns of the points of all curves, in the order of ``_in_order``."""
        nodes, solved, count = self._dense.nodes, node >= 0, node.size
        other = number[~solved]
        piece = between.segment[other]
        states, tangents = (np.empty((count, nodes.states.shape[1])) for _ in range(2))
        states[solved], states[~solved] = nodes.states[node[solved]], between.states[other]
        tangents[solved], tangents[~solved] = nodes.tangents[node[solved]], between.tangents[other]
        near, before = node.copy(), np.empty(count, dtype=int)
        near[~solved], before[~solved] = pieces.second[piece], pieces.first[piece]
        before[solved] = np.append(node[:1], node[solved][:-1])
        branch = nodes.branch[near]
        kind = np.where(solved, "regular", "interpolated").astype(_KINDS)
        begins = np.append(True, branch[1:] != branch[:-1])
        kind[begins], kind[np.append(begins[1:], True)] = "start", "end"
        peak_of = [""] * count
        place = np.full(len(nodes.branch), -1)
        place[node[solved]] = np.flatnonzero(solved)
        for one, (what, name) in located.kinds.items():
            kind[place[one]] = what
            peak_of[place[one]] = name if what == "peak" else ""
        length = np.abs(nodes.arclength[near] - nodes.arclength[before])
        turned = nodes.tangents[near, -1] - nodes.tangents[before, -1]
        bends = np.divide(turned, length, out=np.zeros(count), where=length > 0.0)
        bends[begins], bends[np.isin(kind, FOLDS)] = 0.0, np.inf
        return Columns(
            x=states[:, :-1], omega=states[:, -1], parameter=states[:, -1], residual=np.full(count, np.nan),
            iterations=np.where(solved, nodes.iterations[node], 0), kind=kind, peak_of=peak_of,
            part=np.ones(count, dtype=int), inputs=self._systems.inputs.at(branch),
            reactions=_Reactions(
                factors=self._correctors.factors, near=nodes.factors[near], tangents=tangents, bends=bends
            ),
        )  # fmt: skip

    def _branch(self, i: int, own: Mapping[str, Any], seconds: float) -> Solutions:
        """The solutions of one request from its variables."""
        request, points = self._requests[i], len(own["omega"])
        segment = Segment(number=1, start=request.start, stop=request.stop, points=points, outcome=Outcome.COMPLETED)
        outcome, message = joined([segment])
        said = [*request.warnings, *request.value_warnings(own)]
        work: dict[str, Any] = {
            "parts": 1, "evaluations": int(self._correctors.evaluations[i]),
            "linear_solves": int(self._correctors.solves[i]), "rejected_steps": int(self._rejected[i]),
        }  # fmt: skip
        attributes = attributes_of(
            request.problem, outcome, message, said, analysis=request.analysis, **work,
            peaks_of="\n".join(request.peaks_of), largest_of="", seconds=seconds, jacobian=request.balance.backend.name,
        )  # fmt: skip
        return Solutions(make_table(self._layout, own, attributes), outcome, request.problem, message)
