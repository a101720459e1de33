"""Adapted harmonics: each point of a branch with as few harmonics as its accuracy requires.

All harmonics of the problem are unknowns of the continuation; those not in use are held at zero. The number in use is
part of the ``context`` that points hand on. A point with too large a truncation error is solved again with more
harmonics. Where the highest ones contribute little, the next points are solved without them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil

import numpy as np

from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Adapted, AnySystem, Detail, FrequencySystem, ParameterSystem
from slipstick.balance.inputs import Assigned, Inputs
from slipstick.balance.parameters import parameter_path
from slipstick.balance.problem import Problem
from slipstick.results.measures import largest_deviation
from slipstick.results.record import Outputs
from slipstick.results.truncation import EachReaction, Reaction, truncation
from slipstick.solve.linear.jacobian import EmbeddedJacobian
from slipstick.solve.newton import Evaluation
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, BoolArray

SAFETY = 0.5
"""Largest truncation estimate over the tolerance: the estimate may be low by a factor of two."""

_DROPPED = 0.05
"""Largest contribution over the tolerance of harmonics that are dropped."""

_GROWTH = 1.4
"""Ratio of the numbers of orders in successive levels, at least."""


@dataclass(frozen=True)
class HarmonicLevel:
    """The balance with some harmonics: masks of their unknowns, and of coefficients (L,) at a port."""

    system: AnySystem
    outputs: Outputs
    active: BoolArray
    columns: BoolArray

    @property
    def balance(self) -> Balance:
        """The balance with these harmonics."""
        return self.system.balance

    def spread(self, force: Array) -> Array:
        """Coefficients (n, L) of all harmonics, zero for those not in use."""
        out = np.zeros((len(force), self.columns.size))
        out[:, self.columns] = force
        return out


def adapted(system: AnySystem, tolerance: float, parameter: str = "") -> AnySystem:
    """The same system with adapted harmonics, to a ``tolerance`` relative to the largest amplitude."""
    balance = system.balance
    outputs, levels = Outputs(balance, balance.problem.outputs or ()), []
    for orders in harmonic_ladder(balance.problem):
        narrow = balance.narrowed(orders)
        columns = np.isin(np.array(balance.harmonics.labels), narrow.harmonics.labels)
        narrowed = copy(outputs)
        narrowed.balance = narrow
        active = np.tile(columns, balance.n_ports)
        levels.append(HarmonicLevel(_with(system, narrow, columns, parameter), narrowed, active, columns))
    if isinstance(system, FrequencySystem):
        return _AdaptedFrequency(system, levels, tolerance)
    return _AdaptedParameter(system, levels, tolerance)


def _with(system: AnySystem, balance: Balance, columns: BoolArray, parameter: str) -> AnySystem:
    if isinstance(system, ParameterSystem):
        return ParameterSystem(balance, parameter_path(balance.problem, parameter), system.omega)
    inputs = system.inputs.map(lambda name, value: value[..., columns] if name in ("load", "motion") else value)
    return FrequencySystem(balance, inputs)


def harmonic_ladder(problem: Problem) -> list[Harmonics]:
    """Growing sets of orders of the problem, the last with all: the driven orders and the lowest."""
    orders, count, levels = problem.harmonics.orders, 1, list[Harmonics]()
    driven = driven_orders(problem)
    while count < len(orders) - 1:
        kept = Harmonics(sorted({*orders[: count + 1], *driven}))
        if not levels or kept != levels[-1]:
            levels.append(kept)
        count = max(count + 1, ceil(_GROWTH * count))
    return [*(r for r in levels if r != problem.harmonics), problem.harmonics]


def driven_orders(problem: Problem) -> set[int]:
    """Orders of the loads and of the rubbing motions, zero or not."""
    driven = {load.harmonic * problem.load_order for load in problem.loads}
    for pair in problem.contacts:
        driven |= {m * problem.rubbing_order for amplitudes in pair.rubbing.parts.values() for m in amplitudes}
    driven |= {problem.load_order, problem.rubbing_order}
    return driven & set(problem.harmonics.orders)


class _AdaptedEvaluation(Evaluation):
    """An evaluation whose context is computed on demand."""

    next_context: Callable[[], Array]

    @property
    def context(self) -> Array:
        """Level of harmonics for the next points, and contact states."""
        return self.next_context()


class _Adapting:
    """Common part of both kinds of systems; the levels are those of ``harmonic_ladder``."""

    balance: Balance
    at: Callable[[float], tuple[Inputs, float]]

    def _set_levels(self, levels: Sequence[HarmonicLevel], tolerance: float) -> None:
        self._levels, self._tolerance = levels, tolerance

    def evaluate(self, x: Array, parameter: float, context: Array | None = None) -> Evaluation:
        """Residual, Jacobian and slope for all unknowns, with the harmonics of the level in ``context``."""
        number, near = self._split(context)
        level = self._levels[number]
        value = level.system.evaluate(x[level.active], parameter, near)
        if value.detail is None:
            return Evaluation.undefined(x.size)
        assert value.parameter_derivative is not None
        residual, slope = x.copy(), np.zeros(x.size)
        residual[level.active], slope[level.active] = value.residual, value.parameter_derivative
        point = _AtPoint(self._levels, number, self._tolerance, x, value)
        detail = self._detail(value.detail, point, parameter)
        evaluation = _AdaptedEvaluation(
            residual, EmbeddedJacobian(value.jacobian, level.active), slope, detail,
            lambda: _terms(value, level, x), None, point.again,
        )  # fmt: skip
        evaluation.next_context = point.after
        return evaluation

    def _split(self, context: Array | None) -> tuple[int, Array | None]:
        """Number of the level, and contact states; all harmonics where the context has states only."""
        carried = self.balance.n_states
        if context is None or context.size == carried:
            return len(self._levels) - 1, context
        return int(context[0]), context[1:] if carried else None

    def _detail(self, detail: Detail, point: _AtPoint, parameter: float) -> Detail:
        responses = tuple(r._replace(force=tuple(map(point.level.spread, r.force))) for r in detail.responses)
        inputs, _ = self.at(parameter)
        return replace(detail, responses=responses, inputs=inputs, adapted=point)

    def rates(self, detail: Detail, parameter: float, dx: Array, rate: float) -> tuple[list[dict[int, Array]], Array]:
        """Rates of forces and loads, as of the system itself."""
        point = detail.adapted
        assert isinstance(point, _AtPoint)
        level = point.level
        forces, dP = level.system.rates(point.value.detail, parameter, dx[level.active], rate)
        return [{i: level.spread(f) for i, f in by_port.items()} for by_port in forces], level.spread(dP)


class _AdaptedFrequency(_Adapting, FrequencySystem):
    def __init__(self, system: FrequencySystem, levels: Sequence[HarmonicLevel], tolerance: float) -> None:
        FrequencySystem.__init__(self, system.balance, system.inputs)
        self._set_levels(levels, tolerance)


class _AdaptedParameter(_Adapting, ParameterSystem):
    def __init__(self, system: ParameterSystem, levels: Sequence[HarmonicLevel], tolerance: float) -> None:
        ParameterSystem.__init__(self, system.balance, system.path, system.omega)
        self._set_levels(levels, tolerance)


def _terms(value: Evaluation, level: HarmonicLevel, x: Array) -> Array:
    out = np.abs(x)
    if value.terms is not None:
        out[level.active] = value.terms()
    return out


class _AtPoint(Adapted):
    """A solution with some harmonics: their truncation error, and the levels that follow from it."""

    def __init__(
        self, levels: Sequence[HarmonicLevel], number: int, tolerance: float, x: Array, value: Evaluation
    ) -> None:
        self.level, self.value = levels[number], value
        self._levels, self._number, self._tolerance, self._x = levels, number, tolerance, x

    @property
    def in_use(self) -> int:
        """Number of harmonics, 0 included."""
        return len(self.level.balance.harmonics.orders)

    @property
    def context(self) -> Array:
        """Context with the same harmonics and contact states."""
        return self._context(self._number)

    @cached_property
    def truncation(self) -> float:
        """Estimated contribution of neglected harmonics, relative to the largest amplitude."""
        inputs, reaction = Assigned.of([self.value.detail.asked]), EachReaction([Reaction(self.value.jacobian)])
        return float(truncation(self.level.outputs, self._some, self._motion, self._omega, inputs, reaction)[0])

    @property
    def _some(self) -> Array:
        return self._x[self.level.active][None]

    @property
    def _omega(self) -> Array:
        return np.array([self.value.detail.omega])

    @cached_property
    def _motion(self) -> Array:
        b, detail = self.level.balance, self.value.detail
        force = b.layout.gathered(detail.forces, np.zeros((b.n_ports, b.L)))[None]
        structures = [detail.inputs.structure]
        return self.level.outputs.motion(self._some, force, detail.inputs.P[None], self._omega, structures)

    def again(self) -> Array | None:
        """Context with more harmonics to solve this point again; None where the accuracy suffices or all are in use."""
        if self._number == len(self._levels) - 1 or self.truncation <= SAFETY * self._tolerance:
            return None
        return self._context(self._number + 1)

    def after(self) -> Array:
        """Context for the next points, with fewer harmonics where the last ones contribute little."""
        number = self._number
        while number > 0 and self._dropped(number - 1) <= _DROPPED * self._tolerance:
            number -= 1
        return self._context(number)

    def _context(self, number: int) -> Array:
        carried = self.value.detail.carried
        return np.append(float(number), () if carried is None else carried)

    def _dropped(self, number: int) -> float:
        """Largest deviation at the contacts by harmonics that a lower level lacks, over that of all."""
        b = self.level.balance
        X = self._some.reshape(1, b.n_ports, b.L)
        dropped = Harmonics([0, *sorted(set(b.harmonics.orders) - set(self._levels[number].balance.harmonics.orders))])
        at = b.harmonics.columns(dropped.orders)
        size = largest_deviation(b.harmonics, X).max(initial=0.0)
        return float(largest_deviation(dropped, X[..., at]).max(initial=0.0) / size) if size > 0 else 0.0
