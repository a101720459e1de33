"""Many branches followed side by side: the continuation of ``follow.py`` with one evaluation a round for all of them.

Each branch takes the steps that it takes alone: predictor, corrector, step control and what is believed are those of
``predictor.py``, ``corrector.py``, ``options.py`` and ``step_acceptance.py``, written for arrays whose first axis is
the branch. No number of one depends on another, to the last bit: sums run along one branch, and products of matrices
are those of one branch each. What is out of the ordinary is left to a continuation of its own: a branch that turns back
at its start, finds no way on, stands before a corner, or is known to rounding only is ``given_up``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from slipstick.solve.continuation.hermite_segment import blend, blend_slope
from slipstick.solve.continuation.metric import _TINY, _VANISHED, STILL, ArclengthScaling
from slipstick.solve.continuation.options import ContinuationOptions
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import Array, BoolArray

_ROUNDING = 1e-10
"""Residual over the solution below which an iteration that failed may have met rounding."""

_GATHERED = 256
"""Matrices that are gathered in one go: as many as stay near to the processor."""

Numbers = NDArray[np.intp]


class Systems(Protocol):
    """Systems of n branches, N equations each."""

    def evaluate(self, branches: Numbers, states: Array) -> tuple[Array, Array]:
        """Residuals (k, N) and derivatives by the state (k, N, N + 1) at states (k, N + 1); nan where none are."""
        ...


@dataclass(frozen=True, kw_only=True)
class Measures:
    """The metrics of k branches, or of k places on them: what ``Metric`` is of one.

    Attributes
    ----------
    unit
        Inverse typical size of the unknowns, (k,).
    size, present, largest
        As in ``Metric.measure``, (k,).
    parameter
        Inverse of the change of the parameter that counts as 1.
    scaling
        What they have in common.
    """

    unit: Array
    size: Array
    present: Array
    largest: Array
    parameter: float
    scaling: ArclengthScaling

    @classmethod
    def begun(cls, scaling: ArclengthScaling, sizes: Array, x: Array, span: float) -> Measures:
        """Of typical ``sizes`` (k,) of the unknowns, at first points (k, N)."""
        one = np.ones(len(x))
        return cls(
            unit=1.0 / sizes, size=one, present=one, largest=0.0 * one, scaling=scaling,
            parameter=1.0 / (span if scaling.parameter is None else scaling.parameter),
        ).renewed(x)  # fmt: skip

    def at(self, which: Numbers | BoolArray) -> Measures:
        """Those of some."""
        return replace(
            self, unit=self.unit[which], size=self.size[which], present=self.present[which],
            largest=self.largest[which],
        )  # fmt: skip

    @classmethod
    def joined(cls, parts: Sequence[Measures]) -> Measures:
        """Those of several."""
        names = ("unit", "size", "present", "largest")
        unit, size, present, largest = (np.concatenate([getattr(part, name) for part in parts]) for name in names)
        return replace(parts[0], unit=unit, size=size, present=present, largest=largest)

    def put(self, which: Numbers, those: Measures) -> None:
        """Replace those of some."""
        self.size[which], self.present[which], self.largest[which] = those.size, those.present, those.largest

    def renewed(self, x: Array) -> Measures:
        """Following the magnitude of solutions (k, N)."""
        magnitude = norms(x * self.unit[:, None])
        largest = np.maximum(self.largest, magnitude)
        size, present = np.maximum(magnitude, self.scaling.floor * largest), np.maximum(magnitude, _VANISHED * largest)
        return replace(
            self, size=np.where(size == 0.0, 1.0, size), present=np.where(present == 0.0, 1.0, present), largest=largest
        )

    def weighted(self, z: Array) -> Array:
        """Vectors (k, N + 1) as arclength measures them."""
        out = z * (self.unit * (self.scaling.weight / self.size))[:, None]
        out[:, -1] = z[:, -1] * self.parameter
        return out

    def weights(self, count: int) -> Array:
        """Weights (k, N + 1)."""
        return self.weighted(np.ones((self.unit.size, count)))

    def corrections(self, z: Array) -> Array:
        """Sizes (k,) of Newton corrections (k, N + 1), relative to the solution."""
        out = z * (self.unit / self.present)[:, None]
        out[:, -1] = z[:, -1] * self.parameter
        return norms(out)

    def lengths(self, z: Array) -> Array:
        """Scaled lengths (k,) of vectors (k, N + 1)."""
        return norms(self.weighted(z))

    def cosines(self, a: Array, b: Array) -> Array:
        """Cosines (k,) of scaled angles."""
        a, b = self.weighted(a), self.weighted(b)
        product = norms(a) * norms(b)
        return dots(a, b) / np.where(product == 0.0, np.inf, product)

    def row_sizes(self, *states: Array) -> Array:
        """Size (k, rows) of each row of what is judged, the largest of the states (k, N + 1)."""
        rows, judged = self.scaling.rows, self.scaling.judged
        squares = []
        for z in states:
            x = (z[:, :-1] * self.unit[:, None]).reshape(len(z), rows, -1)
            squares.append((np.vecdot(x, x), np.vecdot(x, x if judged is None else x * judged)))
        whole, own = (np.maximum.reduce(parts) for parts in zip(*squares, strict=True))
        least = STILL * np.sqrt(whole.max(axis=1, initial=0.0))
        return np.asarray(np.maximum(np.sqrt(own), least[:, None]) + _TINY)

    def judged(self, changes: Array, sizes: Array) -> Array:
        """Changes (k, N + 1) over the sizes (k, rows) of their rows, the largest of each: (k,)."""
        x = (changes[:, :-1] * self.unit[:, None]).reshape(*sizes.shape, -1)
        relative = np.sqrt(np.vecdot(x, x)) / sizes
        return np.maximum(relative.max(axis=1), np.abs(changes[:, -1]) * self.parameter)


def dots(a: Array, b: Array) -> Array:
    """Scalar products (k,) of vectors (k, n)."""
    return np.asarray(np.vecdot(a, b))


def norms(z: Array) -> Array:
    """Euclidean norms (k,) of vectors (k, n); inf where not finite."""
    with np.errstate(over="ignore", invalid="ignore"):
        square = dots(z, z)
    return np.sqrt(np.where(np.isfinite(square), square, np.inf))


def times(matrices: Array, vectors: Array) -> Array:
    """Products (k, n) of matrices (k, n, m) and vectors (k, m)."""
    return np.asarray((matrices @ vectors[..., None])[..., 0])


def angles(cosines: Array) -> Array:
    """Angles of cosines that may be beyond 1 by rounding."""
    return np.asarray(np.arccos(np.clip(cosines, -1.0, 1.0)))


@cache
def _inverses() -> Callable[[Array], Array]:
    """Loaded with the first step: what is compiled takes a while to import."""
    from slipstick.solve.linear.inverses import inverses

    return inverses


class Inverses:
    """Inverses (size, size) of the Jacobians of many points: kept in one place, where points name them by number."""

    def __init__(self, size: int) -> None:
        self._room, self._count = np.empty((0, size, size)), 0

    def add(self, matrices: Array, which: Numbers | None = None) -> Numbers:
        """Keep some more (k, size, size), or those named of them; their numbers."""
        which = np.arange(len(matrices)) if which is None else which
        begin, end = self._count, self._count + which.size
        if end > len(self._room):
            room = np.empty((max(end, 2 * len(self._room)), *self._room.shape[1:]))  # memory once it is written to
            room[:begin] = self._room[:begin]
            self._room = room
        np.take(matrices, which, axis=0, out=self._room[begin:end], mode="clip")
        self._count = end
        return np.arange(begin, end)

    def times(self, which: Numbers, vectors: Array) -> Array:
        """Products (k, size) of inverses and vectors (k, m), zero beyond their ends."""
        out = np.empty((len(vectors), self._room.shape[1]))
        for begin in range(0, len(vectors), _GATHERED):
            part = slice(begin, begin + _GATHERED)
            out[part] = times(self._room[which[part]][:, :, : vectors.shape[1]], vectors[part])
        return out


@dataclass(kw_only=True)
class Cubics:
    """``HermiteSegment`` of k pairs of points: nodes (k, 4, N + 1), lengths and rates (k,)."""

    nodes: Array
    length: Array
    rates: tuple[Array, Array]

    @classmethod
    def between(cls, measures: Measures, first: tuple[Array, Array], second: tuple[Array, Array]) -> Cubics:
        """From states and tangents (k, N + 1) of both, as ``Corrector.segment``."""
        (a, ta), (b, tb) = first, second
        turn = angles(measures.cosines(ta, tb))
        length = measures.lengths(b - a) * (1.0 + turn * turn / 24.0)
        rates = length / measures.lengths(ta), length / measures.lengths(tb)
        nodes = np.stack((a, b, rates[0][:, None] * ta, rates[1][:, None] * tb), axis=1)
        return cls(nodes=nodes, length=length, rates=rates)

    def at(self, which: Numbers | BoolArray) -> Cubics:
        """Some of them."""
        rates = self.rates[0][which], self.rates[1][which]
        return Cubics(nodes=self.nodes[which], length=self.length[which], rates=rates)

    def points(self, u: Array) -> Array:
        """States (k, N + 1) at places (k,)."""
        return mixed(blend(u), self.nodes)

    def derivatives(self, u: Array) -> Array:
        """Derivatives by ``u``."""
        return mixed(blend_slope(u), self.nodes)

    def where(self, parameter: float, low: Array, high: Array) -> Array:
        """The places in [low, high] where they pass a parameter, which the ends bracket."""

        def at(u: Array) -> Array:
            p, q, r, s = blend(u)
            a, b, c, d = self.nodes[:, :, -1].T
            return np.asarray(p * a + q * b + r * c + s * d)

        rising = at(high) > at(low)
        for _ in range(60):
            middle = 0.5 * (low + high)
            above = (at(middle) > parameter) == rising
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        return np.asarray(0.5 * (low + high))


def mixed(shares: Any, nodes: Array) -> Array:
    """What lies at shares (4 of (k,)) of nodes (k, 4, ...)."""
    p, q, r, s = (share.reshape(-1, *(1,) * (nodes.ndim - 2)) for share in shares)
    return np.asarray(p * nodes[:, 0] + q * nodes[:, 1] + r * nodes[:, 2] + s * nodes[:, 3])


@dataclass(kw_only=True)
class Solved:
    """Solutions sought on k planes; what is not ``found`` means nothing.

    Attributes
    ----------
    states, tangents, inverse
        (k, N + 1) each, and inverses (k, N + 1, N + 1) of the bordered Jacobians.
    orientation, iterations, contraction, stagnated
        As of ``Step`` and ``NewtonResult``, (k,).
    """

    states: Array
    tangents: Array
    inverse: Array
    found: BoolArray
    orientation: NDArray[np.int_]
    iterations: NDArray[np.int_]
    contraction: Array
    stagnated: BoolArray


class Correctors:
    """The bordered Newton iteration of ``Corrector`` for many branches at once.

    Attributes
    ----------
    evaluations, solves
        Work so far, by branch (n,).
    doubtful
        Branches (n,) on which an iteration failed that may have met rounding.
    inverses
        Of the bordered Jacobians of points that were taken.
    """

    def __init__(self, systems: Systems, count: int, size: int, options: NewtonOptions) -> None:
        self._systems, self._options = systems, options
        self.patient = replace(options, max_iterations=2 * options.max_iterations, min_damping=0.1)
        self.evaluations, self.solves = np.zeros(count, dtype=int), np.zeros(count, dtype=int)
        self.doubtful = np.zeros(count, dtype=bool)
        self.inverses = Inverses(size + 1)

    def correct(
        self, branches: Numbers, guess: Array, normal: Array, fixed: BoolArray, measures: Measures, *,
        forward: Array, reach: Array | None = None, options: NewtonOptions | None = None,
    ) -> Solved:  # fmt: skip
        """As ``Corrector.correct``: on the planes through ``guess`` across ``normal``, or where ``fixed`` at its
        parameter, the tangent then along ``forward``."""
        row = measures.weighted(measures.weighted(normal))
        row[fixed] = 0.0
        row[fixed, -1] = 1.0
        row /= np.abs(row).max(axis=1)[:, None]
        solved = self._iterated(branches, guess, row, measures, options or self._options, reach)
        states, found = solved.states, solved.found
        states[fixed, -1] = guess[fixed, -1]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            solved.tangents = np.ascontiguousarray(solved.inverse[:, :, -1])
            solved.tangents /= measures.lengths(solved.tangents)[:, None]
        self.solves += np.bincount(branches[found], minlength=self.solves.size)
        some = np.flatnonzero(found)
        solved.orientation = np.ones(len(guess), dtype=int)
        if some.size:
            solved.orientation[some] = np.linalg.slogdet(solved.inverse[some])[0].astype(int)
            back = some[fixed[some] & (measures.at(some).cosines(solved.tangents[some], forward[some]) < 0.0)]
            solved.tangents[back] *= -1.0
            solved.orientation[back] *= -1
        return solved

    def _bordered(self, branches: Numbers, z: Array, row: Array, level: Array) -> tuple[Array, Array]:
        """Residuals (k, N + 1) and inverse Jacobians (k, N + 1, N + 1)."""
        N = z.shape[1] - 1
        residual, jacobian = np.empty_like(z), np.empty((len(z), N + 1, N + 1))
        residual[:, :N], jacobian[:, :N] = self._systems.evaluate(branches, z)
        residual[:, N], jacobian[:, N] = dots(row, z) - level, row
        self.evaluations += np.bincount(branches, minlength=self.evaluations.size)
        return residual, _inverses()(jacobian)

    def _iterated(
        self, branches: Numbers, guess: Array, row: Array, measures: Measures, options: NewtonOptions,
        reach: Array | None,
    ) -> Solved:  # fmt: skip
        """``newton.iterate`` on each."""
        count, level = len(guess), dots(row, guess)
        z = guess.copy()
        residual, inverse = self._bordered(branches, z, row, level)
        found, stagnated = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
        iterations, contraction = np.zeros(count, dtype=int), np.zeros(count)
        allowance, sizes = np.full(count, options.non_monotone), np.full((3, count), np.nan)
        live = np.arange(count)
        while live.size:
            step = times(inverse[live], residual[live])
            size = measures.at(live).corrections(step)
            self.solves += np.bincount(branches[live], minlength=self.solves.size)
            sizes[:, live] = size, sizes[0, live], sizes[1, live]
            done = size <= options.tolerance
            with np.errstate(invalid="ignore"):
                shrinks = ~((size > 0.5 * sizes[1, live]) & (sizes[1, live] > 0.1 * sizes[2, live]))
            rounded = ~done & ~shrinks & (size <= options.stagnation)
            lost = ~done & ~rounded & (~np.isfinite(size) | (iterations[live] >= options.max_iterations))
            self._doubt(branches, live[lost], z, residual, size[lost])
            if reach is not None:
                first = iterations[live] == 0
                lost |= first & ~done & ~rounded & ~(measures.at(live).lengths(step) <= reach[live])
            found[live[done | rounded]], stagnated[live[rounded]] = True, True
            on = ~(done | rounded | lost)
            live, step, size = live[on], step[on], size[on]
            if live.size:
                taken = self._searched(
                    branches, live, step, size, (z, residual, inverse), (row, level), measures, options, allowance,
                    contraction, iterations,
                )  # fmt: skip
                live = live[taken]
        return Solved(
            states=z, tangents=z, inverse=inverse, found=found, orientation=iterations, iterations=iterations,
            contraction=contraction, stagnated=stagnated,
        )  # fmt: skip

    def _searched(
        self, branches: Numbers, live: Numbers, step: Array, size: Array, at: tuple[Array, Array, Array],
        plane: tuple[Array, Array], measures: Measures, options: NewtonOptions, allowance: NDArray[np.int_],
        contraction: Array, iterations: NDArray[np.int_],
    ) -> BoolArray:  # fmt: skip
        """``newton.line_search`` of each; which of them took a correction."""
        z, residual, inverse = at

        def tried(which: Numbers, damping: float) -> tuple[Array, Array, Array, Array]:
            i = live[which]
            trial = z[i] - damping * step[which]
            R, V = self._bordered(branches[i], trial, plane[0][i], plane[1][i])
            with np.errstate(invalid="ignore", over="ignore"):
                natural = measures.at(i).corrections(times(inverse[i], R)) / size[which]
            finite = np.isfinite(norms(R))
            self.solves += np.bincount(branches[i[finite]], minlength=self.solves.size)
            return trial, R, V, np.where(finite, natural, np.inf)

        every = np.arange(live.size)
        trial, R, V, natural = tried(every, 1.0)
        first = iterations[live] == 0
        contraction[live[first]] = natural[first]
        good = (natural <= 0.5) | ((size <= options.stagnation) & np.isfinite(natural))
        rest = np.flatnonzero(~good)
        self._doubt(branches, live[rest], z, residual, size[rest])
        if rest.size:
            best, taken = natural[rest].copy(), rest
            usable, damping = natural[rest] < 10.0, 0.5
            trials = [array[rest].copy() for array in (trial, R, V)]
            while damping >= options.min_damping and taken.size:
                place = np.searchsorted(rest, taken)
                *more, natural_here = tried(taken, damping)
                better = natural_here < best[place]
                for kept, new in zip(trials, more, strict=True):
                    kept[place[better]] = new[better]
                best[place[better]] = natural_here[better]
                taken = taken[better | ~(best[place] < 1.0 - 0.1 * damping)]
                damping *= 0.5
            whole = (best >= 1.0 - 0.1 * options.min_damping) & usable & (allowance[live[rest]] > 0)
            allowance[live[rest[whole]]] -= 1
            better = ~whole & (best < 1.0)
            for kept, full in zip(trials, (trial, R, V), strict=True):
                full[rest[better]] = kept[better]
            good[rest] = whole | better
        took = live[good]
        z[took], residual[took], inverse[took] = trial[good], R[good], V[good]
        iterations[took] += 1
        return good

    def _doubt(self, branches: Numbers, which: Numbers, z: Array, residual: Array, size: Array) -> None:
        """Note iterations that may have met rounding before their tolerance: whether they did is not judged here."""
        near = which[size < 1e-3]
        rounding = norms(residual[near]) <= _ROUNDING * norms(z[near])
        self.doubtful[branches[near[rounding]]] = True


@dataclass(kw_only=True)
class Points:
    """Points that were stepped to, branch after branch, each in order.

    Attributes
    ----------
    branch
        Whose each is, (p,).
    states, tangents, orientation, iterations, arclength
        As of ``Step``.
    inverse
        Number of that of the bordered Jacobian among ``Correctors.inverses``.
    apart
        See ``Step.apart``; of a first point infinite.
    measures
        In which what comes after each is measured.
    """

    branch: Numbers
    states: Array
    tangents: Array
    inverse: Numbers
    orientation: NDArray[np.int_]
    iterations: NDArray[np.int_]
    arclength: Array
    apart: Array
    measures: Measures

    def at(self, which: Numbers | BoolArray) -> Points:
        """Some of them."""
        arrays = {name: getattr(self, name)[which] for name in self.__dataclass_fields__ if name != "measures"}
        return Points(**arrays, measures=self.measures.at(which))

    @classmethod
    def joined(cls, parts: list[Points]) -> Points:
        """All of several."""
        arrays = {
            name: np.concatenate([getattr(part, name) for part in parts])
            for name in cls.__dataclass_fields__
            if name != "measures"
        }
        return cls(**arrays, measures=Measures.joined([part.measures for part in parts]))


@dataclass(kw_only=True)
class Followed:
    """What was found: points, of which branches (n,) they are not all there, and steps rejected (n,)."""

    points: Points
    given_up: BoolArray
    rejected: NDArray[np.int_]


def follow(
    correctors: Correctors, x: Array, span: tuple[float, float], measures: Measures, options: ContinuationOptions
) -> Followed:
    """Follow n branches through ``x`` (n, N) over the same range of the parameter, as ``Continuation`` does each."""
    start, stop = span
    n, size = len(x), x.shape[1] + 1
    everyone = np.arange(n)
    rejected, given_up = np.zeros(n, dtype=int), np.zeros(n, dtype=bool)
    ahead = np.zeros((n, size))
    ahead[:, -1] = stop - start
    first = _first(correctors, everyone, np.column_stack((x, np.full(n, start))), measures, ahead)
    given_up |= ~first.found
    measures.put(everyone, measures.renewed(first.states[:, :-1]))
    z, tangent, orientation = first.states, first.tangents, first.orientation
    step_length = np.full(n, min(options.first_step, options.max_step))
    cubics = Cubics(nodes=np.zeros((n, 4, size)), length=np.ones(n), rates=(np.ones(n), np.ones(n)))
    curved, arclength, length = np.zeros(n, dtype=bool), np.zeros(n), step_length.copy()
    order = np.full(n, 2)
    found = np.flatnonzero(first.found)
    accepted = [_taken(correctors.inverses, first, everyone, found, measures, arclength, np.full(found.size, np.inf))]
    count, live = np.ones(n, dtype=int), np.flatnonzero(first.found)
    while live.size:
        here, last, along, reaching = measures.at(live), z[live], tangent[live], length[live]
        guess, direction, at_end, back = _predicted(here, last, along, cubics.at(live), curved[live], reaching, span)
        corner = reaching <= 0.25 * options.max_step
        reach = np.maximum(np.where(corner, 5.0, 0.0), options.max_correction) * reaching
        solved = correctors.correct(live, guess, direction, at_end, here, forward=along, reach=reach)
        with np.errstate(invalid="ignore"):
            believed = _believed(here, last, along, orientation[live], solved, guess, reaching, at_end, span, options)
            good = solved.found & believed
        new = live[good]
        if new.size:
            those, measured = solved.states[good], here.at(good)
            apart = apart_from(measured, those, solved.tangents[good], guess[good], direction[good], reaching[good])
            turned = angles(measured.cosines(along[good], solved.tangents[good]))
            arclength[new] += measured.lengths(those - last[good])
            step_length[new] = _next_steps(reaching[good], solved, good, turned, order[new], options)
            segment = Cubics.between(measured, (last[good], along[good]), (those, solved.tangents[good]))
            cubics.nodes[new], cubics.length[new] = segment.nodes, segment.length
            curved[new] = turned <= options.max_angle
            order[new] = np.where(curved[new], 4, 2)
            z[new], tangent[new], orientation[new] = those, solved.tangents[good], solved.orientation[good]
            measures.put(new, measured.renewed(those[:, :-1]))
            taken = np.flatnonzero(good)
            accepted.append(_taken(correctors.inverses, solved, live, taken, measures, arclength, apart))
            count[new] += 1
            length[new] = step_length[new]
        missed = live[~good]
        rejected[missed] += 1
        length[missed] *= 0.5
        curved[missed], order[missed] = False, 2
        ended = np.zeros(live.size, dtype=bool)
        ended[good] = at_end[good]
        # a corner, the way back, or a solution known to rounding: on a road of their own
        stop_here = (back & good) | (~good & (reaching <= 4.0 * options.kink_step)) | correctors.doubtful[live]
        stop_here |= ~ended & (count[live] >= options.max_points)
        given_up[live[stop_here]] = True
        live = live[~ended & ~stop_here]
    points = Points.joined(accepted)
    in_order = np.argsort(points.branch, kind="stable")
    points = points.at(in_order[~given_up[points.branch[in_order]]])
    return Followed(points=points, given_up=given_up, rejected=rejected)


def _first(correctors: Correctors, every: Numbers, guess: Array, measures: Measures, ahead: Array) -> Solved:
    """Solutions at the fixed first value, their tangents pointing forward."""
    fixed = np.ones(len(guess), dtype=bool)
    first = correctors.correct(every, guess, ahead, fixed, measures, forward=ahead)
    renewed = measures.renewed(first.states[:, :-1])
    grew = np.flatnonzero(first.found & (measures.present > 2.0 * renewed.present))
    if grew.size:
        again = correctors.correct(
            grew, first.states[grew], ahead[grew], fixed[grew], renewed.at(grew), forward=ahead[grew]
        )
        for name in Solved.__dataclass_fields__:
            getattr(first, name)[grew] = getattr(again, name)
    return first


def _taken(
    inverses: Inverses, solved: Solved, live: Numbers, which: Numbers, measures: Measures, arclength: Array,
    apart: Array,
) -> Points:  # fmt: skip
    """Solutions that were accepted, as points."""
    branches = live[which]
    return Points(
        branch=branches, states=solved.states[which].copy(), tangents=solved.tangents[which].copy(),
        inverse=inverses.add(solved.inverse, which), orientation=solved.orientation[which].copy(),
        iterations=solved.iterations[which], arclength=arclength[branches],
        apart=apart, measures=measures.at(branches),
    )  # fmt: skip


def _predicted(
    here: Measures, last: Array, tangent: Array, cubics: Cubics, curved: BoolArray, length: Array,
    span: tuple[float, float],
) -> tuple[Array, Array, BoolArray, BoolArray]:  # fmt: skip
    """``predict``: guesses and directions (k, N + 1), which are at an end of the range, and which at its start."""
    ratio = here.lengths(tangent)
    straight = tangent / ratio[:, None]
    guess, direction = last + length[:, None] * straight, straight.copy()
    u = 1.0 + length / (ratio * cubics.length)
    bent = np.flatnonzero(curved)
    if bent.size:
        some = cubics.at(bent)
        slopes = some.derivatives(u[bent])
        goes_on = here.at(bent).cosines(slopes, tangent[bent]) >= 0.7
        curved = np.zeros(len(last), dtype=bool)
        curved[bent[goes_on]] = True
        guess[curved], direction[curved] = some.points(u[bent])[goes_on], slopes[goes_on]
    start, stop = span
    forward = 1.0 if stop > start else -1.0
    beyond = (guess[:, -1] - stop) * forward >= 0.0
    back = ~beyond & ((guess[:, -1] - start) * forward <= 0.0)
    for end, passed in ((stop, beyond), (start, back)):
        plain, on_cubic = np.flatnonzero(passed & ~curved), np.flatnonzero(passed & curved)
        if plain.size:
            way = guess[plain] - last[plain]
            guess[plain] = last[plain] + ((end - last[plain, -1]) / way[:, -1])[:, None] * way
        if on_cubic.size:
            some = cubics.at(on_cubic)
            guess[on_cubic] = some.points(some.where(end, np.ones(on_cubic.size), u[on_cubic]))
        guess[passed, -1] = end
    return guess, direction, beyond | back, back


def _believed(
    here: Measures, last: Array, tangent: Array, orientation: NDArray[np.int_], solved: Solved, guess: Array,
    length: Array, at_end: BoolArray, span: tuple[float, float], options: ContinuationOptions,
) -> BoolArray:  # fmt: skip
    """Where ``objection`` has none."""
    start, stop = span
    forward = 1.0 if stop > start else -1.0
    new = solved.states
    inside = at_end | (((new[:, -1] - stop) * forward < 0.0) & ((new[:, -1] - start) * forward > 0.0))
    same_way = orientation * solved.orientation >= 0
    kink = (length <= 0.25 * options.max_step) & _kinks(here, last, tangent, new, solved.tangents)
    near = here.lengths(new - guess) <= np.where(kink, 5.0, options.max_correction) * length
    smooth = angles(here.cosines(tangent, solved.tangents)) <= options.max_angle
    return np.asarray(inside & same_way & near & (kink | smooth))


def _kinks(here: Measures, last: Array, tangent: Array, new: Array, after: Array) -> BoolArray:
    """``Corrector.is_kink``."""
    if last.shape[1] < 5:
        return np.zeros(len(last), dtype=bool)
    a, b, chord = here.weighted(tangent), here.weighted(after), here.weighted(new - last)
    a, b = a / norms(a)[:, None], b / norms(b)[:, None]
    g, p, q = dots(a, b), dots(a, chord), dots(b, chord)
    first, second = p - g * q, q - g * p
    rest = chord * (1.0 - g * g)[:, None] - first[:, None] * a - second[:, None] * b
    on_line = norms(rest) <= 0.05 * (1.0 - g * g) * norms(chord)
    return np.asarray((g >= 0.1) & (first >= 0.0) & (second >= 0.0) & on_line)


def apart_from(
    measures: Measures, states: Array, tangents: Array, guess: Array, direction: Array, length: Array
) -> Array:
    """``Corrector.apart``."""
    turned = tangents / measures.lengths(tangents)[:, None] - direction / measures.lengths(direction)[:, None]
    by_state, by_slope = 0.5 * (states - guess), (0.125 * length)[:, None] * turned
    sizes = measures.row_sizes(states)
    both, first, second = (measures.judged(change, sizes) for change in (by_state - by_slope, by_state, by_slope))
    return np.asarray(np.maximum(both, 0.125 * (first + second)))


def _next_steps(
    length: Array, solved: Solved, good: BoolArray, turned: Array, order: NDArray[np.int_], options: ContinuationOptions
) -> Array:
    """``next_step``."""
    rounded = solved.stagnated[good]
    contraction = np.where(rounded, 0.0, solved.contraction[good])
    iterations = np.where(rounded, 0, solved.iterations[good])
    many = options.target_iterations / np.maximum(iterations, 1)
    factor = np.minimum(
        (options.contraction / np.maximum(contraction, 1e-12)) ** (1.0 / order),
        np.minimum(
            options.aimed_angle / np.maximum(turned, 1e-12),
            np.where(iterations <= options.target_iterations, 2.0, many),
        ),
    )
    return np.asarray(np.minimum(options.max_step, length * np.clip(factor, 0.5, 2.0)))
