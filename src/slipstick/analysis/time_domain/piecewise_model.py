"""The piecewise linear system of a problem, for integration in time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.time_domain.law_in_time import LawInTime, LawsInTime
from slipstick.analysis.time_domain.piecewise import FrictionSystem
from slipstick.contact.friction_law import FrictionLaw, is_friction
from slipstick.contact.law import Law
from slipstick.contact.rest import REST, SECOND_REST
from slipstick.errors import Fault
from slipstick.faults import Gathering, numbers, shown, wrong
from slipstick.structure.checks import beside, dense
from slipstick.structure.protocol import TimeEquations
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, IntArray

if TYPE_CHECKING:
    from slipstick.balance.layout import Batch
    from slipstick.balance.problem import Problem


HELD_PARAMETERS = ("mu", "kt", "kn", "gap")
"""Contact parameters that can be given instead of the problem's."""


def friction_system(problem: Problem, omega: float, held: Mapping[str, Array] | None = None) -> FrictionSystem:
    """Structure, contacts and forcing of a problem at one fundamental frequency, rad/s.

    ``held`` gives contact parameters (n_contacts,) by name instead of the problem's own, see ``HELD_PARAMETERS``.

    Raises
    ------
    InputError
        If a name in ``held`` is unknown, or contacts carry a state and the parameters that follow it are not held.
    """
    held = _held(problem, held)
    frictional = friction_elements(problem)
    members = [(pair, k) for pair in problem.contacts for k in range(len(pair))]
    friction = [members[e] for e in frictional]
    tangential = [pair.direction("tangential", k) or {} for pair, k in friction]
    normal = [pair.direction("normal", k) if is_friction(pair.contact) else None for pair, k in friction]
    has_normal = np.array([direction is not None for direction in normal], dtype=bool)
    both = list(zip(problem.batches, problem.inputs.batches, strict=True))
    others = [(b, g) for b, g in both if not sticks_and_slips(b.law)]
    ports = [
        problem.contacts[p].direction(port, k) or {} for b, _ in others for port in b.law.ports for p, k in b.members
    ]
    contact = problem.direction_matrix([*tangential, *(d for d in normal if d is not None), *ports])
    driven = problem.load_columns
    outputs = problem.direction_matrix({name: 1.0} for name in problem.outputs or ())
    equations = problem.structure.turning_with(omega).time_equations(
        dense(beside(contact, outputs)), dense(beside(contact, driven.vectors)), driven.shapes
    )
    h = problem.harmonics
    loads = driven.forces(problem.load_coefficients(), h.orders[1:], omega)
    rubbing, approach = np.zeros((2, len(members), h.size))
    velocity = np.zeros(len(members))
    for batch, inputs in both:
        if sticks_and_slips(batch.law):
            rubbing[batch.elements], velocity[batch.elements] = inputs.motion[0], inputs.speed(omega)[0]
        if is_friction(batch.law):
            approach[batch.elements] = inputs.motion[1]
    values = {name: np.asarray(held.get(name, problem.contact_values(name)), dtype=float) for name in HELD_PARAMETERS}
    values = {name: value[frictional] for name, value in values.items()}
    for batch, inputs in both:
        if batch.law.slider_count:
            own = np.isin(frictional, batch.numbers)
            for name, value in slider_values(batch.law, inputs.values).items():
                values[name][own] = value
    return system_of(
        equations, omega, h, velocity=velocity[frictional], has_normal=has_normal, rubbing=rubbing[frictional],
        approach=approach[frictional], loads=loads, **values,
        laws=LawsInTime([law_in_time(b, held_values(b, g.values, held), g.speed(omega)) for b, g in others]),
        law_motion=np.concatenate([np.zeros((0, h.size)), *(g.motion.reshape(-1, h.size) for _, g in others)]),
        law_velocity=np.concatenate([np.zeros(0), *(g.speed(omega).reshape(-1) for _, g in others)]),
    )  # fmt: skip


def sticks_and_slips(law: Law) -> bool:
    """Whether contacts of a law are integrated as friction contacts, which they are or consist of."""
    return is_friction(law) or law.slider_count > 0


def slider_values(law: Law, values: Mapping[str, Array]) -> dict[str, Array]:
    """Parameters (n count,) of the sliders of n elements of a law, as friction contacts."""
    kt, limit = (part.reshape(-1) for part in law.slider_parameters(values))
    return {"kt": kt, "mu": np.ones(kt.size), "kn": np.ones(kt.size), "gap": -limit}


def friction_elements(problem: Problem) -> IntArray:
    """Numbers among all contacts: friction contacts, then contacts of sliders, repeated for each slider."""
    kinds = [is_friction(pair.contact) for pair in problem.contacts for _ in range(len(pair))]
    sliders = [np.repeat(b.numbers, b.law.slider_count).astype(int) for b in problem.batches]
    return np.concatenate([np.flatnonzero(kinds), *sliders])


def law_in_time(batch: Batch, values: Mapping[str, Array], velocity: Array) -> LawInTime:
    """Contacts of a batch whose law has equations in time; ``velocity`` (n_ports, n), constant."""
    numbers = np.arange(max(batch.numbers, default=-1) + 1)
    columns = {name: np.asarray(value, dtype=float)[:, None] for name, value in values.items()}
    return LawInTime(law=batch.law, values=columns, elements=numbers[batch.elements], velocity=velocity)


def held_values(batch: Batch, values: Mapping[str, Array], held: Mapping[str, Array]) -> Mapping[str, Array]:
    """Parameters (n,) of a batch, with the given ones in place of those of friction."""
    if not isinstance(batch.law, FrictionLaw):
        return values
    return {name: held[name][batch.elements] if name in held else value for name, value in values.items()}


def system_of(
    equations: TimeEquations, omega: float, harmonics: Harmonics, *, rubbing: Array, approach: Array, loads: Array,
    gap: Array, law_motion: Array | None = None, laws: LawsInTime | None = None, **contacts: Any,
) -> FrictionSystem:  # fmt: skip
    """The system in the orders of its loads and prescribed motions, which are (..., L).

    ``contacts`` are ``velocity``, ``has_normal``, ``kt``, ``mu``, ``kn`` and ``law_velocity``, as ``FrictionSystem``
    takes them.
    """
    approach = approach.copy()
    approach[:, 0] -= gap
    law_motion = np.zeros((0, harmonics.size)) if law_motion is None else law_motion
    moving = np.abs(np.vstack([rubbing, approach, loads, law_motion])).max(axis=0, initial=0.0)
    orders = tuple(m for k, m in enumerate(harmonics.orders[1:]) if moving[1 + 2 * k : 3 + 2 * k].any())
    kept = harmonics.columns((0, *orders))
    laws = LawsInTime(()) if laws is None else laws
    if laws.switching:
        laws = laws.sized(_typical_motion(equations, laws, loads, law_motion))
    return FrictionSystem(
        equations=equations, omega=omega, orders=orders, laws=laws, rubbing=rubbing[:, kept],
        approach=approach[:, kept], loads=loads[:, kept], law_motion=law_motion[:, kept], **contacts,
    )  # fmt: skip


def _typical_motion(equations: TimeEquations, laws: LawsInTime, loads: Array, moved: Array) -> float:
    """Typical motion of contacts whose law switches.

    The largest gap, motion at rest, surface motion or static answer to the loads.
    """
    own = [law.values[name] for law, *_ in laws.each for name in ("gap", REST, SECOND_REST) if name in law.values]
    forces = np.abs(equations.columns[:, equations.columns.shape[1] - len(loads) :]) @ np.abs(loads).sum(axis=1)
    still = np.linalg.lstsq(equations.K, forces, rcond=None)[0]
    sizes = [
        *(np.abs(values).max(initial=0.0) for values in own),
        np.abs(moved).max(initial=0.0),
        np.abs(equations.rows @ still).max(initial=0.0),
    ]
    return float(max(sizes)) or 1.0


def integration_faults(problem: Problem) -> Iterator[Fault]:
    """Contacts whose law has no equations in time."""
    for pair in problem.contacts:
        if not (sticks_and_slips(pair.contact) or pair.contact.in_time):
            what = f"contact '{pair.name}' follows a law that does not tell its rate in time"
            yield Fault("time integration", what, remedy=pair.contact.rate_remedy)


def _held(problem: Problem, parameters: Mapping[str, Any] | None) -> dict[str, Array]:
    """Contact parameters given instead of the problem's, (n_contacts,) each."""
    if parameters is not None and not isinstance(parameters, Mapping):
        raise wrong("time integration, held", parameters, f"a dict of contact parameters: {', '.join(HELD_PARAMETERS)}")
    n, checks, held = len(problem.elements), Gathering(), {}
    checks.faults += integration_faults(problem)
    for name, value in (parameters or {}).items():
        where = f"time integration, held {shown(name)}"
        if name not in HELD_PARAMETERS:
            checks.faults.append(
                Fault("time integration, held", found=shown(name), expected=f"one of {', '.join(HELD_PARAMETERS)}")
            )
            continue
        values = checks.take(numbers, where, value)
        if values is not None and values.shape != (n,):
            checks.faults.append(Fault(where, found=f"shape {values.shape}", expected=f"({n},)"))
        elif values is not None:
            held[name] = values
    unknown = (state.time_fault(parameters or ()) for state in problem.contact_states)
    checks.faults += [fault for fault in unknown if fault is not None]
    checks.end()
    return held
