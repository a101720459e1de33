"""A model from matrices and what their rows are, checked: halves, sizes, constraints, empty rows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.model import ImportedModel
from slipstick.fem.support import empty_rows, floating_parts, misplaced_parts, name_rows
from slipstick.importers.deck import Deck
from slipstick.structure.checks import DAMPING_ELSEWHERE, asymmetry, number_faults, real
from slipstick.typing import BoolArray, IntArray, Matrix

if TYPE_CHECKING:
    from scipy.sparse import csr_array


FILE_ASYMMETRY = 1e-6
"""What files of few digits may differ between their halves, see ``asymmetry``; the mean is taken."""


def full_symmetric(matrix: Matrix, name: str) -> csr_array:
    """Both halves of a symmetric matrix of which one half, the other, or both are stored.

    Raises
    ------
    InputError
        If it is not real, not square, not finite, or its halves differ.

    Examples
    --------
    >>> full_symmetric(np.array([[2.0, -1.0], [0.0, 3.0]]), "K").toarray().tolist()
    [[2.0, -1.0], [-1.0, 3.0]]
    """
    from scipy.sparse import csr_array, diags_array, tril, triu

    faults = number_faults(name, matrix, DAMPING_ELSEWHERE)
    if faults:
        raise InputError(faults)
    matrix = csr_array(real(matrix), copy=True)  # what follows works in place
    if matrix.shape[0] != matrix.shape[1]:
        raise InputError(
            Fault(statement=f"{name} is {matrix.shape[0]} x {matrix.shape[1]}", expected="a square matrix")
        )
    matrix.sum_duplicates()
    if not np.all(np.isfinite(matrix.data)):
        raise InputError(Fault(statement=f"{name} holds values that are not finite", remedy="export it again"))
    matrix.eliminate_zeros()
    lower, upper = csr_array(tril(matrix, -1)), csr_array(triu(matrix, 1).T)
    stored_twice = (lower != 0).multiply(upper != 0).nnz if lower.nnz and upper.nnz else 0
    if not stored_twice:
        half = lower + upper
        return csr_array(half + half.T + diags_array(matrix.diagonal()))
    _refuse_asymmetric(matrix, name)
    return csr_array((matrix + matrix.T) * 0.5)


def _refuse_asymmetric(matrix: csr_array, name: str) -> None:
    pair = asymmetry(matrix, FILE_ASYMMETRY)
    if pair is None:
        return
    i, j = pair.row + 1, pair.column + 1
    raise InputError(
        Fault(
            statement=f"{name} is not symmetric: entry ({i}, {j}) is {pair.entry:.6g}, entry ({j}, {i}) is "
            f"{pair.mirrored:.6g}",
            remedy="export a symmetric model (no friction, follower or gyroscopic terms)",
        )
    )


def build_model(deck: Deck, *, source: str, cyclic: bool = True) -> ImportedModel:
    """Check what was read and take out held and empty degrees of freedom; equations of the deck are applied.

    ``cyclic``: with those that join the faces of a sector.

    Raises
    ------
    InputError
        For each fault: K or M missing, sizes that differ, no map of rows, asymmetry, negative diagonal, rows without
        stiffness.
    """
    faults = list(_size_faults(deck, source))
    if faults:
        raise InputError(faults)
    full = {name: full_symmetric(matrix, f"{source}: {name}") for name, matrix in deck.matrices.items()}
    assert deck.rows is not None
    mesh = deck.mesh
    model = ImportedModel(
        **full,
        dof_nodes=deck.rows[:, 0],
        dof_components=deck.rows[:, 1],
        node_ids=deck.labels if mesh is None else mesh.labels,
        coordinates=deck.coordinates if mesh is None else mesh.nodes,
        node_sets={} if mesh is None else {name: mesh.labels[part] for name, part in mesh.all_sets.items()},
        source=source,
        units=deck.units,
        notes=deck.notes,
        warnings=deck.warnings,
    )
    held = _held(deck.rows, deck.held_rows)
    constrained = np.unique(np.concatenate([deck.held_rows, _table(model, held)]), axis=0)
    if equations := deck.equations(mesh, cyclic=cyclic):
        model = model.constrain(equations, held=constrained.tolist())
        held = np.zeros(model.n_dofs, dtype=bool)
        constrained = model.constrained
    return _cut(model, held, constrained)


def _table(model: ImportedModel, chosen: BoolArray) -> IntArray:
    return np.stack([model.dof_nodes[chosen], model.dof_components[chosen]], axis=1)


def _cut(model: ImportedModel, held: BoolArray, constrained: IntArray) -> ImportedModel:
    """The model without its held and empty rows, once nothing is wrong with the others."""
    full = {"K": model.K, "M": model.M} | ({} if model.C is None else {"C": model.C})
    empty = np.logical_and.reduce([empty_rows(matrix) for matrix in full.values()]) & ~held
    faults = list(_diagonal_faults(full, held | empty, model.dof_nodes, model.dof_components, model.source))
    if faults:
        raise InputError(faults)
    notes = list(model.notes)
    if empty.any():
        some = _some(model.dof_nodes, model.dof_components, empty)
        notes.append(f"{empty.sum()} dofs without any stiffness or mass were left out: {some}")
    kept = np.flatnonzero(~(held | empty))
    return replace(
        model,
        **{name: matrix[kept][:, kept] for name, matrix in full.items()},
        dof_nodes=model.dof_nodes[kept],
        dof_components=model.dof_components[kept],
        constrained=constrained,
        dependence=None if model.dependence is None else model.dependence[:, kept],
        notes=tuple(notes),
    )


def _size_faults(deck: Deck, source: str) -> Iterator[Fault]:
    for name, word in (("K", "stiffness"), ("M", "mass")):
        if name not in deck.matrices:
            yield Fault(Place(source), f"no {word} matrix {name}", remedy="give the file that holds it")
    shapes = {name: matrix.shape for name, matrix in deck.matrices.items()}
    if len(set(shapes.values())) > 1:
        sizes = ", ".join(f"{name} is {rows} x {columns}" for name, (rows, columns) in shapes.items())
        yield Fault(
            Place(source), f"matrices of different size ({sizes})", remedy="export them from the same model and set"
        )
    elif deck.rows is None:
        remedy = "give it as a file (HBMAT's .mapping, CalculiX's .dof, or lines 'node direction')"
        yield Fault(Place(source), "no map from rows to nodes and directions", remedy=remedy)
    elif shapes and len(deck.rows) != next(iter(shapes.values()))[0]:
        size = next(iter(shapes.values()))[0]
        what = f"the matrices have {size} rows, the dof map has {len(deck.rows)} entries"
        yield Fault(Place(source), what, remedy="they must agree")


def _held(rows: IntArray, held: IntArray) -> NDArray[np.bool_]:
    factor = 8
    return np.isin(rows[:, 0] * factor + rows[:, 1], held[:, 0] * factor + held[:, 1])


def _some(nodes: IntArray, components: IntArray, chosen: NDArray[np.bool_]) -> str:
    return name_rows(nodes[chosen], components[chosen])


def _diagonal_faults(
    full: Mapping[str, csr_array], out: NDArray[np.bool_], nodes: IntArray, components: IntArray, source: str
) -> Iterator[Fault]:
    if np.all(out):
        yield Fault(Place(source), "no degree of freedom is left: all are constrained or empty")
        return
    for name in ("K", "M"):
        negative = (full[name].diagonal() < 0.0) & ~out
        if negative.any():
            what = f"has negative diagonal entries at {_some(nodes, components, negative)}"
            yield Fault(Place(source, name), what)
    loose = empty_rows(full["K"]) & ~out
    if loose.any():
        some = _some(nodes, components, loose)
        what = f"is singular, {loose.sum()} dofs have mass but no stiffness (a mechanism): {some}"
        yield Fault(Place(source, "K"), what, remedy="connect or fix them")


def support_notes(model: ImportedModel) -> tuple[str, ...]:
    """One sentence for each part which is not held; empty when every part is."""
    return tuple(
        f"the part with node {part[0]} ({len(part)} nodes) is not constrained ({count} rigid body motions); "
        "fix some nodes"
        for part, count in floating_parts(model)
    )


def place_warnings(model: ImportedModel) -> Iterator[str]:
    """One sentence for each part whose positions or directions do not fit its stiffness."""
    for part, free, rigid in misplaced_parts(model):
        yield (
            f"{model.source}: the part with node {part[0]} ({len(part)} nodes) moves freely in {free} ways, of which "
            f"{rigid} are rigid body motions of its points: their positions, the directions of their displacements or "
            "the order of the rows do not fit the matrices"
        )
