"""The value of a parameter at which the highest peak is lowest, by one Newton iteration instead of a scan.

A whole curve at the value found tells whether its peak is the highest there. Where another one is, both are equally
high somewhere on the way: there the peak that was followed is left for the other. Where the one falls and the other
rises, that is the optimum.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar, NamedTuple

import numpy as np

from slipstick.analysis.augmented import Augmented, Bordered
from slipstick.analysis.peaks.continuation import LEVEL, NEWTON, OPTIMUM, PeakPoint, bracketed_peak
from slipstick.analysis.peaks.system import Displaced, Extreme, PeakDetail, PeakGradient, PeakSystem
from slipstick.analysis.peaks.tracking import Highest, PeakRun, TrackedPeak, tracked_peak
from slipstick.analysis.road.checkpoint import Checkpoint, undamaged, vector
from slipstick.analysis.road.events import EventFunction
from slipstick.analysis.sensitivity.linearization import FREQUENCY, Linearization, Move
from slipstick.balance.physics_checks import parameter_warnings
from slipstick.balance.problem import Problem
from slipstick.balance.scaling import scales
from slipstick.branch import Branch
from slipstick.errors import InputError, Outcome
from slipstick.interrupts import pass_on
from slipstick.results.record import Point
from slipstick.solve.continuation.events import BracketedRoot
from slipstick.solve.linear.jacobian import Eliminated
from slipstick.solve.newton import Evaluation, NewtonOptions, newton
from slipstick.solve.norm import norm, relative
from slipstick.typing import Array, FrequencyRange, Real

_NEWTON = NewtonOptions(max_iterations=15, min_damping=0.5, patience=4, non_monotone=3)
_SEARCH_FACTOR = 30.0
"""Factor by which the parameter may shrink or grow in the search by tracking."""
_SAME_OPTIMUM = 1e-6
"""Relative difference of the parameter up to which two optima are the same."""
LOWEST = "lowest"
"""Kind of an optimum."""
_MOST_PEAKS = 8
"""Number of peaks up to which the highest one is followed."""
_HALVINGS, _NARROW = 40, 0.1
"""Largest number of times that the range in which another peak becomes the highest is halved; its width, over the
parameter, from which both peaks are sought at either end of it."""
_SAME_FREQUENCY = 0.1
"""Largest relative change of frequency of a peak between these ends."""
_EQUAL_WIDTH, _EQUAL_TRIALS = 1e-10, 40
"""Width over the parameter to which the place of equal peaks is bracketed, and largest number of trials."""
_ASIDE = 1e-4
"""Relative distance from there at which it shows which peak rises."""
_RISEN = 1e-3
"""Relative height above the start at which a peak has risen."""


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """The value of a parameter at which the highest peak is lowest.

    Attributes
    ----------
    parameter, dof
        Names.
    value, omega, amplitude
        Value of the parameter, frequency in rad/s and amplitude of the peak; nan where none was found.
    kind
        "lowest"; empty where none was found.
    hessian
        Second derivatives (2, 2) of the amplitude by frequency and parameter along the solutions, symmetric; nan where
        two peaks are equally high, which ``message`` says.
    factorisations
        Number of factorised Jacobians of the balance, without those of whole curves.
    branch
        The optimum as a point of results; its problem has the value of the parameter.
    """

    parameter: str
    dof: str
    value: float
    omega: float
    amplitude: float
    kind: str
    hessian: Array
    factorisations: int
    branch: Branch

    @property
    def outcome(self) -> Outcome:
        """How it ended."""
        return self.branch.outcome

    @property
    def message(self) -> str:
        """How it ended in words."""
        return self.branch.message


def optimal(
    problem: Problem,
    parameter: str,
    *,
    omega: FrequencyRange,
    dof: str | None = None,
    start: Real | None = None,
    options: Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
) -> Optimum:
    """The value of a parameter at which the highest peak is lowest, such as the best normal load of a damper.

    One Newton iteration on motion, frequency and parameter with ``da/dw = 0`` and ``da/ds = 0``; where it starts too
    far away the peak is tracked towards the optimum first, the way it falls. A whole curve at the optimum tells whether
    its peak is the highest. Where another one is, the highest peak is followed across the value at which both are
    equally high; that value is the optimum where one falls and the other rises.

    Parameters
    ----------
    problem
        What vibrates.
    parameter
        Name as of ``parameter_response``.
    omega
        Range of frequencies, rad/s, whose highest peak is meant. A peak that is followed may leave the range.
    dof
        Name of the output whose amplitude peaks; by default the first.
    start
        Value of the parameter to begin at; by default that of the problem.
    options, listeners
        As of ``track_peak``.

    Returns
    -------
    Optimum
        With value, frequency and amplitude; look at ``outcome``, which is ``NO_OPTIMUM`` where there is none.

    Raises
    ------
    InputError
        As ``track_peak``.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> damper = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=500.0)
    >>> problem = ss.Problem(structure, contacts=ss.ContactPair(name="damper", tangential="x", contact=damper),
    ...                      loads=ss.Load(dof="x", sin=100.0), harmonics=range(11))
    >>> best = optimal(problem, "damper.normal_load", omega=(2.0, 15.0))
    >>> round(best.value, 5), round(best.omega, 6), round(best.amplitude, 7), best.kind
    (471.69623, 9.504764, 2.8037329, 'lowest')
    """
    search = optimum_request(problem, parameter, start, omega, dof, options, listeners).run()
    return search.optimum(Branch.of(search.solutions()))


def optimum_request(
    problem: Any, parameter: Any, start: Any, omega: Any, dof: Any, options: Any = None, listeners: Any = (), *,
    beside: float | None = None,
) -> OptimumRequest:  # fmt: skip
    """Request of ``optimal``; its arguments, checked. Raises InputError with all faults."""
    request = tracked_peak(problem, parameter, start, omega, (), dof, options, listeners)
    return OptimumRequest(**vars(request), beside=beside)


class OptimumSystem(Augmented):
    """``(R, da/dw, da/ds) = 0`` for the unknowns ``(X, w, s)``."""

    def __init__(self, peaks: PeakSystem, context: Array | None) -> None:
        self.peaks, self._context = peaks, context
        self.hessian: Array = np.full((2, 2), np.nan)

    def state(self, y: Array, parameter: float = 0.0, context: Array | None = None) -> Bordered | None:
        """The balance with both slopes, from one factorisation; ``parameter`` and ``context`` are not used."""
        sloped = self.peaks.slope(y[:-1], float(y[-1]), self._context) if np.all(np.isfinite(y)) else None
        if sloped is None:
            return None
        here, over_w = sloped
        space, s = self.peaks.space, float(y[-1])
        along = space.along(s)
        over_s = PeakGradient(space, here, s, over_w.extreme, along, over_w.z)
        sides = over_w.displaced(here.omega), over_s.displaced(abs(s) or 1.0)
        turned = tuple(space.along(v) for v in sides[1].values)
        rows = np.array([self._row(sides[0], (along,)), self._row(sides[1], turned)])
        steps = np.column_stack([over_w.t, over_s.t])
        self.hessian = rows @ np.vstack([steps, np.eye(2)])
        return Bordered(
            here, Eliminated(here.jacobian, np.column_stack([over_w.R, over_s.R]), rows, -steps),
            np.array([over_w.value, over_s.value]), np.array([over_w.size, over_s.size]),
            lambda way: np.array([side.along(way) for side in sides]), None, here,
        )  # fmt: skip

    @staticmethod
    def _row(side: Displaced, along: tuple[Move, ...]) -> Array:
        """Gradient of a slope by all unknowns."""
        return np.concatenate([side.by_motion(), [side.along(FREQUENCY), side.along(*along)]])


@dataclass(frozen=True, kw_only=True)
class OptimumRequest(TrackedPeak):
    """A request for the optimum of a peak over the parameter.

    With a factor ``beside``, the peak is followed from the optimal value divided by it to the optimal value times it,
    where the parameter can have such values. Without, the optimum is the only point.
    """

    analysis: ClassVar[str] = "optimal"
    beside: float | None = None

    def checkpoint(self, plain: Mapping[str, Any]) -> Checkpoint:
        """Checkpoint of the peak, with unknowns, iterations and factorisations of the optimum."""
        with undamaged():
            point = super().checkpoint(plain) if "y" in plain else Checkpoint.from_plain(plain)
            own = {"optimum": vector(plain["optimum"], self.balance.size + 2)}
            counts = {name: int(plain[name]) for name in ("optimum_iterations", "optimum_factorisations")}
            equal = {"optimum_equal": str(plain["optimum_equal"])}
            return replace(point, own={**point.own, **own, **counts, **equal})

    def run(self) -> OptimumSearch:
        """The run that finds the optimum."""
        return OptimumSearch(self)

    def around(self, value: float) -> OptimumRequest | None:
        """Request for the peak around the optimal value; None where it is not to be followed."""
        if self.beside is None or value == 0.0:
            return None
        problem, ends = self.problem, (value / self.beside, value * self.beside)
        try:
            for end in ends:
                problem.at_parameter(self.parameter, end)
        except InputError:
            return None
        static = self.balance.receptance.static
        warnings = parameter_warnings(problem, self.parameter, ends, self.omega[0], static)
        return replace(self, start=ends[0], stop=ends[1], warnings=warnings)


class OptimumSearch(PeakRun):
    """Run that finds an optimum, and follows the peak around it where that is requested."""

    request: OptimumRequest

    def __init__(self, request: OptimumRequest) -> None:
        super().__init__(request)
        self._best: _Optimal | None = None
        self._factorisations, self._followed = 0, False

    def points(self) -> Generator[Point, None, None]:
        """The optimum; or the peak around it, then the optimum unless one of its points is that."""
        own = self.request.checkpoints[-1].own if self.request.checkpoints else None
        if own is None:
            self._best = self._find()
        else:
            self._best, self._factorisations = self._known(own), own["optimum_factorisations"]
        if self._best is None:
            return
        best, u, passed, part = self._best.peak, self._best.u, False, 0
        kept = {
            "optimum": u, "optimum_iterations": best.iterations, "optimum_factorisations": self._factorisations,
            "optimum_equal": self._best.equal,
        }  # fmt: skip
        around = self.request.around(best.parameter)
        alone = Checkpoint(value=best.parameter, seconds=self.seconds, goes_on=False, own=kept)
        if around is not None:
            self.request, self._followed, self.system.factorisations = around, True, 0
            self._peaks = self.continuation(around.start, around.stop)
            passed = any(self._same(point.value, point.own["kind"]) for point in around.checkpoints)
            try:
                for point in super().points():
                    assert self.checkpoint is not None
                    self.checkpoint = replace(self.checkpoint, own={**self.checkpoint.own, **kept})
                    passed, part = passed or self._same(point.parameter, point.kind), point.part
                    yield point
            except KeyboardInterrupt:
                if not part:  # the optimum itself is known
                    self.checkpoint = alone
                    yield self.point(best)
                raise
        if not passed:
            self.checkpoint = replace(alone, part=part + 1)
            yield self.point(best._replace(part=part + 1))
        if not (passed and self.outcome.ok):
            beside = f"; the peak beside it: {self.message}" if self._followed else ""
            self.outcome, self.message = Outcome.COMPLETED, Outcome.COMPLETED.text + beside
        if self._best.equal:
            self.message = f"{self.message}; {self._best.equal}"

    def _find(self) -> _Optimal | None:
        """The optimum by Newton's method from the highest peak, or from the tracked one; None where none is found."""
        first = self.highest(self.request.start)
        if first is None:
            self.outcome, self.message = Outcome.NO_FIRST_POINT, self.none_found
            return None
        self.system.factorisations, self.doing = 0, "going to the optimum"
        best, message = self._newton(first.y, self.request.start), ""
        if best is None or self.higher(best.peak) is not None:
            best, message = self._tracked(first)
        self._factorisations = self.system.factorisations
        self.outcome = Outcome.NO_OPTIMUM if best is None else Outcome.COMPLETED
        self.message = message or self.outcome.text
        return best

    def _known(self, own: Mapping[str, Any]) -> _Optimal | None:
        """The optimum of a checkpoint."""
        u, iterations, equal = own["optimum"], own["optimum_iterations"], own["optimum_equal"]
        if equal:
            value = self.system.evaluate(u[:-1], float(u[-1]))
            assert value.terms is not None
            residual = relative(value.residual[:-1], value.terms()[:-1])
            return self._at_equal(PeakPoint(u[:-1], float(u[-1]), value.detail, OPTIMUM, residual, iterations), equal)
        system = OptimumSystem(self.system, None)
        return self._stationary(system, u, system.evaluate(u, float(u[-1])), iterations)

    def doubt(self, peak: PeakPoint) -> None:
        """Warn where another peak is higher; the optimum was compared when it was found."""
        if not self._same(peak.parameter, peak.kind):
            super().doubt(peak)

    def _same(self, value: float, kind: str) -> bool:
        """Whether a point of the peak is the optimum."""
        assert self._best is not None
        best = self._best.peak.parameter
        return kind == OPTIMUM and abs(value - best) <= _SAME_OPTIMUM * abs(best)

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Output, optimum and work."""
        found: dict[str, Any] = {}
        if self._best is not None:
            peak = self._best.peak
            found = {"optimum": peak.parameter, "optimum_omega": peak.detail.omega, "optimum_kind": LOWEST}
            found["optimum_amplitude"] = peak.detail.amplitude
        alone = {"peak_of": self.request.dof, "factorisations": self._factorisations, "curves": self.curves}
        return {**(super().attributes if self._followed else alone), **found}

    def optimum(self, branch: Branch) -> Optimum:
        """The optimum, with the branch of its points."""
        request, best = self.request, self._best if len(branch) else None
        peak = None if best is None else best.peak
        return Optimum(
            parameter=request.parameter, dof=request.dof, branch=branch, factorisations=self._factorisations,
            value=np.nan if peak is None else peak.parameter, omega=np.nan if peak is None else peak.detail.omega,
            amplitude=np.nan if peak is None else peak.detail.amplitude, kind="" if best is None else LOWEST,
            hessian=np.full((2, 2), np.nan) if best is None else best.hessian,
        )  # fmt: skip

    def _newton(self, y: Array, value: float, context: Array | None = None) -> _Optimal | None:
        """The optimum next to a state; None where the iteration fails or ends at another kind of point."""
        system = OptimumSystem(self.system, context)
        size = scales(self.system.balance, self.system.at(value)[0], float(y[-1])).displacement
        scale = np.full(y.size + 1, max(size, norm(y[:-1])))
        scale[-2:] = y[-1], abs(value) or 1.0
        result = newton(partial(system.evaluate, parameter=value), np.append(y, value), options=_NEWTON, scale=scale)
        near = abs(value) / _SEARCH_FACTOR <= abs(result.x[-1]) <= abs(value) * _SEARCH_FACTOR or value == 0.0
        if not (result.converged and near):
            return None
        return self._stationary(system, result.x, result.evaluation, result.iterations)

    def _stationary(self, system: OptimumSystem, u: Array, evaluation: Evaluation, iterations: int) -> _Optimal | None:
        """The optimum at stationary unknowns, frequency and parameter (N + 2,); None where it is no minimum over the
        parameter of a maximum over frequency."""
        H, here = system.hessian, evaluation.detail
        if not H[0, 0] < 0.0:
            return None
        bend, amplitude = float(np.linalg.det(H) / H[0, 0]), self._amplitude(here)
        if bend * float(u[-1]) ** 2 <= LEVEL * amplitude:
            return None  # a plateau, or the peak is highest there
        detail = PeakDetail(
            responses=here.detail.responses, inputs=here.detail.inputs, omega=float(u[-2]), states=here.detail.states,
            amplitude=amplitude, rate=0.0, bend=float(H[0, 0]), ahead=0.0, motion=here.motion()[0],
            extreme=Extreme.largest(here.outputs.balance.harmonics, here.motion()[0]),
        )  # fmt: skip
        assert evaluation.terms is not None
        residual = relative(evaluation.residual[:-2], evaluation.terms()[:-2])
        peak = PeakPoint(u[:-1], float(u[-1]), detail, OPTIMUM, residual, iterations)
        return _Optimal(peak, H)

    def _amplitude(self, here: Linearization) -> float:
        return Extreme.largest(self.request.problem.harmonics, here.motion()[0]).value

    def _tracked(self, first: Highest) -> tuple[_Optimal | None, str]:
        """The optimum on the highest peak in the direction in which it falls, in both from a plateau; and a message."""
        value = self.request.start
        at = self.system.evaluate(first.y, value)
        rate, amplitude = (at.detail.rate, at.detail.amplitude) if at.detail is not None else (np.nan, np.nan)
        down, up, ended = 1.0 / _SEARCH_FACTOR, _SEARCH_FACTOR, list[str]()
        ways = [up if rate * np.sign(value) < 0.0 else down]
        if abs(rate * value) <= LEVEL * amplitude:
            ended.append(f"the peak does not depend on {self.request.parameter} at {value:g}")
            ways = [down, up]
        for factor in ways:
            best, why = self._descended(first, value * factor)
            if best is not None:
                return best, ""
            ended.append(
                f"no optimum of {self.request.parameter} was found from {value:g} to {value * factor:g}: {why}"
            )
        return None, "; ".join(ended)

    def _descended(self, first: Highest, stop: float) -> tuple[_Optimal | None, str]:
        """The first minimum of the highest peak up to ``stop`` that is lower than at the start; or why there is none.

        Where another peak is the highest at the end of the one followed, the other is followed from where both are
        equally high. A peak is left where it rises above the start.
        """
        request, value, here = self.request, self.request.start, first
        for _ in range(_MOST_PEAKS):
            peaks, best, last = self.continuation(value, stop), None, None
            for peak in peaks.points(here.y):
                pass_on()
                self.doing = f"following the peak, {request.parameter} = {peak.parameter:.6g}"
                last = peak if peak.detail.bend < 0.0 else last
                if peak.kind == OPTIMUM:
                    best = self._newton(peak.y, peak.parameter)
                    if best is not None and best.peak.detail.amplitude < first.amplitude:
                        last = best.peak
                        break
                    best = None
                if last is not None and last.detail.amplitude > (1.0 + _RISEN) * first.amplitude:
                    break
            if last is None:
                return None, peaks.message
            other = self.higher(last)
            if other is None:
                amplitude = last.detail.amplitude
                ends = (
                    f"the highest peak is {first.amplitude:.6g} at {request.start:g} and {amplitude:.6g} at "
                    f"{last.parameter:.6g}, without a lower minimum between"
                )
                ended = peaks.outcome is None or peaks.outcome.ok
                return best, ends if ended else f"{ends}; there {peaks.message}"
            change = self._change(value, here, last.parameter, other)
            if change is None:
                return None, (
                    f"at {last.parameter:.6g} another peak is higher, {other.amplitude:.6g} at {other.omega:.6g} "
                    f"{request.problem.units.angular}, and where it becomes the highest was not found"
                )
            left, taken = change
            amplitude, at = taken.peak.detail.amplitude, taken.peak.parameter
            if left is not None and left.falls and not taken.falls and amplitude < first.amplitude:
                return self._at_equal(taken.peak, self._equal(left.peak, taken.peak)), ""
            if not taken.falls:
                return None, (
                    f"the highest peak is {first.amplitude:.6g} at {request.start:g} and {amplitude:.6g} at {at:.6g}, "
                    "where it rises; no minimum was found between"
                )
            value, here = at, Highest(taken.peak.y, amplitude)
        return None, f"the highest peak is another one more than {_MOST_PEAKS} times"

    def _equal(self, one: PeakPoint, other: PeakPoint) -> str:
        """What is said of two peaks that are equally high."""
        unit = self.request.problem.units.angular
        low, high = sorted((one.detail.omega, other.detail.omega))
        return (
            f"two peaks are equally high there, at {low:.6g} and {high:.6g} {unit}: with another value one of them is "
            "higher"
        )

    def _at_equal(self, peak: PeakPoint, equal: str) -> _Optimal:
        """The optimum where two peaks are equally high."""
        return _Optimal(peak._replace(kind=OPTIMUM), np.full((2, 2), np.nan), equal)

    def _change(
        self, low: float, at_low: Highest, high: float, at_high: Highest
    ) -> tuple[_Sloped | None, _Sloped] | None:
        """Where another peak becomes the highest between two values: the peak that is left, None where it ends there,
        and the one that is taken.

        The range is halved to where the frequency of the highest peak jumps, until both peaks are found at both ends.
        """
        request = self.request
        self.doing = "looking for the value at which another peak becomes the highest"
        for _ in range(_HALVINGS):
            if abs(high - low) <= _NARROW * abs(high):
                both = self._equally_high(low, at_low.y, high, at_high.y)
                if both is not None:
                    return both
            if abs(high - low) <= _SAME_OPTIMUM * abs(high):
                taken = self._sloped(at_high.y, high, _ASIDE * float(np.sign(high - low)) * abs(high))
                return None if taken is None else (None, taken)
            middle = float(np.sign(low) * np.sqrt(low * high)) if low * high > 0.0 else 0.5 * (low + high)
            found = request.highest(self.system, middle)
            self.curves += 1
            if found is None:
                return None
            if abs(np.log(found.omega / at_low.omega)) > abs(np.log(found.omega / at_high.omega)):
                high, at_high = middle, found
            else:
                low, at_low = middle, found
        return None

    def _equally_high(self, low: float, one: Array, high: float, other: Array) -> tuple[_Sloped, _Sloped] | None:
        """``_change`` at two peaks, the ``one`` found at ``low`` and the ``other`` at ``high``; None where either does
        not exist at both ends."""

        def ahead(value: float) -> float | None:
            """How much higher the other peak is, over the one."""
            pair = self._peak(one, value), self._peak(other, value)
            if pair[0] is None or pair[1] is None:
                return None
            return pair[1].detail.amplitude / pair[0].detail.amplitude - 1.0

        ends = ahead(low), ahead(high)
        if ends[0] is None or ends[1] is None or not ends[0] < 0.0 < ends[1]:
            return None
        root = BracketedRoot(low, ends[0], high, ends[1])
        for _ in range(_EQUAL_TRIALS):
            if root.width <= _EQUAL_WIDTH * abs(high):
                break
            between = ahead(root.trial)
            if between is None:
                return None
            root.update(root.trial, between, _EQUAL_WIDTH * abs(high))
        step = _ASIDE * (high - low)
        left, taken = (self._sloped(y, root.best, step) for y in (one, other))
        return None if left is None or taken is None else (left, taken)

    def _sloped(self, y: Array, value: float, step: float) -> _Sloped | None:
        """The peak next to ``y`` at a value of the parameter, and whether it falls over a ``step``."""
        peak, beyond = self._peak(y, value), self._peak(y, value + step)
        if peak is None or beyond is None:
            return None
        return _Sloped(peak, beyond.detail.amplitude < peak.detail.amplitude)

    def _peak(self, y: Array, value: float) -> PeakPoint | None:
        """The peak next to ``y`` at a value of the parameter; None where there is none."""
        scale = np.full(y.size, norm(y[:-1]) or 1.0)
        scale[-1] = y[-1]
        result = newton(lambda trial: self.system.evaluate(trial, value), y, options=NEWTON, scale=scale)
        found: PeakPoint | None = None
        if result.converged and result.evaluation.detail is not None and result.evaluation.detail.bend < 0.0:
            residual = relative(result.evaluation.residual[:-1], result.evaluation.terms()[:-1])
            found = PeakPoint(result.x, value, result.evaluation.detail, "regular", residual, result.iterations)
        else:
            found = bracketed_peak(self.system, value, y, None)
        near = found is not None and abs(found.detail.omega / y[-1] - 1.0) <= _SAME_FREQUENCY
        return found if near else None


class _Sloped(NamedTuple):
    """A peak, and whether it falls in the direction of the search."""

    peak: PeakPoint
    falls: bool


class _Optimal(NamedTuple):
    """A minimum of the highest peak over the parameter."""

    peak: PeakPoint
    hessian: Array
    equal: str = ""
    """What is said where two peaks are equally high; empty elsewhere."""

    @property
    def u(self) -> Array:
        """Unknowns, frequency and parameter, (N + 2,)."""
        return np.append(self.peak.y, self.peak.parameter)
