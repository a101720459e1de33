"""Warnings of a mesh, in the same sentences for every code: linear elements, units, its mass."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.fem.elements import ELEMENTS, LINEAR_TO_QUADRATIC
from slipstick.fem.geometry import determinant_and_inverse, tangents
from slipstick.fem.lumped import Lumped
from slipstick.fem.materials import Material, Materials, element_values
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import ImportedModel
from slipstick.fem.unit_systems import system_like
from slipstick.typing import Array, BoolArray, IntArray

Variants = Mapping[str, Mapping[str, int]]

_WARNED, _REFUSED = 1.01, 2.0
"""Ratio of the masses of a mesh and of the matrices beside it from which they do not fit."""

_ONE_POINT = (
    "are computed by their mean strain, with 0.005 G as hourglass stiffness (the default of Abaqus/Standard), that of "
    "other codes and options differs"
)

_NONE = np.empty((0, 2), dtype=np.int64)


def variant_warnings(mesh: Mesh, variants: Variants, source: str) -> Iterator[str]:
    """A sentence for each foreign element type that integrates otherwise than ours, with the size of the difference."""
    for kind, counts in variants.items():
        for name, count in counts.items():
            if kind in mesh.blocks and len(mesh.blocks[kind]):
                said = f"{count} elements of type {name}"
                if ELEMENTS[kind].mean_strain:
                    yield f"{source}: {said} {_ONE_POINT}: {_difference(mesh, kind)}"
                else:
                    yield f"{source}: {said} are computed as fully integrated {kind}: {_difference(mesh, kind)}"


def _difference(mesh: Mesh, kind: str) -> str:
    """Error of full integration, by the ratio of longest to shortest edge of the median element.

    Linear elements, against a beam in pure bending: the edges of a brick that spans the thickness h stay straight, so
    that E I is multiplied by ``1.15 + (l/h)^2 / (2 (1 + nu))`` for nu = 0.3 and as much width as height; with n across
    1/n^2 of what is above 1 is left. Elements of mean strain, in the same way: ``0.12 (1 + 2 (l/h)^2) / (2 (1 + nu))``
    by the hourglass stiffness alone, and 1/n^2 of its distance from 1 is left. Quadratic ones, against those with
    2 x 2 x 2 points: measured on cantilevers and plates, see docs/importing.md.
    """
    element = ELEMENTS[kind]
    corners = mesh.nodes[mesh.blocks[kind]]
    edges = np.stack([np.linalg.norm(corners[:, a] - corners[:, b], axis=1) for a, b in element.edges], axis=1)
    ratio = float(np.median(edges.max(axis=1) / edges.min(axis=1)))
    if element.mean_strain:
        factors = [1.0 + (0.12 * (1.0 + 2.0 * ratio**2) / 2.6 - 1.0) / n**2 for n in (1, 2, 4)]
        one, two, four = (f"{factor:.2g}" for factor in factors)
        return f"their stiffness in bending is {one} times a beam's with one across, {two} with two, {four} with four"
    if kind in LINEAR_TO_QUADRATIC:
        excess = 0.15 + ratio**2 / 2.6
        return f"up to {1.0 + excess:.2g} times too stiff in bending with one across, {1.0 + excess / 4.0:.2g} with two"
    return f"natural frequencies may be some {0.6 * ratio**2:.1g} % too high with one across"


def material_warnings(of_file: Mapping[str, Material], of_user: Material | None, source: str) -> Iterator[str]:
    """A sentence where the material for the whole mesh differs from those in the file."""
    others = {name: m for name, m in of_file.items() if m != of_user}
    if of_user is not None and others:
        yield (
            f"{source}: the material given ({_numbers(of_user)}) is used for the whole mesh, not the file's own: "
            + "; ".join(f"{name} ({_numbers(m)})" for name, m in others.items())
        )


def _numbers(material: Material) -> str:
    return f"E = {material.young:.6g}, nu = {material.poisson:.6g}, density = {material.density:.6g}"


def mass_warnings(
    model: ImportedModel, mesh: Mesh, materials: Materials, lumped: Sequence[Lumped] = (), held: IntArray = _NONE
) -> Iterator[str]:
    """Mass that moves with the free dofs, by the matrices and by the mesh: a sentence from 1 % difference.

    ``held`` (n, 2) are dofs that the mesh file holds. Where the rows lack nodes of the mesh, these are held, or reduced
    into the others: the mass may then lie between that without and that with them.

    Raises
    ------
    InputError
        If they differ by more than a factor of 2: other units, another material or another model.
    """
    try:
        density = element_values(mesh, materials, lambda m: m.density)
    except InputError as error:
        yield f"{model.source}: the mass of the mesh is not compared with that of the matrices: {error}"
        return
    theirs = _mass_of_matrices(model)
    rows = np.stack([model.dof_nodes, model.dof_components], axis=1)
    moving = _along(mesh, np.concatenate([rows, model.dependent]))
    free = ~_along(mesh, np.concatenate([model.constrained, held])) | moving
    least, most = (_mass_of_mesh(mesh, density, chosen, lumped) for chosen in (moving, free))
    if not (theirs > 0.0 and most > 0.0):
        return
    if not moving.any():
        yield f"{model.source}: no row of the matrices belongs to a node of the mesh: are they of the same model?"
        return
    ours = min((least, most), key=lambda mass: abs(np.log(max(mass, 1e-300) / theirs)))
    ratio = max(theirs / ours, ours / theirs)
    compared = f"{model.source}: the matrices have the mass {theirs:.6g}, the mesh beside them {ours:.6g}"
    if ratio > _WARNED and least < theirs < most:
        yield (
            f"{compared} or, without nodes that have no row, {least:.6g}: as if the others were reduced; are they "
            "of the same model, material and units?"
        )
    elif ratio > _REFUSED:
        raise InputError(
            Fault(
                statement=compared,
                remedy="give both of one model in the same units, or the material (--young ...)",
            )
        )
    elif ratio > _WARNED:
        yield f"{compared}, {100 * (ratio - 1):.3g} % apart: are they of the same model, material and units?"


def _along(mesh: Mesh, pairs: IntArray) -> BoolArray:
    """Mask (nodes, 3) of the directions x, y, z of mesh nodes that are among these dofs (n, 2)."""
    return np.stack([np.isin(mesh.labels, pairs[pairs[:, 1] == axis, 0]) for axis in range(3)], axis=1)


def _mass_of_matrices(model: ImportedModel) -> float:
    """Mean over the three directions of the mass that moves in a unit translation of the free dofs."""
    along = [(model.dof_components == axis).astype(float) for axis in range(3)]
    return float(sum(e @ (model.M @ e) for e in along)) / 3.0


def _mass_of_mesh(mesh: Mesh, density: Mapping[str, Array], free: BoolArray, lumped: Sequence[Lumped]) -> float:
    """The same by the mesh: integral of density times the square of the sum of the free nodes' shape functions."""
    moving = {(int(mesh.labels[i]), int(axis)) for i, axis in np.argwhere(free)} if lumped else set()
    points = (
        (pair, m)
        for part in lumped
        if part.matrix == "M"
        for pair, m in zip(part.pairs, np.diag(part.values), strict=True)
    )
    total = sum(float(mass) for pair, mass in points if pair in moving)
    for element, block in mesh.items():
        values, gradients = element.at_mass_rule
        determinant, _ = determinant_and_inverse(tangents(mesh.nodes[block], gradients))
        weights = determinant * element.mass_rule.weights * density[element.name][:, None]
        moved = np.matmul(values, free[block].astype(float))
        total += float((weights[:, :, None] * moved**2).sum())
    return total / 3.0


def unit_notes(mesh: Mesh, materials: Mapping[str, Material]) -> tuple[str, ...]:
    """Sentences on the units that the size of the numbers suggests; a suspicion, never an error."""
    size = float(np.ptp(mesh.nodes[mesh.used_nodes], axis=0).max())
    notes = [f"the largest dimension is {size:.4g} length units; stiffness and density must be in the same system"]
    for name, material in materials.items():
        system = system_like(material)
        if system:
            notes.append(f"{name}: E = {material.young:.4g}, density = {material.density:.4g} look like {system}")
    return tuple(notes)
