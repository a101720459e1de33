"""Quadratic elements without some of their middle nodes: such an edge stays straight and moves so.

A middle node that is not there is made, halfway between the ends of its edge, and moves as their mean: the shape
functions that are left are those Ansys and Nastran use, linear along that edge.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from slipstick.fem.elements import ELEMENTS
from slipstick.fem.equations import NodalEquation
from slipstick.importers.findings import DAMAGED, refused
from slipstick.typing import Array, IntArray

Edges = dict[tuple[int, int], int]
"""Label of a made node by the labels of the ends of its edge."""


def with_middles(name: str, nodes: Sequence[int], number: int, made: Edges, next_label: int, source: str) -> list[int]:
    """Labels of an element with middle nodes put where there is 0; those made so far are in ``made``.

    Raises
    ------
    InputError
        If a corner is missing.
    """
    element = ELEMENTS[name]
    if min(nodes[: element.n_corners]) <= 0 or min(nodes) < 0:
        raise refused(source, f"element {number} lacks a corner node", remedy=DAMAGED)
    labels = list(nodes)
    for place in (i for i, node in enumerate(nodes) if node == 0):
        a, b = (nodes[i] for i in element.edges[place - element.n_corners])
        labels[place] = made.setdefault((min(a, b), max(a, b)), next_label + len(made))
    return labels


def placed(made: Edges, labels: IntArray, nodes: Array, source: str) -> tuple[IntArray, Array]:
    """Labels and positions of all nodes, with those made."""
    if not made:
        return labels, nodes
    order = np.argsort(labels)
    ends = np.array(list(made), dtype=np.int64)
    at = order[np.searchsorted(labels, ends, sorter=order).clip(max=len(order) - 1)]
    if np.any(labels[at] != ends):
        raise refused(source, f"an element uses node {ends[labels[at] != ends][0]}, which is not in the file")
    new = np.fromiter(made.values(), dtype=np.int64, count=len(made))
    return np.concatenate([labels, new]), np.vstack([nodes, nodes[at].mean(axis=1)])


def middle_equations(made: Edges, source: str) -> Iterator[NodalEquation]:
    """Each made node moves as the mean of the ends of its edge."""
    for (a, b), middle in made.items():
        for axis in range(3):
            terms = ((middle, axis, 1.0), (a, axis, -0.5), (b, axis, -0.5))
            yield NodalEquation(terms=terms, where=f"{source}: an edge without a middle node")


def whole_row(nodes: Sequence[int], quadratic: bool) -> Sequence[int]:
    """A row of a 20-node brick whose last nodes are left out."""
    return [*nodes, *[0] * (20 - len(nodes))] if quadratic and 8 < len(nodes) < 20 and len(nodes) != 10 else nodes
