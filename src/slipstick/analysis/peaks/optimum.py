"""The value of a parameter at which a peak is lowest (or highest), in one Newton iteration, without a scan."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from slipstick.analysis.events import EventFunction
from slipstick.analysis.peaks.continuation import LEVEL, OPTIMUM, PeakPoint
from slipstick.analysis.peaks.gradient import Displaced, Extreme, PeakGradient
from slipstick.analysis.peaks.system import PeakDetail, PeakSystem
from slipstick.analysis.peaks.tracking import PeakRun, TrackedPeak, tracked_peak
from slipstick.analysis.sensitivity.linearization import FREQUENCY, Linearization, Move
from slipstick.balance.problem import Problem
from slipstick.balance.residual import terms
from slipstick.balance.scaling import scales
from slipstick.branch import Branch
from slipstick.errors import Outcome
from slipstick.interrupts import pass_on
from slipstick.results.record import Point
from slipstick.solve.linear.bordered import Eliminated
from slipstick.solve.newton import Evaluation, NewtonOptions, NewtonResult, newton
from slipstick.solve.norm import norm, relative
from slipstick.typing import Array, FrequencyRange, Real

_NEWTON = NewtonOptions(max_iterations=15, min_damping=0.5, patience=4, non_monotone=3)
_SEARCHED = 30.0
"""How many times smaller and larger the parameter may become where it is sought by tracking."""


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """Where a peak is lowest or highest over a parameter.

    Attributes
    ----------
    parameter, dof
        Names.
    value, omega, amplitude
        Of the parameter, rad/s, and of the peak there; nan where none was found.
    kind
        "lowest" or "highest"; empty where none was found.
    hessian
        Second derivatives (2, 2) of the amplitude by frequency and parameter along the solutions, symmetric.
    factorisations
        Of Jacobians that Newton's method took.
    branch
        The point itself with everything results hold; its problem has the parameter.
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
    request = tracked_peak(problem, parameter, start, omega, dof, (), options, listeners)
    search = OptimumRequest(**vars(request)).run()
    return search.optimum(Branch.of(search.solutions()))


class OptimumSystem:
    """``(R, da/dw, da/ds) = 0`` for the unknowns ``(X, w, s)``."""

    def __init__(self, peaks: PeakSystem, context: Array | None) -> None:
        self.peaks, self._context = peaks, context
        self.hessian: Array = np.full((2, 2), np.nan)

    def evaluate(self, u: Array) -> Evaluation:
        """Residual and Jacobian; of the balance one factorisation."""
        sloped = self.peaks.slope(u[:-1], float(u[-1]), self._context) if np.all(np.isfinite(u)) else None
        if sloped is None:
            return Evaluation.undefined(u.size)
        here, over_w = sloped
        space, s = self.peaks.space, float(u[-1])
        along = space.along(s)
        over_s = PeakGradient(space, here, s, over_w.extreme, along, over_w.z)
        sides = over_w.displaced(here.omega), over_s.displaced(abs(s) or 1.0)
        turned = tuple(space.along(v) for v in sides[1].values)
        rows = np.array([self._row(sides[0], (along,)), self._row(sides[1], turned)])
        steps = np.column_stack([over_w.t, over_s.t])
        self.hessian = rows @ np.vstack([steps, np.eye(2)])
        columns = np.column_stack([over_w.R, over_s.R])
        return Evaluation(
            np.concatenate([here.at.residual, [over_w.value, over_s.value]]),
            Eliminated(here.jacobian, columns, rows, -steps), None, here,
            lambda: np.concatenate([terms(self.peaks.balance, here.x, here.at), [over_w.size, over_s.size]]),
        )  # fmt: skip

    @staticmethod
    def _row(side: Displaced, along: tuple[Move, ...]) -> Array:
        """Gradient of a slope over all unknowns."""
        return np.concatenate([side.by_motion(), [side.along(FREQUENCY), side.along(*along)]])


@dataclass(frozen=True, kw_only=True)
class OptimumRequest(TrackedPeak):
    """A peak whose optimum over the parameter is sought."""

    analysis: ClassVar[str] = "optimal"

    def run(self) -> OptimumSearch:
        """What finds it."""
        return OptimumSearch(self)


class OptimumSearch(PeakRun):
    """The way to an optimum: its one point."""

    def __init__(self, request: TrackedPeak) -> None:
        super().__init__(request)
        self._best: _Stationary | None = None
        self._factorisations = 0

    def points(self) -> Generator[Point, None, None]:
        """The optimum: by Newton's method from the highest peak, or from where tracking leads to."""
        self.doing = self.sought
        y = self.request.first(self.system)
        if y is None:
            self.outcome, self.message = Outcome.NO_FIRST_POINT, self.none_found
            return
        self.system.factorisations, self.doing = 0, "going to the optimum"
        self._best, message = self._newton(y, self.request.start), ""
        if self._best is None:
            self._best, message = self._tracked(y)
        self._factorisations = self.system.factorisations
        self.outcome = Outcome.STEP_TOO_SMALL if self._best is None else Outcome.COMPLETED
        self.message = message or self.outcome.text
        if self._best is not None:
            yield self.point(self._best.peak)

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Whose peak, and the work."""
        return {"peak_of": self.request.dof, "factorisations": self._factorisations}

    def optimum(self, branch: Branch) -> Optimum:
        """What was found, with the branch of its one point."""
        request, best = self.request, self._best if len(branch) else None
        peak = None if best is None else best.peak
        return Optimum(
            parameter=request.parameter, dof=request.dof, branch=branch, factorisations=self._factorisations,
            value=np.nan if peak is None else peak.parameter, omega=np.nan if peak is None else peak.detail.omega,
            amplitude=np.nan if peak is None else peak.detail.amplitude, kind="" if best is None else best.kind,
            hessian=np.full((2, 2), np.nan) if best is None else best.hessian,
        )  # fmt: skip

    def _newton(self, y: Array, value: float, context: Array | None = None) -> _Stationary | None:
        """The optimum next to a state; None where the iteration fails, or ends at another kind of point."""
        system = OptimumSystem(self.system, context)
        size = scales(self.system.balance, self.system.at(value)[0], float(y[-1])).displacement
        scale = np.full(y.size + 1, max(size, norm(y[:-1])))
        scale[-2:] = y[-1], abs(value) or 1.0
        result = newton(system.evaluate, np.append(y, value), options=_NEWTON, scale=scale)
        H = system.hessian
        near = abs(value) / _SEARCHED <= abs(result.x[-1]) <= abs(value) * _SEARCHED or value == 0.0
        if not (result.converged and near and H[0, 0] < 0.0):
            return None
        bend, amplitude = float(np.linalg.det(H) / H[0, 0]), self._amplitude(result.evaluation.detail)
        if abs(bend) * float(result.x[-1]) ** 2 <= LEVEL * amplitude:
            return None  # a plateau
        return _Stationary(self._peak(result, H, amplitude), H, "lowest" if bend > 0.0 else "highest")

    @staticmethod
    def _peak(result: NewtonResult, hessian: Array, amplitude: float) -> PeakPoint:
        u, evaluation = result.x, result.evaluation
        here = evaluation.detail
        detail = PeakDetail(
            responses=here.detail.responses, inputs=here.detail.inputs, omega=float(u[-2]), states=here.detail.states,
            amplitude=amplitude, rate=0.0, bend=float(hessian[0, 0]), ahead=0.0, motion=here.motion()[0],
            extreme=Extreme.largest(here.outputs.balance.harmonics, here.motion()[0]),
        )  # fmt: skip
        residual = relative(evaluation.residual[:-2], evaluation.terms()[:-2])
        return PeakPoint(u[:-1], float(u[-1]), detail, OPTIMUM, residual, result.iterations)

    def _amplitude(self, here: Linearization) -> float:
        return Extreme.largest(self.request.problem.harmonics, here.motion()[0]).value

    def _tracked(self, y: Array) -> tuple[_Stationary | None, str]:
        """The optimum the peak comes by where it is tracked to where it falls, from a plateau both ways; polished."""
        value = self.request.start
        at = self.system.evaluate(y, value)
        rate, amplitude = (at.detail.rate, at.detail.amplitude) if at.detail is not None else (np.nan, np.nan)
        down, up, ended = 1.0 / _SEARCHED, _SEARCHED, list[str]()
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
    peak: PeakPoint
    hessian: Array
    kind: str
