"""Nastran bulk data: the cards of a file, and what becomes of those that are not read.

The matrices come from Nastran, so elements, properties and loads are in them; what matters here is what changes which
degrees of freedom their rows are.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator

from slipstick.errors import Fault, InputError
from slipstick.importers.findings import Findings, Table, Verdict

_SUPER = (
    "belongs to an assembly with superelements, which is not put together; import one superelement from its own punch "
    "file, or export the residual structure with its own bulk data"
)

SYSTEMS = " ".join(f"CORD{i}{kind}" for i in "12" for kind in "RCS")
SETS = "ASET BSET CSET QSET"
"""Cards of the analysis set: boundary and generalised degrees of freedom."""


MATRIX_CARDS = Table(("SPCD", Verdict.COUPLING, "prescribes a motion"))
"""Cards that are read, or mean something, beside matrices alone."""

CARDS = Table(
    ("INCLUDE", Verdict.INCOMPLETE, "is not read; merge the included files into one"),
    ("SUPER SEQSET SEQSET1 SEUSET SEUSET1 SESUP CSUPER CSUPEXT", Verdict.INCOMPLETE, _SUPER),
    ("SESET SEELT SEBULK SECONCT SEBNDRY SEEXCLD SELABEL SELOC SEMPLN SETREE SENQSET", Verdict.INCOMPLETE, _SUPER),
    ("EPOINT", Verdict.INCOMPLETE, "adds extra points, which are not read; export matrices without them"),
    ("AXIC AXIF RINGAX RINGFL GRIDB GRIDF GRIDS POINTAX", Verdict.INCOMPLETE, "is of a model that is no solid"),
    ("MPCAX", Verdict.COUPLING, "ties degrees of freedom to each other"),
    ("CYJOIN CYSYM CYAX", Verdict.COUPLING, "ties the two sides of a sector to each other"),
    ("RBAR1 RBE1 RBE2GS RROD RTRPLT RTRPLT1 RJOINT", Verdict.COUPLING, "couples nodes rigidly"),
    ("RSPLINE RSSCON", Verdict.COUPLING, "couples nodes by a spline"),
    ("SPCR SPCAX", Verdict.COUPLING, "prescribes a motion"),
    ("SPCOFF SPCOFF1", Verdict.COUPLING, "takes supports away"),
)
"""Cards that mean the same beside matrices and in a mesh; those that are read are entered by what reads them."""
_IN_THE_MATRICES = re.compile(
    r"[BCDP][A-Z0-9]+|MAT[A-Z0-9]*|EIG[A-Z]*|TAB[A-Z0-9]+|FORCE\d?|MOMENT\d?|[RT]?LOAD\d?|GRAV|ACCEL\d?|RFORCE|LSEQ|FREQ\d?|"
    r"TSTEP[A-Z]*|TEMP[A-Z0-9]*|[QU]?SET\d?|NSM[A-Z0-9]*|NLP[A-Z]*|MDLPRM|SUPORT\d?|OMIT\d?|TF|GENEL|MFLUID|ECHO[A-Z]*|"
    r"VIEW[A-Z0-9]*|RANDPS|RANDT1|ROTOR[A-Z]*|RGYRO|UNBALNC"
)
"""Elements, properties, materials, loads, tables, parameters: they are in the matrices, or not needed."""


def classify_card(findings: Findings, name: str, line: int) -> None:
    """Give a card that is not read its verdict."""
    if name in MATRIX_CARDS:
        findings.look_up(MATRIX_CARDS, name, name, line)
    elif name not in CARDS and _IN_THE_MATRICES.fullmatch(name):
        findings.add(Verdict.HARMLESS, name, "", line)
    else:
        findings.look_up(CARDS, name, name, line)


def cards(text: str, wanted: Collection[str]) -> Iterator[tuple[int, str, list[str]]]:
    """Line number, name and fields of each card; small, large and free fields, continuations joined.

    Cards with other names than those wanted come without fields. Executive and case control are passed over.

    >>> list(cards("GRID,1,,0.,1.5,2.", {"GRID"}))
    [(1, 'GRID', ['1', '', '0.', '1.5', '2.', '', '', ''])]
    >>> list(cards("GRID   *               1", {"GRID"}))
    [(1, 'GRID', ['1', '', '', ''])]
    """
    name, start, fields = "", 0, []
    for number, line in _bulk_lines(text, wanted):
        head = line.split(",", 1)[0][:8].strip().upper()
        if line[0] in "+*, " and not head[:1].isalpha():
            if name in wanted:
                fields += _fields(line, large=line[0] == "*")
            continue
        if name:
            yield start, name, fields
        start, fields = number, []
        name = head.rstrip("*").rstrip()
        if name in wanted:
            fields = _fields(line, large=head.endswith("*"))
    if name:
        yield start, name, fields


def _bulk_lines(text: str, wanted: Collection[str]) -> Iterator[tuple[int, str]]:
    """Lines between BEGIN BULK and ENDDATA, or all, without comments and empty ones.

    A punch file of one superelement is what follows its BEGIN SUPER; one among other cards is reported as card SUPER.
    """
    lines = text.splitlines()
    begins = re.compile(r"\s*BEGIN(\s*,?\s*BULK)?\b", re.IGNORECASE)
    first = next((i for i, line in enumerate(lines) if begins.match(line)), -1)
    if first >= 0 and "SUPER" in lines[first].upper():
        heads = (line.split(",", 1)[0][:8].strip().upper().rstrip("* ") for line in lines[:first])
        if any(head in wanted for head in heads):
            yield first + 1, "SUPER,"
    for number, raw in enumerate(lines[first + 1 :], first + 2):
        line = raw.split("$", 1)[0].expandtabs(8).rstrip()
        if line[:8].strip().upper().startswith("ENDDATA"):
            return
        if begins.match(line):
            yield number, "SUPER,"
        elif line:
            yield number, line


_REAL = re.compile(r"[+-]?(\d+\.\d*|\.\d+)([EeDd]?[+-]?\d+)?")


def _fields(line: str, *, large: bool) -> list[str]:
    count, width = (4, 16) if large else (8, 8)
    if "," in line:
        parts = [part.strip() for part in line.split(",")][1:]
        if any(_REAL.fullmatch(part) for part in parts[count:]):
            some = "a line of large fields (*) holds four" if large else "a line holds eight; go on in the next one"
            raise InputError(Fault(statement=f"bulk data '{line.strip()[:72]}' has {len(parts)} fields", remedy=some))
        parts = parts[:count]
    else:
        parts = [line[8 + width * i : 8 + width * (i + 1)].strip() for i in range(count)]
    return parts + [""] * (count - len(parts))
