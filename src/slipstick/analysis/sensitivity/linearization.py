"""The balance linearised at a state: derivatives of residual, motion, power and contact states.

``R(X, w, s) = 0`` is the balance and ``U(X, w, s)`` the motion of the outputs. Changes are propagated forwards
(``change``), weights of residual and motion backwards: to the unknowns (``pull``), which is the gradient of any linear
functional of both, and to the forces (``columns_pulled``), on which parameters of contacts and loads act.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from slipstick.balance.compliance import Compliance
from slipstick.balance.evaluation import Balanced, by_inputs, by_omega, detail, force_rates
from slipstick.balance.inputs import Inputs
from slipstick.balance.states import BatchPower, Powered, add_force_changes, at_states, power_along
from slipstick.contact.law import add_to
from slipstick.contact.power import Power
from slipstick.results.record import Outputs
from slipstick.state.contact_state import Carried
from slipstick.typing import Array, ComplexArray

Moved = Collection[tuple[int, str]]
"""Arrays of the inputs: number of the batch with "velocity", "velocity_per_omega", "motion" or a parameter."""


class Move(NamedTuple):
    """A change of all arguments of the balance other than the motion."""

    omega: float = 0.0
    inputs: Inputs | None = None
    """Changes of contacts, loads and structure, without those that contact states cause."""


NOTHING = Move()
FREQUENCY = Move(omega=1.0)


class Linearization:
    """Derivatives of residual and outputs at unknowns ``x`` (N,), whether they solve the balance or not.

    Parameters
    ----------
    outputs
        Outputs of the balance.
    near
        Contact states (n_states,) near which these are sought; None: from their start.
    """

    def __init__(self, outputs: Outputs, x: Array, omega: float, inputs: Inputs, near: Array | None = None) -> None:
        balance = self.balance = outputs.balance
        self.outputs, self.x, self.omega, self.inputs = outputs, x, omega, inputs
        self.detail = detail(balance, x, omega, inputs, near)
        self.at = Balanced(balance, x, self.detail, balance.compliance(omega, inputs.structure))
        self.jacobian = self.at.jacobian
        self._far = self._to_far()
        self._G = self.at.G
        if balance.springs is not None:  # forces of the balance without its springs
            self._G = balance.layout.excitation(self.detail.forces, inputs.P)
            balance.subtract_support(x, self._G)

    @property
    def lost(self) -> bool:
        """Whether a contact state has no equilibrium near its first value."""
        return self.detail.lost

    def motion(self) -> Array:
        """Coefficients of the outputs, (n_outputs, L)."""
        far = self._far
        return self.outputs.assembled(self.x, None if far is None else -far.answer(self._G))

    def change(self, dx: Array, direction: Move = NOTHING) -> tuple[Array, Array]:
        """Change of the residual (N,) and of the outputs (n_outputs, L) for ``dx`` (N,) and a direction."""
        b = self.balance
        forces, dpowers, dP = self._sources(direction)
        dG = b.layout.excitation(force_rates(b, self.detail, dx, forces, dpowers), dP)
        b.subtract_support(dx, dG)
        dU = self._outputs_change(dx, dG, direction)
        b.anchor(dx, dG)
        dR = dx + self.at.compliance.answer(dG)
        if direction.omega:
            dR += direction.omega * self.at.compliance.rate(self.at.G)
        if structure := _structure(direction):
            dR += b.compliance(self.omega, self.inputs.structure, structure).rate(self.at.G)
        return dR, dU

    def solutions(self, directions: Sequence[Move]) -> tuple[Array, Array]:
        """Derivatives of the solution along directions: unknowns (n, N) and outputs (n, n_outputs, L)."""
        still = np.zeros(self.balance.size)
        if not directions:
            return np.zeros((0, still.size)), np.zeros((0, len(self.outputs), self.balance.L))
        R = [self.change(still, direction)[0] for direction in directions]
        dX = -self.jacobian.solve(np.column_stack(R)).T
        U = [self.change(dx, direction)[1] for dx, direction in zip(dX, directions, strict=True)]
        return dX, np.array(U)

    def pushed(self, direction: Move) -> ComplexArray:
        """Change of forces minus loads on all columns (n_columns, n + 1) at fixed motion, states included."""
        forces, dpowers, dP = self._sources(direction)
        add_force_changes(self.detail.states, dpowers, forces)
        return self.balance.layout.excitation(forces, dP)

    def _sources(self, direction: Move) -> tuple[list[dict[int, Array]], list[Array], Array]:
        """Changes at fixed motion and states: of forces, powers and loads."""
        here, inputs = self.detail, self._at_states(direction.inputs)
        forces: list[dict[int, Array]] = [{} for _ in self.balance.batches]
        if direction.omega:
            forces = [{i: direction.omega * part for i, part in slopes.items()} for slopes in by_omega(here)]
        if inputs is not None:
            for total, more in zip(forces, by_inputs(here, inputs), strict=True):
                for i, part in more.items():
                    add_to(total, i, part)
        dpowers = [self.power_rate(state, direction) for state in here.states]
        return forces, dpowers, np.zeros_like(here.inputs.P) if inputs is None else inputs.P

    def _outputs_change(self, dx: Array, dG: ComplexArray, direction: Move) -> Array:
        far = self._far
        if far is None:
            return self.outputs.assembled(dx, None)
        rates = far.answer(dG)
        if direction.omega:
            rates += direction.omega * far.rate(self._G)
        if structure := _structure(direction):
            rates += self._to_far(structure).rate(self._G)  # type: ignore[union-attr]
        return self.outputs.assembled(dx, -rates)

    def structural_change(self, structure: Mapping[str, float]) -> tuple[Array, Array]:
        """Change of residual and outputs along parameters of the structure, at fixed forces."""
        b, along = self.balance, self._to_far(structure)
        dR = b.compliance(self.omega, self.inputs.structure, structure).rate(self.at.G)
        far = None if along is None else -along.rate(self._G)
        return dR, self.outputs.assembled(np.zeros(b.size), far)

    def pull(self, h: Array | None = None, z: Array | None = None) -> Array:
        """Gradient (N,) over the unknowns of ``h . U + z . R`` for ``h`` (n_outputs, L) and ``z`` (N,)."""
        gradient = np.zeros(self.balance.size)
        if h is not None:
            near, rest = self.outputs.transposed(h)
            gradient += near
            if self._far is not None:
                pulled = self._far.transposed(_pairs(rest))[: self.balance.n_ports]
                gradient -= self.forces_pulled(pulled)
                if self.balance.support_springs is not None:
                    gradient.reshape(self.balance.n_ports, -1)[:, 0] += self.balance.support_springs * pulled[:, 0].real
        if z is not None:
            gradient += self.jacobian.multiply(z, transposed=True)
        return gradient

    def columns_pulled(self, h: Array, z: Array) -> ComplexArray:
        """Weights (n_columns, n + 1) of forces minus loads that give ``h . U + z . R``."""
        pulled = self.at.compliance.transposed(_pairs(z.reshape(-1, self.balance.L)))
        if self._far is not None:
            pulled -= self._far.transposed(_pairs(self.outputs.transposed(h)[1]))
        return pulled

    def inputs_pulled(self, psi: ComplexArray, powers: Iterable[tuple[Powered, Array]], moved: Moved) -> Inputs:
        """Gradient by the inputs of forces minus loads with weights ``psi`` (n_columns, n + 1), states included.

        Weighted ``powers`` of batches at fixed states are added. The motion is fixed; arrays that are not ``moved``
        have zero gradient.
        """
        b, omega = self.balance, self.omega
        by_port = b.layout.spread(b.layout.real(psi[: b.n_ports]))
        weighted = [*powers, *((state, state.gain.T @ self._on_state(state, by_port)) for state in self.detail.states)]
        gradient = self.detail.inputs.only()
        gradient.P[:] = -b.layout.real(psi[b.n_ports :]).reshape(gradient.P.shape)
        for k, (response, on, total) in enumerate(zip(self.detail.responses, by_port, gradient.batches, strict=True)):
            powers_here = [(state.power, weights) for state, weights in weighted if state.batch == k]
            for name in (name for name in total.values if (k, name) in moved):
                slopes = response.by_parameter(name)
                total.values[name][:] = sum(np.einsum("cl,cl->c", slopes[i], F) for i, F in on.items() if i in slopes)
                for power, weights in powers_here:
                    total.values[name][:] += weights * power.by_parameter(name)
            if (k, "velocity") in moved or (k, "velocity_per_omega") in moved:
                drift = total.velocity_per_omega
                for (i, j), tangent in response.by_drift.items():
                    if i in on:
                        drift[j] += np.einsum("cl,cl->c", tangent, on[i])
                for power, weights in powers_here:
                    drift += omega * weights * power.by_velocity
                total.velocity[:] = drift / omega
            if (k, "motion") in moved:
                for (i, j), tangent in response.by_motion.items():
                    if i in on:
                        total.motion[j] += np.einsum("cij,ci->cj", tangent, on[i])
                for power, weights in powers_here:
                    for j, tangent in power.by_motion.items():
                        total.motion[j] += weights[:, None] * tangent
        return at_states(self.detail.states, gradient)

    def _on_state(self, state: Carried, by_port: Sequence[Mapping[int, Array]]) -> Array:
        """Weights (n,) of the values of a state, from weights of the forces at the ports of each batch."""
        on_state = np.zeros(self.balance.batches[state.batch].count)
        for i, force in state.force_by_value.items():
            if i in by_port[state.batch]:
                on_state += np.einsum("cl,cl->c", force, by_port[state.batch][i])
        return on_state

    def forces_pulled(self, psi: ComplexArray) -> Array:
        """``(dF/dX)^T psi`` (N,) of weights (n_ports, n + 1) of the forces at the ports, contact states included."""
        b = self.balance
        by_batch, out = b.layout.spread(b.layout.real(psi)), np.zeros((b.n_ports, b.L))
        for batch, response, by_port in zip(b.batches, self.detail.responses, by_batch, strict=True):
            for (i, j), tangent in response.by_motion.items():
                port = batch.ports[j]
                if i in by_port and port.size:
                    port.add(np.einsum("cij,ci->cj", tangent, by_port[i])[port.members], out, 0)
        pulled = out.reshape(-1)
        for state in self.detail.states:
            pulled += self.power_pulled(state, state.gain.T @ self._on_state(state, by_batch))
        return pulled

    def _to_far(self, along: Mapping[str, float] | None = None) -> Compliance | None:
        """Receptances to outputs that are not ports, with derivatives by omega, or along structural parameters."""
        if self.outputs.receptance is None:
            return None
        receptance = self.outputs.receptance.adjusted(self.inputs.structure)
        return Compliance(receptance, self.balance.orders, self.omega, along)

    def _at_states(self, inputs: Inputs | None) -> Inputs | None:
        return None if inputs is None else at_states(self.detail.states, inputs)

    def powers(self) -> list[Powered]:
        """Power of every batch."""
        known: dict[int, Powered] = {state.batch: state for state in self.detail.states}
        for k, (batch, response) in enumerate(zip(self.balance.batches, self.detail.responses, strict=True)):
            if k not in known:
                motion = self.balance.layout.motion(k, self.x, self.omega, self.inputs.batches[k])
                known[k] = BatchPower(k, Power(batch.law, motion, response))
        return [known[k] for k in range(len(self.balance.batches))]

    def power_pulled(self, state: Powered, weights: Array) -> Array:
        """Gradient (N,) of weighted powers over the unknowns at fixed states."""
        pulled, batch = np.zeros((self.balance.n_ports, self.balance.L)), self.balance.batches[state.batch]
        for j, tangent in state.power.by_motion.items():
            port = batch.ports[j]
            port.add((weights[:, None] * tangent)[port.members], pulled, 0)
        return pulled.reshape(-1)

    def power_rate(self, state: Powered, direction: Move) -> Array:
        """Change of the powers (n,) of a batch along a direction, at fixed motion and states."""
        inputs = self._at_states(direction.inputs)
        rate = np.zeros(self.balance.batches[state.batch].count)
        if direction.omega:
            rate = rate + direction.omega * state.power.omega
        return rate if inputs is None else rate + power_along(state, inputs)


def _structure(direction: Move) -> Mapping[str, float]:
    return {} if direction.inputs is None else direction.inputs.structure


def _pairs(h: Array) -> ComplexArray:
    """Coefficients (rows, L) as complex numbers (rows, n + 1)."""
    out = np.zeros((len(h), h.shape[1] + 1))
    out[:, 0], out[:, 2:] = h[:, 0], h[:, 1:]
    return out.view(complex)
