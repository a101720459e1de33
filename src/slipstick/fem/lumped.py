"""Masses and springs between single degrees of freedom, added to the matrices of a model."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array

from slipstick.errors import Fault, InputError, Where
from slipstick.fem.equations import Pair
from slipstick.typing import Array


@dataclass(frozen=True, kw_only=True)
class Lumped:
    """A small symmetric matrix (n, n), part of the stiffness "K" or mass "M", between degrees of freedom (n,)."""

    matrix: str
    pairs: tuple[Pair, ...]
    values: Array


def point_mass(node: int, mass: float, inertia: Array | None = None, offset: Array | None = None) -> Iterator[Lumped]:
    """A mass at a node, with its inertia (3, 3) about its centre, which lies at an offset (3,) from the node."""
    arm = np.zeros(3) if offset is None else np.asarray(offset, dtype=float)
    if inertia is None and not arm.any():
        yield Lumped(matrix="M", pairs=tuple((node, axis) for axis in range(3)), values=mass * np.eye(3))
        return
    x, y, z = arm
    turn = np.hstack([np.eye(3), np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])])
    values = mass * turn.T @ turn
    values[3:, 3:] += 0.0 if inertia is None else inertia
    pairs = [i for i in range(6) if np.abs(values[i]).max() > 0.0]
    yield Lumped(matrix="M", pairs=tuple((node, i) for i in pairs), values=values[np.ix_(pairs, pairs)])


def spring(stiffness: float, first: Pair, second: Pair | None = None) -> Lumped:
    """A spring between two degrees of freedom, or from one to ground."""
    pairs = (first,) if second is None else (first, second)
    signs = np.array([1.0, -1.0][: len(pairs)])
    return Lumped(matrix="K", pairs=pairs, values=stiffness * np.outer(signs, signs))


def axial_spring(stiffness: float, ends: tuple[int, int], along: Array, where: str | Where) -> Lumped:
    """A spring along the line between two nodes; ``along`` (3,) goes from one to the other."""
    length = float(np.linalg.norm(along))
    if not length > 0.0:
        raise InputError(Fault(where, "a spring along the line of two nodes needs a distance between them"))
    cosines = np.concatenate([along, -np.asarray(along)]) / length
    pairs = tuple((node, axis) for node in ends for axis in range(3))
    return Lumped(matrix="K", pairs=pairs, values=stiffness * np.outer(cosines, cosines))


def with_lumped(
    matrices: Mapping[str, csr_array], rows: Sequence[Pair], lumped: Iterable[Lumped]
) -> tuple[dict[str, csr_array], list[Pair]]:
    """Matrices with these added, and their rows: those that only a mass or a spring has come last."""
    parts = list(lumped)
    every = list(dict.fromkeys([*rows, *(pair for part in parts for pair in part.pairs)]))
    place = {pair: i for i, pair in enumerate(every)}
    size = len(every)
    found = {}
    for name, matrix in matrices.items():
        of_matrix = [part for part in parts if part.matrix == name]
        wide = csr_array(matrix)
        wide.resize((size, size))
        at = [np.array([place[pair] for pair in part.pairs]) for part in of_matrix]
        i = np.concatenate([np.empty(0, dtype=int), *(np.repeat(p, len(p)) for p in at)])
        j = np.concatenate([np.empty(0, dtype=int), *(np.tile(p, len(p)) for p in at)])
        values = np.concatenate([np.empty(0), *(np.asarray(part.values, dtype=float).ravel() for part in of_matrix)])
        found[name] = csr_array(wide + csr_array(coo_array((values, (i, j)), shape=(size, size))))
    return found, every
