"""Contact states in the balance: their term in each derivative, and the contacts at their initial values.

With a fast state z eliminated, every derivative of the residual gains ``C dP``, where ``C = A F_z G`` (N, n), ``G`` is
the state's gain and ``dP`` the derivative of the powers at fixed z (``state/contact_state.py``, THEORY.md (8.2)). A
slow one is held and adds nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from slipstick.balance.inputs import Inputs
from slipstick.contact.law import add_to
from slipstick.contact.power import Power
from slipstick.errors import Fault
from slipstick.faults import shown
from slipstick.state.contact_state import Carried, ContactState
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.balance import Balance
    from slipstick.balance.compliance import Compliance
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.jacobian_backends import AnyCompliance
    from slipstick.balance.layout import Batch


def state_columns(balance: Balance, carried: Carried, compliance: Compliance) -> Array:
    """``A F_z G``, (N, n): the residual by power put in at each contact that has the state."""
    batch = balance.batches[carried.batch]
    moved = np.zeros((batch.count, balance.n_ports, balance.orders.size + 1), dtype=complex)
    for i, force in carried.force_by_value.items():
        port = batch.ports[i]
        if port.size:
            pairs = np.zeros((port.size, 2 * balance.orders.size + 2))
            force_here = force[port.members]
            pairs[:, 0], pairs[:, 2:] = force_here[:, 0], force_here[:, 1:]
            moved[port.members] += compliance.value[port.rows] * pairs.view(complex)[:, None, :]
    by_value = balance.layout.real(moved.reshape(-1, moved.shape[2])).reshape(batch.count, -1)
    return np.asarray(by_value.T @ carried.gain, dtype=float)


class BatchPower(NamedTuple):
    """The power of the contacts of one batch that has no state."""

    batch: int
    power: Power


Powered = Carried | BatchPower


def power_rows(balance: Balance, powered: Powered) -> Array:
    """Derivatives of the powers by the unknowns at fixed states, (n, N)."""
    batch = balance.batches[powered.batch]
    rows = np.zeros((batch.count, balance.n_ports, balance.L))
    elements, ports = np.arange(batch.count), np.arange(balance.n_ports)
    for j, tangent in powered.power.by_motion.items():
        port = batch.ports[j]
        rows[elements[port.members], ports[port.rows]] = tangent[port.members]
    return rows.reshape(batch.count, -1)


def answer_to_powers(
    balance: Balance, states: Sequence[Carried], dpowers: Iterable[Array], compliance: AnyCompliance
) -> Array:  # fmt: skip
    """Change (N,) of the residual for changes (n,) of the powers at fixed states."""
    forces: list[dict[int, Array]] = [{} for _ in balance.batches]
    add_force_changes(states, dpowers, forces)
    return compliance.answer(balance.layout.excitation(forces))


def add_force_changes(states: Sequence[Carried], dpowers: Iterable[Array], forces: list[dict[int, Array]]) -> None:
    """Add the effect of the states to changes of the forces, for changes (n,) of the powers at fixed states."""
    for carried, dpower in zip(states, dpowers, strict=True):
        dz = carried.gain @ dpower
        for i, force in carried.force_by_value.items():
            add_to(forces[carried.batch], i, dz[:, None] * force)


def at_states(states: Sequence[Carried], direction: Inputs) -> Inputs:
    """A direction in the problem's parameters as one in the parameters of the laws at the contact states."""
    for carried in states:
        rates = direction.batches[carried.batch]
        direction = direction.with_batch(
            carried.batch,
            **{name: carried.state.by_given(name, carried.values) * rates.values[name] for name in carried.sampled},
        )
    return direction


def power_along(powered: Powered, direction: Inputs) -> Array:
    """Derivative of the powers along a direction (``at_states``) at fixed states, (n,)."""
    rates = direction.batches[powered.batch]
    along, speed = np.zeros(rates.velocity.shape[1]), rates.speed(powered.power.motion.omega)
    if speed.any():
        along += np.einsum("pn,pn->n", powered.power.by_velocity, speed)
    if rates.motion.any():
        for j, tangent in powered.power.by_motion.items():
            along += np.einsum("nl,nl->n", tangent, rates.motion[j])
    for name, rate in rates.values.items():
        if rate.any():
            along += powered.power.by_parameter(name) * rate
    return np.asarray(along, dtype=float)


def pairs_at_start(pairs: Sequence[ContactPair], batch: Batch, state: ContactState) -> tuple[ContactPair, ...]:
    """The contacts with their parameters at the initial value of a state."""
    changed = list(pairs)
    for e, (p, k) in enumerate(batch.members):
        for name, value in state.at_start().items():
            if np.isfinite(value[e]):
                changed[p] = changed[p].with_value(name, float(value[e]), k)
    return tuple(changed)


def state_faults(
    pairs: Sequence[ContactPair], batches: Sequence[Batch], states: Sequence[ContactState]
) -> Iterator[Fault]:
    """Faults of contacts that cannot have their states."""
    for s, state in enumerate(states):
        if not batches:
            continue
        batch = batches[state.batch]
        ports = [
            {name for name in batch.law.ports if pairs[p].direction(name, k) is not None} for p, k in batch.members
        ]
        yield from state.faults(batch.law, ports)
        for rival in (other for other in states[:s] if other.batch == state.batch):
            if rival.variable.name == state.variable.name:
                twice = f"two contact states are called {shown(rival.variable.name)}"
                yield Fault("states", twice, remedy="rename one")
            elif not (rival.slow or state.slow):
                names = f"{rival.variable.long_name} and {state.variable.long_name}"
                both = f"{names} are both fast states of contacts of one law"
                yield Fault("states", both, remedy="make them one state")
