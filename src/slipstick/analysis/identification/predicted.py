"""What a problem predicts of what was measured, with exact derivatives by the parameters sought."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from slipstick.analysis.curve.follow import frequency_request
from slipstick.analysis.curve.steady import steady_request
from slipstick.analysis.identification.kinds import Backbone, Decay, Loops, Measured, Vibration
from slipstick.analysis.peaks.gradient import Extreme
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

_NEWTON = NewtonOptions(tolerance=1e-12, stagnation=1e-9, max_iterations=30)
_PARTS = 16
"""A change of the parameters is made in at most so many parts where it is too much at once."""
_BESIDE = 0.03
"""The curve is followed so far beyond the measured frequencies."""
_SAME = 1e-6
"""Motions closer than this, relative to their size, are one."""


class Predictor(Protocol):
    """Predicts the measured numbers."""

    several: int
    """Points at which more than one motion was found."""

    @property
    def solved(self) -> int:
        """Motions solved for so far."""

    def begin(self, p: Array) -> bool:
        """Choose the motions that are meant, at parameters (n_p,); whether they are others than before."""

    def values(self, p: Array) -> Array:
        """What is predicted at parameters (n_p,), of the shape of what was measured; nan where there is no motion."""

    def slopes(self, p: Array) -> Array:
        """Its derivatives at the parameters asked for last, (n_p, ...)."""


def predictor_of(problem: Problem, names: Sequence[str], measured: Measured) -> Predictor:
    """The one for what was measured."""
    match measured:
        case Decay():
            from slipstick.analysis.identification.decays import DecayPredictor

            return DecayPredictor(problem, names, measured)
        case Loops():
            return LoopPredictor(problem, names, measured)
        case Backbone():
            from slipstick.analysis.identification.backbones import ModePredictor, PeakPredictor

            return (PeakPredictor if measured.kind == "peak" else ModePredictor)(problem, names, measured)
        case Vibration():
            return VibrationPredictor(problem, names, measured)
    raise NotImplementedError(type(measured).__name__)


class LoopPredictor:
    """Forces of a contact whose motion is prescribed: nothing is solved."""

    several = 0
    solved = 0

    def __init__(self, problem: Problem, names: Sequence[str], loops: Loops) -> None:
        pair = next(pair for pair in problem.contacts if pair.name == loops.contact)
        self._problem = replace(problem, contacts=[pair], loads=[], states=(), thermal=None, told=None)
        self.names, self.loops = tuple(names), loops
        self._slopes: Array = np.empty(0)

    def begin(self, p: Array) -> bool:
        """There is one answer."""
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
        """Their derivatives (n_p, n, L)."""
        return self._slopes


class _Solved(NamedTuple):
    """A motion with the parameters it belongs to."""

    p: Array
    x: Array
    near: Array | None
    """Contact states."""
    rate: Array | None
    """How the unknowns move with the parameters, (n_p, N); None: not asked for."""


@dataclass(frozen=True)
class _Level:
    """The points measured under the same conditions, and the balance at the parameters of the moment."""

    balance: Balance
    outputs: Outputs
    directions: tuple[Move, ...]


class VibrationPredictor:
    """Motions at the points measured, each followed from the parameters before to those that are tried."""

    def __init__(self, problem: Problem, names: Sequence[str], measured: Vibration) -> None:
        self.problem, self.names, self.measured = replace(problem, told=None), tuple(names), measured
        self._groups = measured.groups
        self._kept: list[_Solved | None] = [None] * measured.omega.size
        """Motions at the parameters taken last."""
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
        """Follow the curves at these parameters, and of several motions take those nearest to what was measured."""
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
                same = old is not None and np.array_equal(old.p, p) and norm(old.x - best.x) <= _SAME * norm(best.x)
                changed |= old is not None and not same
        return changed

    def _candidates(self, problem: Problem, omega: Array) -> list[list[tuple[Array, Array | None]]]:
        """Unknowns and contact states of every motion met at each frequency."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            each: list[list[tuple[Array, Array | None]]] = [[] for _ in omega]
            if len(omega) > 2:
                span = (float(omega.min()) * (1.0 - _BESIDE), float(omega.max()) * (1.0 + _BESIDE))
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
        """From what was measured, over its noise where that is known."""
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
        """Their derivatives (n_p, n, ...); the motions they are of are those that the next ones are sought from."""
        out = np.empty((len(p), *self.measured.values.shape))
        for point, tried in enumerate(self._tried):
            assert tried is not None
            level, solved, here = tried
            rate, moved = here.solutions(level.directions)
            out[:, point] = self._read(here, level, moved)[1]
            self._kept[point] = solved._replace(rate=rate)
        return out

    def _read(self, here: Linearization, level: _Level, moved: Array | None = None) -> tuple[Array, Array]:
        """What was measured of a motion, and its change for changes (n_p, n_dofs, L)."""
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
        """The motion at a point from the one kept, in smaller changes of the parameters where one is too much."""
        kept = self._kept[point]
        if kept is None:
            return None
        here = self._step(level, point, kept, p)
        parts = 2
        while here is None and parts <= _PARTS:
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
            found = newton(lambda z: system.evaluate(z, omega, near), x, options=_NEWTON, scale=scale)
        except SlipstickError:
            return None
        if not found.converged:
            return None
        carried = found.evaluation.detail.carried
        return Linearization(level.outputs, found.x, omega, balance.problem.inputs, carried)


def _distinct(motions: Sequence[Linearization]) -> list[Linearization]:
    out: list[Linearization] = []
    for motion in motions:
        if all(norm(motion.x - other.x) > _SAME * (norm(other.x) or 1.0) for other in out):
            out.append(motion)
    return out
