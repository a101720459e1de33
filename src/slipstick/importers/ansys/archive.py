"""Meshes from Ansys archives (.cdb, CDWRITE): nodes, solid elements, components, linear materials, supports.

Nodes, elements and components come from ``mapdl-archive``. Bricks may be degenerate: Ansys writes a wedge as a brick
with K = L and O = P, a pyramid with M = N = O = P, a tetrahedron with both. Materials must be isotropic.
CYCLIC gives the number of sectors, the coordinate system of the axis and the components of the two faces. Contacts and
bolts stand in interfaces.py.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.axis import Axis
from slipstick.fem.cyclic import CyclicSymmetry
from slipstick.fem.equations import NodalEquation, in_global, supports
from slipstick.fem.extras import require
from slipstick.fem.load_steps import LoadStep, StepLoad
from slipstick.fem.materials import TABULATED, Material
from slipstick.fem.unit_systems import NOT_STATED
from slipstick.importers.ansys.commands import COMMANDS, classify_commands, commands
from slipstick.importers.ansys.couplings import Lumps, read_equations
from slipstick.importers.ansys.interfaces import INTERFACES, Interfaces, read_friction
from slipstick.importers.deck import Deck, with_surfaces
from slipstick.importers.findings import DAMAGED, Coupling, Findings, Verdict, refused
from slipstick.importers.interfaces import kept_note
from slipstick.importers.mesh_checks import unit_notes
from slipstick.importers.midsides import whole_row
from slipstick.importers.text_numbers import fortran_real, read_bytes, reading, whole_number
from slipstick.typing import Array

_HEAD = 10
"""Numbers of an EBLOCK row before its nodes: material, type, ..., element number, one more."""
_SHAPES = {
    8: {
        "hex8": range(8),
        "wedge6": (0, 1, 2, 4, 5, 6),
        "pyramid5": range(5),
        "tet4": (0, 1, 2, 4),
    },
    20: {
        "hex20": range(20),
        "wedge15": (0, 1, 2, 4, 5, 6, 8, 9, 11, 12, 13, 15, 16, 17, 18),
        "pyramid13": (0, 1, 2, 3, 4, 8, 9, 10, 11, 16, 17, 18, 19),
        "tet10": (0, 1, 2, 4, 8, 9, 11, 16, 17, 18),
    },
}
_TETRAHEDRA = {4: "tet4", 10: "tet10"}


@dataclass(frozen=True, kw_only=True)
class ElementType:
    """An element type by its number.

    ``solid``; ``quadratic`` ones may lack middle nodes; ``option`` is the KEYOPT that changes their integration: values
    for which it is as here (``same``; with ``reduced`` as of our hex20r or hex8r). Of the others:
    ``ignored`` ones add nothing, ``point`` ones are masses and springs.
    """

    name: str
    solid: bool = False
    quadratic: bool = False
    option: int = 0
    same: tuple[int, ...] = ()
    reduced: tuple[int, ...] = ()
    ignored: bool = False
    point: bool = False


def _named(family: str, *numbers: int, **what: Any) -> dict[int, ElementType]:
    return {number: ElementType(name=f"{family}{number}", **what) for number in numbers}


ELEMENT_TYPES: dict[int, ElementType] = {
    **_named("SOLID", 45, solid=True, option=1),
    **_named("SOLID", 64, 65, 73, 285, solid=True),
    **_named("SOLID", 92, 187, solid=True, same=(0,)),
    **_named("SOLID", 95, solid=True, quadratic=True, option=11, reduced=(1,)),
    **_named("SOLID", 185, solid=True, option=2, reduced=(1,)),
    **_named("SOLID", 186, solid=True, quadratic=True, option=2, same=(0, 1), reduced=(0,)),  # 14 points: as our 27
    **_named("SOLSH", 190, solid=True),
    **_named("MASS", 21, point=True),
    **_named("COMBIN", 14, point=True),
    **_named("MESH", 200, ignored=True, same=(0,)),
    **_named("SURF", 151, 152, 153, 154, 156, ignored=True),
    **_named("TARGE", 169, ignored=True),
    **_named("CONTA", 171, 172, 176, 177, 178),
    **_named("COMBIN", 37, 39, 40),
    **_named("MATRIX", 27, 50),
    **_named("LINK", 180),
    **_named("SHELL", 181, 281),
    **_named("MPC", 184),
    **_named("BEAM", 188, 189),
    **_named("COMBI", 214),
}
"""Known element types; elements of any other type add stiffness, mass or constraints and are not read."""

_MESH200_SOLID = {8, 9, 10, 11}
_UNITS = {"SI": "SI (m, kg, s)", "MKS": "m, kg, s", "CGS": "cm, g, s", "BIN": "inch, lbf, s", "BFT": "foot, slug, s"}
_UNITS |= {"MPA": "mm, tonne, s", "UMKS": "micrometre, kg, s"}


def read_archive(path: Path) -> Deck:
    """Mesh of a .cdb file with its node and element components; materials by element set "material <number>".

    Raises
    ------
    InputError
        If the extra is not installed, the file is damaged or has no solid element. What couples or holds otherwise is
        in the deck's ``couplings``.
    """
    reader = require("mapdl_archive", "mapdl-archive")
    text = read_bytes(path).decode("latin-1")
    _check_counts(text, path)
    archive = _parse(reader, path)
    labels, places = np.asarray(archive.nnum, dtype=np.int64), np.asarray(archive.nodes, dtype=float).reshape(-1, 3)
    deck = Deck(source=path.name, nodes=dict(zip(labels.tolist(), places, strict=True)))
    interfaces = Interfaces(deck, archive, text)
    skipped = _elements(deck, archive, interfaces.rows, path)
    used = {name: int(name.split()[1]) for name in deck.element_sets}
    deck.node_sets = {
        name: [interfaces.follow(node) for node in np.asarray(part).tolist()]
        for name, part in archive.node_components.items()
    }
    deck.element_sets |= {name: np.asarray(part).tolist() for name, part in archive.element_components.items()}
    deck.axes = _turned_nodes(text, path)
    interfaces.sections()
    bolts = {section.node for section in deck.pretension_sections.values()}
    moved: list[StepLoad] = []
    supported = {(interfaces.follow(n), c) for n, c in classify_commands(deck, text, bolts, deck.axes, moved)}
    _keep_loads(deck, text, moved)
    read = read_materials(deck, text)
    symmetry = read_cyclic(deck, text, deck.node_sets)
    deck.refuse_incomplete()
    known = {name: read.materials[number] for name, number in used.items() if number in read.materials}
    deck.materials = known if len(known) == len(used) else {}
    deck.material_faults = [fault for number in used.values() for fault in read.faults.get(number, ())]
    lumps = Lumps(deck, archive, text, interfaces.rows)
    deck.lumped += lumps
    tied = [_following(equation, interfaces) for equation in read_equations(deck, text)]
    _refuse_missing(tied, set(deck.nodes))
    turning = lumps.turning() | {node for equation in tied for node, axis in equation.pairs if axis > 2}
    meant = {(n, c) for n, c in supported if c < 3 or n in turning}
    deck.held, along = supports(meant, deck.axes, Place(path.name, "D"))
    deck.equate([*in_global(tied, deck.axes), *along])
    deck.mesh = interfaces.placed(with_surfaces(deck.build(), deck.node_sets), read_friction(deck, text))
    deck.units = _units(text)
    deck.elsewhere += _elements_that_matter(skipped, path)
    deck.extra += [*_left_out(skipped, path), *unit_notes(deck.mesh, known)]
    deck.symmetry = lambda _mesh: symmetry
    return deck


_NOT_SET = "_TINY"
"""What Ansys writes for a uniform temperature that nobody set."""


@COMMANDS.reads("BF BFUNIF TUNIF")
def _keep_loads(deck: Deck, text: str, moved: Sequence[StepLoad]) -> None:
    """Put displacements and the temperatures of nodes into the first load step."""
    rest, stated, nodal, blocks = 0.0, False, list[StepLoad](), 0
    for line, name, words in commands(text):
        with reading(Place(deck.source, f"line {line}", name)):
            words = [*words, *[""] * 4]
            if (name == "BFUNIF" and words[0].upper() == "TEMP") or name == "TUNIF":
                word = words[1] if name == "BFUNIF" else words[0]
                if word.upper() not in ("", _NOT_SET):
                    stated, rest = True, fortran_real(word)
            elif name == "BF" and words[1].upper() == "TEMP":
                if words[0].isdigit() and "%" not in words[2]:
                    nodal.append(StepLoad(kind="temperature", where=words[0], value=fortran_real(words[2] or "0")))
                else:
                    deck.add(Verdict.APPROXIMATED, name, "gives temperatures by a table or a name: not kept", line)
            elif name in ("BFBLOCK", "BFEBLOCK") or (name == "BFE" and words[1].upper() == "TEMP"):
                blocks = blocks or line
            elif name == "TREF" and not stated:
                rest = fortran_real(words[0] or "0")
    if blocks:
        deck.add(Verdict.APPROXIMATED, "BFBLOCK or BFE", "gives body loads that are not kept, as temperatures", blocks)
    everywhere = [StepLoad(kind="temperature", where="", value=rest)] if nodal or stated else []
    loads = [*moved, *everywhere, *nodal]
    if loads:
        before = deck.load_steps.get("STEP-1", LoadStep(procedure="static"))
        first = replace(before, loads=(*before.loads, *loads))
        deck.load_steps = {"STEP-1": first} | {n: s for n, s in deck.load_steps.items() if n != "STEP-1"}
    deck.extra += kept_note(deck)


def _following(equation: NodalEquation, interfaces: Interfaces) -> NodalEquation:
    """An equation on the nodes that are left where a bolt was cut."""
    return replace(equation, terms=tuple((interfaces.follow(n), axis, factor) for n, axis, factor in equation.terms))


def _known(kind: int) -> ElementType:
    return ELEMENT_TYPES.get(kind, ElementType(name=str(kind)))


def _left_out(skipped: dict[int, int], path: Path) -> Iterator[str]:
    for kind, count in skipped.items():
        if _known(kind).ignored:
            yield f"{path.name}: {count} elements of type {_known(kind).name} are no solids and were left out"


def _elements_that_matter(skipped: dict[int, int], path: Path) -> Iterator[Coupling]:
    for kind, count in skipped.items():
        if not _known(kind).ignored:
            name = _known(kind).name
            what = "add stiffness, mass or constraints and are not read"
            yield Coupling(where=Place(path.name, f"{count} elements of type {name}"), what=what)


def _refuse_missing(tied: Sequence[NodalEquation], labels: set[int]) -> None:
    """Nodes of CE and CP that the file does not have."""
    missing = {e.where: node for e in reversed(tied) for node, _ in e.pairs if node not in labels}
    if missing:
        raise InputError(
            [Fault(where, f"names node {node}, which the file does not have") for where, node in missing.items()]
        )


def _turned_nodes(text: str, path: Path) -> dict[int, Array]:
    """Axes (rows) of the nodes with rotation angles in an NBLOCK: the fourth to sixth real of their lines."""
    turned: dict[int, Array] = {}
    for block in re.finditer(
        r"^NBLOCK[^\r\n]*\r?\n\((\d+)i(\d+),\s*\d+[eEgG](\d+)[^\r\n]*\r?\n((?:[ \t]*\d[^\r\n]*\r?\n)*)",
        text,
        re.MULTILINE | re.IGNORECASE,
    ):
        integers, width, real = (int(block.group(i)) for i in (1, 2, 3))
        start = integers * width + 3 * real
        for line in block.group(4).splitlines():
            words = [line[at : at + real] for at in range(start, len(line.rstrip()), real)]
            with reading(Place(path.name, "NBLOCK, a line")):
                angles = [fortran_real(word) if word.strip() else 0.0 for word in words]
                if any(angles):
                    turned[whole_number(line[:width])] = _axes_of([*angles, 0.0, 0.0][:3])
    return turned


def _axes_of(angles: Sequence[float]) -> Array:
    """Axes (rows) of a node: turned by its angles (degrees) about z, then about the new x, then about the new y."""
    (a, b, c), (u, v, w) = np.cos(np.radians(angles)), np.sin(np.radians(angles))
    return np.array(
        [
            [a * c - u * v * w, u * c + a * v * w, -w * b],
            [-u * b, a * b, v],
            [a * w + u * v * c, u * w - a * v * c, b * c],
        ]
    )


def _parse(reader: Any, path: Path) -> Any:
    try:
        archive = reader.Archive(str(path), parse_vtk=False)
        sound = len(archive.nodes) and len(archive.nnum) == len(archive.nodes) and archive.n_elem
    except Exception:
        sound = False
    if not sound:
        raise refused(path.name, "has no readable node and element block", remedy="write it with CDWRITE,DB")
    return archive


def _check_counts(text: str, path: Path) -> None:
    """The compiled reader believes the counts of the blocks: they must fit the file, and blocks must end."""
    for block in re.finditer(r"^([NE]BLOCK),([^\r\n]*)\r?\n\(([^)\r\n]*)\)\r?\n", text, re.MULTILINE | re.IGNORECASE):
        words = [word.strip() for word in block.group(2).split("!")[0].split(",")]
        numbers = [int(word) for word in words[2:] if word.isdigit()]
        body = text[block.end() :]
        if block.group(1).upper() == "EBLOCK":
            end = re.search(r"^\s*-1\s*$", body, re.MULTILINE)
        else:
            end = re.search(r"^(?:N,R5\.\d,LOC,\s*-1|\s*-1\s*,?)", body, re.MULTILINE)
        lines = body[: end.start()].count("\n") if end else 0
        if end is None or (numbers and numbers[-1] > lines):
            raise refused(
                path.name,
                f"its {block.group(1).upper()} claims {numbers[-1] if numbers else 0} entries, "
                f"the file has {lines} lines there",
                remedy=DAMAGED,
            )
    for block in re.finditer(
        r"^CMBLOCK,([^,\r\n]*),[^,\r\n]*,\s*(\d+)[^\r\n]*\r?\n\([^\r\n]*\r?\n([-\s\d]*)", text, re.MULTILINE
    ):
        count = len(block.group(3).split())
        if count != int(block.group(2)):
            raise refused(
                path.name, f"component {block.group(1).strip()} claims {block.group(2)} numbers, the file has {count}"
            )


@COMMANDS.reads("NBLOCK EBLOCK CMBLOCK ET KEYOP KEYOPT RLBLOCK")
def _elements(deck: Deck, archive: Any, rows: Sequence[Sequence[int]], path: Path) -> dict[int, int]:
    """Add solids to element sets "material <number>"; the number of elements of each other type."""
    solid = dict(_solid_types(archive))
    skipped: dict[int, int] = {}
    types = {int(number): int(kind) for number, kind in np.asarray(archive.ekey)}
    where = Place(path.name, "EBLOCK")
    for row in rows:
        material, of, number = row[0], row[1], row[8]
        kind = types.get(of, 0)
        if of not in solid:
            if not _known(kind).point and kind not in INTERFACES:
                skipped[kind] = skipped.get(kind, 0) + 1
            continue
        known, option = _known(kind), solid[of]
        name, nodes = _shape(whole_row(row[_HEAD:], known.quadratic), number, path)
        name = f"{name}r" if name in ("hex8", "hex20") and option in known.reduced else name
        full = known.name + (f" with KEYOPT({known.option}) = {option}" if option else "")
        foreign = "" if option in known.same and name != "pyramid13" else full
        deck.element(name, number, nodes, where, foreign)
        deck.element_sets.setdefault(f"material {material}", []).append(number)
    if not deck.elements:
        solids = sorted(number for number, known in ELEMENT_TYPES.items() if known.solid)
        raise refused(path.name, f"has no solid element (types {solids} or MESH200 solids)")
    deck.element_sets = dict(sorted(deck.element_sets.items(), key=lambda item: int(item[0].split()[1])))
    return skipped


def _solid_types(archive: Any) -> Iterator[tuple[int, int]]:
    """Number of each solid element type, and the value of the option that changes its integration.

    Layered solids (KEYOPT(3) = 1 of 185 and 186) are not read.
    """
    for number, kind in np.asarray(archive.ekey).tolist():
        options = dict(tuple(pair[:2]) for pair in archive.key_option.get(number, []))
        layered = kind in (185, 186) and options.get(3) == 1
        if (_known(kind).solid and not layered) or (kind == 200 and options.get(1) in _MESH200_SOLID):
            yield number, options.get(_known(kind).option, 0)


def _shape(nodes: Sequence[int], number: int, path: Path) -> tuple[str, Sequence[int]]:
    """Element type and its nodes from a row of an EBLOCK, degenerate bricks recognised."""
    if len(nodes) in _TETRAHEDRA:
        name = _TETRAHEDRA[len(nodes)]
    elif len(nodes) in _SHAPES:
        k, l, m, n, o, p = nodes[2:8]  # noqa: E741 - the names of Ansys' element pictures
        flat, point = k == l, m == n == o == p
        wedge = flat and o == p and not point
        family = "tet" if flat and point else "pyramid" if point else "wedge" if wedge else "hex"
        name, local = next((s, list(at)) for s, at in _SHAPES[len(nodes)].items() if s.startswith(family))
        nodes = [nodes[at] for at in local]
    else:
        raise refused(path.name, f"element {number} has {len(nodes)} nodes", expected="a solid with 4, 8, 10 or 20")
    return name, nodes


@COMMANDS.reads("/UNITS")
def _units(text: str) -> str:
    match = re.search(r"^/UNITS,\s*(\w+)", text, re.MULTILINE | re.IGNORECASE)
    return _UNITS.get(match.group(1).upper(), match.group(1)) if match else NOT_STATED


_PROPERTIES = {
    "EX": "young", "NUXY": "poisson", "PRXY": "poisson", "DENS": "density", "KXX": "conductivity", "ALPX": "expansion",
    "REFT": "reference",
}  # fmt: skip
_EXPANSIONS = {"ALPX", "ALPY", "ALPZ"}
_INSTANTANEOUS = {"CTEX", "CTEY", "CTEZ", "THSX", "THSY", "THSZ"}
_OTHER_AXES = {"EY": "EX", "EZ": "EX", "NUYZ": "NUXY", "NUXZ": "NUXY", "PRYZ": "PRXY", "PRXZ": "PRXY"}
_DAMPING = {"DAMP", "ALPD", "BETD", "DMPR", "DMPS"}
_LAWS = {"ELAS", "ANEL", "HYPE", "AHYPER", "USER", "DENS", "PRONY", "SMA", "GASKET", "CONCR", "MPLANE"}
_UNUSED = {"CTE", "THERM", "FRIC", "FLUID", "PIEZ", "DPER", "SDAMP", "PERF", "FCON", "CGCR", "FATI", "STATE"}

Values = dict[tuple[int, str], list[float]]
Stated = dict[tuple[int, str], tuple[int, list[float]]]
"""Line of a property, and the temperatures of its values where the file has a table of them."""


@dataclass(frozen=True, kw_only=True)
class MaterialTable:
    """Materials by number, and for others what is wrong with them."""

    materials: Mapping[int, Material] = field(default_factory=dict)
    faults: Mapping[int, list[Fault]] = field(default_factory=dict)


@COMMANDS.reads("MP MPDATA MPTEMP TB TREF")
def read_materials(findings: Findings, text: str) -> MaterialTable:
    """Materials of the MP, MPDATA and TB commands; what is left out of them goes to ``findings``."""
    values: Values = {}
    stated: Stated = {}
    temperatures: list[float] = []
    reference = 0.0
    faults: dict[int, list[Fault]] = {}
    for line, name, words in commands(text):
        where = Place(findings.source, f"line {line}", name)
        with reading(where):
            if name == "MP":
                _property(findings, line, values, faults, where, words[0], words[1], words[2:])
                stated[int(words[1]), words[0].upper()] = line, []
            elif name == "MPDATA":
                at = 1 if words[0][:1].isalpha() else 0  # a release such as R5.0, or UNBL
                _property(
                    findings, line, values, faults, where, words[at + 1], words[at + 2], words[at + 4 :], table=True
                )
                stated[int(words[at + 2]), words[at + 1].upper()] = line, temperatures
            elif name == "MPTEMP":
                at = 2 if words[:1] and words[0][:1].isalpha() else 0
                first = whole_number(words[at]) if words[at : at + 1] and words[at] else 1
                temperatures = [*temperatures[: first - 1], *(fortran_real(word) for word in words[at + 1 :] if word)]
            elif name == "TREF":
                reference = fortran_real(words[0]) if words and words[0] else 0.0
            elif name == "TB":
                _table(findings, line, faults, where, words)
    materials: dict[int, Material] = {}
    for number in sorted({number for number, _ in values}):
        known = _constant(findings, values, stated, number, faults)
        if "expansion" in known:
            known = {"reference": reference, **known}
        else:
            known.pop("reference", None)
        try:
            if {"young", "poisson"} <= known.keys():
                materials[number] = Material(**known)
        except InputError as error:
            faults.setdefault(number, []).extend(
                fault.inside(findings.source, f"material {number}") for fault in error.faults
            )
    return MaterialTable(materials=materials, faults=faults)


def _property(
    findings: Findings,
    line: int,
    values: Values,
    faults: dict[int, list[Fault]],
    where: Place,
    label: str,
    number: str,
    words: list[str],
    *,
    table: bool = False,
) -> None:
    label, material = label.upper(), int(number)
    if label in _DAMPING:
        what = "damping is not read; give the structure's loss_factor or damping_ratio"
        findings.add(Verdict.APPROXIMATED, f"{label} of material {material}", what, line)
    if label in _INSTANTANEOUS:
        what = "is not read: give the secant coefficient ALPX, or expansion in the case"
        findings.add(Verdict.APPROXIMATED, f"{label} of material {material}", what, line)
    if label not in (*_PROPERTIES, *_OTHER_AXES, *_EXPANSIONS, "GXY", "GYZ", "GXZ"):
        return
    numbers = [fortran_real(word) for word in words if word]
    if not table and any(numbers[1:]):
        faults.setdefault(material, []).append(
            Fault(Place(*where[:-1], f"{where[-1]} of material {material}"), f"{label} depends on temperature")
        )
    values.setdefault((material, label), []).extend(numbers if table else numbers[:1])


def _table(findings: Findings, line: int, faults: dict[int, list[Fault]], where: Place, words: list[str]) -> None:
    law = words[0].upper()
    if any(law.startswith(name) for name in _LAWS):
        fault = Fault((*where, f"{law} of material {words[1]}"), "is not isotropic elasticity by MP")
        faults.setdefault(int(words[1]), []).append(fault)
    elif not any(law.startswith(name) for name in _UNUSED):
        what = "is left out: the structure is linear, its material elastic"
        findings.add(Verdict.APPROXIMATED, f"TB, {law} of material {words[1]}", what, line)


def _constant(
    findings: Findings,
    values: Values,
    stated: Stated,
    number: int,
    faults: dict[int, list[Fault]],
) -> dict[str, Any]:
    """The properties of one material, numbers or tables over temperature, where they are the same along every axis."""
    tables = {label: numbers for (material, label), numbers in values.items() if material == number and numbers}
    known: dict[str, Any] = {}
    wrong: list[str] = []
    alike = [tables[label] for label in ("ALPX", "ALPY", "ALPZ") if label in tables]
    if any(part != alike[0] for part in alike):
        what = "is not the same along every axis and is not read; give expansion in the case"
        first_line = min(stated[number, label][0] for label in _EXPANSIONS & tables.keys())
        findings.add(Verdict.APPROXIMATED, f"ALPX of material {number}", what, first_line)
        tables = {label: part for label, part in tables.items() if label not in _EXPANSIONS}
    for label, numbers in tables.items():
        line, at = stated[number, label]
        changes = len(set(numbers)) > 1
        if changes and _PROPERTIES.get(label, "") in TABULATED and len(at) == len(numbers):
            known[_PROPERTIES[label]] = [*zip(at, numbers, strict=True)]
            continue
        if changes and label in _OTHER_AXES and numbers == tables.get(_OTHER_AXES[label]):
            continue
        if changes and label in _EXPANSIONS:
            if label == "ALPX":
                findings.add(
                    Verdict.APPROXIMATED, f"ALPX of material {number}", "has no temperatures: it is not read", line
                )
            continue
        if changes:
            wrong.append(f"{label} depends on temperature ({numbers[0]:.6g} to {numbers[-1]:.6g})")
        first = tables.get(_OTHER_AXES.get(label, label), numbers)
        if first[0] != numbers[0]:
            wrong.append(f"{label} is {numbers[0]:.6g}, along x {first[0]:.6g}: not isotropic")
        if label in _PROPERTIES:
            known[_PROPERTIES[label]] = numbers[0]
    if all(isinstance(known.get(name), float) for name in ("young", "poisson")):
        shear = known["young"] / (2.0 * (1.0 + known["poisson"]))
        for label in ("GXY", "GYZ", "GXZ"):
            if label in tables and abs(tables[label][0] - shear) > 1e-3 * abs(shear):
                wrong.append(f"{label} is {tables[label][0]:.6g}, of an isotropic material {shear:.6g}: not isotropic")
    faults.setdefault(number, []).extend(Fault(Place(findings.source, f"material {number}"), what) for what in wrong)
    return known


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
