"""Residual ``R = X + A (F - P)`` of the multiharmonic balance and its derivatives (THEORY.md (9.2))."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from slipstick.balance.balance import Balance
from slipstick.balance.inputs import ContactInputs, Inputs
from slipstick.balance.jacobian_backends import AnyCompliance
from slipstick.balance.ports import Forces
from slipstick.balance.states import add_force_changes, power_rows
from slipstick.contact.law import Response, add_to
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.solve.norm import norm
from slipstick.state.contact_state import Carried, respond
from slipstick.typing import Array, ComplexArray


class Adapted(Protocol):
    """What is known of a solution with some of the harmonics."""

    @property
    def in_use(self) -> int:
        """How many, 0 included."""
        ...

    @property
    def truncation(self) -> float:
        """What those left out would add, relative to the largest amplitude."""
        ...

    @property
    def context(self) -> Array:
        """The context with which the same harmonics are in use, near the same contact states."""
        ...


@dataclass(frozen=True, kw_only=True, slots=True)
class Detail:
    """What a solution keeps of its evaluation."""

    responses: tuple[Response, ...]
    """One for each batch; none where they are still to be had (``balance.batch_evaluation``)."""
    inputs: Inputs
    omega: float
    states: tuple[Carried, ...] = ()
    """What the contacts carry beside motion, in the order of the balance."""
    adapted: Adapted | None = None
    """Which harmonics are in use; None: all."""

    @property
    def asked(self) -> Inputs:
        """The inputs with the parameters that the laws were asked with: at the contact states."""
        if not self.states:
            return self.inputs
        pairs = zip(self.inputs.batches, self.responses, strict=True)
        return replace(
            self.inputs, batches=tuple(contact_inputs.changed(**response.values) for contact_inputs, response in pairs)
        )

    @property
    def carried(self) -> Array | None:
        """Values of the contact states (n_states,), near which those of the next points are sought."""
        if len(self.states) == 1:
            return self.states[0].values
        return np.concatenate([state.values for state in self.states]) if self.states else None

    @property
    def fast(self) -> tuple[Carried, ...]:
        """The states that follow the motion; a slow one is held and adds nothing to a derivative."""
        return self.states and tuple(carried for carried in self.states if not carried.state.slow)

    @property
    def lost(self) -> bool:
        """Whether the equilibrium of some state near the values handed on has vanished."""
        return bool(self.states) and any(state.lost for state in self.states)

    @property
    def forces(self) -> Forces:
        """Forces by batch and port."""
        return [dict(enumerate(response.force)) for response in self.responses]


class Balanced(NamedTuple):
    """One evaluation: residual (N,), Jacobian, the forces on all columns, and what they came from."""

    residual: Array
    jacobian: Jacobian
    G: ComplexArray
    compliance: AnyCompliance
    detail: Detail


def detail(balance: Balance, x: Array, omega: float, inputs: Inputs, near: Array | None = None) -> Detail:
    """Forces, and contact states if any, at unknowns (N,): the one place where laws meet the motion.

    ``near`` (n_states,) are the states of the neighbouring solution, near which these are sought; from their start
    without it.
    """
    if (felt := balance.pulse.felt) is not None:
        felt()
    responses: list[Response] = []
    states: dict[int, Carried] = {}
    for k, contact_inputs in enumerate(inputs.batches):
        batch, motion = balance.batches[k], balance.layout.motion(k, x, omega, contact_inputs)
        of_batch = balance.states and [s for s, state in enumerate(balance.states) if state.batch == k]
        if of_batch:
            values = balance.by_state(near)
            response, carried = respond(
                [balance.states[s] for s in of_batch],
                batch.law,
                motion,
                contact_inputs.values,
                [values[s] for s in of_batch],
            )
            responses.append(response)
            states |= zip(of_batch, carried, strict=True)
        else:
            responses.append(batch.law.respond(motion, contact_inputs.values))
    in_order = tuple(states[s] for s in sorted(states)) if states else ()
    return Detail(responses=tuple(responses), inputs=inputs, omega=omega, states=in_order)


def unanswered(inputs: Inputs, omega: float) -> Detail:
    """Of a state whose forces are asked for later, together with those of others."""
    return Detail(responses=(), inputs=inputs, omega=omega)


def balanced(balance: Balance, x: Array, solution: Detail, compliance: AnyCompliance) -> Balanced:
    """Residual and Jacobian from the forces at unknowns (N,)."""
    G = balance.layout.excitation(solution.forces, solution.inputs.P)
    balance.anchoring(x, G)
    jacobian = balance.jacobian([response.by_motion for response in solution.responses], compliance, solution.fast)
    return Balanced(
        residual=x + compliance.answer(G), jacobian=jacobian, G=G, compliance=compliance,
        detail=solution,
    )  # fmt: skip


def terms(balance: Balance, x: Array, at: Balanced) -> Array:
    """Sizes (N,) of the terms whose sum each residual is: the motion, and ``|A| k`` times all motion at the ports.

    ``k`` are the contact springs as far as they act. The stiffer they are, the more the forces cancel, and the more is
    seen of the rounding of the motion.
    """
    stiffness, prescribed = np.zeros(balance.n_ports), 0.0
    for batch, contact_inputs, response in zip(
        balance.batches, at.detail.inputs.batches, at.detail.responses, strict=True
    ):
        prescribed += float(np.sum(contact_inputs.motion[..., 1:] ** 2))
        for i, springs in batch.law.springs(response).items():
            port = batch.ports[i]
            stiffness[port.rows] += springs[port.members]
    motion = norm(x)
    by_order = motion + at.compliance.reach(stiffness) * (motion + np.sqrt(prescribed))
    return np.concatenate([by_order[:, :1], np.repeat(by_order[:, 1:], 2, axis=1)], axis=1).reshape(-1)


def force_rates(
    balance: Balance, solution: Detail, dx: Array, fixed: Forces, dpowers: Iterable[Array] = ()
) -> Forces:  # fmt: skip
    """Change of the forces for a change ``dx`` (N,) of the motion, with changes ``fixed`` at fixed motion besides.

    ``dpowers`` (n,) are changes of the powers that drive each contact state, at fixed motion and states.
    """
    changed = []
    for response, moved, extra in zip(solution.responses, balance.layout.spread(dx), fixed, strict=True):
        total = dict(extra)
        for (i, j), tangent in response.by_motion.items():
            if j in moved:
                part = np.einsum("cij,cj->ci", tangent, moved[j])
                add_to(total, i, part)
        changed.append(total)
    if solution.states:
        total_power = [
            power_rows(balance, state) @ dx + dpower for state, dpower in zip(solution.states, dpowers, strict=True)
        ]
        add_force_changes(solution.states, total_power, changed)
    return changed


def by_omega(solution: Detail) -> list[dict[int, Array]]:
    """Derivatives of the forces by omega at fixed motion; velocities that grow with omega leave the drift alone."""
    slopes = []
    for response, contact_inputs in zip(solution.responses, solution.inputs.batches, strict=True):
        slope = dict(response.by_omega)
        if response.by_drift and contact_inputs.at_speed:
            rate = contact_inputs.velocity / -(solution.omega**2)
            for (i, j), tangent in response.by_drift.items():
                part = rate[j][:, None] * tangent
                add_to(slope, i, part)
        slopes.append(slope)
    return slopes


def by_inputs(solution: Detail, direction: Inputs) -> list[dict[int, Array]]:
    """Derivatives of the forces along a direction in the inputs at fixed motion."""
    slopes = []
    for response, along in zip(solution.responses, direction.batches, strict=True):
        slope: dict[int, Array] = {}
        for i, part in _terms(response, along, solution.omega):
            add_to(slope, i, part)
        slopes.append(slope)
    return slopes


def _terms(response: Response, along: ContactInputs, omega: float) -> Iterator[tuple[int, Array]]:
    for name, rate in along.values.items():
        if rate.any():
            for i, tangent in response.by_parameter(name).items():
                yield i, rate[:, None] * tangent
    drift = along.drift(omega)
    if drift.any():
        for (i, j), tangent in response.by_drift.items():
            yield i, drift[j][:, None] * tangent
    if along.motion.any():
        for (i, j), tangent in response.by_motion.items():
            yield i, np.einsum("cij,cj->ci", tangent, along.motion[j])
