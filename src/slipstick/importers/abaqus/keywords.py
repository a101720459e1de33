"""The text of an input file (.inp) as blocks, and the table of all its keywords and element types.

A block is a keyword, its parameters and its data lines; what a file includes is read in its place. ``KEYWORDS`` says
what becomes of each keyword (without its blanks): read, refused, approximated, without effect. A keyword that is not in
it is named as not understood.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from slipstick.errors import Place
from slipstick.faults import real_path, unreached
from slipstick.importers.findings import Findings, Table, Verdict, refused
from slipstick.importers.text_numbers import LARGEST_TEXT_FILE, read_bytes
from slipstick.typing import Array

_WHOLE = "is not read: the mesh would be incomplete; write one flat input file with all nodes and elements"
_TIES = "ties degrees of freedom to each other"
_REFERENCE = "couples nodes to a reference node"
_MEDIUM = "couples faces to a medium"
_DAMPING = "is not read; give the structure's loss_factor or damping_ratio"
_LINEAR = "is left out: the structure is linear, its material elastic"


def _gives(what: str) -> str:
    return f"gives {what}, elements that are not read"


LAWS = """HYPERELASTIC HYPERFOAM USERMATERIAL VISCOELASTIC POROUSELASTIC LOWDENSITYFOAM HYPOELASTIC FABRIC
    NOCOMPRESSION NOTENSION MOHRCOULOMB"""
"""Laws that make a material unusable; refused where a section uses it."""

_LOADS = """BOUNDARYF TRANSFORMF EQUATIONF VIEWFACTOR FLUIDSECTIONS
    DSFLUX FIELD CFLUX DFLUX FILM SFILM CFILM RADIATE SRADIATE CRADIATE
    MASSFLOW BASEMOTION PRESSURESTRESS FILMPROPERTY AMPLITUDE TIMEPOINTS LOADCASE ENDLOADCASE PSD-DEFINITION
    CORRELATION"""
_DEFINITIONS = """HEADING PREPRINT ASSEMBLY ENDASSEMBLY ENDSTEP DISTRIBUTION
    DISTRIBUTIONTABLE SPECIFICHEAT LATENTHEAT HEATGENERATION DEPVAR USEROUTPUTVARIABLES
    PHYSICALCONSTANTS VALUESATINFINITY CHANGEFRICTION
    GAPCONDUCTANCE GAPHEATGENERATION CONTACTDAMPING CONTACTINCLUSIONS CONTACTPROPERTYASSIGNMENT
    CONTACTCONTROLS CONTACTFORMULATION SURFACEPROPERTYASSIGNMENT CONTACTINITIALIZATIONASSIGNMENT
    CONTACTINITIALIZATIONDATA CONTACTEXCLUSIONS CHANGESURFACEBEHAVIOR CHANGECONTACTTYPE FLUIDCONSTANTS
    FLUIDSECTION SPECIFICGASCONSTANT ELECTRICALCONDUCTIVITY MAGNETICPERMEABILITY
    NORMAL NODALTHICKNESS TRANSVERSESHEARSTIFFNESS CONNECTORBEHAVIOR CONNECTORELASTICITY
    CONNECTORDAMPING CHANGEPLASTIC"""
_PROCEDURES = """MODALDYNAMIC STEADYSTATEDYNAMICS BUCKLE GREEN HEATTRANSFER ELECTROMAGNETICS CFD SENSITIVITY
    RANDOMRESPONSE RESPONSESPECTRUM SUBSTRUCTUREGENERATE SUBSTRUCTUREMATRIXOUTPUT
    MATRIXGENERATE MATRIXOUTPUT ELEMENTMATRIXOUTPUT SELECTEIGENMODES DESIGNVARIABLES
    DESIGNRESPONSE OBJECTIVE CONSTRAINT FEASIBLEDIRECTION FILTER ROBUSTDESIGN RANDOMFIELD CORRELATIONLENGTH
    CRACKPROPAGATION REFINEMESH NOANALYSIS RESTART CONTROLS SOLUTIONTECHNIQUE DAMPINGCONTROLS
    SUBSTRUCTURELOADCASE"""
_OUTPUT = """NODEPRINT NODEFILE NODEOUTPUT ELPRINT ELFILE ELEMENTOUTPUT OUTPUT CONTACTPRINT CONTACTFILE CONTACTOUTPUT
    SECTIONPRINT SECTIONFILE FACEPRINT FILEFORMAT MONITOR MODALFILE MODALPRINT ENERGYPRINT ENERGYFILE
    ENERGYOUTPUT PRINT FILEOUTPUT RADIATIONOUTPUT INTEGRATEDOUTPUTSECTION INTEGRATEDOUTPUT DIAGNOSTICS"""

LOADING = "STATIC DYNAMIC VISCO COUPLEDTEMPERATURE-DISPLACEMENT UNCOUPLEDTEMPERATURE-DISPLACEMENT"
"""Procedures after which the model is loaded: small motions about that state are stiffened by it."""

OTHER_SECTIONS = """SHELLSECTION SHELLGENERALSECTION BEAMSECTION BEAMGENERALSECTION FRAMESECTION
    MEMBRANESECTION SURFACESECTION GASKETSECTION COHESIVESECTION"""
"""Sections of elements that are no solids: refused where these share nodes with solids, else listed."""

KEYWORDS = Table(
    ("PARAMETER", Verdict.INCOMPLETE, "is not read; write the values in place of the parameters"),
    ("NGEN NFILL NCOPY NMAP ELGEN ELCOPY IMPORT IMPORTNSET IMPORTELSET", Verdict.INCOMPLETE, _WHOLE),
    ("SYMMETRICMODELGENERATION", Verdict.INCOMPLETE, _WHOLE),
    ("NETWORKMPC", Verdict.COUPLING, _TIES),
    ("TIEDCONTACT", Verdict.COUPLING, "glues surfaces together"),
    ("CONTACT", Verdict.COUPLING, "holds surfaces in contact"),
    ("CLEARANCE CONTACTINTERFERENCE", Verdict.APPROXIMATED, "moves surfaces of contacts, which is left out"),
    ("KINEMATICCOUPLING", Verdict.COUPLING, _REFERENCE),
    ("EMBEDDEDELEMENT SHELLTOSOLIDCOUPLING", Verdict.COUPLING, "ties elements into others"),
    ("FASTENER", Verdict.COUPLING, "joins surfaces by fasteners"),
    ("RELEASE", Verdict.COUPLING, "releases rotations"),
    ("INERTIARELIEF", Verdict.COUPLING, "balances loads by accelerations"),
    ("MODELCHANGE", Verdict.COUPLING, "takes elements or contacts out or puts them in"),
    ("SUBMODEL", Verdict.COUPLING, "moves nodes by the results of another model"),
    ("FOUNDATION", Verdict.COUPLING, "supports faces by an elastic foundation"),
    ("IMPEDANCE SIMPEDANCE", Verdict.COUPLING, _MEDIUM),
    ("NONSTRUCTURALMASS", Verdict.COUPLING, "gives mass that is not read"),
    ("JOINT CONNECTORSECTION GAP BUSHING", Verdict.COUPLING, _gives("stiffness to gaps or connectors")),
    ("REBAR REBARLAYER", Verdict.COUPLING, _gives("stiffness and mass to reinforcements")),
    ("ACOUSTICMEDIUM", Verdict.COUPLING, _gives("stiffness and mass to a fluid")),
    ("USERELEMENT UELPROPERTY USERSECTION", Verdict.COUPLING, _gives("stiffness and mass to user elements")),
    ("SUBSTRUCTUREPROPERTY", Verdict.COUPLING, _gives("stiffness and mass to substructures")),
    ("MATRIX MATRIXINPUT MATRIXASSEMBLE", Verdict.COUPLING, "gives stiffness and mass by matrices"),
    ("DAMPING MODALDAMPING GLOBALDAMPING", Verdict.APPROXIMATED, _DAMPING),
    ("CHANGEMATERIAL", Verdict.APPROXIMATED, "is left out: the materials of the model stay"),
    ("CHANGESOLIDSECTION", Verdict.APPROXIMATED, "is left out: the sections of the model stay"),
    ("COMPLEXFREQUENCY", Verdict.APPROXIMATED, "asks for gyroscopic terms, which are left out"),
    ("PLASTIC CYCLICHARDENING DEFORMATIONPLASTICITY CREEP POTENTIAL", Verdict.APPROXIMATED, _LINEAR),
    ("RATEDEPENDENT SWELLING ANNEALTEMPERATURE DAMAGEINITIATION DAMAGEEVOLUTION", Verdict.APPROXIMATED, _LINEAR),
    ("DRUCKERPRAGER CAPPLASTICITY", Verdict.APPROXIMATED, _LINEAR),
    (" ".join((_LOADS, _DEFINITIONS, _PROCEDURES, _OUTPUT)), Verdict.HARMLESS, ""),
)
"""Every keyword: those that are read are entered by the functions that read them."""


@dataclass(frozen=True, kw_only=True)
class ElementType:
    """Our element for a solid; whether both integrate alike."""

    kind: str
    same: bool = False


ELEMENT_TYPES = {
    "C3D4": ElementType(kind="tet4", same=True),
    "C3D5": ElementType(kind="pyramid5"),
    "C3D6": ElementType(kind="wedge6"),
    "C3D8": ElementType(kind="hex8"),
    "C3D8R": ElementType(kind="hex8r"),
    "C3D8I": ElementType(kind="hex8i", same=True),
    "C3D10": ElementType(kind="tet10", same=True),
    "C3D15": ElementType(kind="wedge15", same=True),
    "C3D20": ElementType(kind="hex20", same=True),
    "C3D20R": ElementType(kind="hex20r", same=True),
}
"""Solids. With other letters (C3D8H, C3D10M, DC3D8) they have the same nodes and another integration."""


def solid_type(name: str) -> ElementType | None:
    """Our element for a foreign element type; None unless it is a solid.

    >>> solid_type("C3D20RH")
    ElementType(kind='hex20r', same=False)
    >>> solid_type("DC3D8").kind, solid_type("C3D8IH").kind, solid_type("S8R")
    ('hex8', 'hex8i', None)
    """
    match = re.fullmatch(r"D?(C3D\d+)([A-Z]*)", name)
    if name in ELEMENT_TYPES or match is None:
        return ELEMENT_TYPES.get(name)
    own = next((letter for letter in "RI" if letter in match[2]), "")
    like = ELEMENT_TYPES.get(match[1] + own, ELEMENT_TYPES.get(match[1]))
    return None if like is None else replace(like, same=False)


_DEPTH = 10
_INCLUDE = re.compile(r"^\s*\*\s*INCLUDE\s*,(.*)$", re.IGNORECASE)
_FILE = re.compile(r'^\s*INPUT\s*=\s*"?([^",]*)"?\s*,?\s*$', re.IGNORECASE)


def whole_text(path: Path, findings: Findings) -> str:
    """The text of a file with those it includes, which must lie in its folder or below.

    Raises
    ------
    InputError
        If one is missing, lies elsewhere, includes itself, or all together are too long; with the line.
    """
    read: list[int] = []
    lines = _lines(path, real_path(path).parent, (real_path(path),), read)
    if len(read) > 1:
        findings.origin = [where for where, _ in lines]
        findings.extra.append(f"{path.name}: {len(read) - 1} included files were read")
    return "\n".join(line for _, line in lines)


Line = tuple[tuple[str, int], str]
"""File and number, and text."""


def _lines(path: Path, folder: Path, above: tuple[Path, ...], read: list[int]) -> list[Line]:
    """Place and text of each line."""
    text = read_bytes(path)
    read.append(len(text))
    if sum(read) > LARGEST_TEXT_FILE:
        raise refused(path.name, f"with what it includes it is larger than {LARGEST_TEXT_FILE / 1e9:.3g} GB")
    lines: list[Line] = []
    for number, line in enumerate(text.decode("latin-1").splitlines(), 1):
        match = _INCLUDE.match(line)
        if not match:
            lines.append(((path.name, number), line))
            continue
        where = Place(path.name, f"line {number}", "*INCLUDE")
        inner = _included(match.group(1), folder, where)
        if inner in above or len(above) >= _DEPTH:
            raise refused(where, f"{inner.name} includes itself, or files include each other more than {_DEPTH} deep")
        lines += _lines(inner, folder, (*above, inner), read)
    return lines


def _included(words: str, folder: Path, where: Place) -> Path:
    """The file of "INPUT=name", in the folder of the deck."""
    match = _FILE.match(words)
    if not match or not match.group(1).strip():
        raise refused(where, "lacks INPUT=", expected="the name of a file")
    name = match.group(1).strip()
    inner = real_path(folder / name.replace("\\", "/"))
    if not inner.is_relative_to(folder):
        raise refused(where, f"{name} does not lie in the folder of the file", remedy="put it there, or merge the two")
    if reason := unreached(inner):
        raise refused(where, f"{name} cannot be reached ({reason})", remedy="put the file itself there")
    if not inner.is_file():
        raise refused(where, f"there is no file {name} in the folder of the file")
    return inner


@dataclass(frozen=True, kw_only=True)
class Placement:
    """A motion of places: ``turn @ x + shift``."""

    turn: Array
    shift: Array

    def place(self, x: Array) -> Array:
        """Where a place (3,) goes."""
        return np.asarray(self.turn @ x + self.shift)


@dataclass(frozen=True, kw_only=True)
class Block:
    """A keyword without blanks, its parameters in capitals, and its data lines as words.

    ``continued`` holds the indices of the rows that end with a comma: an element goes on in the next one;
    ``placement`` is that of the instance of which the block is.
    """

    keyword: str
    shown: str
    parameters: dict[str, str]
    line: int
    rows: list[list[str]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    continued: set[int] = field(default_factory=set)
    placement: Placement | None = None

    def joined(self) -> Iterator[tuple[int, list[str]]]:
        """Line and words of each entry, continued rows joined."""
        start = self.line
        words: list[str] = []
        for index, row in enumerate(self.rows):
            start = start if words else self.lines[index]
            words = words + [word for word in row if word]
            if index not in self.continued:
                yield start, words
                words = []
        if words:
            yield start, words


def blocks(text: str) -> Iterator[Block]:
    """The blocks of a file; a keyword line that ends with a comma goes on in the next line.

    >>> [(b.shown, b.parameters, b.rows) for b in blocks("*NSET,\\n nset=Tip\\n1, 2,\\n3")]
    [('*NSET', {'NSET': 'TIP'}, [['1', '2'], ['3']])]
    """
    block: Block | None = None
    head, head_line = "", 0
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        if line.startswith("**") or not line:
            continue
        if line.startswith("*") and head:
            if block:
                yield block
            block, head = _start(head, head_line), ""
        if head or line.startswith("*"):
            head, head_line = head + line, head_line if head else number
            if line.endswith(","):
                continue
            if block:
                yield block
            block, head = _start(head, head_line), ""
        elif block:
            if line.endswith(","):
                block.continued.add(len(block.rows))
            block.rows.append([word.strip() for word in line.rstrip(",").split(",")])
            block.lines.append(number)
    if head:
        if block:
            yield block
        block = _start(head, head_line)
    if block:
        yield block


def _start(head: str, line: int) -> Block:
    name, *parameters = (part.strip().upper() for part in head[1:].split(","))
    pairs = (part.split("=", 1) for part in parameters if part)
    named = {pair[0].replace(" ", ""): pair[-1].strip().strip('"') for pair in pairs}
    return Block(keyword=name.replace(" ", ""), shown=f"*{' '.join(name.split())}", parameters=named, line=line)
