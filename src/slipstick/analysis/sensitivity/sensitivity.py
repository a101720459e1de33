"""Derivatives of a branch by named parameters: of forced vibration, limit cycles and nonlinear modes.

The frequency of free vibration is one of its unknowns. ``(R, g) = 0`` for ``(X, v)``, as in ``analysis/augmented.py``,
gives ``d(X, v)/ds = -J^-1 (R_s, g_s)`` for each parameter, at a fixed value of the quantity that the branch follows.
The phase of free vibration is arbitrary: derivatives of the motion hold the phase of harmonic 1 of the output fixed.
"""

from __future__ import annotations

import warnings
from abc import abstractmethod
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from math import log
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from slipstick.analysis.augmented import Augmented, Bordered
from slipstick.analysis.modes.free_problem import FreeProblem, free_problem
from slipstick.analysis.modes.system import BothSides, ModeSystem, damping_rate
from slipstick.analysis.peaks.system import StateSpace
from slipstick.analysis.road.run import one_thread
from slipstick.analysis.self_excited.system import CycleSystem
from slipstick.analysis.sensitivity.derivatives import Directions, Functional, Sensitivities
from slipstick.analysis.sensitivity.linearization import Linearization, Move
from slipstick.balance.parameters import product_warnings
from slipstick.balance.problem import Problem
from slipstick.errors import SlipstickWarning
from slipstick.faults import point_numbers, warn, wrong
from slipstick.results.record import Outputs, contact_states, unknowns
from slipstick.results.sensitivities import (
    corner_warnings,
    direction_of,
    known_problem,
    motion_dataset,
    parameter_names,
    sensitivity_dataset,
)
from slipstick.results.view import analysis_of
from slipstick.solve.newton import NewtonOptions, newton
from slipstick.solve.norm import norm
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray

    from slipstick.results.solutions import Solutions


_NEWTON = NewtonOptions(tolerance=1e-12, stagnation=1e-8)
_ARBITRARY_SIZE = 1e-7
"""Change of all equations with the size of the motion over their terms, up to which the size is arbitrary."""
_SLIDING = "steady sliding does not vibrate"
_VERTICAL = "where cycles rise straight from the Hopf point their size is open"
_LOST = "Newton's method does not come back to the motion"


class _Solved(NamedTuple):
    """A point solved to rounding."""

    system: Augmented
    y: Array
    parameter: float
    at: Bordered


class _Slope(NamedTuple):
    """Derivatives of a solution by a parameter: of unknowns, motion, and other arguments of the balance."""

    dy: Array
    dx: Array
    move: Move
    dU: Array
    """Derivative of the motion of the outputs, (n_outputs, L)."""


class FreeSensitivities(Sensitivities):
    """Derivatives along a branch of free vibration. A subclass defines its equations."""

    found: tuple[str, ...] = ("omega",)

    def __init__(self, branch: Solutions, parameters: tuple[str, ...], dof: str) -> None:
        super().__init__(branch, parameters, dof)
        self._none: Counter[str] = Counter()

    @abstractmethod
    def _state(self, point: int) -> _Solved | str:
        """The solution at a point, or the reason why it has no derivatives."""

    def _linearized(self, point: int) -> Linearization | None:
        solved = self._state(point)
        if isinstance(solved, str):
            self._none[solved] += 1
            return None
        self._at, self._cached = solved, list[_Slope]()
        return solved.at.here

    def warnings(self) -> Iterator[str]:
        """Sentences about missing derivatives: by single parameters, and at whole points."""
        yield from super().warnings()
        for reason, times in self._none.items():
            yield f"there are no derivatives at {times} {'point' if times == 1 else 'points'}: {reason}"

    def _point_slopes(self, directions: Directions) -> list[_Slope]:
        """Derivatives by every parameter at the current point."""
        if directions.moves and not self._cached:
            ways = enumerate(zip(self._at.at.slopes(directions.moves).T, directions.moves, strict=True))
            self._cached = [self._slope(self._at, dy, way, k) for k, (dy, way) in ways]
        return self._cached

    def _slope(self, solved: _Solved, dy: Array, way: Move, k: int) -> _Slope:
        """Derivative by parameter ``k``, with the derivative ``dy`` of the unknowns."""
        del k
        dx, move = solved.system.moved(solved.at, dy, way)
        return _Slope(dy, dx, move, solved.at.here.change(dx, move)[1])

    def _rates(
        self, here: Linearization, parts: Sequence[Functional], directions: Directions
    ) -> tuple[Array, Sequence[Array]]:
        slopes = self._point_slopes(directions)
        rates = np.array([[self._rate(here, part, slope) for slope in slopes] for part in parts])
        return rates.reshape(len(parts), len(slopes)), self._found_rates(slopes)

    def _found_rates(self, slopes: Sequence[_Slope]) -> Sequence[Array]:
        """Derivatives (K,) of each variable of ``found``."""
        return (np.array([slope.move.omega for slope in slopes]),)

    @staticmethod
    def _rate(here: Linearization, part: Functional, slope: _Slope) -> float:
        power = sum(
            here.power_pulled(powered, weights) @ slope.dx + weights @ here.power_rate(powered, slope.move)
            for powered, weights in part.powers
        )
        return float(np.sum(part.h * slope.dU) + power)

    def _slopes(self, here: Linearization, directions: Directions) -> Array:
        return np.array([slope.dx for slope in self._point_slopes(directions)])

    def _motions(self, here: Linearization, directions: Directions) -> Array:
        """Derivatives of the motion at a fixed phase of harmonic 1."""
        U, h = here.motion()[-1], self.balance.harmonics
        turned, (c, s) = h.derivative(U), (h.index(1, part) for part in "cs")
        size = U[c] ** 2 + U[s] ** 2
        rates = np.array([slope.dU[-1] for slope in self._point_slopes(directions)])
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
    """Derivatives of limit cycles, at a fixed value of the followed parameter."""

    def _state(self, point: int) -> _Solved | str:
        x = unknowns(self._table, self._problem, point)
        omega, value = float(self._table["omega"].to_numpy()[point]), float(self._along[point])
        rate = self.balance.harmonics.derivative(x).reshape(-1)
        vibration = np.append(np.where(np.arange(x.shape[1]) > 0, x, 0.0).reshape(-1), 0.0)
        if not norm(rate) > 0.0:
            return _SLIDING
        space = StateSpace(self.outputs, self._problem.inputs, self._path)
        system, y = CycleSystem(space, rate), np.append(x.reshape(-1), omega)
        at = system.state(y, value)
        if at is None:
            return _LOST
        if norm(at.jacobian.multiply(vibration)) <= _ARBITRARY_SIZE * norm(at.jacobian.bound(np.abs(vibration))):
            return _VERTICAL
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
        self._exact = [bool(target.members) or name == "friction" for name, target in targets.items()]
        self._both_sides = dict[int, BothSides]()

    def _free_problem(self, problem: Problem) -> FreeProblem:
        """The mode of a problem, with ``dof`` as the last output."""
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
        """Directions of parameters of contacts, zero for others: their derivatives are differences of the equations."""
        inputs = self._free.problem.inputs
        ways = [
            direction_of(self._free.problem, name) if exact else inputs.scaled(0.0)
            for name, exact in zip(self.parameters, self._exact, strict=True)
        ]
        return Directions(inputs, ways)

    def _slope(self, solved: _Solved, dy: Array, way: Move, k: int) -> _Slope:
        if self._exact[k]:
            return super()._slope(solved, dy, way, k)
        system, y, parameter, at = solved
        assert isinstance(system, ModeSystem)
        if k not in self._both_sides:
            name, motion = self.parameters[k], np.append(at.here.x, [at.detail.size, 0.0])
            self._both_sides[k] = BothSides(
                lambda value: self._free_problem(self._problem.at_parameter(name, value)).system(motion, at_dof=True),
                self._problem.parameter(name),
            )
        R, U, smooth = self._both_sides[k].rates(system, y, parameter, at.context)
        slope = super()._slope(solved, -at.jacobian.solve(R) if smooth else np.full_like(R, np.nan), way, k)
        return slope._replace(dU=slope.dU + U)

    def _found_rates(self, slopes: Sequence[_Slope]) -> Sequence[Array]:
        rates = np.array([damping_rate(self._at.y, slope.dy) for slope in slopes])
        return (*super()._found_rates(slopes), rates)


OF = ("amplitude", "displacement")
"""Values of ``of``: the amplitude and other scalars of a point, or every coefficient of the motion."""

_OF_FREE_VIBRATION = {"cycles": CycleSensitivities, "modes": ModeSensitivities}
"""Classes by analysis; other branches are vibration at a given frequency."""


def sensitivity_of(
    branch: Solutions, parameters: Any = None, dof: str | None = None, *, points: Any = None, of: Any = OF[0],
    together: bool = True,
) -> xarray.Dataset:  # fmt: skip
    """As ``Branch.sensitivity``; ``together``: whether to warn of parameters that are equivalent."""
    problem = known_problem(branch)
    branch.point(0)
    if not isinstance(of, str) or of not in OF:
        raise wrong("of", of, " or ".join(f'"{name}"' for name in OF))
    chosen = parameter_names(problem, parameters)
    at = point_numbers("points", points, branch.table.sizes["point"])
    d = branch.dof_index(dof)
    if parameters is not None and together:
        warn(product_warnings(problem, chosen))
    name = str(branch.table["dof"].to_numpy()[d])
    sensitivities = _OF_FREE_VIBRATION.get(analysis_of(branch.table), Sensitivities)(branch, chosen, name)
    with one_thread():
        if of == "displacement":
            rates = [sensitivities.motion_at(k) for k in at]
            warn(list(sensitivities.warnings()))
            return motion_dataset(branch, name, chosen, at, np.array(rates).swapaxes(0, 1))
        found = sensitivity_dataset(branch, name, chosen, at, [sensitivities.at(k) for k in at])
    warn([*sensitivities.warnings(), *corner_warnings(found)])
    return found
