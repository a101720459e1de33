"""Degrees of freedom of nodes: their names ("n12y"), linear constraints between them, and their elimination.

Equations may be stated along directions of a node's own; here they are written in global ones. Equations of rigid parts
tie nodes to the motion of a reference node; those of the mean let a reference node follow others and stiffen none. A
reference node has rotations, three degrees of freedom of their own: directions 3..5 of the same label, or 0..2 of
another node where a file says so.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from slipstick.errors import Fault, InputError, Where
from slipstick.structure.constraints import Dependent, Elimination, Equation, eliminate
from slipstick.typing import Array, BoolArray, IntArray

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz", "s")
"""Directions by number: three displacements, three rotations, and a scalar (a point without direction)."""

Pair = tuple[int, int]
"""Node label and direction (index into ``COMPONENTS``)."""

_SINGLE = re.compile(r"n(\d{1,18})(x|y|z|rx|ry|rz|s)?$")
"""A node or a degree of freedom by name."""


@dataclass(frozen=True, kw_only=True)
class NodalEquation:
    """``sum coefficient u = 0`` over terms (node label, direction 0..6, coefficient), in global directions.

    ``where`` says in messages who stated it, ``dependent`` which dof becomes dependent.
    """

    terms: tuple[tuple[int, int, float], ...]
    where: str | Where = "an equation"
    dependent: Dependent = Dependent.FIRST

    @property
    def pairs(self) -> list[Pair]:
        """Node and direction of each term."""
        return [(node, component) for node, component, _ in self.terms]


def resolve(
    rows: Sequence[Pair],
    equations: Sequence[NodalEquation],
    held: Collection[Pair] = (),
    earlier: Mapping[Pair, Sequence[tuple[Pair, float]]] = MappingProxyType({}),
) -> tuple[list[Pair], Elimination]:
    """Eliminate equations between the rows of a model, and between degrees of freedom that only equations name.

    ``earlier`` has the combinations of rows that dependent ones are already. Returned with the elimination: all
    degrees of freedom in its order, the rows first.
    """
    known = dict.fromkeys([*rows, *earlier, *held])
    known |= dict.fromkeys(pair for equation in equations for pair in equation.pairs)
    every = list(known)
    place = {pair: i for i, pair in enumerate(every)}
    old = (
        NodalEquation(terms=((*pair, -1.0), *((*other, value) for other, value in terms)), where="an earlier equation")
        for pair, terms in earlier.items()
    )
    stated = [_placed(equation, place) for equation in (*old, *equations)]
    elimination = eliminate(len(every), stated, [place[pair] for pair in held], name=lambda i: dof_name(every[i]))
    return every, elimination


def idle_notes(elimination: Elimination) -> tuple[str, ...]:
    """One sentence for each source of equations that said nothing new or did not apply."""
    return tuple(
        f"{where}: {count} equation{'s' * (count > 1)} constrained already, or yielded to a support or another equation"
        for where, count in elimination.idle.items()
    )


def _placed(equation: NodalEquation, place: Mapping[Pair, int]) -> Equation:
    dofs = tuple(place[pair] for pair in equation.pairs)
    values = tuple(value for _, _, value in equation.terms)
    return Equation(dofs=dofs, coefficients=values, where=equation.where, dependent=equation.dependent)


def dof_name(pair: Pair) -> str:
    """The name of a degree of freedom.

    >>> dof_name((12, 4))
    'n12ry'
    """
    return f"n{pair[0]}{COMPONENTS[pair[1]]}"


def directions_in(components: str) -> set[str]:
    """Directions in a text such as "xyz", "x ry" or "x,y".

    >>> sorted(directions_in("xz")), sorted(directions_in("x, ry"))
    (['x', 'z'], ['ry', 'x'])
    """
    words = components.replace(",", " ").split()
    return {part for word in words for part in ([word] if word in COMPONENTS else list(word))}


def rows_named(name: str, labels: IntArray, components: IntArray) -> BoolArray:
    """Mask of the degrees of freedom of "n12", or of "n12y" alone."""
    node, component = _SINGLE.match(name).groups()  # type: ignore[union-attr]
    here = labels == int(node)
    return here & (components == COMPONENTS.index(component)) if component else here


def names_dofs(name: str) -> bool:
    """Whether a name is that of a node or of one of its degrees of freedom.

    >>> [names_dofs(name) for name in ("n12", "n12ry", "NOZZLE", "n12w")]
    [True, True, False, False]
    """
    return _SINGLE.match(name) is not None


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
    """Supports along own directions of nodes: held global degrees of freedom, and equations for the rest."""
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
    undetermined = vectors[:, ~known]
    if np.abs(undetermined[wanted]).max(initial=0.0) > 1e-6:
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
