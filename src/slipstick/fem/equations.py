"""Degrees of freedom of nodes: their names ("n12y"), linear constraints between them, and their elimination."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from slipstick.errors import Where
from slipstick.structure.constraints import Dependent, Elimination, Equation, eliminate
from slipstick.typing import BoolArray, IntArray

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
    """Where "n12" or "n12y" stands among degrees of freedom."""
    node, component = _SINGLE.match(name).groups()  # type: ignore[union-attr]
    here = labels == int(node)
    return here & (components == COMPONENTS.index(component)) if component else here


def names_dofs(name: str) -> bool:
    """Whether a name is that of a node or of one of its degrees of freedom.

    >>> [names_dofs(name) for name in ("n12", "n12ry", "NOZZLE", "n12w")]
    [True, True, False, False]
    """
    return _SINGLE.match(name) is not None
