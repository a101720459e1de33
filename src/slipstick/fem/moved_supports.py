"""Held dofs that move: what the elements at them do to the body, as a load in coordinates that do not move.

With u_s the motion of the held dofs and K_fs the stiffness between free and held ones, a slow motion obeys

    K u = p - K_fs u_s.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from slipstick.errors import Fault, InputError, Where
from slipstick.faults import Gathering, number, numbers, shown, suggestion, table, wrong
from slipstick.fem.assembly import assemble
from slipstick.fem.equations import COMPONENTS, names_dofs, rows_named
from slipstick.fem.expansion import meshed
from slipstick.fem.load_steps import LoadStep, acting, curve_warnings, nodes_of
from slipstick.fem.mesh import Mesh, part_of, user_names
from slipstick.fem.model import FiniteElementModel
from slipstick.structure.protocol import DISPLACEMENT
from slipstick.typing import Array, BoolArray, IntArray

MOVED = (
    'node sets or surfaces with a direction, {"jaw": {"x1": [1, 0, 0]}}, held dofs with their motion, '
    '{"jaw": {"n12x": 1.0}}, or a load step of the file by its name'
)
_AXES: Mapping[str, tuple[float, float, float]] = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
_BALANCED = 1e-6
"""Force of a motion of body and supports together, over that of the supports alone, that is rounding."""


@dataclass(frozen=True, kw_only=True)
class MovedSupports:
    """Motions of held nodes by name, node-major (3 n_nodes,), for a unit displacement.

    Each is a load shape, "displacement NAME": ``-K_fs u_s`` by the elements at these nodes.
    """

    motions: Mapping[str, Array]
    forces: Mapping[str, Array] = field(repr=False)
    """On the rows of the model (n,)."""
    warnings: tuple[str, ...] = ()

    @classmethod
    def of(cls, model: FiniteElementModel, given: Mapping[str, Any]) -> MovedSupports | None:
        """From what a user gives; None without any.

        Raises
        ------
        InputError
            For sets that are not there, nodes that are not held, a model without mesh and materials, and supports on
            whose motion equations depend.
        """
        if not given:
            return None
        mesh, gathering = meshed(model, "supports that move"), Gathering()
        held = _held(model, mesh)
        motions = {
            name: gathering.take(_motion, model, mesh, held, moved, (DISPLACEMENT, name))
            for name, moved in given.items()
        }
        gathering.end()
        stiffness = _at_nodes(model, mesh, np.flatnonzero(held.reshape(-1, 3).any(axis=1)))
        made = {name: motion for name, motion in motions.items() if motion is not None}
        for name, motion in made.items():
            for axis in np.flatnonzero(motion.reshape(-1, 3).any(axis=0)):
                gathering.take(_free_of_equations, model, COMPONENTS[axis], (DISPLACEMENT, name))
        forces = {name: -np.asarray(model.restrict(stiffness @ motion)) for name, motion in made.items()}
        for name, force in forces.items():
            if not force.any():
                what = "moves no free node: there is no element of the mesh between it and one"
                remedy = "name held nodes of solid elements, of a rigid body those of its surface"
                gathering.faults.append(Fault((DISPLACEMENT, name), what, remedy=remedy))
        gathering.end()
        steps = [of for of in given.values() if isinstance(of, str)]
        return cls(
            motions=made,
            forces={f"{DISPLACEMENT} {name}": force for name, force in forces.items()},
            warnings=(
                *_warnings(model, stiffness, held, made),
                *curve_warnings(model.source, model.load_steps, steps, DISPLACEMENT),
            ),
        )

    def at_nodes(self, nodes: IntArray) -> dict[str, Array]:
        """Motion of some nodes (3 n,) by shape."""
        every = self.motions.items()
        return {f"{DISPLACEMENT} {name}": motion.reshape(-1, 3)[nodes].ravel() for name, motion in every}

    def seen(self, rows: Any) -> dict[str, Array]:
        """What the held nodes do to what is taken from the motion of all, by columns (3 n_nodes, k), by shape."""
        return {f"{DISPLACEMENT} {name}": np.asarray(rows.T @ motion) for name, motion in self.motions.items()}


def _held(model: FiniteElementModel, mesh: Mesh) -> BoolArray:
    """Which dofs are held, (3 n_nodes,)."""
    labels, components = model.constrained.T
    place = {int(label): at for at, label in enumerate(mesh.labels)}
    held = np.zeros(3 * mesh.n_nodes, dtype=bool)
    for label, component in zip(labels.tolist(), components.tolist(), strict=True):
        if component < 3 and label in place:
            held[3 * place[label] + component] = True
    return held


def _motion(model: FiniteElementModel, mesh: Mesh, held: BoolArray, moved: Any, name: Where) -> Array:
    """Of all nodes (3 n_nodes,)."""
    if isinstance(moved, str) and model.load_steps:
        motion = _of_step(mesh, model.load_steps, moved, name)
        _require_held(mesh, held, motion.ravel(), name)
        return motion.ravel()
    motion, gathering = np.zeros((mesh.n_nodes, 3)), Gathering()
    every = np.repeat(mesh.labels, 3), np.tile(np.arange(3), mesh.n_nodes)
    for at, value in table(name, moved, MOVED).items():
        if at in mesh.all_sets:
            along = gathering.take(_direction, value, (*name, at))
            if along is not None:
                motion[mesh.all_sets[at]] = along
        elif names_dofs(at) and (rows := rows_named(at, *every)).sum() == 1:
            motion.reshape(-1)[rows] = gathering.take(number, (*name, at), value, "its motion") or 0.0
        else:
            what = f"there is no node set or held dof '{at}' in the model"
            gathering.faults.append(Fault((*name, at), what, remedy=suggestion(at, user_names(mesh.all_sets))))
    gathering.end()
    _require_held(mesh, held, motion.ravel(), name)
    if not motion.any():
        raise wrong(name, moved, MOVED)
    return motion.ravel()


def _of_step(mesh: Mesh, steps: Mapping[str, LoadStep], step: str, name: Where) -> Array:
    """Displacements (n_nodes, 3) at the end of a load step of the file."""
    motion = np.zeros((mesh.n_nodes, 3))
    try:
        for load in acting(steps, step, DISPLACEMENT):
            nodes = nodes_of(load, mesh)
            if load.value and not len(nodes):
                raise InputError(Fault(statement=f"moves node {load.where}, which belongs to no element of the mesh"))
            motion[nodes, load.axis - 1] = load.value
    except InputError as error:
        raise InputError([fault.inside(*name) for fault in error.faults]) from None
    return motion


def _require_held(mesh: Mesh, held: BoolArray, motion: Array, name: Where) -> None:
    loose = np.flatnonzero((motion != 0.0) & ~held)
    if len(loose):
        dof = f"n{mesh.labels[loose[0] // 3]}{COMPONENTS[loose[0] % 3]}"
        what = f"{len(loose)} of the dofs that move are not held, the first of them {dof}"
        raise InputError(Fault(name, what, remedy='hold them where the model is made: fixed=["..."]'))


def _direction(value: Any, name: Where) -> Array:
    expected = 'a direction: "x", "y", "z" or three numbers'
    if isinstance(value, str):
        if value not in _AXES:
            raise InputError(Fault(name, found=shown(value), expected=expected))
        return np.array(_AXES[value], dtype=float)
    along = numbers(name, value, expected)
    if along.shape != (3,):
        raise wrong(name, value, expected)
    return along


def _at_nodes(model: FiniteElementModel, mesh: Mesh, nodes: IntArray) -> csr_array:
    """Stiffness (3 n_nodes, 3 n_nodes) of the elements at some nodes."""
    chosen = {kind: np.flatnonzero(np.isin(block, nodes).any(axis=1)) for kind, block in mesh.blocks.items()}
    return assemble(part_of(mesh, chosen), model.materials).stiffness


def _free_of_equations(model: FiniteElementModel, axis: str, name: Where) -> None:
    """Refuse equations on held dofs: how these move them is not kept."""
    try:
        model.translation(axis)
    except InputError as error:
        what = f"equations of the model may hold nodes to supports that stay: {error.faults[0].statement}"
        raise InputError(Fault(name, what, remedy="hold nodes that no equation names")) from None


def _warnings(
    model: FiniteElementModel, stiffness: csr_array, held: BoolArray, motions: Mapping[str, Array]
) -> Iterator[str]:
    """Whether something besides the elements of the mesh at rest makes forces between the body and what holds it."""
    source = model.source or "the model"
    if model.speed:
        yield f"{source}: supports move against the stiffness at rest, without what the speed adds at them"
        return
    moving = np.any([motion.reshape(-1, 3).any(axis=0) for motion in motions.values()], axis=0)
    for axis, component in enumerate(COMPONENTS[:3]):
        if not moving[axis]:
            continue
        along = held & (np.tile(np.arange(3), len(held) // 3) == axis)
        force = np.asarray(model.restrict(stiffness @ along.astype(float)))
        others = force + model.K @ model.translation(component)
        if np.abs(others).max() > _BALANCED * max(np.abs(force).max(), abs(model.K).max()):
            yield (
                f"{source}: the elements of the mesh do not make all of the forces between the body and what holds it "
                f"along {component}, as where springs do: that part stays where it is when a support moves"
            )
