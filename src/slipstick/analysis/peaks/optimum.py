"""The value of a parameter at which a peak is lowest or highest, by one Newton iteration instead of a scan."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar, NamedTuple

import numpy as np

from slipstick.analysis.augmented import Augmented, Bordered
from slipstick.analysis.peaks.continuation import LEVEL, OPTIMUM, PeakPoint
from slipstick.analysis.peaks.system import Displaced, Extreme, PeakDetail, PeakGradient, PeakSystem
from slipstick.analysis.peaks.tracking import PeakRun, TrackedPeak, tracked_peak
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
from slipstick.solve.linear.jacobian import Eliminated
from slipstick.solve.newton import Evaluation, NewtonOptions, newton
from slipstick.solve.norm import norm, relative
from slipstick.typing import Array, FrequencyRange, Real

_NEWTON = NewtonOptions(max_iterations=15, min_damping=0.5, patience=4, non_monotone=3)
_SEARCH_FACTOR = 30.0
"""Factor by which the parameter may shrink or grow in the search by tracking."""
_SAME_OPTIMUM = 1e-6
"""Relative difference of the parameter up to which two optima are the same."""


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """The value of a parameter at which a peak is lowest or highest.

    Attributes
    ----------
    parameter, dof
        Names.
    value, omega, amplitude
        Value of the parameter, frequency in rad/s and amplitude of the peak; nan where none was found.
    kind
        "lowest" or "highest"; empty where none was found.
    hessian
        Second derivatives (2, 2) of the amplitude by frequency and parameter along the solutions, symmetric.
    factorisations
        Number of factorised Jacobians of the balance.
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
    """The value of a parameter at which a peak is lowest, such as the best normal load of a damper.

    One Newton iteration on motion, frequency and parameter with ``da/dw = 0`` and ``da/ds = 0``; where it starts too
    far away the peak is tracked towards the optimum first.

    Parameters
    ----------
    problem
        What vibrates.
    parameter
        Name as of ``parameter_response``.
    omega
        Range of frequencies, rad/s, whose highest peak at ``start`` is meant. It may leave the range.
    dof
        Name of the output whose amplitude peaks; by default the first.
    start
        Value of the parameter to begin at; by default that of the problem.
    options, listeners
        As of ``track_peak``.

    Returns
    -------
    Optimum
        With value, frequency and amplitude; look at ``outcome``. A maximum over the parameter is one too: ``kind``.

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
            return replace(point, own={**point.own, **own, **counts})

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
        self._best: _Stationary | None = None
        self._factorisations, self._followed = 0, False

    def points(self) -> Generator[Point, None, None]:
        """The optimum; or the peak around it, then the optimum unless one of its points is that."""
        own = self.request.checkpoints[-1].own if self.request.checkpoints else None
        if own is None:
            self._best = self._find()
        else:
            system, u = OptimumSystem(self.system, None), own["optimum"]
            self._best = self._stationary(system, u, system.evaluate(u, float(u[-1])), own["optimum_iterations"])
            self._factorisations = own["optimum_factorisations"]
        if self._best is None:
            return
        best, u, passed, part = self._best.peak, self._best.u, False, 0
        kept = {
            "optimum": u, "optimum_iterations": best.iterations, "optimum_factorisations": self._factorisations
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

    def _find(self) -> _Stationary | None:
        """The optimum by Newton's method from the highest peak, or from the tracked one; None where none is found."""
        self.doing = self.sought
        y = self.request.first(self.system)
        if y is None:
            self.outcome, self.message = Outcome.NO_FIRST_POINT, self.none_found
            return None
        self.system.factorisations, self.doing = 0, "going to the optimum"
        best, message = self._newton(y, self.request.start), ""
        if best is None:
            best, message = self._tracked(y)
        self._factorisations = self.system.factorisations
        self.outcome = Outcome.STEP_TOO_SMALL if best is None else Outcome.COMPLETED
        self.message = message or self.outcome.text
        return best

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
            found = {"optimum": peak.parameter, "optimum_omega": peak.detail.omega, "optimum_kind": self._best.kind}
            found["optimum_amplitude"] = peak.detail.amplitude
        alone = {"peak_of": self.request.dof, "factorisations": self._factorisations}
        return {**(super().attributes if self._followed else alone), **found}

    def optimum(self, branch: Branch) -> Optimum:
        """The optimum, with the branch of its points."""
        request, best = self.request, self._best if len(branch) else None
        peak = None if best is None else best.peak
        return Optimum(
            parameter=request.parameter, dof=request.dof, branch=branch, factorisations=self._factorisations,
            value=np.nan if peak is None else peak.parameter, omega=np.nan if peak is None else peak.detail.omega,
            amplitude=np.nan if peak is None else peak.detail.amplitude, kind="" if best is None else best.kind,
            hessian=np.full((2, 2), np.nan) if best is None else best.hessian,
        )  # fmt: skip

    def _newton(self, y: Array, value: float, context: Array | None = None) -> _Stationary | None:
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

    def _stationary(
        self, system: OptimumSystem, u: Array, evaluation: Evaluation, iterations: int
    ) -> _Stationary | None:
        """The optimum at stationary unknowns, frequency and parameter (N + 2,); None where the peak is no maximum."""
        H, here = system.hessian, evaluation.detail
        if not H[0, 0] < 0.0:
            return None
        bend, amplitude = float(np.linalg.det(H) / H[0, 0]), self._amplitude(here)
        if abs(bend) * float(u[-1]) ** 2 <= LEVEL * amplitude:
            return None  # a plateau
        detail = PeakDetail(
            responses=here.detail.responses, inputs=here.detail.inputs, omega=float(u[-2]), states=here.detail.states,
            amplitude=amplitude, rate=0.0, bend=float(H[0, 0]), ahead=0.0, motion=here.motion()[0],
            extreme=Extreme.largest(here.outputs.balance.harmonics, here.motion()[0]),
        )  # fmt: skip
        assert evaluation.terms is not None
        residual = relative(evaluation.residual[:-2], evaluation.terms()[:-2])
        peak = PeakPoint(u[:-1], float(u[-1]), detail, OPTIMUM, residual, iterations)
        return _Stationary(peak, u, H, "lowest" if bend > 0.0 else "highest")

    def _amplitude(self, here: Linearization) -> float:
        return Extreme.largest(self.request.problem.harmonics, here.motion()[0]).value

    def _tracked(self, y: Array) -> tuple[_Stationary | None, str]:
        """The optimum on the peak tracked in the direction in which it falls, in both from a plateau; and a message."""
        value = self.request.start
        at = self.system.evaluate(y, value)
        rate, amplitude = (at.detail.rate, at.detail.amplitude) if at.detail is not None else (np.nan, np.nan)
        down, up, ended = 1.0 / _SEARCH_FACTOR, _SEARCH_FACTOR, list[str]()
        ways = [up if rate * np.sign(value) < 0.0 else down]
        if abs(rate * value) <= LEVEL * amplitude:
            ended.append(f"the peak does not depend on {self.request.parameter} at {value:g}")
            ways = [down, up]
        for factor in ways:
            peaks = self.continuation(value, value * factor)
            for peak in peaks.points(y):
                pass_on()
                self.doing = f"following the peak, {self.request.parameter} = {peak.parameter:.6g}"
                if peak.kind == OPTIMUM:
                    best = self._newton(peak.y, peak.parameter)
                    if best is not None:
                        return best, ""
            none = f"no optimum of {self.request.parameter} was found from {value:g} to {value * factor:g}"
            ended.append(f"{none}: {peaks.message}")
        return None, "; ".join(ended)


class _Stationary(NamedTuple):
    """A stationary point of the peak over the parameter."""

    peak: PeakPoint
    u: Array
    """Unknowns, frequency and parameter, (N + 2,)."""
    hessian: Array
    kind: str
