"""Nodes that move with a reference node as a rigid body, and reference nodes that move with the mean of others.

A reference node has rotations, three degrees of freedom of their own: directions 3..5 of the same label, or 0..2 of
another node where a file says so.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.errors import Fault, InputError, Where
from slipstick.fem.equations import NodalEquation, Pair
from slipstick.typing import Array

_ALL = (0, 1, 2)


@dataclass(frozen=True, kw_only=True)
class Reference:
    """A reference node: label, position (3,), and which degrees of freedom are its rotations."""

    node: int
    position: Array
    rotations: tuple[Pair, Pair, Pair]

    @classmethod
    def of(cls, node: int, position: Array) -> Reference:
        """One that has its own rotations."""
        x, y, z = ((node, 3 + axis) for axis in range(3))
        return cls(node=node, position=np.asarray(position, dtype=float), rotations=(x, y, z))


def rigid_rows(reference: Reference, position: Array) -> list[list[tuple[int, int, float]]]:
    """Terms (node, direction, factor) of x, y, z of a point that moves with a reference node: ``u + theta x r``."""
    x, y, z = np.asarray(position, dtype=float) - reference.position
    turns = ((None, z, -y), (-z, None, x), (y, -x, None))
    rows = []
    for axis in range(3):
        row = [(reference.node, axis, 1.0)]
        row += [
            (*pair, float(arm))
            for pair, arm in zip(reference.rotations, turns[axis], strict=True)
            if arm is not None and arm != 0.0
        ]
        rows.append(row)
    return rows


def rigid_equations(
    reference: Reference, nodes: Mapping[int, Array], where: str | Where, components: Sequence[int] = _ALL
) -> Iterator[NodalEquation]:
    """Nodes (label -> position) follow a reference node in these directions, 0..5; rotations are equal."""
    for node, position in nodes.items():
        rows = rigid_rows(reference, position)
        for component in components:
            if node == reference.node:
                continue
            row = rows[component] if component < 3 else [(*reference.rotations[component - 3], 1.0)]
            terms = ((node, component, 1.0), *((n, c, -value) for n, c, value in row))
            yield NodalEquation(terms=terms, where=where)


def mean_equations(
    reference: Reference,
    nodes: Mapping[int, tuple[Array, float, Sequence[int]]],
    where: str | Where,
    components: Sequence[int] = (0, 1, 2, 3, 4, 5),
) -> Iterator[NodalEquation]:
    """A reference node follows others in the mean, and stiffens none: label -> position, weight, directions 0..2.

    Its motion is that of the rigid body which fits theirs best in the weighted sum of squares.

    Raises
    ------
    InputError
        If the nodes do not tell a rotation that is asked for: they lie on a line, or have too few directions.
    """
    pairs: list[Pair] = []
    rows: list[list[float]] = []
    weights: list[float] = []
    size = max((float(np.linalg.norm(x - reference.position)) for x, _, _ in nodes.values()), default=0.0) or 1.0
    for node, (position, weight, directions) in nodes.items():
        x, y, z = (np.asarray(position, dtype=float) - reference.position) / size
        turns = ((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))
        for axis in directions:
            pairs.append((node, axis))
            rows.append([float(axis == i) for i in range(3)] + [float(value) for value in turns[axis]])
            weights.append(weight)
    A, W = np.array(rows).reshape(-1, 6), np.array(weights)
    wanted = sorted(set(components))
    fit = _fit(A, W, wanted, where)
    fit[3:] /= size
    for component in wanted:
        pair = (reference.node, component) if component < 3 else reference.rotations[component - 3]
        terms = [(*pair, 1.0)]
        terms += [(*p, -float(v)) for p, v in zip(pairs, fit[component], strict=True) if abs(v) > 1e-14 / size]
        yield NodalEquation(terms=tuple(terms), where=where)


def _fit(A: Array, W: Array, wanted: Sequence[int], where: str | Where) -> Array:
    """Rows (6, n) that take the best rigid motion out of the motions of n degrees of freedom."""
    normal = A.T @ (W[:, None] * A)
    values, vectors = np.linalg.eigh(normal)
    known = np.abs(values) > 1e-10 * np.abs(values).max(initial=0.0)
    lost = vectors[:, ~known]
    if np.abs(lost[wanted]).max(initial=0.0) > 1e-6:
        raise InputError(
            Fault(
                where,
                "the nodes do not determine the motion of the reference node (they lie on a line, or too few of "
                "their directions count)",
                remedy="leave out the rotations, or name more nodes",
            )
        )
    inverse = vectors[:, known] @ (vectors[:, known].T / values[known][:, None])
    fitted: Array = inverse @ (A.T * W)
    return fitted
