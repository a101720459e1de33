"""The treatment of each command of an Ansys archive (.cdb) other than nodes, elements, components and materials."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping

from slipstick.errors import Place
from slipstick.fem.load_steps import StepLoad
from slipstick.importers.findings import Entry, Findings, Table, Verdict
from slipstick.importers.text_numbers import fortran_real, reading, whole_number

_TIES = "ties degrees of freedom to each other"
_MISSING = "brings in data that are not in the file; write one archive with CDWRITE,DB"
_ROTATES = "rotates the structure: its stiffening and softening are left out"
_DAMPING = "is not read; give the structure's loss_factor or damping_ratio"

_HARMLESS_WORDS = """
    /COM /PREP7 /NOPR /GOPR /GO /TITLE /AUX15 /SOLU /POST1 /POST26 /BATCH /CONFIG /NERR /WB /DELETE /EOF
    /VIEW
    /STITLE /PBC /PSF /OUTPUT /SHOW /CLEAR /FILNAME /GRAPHICS /CPLANE /TYPE /FOC /AUTO /DIST /ANG /AN3D /FACET
    FINISH FINI SAVE IOPTN NUMOFF DOF EXTOPT CM CMSEL CMEDIT ALLSEL NSEL ESEL CMGRP SHPP ERESX OUTRES OUTPR
    OUTGEOM ACEL CGLOC DOMEGA DCGOMG DCMOMEGA CMDOMEGA KUSE TIME CRPLIM NCNV NEQIT CNVTOL
    AUTOTS NSUBST DELTIM KBC NROPT EQSLV LNSRCH PRED RESCONTROL CUTCONTROL STABILIZE MONITOR ARCLEN OPNCONTROL
    ANTYPE MODOPT MODCONTROL QRDOPT MXPAND HROPT HROUT HARFRQ TRNOPT BUCOPT NLGEOM MPCOPY DMPOPTION F FBLOCK
    FCUM FJ SF SFE SFEBLOCK SFBEAM SFGRAD SFCUM BFE BFBLOCK BFEBLOCK BFCUM DCUM ICUM IC LDREAD LSWRITE
    LSSOLVE SOLVE LOCAL CS CSYS CSKP CLOCAL DSYS ESYS WPLANE WPCSYS WPSTYL TYPE MAT REAL SECNUM TSHAP
    SECBLOCK SECOFFSET SECCONTROL SECREAD SECLOCK SECMODIF SECJOINT SECPLOT
    SECSTOP TBFIELD TBPT TBLIST TBDELE TBCOPY TBIN MPLIB UIMP KEYW PARSAV PARRES ESHAPE
    MSHAPE MSHKEY KEYPTS STARSET NUMCMP ETCONTROL"""


COMMANDS = Table(
    (_HARMLESS_WORDS, Verdict.HARMLESS, ""),
    ("CEQN CEINTF CERIG CESGEN CECYC", Verdict.COUPLING, _TIES),
    ("CPLGEN CPINTF CPNGEN CPSGEN CPCYC RBE3", Verdict.COUPLING, _TIES),
    ("NROTAT NANG", Verdict.COUPLING, "rotates the directions of nodes"),
    ("EKILL", Verdict.COUPLING, "takes elements out"),
    ("DJ", Verdict.COUPLING, "moves joints"),
    ("ISTRESS INISTATE", Verdict.COUPLING, "sets stresses that stiffen the structure"),
    ("DDELE", Verdict.COUPLING, "takes supports away"),
    ("NUMMRG", Verdict.COUPLING, "merges nodes"),
    ("E EN EMORE", Verdict.COUPLING, "adds an element outside of the element blocks, which is not read"),
    ("EMODIF EDELE NMODIF NDELE NSCALE EGEN ENGEN NGEN", Verdict.COUPLING, "changes the mesh that was read"),
    ("MPCHG MPDELE", Verdict.COUPLING, "changes the materials that were read"),
    ("DSYM DK DL DA", Verdict.COUPLING, "holds what lies on a plane or a body, which is not read"),
    ("CDREAD /INPUT *USE", Verdict.INCOMPLETE, _MISSING),
    ("MPAMOD", Verdict.APPROXIMATED, "is left out"),
)
"""Every command: those that are read are entered by what reads them. What stands neither here nor in ``ZERO`` is named
as not understood.
"""

ZERO = Table(
    ("ALPHAD BETAD DMPRAT DMPSTR MDAMP", Verdict.APPROXIMATED, _DAMPING),
    ("OMEGA CMOMEGA CGOMGA CGOMEGA", Verdict.APPROXIMATED, _ROTATES),
    ("CORIOLIS", Verdict.APPROXIMATED, "asks for gyroscopic terms, which are left out"),
    ("LUMPM", Verdict.APPROXIMATED, "asks for lumped masses; consistent ones are used"),
    ("SSTIF PSTRES", Verdict.APPROXIMATED, "asks for stiffening by stress, which is left out"),
    ("IRLF", Verdict.COUPLING, "balances loads by accelerations"),
)
"""Commands that matter with numbers other than 0 only."""

_GEOMETRY = re.compile(r".{72}[SGDPT] *\d+\s*$")


def commands(text: str) -> Iterator[tuple[int, str, list[str]]]:
    """Line, name and words of each command; the numbers of blocks and the geometry before them are passed over.

    Blanks may stand before a command, and "$" between several.

    >>> list(commands("D,      1,UX  ,  0.0\\n     1     2\\n"))
    [(1, 'D', ['1', 'UX', '0.0'])]
    """
    for number, line in enumerate(text.splitlines(), 1):
        if not (line.lstrip()[:1].isalpha() or line.lstrip()[:1] in ("/", "*")) or _GEOMETRY.match(line):
            continue
        for one in line.split("!")[0].split("$"):
            head, *words = one.split(",")
            if head.split() and len(head.split()) == 1:
                yield number, head.strip().upper(), [word.strip() for word in words]


@COMMANDS.reads("D N")
def classify_commands(
    findings: Findings,
    text: str,
    bolts: Collection[int] = (),
    turned: Collection[int] = (),
    moved: list[StepLoad] | None = None,
) -> set[tuple[int, int]]:
    """Give each command its verdict; return the supports (node, direction 0..5), without those of bolts' nodes.

    Displacements other than 0 are added to ``moved``, those of nodes that are not ``turned``.
    """
    held: set[tuple[int, int]] = set()
    for line, name, words in commands(text):
        if name == "D" and words and words[0].isdigit() and int(words[0]) in bolts:
            findings.add(Verdict.HARMLESS, name, "", line)
        elif name == "D":
            with reading(Place(findings.source, f"line {line}", "D")):
                held |= _support(findings, line, words, turned, moved)
        elif name == "N" and "-1" not in words:  # which ends a block
            what = "adds, moves or turns a node outside of the node blocks, which is not read"
            findings.add(Verdict.COUPLING, name, what, line)
        elif name in ZERO:
            entry = ZERO[name] if any(map(_value, words)) else Entry(verdict=Verdict.HARMLESS)
            findings.add(entry.verdict, name, entry.what, line)
        elif name.startswith("*") and name not in COMMANDS:
            findings.add(Verdict.HARMLESS, name, "", line)
        else:
            findings.look_up(COMMANDS, name, name, line)
    return held


def _value(word: str) -> float:
    """A number, 0 for a blank or a word that says no; other words count as 1.

    >>> [_value(word) for word in ("", "0.5D-3", "OFF", "%TABLE%")]
    [0.0, 0.0005, 0.0, 1.0]
    """
    if word.upper() in ("", "OFF", "NO"):
        return 0.0
    try:
        return fortran_real(word)
    except ValueError:
        return 1.0


def _support(
    findings: Findings, line: int, words: list[str], turned: Collection[int], moved: list[StepLoad] | None
) -> set[tuple[int, int]]:
    """D, node, label, value, second value, last node, step, more labels."""
    node, label, value, second, last, _, *more = [*words, *[""] * 6]
    labels = [name.upper() for name in (label, *more) if name]
    straight = moved is not None and node.isdigit() and int(node) not in turned
    along = [LABELS.get(name, 9) for name in labels]
    kept = straight and "%" not in value and not _value(second) and all(axis < 3 for axis in along)
    if "%" in value or _value(second) or (_value(value) and not kept):
        findings.add(Verdict.COUPLING, "D", "prescribes a value that is not 0", line)
        return set()
    if not node.isdigit() or last not in ("", "0", node):
        findings.add(Verdict.COUPLING, "D", "names its nodes otherwise than one on a line, which is not read", line)
        return set()
    if moved is not None and _value(value):
        size, where = fortran_real(value), str(whole_number(node))
        moved += [StepLoad(kind="displacement", where=where, value=size, axis=axis + 1) for axis in along]
    axes = [axis for name in labels for axis in (range(6) if name == "ALL" else [LABELS.get(name, -1)]) if axis >= 0]
    return {(whole_number(node), axis) for axis in axes}


LABELS: Mapping[str, int] = {"UX": 0, "UY": 1, "UZ": 2, "ROTX": 3, "ROTY": 4, "ROTZ": 5}
"""Directions by their labels."""
