"""Point masses and springs of an Ansys archive (.cdb): MASS21 and COMBIN14, with their real constants."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from slipstick.errors import Place
from slipstick.fem.equations import Pair
from slipstick.fem.lumped import Lumped, axial_spring, point_mass, spring
from slipstick.importers.ansys.commands import COMMANDS, commands
from slipstick.importers.deck import Deck
from slipstick.importers.findings import Verdict, refused
from slipstick.importers.text_numbers import fortran_real, whole_number

LUMP_TYPES = {21: "MASS21", 14: "COMBIN14"}
_TYPE, _REAL, _NUMBER, _HEAD = 1, 2, 8, 10


@COMMANDS.reads("R RMORE RMODIF")
def real_constants(archive: Any, text: str) -> dict[int, list[float]]:
    """Real constants by set: of the RLBLOCK, and of R, RMORE and RMODIF commands."""
    constants = {
        int(number): [float(value) for value in values]
        for number, values in zip(archive.rlblock_num, archive.rlblock, strict=False)
    }
    last = 0
    for _, name, words in commands(text):
        values = [fortran_real(word) if word else 0.0 for word in words[1:]] if name in ("R", "RMODIF") else []
        if name == "R" and words and words[0].isdigit():
            last = whole_number(words[0])
            constants[last] = values
        elif name == "RMORE" and last:
            constants[last] += [fortran_real(word) if word else 0.0 for word in words]
        elif name == "RMODIF" and len(values) > 1 and words[0].isdigit():
            start = int(values[0]) - 1
            known = constants.setdefault(whole_number(words[0]), [])
            known += [0.0] * max(0, start + len(values) - 1 - len(known))
            known[start : start + len(values) - 1] = values[1:]
    return constants


class Lumps:
    """What the elements of these types add.

    Parameters
    ----------
    deck
        Takes what cannot be applied, and knows positions and own directions of nodes.
    archive, text
        The archive as read, and its text.
    """

    def __init__(self, deck: Deck, archive: Any, text: str) -> None:
        self.findings, self.axes = deck, deck.axes
        self.places = deck.nodes
        self.options: dict[int, dict[int, int]] = {
            int(number): {int(key): int(value) for key, value, *_ in options}
            for number, options in archive.key_option.items()
        }
        self.kinds = {int(number): int(kind) for number, kind in np.asarray(archive.ekey)}
        rows = [[int(value) for value in row] for row in archive.elem]
        self.rows = [row for row in rows if self.kinds.get(row[_TYPE]) in LUMP_TYPES]
        self.reals = real_constants(archive, text) if self.rows else {}

    def __iter__(self) -> Iterator[Lumped]:
        """What is added; InputError for elements without real constants."""
        for row in self.rows:
            kind, options = self.kinds[row[_TYPE]], self.options.get(row[_TYPE], {})
            where = Place(self.findings.source, f"{LUMP_TYPES[kind]} element {row[_NUMBER]}")
            nodes = [node for node in row[_HEAD:] if node > 0]
            reals = self.reals.get(row[_REAL])
            missing = [node for node in nodes if node not in self.places]
            if reals is None or missing or not nodes:
                what = f"real constants {row[_REAL]}" if reals is None else f"node {[*missing, '?'][0]}"
                raise refused(where, f"needs {what}, which the file does not have")
            yield from (
                self._mass(where, nodes[0], reals, options)
                if kind == 21
                else self._spring(where, nodes, reals, options)
            )

    def turning(self) -> set[int]:
        """Labels of nodes whose rotations a mass gives inertia."""
        return {
            row[_HEAD]
            for row in self.rows
            if self.kinds[row[_TYPE]] == 21 and self.options.get(row[_TYPE], {}).get(3, 0) == 0
        }

    def _refused(self, where: Place, what: str) -> None:
        self.findings.couple(where, what)

    def _mass(self, where: Place, node: int, reals: Sequence[float], options: Mapping[int, int]) -> Iterator[Lumped]:
        form = options.get(3, 0)
        turned = options.get(2, 0) and node in self.axes
        if options.get(1, 0) or form not in (0, 2) or turned:
            self._refused(where, "has options (volumes, two dimensions, own directions) which are not read")
            return
        if form == 2:
            yield from point_mass(node, reals[0])
            return
        x, y, z, xx, yy, zz = [*reals, *[0.0] * 6][:6]
        if x == y == z:
            yield from point_mass(node, x, np.diag([xx, yy, zz]) if any((xx, yy, zz)) else None)
            return
        yield Lumped(matrix="M", pairs=tuple((node, axis) for axis in range(3)), values=np.diag([x, y, z]))
        yield Lumped(matrix="M", pairs=tuple((node, 3 + axis) for axis in range(3)), values=np.diag([xx, yy, zz]))

    def _spring(
        self, where: Place, nodes: Sequence[int], reals: Sequence[float], options: Mapping[int, int]
    ) -> Iterator[Lumped]:
        stiffness, *others = [*reals, 0.0]
        if any(others[:2]):
            what = "damping is not read; give the structure's loss_factor or damping_ratio"
            self.findings.add(Verdict.APPROXIMATED, str(where[-1]), what, 0)
        axis = options.get(2, 0)
        if options.get(1, 0) or axis not in range(7) or (axis == 0 and options.get(3, 0)) or len(nodes) != 2:
            self._refused(where, "is not linear, twists, or is of two dimensions, which is not read")
            return
        first, second = nodes
        if axis == 0:
            along = np.asarray(self.places[second]) - np.asarray(self.places[first])
            yield axial_spring(stiffness, (first, second), along, where)
            return
        if any(node in self.axes for node in nodes):
            self._refused(where, "acts along directions of its nodes that are rotated")
            return
        pairs: tuple[Pair, Pair] = (first, axis - 1), (second, axis - 1)
        yield spring(stiffness, *pairs)
