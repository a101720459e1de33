"""Contacts of a stored point, each with its law: loops, forces and states are computed by the law itself.

The law comes from the problem. Without a problem, contacts whose friction variables are numbers are friction contacts;
the law of all others is unknown. Names of ports do not tell laws apart, as any law may use them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.contact.forces import ContactForces, element_forces
from slipstick.contact.friction import FrictionContact
from slipstick.contact.friction_law import NORMAL_PORT, TANGENTIAL_PORT, FrictionLaw, is_friction
from slipstick.contact.law import Interval, Motion
from slipstick.contact.planar import PlanarFrictionContact
from slipstick.contact.rest import REST, remember, rest_of
from slipstick.contact.stator import StatorContact
from slipstick.errors import InputError
from slipstick.faults import LARGEST, MOST_ITEMS, shown, suggestion, whole
from slipstick.results.schema import law_variables
from slipstick.results.view import names_of, place_of
from slipstick.state.thermal.model import HeatedContacts
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, BoolArray, IntArray

if TYPE_CHECKING:
    from slipstick.contact.law import Law
    from slipstick.results.solutions import Solutions

FRICTION_VARIABLES = {
    "kt": "tangential_stiffness",
    "mu": "friction_coefficient",
    "kn": "normal_stiffness",
    "gap": "gap",
}
"""Parameters of friction contacts and the variables that hold them."""

_FRICTION = FrictionContact(kt=0.0, mu=0.0, normal_load=0.0)
"""The law; its numbers are those of the results."""
NO_FRICTION = "these results hold no friction contact; laws of another kind have no such states"
UNKNOWN_STATE = "unknown"
"""State of a contact whose law has no states."""


@dataclass(frozen=True, kw_only=True)
class ContactsAtPoint:
    """Contacts of one law at a point, with the arguments of its functions.

    Attributes
    ----------
    law
        None where it is unknown.
    elements
        Numbers (n,) among all contacts.
    motion
        Total motion, that of rubbing included.
    relative
        Motion without it, (n, L) for each port.
    values
        Parameters of the law, (n,) each.
    """

    law: Law | None
    elements: IntArray
    motion: Motion
    relative: tuple[Array, ...]
    values: Mapping[str, Array]

    def of(self, contact: int) -> ContactsAtPoint:
        """One of them alone, by its number among all contacts."""
        e = np.flatnonzero(self.elements == contact)
        Q, drift = tuple(X[e] for X in self.motion.Q), self.motion.drift[:, e]
        return ContactsAtPoint(
            law=self.law, elements=self.elements[e], motion=self.motion._replace(Q=Q, drift=drift),
            relative=tuple(X[e] for X in self.relative), values={name: array[e] for name, array in self.values.items()},
        )  # fmt: skip


def friction_contacts(dataset: Any) -> BoolArray:
    """Which contacts (n_contacts,) are friction contacts of one direction, by the numbers of a table alone."""
    count = dataset.sizes.get("contact", 0)
    if not {*FRICTION_VARIABLES.values(), "contact_tangential"} <= set(dataset):
        return np.zeros(count, dtype=bool)
    known = [~np.isnan(dataset[name].to_numpy()).reshape(-1, count).all(axis=0) for name in FRICTION_VARIABLES.values()]
    return np.asarray(np.all(known, axis=0) & ~planar_contacts(dataset))


def planar_contacts(dataset: Any) -> BoolArray:
    """Which contacts (n_contacts,) slide in a plane, with the Coulomb circle, by the numbers of a table alone."""
    count = dataset.sizes.get("contact", 0)
    if not {"contact_second", "second_friction_force"} <= set(dataset):
        return np.zeros(count, dtype=bool)
    second = dataset["second_friction_force"].to_numpy().reshape(-1, count, dataset.sizes["coefficient"])
    return np.asarray(~np.isnan(second).all((0, 2)))


def contacts_at(branch: Solutions, point: int) -> list[ContactsAtPoint]:
    """The contacts of a point by law; InputError where there is no such point or its numbers are none."""
    d = branch.point(point)
    count, omega = d.sizes["contact"], float(d["omega"])
    if not 0.0 < omega <= LARGEST:
        raise InputError(f"point {point}: omega in the results is {omega:g}, which is no frequency; compute them again")
    if branch.problem is None:
        friction = friction_contacts(d)
        known = [_friction(branch.harmonics, d, point, np.flatnonzero(friction))] if friction.any() else []
        rest = np.flatnonzero(~friction)
        return [*known, *([_unknown(branch.harmonics, d, rest)] if rest.size else [])]
    problem, numbers, at_point = branch.problem_at(point), np.arange(count), []
    for batch, inputs in zip(problem.batches, problem.inputs.batches, strict=True):
        elements = numbers[batch.elements]
        if is_friction(batch.law) and REST not in batch.law.values:
            at_point.append(_friction(branch.harmonics, d, point, elements))
            continue
        relative = tuple(_numbers(d, f"contact_{port}", point, elements) for port in batch.law.ports)
        stored = {v.source: name for name, v in law_variables(batch.law).items() if v.source in batch.law.values}
        values = {
            name: _numbers(d, stored[name], point, elements) if stored.get(name) in d else default
            for name, default in inputs.values.items()
        }
        motion = Motion(
            branch.harmonics, omega, tuple(X + u for X, u in zip(relative, inputs.motion, strict=True)),
            inputs.drift(omega), inputs.velocity_per_omega,
        )  # fmt: skip
        at_point.append(
            ContactsAtPoint(law=batch.law, elements=elements, motion=motion, relative=relative, values=values)
        )
    return at_point


def contact_at(branch: Solutions, point: int, contact: int) -> ContactsAtPoint:
    """One contact of a point, by its number."""
    return next(batch.of(contact) for batch in contacts_at(branch, point) if contact in batch.elements)


def states_at(branch: Solutions, point: int) -> dict[str, list[Interval]]:
    """Intervals (start, end, state) of one period by contact; "unknown" where a law has no states.

    Raises InputError where no law does.
    """
    by_element: dict[int, list[Interval]] = {}
    has_any = False
    for batch in contacts_at(branch, point):
        states = None if batch.law is None else batch.law.states(batch.motion, batch.values)
        has_any = has_any or states is not None
        unknown = [[(0.0, 2.0 * np.pi, UNKNOWN_STATE)] for _ in batch.elements]
        by_element |= dict(zip(batch.elements.tolist(), states if states is not None else unknown, strict=True))
    if not has_any:
        raise InputError(NO_FRICTION)
    names = names_of(branch.table, "contact")
    return {name: by_element[i] for i, name in enumerate(names)}


def has_states(branch: Solutions, point: int) -> bool:
    """Whether the law of any contact has states."""
    return any(b.law is not None and b.law.states(b.motion, b.values) is not None for b in contacts_at(branch, point))


def has_orbit(branch: Solutions, point: int, contact: str) -> bool:
    """Whether a contact is one of a rotor with a circular stator."""
    names = names_of(branch.table, "contact")
    return isinstance(contact_at(branch, point, names.index(contact)).law, StatorContact)


def forces_at(branch: Solutions, point: int) -> ContactForces:
    """See ``Branch.contact_forces``."""
    batches = contacts_at(branch, point)
    friction = [batch for batch in batches if batch.law is not None and is_friction(batch.law)]
    if not friction:
        raise InputError(NO_FRICTION)
    count, omega = branch.table.sizes["contact"], float(np.asarray(friction[0].motion.omega))

    def among_all(each: Sequence[tuple[ContactsAtPoint, Array]]) -> Array:
        out = np.full((count, *each[0][1].shape[1:]), np.nan)
        for batch, values in each:
            out[batch.elements] = values
        return out

    X, Y = (among_all([(batch, batch.motion.Q[i]) for batch in friction]) for i in (TANGENTIAL_PORT, NORMAL_PORT))
    names = dict.fromkeys(name for batch in friction for name in batch.values)
    parameters, rest = rest_of(
        {name: among_all([(b, b.values[name]) for b in friction if name in b.values]) for name in names}
    )
    drift = among_all([(batch, batch.motion.drift[TANGENTIAL_PORT]) for batch in friction])
    forces = element_forces(branch.harmonics, X, Y, v=drift, **parameters)
    if rest:
        remember(forces, Motion(branch.harmonics, omega, (X, Y), drift[None]), parameters, rest[0])
    forces.omega = omega
    return forces


def equilibria_at(branch: Solutions, point: int) -> Any:
    """See ``Branch.thermal_equilibria``."""
    d, problem = branch.point(point), branch.problem_at(point)
    heated = next((state for state in problem.contact_states if isinstance(state, HeatedContacts)), None)
    if heated is None:
        raise InputError("no contact of this branch is heated; give the problem a thermal model")
    batch, inputs = problem.batches[heated.batch], problem.inputs.batches[heated.batch]
    omega = float(d["omega"])
    Q = tuple(
        d[f"contact_{port}"].to_numpy()[batch.elements] + inputs.motion[i] for i, port in enumerate(batch.law.ports)
    )
    motion = Motion(branch.harmonics, omega, Q, inputs.drift(omega), inputs.velocity_per_omega)
    return heated.all_equilibria(batch.law, motion, inputs.values)


def loop_at(
    branch: Solutions, point: int, contact: str | None = None, *, samples: int = 721, port: str | None = None
) -> dict[str, Array]:
    """See ``Branch.loop``."""
    place, samples = place_of(branch.table, "contact", contact), whole("samples", samples, 2, MOST_ITEMS)
    name, tau = names_of(branch.table, "contact")[place], np.linspace(0.0, 2.0 * np.pi, samples)
    there = contact_at(branch, point, place)
    if there.law is None:
        raise InputError(
            f"the law of contact '{name}' is not known: {branch.without}; give the problem, ss.load(path, problem)"
        )
    i = _port(there.law, name, port)
    forces = there.law.forces_in_time(there.motion, there.values, tau)
    if forces is None:
        raise InputError(f"the law of contact '{name}', a {type(there.law).__name__}, does not give its force in time")
    H, v = there.motion.harmonics.H_minus(tau), float(there.motion.drift[i, 0])
    loop = {
        "tau": tau,
        "motion": H @ there.relative[i][0],
        "total": H @ there.motion.Q[i][0] + v * tau,
        "force": forces[i][0],
    }
    if is_friction(there.law) and i == TANGENTIAL_PORT:
        loop |= {"friction": forces[i][0], "limit": there.values["mu"] * forces[NORMAL_PORT][0]}
    elif isinstance(there.law, PlanarFrictionContact) and i in there.law.dissipating:
        loop["limit"] = there.values["mu"] * forces[there.law.ports.index("normal")][0]
    return loop


def force_of(dataset: Any, contact: int) -> tuple[str, bool]:
    """The variable that holds the force of a contact along its first port, and whether that is a friction force."""
    if friction_contacts(dataset)[contact]:
        return "friction_force", True
    for name in dataset.data_vars:
        force = f"{str(name).removeprefix('contact_')}_force"
        there = str(name).startswith("contact_") and force in dataset
        if there and np.isfinite(dataset[force].to_numpy()[..., contact, :]).all():
            return force, False
    names = names_of(dataset, "contact")
    raise InputError(f"these results hold no force of contact '{names[contact]}'")


def _port(law: Law, contact: str, port: str | None) -> int:
    if port is not None and port not in law.ports:
        raise InputError(f"contact '{contact}' has no port {shown(port)}; {suggestion(port, law.ports)}")
    return 0 if port is None else law.ports.index(port)


def _friction(harmonics: Harmonics, d: Any, point: int, elements: IntArray) -> ContactsAtPoint:
    """Friction contacts: all from the numbers of the point."""
    relative = tuple(_numbers(d, f"contact_{port}", point, elements) for port in FrictionLaw.ports)
    moved = tuple(_numbers(d, name, point, elements) for name in ("rubbing_motion", "normal_motion"))
    velocity, omega = _numbers(d, "rubbing_velocity", point, elements), float(d["omega"])
    drift = np.stack([velocity / omega, np.zeros_like(velocity)])
    return ContactsAtPoint(
        law=_FRICTION, elements=elements, relative=relative,
        motion=Motion(harmonics, omega, tuple(X + u for X, u in zip(relative, moved, strict=True)), drift),
        values={name: _numbers(d, variable, point, elements) for name, variable in FRICTION_VARIABLES.items()},
    )  # fmt: skip


def _unknown(harmonics: Harmonics, d: Any, elements: IntArray) -> ContactsAtPoint:
    motion = Motion(harmonics, float(d["omega"]), (), np.zeros((0, elements.size)))
    return ContactsAtPoint(law=None, elements=elements, motion=motion, relative=(), values={})


def _numbers(d: Any, name: str, point: int, elements: IntArray) -> Array:
    """A variable of some contacts; InputError where it is missing, or holds what is no number of any machine."""
    if name not in d:
        raise InputError(f"point {point}: the results hold no '{name}', which these contacts need")
    values = np.asarray(d[name].to_numpy()[elements], dtype=float)
    wrong = ~(np.abs(values.reshape(len(values), -1)) <= LARGEST).all(axis=1)
    if wrong.any():
        contact = str(d["contact"].to_numpy()[elements[wrong][0]])
        raise InputError(
            f"point {point}, contact '{contact}': '{name}' in the results is not a number, or beyond {LARGEST:g}; "
            "compute them again"
        )
    return values
