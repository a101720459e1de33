"""Structures that only their contacts hold: reference springs in harmonic 0, subtracted from the contact forces again.

A singular stiffness K has no static compliance. With reference springs k along the contact ports, ``K + B k B^T`` has,
and ``X + A (F - k X - P)`` has the same solutions as ``K u + B (F - P) = 0``, whatever k is. Harmonics above 0 need
none.

Friction alone fixes no mean position: its force does not change with it. Where only friction holds a rigid-body motion,
the mean displacement is computed without it, and the mean loads along it have to be in balance by themselves.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.contact.law import Motion
from slipstick.contact.rest import REST
from slipstick.errors import Fault, InputError
from slipstick.structure.checks import dense
from slipstick.structure.matrices import NOTHING_HOLDS
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.layout import Batch
    from slipstick.balance.problem import Problem

_BALANCED = 1e-8
"""Mean force along a rigid-body motion, over the forces it consists of, that counts as zero: rounding of the modes."""
_SLIDING = 10.0
"""Amplitude, over the motion up to slip, at which laws are evaluated: at the onset of slip rounding would decide."""
_NO_STIFFNESS = 1e-6
"""Derivative by the mean displacement, over the largest derivative, that counts as zero."""
_NNLS_RESIDUAL = 1e-6
"""Residual of non-negative least squares, over the right-hand side, above which there is no solution."""


@dataclass(frozen=True, kw_only=True)
class Support:
    """Support in harmonic 0 of a structure that is not held by itself.

    Attributes
    ----------
    structure
        The structure with the reference springs in its static compliance.
    springs
        Reference stiffness of each port (n_ports,), to be subtracted from the contact forces.
    held_by_friction
        Rigid-body motions of the ports that friction alone holds, (n_ports, k); mass-normalised.
    """

    structure: Any
    springs: Array
    held_by_friction: Array


def support_of(problem: Problem) -> Support | None:
    """Support of the structure in harmonic 0; None where it is held by itself. InputError where nothing holds it."""
    structure: Any = problem.structure
    if structure.held:
        return None
    directions = np.asarray(dense(problem.direction_matrix(problem.port_directions)), dtype=float)
    fixing = _fixing(problem)
    supported, springs, free = structure.supported_at(directions, fixing)
    held_by_friction = directions.T @ free
    for motion in held_by_friction.T:
        if not np.any(np.abs(motion) > _BALANCED * np.abs(free).max(initial=0.0)):
            raise InputError(NOTHING_HOLDS)
    forces = _static_loads(problem)
    if np.any(np.abs(forces.T @ free) > _BALANCED * np.abs(free).max(initial=0.0) * np.abs(forces).max()):
        raise InputError(
            Fault(
                "loads",
                "those of harmonic 0 push the structure where friction alone holds it, and its mean "
                "position there is not determined",
                remedy="hold the structure there, or leave the mean of the loads out",
            )
        )
    return Support(structure=supported, springs=springs, held_by_friction=held_by_friction)


def _static_loads(problem: Problem) -> Array:
    """Forces on all dofs in harmonic 0, (n_dofs, 1)."""
    columns, P = problem.load_columns, problem.load_coefficients()
    forces = np.column_stack([columns.vectors, *(problem.structure.shape_load(name) for name in columns.shapes)])  # type: ignore[attr-defined]
    return np.asarray(forces @ columns.forces(P, [], 1.0)[:, :1])


def _fixing(problem: Problem) -> Array:
    """Ports (n_ports,) whose force depends on the mean position: friction along a surface does not.

    That of a contact that knows its motion at rest does, as long as it sticks.
    """
    fixing = np.ones(len(problem.port_directions), dtype=bool)
    for batch, given in zip(problem.batches, problem.inputs.batches, strict=True):
        along = {port for name, port in batch.law.surface_ports.items() if name != "normal"}
        for i, name in enumerate(batch.law.ports):
            port = batch.ports[i]
            if name in along and port.size and REST not in given.values:
                fixing[port.rows] = _answers_mean(batch, i, given.values)[port.members]
    return fixing


def _answers_mean(batch: Batch, i: int, values: Mapping[str, Array]) -> Any:
    """Whether the mean force changes with the mean displacement while a contact vibrates along a port, (n,)."""
    harmonics, n, ports = Harmonics([0, 1]), batch.count, len(batch.law.ports)
    moved = [np.zeros((n, harmonics.size)) for _ in range(ports)]
    size = float(np.max(np.abs(batch.law.size(values)), initial=0.0))
    moved[i][:, 1] = _SLIDING * (size if 0.0 < size < np.inf else 1.0)
    response = batch.law.respond(Motion(harmonics, 1.0, tuple(moved), np.zeros((ports, n))), values)
    tangent = response.by_motion.get((i, i))
    if tangent is None:
        return np.zeros(n, dtype=bool)
    return np.abs(tangent[:, 0, 0]) > _NO_STIFFNESS * np.abs(tangent).max(axis=(1, 2))


def pressing_warnings(problem: Problem) -> Iterator[str]:
    """Whether what can only push can balance the mean of the loads along the rigid-body motions, where it alone holds.

    In a periodic motion the mean forces along a rigid-body motion are in balance. A normal force is never negative.
    """
    if problem.support is None:
        return
    from scipy.optimize import nnls  # its import takes a tenth of a run

    structure: Any = problem.structure
    R, forces = structure.rigid_motions, _static_loads(problem)
    motions = np.asarray(dense(problem.direction_matrix(problem.port_directions)), dtype=float).T @ R
    pushing = np.zeros(len(motions), dtype=bool)
    for batch, given in zip(problem.batches, problem.inputs.batches, strict=True):
        normal = batch.law.surface_ports.get("normal")
        for name, port in zip(batch.law.ports, batch.ports, strict=True):
            if name == normal:
                pushing[port.rows] = True
            elif not np.any(np.asarray(given.values.get("mu", 1.0))):
                motions[port.rows] = 0.0  # without friction no force
    if not pushing.any() or np.any(np.abs(motions[~pushing]) > _BALANCED * np.abs(R).max()):
        return
    loads = (R.T @ forces).ravel()
    wanted, columns = loads, motions[pushing].T
    if not np.any(np.abs(loads) > _BALANCED * np.abs(R).max() * np.abs(forces).max(initial=0.0)):
        wanted, columns = np.r_[loads, 1.0], np.vstack([columns, np.ones(columns.shape[1])])  # any forces in balance
    if nnls(columns, wanted)[1] > _NNLS_RESIDUAL * np.linalg.norm(wanted):
        yield (
            "only contacts hold the structure, and they can only push: without a static load (harmonic 0) that "
            "presses it onto them it comes off; give that load, such as its weight"
        )


def drift_warnings(problem: Problem, values: Mapping[str, Array]) -> Iterator[str]:
    """Whether the mean friction forces in results push a structure along what nothing else holds."""
    support = problem.support
    if support is None or not support.held_by_friction.shape[1]:
        return
    force, largest = np.zeros((len(values["omega"]), len(support.springs))), 0.0
    for batch in problem.batches:
        for name, port in zip(batch.law.force_names, batch.ports, strict=True):
            found = np.asarray(values[f"{name}_force"])[:, batch.elements][:, port.members]
            port.add(found[..., 0], force)
            largest = max(largest, float(np.nanmax(np.abs(found), initial=0.0)))
    pushed = float(np.nanmax(np.abs(force @ support.held_by_friction), initial=0.0))
    if pushed > _BALANCED * largest * np.abs(support.held_by_friction).max():
        yield (
            "the mean friction force pushes the structure along a motion that nothing but friction holds: it would "
            "creep away, so the mean displacement means nothing; hold the structure there"
        )
