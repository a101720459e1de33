"""Directions of nodes that are turned out of the global ones: what is said along them, in global directions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from slipstick.errors import Fault, InputError, Where
from slipstick.fem.equations import NodalEquation, Pair
from slipstick.structure.constraints import Dependent
from slipstick.typing import Array

NodeAxes = Mapping[int, Array]
"""Own axes of nodes by label, (3, 3): the rows are unit vectors along its first, second, third direction."""


def rectangular(a: Array, b: Array) -> Array:
    """Axes whose first goes along ``a``, whose second lies in the plane of ``a`` and ``b``, (3,) each.

    >>> rectangular(np.array([0.0, 2.0, 0.0]), np.array([-1.0, 3.0, 0.0])).tolist()
    [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    third = np.cross(a, b)
    if not np.linalg.norm(third) > 1e-10 * np.linalg.norm(a) * np.linalg.norm(b):
        raise InputError(
            Fault(statement="a coordinate system is given by points on one line", remedy="give a third one off it")
        )
    first, third = a / np.linalg.norm(a), third / np.linalg.norm(third)
    return np.stack([first, np.cross(third, first), third]) + 0.0


def cylindrical(start: Array, end: Array, position: Array) -> Array:
    """Radial, circumferential and axial direction at a position; the global ones' like on the axis itself."""
    axis = (end - start) / np.linalg.norm(end - start)
    arm = position - start
    radial = arm - (arm @ axis) * axis
    if not np.linalg.norm(radial) > 1e-10 * max(np.linalg.norm(arm), np.linalg.norm(end - start)):
        radial = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    radial = radial / np.linalg.norm(radial)
    return np.stack([radial, np.cross(axis, radial), axis])


def in_global(equations: Iterable[NodalEquation], frames: NodeAxes) -> Iterator[NodalEquation]:
    """Equations between own directions of nodes, written in global ones."""
    for equation in equations:
        turned = any(node in frames for node, _, _ in equation.terms)
        if not turned:
            yield equation
            continue
        terms = tuple(turned for term in equation.terms for turned in _turned(term, frames))
        first = equation.terms[0][0] in frames and equation.dependent is Dependent.FIRST
        yield replace(equation, terms=terms, dependent=Dependent.ANY if first else equation.dependent)


def _turned(term: tuple[int, int, float], frames: NodeAxes) -> Iterator[tuple[int, int, float]]:
    node, component, value = term
    if node not in frames or component > 5:
        yield term
        return
    block, axis = divmod(component, 3)
    for other, cosine in enumerate(frames[node][axis].tolist()):
        if abs(cosine) > 1e-15:
            yield (node, 3 * block + other, value * cosine)


def supports(held: Iterable[Pair], frames: NodeAxes, where: str | Where) -> tuple[set[Pair], list[NodalEquation]]:
    """What is held along own directions: global degrees of freedom, and equations for the rest."""
    plain: set[Pair] = set()
    along: dict[tuple[int, int], set[int]] = {}
    for node, component in held:
        if node in frames and component < 6:
            along.setdefault((node, component // 3), set()).add(component % 3)
        else:
            plain.add((node, component))
    equations: list[NodalEquation] = []
    for (node, block), axes in sorted(along.items()):
        if len(axes) == 3:
            plain |= {(node, 3 * block + axis) for axis in range(3)}
        else:
            equations += [
                NodalEquation(terms=((node, 3 * block + axis, 1.0),), where=where, dependent=Dependent.ANY)
                for axis in sorted(axes)
            ]
    return plain, list(in_global(equations, frames))
