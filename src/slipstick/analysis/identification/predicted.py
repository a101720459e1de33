"""Predictions of the measured numbers, with exact derivatives by the parameters sought.

Loops and vibration at given frequencies are solutions of the balance. Of backbones, a peak of the response solves
``(R, G) = 0``, the balance with ``G = da/dw``, for ``(X, w)``: its derivatives by parameters are ``-J^-1 (R_p, G_p)``
with the Jacobian of ``analysis/peaks/system.py``. A point of a nonlinear mode solves the equations of
``analysis/modes/system.py`` for motion, frequency and damping. There the derivatives of the residual by the parameters
are central differences at the solution; nothing is solved again.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import log
from typing import NamedTuple, Protocol

import numpy as np

from slipstick.analysis.curve.follow import frequency_request
from slipstick.analysis.curve.steady import steady_request
from slipstick.analysis.identification.kinds import Backbone, Decay, Loops, Measured, Vibration
from slipstick.analysis.identification.measured import conditions_at
from slipstick.analysis.modes.following import first_guess
from slipstick.analysis.modes.free_problem import FreeProblem, LinearMode, free_problem
from slipstick.analysis.modes.system import BothSides, ModeSystem, damping_rate
from slipstick.analysis.peaks.system import Extreme, PeakSystem, StateSpace
from slipstick.analysis.road.run import stopped_too
from slipstick.analysis.sensitivity.linearization import Linearization, Move
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Detail, FrequencySystem, by_inputs
from slipstick.balance.problem import Problem
from slipstick.contact.law import Motion
from slipstick.errors import SlipstickError, SlipstickWarning
from slipstick.results.record import Outputs, contact_states, unknowns
from slipstick.results.sensitivities import direction_of
from slipstick.results.solutions import Solutions
from slipstick.solve.newton import NewtonOptions, newton
from slipstick.solve.norm import norm
from slipstick.typing import Array, IntArray

_MOTION_NEWTON = NewtonOptions(tolerance=1e-12, stagnation=1e-9, max_iterations=30)
_BACKBONE_NEWTON = NewtonOptions(tolerance=1e-11, stagnation=1e-8, max_iterations=30)
"""Options of Newton's method for motions at given frequencies, and for peaks and nonlinear modes."""
_MOTION_PARTS, _BACKBONE_PARTS = 16, 32
"""Number of parts that a change of parameters, or of amplitude, is divided into at most where Newton's method fails."""
_MARGIN = 0.03
"""Share by which the range of a followed curve exceeds that of the measured frequencies."""
_PEAK_RANGE = (0.6, 1.6)
"""Range in which peaks are sought: factors on the lowest and highest measured frequency."""
_SAME_MOTION = 1e-6
"""Relative difference below which two motions are the same."""


class Predictor(Protocol):
    """Predicts the measured numbers from parameters."""

    several: int
    """Number of points with more than one motion."""

    @property
    def solved(self) -> int:
        """Number of solved motions so far."""

    def begin(self, p: Array) -> bool:
        """Choose the motions at parameters (n_p,) nearest to the measurement; True if the choice has changed."""

    def values(self, p: Array) -> Array:
        """Predicted numbers at parameters (n_p,), of the shape of the measured ones; nan where there is no motion."""

    def slopes(self, p: Array) -> Array:
        """Derivatives of the predicted numbers at the last parameters, (n_p, ...)."""


def predictor_of(problem: Problem, names: Sequence[str], measured: Measured) -> Predictor:
    """The predictor for a kind of measurement."""
    match measured:
        case Decay():
            from slipstick.analysis.identification.decays import DecayPredictor

            return DecayPredictor(problem, names, measured)
        case Loops():
            return LoopPredictor(problem, names, measured)
        case Backbone():
            return (PeakPredictor if measured.kind == "peak" else ModePredictor)(problem, names, measured)
        case Vibration():
            return VibrationPredictor(problem, names, measured)
    raise NotImplementedError(type(measured).__name__)


class LoopPredictor:
    """Predicts forces of a contact whose motion is prescribed."""

    several = 0
    solved = 0

    def __init__(self, problem: Problem, names: Sequence[str], loops: Loops) -> None:
        pair = next(pair for pair in problem.contacts if pair.name == loops.contact)
        self._problem = replace(problem, contacts=[pair], loads=[], states=(), thermal=None, told=None)
        self.names, self.loops = tuple(names), loops
        self._slopes: Array = np.empty(0)

    def begin(self, p: Array) -> bool:
        """False: there is only one motion."""
        return False

    def values(self, p: Array) -> Array:
        """Coefficients of the force (n, L)."""
        out, slopes = np.empty_like(self.loops.values), np.empty((len(p), *self.loops.values.shape))
        problem = self._problem.at_parameters(dict(zip(self.names, p, strict=True)))
        for k, omega in enumerate(self.loops.omega):
            here = problem.at_parameters({name: v[k] for name, v in self.loops.conditions.items()})
            batch, inputs = here.batches[0], here.inputs
            moved = tuple(
                self.loops.motion.get(port, np.zeros_like(out))[[k]] + inputs.batches[0].motion[i]
                for i, port in enumerate(batch.law.ports)
            )
            motion = Motion(
                here.harmonics,
                float(omega),
                moved,
                inputs.batches[0].drift(omega),
                inputs.batches[0].velocity_per_omega,
            )
            response = batch.law.respond(motion, inputs.batches[0].values)
            out[k] = response.force[0][0]
            solution = Detail(responses=(response,), inputs=inputs, omega=float(omega))
            for i, name in enumerate(self.names):
                rates = by_inputs(solution, direction_of(here, name))[0]
                slopes[i, k] = rates[0][0] if 0 in rates else 0.0
        self._slopes = slopes
        return out

    def slopes(self, p: Array) -> Array:
        """Derivatives of the coefficients (n_p, n, L)."""
        return self._slopes


class _Solved(NamedTuple):
    """A motion and its parameters."""

    p: Array
    x: Array
    near: Array | None
    """Contact states."""
    rate: Array | None
    """Derivatives (n_p, N) of the unknowns by the parameters; None: not computed."""


@dataclass(frozen=True)
class _Level:
    """Points measured under the same conditions, and the balance at the current parameters."""

    balance: Balance
    outputs: Outputs
    directions: tuple[Move, ...]


class VibrationPredictor:
    """Predicts vibration at the measured points, each followed from the last parameters to new ones."""

    def __init__(self, problem: Problem, names: Sequence[str], measured: Vibration) -> None:
        self.problem, self.names, self.measured = replace(problem, told=None), tuple(names), measured
        self._groups = measured.groups
        self._kept: list[_Solved | None] = [None] * measured.omega.size
        """Motions at the last parameters."""
        self._tried: list[tuple[_Level, _Solved, Linearization] | None] = []
        self.several, self.solved = 0, 0

    def _problem_at(self, group: IntArray, p: Array) -> Problem:
        values = dict(zip(self.names, p, strict=True))
        values |= {name: float(v[group[0]]) for name, v in self.measured.conditions.items()}
        return self.problem.at_parameters(values)

    def _level(self, group: IntArray, p: Array, *, slopes: bool) -> _Level:
        here = self._problem_at(group, p)
        balance = Balance(here)
        balance.anchor_if_undamped(float(self.measured.omega[group[0]]))
        directions = tuple(Move(inputs=direction_of(here, name)) for name in self.names) if slopes else ()
        return _Level(balance, Outputs(balance, self.measured.dofs), directions)

    def begin(self, p: Array) -> bool:
        """Follow the curves at these parameters, and choose the motions nearest to the measurement."""
        changed, self.several = False, 0
        for group in self._groups:
            level = self._level(group, p, slopes=False)
            found = self._candidates(self._problem_at(group, p), self.measured.omega[group])
            for place, point in enumerate(group):
                motions = [self._solve(level, point, x, near) for x, near in found[place]]
                if (kept := self._kept[point]) is not None and np.array_equal(kept.p, p):
                    motions.append(self._solve(level, point, kept.x, kept.near))
                distinct = _distinct([m for m in motions if m is not None])
                self.several += len(distinct) > 1
                if not distinct:
                    continue
                best = min(distinct, key=lambda here: self._distance(here, level, point))
                old, self._kept[point] = self._kept[point], _Solved(p.copy(), best.x, best.detail.carried, None)
                same = (
                    old is not None and np.array_equal(old.p, p) and norm(old.x - best.x) <= _SAME_MOTION * norm(best.x)
                )
                changed |= old is not None and not same
        return changed

    def _candidates(self, problem: Problem, omega: Array) -> list[list[tuple[Array, Array | None]]]:
        """Unknowns and contact states of every motion at each frequency."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            each: list[list[tuple[Array, Array | None]]] = [[] for _ in omega]
            if len(omega) > 2:
                span = (float(omega.min()) * (1.0 - _MARGIN), float(omega.max()) * (1.0 + _MARGIN))
                self._gather(each, frequency_request(problem, span, omega, ()).solutions(), omega)
            missing = [k for k, found in enumerate(each) if not found]
            if missing:
                self._gather(each, steady_request(problem, omega=omega[missing]).solutions(), omega)
        return each

    def _gather(self, each: list[list[tuple[Array, Array | None]]], branch: Solutions, omega: Array) -> None:
        stopped_too(branch.outcome)
        table = branch.table
        if not len(branch):
            return
        assert branch.problem is not None
        balance, at = Balance(branch.problem), table["omega"].to_numpy()
        for point in np.flatnonzero(table["kind"].to_numpy() == "requested").tolist():
            x = unknowns(table, branch.problem, point).reshape(-1)
            for k in np.flatnonzero(np.abs(omega - at[point]) <= 1e-9 * at[point]):
                each[k].append((x, contact_states(table, balance, point)))

    def _distance(self, here: Linearization, level: _Level, point: int) -> float:
        """Distance of a motion from the measurement, over the noise where that is known."""
        left = self._read(here, level)[0] - self.measured.values[point]
        if self.measured.noise is not None:
            left = left / self.measured.noise[point]
        return float(np.nansum(left**2))

    def values(self, p: Array) -> Array:
        """Coefficients (n, n_dofs, L) or amplitudes (n, n_dofs)."""
        out = np.full_like(self.measured.values, np.nan)
        self._tried = [None] * self.measured.omega.size
        for group in self._groups:
            level = self._level(group, p, slopes=True)
            for point in group:
                here = self._follow(level, group, point, p)
                if here is None:
                    return np.full_like(out, np.nan)
                self._tried[point] = (level, _Solved(p.copy(), here.x, here.detail.carried, None), here)
                out[point] = self._read(here, level)[0]
        return out

    def slopes(self, p: Array) -> Array:
        """Derivatives (n_p, n, ...); the next motions are sought from those of this call."""
        out = np.empty((len(p), *self.measured.values.shape))
        for point, tried in enumerate(self._tried):
            assert tried is not None
            level, solved, here = tried
            rate, moved = here.solutions(level.directions)
            out[:, point] = self._read(here, level, moved)[1]
            self._kept[point] = solved._replace(rate=rate)
        return out

    def _read(self, here: Linearization, level: _Level, moved: Array | None = None) -> tuple[Array, Array]:
        """The measured quantity of a motion, and its change for changes (n_p, n_dofs, L) of the motion."""
        U = here.motion()
        if not self.measured.of_amplitude:
            return U, np.empty(0) if moved is None else moved
        extremes = [Extreme.largest(level.balance.harmonics, row) for row in U]
        value = np.array([extreme.value for extreme in extremes])
        if moved is None:
            return value, np.empty(0)
        h = np.array([extreme.h[0] for extreme in extremes])
        return value, np.asarray(np.einsum("pdl,dl->pd", moved, h))

    def _follow(self, level: _Level, group: IntArray, point: int, p: Array) -> Linearization | None:
        """The motion at a point from the stored one, in smaller changes of the parameters where one change fails."""
        kept = self._kept[point]
        if kept is None:
            return None
        here = self._step(level, point, kept, p)
        parts = 2
        while here is None and parts <= _MOTION_PARTS:
            last: _Solved | None = kept
            for part in range(1, parts):
                between = kept.p + (part / parts) * (p - kept.p)
                other = self._level(group, between, slopes=False)
                assert last is not None
                found = self._step(other, point, last, between)
                last = None if found is None else _Solved(between, found.x, found.detail.carried, None)
                if last is None:
                    break
            here = None if last is None else self._step(level, point, last, p)
            parts *= 4
        return here

    def _step(self, level: _Level, point: int, kept: _Solved, p: Array) -> Linearization | None:
        if kept.rate is not None:
            here = self._solve(level, point, kept.x + (p - kept.p) @ kept.rate, kept.near)
            if here is not None and norm(here.x - kept.x) <= 3.0 * (norm((p - kept.p) @ kept.rate) + norm(kept.x)):
                return here
        return self._solve(level, point, kept.x, kept.near)

    def _solve(self, level: _Level, point: int, x: Array, near: Array | None) -> Linearization | None:
        """The motion near unknowns (N,)."""
        balance, omega = level.balance, float(self.measured.omega[point])
        system, scale = FrequencySystem(balance, balance.problem.inputs), norm(x) or 1.0
        self.solved += 1
        try:
            found = newton(lambda z: system.evaluate(z, omega, near), x, options=_MOTION_NEWTON, scale=scale)
        except SlipstickError:
            return None
        if not found.converged:
            return None
        carried = found.evaluation.detail.carried
        return Linearization(level.outputs, found.x, omega, balance.problem.inputs, carried)


def _distinct(motions: Sequence[Linearization]) -> list[Linearization]:
    out: list[Linearization] = []
    for motion in motions:
        if all(norm(motion.x - other.x) > _SAME_MOTION * (norm(other.x) or 1.0) for other in out):
            out.append(motion)
    return out


class _Kept(NamedTuple):
    """A solution and its parameters."""

    p: Array
    y: Array
    context: Array | None


class PeakPredictor:
    """Predicts frequency and height of peaks, each followed from the last parameters to new ones."""

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
        """Follow the curves at these parameters, and choose the peaks nearest to the measurement."""
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
        span = _PEAK_RANGE[0] * float(omega.min()), _PEAK_RANGE[1] * float(omega.max())
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
        while parts <= _BACKBONE_PARTS:
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
                        options=_BACKBONE_NEWTON, scale=scale,
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
        """Derivatives (n_p, n, 2) of the predicted numbers."""
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
    """Predicts frequency and damping ratio of a nonlinear mode at measured amplitudes."""

    several = 0

    def __init__(self, problem: Problem, names: Sequence[str], measured: Backbone) -> None:
        self.problem, self.names, self.measured = replace(problem, told=None), tuple(names), measured
        self.solved = 0
        self._found: list[Array] = []
        self._systems: list[ModeSystem] = []

    def begin(self, p: Array) -> bool:
        """False: there is only one motion."""
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
        """The mode at log amplitude ``to`` from one at ``at`` (None: the linear one), in parts where one step fails."""
        scale = np.ones(y.size)
        scale[-2:] = unit
        parts = 1
        while parts <= _BACKBONE_PARTS:
            now: Array | None = y
            begin = to - 4.0 * (parts > 1) if at is None else at
            for part in range(1, parts + 1):
                parameter = begin + (part / parts) * (to - begin)
                assert now is not None
                self.solved += 1
                try:
                    result = newton(
                        partial(system.evaluate, parameter=parameter), now, options=_BACKBONE_NEWTON, scale=scale
                    )
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
        """Derivatives (n_p, n, 2) of the predicted numbers."""
        out = np.empty((len(p), *self.measured.values.shape))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            for group in self.measured.groups:
                first = int(group[0])
                here = self._system_at(first, p)
                sides = [BothSides(partial(self._system_with, first, p, k), float(value)) for k, value in enumerate(p)]
                for point in group.tolist():
                    y, at = self._found[point], log(float(self.measured.amplitude[point]))
                    J = here.evaluate(y, at).jacobian
                    for k, side in enumerate(sides):
                        dy = -J.solve(side.rates(here, y, at)[0])
                        out[k, point] = dy[-2], damping_rate(y, dy)
        return out

    def _system_at(self, point: int, p: Array) -> ModeSystem:
        return self._system(point, p, float(self.measured.amplitude[point]))[0]

    def _system_with(self, point: int, p: Array, k: int, value: float) -> ModeSystem:
        """The equations with another value of one parameter."""
        moved = p.copy()
        moved[k] = value
        return self._system_at(point, moved)
