"""What becomes of each card of a bulk data file whose solids are assembled here."""

from __future__ import annotations

import re

from slipstick.importers.findings import Findings, Verdict, VerdictRow, rows
from slipstick.importers.nastran.cards import CARD_VERDICTS

SOLIDS: dict[str, dict[int, tuple[str, tuple[int, ...]]]] = {
    "CTETRA": {4: ("tet4", tuple(range(4))), 10: ("tet10", tuple(range(10)))},
    "CPYRAM": {5: ("pyramid5", tuple(range(5))), 13: ("pyramid13", tuple(range(13)))},
    "CPYRA": {5: ("pyramid5", tuple(range(5))), 13: ("pyramid13", tuple(range(13)))},
    "CPENTA": {6: ("wedge6", tuple(range(6))), 15: ("wedge15", (*range(9), 12, 13, 14, 9, 10, 11))},
    "CHEXA": {8: ("hex8", tuple(range(8))), 20: ("hex20", (*range(12), *range(16, 20), *range(12, 16)))},
}
"""Our elements by card and number of nodes, and which of its nodes ours are: Nastran has the upright edges second."""

SAME = {"CTETRA"}
"""Integrated by Nastran as by us; the others have reduced integration or bubble functions by default."""

LUMPS = {"CONM2", "CELAS1", "CELAS2", "CMASS2", "PELAS"}
MATERIALS = {"MAT1", "PSOLID", "PARAM"}
POINTS = {"GRID", "GRDSET", "SPOINT", "SPC", "SPC1", "SPCADD", "MPC", "MPCADD", "RBE2", "RBE3", "RBAR"}
SYSTEMS = {f"CORD{i}{kind}" for i in "12" for kind in "RCS"}

_OTHERS = """CELAS3 CELAS4 CMASS1 CMASS3 CMASS4 CONM1 CDAMP1 CDAMP2 CDAMP3 CDAMP4 CVISC GENEL TF DMIG DMIJ
    NSM NSM1 NSML NSML1"""
MESH_VERDICTS: dict[str, VerdictRow] = {
    **rows(" ".join(sorted({*SOLIDS, *LUMPS, *MATERIALS, *POINTS, *SYSTEMS})), Verdict.READ),
    **CARD_VERDICTS,
    **rows(_OTHERS, Verdict.COUPLING, "adds stiffness, mass or damping, which is not read"),
    **rows("BCTABLE BCTSET BSURF BSURFS BCPROP BGSET BCTADD BGADD", Verdict.COUPLING, "holds surfaces in contact"),
    **rows("SUPORT SUPORT1", Verdict.HARMLESS),
    **rows("RFORCE", Verdict.APPROXIMATED, "rotates the structure: its stiffening and softening are left out"),
    **rows("MATT1", Verdict.APPROXIMATED, "lets a material depend on temperature: the numbers of its MAT1 are used"),
    **rows("MATS1", Verdict.APPROXIMATED, "is left out: the structure is linear, its material elastic"),
    **rows("RGYRO ROTORG ROTORD", Verdict.APPROXIMATED, "asks for gyroscopic terms, which are left out"),
    **rows("TABDMP1", Verdict.APPROXIMATED, "is not read; give the structure's loss_factor or damping_ratio"),
}
"""The whole of it at a glance, with the patterns below; what stands nowhere is named as not understood."""
_ELEMENT = re.compile(
    r"C(QUAD|TRI|BAR|BEAM|ROD|ONROD|TUBE|BUSH|GAP|SHEAR|BEND|WELD|FAST|SEAM|RAC|HEX|PEN|TET|AERO|FLUID|HA|HB)"
)
_HARMLESS = re.compile(
    r"P[A-Z0-9]+|PLOTEL|MATT?[A-Z0-9]+|EIG[A-Z]*|TAB[A-Z0-9]+|FORCE\d?|MOMENT\d?|PLOAD\d?|[RT]?LOAD\d?|DLOAD|DAREA|GRAV|"
    r"ACCEL\d?|LSEQ|FREQ\d?|TSTEP[A-Z]*|TEMP[A-Z0-9]*|[ABCQOU]?SET\d?|NLP[A-Z]*|MDLPRM|OMIT\d?|ECHO[A-Z]*|VIEW[A-Z0-9]*|"
    r"RAND[A-Z0-9]*|D[A-Z]+\d?|BEGIN|EXTRN"
)


def is_other_element(name: str) -> bool:
    """Whether a card is an element that is no solid: shells, beams, bushings.

    >>> [is_other_element(name) for name in ("CQUAD4", "CBEAM", "CORD2R", "CHEXA")]
    [True, True, False, False]
    """
    return name not in SOLIDS and _ELEMENT.match(name) is not None


def classify_mesh_card(findings: Findings, name: str, line: int) -> None:
    """Give a card that is not read its verdict."""
    if name not in MESH_VERDICTS and _HARMLESS.fullmatch(name):
        findings.add(Verdict.HARMLESS, name, "", line)
    else:
        findings.look_up(MESH_VERDICTS, name, name, line)
