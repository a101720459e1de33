"""The balance as a system of equations: in omega, or in a named parameter. What Newton and the continuation see."""

from __future__ import annotations

from math import inf, isfinite

import numpy as np

from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Detail, Forces, balanced, by_inputs, by_omega, detail, force_rates, terms
from slipstick.balance.inputs import Inputs
from slipstick.balance.jacobian_backends import AnyCompliance
from slipstick.balance.paths import Path
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

    def evaluate(self, x: Array, parameter: float, context: Array | None = None) -> Evaluation:
        """Residual, Jacobian and derivative by omega at ``parameter`` = omega.

        All nan where the motion is not finite, where nothing holds the structure, and where the equilibrium of a
        contact state near that of ``context`` has vanished.

        ``context`` holds the contact states (n_states,) of the accepted point before, near which these are sought.
        """
        if not (isfinite(x.dot(x)) and 0.0 < parameter < inf):
            return Evaluation.undefined(x.size)
        balance = self.balance
        solution = detail(balance, x, parameter, self.inputs, context)
        if solution.lost or balance.is_unsupported(solution.tangents):
            return Evaluation.undefined(x.size)
        compliance = balance.compliance(parameter, self.inputs.structure)
        at = balanced(balance, x, solution, compliance, by_omega(solution))
        slope = at.slope
        assert slope is not None
        if fast := solution.fast:
            slope += answer_to_powers(balance, fast, (state.power.omega for state in fast), at.compliance)
        return Evaluation(at.residual, at.jacobian, slope, solution, lambda: terms(balance, x, at), solution.carried)

    def rates(self, solution: Detail, parameter: float, dx: Array, rate: float) -> tuple[Forces, Array]:
        """Change of the forces and of the loads at ``parameter`` for changes ``dx`` (N,) and ``rate`` of it."""
        slopes_here = [{i: rate * part for i, part in slopes.items()} for slopes in by_omega(solution)]
        dpowers = (rate * carried.power.omega for carried in solution.states)
        return force_rates(self.balance, solution, dx, slopes_here, dpowers), np.zeros_like(solution.inputs.P)


class ParameterSystem:
    """The balance at a fixed frequency as a system in a parameter, along whose path the inputs move."""

    def __init__(self, balance: Balance, path: Path, omega: float) -> None:
        self.balance, self.path, self.omega = balance, path, omega
        self._fixed_compliance = balance.compliance(omega)
        self._loads_known: tuple[Array, AnyCompliance, Array] | None = None

    def at(self, parameter: float) -> tuple[Inputs, float]:
        """Inputs and frequency at ``parameter``."""
        return self.path.at(parameter)[0], self.omega

    def evaluate(self, x: Array, parameter: float, context: Array | None = None) -> Evaluation:
        """Residual, Jacobian and derivative by the parameter; nan as in a ``FrequencySystem``."""
        if not (isfinite(x.dot(x)) and isfinite(parameter)):
            return Evaluation.undefined(x.size)
        balance = self.balance
        inputs, direction = self.path.at(parameter)
        solution = detail(balance, x, self.omega, inputs, context)
        if solution.lost or balance.is_unsupported(solution.tangents):
            return Evaluation.undefined(x.size)
        at = balanced(balance, x, solution, self._compliance(inputs, direction))
        direction = at_states(solution.states, direction)
        slope = self._moved_by(by_inputs(solution, direction), direction.P, at.compliance)
        if direction.structure:
            slope += at.compliance.rate(at.G)
        if fast := solution.fast:
            dpowers = (power_along(state, direction) for state in fast)
            slope += answer_to_powers(balance, fast, dpowers, at.compliance)
        return Evaluation(at.residual, at.jacobian, slope, solution, lambda: terms(balance, x, at), solution.carried)

    def rates(self, solution: Detail, parameter: float, dx: Array, rate: float) -> tuple[Forces, Array]:
        """Change of the forces and of the loads at ``parameter`` for changes ``dx`` (N,) and ``rate`` of it."""
        direction = at_states(solution.states, self.path.at(parameter)[1])
        slopes_here = [{i: rate * part for i, part in slopes.items()} for slopes in by_inputs(solution, direction)]
        dpowers = (rate * power_along(carried, direction) for carried in solution.states)
        return force_rates(self.balance, solution, dx, slopes_here, dpowers), rate * direction.P

    def _moved_by(self, slopes: Forces, P: Array, compliance: AnyCompliance) -> Array:
        """Along the forces and loads (N,); where loads alone change it is the same everywhere, and remembered."""
        if any(slopes):
            return self.balance.moved_by(slopes, P, compliance)
        known = self._loads_known
        if known is None or known[0] is not P or known[1] is not compliance:
            self._loads_known = known = P, compliance, self.balance.moved_by(slopes, P, compliance)
        return known[2].copy()

    def _compliance(self, inputs: Inputs, direction: Inputs) -> AnyCompliance:
        if not (inputs.structure or direction.structure):
            return self._fixed_compliance
        return self.balance.compliance(self.omega, inputs.structure, direction.structure)


AnySystem = FrequencySystem | ParameterSystem
