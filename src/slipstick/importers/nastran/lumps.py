"""Point masses and springs of bulk data: CONM2, CELAS1, CELAS2, CMASS2."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from slipstick.errors import InputError
from slipstick.fem.lumped import Lumped, point_mass
from slipstick.importers.findings import Findings, Verdict
from slipstick.importers.nastran.couplings import Points
from slipstick.importers.text_numbers import fortran_real, whole_number

Card = tuple[str, int, list[str]]


def lumped_of(
    findings: Findings, lump_cards: Sequence[Card], points: Points, solid: set[int], factor: float
) -> tuple[tuple[Lumped, ...], set[int]]:
    """What the cards add, and the points whose rotations take part; ``factor`` multiplies masses (PARAM,WTMASS).

    Raises
    ------
    InputError
        For cards that cannot be read, and points or properties that are not there.
    """
    stiffness = {
        whole_number(f[i]): fortran_real(f[i + 1]) for n, _, f in lump_cards if n == "PELAS" for i in (0, 4) if f[i]
    }
    parts: list[Lumped] = []
    for name, line, fields in lump_cards:
        where = f"{points.source}, line {line}: {name}"
        try:
            if name == "CONM2":
                parts += _mass(findings, [*fields, *[""] * 16], line, points, solid, factor, where)
            elif name != "PELAS":
                parts += _scalar(name, fields, points, stiffness, factor, where)
        except InputError:
            raise
        except (ValueError, IndexError) as error:
            raise InputError(f"{where} cannot be read ({error})") from None
    return tuple(parts), {node for part in parts for node, axis in part.pairs if axis > 2}


def _mass(
    findings: Findings, fields: Sequence[str], line: int, points: Points, solid: set[int], factor: float, where: str
) -> Iterator[Lumped]:
    """Number, point, system, mass, offset (three), blank, then I11, I21, I22, I31, I32, I33."""
    node, system = whole_number(fields[1]), fields[2]
    place = points.place(node, where)
    mass = factor * fortran_real(fields[3])
    offset = np.array([fortran_real(word) if word else 0.0 for word in fields[4:7]])
    xx, yx, yy, zx, zy, zz = (factor * fortran_real(word) if word else 0.0 for word in fields[8:14])
    inertia = np.array([[xx, -yx, -zx], [-yx, yy, -zy], [-zx, -zy, zz]])
    if system == "-1":
        offset = offset - place
    elif system not in ("", "0") and (offset.any() or inertia.any()):
        what = f"has its offset or inertia in coordinate system {system}, which is not read"
        findings.add(Verdict.COUPLING, "CONM2", what, line)
        return
    if node in solid and (offset.any() or inertia.any()):
        what = f"has an offset or inertia at point {node} of solids, which have no rotations: only its mass is used"
        findings.add(Verdict.APPROXIMATED, "CONM2", what, line)
        offset, inertia = np.zeros(3), np.zeros((3, 3))
    yield from point_mass(node, mass, inertia if inertia.any() else None, offset if offset.any() else None)


def _scalar(
    name: str, fields: Sequence[str], points: Points, stiffness: Mapping[int, float], factor: float, where: str
) -> Iterator[Lumped]:
    """CELAS1: number, property, then "point, direction" twice; CELAS2, CMASS2: number, value, and the same."""
    if name == "CELAS1":
        number = whole_number(fields[1] or fields[0])
        if number not in stiffness:
            raise InputError(f"{where} names the property PELAS {number}, which is not in the file")
        value = stiffness[number]
    else:
        value = fortran_real(fields[1]) * (factor if name == "CMASS2" else 1.0)
    terms: list[tuple[int, int, float]] = []
    for sign, at in ((1.0, 2), (-1.0, 4)):
        node, direction = [*fields[at : at + 2], "", ""][:2]
        if node and node != "0" and direction not in ("", "0"):
            points.place(whole_number(node), where)
            axis_terms = points.axis(whole_number(node), whole_number(direction) - 1)
            terms += [(n, c, sign * cosine) for n, c, cosine in axis_terms]
        elif node and node != "0":
            raise InputError(f"{where} joins the scalar point {node}, which is not read")
    along = np.array([cosine for _, _, cosine in terms])
    pairs = tuple((n, c) for n, c, _ in terms)
    yield Lumped(matrix="M" if name == "CMASS2" else "K", pairs=pairs, values=value * np.outer(along, along))
