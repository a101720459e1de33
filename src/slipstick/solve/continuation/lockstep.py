"""Many branches followed in lockstep: the continuation of ``follow.py`` with one evaluation per round for all of them.

Each branch takes the steps that it would take alone: metric, segment, predictor, step control and acceptance are the
same formulas, on arrays whose first axis is the branch. This file only takes the decisions, by masks. No number of one
branch depends on another, to the last bit: sums and products of matrices are those of one branch each.
A branch is ``given_up``, and followed by a continuation of its own, where it turns back at its start, where steps fail
or meet a corner, and where a solution converges to rounding level only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol, Self

import numpy as np
from numpy import ndarray
from numpy.typing import NDArray

from slipstick.solve.continuation.corrector import patient
from slipstick.solve.continuation.hermite_segment import HermiteSegment
from slipstick.solve.continuation.metric import Metric, angle_of, dots, norms
from slipstick.solve.continuation.step_control import (
    CUBIC_ORDER,
    SCALE_CHANGE,
    TANGENT_ORDER,
    ContinuationOptions,
    Span,
    along_tangent,
    cubic_distance,
    is_cubic_valid,
    is_far,
    is_kink,
    is_short,
    max_distance,
    next_step,
    place_ahead,
    shortened,
)
from slipstick.solve.newton import NewtonOptions, gains, is_clear_gain, may_be_taken_whole, stalls
from slipstick.typing import Array, BoolArray


class Table:
    """A dataclass of arrays of equal length, and of other things with rows: tables, metrics."""

    def at(self, which: Any) -> Self:
        """Some of the rows."""
        columns = vars(self).items()
        return type(self)(
            **{name: part[which] if isinstance(part, ndarray) else part.at(which) for name, part in columns}
        )

    def put(self, which: Any, those: Self) -> None:
        """Replace some of the rows, in place."""
        for name, part in vars(self).items():
            new = getattr(those, name)
            if isinstance(part, ndarray):
                part[which] = new
            else:
                part.put(which, new)

    @classmethod
    def joined(cls, tables: Sequence[Self]) -> Self:
        """The rows of several, one after the other."""
        return cls(**{name: _joined([vars(table)[name] for table in tables]) for name in vars(tables[0])})


def _joined(parts: Sequence[Any]) -> Any:
    return np.concatenate(parts) if isinstance(parts[0], ndarray) else type(parts[0]).joined(parts)


_ROUNDING = 1e-10
"""Residual over the solution below which a failed iteration may have met rounding."""
_ROUNDING_CORRECTION = 1e-3
"""Largest scaled correction of such an iteration, as in ``newton``."""
_CORNER_STEP = 4.0
"""Failed step, over ``kink_step``, at which a branch is given up: a continuation of its own looks for a corner."""

Numbers = NDArray[np.intp]


class Systems(Protocol):
    """Systems of n branches, N equations each."""

    def evaluate(self, branches: Numbers, states: Array) -> tuple[Array, Array]:
        """Residuals (k, N) and derivatives by the state (k, N, N + 1) at states (k, N + 1); nan where none are."""
        ...


@cache
def _linear() -> Any:
    """The compiled factorisations, imported with the first step: that takes time."""
    from slipstick.solve.linear import many_factors

    return many_factors


class Factors:
    """Factors of the bordered Jacobians of many points, numbered in one array."""

    def __init__(self, size: int) -> None:
        self._array, self._count = np.empty((0, size + 1, size)), 0

    def of(self, matrices: Array) -> Numbers:
        """Add the factors of matrices (k, size, size); their numbers."""
        factors = np.empty((len(matrices), *self._array.shape[1:]))
        factors[:, :-1] = matrices
        _linear().factorise(factors)
        return self.add(factors)

    def add(self, factors: Array, which: Numbers | None = None) -> Numbers:
        """Add factors (k, size + 1, size), or only ``which`` of them; their numbers."""
        which = np.arange(len(factors)) if which is None else which
        begin, end = self._count, self._count + which.size
        if end > len(self._array):
            array = np.empty((max(end, 2 * len(self._array)), *self._array.shape[1:]))  # memory once it is written to
            array[:begin] = self._array[:begin]
            self._array = array
        np.take(factors, which, axis=0, out=self._array[begin:end], mode="clip")
        self._count = end
        return np.arange(begin, end)

    def solve(self, which: Numbers, right: Array) -> Array:
        """Solutions (k, size) for right-hand sides (k, m), zero beyond their ends."""
        return np.asarray(_linear().solutions(self._array, which, right))


@dataclass(kw_only=True)
class Solutions(Table):
    """Solutions of k branches.

    Attributes
    ----------
    states, tangents
        (k, N + 1).
    orientation, iterations
        As of ``Step``, (k,).
    """

    states: Array
    tangents: Array
    orientation: NDArray[np.int_]
    iterations: NDArray[np.int_]

    def columns(self, which: Any) -> dict[str, Any]:
        """The columns of some rows, for a table with more columns."""
        return {name: vars(self)[name][which] for name in Solutions.__dataclass_fields__}


@dataclass(kw_only=True)
class Solved(Solutions):
    """Results of k iterations; rows that are not ``found`` are undefined.

    Attributes
    ----------
    factors
        Of the bordered Jacobians (k, N + 2, N + 1), see ``many_factors.py``.
    contraction, stagnated
        As of ``NewtonResult``, (k,).
    """

    factors: Array
    found: BoolArray
    contraction: Array
    stagnated: BoolArray


class Correctors:
    """The bordered Newton iteration of ``Corrector`` for many branches at once.

    Attributes
    ----------
    evaluations, solves
        Evaluations and linear solves so far, by branch (n,).
    doubtful
        Branches (n,) on which a failed iteration may have met rounding.
    factors
        Of the bordered Jacobians of accepted points.
    """

    def __init__(self, systems: Systems, count: int, size: int, options: NewtonOptions) -> None:
        self._systems, self._options = systems, options
        self.patient = patient(options)
        self.evaluations, self.solves = np.zeros(count, dtype=int), np.zeros(count, dtype=int)
        self.doubtful = np.zeros(count, dtype=bool)
        self.factors = Factors(size + 1)

    def correct(
        self, branches: Numbers, guess: Array, normal: Array, fixed: BoolArray, metric: Metric, *,
        forward: Array, max_distance: Array | None = None, options: NewtonOptions | None = None,
    ) -> Solved:  # fmt: skip
        """As ``Corrector.correct``: on the planes through ``guess`` across ``normal``, or where ``fixed`` at its
        parameter, the tangent then along ``forward``."""
        row = _row(normal, metric)
        row[fixed] = 0.0
        row[fixed, -1] = 1.0
        solved = self._iterated(branches, guess, row, metric, options or self._options, max_distance)
        states, found = solved.states, solved.found
        states[fixed, -1] = guess[fixed, -1]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            last = np.zeros_like(states)
            last[:, -1] = 1.0
            solved.tangents = _linear().solutions(solved.factors, np.arange(len(last)), last)
            solved.tangents /= metric.length(solved.tangents)[:, None]
        self.solves += np.bincount(branches[found], minlength=self.solves.size)
        some = np.flatnonzero(found)
        solved.orientation = np.ones(len(guess), dtype=int)
        if some.size:
            solved.orientation[some] = _linear().signs(solved.factors[some]).astype(int)
            back = some[fixed[some] & (metric.at(some).cosine(solved.tangents[some], forward[some]) < 0.0)]
            solved.tangents[back] *= -1.0
            solved.orientation[back] *= -1
        return solved

    def keep(self, branches: Numbers, states: Array, normal: Array, metric: Metric) -> Numbers:
        """Add the factors at solutions across ``normal`` that become points; their numbers."""
        row = _row(normal, metric)
        return self.factors.add(self._bordered(branches, states, row, dots(row, states))[1])

    def _bordered(self, branches: Numbers, z: Array, row: Array, level: Array) -> tuple[Array, Array]:
        """Residuals (k, N + 1) and factors of the Jacobians (k, N + 2, N + 1)."""
        N = z.shape[1] - 1
        residual, jacobian = np.empty_like(z), np.empty((len(z), N + 2, N + 1))
        residual[:, :N], jacobian[:, :N] = self._systems.evaluate(branches, z)
        residual[:, N], jacobian[:, N] = dots(row, z) - level, row
        self.evaluations += np.bincount(branches, minlength=self.evaluations.size)
        _linear().factorise(jacobian)
        return residual, jacobian

    def _iterated(
        self, branches: Numbers, guess: Array, row: Array, metric: Metric, options: NewtonOptions,
        max_distance: Array | None,
    ) -> Solved:  # fmt: skip
        """``newton.iterate`` on each."""
        count, level = len(guess), dots(row, guess)
        z = guess.copy()
        residual, factors = self._bordered(branches, z, row, level)
        found, stagnated = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
        iterations, contraction = np.zeros(count, dtype=int), np.zeros(count)
        allowance, sizes = np.full(count, options.non_monotone), np.full((3, count), np.nan)
        live = np.arange(count)
        while live.size:
            step = _linear().solutions(factors, live, residual[live])
            size = norms(step * metric.inverse[live])
            self.solves += np.bincount(branches[live], minlength=self.solves.size)
            sizes[:, live] = size, sizes[0, live], sizes[1, live]
            done = size <= options.tolerance
            with np.errstate(invalid="ignore"):
                stalled = stalls(*sizes[:, live])
            rounded = ~done & stalled & (size <= options.stagnation)
            lost = ~done & ~rounded & (~np.isfinite(size) | (iterations[live] >= options.max_iterations))
            self._mark_doubtful(branches, live[lost], z, residual, size[lost])
            if max_distance is not None:
                first = iterations[live] == 0
                lost |= first & ~done & ~rounded & ~(metric.at(live).length(step) <= max_distance[live])
            found[live[done | rounded]], stagnated[live[rounded]] = True, True
            on = ~(done | rounded | lost)
            live, step, size = live[on], step[on], size[on]
            if live.size:
                taken = self._searched(
                    branches, live, step, size, (z, residual, factors), (row, level), metric, options, allowance,
                    contraction, iterations,
                )  # fmt: skip
                live = live[taken]
        return Solved(
            states=z, tangents=z, factors=factors, found=found, orientation=iterations, iterations=iterations,
            contraction=contraction, stagnated=stagnated,
        )  # fmt: skip

    def _searched(
        self, branches: Numbers, live: Numbers, step: Array, size: Array, at: tuple[Array, Array, Array],
        plane: tuple[Array, Array], metric: Metric, options: NewtonOptions, allowance: NDArray[np.int_],
        contraction: Array, iterations: NDArray[np.int_],
    ) -> BoolArray:  # fmt: skip
        """``newton.line_search`` of each; whether a correction was taken."""
        z, residual, factors = at

        def tried(which: Numbers, damping: float) -> tuple[Array, Array, Array, Array]:
            i = live[which]
            trial = z[i] - damping * step[which]
            R, V = self._bordered(branches[i], trial, plane[0][i], plane[1][i])
            with np.errstate(invalid="ignore", over="ignore"):
                natural = norms(_linear().solutions(factors, i, R) * metric.inverse[i]) / size[which]
            finite = np.isfinite(norms(R))
            self.solves += np.bincount(branches[i[finite]], minlength=self.solves.size)
            return trial, R, V, np.where(finite, natural, np.inf)

        every = np.arange(live.size)
        trial, R, V, natural = tried(every, 1.0)
        first = iterations[live] == 0
        contraction[live[first]] = natural[first]
        good = is_clear_gain(natural, size, options)
        rest = np.flatnonzero(~good)
        self._mark_doubtful(branches, live[rest], z, residual, size[rest])
        if rest.size:
            best, taken = natural[rest].copy(), rest
            usable, damping = may_be_taken_whole(natural[rest]), 0.5
            trials = [array[rest].copy() for array in (trial, R, V)]
            while damping >= options.min_damping and taken.size:
                place = np.searchsorted(rest, taken)
                *more, natural_here = tried(taken, damping)
                better = natural_here < best[place]
                for kept, new in zip(trials, more, strict=True):
                    kept[place[better]] = new[better]
                best[place[better]] = natural_here[better]
                taken = taken[better | ~gains(best[place], damping)]
                damping *= 0.5
            whole = ~gains(best, options.min_damping) & usable & (allowance[live[rest]] > 0)
            allowance[live[rest[whole]]] -= 1
            better = ~whole & (best < 1.0)
            for kept, full in zip(trials, (trial, R, V), strict=True):
                full[rest[better]] = kept[better]
            good[rest] = whole | better
        took = live[good]
        z[took], residual[took], factors[took] = trial[good], R[good], V[good]
        iterations[took] += 1
        return good

    def _mark_doubtful(self, branches: Numbers, which: Numbers, z: Array, residual: Array, size: Array) -> None:
        """Mark failed iterations that may have met rounding before their tolerance."""
        near = which[size < _ROUNDING_CORRECTION]
        rounding = norms(residual[near]) <= _ROUNDING * norms(z[near])
        self.doubtful[branches[near[rounding]]] = True


def _row(normal: Array, metric: Metric) -> Array:
    """The rows (k, N + 1) that border Jacobians, of planes across ``normal``."""
    row = normal * metric.weights * metric.weights
    return np.asarray(row / np.abs(row).max(axis=1)[:, None])


@dataclass(kw_only=True)
class Points(Solutions):
    """Points that were stepped to, branch after branch, each in order.

    Attributes
    ----------
    branch
        Number of the branch of each, (p,).
    arclength
        As of ``Step``.
    factors
        Numbers of the factors of the bordered Jacobians among ``Correctors.factors``.
    apart
        As of ``Step``; infinite of a first point.
    metric
        Metric of the step after each.
    """

    branch: Numbers
    factors: Numbers
    arclength: Array
    apart: Array
    metric: Metric


@dataclass(kw_only=True)
class Followed:
    """Points, branches (n,) that were given up, and numbers of rejected steps (n,)."""

    points: Points
    given_up: BoolArray
    rejected: NDArray[np.int_]


def follow(
    correctors: Correctors, x: Array, ends: tuple[float, float], metric: Metric, options: ContinuationOptions
) -> Followed:
    """Follow n branches through ``x`` (n, N) over the same range of the parameter, as ``Continuation`` does each."""
    span = Span(*ends)
    n, size = len(x), x.shape[1] + 1
    everyone = np.arange(n)
    rejected, given_up = np.zeros(n, dtype=int), np.zeros(n, dtype=bool)
    ahead = np.zeros((n, size))
    ahead[:, -1] = span.stop - span.start
    first = _first(correctors, everyone, np.column_stack((x, np.full(n, span.start))), metric, ahead)
    given_up |= ~first.found
    metric.put(everyone, metric.renewed(first.states[:, :-1]))
    z, tangent, orientation = first.states, first.tangents, first.orientation
    step_length = np.full(n, min(options.first_step, options.max_step))
    nothing = np.zeros((n, size))
    segments = HermiteSegment(nothing, nothing, nothing, nothing, np.ones(n), rates=(np.ones(n), np.ones(n)))
    curved, arclength, length = np.zeros(n, dtype=bool), np.zeros(n), step_length.copy()
    order = np.full(n, TANGENT_ORDER)
    found = np.flatnonzero(first.found)
    accepted = [_points_of(correctors.factors, first, everyone, found, metric, arclength, np.full(found.size, np.inf))]
    count, live = np.ones(n, dtype=int), np.flatnonzero(first.found)
    while live.size:
        here, last, along, step = metric.at(live), z[live], tangent[live], length[live]
        guess, direction, at_end, back = _predicted(here, last, along, segments.at(live), curved[live], step, span)
        limit = max_distance(options, step)
        solved = correctors.correct(live, guess, direction, at_end, here, forward=along, max_distance=limit)
        with np.errstate(invalid="ignore"):
            accept = _accepted(here, last, along, orientation[live], solved, guess, step, at_end, span, options)
            good = solved.found & accept
        new = live[good]
        if new.size:
            those, measured = solved.states[good], here.at(good)
            off = cubic_distance(measured, (those, solved.tangents[good]), (guess[good], direction[good]), step[good])
            turned = angle_of(measured.cosine(along[good], solved.tangents[good]))
            arclength[new] += measured.length(those - last[good])
            rounded = solved.stagnated[good]  # at rounding level neither depends on the step
            step_length[new] = next_step(
                step[good], contraction=np.where(rounded, 0.0, solved.contraction[good]),
                iterations=np.where(rounded, 0, solved.iterations[good]), angle=turned, order=order[new],
                options=options,
            )  # fmt: skip
            ends_here = (last[good], along[good]), (those, solved.tangents[good])
            segments.put(new, HermiteSegment.of(measured, *ends_here, turned))
            curved[new] = turned <= options.max_angle
            order[new] = np.where(curved[new], CUBIC_ORDER, TANGENT_ORDER)
            z[new], tangent[new], orientation[new] = those, solved.tangents[good], solved.orientation[good]
            metric.put(new, measured.renewed(those[:, :-1]))
            taken = np.flatnonzero(good)
            accepted.append(_points_of(correctors.factors, solved, live, taken, metric, arclength, off))
            count[new] += 1
            length[new] = step_length[new]
        missed = live[~good]
        rejected[missed] += 1
        length[missed] *= 0.5
        curved[missed], order[missed] = False, TANGENT_ORDER
        ended = np.zeros(live.size, dtype=bool)
        ended[good] = at_end[good]
        # a turn back at the start, a corner, or rounding
        stop_here = (back & good) | (~good & (step <= _CORNER_STEP * options.kink_step)) | correctors.doubtful[live]
        stop_here |= ~ended & (count[live] >= options.max_points)
        given_up[live[stop_here]] = True
        live = live[~ended & ~stop_here]
    points = Points.joined(accepted)
    in_order = np.argsort(points.branch, kind="stable")
    points = points.at(in_order[~given_up[points.branch[in_order]]])
    return Followed(points=points, given_up=given_up, rejected=rejected)


def _first(correctors: Correctors, every: Numbers, guess: Array, metric: Metric, ahead: Array) -> Solved:
    """Solutions at the fixed first value, their tangents pointing forward."""
    fixed = np.ones(len(guess), dtype=bool)
    first = correctors.correct(every, guess, ahead, fixed, metric, forward=ahead)
    renewed = metric.renewed(first.states[:, :-1])
    smaller = np.any(renewed.inverse[:, :-1] > SCALE_CHANGE * metric.inverse[:, :-1], axis=1)
    shrunk = np.flatnonzero(first.found & smaller)
    if shrunk.size:
        better = correctors.correct(
            shrunk, first.states[shrunk], ahead[shrunk], fixed[shrunk], renewed.at(shrunk), forward=ahead[shrunk]
        )
        first.put(shrunk, better)
    return first


def _points_of(
    store: Factors, solved: Solved, live: Numbers, which: Numbers, metric: Metric, arclength: Array,
    apart: Array,
) -> Points:  # fmt: skip
    """Accepted solutions as points."""
    branches = live[which]
    return Points(
        **solved.columns(which), branch=branches, factors=store.add(solved.factors, which),
        arclength=arclength[branches], apart=apart, metric=metric.at(branches),
    )  # fmt: skip


def _predicted(
    metric: Metric, last: Array, tangent: Array, segments: HermiteSegment, curved: BoolArray, length: Array, span: Span
) -> tuple[Array, Array, BoolArray, BoolArray]:
    """``predict`` of each: guesses and directions (k, N + 1), whether at an end of the range, whether at its start.

    Along the segments where ``curved``, else along the tangents.
    """
    guess, direction = along_tangent(metric, last, tangent, length)
    u, on_cubic = place_ahead(metric, segments, tangent, length), np.zeros(len(last), dtype=bool)
    cubics = np.flatnonzero(curved)
    if cubics.size:
        some = segments.at(cubics)
        slopes = some.derivative(u[cubics])
        on = is_cubic_valid(metric.at(cubics), slopes, tangent[cubics])
        on_cubic[cubics[on]] = True
        guess[on_cubic], direction[on_cubic] = some.point(u[cubics])[on], slopes[on]
    beyond = span.beyond(guess[:, -1])
    back = ~beyond & span.behind(guess[:, -1])
    for end, passed in ((span.stop, beyond), (span.start, back)):
        plain, cubic = np.flatnonzero(passed & ~on_cubic), np.flatnonzero(passed & on_cubic)
        if plain.size:
            guess[plain] = shortened(last[plain], guess[plain], end)
        if cubic.size:
            some = segments.at(cubic)
            guess[cubic] = some.point(some.where(end, np.ones(cubic.size), u[cubic]))
        guess[passed, -1] = end
    return guess, direction, beyond | back, back


def _accepted(
    metric: Metric, last: Array, tangent: Array, orientation: NDArray[np.int_], solved: Solved, guess: Array,
    length: Array, at_end: BoolArray, span: Span, options: ContinuationOptions,
) -> BoolArray:  # fmt: skip
    """Where ``rejection_of`` is None; steps here are never below ``kink_step``."""
    state, after = solved.states, solved.tangents
    inside = at_end | ~span.outside(state[:, -1])
    same_way = orientation * solved.orientation >= 0
    kink = is_short(options, length) & is_kink(metric, (last, tangent), (state, after))
    near = ~is_far(metric, options, state, guess, length, kink)
    smooth = angle_of(metric.cosine(tangent, after)) <= options.max_angle
    return np.asarray(inside & same_way & near & (kink | smooth))
