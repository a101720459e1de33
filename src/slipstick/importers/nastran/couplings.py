"""MPC, RBE2, RBE3 and RBAR cards as equations between the grid points of a file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from slipstick.errors import Place
from slipstick.fem.equations import NodalEquation, Reference, mean_equations, rigid_rows
from slipstick.importers.findings import Coupling, refused
from slipstick.importers.text_numbers import fortran_real, reading, whole_number
from slipstick.structure.constraints import Dependent
from slipstick.typing import Array

COUPLED = "MPC MPCADD RBE2 RBE3 RBAR"
"""Cards read here."""


@dataclass(frozen=True, kw_only=True)
class CoupledCard:
    """A card that ties degrees of freedom: its name, line and fields."""

    name: str
    line: int
    fields: tuple[str, ...]

    def coupling(self, source: str) -> Coupling:
        """The coupling that matrices made with it must hold."""
        what = "ties degrees of freedom to each other" if self.name == "MPC" else "couples points rigidly"
        return Coupling(where=Place(source, f"line {self.line}", self.name), what=what)


@dataclass(frozen=True, kw_only=True)
class Points:
    """Positions of grid points in the basic system, and directions (columns) of those that have their own, by label."""

    places: Mapping[int, Array]
    directions: Mapping[int, Array]
    source: str

    def reference(self, node: int, where: Place) -> Reference:
        """A grid point that others follow."""
        return Reference.of(node, self.place(node, where))

    def place(self, node: int, where: Place) -> Array:
        """Position (3,) of a point; InputError where it is not in the file."""
        if node not in self.places:
            raise refused(where, f"grid point {node} is not in the file")
        return np.asarray(self.places[node])

    def axis(self, node: int, component: int) -> list[tuple[int, int, float]]:
        """A displacement or rotation along a direction of its point, in basic ones: terms (node, direction, factor).

        The term of the same number comes first, where it has a share.
        """
        if node not in self.directions or component > 5:
            return [(node, component, 1.0)]
        block, axis = divmod(component, 3)
        cosines = np.asarray(self.directions[node])[:, axis].tolist()
        order = (axis, *(i for i in range(3) if i != axis))
        return [(node, 3 * block + i, cosines[i]) for i in order if abs(cosines[i]) > 1e-15]


def selected(text: str, name: str) -> int | None:
    """The number of the set that the case control asks for, as in "MPC = 3"; None where it does not say one."""
    head = re.split(r"(?im)^\s*BEGIN\b", text, maxsplit=1)
    numbers = re.findall(rf"(?im)^\s*{name}\s*=\s*(\d+)", head[0]) if len(head) > 1 else []
    return int(numbers[0]) if len(set(numbers)) == 1 else None


def coupled_equations(cards: Sequence[CoupledCard], points: Points, mpc: int | None) -> Iterator[NodalEquation]:
    """Equations of all cards; of MPC those of the set in force.

    Raises
    ------
    InputError
        For cards that cannot be read, points that are not there, several MPC sets of which none is chosen.
    """
    chosen = _mpc_sets(cards, mpc, points.source)
    for card in cards:
        where = Place(points.source, f"line {card.line}", card.name)
        with reading(where):
            if card.name == "MPC" and whole_number(card.fields[0]) in chosen:
                yield _multipoint(card.fields, points, where)
            elif card.name == "RBE2":
                yield from _rigid(card.fields, points, where)
            elif card.name == "RBE3":
                yield from _mean(card.fields, points, where)
            elif card.name == "RBAR":
                yield from _bar(card.fields, points, where)


def _mpc_sets(cards: Sequence[CoupledCard], chosen: int | None, source: str) -> set[int]:
    numbers: set[int] = set()
    sums: dict[int, set[int]] = {}
    for card in cards:
        with reading(Place(source, f"line {card.line}", card.name)):
            if card.name == "MPC":
                numbers.add(whole_number(card.fields[0]))
            elif card.name == "MPCADD":
                sums[whole_number(card.fields[0])] = {whole_number(word) for word in card.fields[1:] if word}
    if chosen is None:
        others = numbers - set().union(*sums.values()) if sums else numbers
        heads = {*sums, *others}
        if len(heads) > 1:
            remedy = "say which is in force (MPC = n before BEGIN BULK)"
            raise refused(source, f"holds the MPC sets {sorted(heads)}", remedy=remedy)
        chosen = next(iter(heads), 0)
    return sums.get(chosen, set()) | {chosen}


def _multipoint(fields: Sequence[str], points: Points, where: Place) -> NodalEquation:
    """A1 u1 + A2 u2 + ... = 0; two terms on a line of the card, the first is dependent."""
    terms: list[tuple[int, int, float]] = []
    for at in range(0, len(fields), 8):
        for start in (at + 1, at + 4):
            node, component, factor = [*fields[start : start + 3], "", "", ""][:3]
            if node:
                value = fortran_real(factor)
                axis_terms = points.axis(whole_number(node), _component(component))
                points.place(whole_number(node), where) if component not in ("", "0") else None
                terms += [(n, c, value * cosine) for n, c, cosine in axis_terms]
    return _dependent_first(terms, where, points)


def _dependent_first(terms: list[tuple[int, int, float]], where: Place, points: Points) -> NodalEquation:
    """The first is dependent; where a point has its own directions, which are several terms, whichever is best."""
    turned = terms[0][0] in points.directions
    return NodalEquation(terms=tuple(terms), where=where, dependent=Dependent.ANY if turned else Dependent.FIRST)


def _component(text: str) -> int:
    number = whole_number(text or "0")
    if not 0 <= number <= 6:
        raise ValueError(f"direction {text}")
    return (number - 1) % 7


def _digits(text: str) -> list[int]:
    if not text.isdigit() or not set(text) <= set("123456"):
        raise ValueError(f"directions '{text}'")
    return sorted({int(digit) - 1 for digit in text})


def _rigid(fields: Sequence[str], points: Points, where: Place) -> Iterator[NodalEquation]:
    """RBE2: number, independent point, directions, dependent points; a real at the end is thermal expansion."""
    components = _digits(fields[2])
    words = [word for word in fields[3:] if word]
    labels: list[int] = []
    for i, word in enumerate(words):
        if "." in word:
            break
        if word.upper() == "THRU":
            labels += range(labels[-1] + 1, whole_number(words[i + 1]))
        else:
            labels.append(whole_number(word))
    reference = points.reference(whole_number(fields[1]), where)
    for node in labels:
        yield from followers(reference, node, components, points, where)


def followers(
    reference: Reference, node: int, components: Sequence[int], points: Points, where: Place
) -> Iterator[NodalEquation]:
    """A point follows another as a rigid body, along the directions of its displacements."""
    rows = rigid_rows(reference, points.place(node, where))
    for component in components:
        axis_terms = points.axis(node, component)
        terms = list(axis_terms)
        for _, direction, cosine in axis_terms:
            row = rows[direction] if direction < 3 else [(*reference.rotations[direction - 3], 1.0)]
            terms += [(n, c, -cosine * value) for n, c, value in row]
        yield _dependent_first(terms, where, points)


def _bar(fields: Sequence[str], points: Points, where: Place) -> Iterator[NodalEquation]:
    """RBAR with all six independent directions at one end: the other end follows it."""
    a, b, free_a, free_b, tied_a, tied_b = [*fields[1:7], *[""] * 6][:6]
    if free_a == "123456" and not free_b:
        first, second, components = a, b, tied_b
    elif free_b == "123456" and not free_a:
        first, second, components = b, a, tied_a
    else:
        raise refused(where, "has independent directions at both ends, which is not read", remedy="write it as RBE2")
    reference = points.reference(whole_number(first), where)
    yield from followers(reference, whole_number(second), _digits(components or "123456"), points, where)


def _mean(fields: Sequence[str], points: Points, where: Place) -> Iterator[NodalEquation]:
    """RBE3: number, blank, reference point, its directions, then weight, directions and points in groups."""
    words = [word for word in fields[4:] if word]
    nodes: dict[int, tuple[Array, float, Sequence[int]]] = {}
    i = 0
    while i < len(words) and words[i].upper() not in ("UM", "ALPHA"):
        weight, components = fortran_real(words[i]), _digits(words[i + 1])
        if max(components) > 2:
            raise refused(where, "takes rotations into the mean, which is not read", remedy="leave out 4, 5 and 6")
        i += 2
        while i < len(words) and words[i].isdigit():
            node = whole_number(words[i])
            nodes[node] = (points.place(node, where), weight, components)
            i += 1
    if "UM" in (word.upper() for word in words):
        raise refused(where, "has dependent directions of its own (UM), which are not read", remedy="leave them out")
    turned = [node for node in (whole_number(fields[2]), *nodes) if node in points.directions]
    if turned and any(len(components) < 3 for _, _, components in nodes.values()):
        raise refused(
            where, f"some directions of point {turned[0]} count, and they are its own", remedy="name all three"
        )
    reference = points.reference(whole_number(fields[2]), where)
    if reference.node in points.directions:
        raise refused(where, f"its reference point {reference.node} has own directions, which is not read")
    yield from mean_equations(reference, nodes, where, _digits(fields[3]))
