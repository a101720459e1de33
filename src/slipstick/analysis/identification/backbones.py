"""What a problem predicts of backbones: peaks of the response over the load, and nonlinear modes over the amplitude.

A peak is a solution of ``(R, G) = 0``, the balance with ``G = da/dw``, for ``(X, w)``: its derivatives by parameters
are ``-J^-1 (R_p, G_p)``, with the exact Jacobian of ``analysis/peaks/system.py``. A point of a nonlinear mode is one of
``analysis/modes/system.py`` for motion, frequency and damping; there the derivatives of the residual by the parameters
are central differences at the solution, and nothing is solved again.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from math import log
from typing import NamedTuple

import numpy as np

from slipstick.analysis.curve.follow import frequency_request
from slipstick.analysis.identification.kinds import Backbone
from slipstick.analysis.identification.measured import conditions_at
from slipstick.analysis.modes.following import first_guess
from slipstick.analysis.modes.free_problem import FreeProblem, free_problem
from slipstick.analysis.modes.start import LinearMode
from slipstick.analysis.modes.system import Beside, ModeSystem, damping_rate
from slipstick.analysis.peaks.gradient import StateSpace
from slipstick.analysis.peaks.system import PeakSystem
from slipstick.analysis.road.run import stopped_too
from slipstick.analysis.sensitivity.linearization import Move
from slipstick.balance.balance import Balance
from slipstick.balance.problem import Problem
from slipstick.errors import SlipstickError, SlipstickWarning
from slipstick.results.record import Outputs, contact_states, unknowns
from slipstick.results.sensitivities import direction_of
from slipstick.solve.newton import NewtonOptions, newton
from slipstick.solve.norm import norm
from slipstick.typing import Array, IntArray

_NEWTON = NewtonOptions(tolerance=1e-11, stagnation=1e-8, max_iterations=30)
_ASIDE = (0.6, 1.6)
"""Peaks are first looked for between these shares of the lowest and highest measured frequency."""
_PARTS = 32
"""A change of parameters or of amplitude is made in at most so many parts where it is too much at once."""


class _Kept(NamedTuple):
    """A solution with the parameters it belongs to."""

    p: Array
    y: Array
    context: Array | None


class PeakPredictor:
    """Where peaks are and how high, each followed from the parameters before to those that are tried."""

    def __init__(self, problem: Problem, names: Sequence[str], measured: Backbone) -> None:
        self.problem, self.names, self.measured = replace(problem, told=None), tuple(names), measured
        self._kept: list[_Kept | None] = [None] * measured.omega.size
        self._tried: list[_Kept] = []
        self.several, self.solved = 0, 0

    def _problem_at(self, point: int, p: Array) -> Problem:
        return conditions_at(self.problem, self.names, p, self.measured.conditions, point)

    def _system(self, problem: Problem) -> PeakSystem:
        balance = Balance(problem)
        balance.anchor_if_undamped(float(self.measured.omega[0]))
        return PeakSystem(StateSpace(Outputs(balance, (self.measured.dof,)), problem.inputs))

    def begin(self, p: Array) -> bool:
        """Follow the curves at these parameters; of several peaks those nearest to what was measured are meant."""
        self.several, changed = 0, False
        for group in self.measured.groups:
            found = list(self._peaks(self._problem_at(int(group[0]), p), group))
            self.several += len(group) if len(found) > 1 else 0
            for point in group.tolist():
                if not found:
                    continue
                near = min(found, key=lambda peak: self._distance(peak, point))
                old, self._kept[point] = self._kept[point], near._replace(p=p.copy())
                changed |= old is not None and abs(old.y[-1] - near.y[-1]) > 0.02 * near.y[-1]
        return changed

    def _distance(self, peak: _Kept, point: int) -> float:
        return abs(float(peak.y[-1]) / float(self.measured.omega[point]) - 1.0)

    def _peaks(self, problem: Problem, group: IntArray) -> Iterator[_Kept]:
        """Unknowns and frequency of the peaks of the curve."""
        omega = self.measured.omega[group]
        span = _ASIDE[0] * float(omega.min()), _ASIDE[1] * float(omega.max())
        problem = replace(problem, outputs=[self.measured.dof])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            branch = frequency_request(problem, span, peaks_of=[self.measured.dof]).solutions()
        stopped_too(branch.outcome)
        table, balance = branch.table, Balance(problem)
        for point in np.flatnonzero(table["peak_dof"].to_numpy() == 0).tolist() if len(branch) else []:
            x = unknowns(table, problem, point).reshape(-1)
            near = contact_states(table, balance, point)
            context = None if near is None else np.append(np.nan, near)
            yield _Kept(np.empty(0), np.append(x, table["omega"].to_numpy()[point]), context)

    def values(self, p: Array) -> Array:
        """Frequencies and amplitudes (n, 2)."""
        out = np.full_like(self.measured.values, np.nan)
        self._tried = []
        for point, kept in enumerate(self._kept):
            found = None if kept is None else self._follow(point, kept, p)
            if found is None:
                return np.full_like(out, np.nan)
            self._tried.append(found[0])
            out[point] = found[0].y[-1], found[1]
        return out

    def _follow(self, point: int, kept: _Kept, p: Array) -> tuple[_Kept, float] | None:
        parts = 1
        while parts <= _PARTS:
            last: _Kept | None = kept
            amplitude = np.nan
            for part in range(1, parts + 1):
                between = kept.p + (part / parts) * (p - kept.p)
                assert last is not None
                system = self._system(self._problem_at(point, between))
                scale = np.append(np.full(last.y.size - 1, norm(last.y[:-1]) or 1.0), last.y[-1])
                self.solved += 1
                try:
                    result = newton(
                        partial(system.evaluate, parameter=0.0, context=last.context), last.y,
                        options=_NEWTON, scale=scale,
                    )  # fmt: skip
                except SlipstickError:
                    last = None
                    break
                if not result.converged or not result.evaluation.detail.bend < 0.0:
                    last = None
                    break
                amplitude = result.evaluation.detail.amplitude
                last = _Kept(between, result.x, result.evaluation.context)
            if last is not None:
                return last, float(amplitude)
            parts *= 4
        return None

    def slopes(self, p: Array) -> Array:
        """Their derivatives (n_p, n, 2)."""
        out = np.empty((len(p), *self.measured.values.shape))
        for point, tried in enumerate(self._tried):
            problem = self._problem_at(point, p)
            system = self._system(problem)
            at = system.state(tried.y, 0.0, tried.context)
            assert at is not None
            moves = [Move(inputs=direction_of(problem, name)) for name in self.names]
            for k, (dy, move) in enumerate(zip(at.slopes(moves).T, moves, strict=True)):
                out[k, point] = dy[-1], np.sum(at.detail.extreme.h * at.here.change(*system.moved(at, dy, move))[1])
            self._kept[point] = tried
        return out


class ModePredictor:
    """Frequency and damping ratio of a nonlinear mode at measured amplitudes."""

    several = 0

    def __init__(self, problem: Problem, names: Sequence[str], measured: Backbone) -> None:
        self.problem, self.names, self.measured = replace(problem, told=None), tuple(names), measured
        self.solved = 0
        self._found: list[Array] = []
        self._systems: list[ModeSystem] = []

    def begin(self, p: Array) -> bool:
        """There is one answer."""
        return False

    def _problem_at(self, point: int, p: Array) -> Problem:
        return conditions_at(self.problem, self.names, p, self.measured.conditions, point)

    def _free(self, point: int, p: Array) -> tuple[FreeProblem, LinearMode]:
        return free_problem(self._problem_at(point, p), self.measured.mode - 1, self.measured.dof)

    def _system(self, point: int, p: Array, amplitude: float) -> tuple[ModeSystem, Array, float]:
        """The equations, the linear mode at an amplitude, and its frequency."""
        free, linear = self._free(point, p)
        guess = first_guess(free.balance, free.target, linear, amplitude)
        system = free.system(guess[:-2], at_dof=True)
        guess[:-2] /= system.sizes(amplitude)
        return system, guess, linear.omega

    def values(self, p: Array) -> Array:
        """Frequencies and damping ratios (n, 2)."""
        out = np.full_like(self.measured.values, np.nan)
        self._found = [np.empty(0)] * len(out)
        self._systems = []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            for group in self.measured.groups:
                order = group[np.argsort(self.measured.amplitude[group])]
                system, y, unit = self._system(int(order[0]), p, float(self.measured.amplitude[order[0]]))
                at: float | None = None
                for point in order.tolist():
                    amplitude = float(self.measured.amplitude[point])
                    found = self._reached(system, y, unit, at, log(amplitude))
                    if found is None:
                        return np.full_like(out, np.nan)
                    y, at = found, log(amplitude)
                    self._found[point] = y
                    out[point] = y[-2], y[-1] / (2.0 * y[-2])
        return out

    def _reached(self, system: ModeSystem, y: Array, unit: float, at: float | None, to: float) -> Array | None:
        """The mode at log amplitude ``to`` from one at ``at`` (None: the linear one), in parts where that is far."""
        scale = np.ones(y.size)
        scale[-2:] = unit
        parts = 1
        while parts <= _PARTS:
            now: Array | None = y
            begin = to - 4.0 * (parts > 1) if at is None else at
            for part in range(1, parts + 1):
                parameter = begin + (part / parts) * (to - begin)
                assert now is not None
                self.solved += 1
                try:
                    result = newton(partial(system.evaluate, parameter=parameter), now, options=_NEWTON, scale=scale)
                except SlipstickError:
                    now = None
                    break
                now = result.x if result.converged else None
                if now is None:
                    break
            if now is not None:
                return now
            parts *= 4
        return None

    def slopes(self, p: Array) -> Array:
        """Their derivatives (n_p, n, 2)."""
        out = np.empty((len(p), *self.measured.values.shape))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            for group in self.measured.groups:
                first = int(group[0])
                here = self._beside(first, p)
                sides = [Beside(partial(self._with, first, p, k), float(value)) for k, value in enumerate(p)]
                for point in group.tolist():
                    y, at = self._found[point], log(float(self.measured.amplitude[point]))
                    J = here.evaluate(y, at).jacobian
                    for k, side in enumerate(sides):
                        dy = -J.solve(side.rates(here, y, at)[0])
                        out[k, point] = dy[-2], damping_rate(y, dy)
        return out

    def _beside(self, point: int, p: Array) -> ModeSystem:
        return self._system(point, p, float(self.measured.amplitude[point]))[0]

    def _with(self, point: int, p: Array, k: int, value: float) -> ModeSystem:
        """The equations with the value of one parameter."""
        moved = p.copy()
        moved[k] = value
        return self._beside(point, moved)
