"""The value of a parameter at which a peak is lowest (or highest), in one Newton iteration, without a scan."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from slipstick.analysis.locus import LEVEL, OPTIMUM, LocusPoint
from slipstick.analysis.neighbourhood import FREQUENCY, Move, Neighbourhood
from slipstick.analysis.peak_system import PeakDetail, PeakSystem
from slipstick.analysis.slope import Displaced, Extreme, Slope
from slipstick.analysis.threads import one_thread
from slipstick.analysis.tracking import TrackedPeak, tracked_peak
from slipstick.balance.problem import Problem
from slipstick.balance.residual import terms
from slipstick.balance.scaling import scales
from slipstick.errors import Outcome
from slipstick.results.branch import Branch
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
    options
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
    request = tracked_peak(problem, parameter, start, omega, dof, (), options)
    with one_thread():
        return _Search(request).optimum()


class OptimumSystem:
    """``(R, da/dw, da/ds) = 0`` for the unknowns ``(X, w, s)``."""

    def __init__(self, peaks: PeakSystem, context: Array | None) -> None:
        self.peaks, self._context = peaks, context
        self.hessian: Array = np.full((2, 2), np.nan)

    def evaluate(self, u: Array) -> Evaluation:
        """Residual and Jacobian; of the balance one factorisation."""
        found = self.peaks.slope(u[:-1], float(u[-1]), self._context) if np.all(np.isfinite(u)) else None
        if found is None:
            return Evaluation.undefined(u.size)
        here, over_w = found
        space, s = self.peaks.space, float(u[-1])
        along = space.along(s)
        over_s = Slope(space, here, s, over_w.extreme, along, over_w.z)
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


class _Search:
    """The way to an optimum."""

    def __init__(self, request: TrackedPeak) -> None:
        self.request = request
        self.system, self.warnings = request.system(), request.warned()

    def optimum(self) -> Optimum:
        """What was found."""
        request, clock = self.request, time.perf_counter()
        y, outcome, message = None, Outcome.COMPLETED, ""
        try:
            y = request.first(self.system)
            if y is None:
                return self._made(None, Outcome.NO_FIRST_POINT, request.none_found, 0, clock)
            self.system.factorisations = 0
            found = self._newton(y, request.span[0])
            if found is None:
                found, message = self._tracked(y)
            taken = self.system.factorisations
        except KeyboardInterrupt:
            return self._made(None, Outcome.INTERRUPTED, Outcome.INTERRUPTED.text, 0, clock)
        outcome = Outcome.COMPLETED if found is not None else Outcome.STEP_TOO_SMALL
        return self._made(found, outcome, message, taken, clock)

    def _newton(self, y: Array, value: float, context: Array | None = None) -> _Found | None:
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
        return _Found(result, system, "lowest" if bend > 0.0 else "highest")

    def _amplitude(self, here: Neighbourhood) -> float:
        return Extreme.largest(self.request.problem.harmonics, here.motion()[0]).value

    def _tracked(self, y: Array) -> tuple[_Found | None, str]:
        """The optimum the peak comes by where it is tracked to where it falls, from a plateau both ways; polished."""
        value = self.request.span[0]
        at = self.system.evaluate(y, value)
        rate, amplitude = (at.detail.rate, at.detail.amplitude) if at.detail is not None else (np.nan, np.nan)
        down, up, ended = 1.0 / _SEARCHED, _SEARCHED, list[str]()
        ways = [up if rate * np.sign(value) < 0.0 else down]
        if abs(rate * value) <= LEVEL * amplitude:
            ended.append(f"the peak does not depend on {self.request.parameter} at {value:g}")
            ways = [down, up]
        for factor in ways:
            locus = self.request.locus(self.system, (value, value * factor))
            for point in locus.points(y):
                if point.kind == OPTIMUM:
                    found = self._newton(point.y, point.parameter)
                    if found is not None:
                        return found, ""
            none = f"no optimum of {self.request.parameter} was found from {value:g} to {value * factor:g}"
            ended.append(f"{none}: {locus.message}")
        return None, "; ".join(ended)

    def _made(self, found: _Found | None, outcome: Outcome, message: str, taken: int, clock: float) -> Optimum:
        request, points = self.request, list[LocusPoint]()
        value = omega = amplitude = np.nan
        hessian, kind = np.full((2, 2), np.nan), ""
        if found is not None:
            u, evaluation = found.result.x, found.result.evaluation
            here, value, omega = evaluation.detail, float(u[-1]), float(u[-2])
            amplitude = self._amplitude(here)
            hessian, kind = found.system.hessian, found.kind
            residual = relative(evaluation.residual[:-2], evaluation.terms()[:-2])
            detail = PeakDetail(
                responses=here.found.responses, inputs=here.found.inputs, omega=omega, heat=here.found.heat,
                amplitude=amplitude, rate=0.0, bend=float(hessian[0, 0]), ahead=0.0,
            )  # fmt: skip
            points = [LocusPoint(u[:-1], value, detail, OPTIMUM, residual, found.result.iterations)]
        branch = request.recorded(
            points, outcome, message or outcome.text, self.warnings, factorisations=taken,
            seconds=time.perf_counter() - clock,
        )  # fmt: skip
        return Optimum(
            parameter=request.parameter, dof=request.dof, value=value, omega=omega, amplitude=amplitude, kind=kind,
            hessian=hessian, factorisations=taken, branch=branch,
        )  # fmt: skip


class _Found(NamedTuple):
    result: NewtonResult
    system: OptimumSystem
    kind: str
