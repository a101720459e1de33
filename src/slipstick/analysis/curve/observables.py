"""Motion of outputs between the solutions of a branch, from the contact forces there, not by interpolation."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any

import numpy as np

from slipstick.balance.evaluation import AnySystem, ParameterSystem, Together, forces_together
from slipstick.balance.inputs import Assigned, Inputs
from slipstick.results.record import Outputs
from slipstick.solve.continuation import Step
from slipstick.solve.continuation.dense_output import Between, Observables
from slipstick.solve.continuation.hermite_segment import HermiteBasis, HermiteSegment
from slipstick.solve.continuation.metric import own_sizes
from slipstick.typing import Array


def context_between(first: Step, second: Step) -> Any:
    """Context for a point between two solutions: that of the second, or of the first if it has more harmonics."""
    before, after = first.evaluation, second.evaluation
    if after.detail.adapted is None:
        return after.context
    return max(before, after, key=lambda value: int(value.detail.adapted.in_use)).detail.adapted.context


class OutputObservables(Observables):
    """Motion of the outputs that are not contact ports."""

    def __init__(self, outputs: Outputs, system: AnySystem) -> None:
        self._outputs, self._system = outputs, system
        self._resonances = _resonances(system) if outputs.far else np.empty(0)

    @property
    def any(self) -> bool:
        """Whether there are such outputs."""
        return bool(self._outputs.far)

    def narrow(self, low: float, high: float) -> Array:
        """Values between ``low`` and ``high`` at which a harmonic meets a natural frequency of the structure.

        Contacts may not move in that mode. The middle, where the structure does not know its natural frequencies.
        """
        known = self._resonances
        if known is None:
            return np.array([0.5 * (low + high)])
        return known[np.searchsorted(known, low) : np.searchsorted(known, high)]

    def between(self, first: Step, second: Step, states: Array) -> Between:
        """Outputs and residuals at states (n, N + 1)."""
        placed = [self._system.at(p) for p in states[:, -1].tolist()]
        inputs, omega = [one for one, _ in placed], np.array([w for _, w in placed])
        evaluated: Together | _OneByOne
        together = forces_together(self._system.balance) and second.evaluation.detail.adapted is None
        if together and omega.min() > 0.0 and isfinite(states.sum()):
            evaluated = Together(self._system.balance, states[:, :-1], omega, Assigned.of(inputs))
        else:
            evaluated = _OneByOne(self._system, states, inputs, context_between(first, second))
        return _Motion(self._outputs, self._system, (first, second), evaluated, (states[:, :-1], omega, inputs))


def _resonances(system: AnySystem) -> Array | None:
    """Frequencies at which a harmonic meets a natural frequency, ascending; None where the structure does not know.

    Empty without damping: there is no bounded motion at them.
    """
    balance = system.balance
    if isinstance(system, ParameterSystem) or balance.springs is not None:
        return np.empty(0)
    return balance.problem.structure.resonances(balance.orders)


class _OneByOne:
    """``Together`` for states that have to be evaluated one by one; nan where there is no motion."""

    def __init__(self, system: AnySystem, states: Array, inputs: Sequence[Inputs], context: Any) -> None:
        self._system, self._parameters, balance = system, states[:, -1], system.balance
        self._evaluated = [system.evaluate(state[:-1], float(state[-1]), context) for state in states]
        self._shape = balance.n_ports, balance.L
        self.loads = np.array([one.P for one in inputs]).reshape(len(states), balance.n_loads, balance.L)

    def residuals(self) -> Array:
        return np.array([value.residual for value in self._evaluated])

    @property
    def forces(self) -> Array:
        return np.array([self._on_ports(value.detail and value.detail.forces) for value in self._evaluated])

    def force_changes(self, dx: Array) -> Array:
        return np.array([
            self._on_ports(value.detail and self._system.rates(value.detail, float(p), change, 0.0)[0])
            for value, p, change in zip(self._evaluated, self._parameters, dx, strict=True)
        ])  # fmt: skip

    def _on_ports(self, forces: Any) -> Array:
        if forces is None:
            return np.full(self._shape, np.nan)
        return self._system.balance.layout.gathered(forces, np.zeros(self._shape))


class _Motion(Between):
    """Motion of the outputs at evaluated states."""

    def __init__(
        self, outputs: Outputs, system: AnySystem, ends: tuple[Step, Step], evaluated: Together | _OneByOne,
        at: tuple[Array, Array, Sequence[Inputs]],
    ) -> None:  # fmt: skip
        self._outputs, self._system, self._ends, self._evaluated = outputs, system, ends, evaluated
        self._x, self._omega, self._structures = at[0], at[1], [one.structure for one in at[2]]
        self.residuals = evaluated.residuals()
        if outputs.far:
            self._known = [(value[outputs.far], rate[outputs.far]) for value, rate in map(self._along, ends)]
            rows = np.array([self._known[0][0], self._known[1][0]])
            ports = np.array([end.x for end in ends])
            whole = np.append(
                np.einsum("srl,srl->sr", rows, rows).max(axis=0), np.einsum("sn,sn->s", ports, ports).max()
            )
            self._sizes = own_sizes(np.einsum("srl,srl->sr", rows[..., 1:], rows[..., 1:]).max(axis=0), whole)

    def _along(self, step: Step) -> tuple[Array, Array]:
        return self._outputs.motion_along(step, self._system)

    def changes(self, dx: Array) -> Array:
        """Largest change (n,) of an output over its size, for changes (n, N) of the contact motion."""
        return self._relative(self._moved(dx))

    def bent(self, dx: Array, segment: HermiteSegment, places: HermiteBasis) -> Array:
        """Largest distance (n,) of an output from the cubic through the motions on both sides, over its size."""
        (a, da), (b, db) = self._known
        forces, loads = self._evaluated.forces, self._evaluated.loads
        value = self._outputs.far_motion(self._x, forces, loads, self._omega, self._structures)
        return self._relative(value + self._moved(dx) - segment.between(a, b, da, db, places)[0])

    def _moved(self, dx: Array) -> Array:
        none = np.zeros_like(self._evaluated.loads)
        return self._outputs.far_motion(dx, self._evaluated.force_changes(dx), none, self._omega, self._structures)

    def _relative(self, changes: Array) -> Array:
        return np.asarray((np.sqrt(np.einsum("nrl,nrl->nr", changes, changes)) / self._sizes).max(axis=1))
