"""The neighbourhood of a state of the balance: how residual, motion, power and temperature answer to everything.

``R(X, w, s) = 0`` is the balance and ``U(X, w, s)`` the motion of the outputs. Changes are propagated forwards
(``change``), and numbers on residual and motion backwards: to the unknowns (``pull``), which is the gradient of any
linear functional of both, and to the forces (``columns_pulled``), where parameters of contacts and loads act.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from slipstick.balance.compliance import Compliance
from slipstick.balance.heat import heat_change, power_along, power_rows, warm_direction
from slipstick.balance.inputs import Inputs
from slipstick.balance.residual import balanced, by_inputs, by_omega, detail, force_rates
from slipstick.contact.law import add_to
from slipstick.results.record import Outputs
from slipstick.structure.dynamic import adjusted
from slipstick.thermal.tangent import Power
from slipstick.typing import Array, ComplexArray


class BatchPower(NamedTuple):
    """The power of the contacts of one batch."""

    batch: int
    power: Power


class Move(NamedTuple):
    """A change of everything the balance depends on besides the motion."""

    omega: float = 0.0
    inputs: Inputs | None = None
    """Parameters of contacts, loads and structure; cold values where friction heats the contacts."""


NOTHING = Move()
FREQUENCY = Move(omega=1.0)


class Linearization:
    """Derivatives of residual and outputs at unknowns ``x`` (N,), whether they solve the balance or not.

    Parameters
    ----------
    outputs
        Whose motion is asked for.
    temperature
        Contact temperatures near which these are sought; None: from the cold.
    """

    def __init__(
        self, outputs: Outputs, x: Array, omega: float, inputs: Inputs, temperature: Array | None = None
    ) -> None:
        balance = self.balance = outputs.balance
        self.outputs, self.x, self.omega, self.inputs = outputs, x, omega, inputs
        self.found = detail(balance, x, omega, inputs, temperature)
        self.at = balanced(balance, x, self.found, balance.compliance(omega, inputs.structure))
        self.jacobian = self.at.jacobian
        self._far = self._to_far()
        self._G = balance.excitation(self.found.forces, inputs.P)

    @property
    def lost(self) -> bool:
        """Whether there is no thermal equilibrium near the temperatures given."""
        return self.found.heat is not None and self.found.heat.lost

    def motion(self) -> Array:
        """Coefficients of the outputs, (n_outputs, L)."""
        far = self._far
        return self.outputs.assembled(self.x, None if far is None else -far.answer(self._G))

    def change(self, dx: Array, direction: Move = NOTHING) -> tuple[Array, Array]:
        """Change of the residual (N,) and of the outputs (n_outputs, L) for ``dx`` (N,) and a direction."""
        b, found = self.balance, self.found
        own, dpower, dP = self._sources(direction)
        dG = b.excitation(force_rates(b, found, dx, own, dpower), dP)
        dU = self._outputs_change(dx, dG, direction)
        b.anchoring(dx, dG)
        dR = dx + self.at.compliance.answer(dG)
        if direction.omega:
            dR += direction.omega * self.at.compliance.rate(self.at.G)
        if structure := _structure(direction):
            dR += b.compliance(self.omega, self.inputs.structure, structure).rate(self.at.G)
        return dR, dU

    def pushed(self, direction: Move) -> ComplexArray:
        """Change of the forces less the loads on all columns (n_columns, n + 1) at fixed motion, heat included."""
        own, dpower, dP = self._sources(direction)
        if self.found.heat is not None:
            heat_change(self.balance, self.found.heat, np.zeros(self.balance.size), dpower, own)
        return self.balance.excitation(own, dP)

    def _sources(self, direction: Move) -> tuple[list[dict[int, Array]], Array | None, Array]:
        """Changes at fixed motion: of forces and powers at fixed temperature too, and of the loads."""
        found, inputs = self.found, self._warm(direction.inputs)
        own: list[dict[int, Array]] = [{} for _ in self.balance.batches]
        if direction.omega:
            own = [{i: direction.omega * part for i, part in slopes.items()} for slopes in by_omega(found)]
        if inputs is not None:
            for total, more in zip(own, by_inputs(found, inputs), strict=True):
                for i, part in more.items():
                    add_to(total, i, part)
        heat = found.heat
        dpower = None if heat is None else self._power_rate(BatchPower(heat.batch, heat.power), direction)
        return own, dpower, np.zeros_like(found.inputs.P) if inputs is None else inputs.P

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
        """Change of residual and outputs along parameters of the structure, which act on no force."""
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
                gradient -= self.forces_pulled(self._far.transposed(_pairs(rest))[: self.balance.n_ports])
        if z is not None:
            gradient += self.jacobian.multiply(z, transposed=True)
        return gradient

    def columns_pulled(self, h: Array, z: Array) -> ComplexArray:
        """Numbers (n_columns, n + 1) on the forces less the loads that ``h . U + z . R`` amounts to."""
        pulled = self.at.compliance.transposed(_pairs(z.reshape(-1, self.balance.L)))
        if self._far is not None:
            pulled -= self._far.transposed(_pairs(self.outputs.transposed(h)[1]))
        return pulled

    def forces_pulled(self, psi: ComplexArray) -> Array:
        """``(dF/dX)^T psi`` (N,) of numbers (n_ports, n + 1) on the forces at the ports, heat included."""
        b, heat = self.balance, self.found.heat
        own, out = b.spread(b.real(psi)), np.zeros((b.n_ports, b.L))
        for batch, response, given in zip(b.batches, self.found.responses, own, strict=True):
            for (i, j), tangent in response.by_motion.items():
                port = batch.ports[j]
                if i in given and port.size:
                    out[port.rows] += np.einsum("cij,ci->cj", tangent, given[i])[port.members]
        pulled = out.reshape(-1)
        if heat is not None:
            given = own[heat.batch]
            warmth = np.zeros(b.batches[heat.batch].count)
            for i, force in heat.tangent.by_temperature.items():
                if i in given:
                    warmth += np.einsum("cl,cl->c", force, given[i])
            pulled += (heat.tangent.gain.T @ warmth) @ power_rows(b, heat)
        return pulled

    def _to_far(self, along: Mapping[str, float] | None = None) -> Compliance | None:
        """Receptances to outputs that are no port, with their derivative by omega, or along structural parameters."""
        if self.outputs.receptance is None:
            return None
        own = adjusted(self.outputs.receptance, self.inputs.structure)
        return Compliance(own, self.balance.orders, self.omega, along)

    def _warm(self, inputs: Inputs | None) -> Inputs | None:
        heat = self.found.heat
        return inputs if heat is None or inputs is None else warm_direction(heat, inputs)

    def powers(self) -> list[BatchPower]:
        """Power of every batch."""
        heat, found = self.found.heat, []
        for k, (batch, response) in enumerate(zip(self.balance.batches, self.found.responses, strict=True)):
            if heat is not None and heat.batch == k:
                found.append(BatchPower(k, heat.power))
            else:
                motion = self.balance.motion(k, self.x, self.omega, self.inputs.batches[k])
                found.append(BatchPower(k, Power(batch.law, motion, response)))
        return found

    def power_change(self, own: BatchPower, weights: Array, direction: Move) -> float:
        """Change of weighted powers at fixed motion and temperature."""
        return float(weights @ self._power_rate(own, direction))

    def power_pulled(self, own: BatchPower, weights: Array) -> Array:
        """Gradient (N,) of weighted powers over the unknowns at fixed temperature."""
        pulled: Array = weights @ power_rows(self.balance, own)
        return pulled

    def _power_rate(self, own: BatchPower, direction: Move) -> Array:
        inputs = self._warm(direction.inputs)
        rate = np.zeros(self.balance.batches[own.batch].count)
        if direction.omega:
            rate = rate + direction.omega * own.power.omega
        return rate if inputs is None else rate + power_along(own, inputs)


def _structure(direction: Move) -> Mapping[str, float]:
    return {} if direction.inputs is None else direction.inputs.structure


def _pairs(h: Array) -> ComplexArray:
    """Coefficients (rows, L) as complex numbers (rows, n + 1)."""
    out = np.zeros((len(h), h.shape[1] + 1))
    out[:, 0], out[:, 2:] = h[:, 0], h[:, 1:]
    return out.view(complex)
