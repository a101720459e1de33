"""The balance as a system of equations: in omega, or in a named parameter. What Newton and the continuation see."""

from __future__ import annotations

from math import inf, isfinite
from typing import Any

import numpy as np

from slipstick.balance.inputs import Inputs
from slipstick.balance.kinds import AnyCompliance
from slipstick.balance.paths import Path
from slipstick.balance.ports import Balance, Forces
from slipstick.balance.residual import Detail, balanced, by_inputs, by_omega, detail, force_rates, terms
from slipstick.balance.states import answer_to_powers, at_states, power_along
from slipstick.solve.newton import Evaluation
from slipstick.typing import Array


class FrequencySystem:
    """The balance as a system in omega."""

    def __init__(self, balance: Balance, inputs: Inputs) -> None:
        self.balance, self.inputs = balance, inputs

    def at(self, parameter: float) -> tuple[Inputs, float]:
        """Inputs and frequency at ``parameter``."""
        return self.inputs, parameter

    def evaluate(self, x: Array, parameter: float, context: Any = None) -> Evaluation:
        """Residual, Jacobian and derivative by omega at ``parameter`` = omega; nan where the motion is not finite, and
        where the equilibrium of a contact state near that of ``context`` has vanished.

        ``context`` holds the contact states (n_states,) of the accepted point before, near which these are sought.
        """
        if not (isfinite(x.dot(x)) and 0.0 < parameter < inf):
            return Evaluation.undefined(x.size)
        balance = self.balance
        found = detail(balance, x, parameter, self.inputs, context)
        if found.lost:
            return Evaluation.undefined(x.size)
        at = balanced(balance, x, found, balance.compliance(parameter, self.inputs.structure))
        slope = at.compliance.rate(at.G)
        slopes = by_omega(found)
        if any(slopes):
            slope += at.compliance.answer(balance.layout.excitation(slopes))
        if found.states:
            slope += answer_to_powers(balance, found.states, (own.power.omega for own in found.states), at.compliance)
        return Evaluation(at.residual, at.jacobian, slope, found, lambda: terms(balance, x, at), found.carried)

    def rates(self, found: Detail, parameter: float, dx: Array, rate: float) -> tuple[Forces, Array]:
        """Change of the forces and of the loads at ``parameter`` for changes ``dx`` (N,) and ``rate`` of it."""
        own = [{i: rate * part for i, part in slopes.items()} for slopes in by_omega(found)]
        dpowers = (rate * carried.power.omega for carried in found.states)
        return force_rates(self.balance, found, dx, own, dpowers), np.zeros_like(found.inputs.P)


class ParameterSystem:
    """The balance at a fixed frequency as a system in a parameter, along whose path the inputs move."""

    def __init__(self, balance: Balance, path: Path, omega: float) -> None:
        self.balance, self.path, self.omega = balance, path, omega
        self._own = balance.compliance(omega)

    def at(self, parameter: float) -> tuple[Inputs, float]:
        """Inputs and frequency at ``parameter``."""
        return self.path.at(parameter)[0], self.omega

    def evaluate(self, x: Array, parameter: float, context: Any = None) -> Evaluation:
        """Residual, Jacobian and derivative by the parameter; nan as in a ``FrequencySystem``."""
        if not (isfinite(x.dot(x)) and isfinite(parameter)):
            return Evaluation.undefined(x.size)
        balance = self.balance
        inputs, direction = self.path.at(parameter)
        found = detail(balance, x, self.omega, inputs, context)
        if found.lost:
            return Evaluation.undefined(x.size)
        at = balanced(balance, x, found, self._compliance(inputs, direction))
        direction = at_states(found.states, direction)
        slope = balance.moved_by(by_inputs(found, direction), direction.P, at.compliance)
        if direction.structure:
            slope += at.compliance.rate(at.G)
        if found.states:
            dpowers = (power_along(own, direction) for own in found.states)
            slope += answer_to_powers(balance, found.states, dpowers, at.compliance)
        return Evaluation(at.residual, at.jacobian, slope, found, lambda: terms(balance, x, at), found.carried)

    def rates(self, found: Detail, parameter: float, dx: Array, rate: float) -> tuple[Forces, Array]:
        """Change of the forces and of the loads at ``parameter`` for changes ``dx`` (N,) and ``rate`` of it."""
        direction = at_states(found.states, self.path.at(parameter)[1])
        own = [{i: rate * part for i, part in slopes.items()} for slopes in by_inputs(found, direction)]
        dpowers = (rate * power_along(carried, direction) for carried in found.states)
        return force_rates(self.balance, found, dx, own, dpowers), rate * direction.P

    def _compliance(self, inputs: Inputs, direction: Inputs) -> AnyCompliance:
        if not (inputs.structure or direction.structure):
            return self._own
        return self.balance.compliance(self.omega, inputs.structure, direction.structure)


AnySystem = FrequencySystem | ParameterSystem
