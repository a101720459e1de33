"""A model from matrices and the dofs of their rows, checked: halves, sizes, constraints, empty rows, supports.

Rows along directions of nodes are turned to the global ones. A model that is not held is found by its rows without
stiffness and by parts that can move as rigid bodies.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.equations import COMPONENTS
from slipstick.fem.model import ImportedModel
from slipstick.importers.deck import Deck
from slipstick.structure.checks import DAMPING_ELSEWHERE, asymmetry, number_faults, real
from slipstick.typing import Array, BoolArray, IntArray, Matrix, Sparse

FILE_ASYMMETRY = 1e-6
"""Asymmetry that files of few digits may have, see ``asymmetry``; the mean of both halves is taken."""


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
    from scipy.sparse import tril, triu

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
    """Check matrices and rows, apply the equations of the deck, and take out held and empty degrees of freedom.

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


def to_global(deck: Deck, directions: Mapping[int, Array], source: str) -> Deck:
    """The deck with the rows of turned nodes along the global directions.

    ``directions`` holds the directions of a node as columns (3, 3). Displacements, or rotations, of which only some
    are free cannot be turned: they keep their own directions, and a warning says which these are.
    """
    if deck.rows is None or not directions:
        return deck
    keys = map(tuple, deck.rows.tolist())
    place = {key: row for row, key in enumerate(keys) if key not in deck.held}
    triples, stray = [], []
    for node, axes in directions.items():
        for start in (0, 3):
            rows = [place[node, start + i] for i in range(3) if (node, start + i) in place]
            if len(rows) == 3:
                triples.append((np.array(rows), axes))
            elif rows:
                free = [i for i in range(3) if (node, start + i) in place]
                stray += [f"n{node}{COMPONENTS[start + i]} is along {_vector(axes[:, i])}" for i in free]
    turn = _rotation(len(deck.rows), triples)
    for name, matrix in deck.matrices.items():
        deck.matrices[name] = turn @ full_symmetric(matrix, f"{source}: {name}") @ turn.T
    deck.own_warnings += _stray(stray, source)
    return deck


def _stray(stray: list[str], source: str) -> tuple[str, ...]:
    if not stray:
        return ()
    more = f" and {len(stray) - 8} more" if len(stray) > 8 else ""
    return (f"{source}: nodes with own directions of which only some are free keep them: {', '.join(stray[:8])}{more}",)


def _vector(axis: Array) -> str:
    return f"({', '.join(f'{x + 0.0:.4g}' for x in np.round(axis, 12))})"


def _rotation(size: int, triples: list[tuple[np.ndarray, Array]]) -> csr_array:
    """``u_global = T u_own``, sparse (size, size)."""
    turned = np.zeros(size, dtype=bool)
    for rows, _ in triples:
        turned[rows] = True
    same = np.flatnonzero(~turned)
    i = [same, *(np.repeat(rows, 3) for rows, _ in triples)]
    j = [same, *(np.tile(rows, 3) for rows, _ in triples)]
    values = [np.ones(len(same)), *(axes.ravel() for _, axes in triples)]
    return csr_array((np.concatenate(values), (np.concatenate(i), np.concatenate(j))), shape=(size, size))


RIGID = 1e-10
"""A motion whose stiffness is below this fraction of the largest diagonal entry of K is taken for a rigid body's."""


def name_rows(nodes: IntArray, components: IntArray, limit: int = 8) -> str:
    """Names of degrees of freedom in one short text.

    >>> name_rows(np.array([4, 4, 9]), np.array([0, 2, 5]))
    'n4x, n4z, n9rz'
    """
    pairs = list(zip(nodes.tolist(), components.tolist(), strict=True))
    names = ", ".join(f"n{node}{COMPONENTS[component]}" for node, component in pairs[:limit])
    return names + (f" and {len(pairs) - limit} more" if len(pairs) > limit else "")


def empty_rows(matrix: csr_array) -> NDArray[np.bool_]:
    """Rows which hold nothing but zeros, (n,)."""
    return np.bincount(matrix.nonzero()[0], minlength=matrix.shape[0]) == 0


def floating_parts(model: ImportedModel) -> Iterator[tuple[IntArray, int]]:
    """Unconnected parts that are not held: node labels and the number of rigid body motions of each.

    A part is a set of rows connected by K. Rotations need coordinates: without them only translations are tried.
    """
    from scipy.sparse.csgraph import connected_components

    count, part = connected_components(model.K, directed=False)
    order = np.argsort(part, kind="stable")
    for rows in np.split(order, np.searchsorted(part[order], np.arange(1, count))):
        free = _rigid_motions(model, rows)
        if free:
            yield np.unique(model.dof_nodes[rows]), free


def _rigid_motions(model: ImportedModel, rows: IntArray) -> int:
    return _without_stiffness(model.K[rows][:, rows], _motions(model, rows))


def _without_stiffness(block: Sparse, motions: Array, small: float = RIGID) -> int:
    """The number of independent motions among these columns that meet no stiffness."""
    basis, values, _ = np.linalg.svd(motions, full_matrices=False)
    basis = basis[:, values > 1e-8 * max(values.max(initial=0.0), 1e-300)]
    if not basis.shape[1]:
        return 0
    largest = np.abs(block.diagonal()).max(initial=0.0)
    return int(np.sum(np.abs(np.linalg.eigvalsh(basis.T @ (block @ basis))) <= small * largest))


def _motions(model: ImportedModel, rows: IntArray) -> Array:
    """Rigid translations and (with coordinates) rotations as columns on these rows."""
    nodes, components = model.dof_nodes[rows], model.dof_components[rows]
    columns = [(components == axis).astype(float) for axis in range(3)]
    if np.isin(nodes, model.node_ids).all():
        arm = model.positions(nodes)
        arm = (arm - arm.mean(axis=0)) / max(np.ptp(arm, axis=0).max(), 1e-300)
        size = max(np.ptp(model.positions(nodes), axis=0).max(), 1e-300)
        for axis, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
            turn = np.where(components == b, arm[:, a], 0.0) - np.where(components == a, arm[:, b], 0.0)
            columns.append(turn + (components == 3 + axis) / size)
    return np.stack(columns, axis=1)


_DENSE = 2000
"""Rows up to which all motions without stiffness are counted."""
_FREE = 1e-9
"""A motion is free where its stiffness, by rows scaled to 1, is below this."""


def misplaced_parts(model: ImportedModel) -> Iterator[tuple[IntArray, int, int]]:
    """Unconnected parts that can move in more ways than as rigid bodies: node labels, how many, how many of them rigid.

    Then positions, directions of displacements or the order of rows do not fit the matrices. Only parts whose points
    have positions are tried, up to 2000 rows.
    """
    from scipy.sparse.csgraph import connected_components

    count, part = connected_components(model.K, directed=False)
    placed = np.isin(model.dof_nodes, model.node_ids)
    for rows in (np.flatnonzero(part == i) for i in range(count if model.n_dofs <= _DENSE else 0)):
        if not placed[rows].all():
            continue
        size = np.sqrt(model.K.diagonal()[rows].clip(min=1e-300))
        block = (diags_array(1.0 / size) @ model.K[rows][:, rows] @ diags_array(1.0 / size)).toarray()
        free = int(np.sum(np.abs(np.linalg.eigvalsh(block)) <= _FREE))
        rigid = _without_stiffness(block, _motions(model, rows) * size[:, None], _FREE)
        if free > rigid:
            yield np.unique(model.dof_nodes[rows]), free, rigid
