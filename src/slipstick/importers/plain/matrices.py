"""Matrices in MatrixMarket or npz files, with a map file; or one npz bundle that holds K, M and the map."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import Fault, InputError, Place
from slipstick.importers.deck import Deck
from slipstick.importers.dof_map import direction, read_dof_map
from slipstick.importers.findings import refused
from slipstick.importers.plain.matrix_file import read_matrix
from slipstick.importers.text_numbers import read_bytes
from slipstick.structure.npz import array_shapes, read_any

if TYPE_CHECKING:
    from slipstick.importers.roles import ImportOptions, Roles


def read_matrices(roles: Roles, options: ImportOptions) -> Deck:
    """The reader of both formats: .mtx may be of Abaqus."""
    del options
    first = roles.first
    if is_bundle(first):
        return read_bundle(first)
    head = read_bytes(first)[:60].splitlines()[0] if first.suffix.lower() == ".mtx" else b""
    if head.startswith(b"%%") and head[:14].lower() != b"%%matrixmarket":
        found = f"the first line '{head.decode('ascii', 'replace')}'"
        raise refused(first.name, found=found, expected="'%%MatrixMarket matrix ...'")
    if first.suffix.lower() == ".mtx" and not head.startswith(b"%%"):
        from slipstick.importers.abaqus.calculix import read_abaqus_matrices

        known = Deck() if roles.dof_map is None else read_dof_map(roles.dof_map)
        deck = read_abaqus_matrices(roles.matrices, known.rows)
        deck.nodes = known.nodes
        return deck
    return read_plain(roles.matrices, roles.dof_map)


def read_plain(files: Mapping[str, Path], dof_map: Path | None) -> Deck:
    """Matrices by name from .mtx (MatrixMarket) or .npz files; a map is needed, here or later."""
    matrices = {name: read_matrix(path) for name, path in files.items()}
    deck = Deck() if dof_map is None else read_dof_map(dof_map)
    deck.matrices = matrices
    return deck


def is_bundle(path: Path) -> bool:
    """Whether an npz file holds K and M together."""
    return path.suffix.lower() == ".npz" and {"K", "M"} <= set(array_shapes(path))


def read_bundle(path: Path) -> Deck:
    """npz with dense ``K``, ``M``, ``dof_nodes``, ``dof_components``; optional ``C``, ``nodes``, ``coordinates``.

    Raises
    ------
    InputError
        If a shape is wrong, or the map is missing.
    """
    shapes = array_shapes(path)
    faults = [
        Fault(Place(path.name), f"'{n}' has shape {shapes[n]}", expected="a square matrix")
        for n in "KMC"
        if n in shapes and len(shapes[n]) != 2
    ]
    missing = [name for name in ("dof_nodes", "dof_components") if name not in shapes]
    if missing:
        what = f"has no {' and no '.join(missing)}, the map from rows to nodes and directions"
        faults.append(Fault(Place(path.name), what))
    if faults:
        raise InputError(faults)
    arrays = read_any(path)
    try:
        components = np.array([direction(str(value)) for value in arrays["dof_components"].tolist()], dtype=np.int64)
        nodes = arrays["dof_nodes"].astype(np.int64)
    except (ValueError, TypeError, OverflowError) as error:
        raise refused(path.name, str(error)) from None
    if nodes.shape != components.shape or nodes.ndim != 1:
        what = f"has {nodes.size} dof_nodes and {components.size} dof_components"
        raise refused(path.name, what, expected="one of each for a row")
    deck = Deck(source=path.name, rows=np.stack([nodes, components], axis=1))
    if {"nodes", "coordinates"} <= set(shapes):
        places = arrays["coordinates"].astype(float)
        if places.shape != (arrays["nodes"].size, 3):
            what = f"coordinates have shape {places.shape}"
            raise refused(path.name, what, expected=f"({arrays['nodes'].size}, 3)")
        deck.nodes = dict(zip(arrays["nodes"].astype(np.int64).tolist(), places.tolist(), strict=True))
    deck.matrices = {name: arrays[name] for name in "KMC" if name in arrays}
    return deck
