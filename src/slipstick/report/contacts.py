"""Data from which a page draws the forces of contacts at every point: coefficients, parameters, states."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.contact.forces import element_states
from slipstick.contact.law import Interval
from slipstick.contact.stator import StatorContact
from slipstick.faults import LARGEST
from slipstick.report.encoding import Indices, fixed, packed
from slipstick.results.contacts import FRICTION_VARIABLES, contacts_at, planar_contacts
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, BoolArray

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions
    from slipstick.results.table import ResultTable

STATES = ("separation", "stick", "slip+", "slip-", "slip")
"""A state is stored as its place here."""
PHASES = 181
"""So many times of a period are stored of a friction force in a plane: every two degrees."""
_MOTIONS = ("contact_tangential", "contact_normal", "rubbing_motion", "normal_motion")
COEFFICIENTS = (*_MOTIONS, "friction_force", "normal_force")
"""Variables over contact and coefficient."""
NEEDED_VARIABLES = (*COEFFICIENTS, "rubbing_velocity", *FRICTION_VARIABLES.values())
"""Variables that make a friction contact's force."""
STEP = 4e-11
"""Step of a coefficient, relative to what the forces drawn from it need: they are right to some 1e-10 of themselves."""


def friction_of(dataset: ResultTable, harmonics: Harmonics, kept: Indices) -> dict[str, Any] | None:
    """Friction contacts among those of the page: motion, parameters and states give their force exactly.

    States are computed here, all points and contacts in one batch. ``of`` are places in ``kept``.
    """
    if not len(kept) or not set(NEEDED_VARIABLES) <= set(dataset):
        return None
    known = [_known(dataset, name, kept) for name in NEEDED_VARIABLES]
    of = np.flatnonzero(np.all([*known, ~planar_contacts(dataset)[kept]], axis=0))
    if not len(of):
        return None
    d = {name: dataset[name].to_numpy()[:, kept[of]] for name in NEEDED_VARIABLES}
    drift = d["rubbing_velocity"] / dataset["omega"].to_numpy()[:, None]
    friction, limit = d["friction_force"], d["friction_coefficient"] * d["normal_stiffness"]
    total, normal = d["contact_tangential"] + d["rubbing_motion"], d["contact_normal"] + d["normal_motion"]
    parameters = {key: d[name] for key, name in FRICTION_VARIABLES.items()}
    flat = {key: value.ravel() for key, value in ({"v": drift} | parameters).items()}
    shape = (-1, harmonics.size)
    intervals = element_states(harmonics, total.reshape(shape), normal.reshape(shape), **flat)
    alone = np.array([len(states) == 1 for states in intervals]).reshape(drift.shape)
    tangential = d["contact_tangential"]
    return {
        "of": of.tolist(),
        "motion": fixed(tangential, 6, _needed(tangential, friction, d["tangential_stiffness"])),
        "rubbing": packed(d["rubbing_motion"], "f8"),
        "normal": fixed(normal, 6, _needed(normal, friction, limit, d["normal_force"], d["normal_stiffness"])),
        "drift": packed(drift, "f8"),
        **{key: packed(value, "f8") for key, value in parameters.items()},
        "mean": packed(np.where(alone, friction[:, :, 0], 0.0), "f8"),  # the level of a contact stuck all period
        "states": _states(intervals, drift.shape),
    }


def planar_of(branch: Solutions, kept: Indices) -> dict[str, Any] | None:
    """Planar contacts among those of the page: vibration, friction force over the period, circle and states.

    ``of`` are places in ``kept``. None without any, or where their law is unknown.
    """
    of = np.flatnonzero(planar_contacts(branch.table)[kept])
    if not len(of) or branch.problem is None or not len(branch):
        return None
    tau = np.linspace(0.0, 2.0 * np.pi, PHASES)
    at_points = [_planar_at(branch, point, kept[of], tau) for point in range(len(branch))]
    force, limit = (np.array([[one[k] for one in row] for row in at_points]) for k in (0, 1))
    intervals = [one[2] for row in at_points for one in row]
    return {
        "of": of.tolist(),
        "tangential": fixed(branch.table["contact_tangential"].to_numpy()[:, kept[of]], 3),
        "second": fixed(branch.table["contact_second"].to_numpy()[:, kept[of]], 3),
        "force": fixed(force, 3),
        "limit": packed(limit, "f8"),
        "mu": packed(branch.table["friction_coefficient"].to_numpy()[:, kept[of]], "f8"),
        "states": _states(intervals, limit.shape[:2]),
    }


def _planar_at(
    branch: Solutions, point: int, contacts: Indices, tau: Array
) -> list[tuple[Array, Array, list[Interval]]]:
    """Of each contact at a point: both friction forces one after the other, the smallest and largest limit, states."""
    batches, found = contacts_at(branch, point), []
    for contact in contacts:
        there = next(batch.of(contact) for batch in batches if contact in batch.elements)
        assert there.law is not None
        forces = there.law.forces_in_time(there.motion, there.values, tau)
        states = there.law.states(there.motion, there.values)
        assert forces is not None
        assert states is not None
        limit = there.values["mu"] * forces[2][0]
        found.append((np.concatenate([forces[0][0], forces[1][0]]), np.array([limit.min(), limit.max()]), states[0]))
    return found


def orbits_of(branch: Solutions, kept: Indices) -> dict[str, Any] | None:
    """Rotors in a circular stator among those of the page: motion of the centre, clearance and states.

    ``of`` are places in ``kept``. None without any, or where their law is unknown.
    """
    problem = branch.problem
    if problem is None or not len(branch):
        return None
    stators = [batch.elements for batch in problem.batches if isinstance(batch.law, StatorContact)]
    numbers = np.arange(branch.table.sizes.get("contact", 0))
    of = np.flatnonzero(np.isin(kept, np.concatenate([numbers[:0], *(numbers[own] for own in stators)])))
    if not len(of):
        return None
    intervals, numbers_of = [], []
    for point in range(len(branch)):
        batches = contacts_at(branch, point)
        for contact in kept[of]:
            there = next(batch.of(contact) for batch in batches if contact in batch.elements)
            assert isinstance(there.law, StatorContact)
            intervals += there.law.states(there.motion, there.values)
            numbers_of.append([float(there.values[name][0]) for name in ("gap", "mu")])
    gap, mu = np.moveaxis(np.array(numbers_of).reshape(len(branch), len(of), 2), 2, 0)
    return {
        "of": of.tolist(),
        **{port: fixed(branch.table[f"contact_{port}"].to_numpy()[:, kept[of]], 3) for port in ("x", "y")},
        "gap": packed(gap, "f8"),
        "mu": packed(mu, "f8"),
        "states": _states(intervals, gap.shape),
    }


def _known(dataset: ResultTable, name: str, kept: Indices) -> BoolArray:
    """Which contacts have plausible numbers at every point, as the element needs them."""
    small = np.abs(dataset[name].to_numpy()[:, kept]) <= LARGEST
    return np.asarray(small.all(axis=(0, *range(2, small.ndim))))


def _needed(coefficients: Array, *forces_and_springs: Array) -> Array:
    """Step (n, m) for coefficients (n, m, L): small relative to them and to the forces that springs make of them."""
    size = np.abs(coefficients[:, :, 1:]).max(axis=2, initial=0.0)
    for force, spring in zip(forces_and_springs[::2], forces_and_springs[1::2], strict=True):
        load = np.abs(force).max(axis=2)
        size = np.minimum(size, np.divide(load, spring, out=np.full_like(load, np.inf), where=spring > 0))
    return STEP * size


def _states(intervals: list[list[Interval]], shape: tuple[int, ...]) -> dict[str, Any]:
    """Each interval ends where the next begins, round the period: starts and states say all."""
    starts = np.array([start for states in intervals for start, _, _ in states])
    codes = np.array([STATES.index(state) for states in intervals for _, _, state in states])
    counts = np.array([len(states) for states in intervals]).reshape(shape)
    return {"counts": packed(counts, "u2"), "starts": packed(starts, "f8"), "codes": packed(codes, "u1")}


def series_of(dataset: ResultTable, kept: Indices, friction: Indices) -> list[dict[str, Any]]:
    """Contacts of other laws by port: the harmonics of motion and force, which is all that results hold of them."""
    others = np.setdiff1d(np.arange(len(kept)), friction)
    return [series for port, force in _ports(dataset) if (series := _port(dataset, kept, others, port, force))]


def _ports(dataset: ResultTable) -> Iterator[tuple[str, str]]:
    """Names of ports and their forces."""
    for name in dataset.data_vars:
        port = name.removeprefix("contact_")
        force = next((f for f in (f"{port}_force", f"{port}_friction_force", "friction_force") if f in dataset), None)
        if name.startswith("contact_") and force:
            yield port, force


def _port(dataset: ResultTable, kept: Indices, others: Indices, port: str, force: str) -> dict[str, Any] | None:
    motion, forces = (dataset[name].to_numpy()[:, kept[others]] for name in (f"contact_{port}", force))
    there = np.isfinite(forces).all(axis=(0, 2)) if len(forces) else np.zeros(len(others), dtype=bool)
    if not there.any():
        return None
    arrays: dict[str, Array] = {"motion": motion[:, there], "force": forces[:, there]}
    return {"of": others[there].tolist(), "port": port, **{name: packed(values) for name, values in arrays.items()}}
