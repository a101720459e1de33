"""Rows of matrices along directions of nodes, turned to the global ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from slipstick.fem.equations import COMPONENTS
from slipstick.importers.deck import Deck
from slipstick.importers.matrix_model import full_symmetric
from slipstick.typing import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array


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
    deck.doubts += _stray(stray, source)
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
    from scipy.sparse import csr_array

    turned = np.zeros(size, dtype=bool)
    for rows, _ in triples:
        turned[rows] = True
    same = np.flatnonzero(~turned)
    i = [same, *(np.repeat(rows, 3) for rows, _ in triples)]
    j = [same, *(np.tile(rows, 3) for rows, _ in triples)]
    values = [np.ones(len(same)), *(axes.ravel() for _, axes in triples)]
    return csr_array((np.concatenate(values), (np.concatenate(i), np.concatenate(j))), shape=(size, size))
