"""Contact pairs with their friction, pre-tension sections, and the dofs that a substructure retains."""

from __future__ import annotations

import numpy as np

from slipstick.errors import Fault, Place
from slipstick.fem.interfaces import WHOLE, PretensionSection, SurfacePair
from slipstick.fem.mesh import Mesh
from slipstick.importers.abaqus.content import Content, named, nodes_of
from slipstick.importers.abaqus.keywords import KEYWORDS, Block
from slipstick.importers.findings import Verdict, refused
from slipstick.importers.interfaces import APART
from slipstick.importers.text_numbers import fortran_real, whole_number

_FRICTION = "*FRICTION"
_VARIES = ("slip rate", "pressure", "temperature", "a field variable")
"""What a coefficient may depend on, by the columns after it."""
_LIMITED = {
    "TAUMAX": "limits the friction stress by TAUMAX, which is left out",
    "EXPONENTIALDECAY": "decays with the slip rate (EXPONENTIAL DECAY); the first coefficient, that at rest, is kept",
    "ANISOTROPIC": "differs with the direction (ANISOTROPIC); the first coefficient is kept",
}
"""Parameters under which the first number is not all."""


@KEYWORDS.reads("SURFACEINTERACTION", "DEPVAR NAME UNSYMM USER")
def on_interaction(content: Content, block: Block) -> None:
    """Properties by name; what they are stands in the next keywords."""
    content.interaction = block.parameters["NAME"]
    content.interactions.add(content.interaction)


@KEYWORDS.reads("SURFACEBEHAVIOR")
def on_behavior(content: Content, block: Block) -> None:
    """Pressure by overclosure: contact stiffness is the case's, but CalculiX glues surfaces by it too."""
    content.note(Verdict.HARMLESS, block)
    if block.parameters.get("PRESSURE-OVERCLOSURE") == "TIED":
        content.glued.add(content.interaction)


@KEYWORDS.reads("FRICTION")
def on_friction(content: Content, block: Block) -> None:
    """The coefficient of the interaction before it."""
    if not content.interaction:
        content.note(Verdict.HARMLESS, block)
        return
    if block.parameters.keys() & {"ROUGH", "USER"} or not block.rows:
        what = "gives no coefficient of friction (no number, ROUGH or USER): the contact pairs have none"
        content.note(Verdict.APPROXIMATED, block, what)
        return
    mu = fortran_real(block.rows[0][0]) if block.rows[0][0] else 0.0
    if not 0.0 <= mu < np.inf:
        raise ValueError(f"a coefficient of {mu:g}")
    for name, what in _LIMITED.items():
        if name in block.parameters:
            content.note(Verdict.APPROXIMATED, block, what)
    if "EXPONENTIALDECAY" not in block.parameters and (what := _varying(block)):
        content.note(Verdict.APPROXIMATED, block, what)
    content.friction[content.interaction] = mu


def _varying(block: Block) -> str:
    """What the coefficient of a table depends on, or which number beside a single one is not used; empty: nothing."""
    begin = 2 if "ANISOTROPIC" in block.parameters else 1
    columns = [[*row[begin:], *[""] * 4][:4] for row in block.rows]
    if len(block.rows) == 1:
        rate = columns[0][0]
        if rate and fortran_real(rate):
            return f"has {rate} beside its coefficient (slip rate, or stick slope of CalculiX), which is not used"
        return ""
    names = [name for name, column in zip(_VARIES, zip(*columns, strict=True), strict=True) if len({*column}) > 1]
    by = " and ".join(names) or "more than one line"
    return f"depends on {by}; the coefficient of its first line is kept"


@KEYWORDS.reads("CONTACTPAIR", stage=2)
def on_contact_pair(content: Content, block: Block) -> None:
    """A dependent and an independent surface on each line; one alone touches itself."""
    interaction = block.parameters.get("INTERACTION", "")
    if "TIED" in block.parameters or interaction in content.glued:
        content.note(Verdict.COUPLING, block, "glues surfaces together (TIED)")
        return
    if interaction and interaction not in content.interactions:
        raise refused(
            content.place(block.line, block.shown), f"names the interaction {interaction}, which the file does not have"
        )
    content.note(Verdict.APPROXIMATED, block, APART)
    for line, row in zip(block.lines, block.rows, strict=True):
        if not any(row):
            raise ValueError("expected two surfaces on a line")
        first, second = ([word.replace('"', "").upper() for word in row if word] * 2)[:2]
        pair = SurfacePair(
            dependent=first, independent=second, mu=content.friction.get(interaction), interaction=interaction,
            card=_FRICTION if interaction in content.friction else "",
        )  # fmt: skip
        content.pairs.append((pair, content.place(line, block.shown)))


def pairs_of(content: Content, mesh: Mesh) -> dict[str, SurfacePair]:
    """Contact pairs by the names of their surfaces.

    Raises
    ------
    InputError
        If a surface is not there.
    """
    found: dict[str, SurfacePair] = {}
    for pair, where in content.pairs:
        for name in (pair.dependent, pair.independent):
            nodes_of(content, mesh, name, where)
        name = f"{pair.dependent}/{pair.independent}"
        if found.setdefault(name, pair) != pair:
            what = f"gives {name} again with other properties ({pair.interaction}): those before are kept"
            content.own_warnings.append(str(Fault(where, what)))
    return found


@KEYWORDS.reads("PRE-TENSIONSECTION PRETENSIONSECTION", "ELEMENT NODE SURFACE", stage=1)
def on_pretension(content: Content, block: Block) -> None:
    """A section of faces (or a beam element) with its node; a line may give the normal."""
    where = content.place(block.line, block.shown)
    node = content.one_node(block.parameters["NODE"])
    name = block.parameters.get("SURFACE", block.parameters.get("ELEMENT", "")).replace('"', "").upper()
    if not name:
        raise KeyError("SURFACE")
    if name in content.pretension_sections:
        raise refused(where, f"gives the section {name} twice")
    normal = None
    if block.rows and any(block.rows[0]):
        x, y, z = ([fortran_real(word) if word else 0.0 for word in block.rows[0]] + [0.0] * 3)[:3]
        if not 0.0 < np.linalg.norm([x, y, z]) < np.inf:
            raise ValueError("a normal without length")
        normal = (x, y, z)
    card = ": ".join(map(str, where[1:]))
    content.pretension_sections[name] = PretensionSection(node=node, normal=normal, card=card)
    content.note(Verdict.APPROXIMATED, block, WHOLE)


def bolt_nodes(content: Content) -> set[int]:
    """Nodes of pre-tension sections: their motion is the shortening of a bolt."""
    return {section.node for section in content.pretension_sections.values()}


def sections_there(content: Content, mesh: Mesh) -> None:
    """InputError where a pre-tension section of faces is not there."""
    for name in content.pretension_sections:
        if name not in content.surfaces and name not in mesh.element_sets and not name.isdigit():
            raise refused(Place(content.source, "*PRE-TENSION SECTION"), f"names {name}, which the file does not have")


@KEYWORDS.reads("RETAINEDNODALDOFS", "SORTED", stage=3)
def on_retained(content: Content, block: Block) -> None:
    """The step before holds what a substructure retains (Craig-Bampton); in the substructure it moves."""
    retained = set()
    for row in block.rows:
        first = whole_number(row[1]) if len(row) > 1 and row[1] else 1
        last = whole_number(row[2]) if len(row) > 2 and row[2] else (first if len(row) > 1 and row[1] else 6)
        if not 1 <= first <= last <= 6:
            raise ValueError(f"directions {first} to {last}")
        retained |= {(n, axis) for n in named(row[0], content.node_sets) for axis in range(first - 1, last)}
    freed = content.held & retained
    content.held -= freed
    if freed:
        what = f"frees {len(freed)} dofs that the step before holds: its substructure has them"
        content.extra.append(f"{content.place(block.line, block.shown)} {what}")
    else:
        content.note(Verdict.HARMLESS, block)
