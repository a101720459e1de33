"""CYCLIC of an Ansys archive: number of sectors, coordinate system of the axis, components of the two faces."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from functools import partial

import numpy as np

from slipstick.fem.axis import Axis
from slipstick.fem.cyclic import CyclicSymmetry
from slipstick.importers.ansys.commands import COMMANDS, commands
from slipstick.importers.findings import Findings, Verdict
from slipstick.importers.text_numbers import fortran_real

_LOCAL = re.compile(r"^LOCAL,R5\.\d,(LOC|ANG),\s*(\d+)\s*,([^!\r\n]*)", re.MULTILINE | re.IGNORECASE)


@COMMANDS.reads("CYCLIC")
def read_cyclic(findings: Findings, text: str, components: Collection[str]) -> CyclicSymmetry | None:
    """What ``CYCLIC, NSECTOR, ANGLE, KCN, Name`` says, with the components Name_M01L, Name_M01H, ...; None without it.

    What cannot be understood is refused as a coupling.
    """
    found = None
    for line, name, words in commands(text):
        if name != "CYCLIC" or (words and words[0].upper() in ("STATUS", "OFF", "UNDOUBLE")):
            continue
        refuse = partial(findings.add, Verdict.COUPLING, name, line=line)
        try:
            found = _symmetry(text, words, components)
        except ValueError as error:
            refuse(f"cannot be read ({error})")
    return found


def _symmetry(text: str, words: Sequence[str], components: Collection[str]) -> CyclicSymmetry:
    count, angle, system, name = [*words, *[""] * 4][:4]
    each = fortran_real(angle) if angle else 0.0
    sectors = fortran_real(count) if count else 360.0 / each if each else 0.0
    if sectors < 2 or abs(sectors - round(sectors)) > 1e-3:
        raise ValueError("expected a number of sectors from 2 up, or their angle")
    prefix = (name or "CYCLIC").upper()
    low, high = (
        sorted(part for part in components if re.fullmatch(rf"{re.escape(prefix)}_M\d+{end}", part.upper()))
        for end in "LH"
    )
    if not low or len(low) != len(high):
        raise ValueError(f"expected the node components {prefix}_M01L and {prefix}_M01H of its faces")
    return CyclicSymmetry(sectors=round(sectors), axis=_axis(text, system), low=tuple(low), high=tuple(high))


def _axis(text: str, system: str) -> Axis:
    """The third axis of a coordinate system; 0, 1 and 2 are global ones, whose axis is z."""
    number = int(fortran_real(system)) if system else 0
    if number in (0, 1, 2):
        return Axis()
    stated = {
        kind.upper(): [fortran_real(word) if word.strip() else 0.0 for word in rest.split(",")]
        for kind, own, rest in _LOCAL.findall(text)
        if int(own) == number
    }
    if "LOC" not in stated or len(stated["LOC"]) < 4:
        raise ValueError(f"the file does not define coordinate system {number}")
    from scipy.spatial.transform import Rotation

    angles = [*stated.get("ANG", []), 0.0, 0.0, 0.0][:3]
    third = Rotation.from_euler("ZXY", angles, degrees=True).as_matrix() @ np.array([0.0, 0.0, 1.0])
    return Axis(point=stated["LOC"][1:4], direction=third)
