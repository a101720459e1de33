"""Input files of Abaqus and CalculiX (.inp): nodes, elements, sets, surfaces, materials, supports, masses, springs.

Every keyword is read here, or has a verdict in keywords.py, or is named as not understood.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.equations import rectangular
from slipstick.fem.lumped import Lumped, axial_spring, point_mass, spring
from slipstick.importers.abaqus.content import Content, Section, named
from slipstick.importers.abaqus.couplings import read_axes, unfinished_coupling
from slipstick.importers.abaqus.interfaces import bolt_nodes
from slipstick.importers.abaqus.keywords import (
    KEYWORDS,
    LAWS,
    LOADING,
    OTHER_SECTIONS,
    Block,
    ElementType,
    Placement,
    blocks,
    solid_type,
    whole_text,
)
from slipstick.importers.abaqus.loads import bolt_motion, moved_support
from slipstick.importers.abaqus.parts import flat
from slipstick.importers.abaqus.ties import about_diameters
from slipstick.importers.findings import Entry, Verdict, refused
from slipstick.importers.text_numbers import fortran_real, whole_number


def _lumped_elements(content: Content, block: Block) -> Iterator[tuple[str, int, list[int]]]:
    """Type, label and nodes of the elements of a section; they are marked as read."""
    chosen = set(content.element_sets[block.parameters["ELSET"]])
    for kind, table in content.skipped.items():
        for label, nodes in table.items():
            if label in chosen:
                missing = [node for node in nodes if node not in content.nodes]
                if missing:
                    raise KeyError(f"node {missing[0]}")
                content.read.add(label)
                yield kind, label, nodes


@KEYWORDS.reads("MASS", "ELSET TYPE", stage=2)
def on_mass(content: Content, block: Block) -> None:
    """One mass for each element of the set."""
    if "TYPE" in block.parameters and block.parameters["TYPE"] != "ISOTROPIC":
        content.note(Verdict.COUPLING, block, "gives a mass that depends on the direction")
        return
    mass = fortran_real(block.rows[0][0])
    for _, _, nodes in _lumped_elements(content, block):
        content.lumped += point_mass(nodes[0], mass)


@KEYWORDS.reads("ROTARYINERTIA", "ELSET ORIENTATION", stage=2)
def on_inertia(content: Content, block: Block) -> None:
    """I11, I22, I33, I12, I13, I23 about each node of the set."""
    if "ORIENTATION" in block.parameters:
        content.note(Verdict.COUPLING, block, "gives inertia along directions of its own")
        return
    values = [fortran_real(word) if word else 0.0 for word in block.rows[0]]
    xx, yy, zz, xy, xz, yz = [*values, *[0.0] * 6][:6]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    for _, _, nodes in _lumped_elements(content, block):
        content.turning.add(nodes[0])
        content.lumped += point_mass(nodes[0], 0.0, inertia)


@KEYWORDS.reads("SPRING", "COMPLEXSTIFFNESS ELSET NONLINEAR ORIENTATION", stage=2)
def on_spring(content: Content, block: Block) -> None:
    """SPRINGA along the line of its nodes, SPRING1 to ground, SPRING2 between two directions; linear ones."""
    if block.parameters.keys() & {"NONLINEAR", "ORIENTATION", "COMPLEXSTIFFNESS"} or len(block.rows) > 2:
        what = "gives springs that are not linear, depend on temperature or have directions of their own"
        content.note(Verdict.COUPLING, block, what)
        return
    stiffness = fortran_real(block.rows[-1][0])
    directions = [whole_number(word) - 1 for word in block.rows[0] if word] if len(block.rows) > 1 else []
    for kind, _, nodes in _lumped_elements(content, block):
        if kind == "SPRINGA":
            ends = (nodes[0], nodes[1])
            along = content.position(ends[1]) - content.position(ends[0])
            content.lumped.append(axial_spring(stiffness, ends, along, content.place(block.line)))
        else:
            content.lumped.append(_spring(kind, nodes, directions, stiffness))


def _spring(kind: str, nodes: list[int], directions: list[int], stiffness: float) -> Lumped:
    wanted = {"SPRING1": 1, "SPRING2": 2}.get(kind)
    if wanted is None or len(directions) != wanted or not all(0 <= d < 6 for d in directions):
        raise ValueError(f"elements of type {kind} with {len(directions)} directions")
    pairs = [*zip(nodes, directions, strict=False)]
    return spring(stiffness, *pairs)


@KEYWORDS.reads("DASHPOT", "ELSET", stage=2)
def on_dashpot(content: Content, block: Block) -> None:
    """Dashpots are damping, which is the structure's loss_factor or damping_ratio."""
    count = sum(1 for _ in _lumped_elements(content, block))
    what = f"gives damping to {count} dashpots, which is not read; give the structure's loss_factor or damping_ratio"
    content.note(Verdict.APPROXIMATED, block, what)


_INSTANCES = (
    'write a flat input file (Abaqus: Model, Edit Attributes, "Do not use parts and assemblies in input files")'
)


def read_content(path: Path) -> Content:
    """The entries of an input file.

    Raises
    ------
    InputError
        For damaged lines, unknown sets, elements given twice (with their line), and whatever leaves the mesh
        incomplete: includes, generated nodes, several parts without an assembly.
    """
    content = Content(path=path, source=path.name, flatten=_INSTANCES)
    late: list[Block] = []
    text = whole_text(path, content)
    for block in flat(text, blocks(text), content):
        if _entry(block).stage:
            late.append(block)
        else:
            _handle(content, block)
    content.refuse_incomplete()
    for block in sorted(late, key=lambda block: _entry(block).stage):
        _handle(content, block)
    unfinished_coupling(content)
    about_diameters(content)
    return content


def _entry(block: Block) -> Entry:
    return KEYWORDS.get(block.keyword, Entry(verdict=Verdict.UNKNOWN))


def _handle(content: Content, block: Block) -> None:
    entry = _entry(block)
    if entry.read is None:
        content.look_up(KEYWORDS, block.keyword, block.shown, block.line, of_the_model=not content.steps)
        return
    _parameters(content, block, entry)
    try:
        entry.read(content, block)
    except InputError:
        raise
    except KeyError as error:
        missing = str(error.args[0])
        lacks = missing in (entry.parameters or ())
        fault = f"lacks {missing}=" if lacks else f"names {missing}, which the file does not have"
        raise refused(content.place(block.line, block.shown), fault) from None
    except (ValueError, IndexError) as error:
        raise refused(content.place(block.line, block.shown), f"cannot be read ({error})") from None


def _parameters(content: Content, block: Block, entry: Entry) -> None:
    """Parameters that nobody reads are named; data in other files are refused."""
    if "INPUT" in block.parameters:
        content.note(Verdict.INCOMPLETE, block, "has its data in another file; merge the files into one")
    for name in block.parameters.keys() - (block.parameters.keys() if entry.parameters is None else entry.parameters):
        content.note(Verdict.APPROXIMATED, block, f"has the parameter {name}, which is not understood")


@KEYWORDS.reads("PART", "NAME")
def _part(content: Content, block: Block) -> None:
    content.parts += 1
    if content.parts > 1:
        content.note(Verdict.INCOMPLETE, block, f"begins a second part, whose labels are its own; {_INSTANCES}")


@KEYWORDS.reads("INSTANCE", "NAME PART")
@KEYWORDS.reads("ENDINSTANCE ENDPART", "")
def _instance(content: Content, block: Block) -> None:
    """What follows has a part of its own (parts.py), and no *SYSTEM yet."""
    del block
    content.system = None


@KEYWORDS.reads("SYSTEM", "")
def _system(content: Content, block: Block) -> None:
    """Origin and a point of the x axis, then one of the x-y plane; without that z stays; without lines it ends."""
    values = [fortran_real(word) if word else 0.0 for row in block.rows[:2] for word in row]
    origin, along, across = (np.array(values[i : i + 3]) for i in (0, 3, 6))
    if len(values) not in (0, 3, 6, 9):
        raise ValueError(f"{len(values)} numbers; expected three for each point")
    content.system = Placement(turn=np.eye(3), shift=origin) if len(values) else None
    if len(values) > 3:
        x = along - origin
        y = across - origin if len(values) == 9 else np.cross([0.0, 0.0, 1.0], x)
        if len(values) == 6 and abs(x[2]) > 1e-6 * np.linalg.norm(x):
            raise ValueError("an x axis that leaves the x-y plane, without a third point")
        content.system = Placement(turn=rectangular(x, y).T, shift=origin)


@KEYWORDS.reads("NODE", "INPUT NSET SYSTEM")
def _node(content: Content, block: Block) -> None:
    kind = block.parameters.get("SYSTEM", "R")[:1]
    if kind not in ("R", "C"):
        content.note(Verdict.INCOMPLETE, block, "gives spherical coordinates; write rectangular or cylindrical ones")
    motions = [motion for motion in (content.system, block.placement) if motion is not None]
    labels = []
    for line, row in zip(block.lines, block.rows, strict=True):
        if len(row) > 4 and all(word.lstrip("+-").isdigit() for word in row):
            raise ValueError(f"line {line} has {len(row)} whole numbers; expected a label and x, y, z with points")
        x, y, z = ([fortran_real(word) if word else 0.0 for word in row[1:4]] + [0.0] * 3)[:3]
        label = whole_number(row[0])
        if kind == "C":
            x, y = x * np.cos(np.deg2rad(y)), x * np.sin(np.deg2rad(y))
        for motion in motions:
            x, y, z = motion.place(np.array([x, y, z])).tolist()
        if content.nodes.setdefault(label, (x, y, z)) != (x, y, z):
            raise refused(content.place(line), f"node {label} is given again at another place", remedy=_INSTANCES)
        labels.append(label)
    if "NSET" in block.parameters:
        content.node_sets.setdefault(block.parameters["NSET"], []).extend(labels)


@KEYWORDS.reads("ELEMENT", "ELSET INPUT TYPE")
def _element(content: Content, block: Block) -> None:
    name = block.parameters["TYPE"]
    solid = solid_type(name)
    labels = _skipped(content, block, name) if solid is None else _solids(content, block, name, solid)
    if "ELSET" in block.parameters:
        content.element_sets.setdefault(block.parameters["ELSET"], []).extend(labels)


def _skipped(content: Content, block: Block, name: str) -> list[int]:
    elements = {whole_number(words[0]): [*map(whole_number, words[1:])] for _, words in block.joined() if words}
    content.skipped.setdefault(name, {}).update(elements)
    return list(elements)


def _solids(content: Content, block: Block, name: str, solid: ElementType) -> list[int]:
    words = [whole_number(word) for row in block.rows for word in row if word]
    width = 1 + ELEMENTS[solid.kind].n_nodes
    if len(words) % width:
        raise ValueError(f"{len(words)} numbers for elements of {width - 1} nodes")
    where = content.place(block.line)
    for at in range(0, len(words), width):
        nodes = words[at + 1 : at + width]
        content.element(solid.kind, words[at], nodes, where, "" if solid.same else name)
    return words[::width]


@KEYWORDS.reads("NSET", "ELSET GENERATE INSTANCE INTERNAL NSET UNSORTED")
def _nset(content: Content, block: Block) -> None:
    members = _members(block, content.node_sets)
    if "ELSET" in block.parameters:
        chosen = set(content.element_sets[block.parameters["ELSET"]])
        members = [n for table in content.elements.values() for e, row in table.items() if e in chosen for n in row]
    content.node_sets.setdefault(block.parameters["NSET"], []).extend(members)


@KEYWORDS.reads("ELSET", "ELSET GENERATE INSTANCE INTERNAL UNSORTED")
def _elset(content: Content, block: Block) -> None:
    content.element_sets.setdefault(block.parameters["ELSET"], []).extend(_members(block, content.element_sets))


def _members(block: Block, sets: dict[str, list[int]]) -> list[int]:
    if "GENERATE" in block.parameters:
        members: list[int] = []
        for row in block.rows:
            first, last, step = (
                whole_number(row[0]),
                whole_number(row[1]),
                whole_number(row[2]) if len(row) > 2 and row[2] else 1,
            )
            if step <= 0 or (last - first) // step > 50_000_000:
                raise ValueError(f"range {first}, {last}, {step}")
            members += range(first, last + 1, step)
        return members
    return [label for row in block.rows for word in row if word for label in named(word, sets)]


@KEYWORDS.reads("SURFACE", "COMBINE INTERNAL NAME TYPE")
def _surface(content: Content, block: Block) -> None:
    name = block.parameters["NAME"]
    kind = block.parameters.get("TYPE", "ELEMENT")
    if kind == "NODE":
        content.node_sets[name] = [n for row in block.rows for n in named(row[0], content.node_sets)]
    elif block.parameters.get("COMBINE", "") == "UNION":
        parts = [word.replace('"', "").upper() for row in block.rows for word in row if word]
        content.surfaces[name] = [row for part in parts for row in content.surfaces[part]]
    elif kind == "ELEMENT" and block.rows and "COMBINE" not in block.parameters:
        content.surfaces[name] = [*zip(block.lines, block.rows, strict=True)]
    else:
        what = block.parameters.get("COMBINE", f"TYPE={kind}")
        content.note(Verdict.APPROXIMATED, block, f"{name} of {what} is left out")


@KEYWORDS.reads("MATERIAL", "NAME RTOL")
def _material(content: Content, block: Block) -> None:
    content.material = block.parameters["NAME"]
    content.properties[content.material] = {}


@KEYWORDS.reads("ELASTIC CONDUCTIVITY", "TYPE")
@KEYWORDS.reads("DENSITY", "")
@KEYWORDS.reads("EXPANSION", "TYPE ZERO USER DEPENDENCIES")
def _property(content: Content, block: Block) -> None:
    if not content.material:
        raise ValueError("no *MATERIAL stands before it")
    rows = [[fortran_real(word) if word else 0.0 for word in row] for row in block.rows]
    table = content.properties[content.material]
    width = 2 if block.keyword == "ELASTIC" else 1
    isotropic = block.parameters.get("TYPE", "ISO") in ("ISO", "ISOTROPIC")
    varies = any(row[:width] != rows[0][:width] for row in rows)
    by_temperature = all(len(row) == width + 1 for row in rows)
    if block.keyword == "EXPANSION":
        if not isotropic or not rows or "USER" in block.parameters or (varies and not by_temperature):
            what = "depends on direction, on fields or on a routine and is not read; give expansion in the case"
            content.note(Verdict.APPROXIMATED, block, what)
            return
        table["expansion"] = [(row[1], row[0]) for row in rows] if varies else rows[0][0]
        table["reference"] = fortran_real(block.parameters.get("ZERO", "0"))
        return
    if block.keyword == "ELASTIC" and isotropic and varies and by_temperature:
        for place, name in enumerate(("young", "poisson")):
            of_name = [(row[2], row[place]) for row in rows]
            table[name] = of_name if any(value != rows[0][place] for _, value in of_name) else rows[0][place]
        return
    if block.keyword == "CONDUCTIVITY" and (varies or not isotropic):
        what = "depends on temperature or direction and is not read; give conductivity in the case"
        content.note(Verdict.APPROXIMATED, block, what)
    elif not isotropic:
        _law(content, block)
    elif varies:
        what = "depends on fields" if block.keyword == "ELASTIC" else "depends on temperature or fields"
        _fault(content, block, f"{what}; keep the line that holds at your temperature")
    elif block.keyword == "ELASTIC":
        table["young"], table["poisson"] = rows[0][:2]
        if len(block.rows) == 1 and len(block.rows[0]) == 3 and block.rows[0][1] == "0":
            what = f"has Poisson's ratio 0 at a temperature of {block.rows[0][2]}: is it a decimal comma?"
            content.note(Verdict.APPROXIMATED, block, what)
    else:
        table[block.keyword.lower()] = rows[0][0]


@KEYWORDS.reads(LAWS)
def _law(content: Content, block: Block) -> None:
    kind = f", TYPE={block.parameters['TYPE']}," if "TYPE" in block.parameters else ""
    _fault(content, block, f"is not isotropic elasticity{kind}".rstrip(","))


def _fault(content: Content, block: Block, what: str) -> None:
    fault = Fault(content.place(block.line, f"{block.shown} of material {content.material}"), what)
    content.law_faults.setdefault(content.material, []).append(fault)


@KEYWORDS.reads("SOLIDSECTION", "COMPOSITE CONTROLS ELSET MATERIAL NODALTHICKNESS ORIENTATION")
@KEYWORDS.reads(OTHER_SECTIONS)
def _section(content: Content, block: Block) -> None:
    if "COMPOSITE" in block.parameters:
        content.note(Verdict.COUPLING, block, "lays up layers of materials")
    section = Section(
        elements=block.parameters["ELSET"],
        material=block.parameters.get("MATERIAL", "(none)"),
        line=block.line,
        shown=block.shown,
    )
    (content.sections if block.keyword == "SOLIDSECTION" else content.other_sections).append(section)


@KEYWORDS.reads("SECTIONCONTROLS HOURGLASSSTIFFNESS", stage=3)
def _hourglass(content: Content, block: Block) -> None:
    """Another hourglass stiffness than the default one, where the file has elements that need some."""
    asked = block.keyword == "HOURGLASSSTIFFNESS" or block.parameters.get("HOURGLASS", "STIFFNESS") != "STIFFNESS"
    scaled = any(word and fortran_real(word) != 1.0 for row in block.rows[:1] for word in row[:3])
    if (asked or scaled) and content.elements.get("hex8r"):
        what = "asks for another hourglass stiffness, which is left out: C3D8R has the default one, 0.005 G"
        content.note(Verdict.APPROXIMATED, block, what)
    else:
        content.note(Verdict.HARMLESS, block)


@KEYWORDS.reads("STEP")
def _step(content: Content, block: Block) -> None:
    """A step about the loaded state of an earlier one is stiffened by its stress."""
    if "PERTURBATION" in block.parameters and content.loaded:
        what = "vibrates about the loaded state of the step before: its stiffening by stress and rotation is left out"
        content.note(Verdict.APPROXIMATED, block, what)
    content.steps.append(block.parameters)
    content.step_lines.append(block.line)


@KEYWORDS.reads(LOADING)
def _loading(content: Content, block: Block) -> None:
    """A procedure that leaves the model loaded, unless its step is one of small motions or says otherwise."""
    step = content.steps[-1] if content.steps else {}
    content.procedures[len(content.steps)] = block.shown[1:].lower()
    content.loaded |= "PERTURBATION" not in step and step.get("NLGEOM") != "NO"
    content.note(Verdict.HARMLESS, block)


@KEYWORDS.reads("FREQUENCY")
def _frequency(content: Content, block: Block) -> None:
    """In Abaqus always about the state of the step before; in CalculiX only in a step of small motions."""
    content.procedures[len(content.steps)] = block.shown[1:].lower()
    large = any(step.get("NLGEOM", "NO") != "NO" for step in content.steps)
    if content.loaded and large and "PERTURBATION" not in content.steps[-1]:
        what = "is computed about the unloaded state; in Abaqus the step before, with NLGEOM, stiffens the structure"
        content.note(Verdict.APPROXIMATED, block, what)
    else:
        content.note(Verdict.HARMLESS, block)


@KEYWORDS.reads("TRANSFORM", "NSET TYPE", stage=1)
def _transform(content: Content, block: Block) -> None:
    axes = read_axes([word for row in block.rows for word in row], block.parameters.get("TYPE", "R"), block.placement)
    for node in content.node_sets[block.parameters["NSET"]]:
        if node in content.nodes:
            content.turned[node] = axes


@KEYWORDS.reads("BOUNDARY", "AMPLITUDE FIXED LOADCASE OP REGIONTYPE STEP SUBMODEL TIMEDELAY TYPE USER", stage=2)
def _boundary(content: Content, block: Block) -> None:
    parameters = block.parameters
    if parameters.get("OP") == "NEW" and content.held:
        content.note(Verdict.COUPLING, block, "takes away the supports given before (OP=NEW)")
    if parameters.keys() & {"USER", "SUBMODEL"} or parameters.get("TYPE", "DISPLACEMENT") != "DISPLACEMENT":
        content.note(Verdict.COUPLING, block, "moves nodes by a routine, another model, a velocity or an acceleration")
    bolts = bolt_nodes(content)
    for line, row in zip(block.lines, block.rows, strict=True):
        nodes = [node for node in named(row[0], content.node_sets) if node in content.nodes]
        if not nodes and row[0].isdigit():
            raise KeyError(f"node {row[0]}")
        if {*nodes} <= bolts and nodes:
            content.note(Verdict.HARMLESS, block)
            bolt_motion(content, block, line, row, fortran_real(row[3]) if len(row) > 3 and row[3] else 0.0)
            continue
        axes = [axis - 1 for axis in _directions(row) if 1 <= axis <= 6]
        value = fortran_real(row[3]) if len(row) > 3 and row[3] else 0.0
        if axes and "FIXED" not in parameters:
            turned = any(node in content.turned for node in nodes)
            in_step = bisect_right(content.step_lines, line) > 0
            if value and (turned or not in_step or max(axes) > 2):
                what = "prescribes a displacement that is not 0"
                why = (
                    "along a node's own axes" if turned else "before the first step" if not in_step else "of a rotation"
                )
                content.add(Verdict.COUPLING, block.shown, f"{what}, {why}", line)
            elif value or any(load.kind == "displacement" for _, load in content.loads):
                moved_support(content, block, line, row, axes, value)
        content.held |= {(node, axis) for node in nodes for axis in axes}


_NAMED = {
    "ENCASTRE": (1, 2, 3, 4, 5, 6),
    "PINNED": (1, 2, 3),
    "XSYMM": (1, 5, 6),
    "YSYMM": (2, 4, 6),
    "ZSYMM": (3, 4, 5),
    "XASYMM": (2, 3, 4),
    "YASYMM": (1, 3, 5),
    "ZASYMM": (1, 2, 6),
}


def _directions(row: list[str]) -> tuple[int, ...]:
    """Directions from 1 of a line "node, first, last, value" or "node, ENCASTRE".

    >>> _directions(["TIP", "2", "3"]), _directions(["TIP", "XASYMM"])
    ((2, 3), (2, 3, 4))
    """
    if row[1].upper() in _NAMED:
        return _NAMED[row[1].upper()]
    first = whole_number(row[1])
    last = whole_number(row[2]) if len(row) > 2 and row[2] else first
    if last - first > 1000:
        raise ValueError(f"directions {first} to {last}")
    return tuple(range(first, last + 1))
