"""Meshes of Nastran bulk data (.bdf): solids, isotropic materials, supports, couplings, point masses and springs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.equations import NodalEquation, supports
from slipstick.fem.load_steps import INITIAL, LoadStep, StepLoad
from slipstick.fem.lumped import Lumped, point_mass
from slipstick.fem.materials import Material
from slipstick.importers.deck import Deck
from slipstick.importers.findings import Findings, Table, Verdict, refused
from slipstick.importers.interfaces import kept_note
from slipstick.importers.mesh_checks import unit_notes
from slipstick.importers.nastran.bulk import MOVED, BulkData, read_bulk
from slipstick.importers.nastran.cards import CARDS, cards
from slipstick.importers.nastran.couplings import Points, coupled_equations, selected
from slipstick.importers.nastran.interfaces import CONTACT_CARDS, Contacts
from slipstick.importers.nastran.matrices import chosen_supports, points_of
from slipstick.importers.text_numbers import fortran_real, read_bytes, reading, whole_number
from slipstick.typing import Array

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

_OTHERS = """CELAS3 CELAS4 CMASS1 CMASS3 CMASS4 CONM1 CDAMP1 CDAMP2 CDAMP3 CDAMP4 CVISC GENEL TF DMIG DMIJ
    NSM NSM1 NSML NSML1"""
MESH_CARDS = Table(
    (_OTHERS, Verdict.COUPLING, "adds stiffness, mass or damping, which is not read"),
    ("BCPROP BCTABL1 BCONECT BCONP BCAUTOP", Verdict.COUPLING, "holds surfaces in contact"),
    ("BGSET BGADD", Verdict.COUPLING, "glues surfaces together"),
    ("BLSEG", Verdict.COUPLING, "holds lines in contact"),
    ("BCTPARM BCPARA BCRPARA BFRIC BCONPRG BCONPRP BCBDPRP BOUTPUT BWIDTH", Verdict.HARMLESS, ""),
    ("BOLTFRC BOLTSEQ", Verdict.HARMLESS, ""),
    ("SUPORT SUPORT1", Verdict.HARMLESS, ""),
    ("RFORCE", Verdict.APPROXIMATED, "rotates the structure: its stiffening and softening are left out"),
    ("MATS1", Verdict.APPROXIMATED, "is left out: the structure is linear, its material elastic"),
    ("RGYRO ROTORG ROTORD", Verdict.APPROXIMATED, "asks for gyroscopic terms, which are left out"),
    ("TABDMP1", Verdict.APPROXIMATED, "is not read; give the structure's loss_factor or damping_ratio"),
)
"""Cards that mean something in a mesh alone, beside those of CARDS, and with the patterns below; what stands nowhere is
named as not understood.
"""
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
    """Give a card that is not read here its verdict."""
    if name not in MESH_CARDS and name not in CARDS and _HARMLESS.fullmatch(name):
        findings.add(Verdict.HARMLESS, name, "", line)
    else:
        findings.look_up(MESH_CARDS if name in MESH_CARDS else CARDS, name, name, line)


Card = tuple[str, int, list[str]]


@dataclass(kw_only=True)
class Cards(Deck):
    """A mesh of bulk data as far as its cards were read; materials and properties by number."""

    property_numbers: dict[int, int] = field(default_factory=dict)
    laws: dict[int, dict[str, Any]] = field(default_factory=dict)
    by_temperature: dict[int, tuple[int, list[str]]] = field(default_factory=dict)
    tables: dict[int, list[tuple[float, float]]] = field(default_factory=dict)
    kept_loads: dict[str, list[StepLoad]] = field(default_factory=dict)
    moved: list[tuple[int, str, int, str, float]] = field(default_factory=list)
    point_elements: list[Card] = field(default_factory=list)
    contact_cards: list[Card] = field(default_factory=list)
    others: dict[str, list[tuple[int, set[int]]]] = field(default_factory=dict)
    mass_factor: float = 1.0


def holds_solids(path: Path) -> bool:
    """Whether bulk data has elements that are read as a mesh."""
    return any(name in SOLIDS for _, name, _ in cards(read_bytes(path).decode("latin-1"), ()))


def read_bulk_mesh(path: Path, constraints: int | None = None) -> Deck:
    """Mesh of a bulk data file; materials by element set "property <number>".

    ``constraints`` is the SPC set in force, instead of the one that the case control asks for.

    Raises
    ------
    InputError
        For damaged cards, included files, superelements, no solid element, several sets of supports or equations of
        which the case control chooses none. What couples or holds otherwise is in the deck's ``couplings``.
    """
    data = read_bulk(path)
    text = read_bytes(path).decode("latin-1")
    deck = _cards(path, text, data.nodes)
    if not deck.elements:
        what = "has no solid element (CHEXA, CPENTA, CTETRA, CPYRAM)"
        raise refused(path.name, what, remedy="give the file with the mesh")
    deck.materials, faults = _materials(deck, path)
    deck.material_faults += faults
    points = points_of(data, path.name)
    lumped, turning = lumped_of(deck, deck.point_elements, points, deck.solid_nodes, deck.mass_factor)
    deck.lumped += lumped
    tied = list(coupled_equations(data.coupled, points, data.mpc))
    turning |= {node for equation in tied for node, axis in equation.pairs if axis > 2}
    number = selected(text, "SPC") if constraints is None else constraints
    deck.held, along = _supports(data, number, path, turning)
    deck.equate([*tied, *along])
    mesh = deck.mesh = Contacts(deck, data, deck.contact_cards, text).placed(deck.build())
    _keep_loads(deck, data, text)
    deck.extra += [*_left_out(deck, path), *unit_notes(mesh, deck.materials)]
    deck.axes = {node: axes.T for node, axes in data.directions.items()}
    return deck


def _cards(path: Path, text: str, nodes: Mapping[int, Array]) -> Cards:
    deck = Cards(source=path.name, nodes=dict(nodes))
    others = {name for _, name, _ in cards(text, ()) if is_other_element(name)}
    readers = {name: entry.read for name, entry in MESH_CARDS.items() if entry.read is not None}
    for line, name, fields in cards(text, {*readers, *others}):
        with reading(where := Place(path.name, f"line {line}", name)):
            if name in readers:
                readers[name](deck, where, line, fields)
            elif name in others:
                used = {int(word) for word in fields[2:] if word.isdigit()}
                deck.others.setdefault(name, []).append((line, used))
            else:
                classify_mesh_card(deck, name, line)
    deck.refuse_incomplete()
    solid = deck.solid_nodes
    for name, members in deck.others.items():
        near = [line for line, used in members if not solid.isdisjoint(used)]
        if near:
            what = "shares nodes with solids: the stiffness and mass it adds are not read"
            for line in near:
                deck.add(Verdict.COUPLING, name, what, line)
    return deck


@MESH_CARDS.reads(" ".join(SOLIDS))
def _element(deck: Cards, where: Place, line: int, fields: list[str]) -> None:
    del line
    name = str(where[-1])
    label, group = whole_number(fields[0]), whole_number(fields[1] or fields[0])
    corners = [whole_number(word) if word else 0 for word in fields[2:]]
    while corners and not corners[-1]:
        corners.pop()
    size = next((n for n in sorted(SOLIDS[name]) if n >= len(corners)), 0)
    if not size:
        raise ValueError(f"{len(corners)} nodes")
    kind, order = SOLIDS[name][size]
    nodes = [*corners, *[0] * (size - len(corners))]
    foreign = "" if name in SAME else f"{name} of {ELEMENTS[kind].n_nodes} nodes"
    deck.element(kind, label, [nodes[at] for at in order], where, foreign)
    deck.element_sets.setdefault(f"property {group}", []).append(label)


@MESH_CARDS.reads("CONM2 CELAS1 CELAS2 CMASS2 PELAS")
def _point_mass_or_spring(deck: Cards, where: Place, line: int, fields: list[str]) -> None:
    deck.point_elements.append((str(where[-1]), line, fields))


@MESH_CARDS.reads(CONTACT_CARDS)
def _contact(deck: Cards, where: Place, line: int, fields: list[str]) -> None:
    deck.contact_cards.append((str(where[-1]), line, fields))


@MESH_CARDS.reads("PSOLID")
def _property(deck: Cards, where: Place, line: int, fields: list[str]) -> None:
    del where, line
    deck.property_numbers[whole_number(fields[0])] = whole_number(fields[1])


@MESH_CARDS.reads("MAT1")
def _material(deck: Cards, where: Place, line: int, fields: list[str]) -> None:
    young, shear, poisson, density = (fortran_real(word) if word else None for word in fields[1:5])
    if young is None or (shear is None and poisson is None):
        young = 2.0 * (1.0 + (poisson or 0.0)) * (shear or 0.0) if young is None else young
    ratio = poisson if poisson is not None else (young / (2.0 * shear) - 1.0 if shear else 0.0)
    known: dict[str, Any] = {"young": young, "poisson": ratio, "density": density or 0.0}
    expansion, reference = (fortran_real(word) if word else None for word in [*fields, "", ""][5:7])
    if expansion is not None or reference is not None:
        known |= {"expansion": expansion, "reference": reference or 0.0}
    deck.laws[whole_number(fields[0])] = known
    if any(fortran_real(word) for word in fields[7:8] if word):
        what = "has structural damping (GE), which is not read; give the structure's loss_factor"
        deck.add(Verdict.APPROXIMATED, str(where[-1]), what, line)


@MESH_CARDS.reads("MATT1")
def _by_temperature(deck: Cards, where: Place, line: int, fields: list[str]) -> None:
    del where
    deck.by_temperature[whole_number(fields[0])] = line, [*fields[1:], *[""] * 6]


@MESH_CARDS.reads("TABLEM1")
def _table(deck: Cards, where: Place, line: int, fields: list[str]) -> None:
    """A number and its axes, then pairs; a pair with SKIP is left out, and ENDT ends it."""
    del where, line
    if {word.upper() for word in fields[1:3]} <= {"", "LINEAR"}:
        words = [word.upper() for word in fields[8:]]
        words = words[: words.index("ENDT")] if "ENDT" in words else [word for word in words if word]
        pairs = [pair for pair in zip(words[::2], words[1::2], strict=False) if "SKIP" not in pair]
        deck.tables[whole_number(fields[0])] = [(fortran_real(at), fortran_real(value)) for at, value in pairs]


_TABULATED = {0: "young", 2: "poisson", 4: "expansion"}
"""Properties by their field of MATT1."""


def _with_tables(deck: Cards, number: int, known: dict[str, Any]) -> dict[str, Any]:
    """The properties of a material with the tables over temperature that MATT1 names; what is not read is told."""
    line, fields = deck.by_temperature.get(number, (0, []))
    for place, word in enumerate(fields):
        table = deck.tables.get(whole_number(word)) if word and word.isdigit() and int(word) else None
        if table and len(table) > 1 and place in _TABULATED:
            known = {**known, _TABULATED[place]: table}
        elif word and word != "0":
            what = (
                "lets a material depend on temperature otherwise than E, NU, A by TABLEM1: those numbers of its MAT1 "
            )
            deck.add(Verdict.APPROXIMATED, "MATT1", f"{what}are used", line)
    if isinstance(known.get("expansion"), list) and "reference" not in known:
        known = {**known, "reference": 0.0}
    return known


@MESH_CARDS.reads("TEMP TEMPD")
def _temperature(deck: Cards, where: Place, line: int, fields: list[str]) -> None:
    """TEMP: a set, then points and values; TEMPD: sets and the values of all other points."""
    del line
    words = [*fields, ""]
    if where[-1] == "TEMPD":
        for number, value in zip(words[:8:2], words[1:8:2], strict=False):
            if number:
                load = StepLoad(kind="temperature", where="", value=fortran_real(value))
                deck.kept_loads.setdefault(f"TEMP {whole_number(number)}", []).insert(0, load)
        return
    for node, value in zip(words[1:7:2], words[2:8:2], strict=False):
        if node:
            load = StepLoad(kind="temperature", where=str(whole_number(node)), value=fortran_real(value))
            deck.kept_loads.setdefault(f"TEMP {whole_number(words[0])}", []).append(load)


@MESH_CARDS.reads("SPCD")
def _moved(deck: Cards, where: Place, line: int, fields: list[str]) -> None:
    """A set, then points, directions and values."""
    words = [*fields, *[""] * 4]
    for node, directions, value in (words[1:4], words[4:7]):
        if node:
            moved = fortran_real(value) if value else 0.0
            deck.moved.append((line, f"{where[-1]} {whole_number(words[0])}", whole_number(node), directions, moved))


def _keep_loads(deck: Cards, data: BulkData, text: str) -> None:
    """Put displacements and temperatures into load steps by the name of their set."""
    moved = [(line, f"SPC {number}", node, axes, value) for line, number, node, axes, value in data.moved]
    for line, name, node, directions, value in [*moved, *deck.moved]:
        if node in data.directions or not set(directions) <= set("123"):
            deck.add(Verdict.COUPLING, name.split()[0], MOVED, line)
            continue
        deck.kept_loads.setdefault(name, []).extend(
            StepLoad(kind="displacement", where=str(node), value=value, axis=int(axis)) for axis in directions
        )
    head = re.split(r"(?im)^\s*BEGIN\b", text, maxsplit=1)[0]
    initial = {f"TEMP {number}" for number in re.findall(_INITIAL, head)}
    for name, loads in deck.kept_loads.items():
        alone = tuple(replace(load, replaces=True) for load in loads)  # sets do not add up
        step = LoadStep(procedure="" if name in initial else "static", loads=alone)
        deck.load_steps[INITIAL if name in initial and len(initial) == 1 else name] = step
    deck.extra += kept_note(deck)


_INITIAL = r"(?im)^\s*TEMP(?:ERATURE)?\s*\(\s*INIT(?:IAL)?\s*\)\s*=\s*(\d+)"
"""The case control asks for the temperatures without stress."""


@MESH_CARDS.reads("PARAM")
def _parameter(deck: Cards, where: Place, line: int, fields: list[str]) -> None:
    del where
    if fields[0].upper() == "WTMASS":
        deck.mass_factor = fortran_real(fields[1])
    else:
        deck.add(Verdict.HARMLESS, f"PARAM,{fields[0].upper()}", "", line)


def _materials(deck: Cards, path: Path) -> tuple[dict[str, Material], tuple[Fault, ...]]:
    """Materials by element set, and what is wrong with those that properties use."""
    materials: dict[str, Material] = {}
    faults: list[Fault] = []
    for group in sorted(int(name.split()[1]) for name in deck.element_sets):
        number = deck.property_numbers.get(group)
        known = deck.laws.get(number) if number is not None else None
        if known is None:
            lacks = "has no PSOLID" if number is None else f"names material {number}, which is no MAT1 (isotropic)"
            faults.append(Fault(Place(path.name, f"property {group}"), lacks))
            continue
        try:
            assert number is not None
            scaled = {**_with_tables(deck, number, known), "density": known["density"] * deck.mass_factor}
            materials[f"property {group}"] = Material(**scaled)
        except InputError as error:
            faults += [fault.inside(path.name, f"material {number}") for fault in error.faults]
    return materials, tuple(faults)


def _supports(
    data: BulkData, number: int | None, path: Path, turning: set[int]
) -> tuple[set[tuple[int, int]], list[NodalEquation]]:
    """Supports, also along directions of points; of rotations those that take part."""
    held = chosen_supports(data, number, path)
    meant = {(node, axis) for node, axis in held if axis < 3 or node in turning}
    return supports(meant, {node: axes.T for node, axes in data.directions.items()}, Place(path.name, "SPC"))


def _left_out(deck: Cards, path: Path) -> Iterator[str]:
    if deck.others:
        counts = ", ".join(f"{len(part)} {name}" for name, part in deck.others.items())
        yield f"{path.name}: elements that are no solids were left out: {counts}"
    if deck.mass_factor != 1.0:
        yield f"{path.name}: densities and masses are multiplied by PARAM,WTMASS = {deck.mass_factor:.6g}"


def lumped_of(
    findings: Findings, point_cards: Sequence[Card], points: Points, solid: set[int], factor: float
) -> tuple[tuple[Lumped, ...], set[int]]:
    """Masses and springs, and the points whose rotations take part; ``factor`` multiplies masses (PARAM,WTMASS).

    Raises
    ------
    InputError
        For cards that cannot be read, and points or properties that are not there.
    """
    stiffness = {
        whole_number(f[i]): fortran_real(f[i + 1]) for n, _, f in point_cards if n == "PELAS" for i in (0, 4) if f[i]
    }
    parts: list[Lumped] = []
    for name, line, fields in point_cards:
        where = Place(points.source, f"line {line}", name)
        with reading(where):
            if name == "CONM2":
                parts += _mass(findings, [*fields, *[""] * 16], line, points, solid, factor, where)
            elif name != "PELAS":
                parts += _scalar(name, fields, points, stiffness, factor, where)
    return tuple(parts), {node for part in parts for node, axis in part.pairs if axis > 2}


def _mass(
    findings: Findings, fields: Sequence[str], line: int, points: Points, solid: set[int], factor: float, where: Place
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
    name: str, fields: Sequence[str], points: Points, stiffness: Mapping[int, float], factor: float, where: Place
) -> Iterator[Lumped]:
    """CELAS1: number, property, then "point, direction" twice; CELAS2, CMASS2: number, value, and the same."""
    if name == "CELAS1":
        number = whole_number(fields[1] or fields[0])
        if number not in stiffness:
            raise refused(where, f"names the property PELAS {number}, which is not in the file")
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
            raise refused(where, f"joins the scalar point {node}, which is not read")
    along = np.array([cosine for _, _, cosine in terms])
    pairs = tuple((n, c) for n, c, _ in terms)
    yield Lumped(matrix="M" if name == "CMASS2" else "K", pairs=pairs, values=value * np.outer(along, along))
