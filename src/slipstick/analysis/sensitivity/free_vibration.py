"""Derivatives of vibration whose frequency is found with the motion: limit cycles, and nonlinear modes.

``(R, g) = 0`` for ``(X, v)``, as ``analysis/augmented.py`` has them: ``d(X, v)/ds = -J^-1 (R_s, g_s)`` for each
parameter, at a fixed value of what the branch follows. The phase of free vibration is open; what is asked of the motion
itself is at a fixed phase of harmonic 1 of the output.
"""

from __future__ import annotations

import warnings
from abc import abstractmethod
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from math import log
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from slipstick.analysis.augmented import Augmented, Bordered
from slipstick.analysis.modes.free_problem import FreeProblem, free_problem
from slipstick.analysis.modes.system import Beside, ModeSystem, damping_rate
from slipstick.analysis.peaks.gradient import StateSpace
from slipstick.analysis.self_excited.system import CycleSystem
from slipstick.analysis.sensitivity.derivatives import Directions, Functional, Sensitivities
from slipstick.analysis.sensitivity.linearization import Linearization, Move
from slipstick.balance.problem import Problem
from slipstick.errors import SlipstickWarning
from slipstick.results.record import Outputs, contact_states, unknowns
from slipstick.results.sensitivities import direction_of
from slipstick.solve.newton import NewtonOptions, newton
from slipstick.solve.norm import norm
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions

_NEWTON = NewtonOptions(tolerance=1e-12, stagnation=1e-8)
_RISE = 1e-7
"""Of its terms, the change of all equations with the size of the motion, below which it may have any size there."""
_STILL = "steady sliding does not vibrate"
_OPEN = "where cycles rise straight from the Hopf point their size is open"
_LOST = "Newton's method does not come back to the motion"


class _Solved(NamedTuple):
    """A point brought to rounding."""

    system: Augmented
    y: Array
    parameter: float
    at: Bordered


class _Slope(NamedTuple):
    """How a solution moves with a parameter: its unknowns, its motion, and all that the balance takes besides."""

    dy: Array
    dx: Array
    move: Move
    dU: Array
    """Of the motions of the outputs, (n_outputs, L)."""


class FreeSensitivities(Sensitivities):
    """Derivatives along a branch of free vibration. A subclass says what vibrates."""

    found: tuple[str, ...] = ("omega",)

    def __init__(self, branch: Solutions, parameters: tuple[str, ...], dof: str) -> None:
        super().__init__(branch, parameters, dof)
        self._none: Counter[str] = Counter()

    @abstractmethod
    def _state(self, point: int) -> _Solved | str:
        """The solution at a point, or why nothing is known of it."""

    def _linearized(self, point: int) -> Linearization | None:
        solved = self._state(point)
        if isinstance(solved, str):
            self._none[solved] += 1
            return None
        self._at, self._known = solved, list[_Slope]()
        return solved.at.here

    def warnings(self) -> Iterator[str]:
        """By which parameters there was no derivative; at how many points there was none by any, and why."""
        yield from super().warnings()
        for reason, times in self._none.items():
            yield f"there are no derivatives at {times} {'point' if times == 1 else 'points'}: {reason}"

    def _answers(self, directions: Directions) -> list[_Slope]:
        """Of every parameter, at the point looked at."""
        if directions.moves and not self._known:
            ways = enumerate(zip(self._at.at.slopes(directions.moves).T, directions.moves, strict=True))
            self._known = [self._answer(self._at, dy, way, k) for k, (dy, way) in ways]
        return self._known

    def _answer(self, solved: _Solved, dy: Array, way: Move, k: int) -> _Slope:
        """That of the parameter of a number, where the unknowns move by ``dy``."""
        del k
        dx, move = solved.system.moved(solved.at, dy, way)
        return _Slope(dy, dx, move, solved.at.here.change(dx, move)[1])

    def _rates(
        self, here: Linearization, parts: Sequence[Functional], directions: Directions
    ) -> tuple[Array, Sequence[Array]]:
        slopes = self._answers(directions)
        rates = np.array([[self._rate(here, part, slope) for slope in slopes] for part in parts])
        return rates.reshape(len(parts), len(slopes)), self._of_found(slopes)

    def _of_found(self, slopes: Sequence[_Slope]) -> Sequence[Array]:
        """Derivatives (K,) of what is ``found``."""
        return (np.array([slope.move.omega for slope in slopes]),)

    @staticmethod
    def _rate(here: Linearization, part: Functional, slope: _Slope) -> float:
        power = sum(
            here.power_pulled(powered, weights) @ slope.dx + weights @ here.power_rate(powered, slope.move)
            for powered, weights in part.powers
        )
        return float(np.sum(part.h * slope.dU) + power)

    def _slopes(self, here: Linearization, directions: Directions) -> Array:
        return np.array([slope.dx for slope in self._answers(directions)])

    def _motions(self, here: Linearization, directions: Directions) -> Array:
        """At a fixed phase of harmonic 1."""
        U, h = here.motion()[-1], self.balance.harmonics
        turned, (c, s) = h.derivative(U), (h.index(1, part) for part in "cs")
        size = U[c] ** 2 + U[s] ** 2
        rates = np.array([slope.dU[-1] for slope in self._answers(directions)])
        phase = (U[s] * rates[:, c] - U[c] * rates[:, s]) / size if size > 0.0 else np.full(len(rates), np.nan)
        return rates - phase[:, None] * turned

    def _place_rates(self, here: Linearization, point: int, directions: Directions) -> Array:
        return np.full(len(directions.moves), np.nan)

    @staticmethod
    def _solve(
        system: Augmented, y: Array, scale: Array, parameter: float, context: Array | None = None
    ) -> _Solved | str:
        evaluate = partial(system.evaluate, parameter=parameter, context=context)
        result = newton(evaluate, y, options=_NEWTON, scale=scale)
        at = system.state(result.x, parameter, context) if result.converged else None
        return _LOST if at is None or at.jacobian.singular else _Solved(system, result.x, parameter, at)


class CycleSensitivities(FreeSensitivities):
    """Derivatives of limit cycles, at a fixed value of the parameter followed."""

    def _state(self, point: int) -> _Solved | str:
        x = unknowns(self._table, self._problem, point)
        omega, value = float(self._table["omega"].to_numpy()[point]), float(self._along[point])
        rate = self.balance.harmonics.derivative(x).reshape(-1)
        vibration = np.append(np.where(np.arange(x.shape[1]) > 0, x, 0.0).reshape(-1), 0.0)
        if not norm(rate) > 0.0:
            return _STILL
        space = StateSpace(self.outputs, self._problem.inputs, self._path)
        system, y = CycleSystem(space, rate), np.append(x.reshape(-1), omega)
        at = system.state(y, value)
        if at is None:
            return _LOST
        if norm(at.jacobian.multiply(vibration)) <= _RISE * norm(at.jacobian.bound(np.abs(vibration))):
            return _OPEN
        return self._solve(system, y, np.append(np.full(x.size, norm(x.reshape(-1))), omega), value)


class ModeSensitivities(FreeSensitivities):
    """Derivatives of nonlinear modes, at a fixed amplitude of the mode."""

    found = ("omega", "modal_damping")

    def _prepare(self) -> None:
        attributes = self._table.attrs
        self._mode = int(attributes["mode"]) - 1, str(attributes["mode_of"])
        self._along = self._table["modal_amplitude"].to_numpy()
        self._free = self._free_problem(self._problem)
        self.balance, self.outputs = self._free.balance, self._free.outputs
        targets = {name: self._problem.parameter_target(name) for name in self.parameters}
        self._of_contacts = [bool(target.members) or name == "friction" for name, target in targets.items()]
        self._beside = dict[int, Beside]()

    def _free_problem(self, problem: Problem) -> FreeProblem:
        """The mode of a problem, with the output looked at as the last one."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            free = free_problem(problem, *self._mode)[0]
        free.outputs = Outputs(free.balance, (self._mode[1], self.dof))
        return free

    def _state(self, point: int) -> _Solved | str:
        table = self._table
        x = unknowns(table, self._free.problem, point).reshape(-1)
        omega, A = float(table["omega"].to_numpy()[point]), float(self._along[point])
        xi = 2.0 * omega * float(table["modal_damping"].to_numpy()[point])
        near = contact_states(table, self.balance, point)
        U = table["displacement"].to_numpy()[point, table["dof"].to_numpy().tolist().index(self._mode[1])]
        motion = self._free.system(np.append(x, [A, 0.0])).with_mode(x, omega, xi, U, near)
        system = self._free.system(motion, at_dof=True)
        y = np.append(motion / system.sizes(A), [omega, xi])
        scale = np.append(np.ones(motion.size), [omega, omega])
        return self._solve(system, y, scale, log(A), system.context(near))

    def _directions(self, value: float) -> Directions:
        del value
        return self._unchanged

    def _directions_of(self, problem: Problem) -> Directions:
        """Of contacts; what else moves the equations is found by making them anew."""
        inputs = self._free.problem.inputs
        ways = [
            direction_of(self._free.problem, name) if exact else inputs.scaled(0.0)
            for name, exact in zip(self.parameters, self._of_contacts, strict=True)
        ]
        return Directions(inputs, ways)

    def _answer(self, solved: _Solved, dy: Array, way: Move, k: int) -> _Slope:
        if self._of_contacts[k]:
            return super()._answer(solved, dy, way, k)
        system, y, parameter, at = solved
        assert isinstance(system, ModeSystem)
        if k not in self._beside:
            name, motion = self.parameters[k], np.append(at.here.x, [at.detail.size, 0.0])
            self._beside[k] = Beside(
                lambda value: self._free_problem(self._problem.at_parameter(name, value)).system(motion, at_dof=True),
                self._problem.parameter(name),
            )
        R, U, smooth = self._beside[k].rates(system, y, parameter, at.context)
        slope = super()._answer(solved, -at.jacobian.solve(R) if smooth else np.full_like(R, np.nan), way, k)
        return slope._replace(dU=slope.dU + U)

    def _of_found(self, slopes: Sequence[_Slope]) -> Sequence[Array]:
        rates = np.array([damping_rate(self._at.y, slope.dy) for slope in slopes])
        return (*super()._of_found(slopes), rates)
