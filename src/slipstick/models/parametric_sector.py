"""A parametric sector of a bladed disc: disc, blade and integral shroud, in quadratic hexahedra; SI units.

The axis of the disc is z. The plan of the mesh (``blade_mesh.plan_of``) is the same at every radius: a core that
follows the section of the blade, and a ring from its outline to that of the sector. The blade is the core alone. So
disc, blade and shroud meet face to face, and the two faces of the sector have the same nodes.

Named surfaces: "bore" (held), "low" and "high" (sides of the disc, towards the sector before and the next one),
"sides" (front and back of the disc), "platform", "concave", "convex", "edges" (of the blade), "shroud_low" and
"shroud_high" (towards the neighbours), "shroud_sides", "shroud_bottom", "tip". Element sets: "disc", "blade" (the
aerofoil), "shroud".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import LARGEST, SMALLEST, Gathering, number, one, suggestion, whole
from slipstick.fem.axis import Axis
from slipstick.fem.boundary import boundary
from slipstick.fem.cyclic import CyclicSymmetry
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.model import ImportedModel, elastic_model
from slipstick.models.blade import BLADE_STEEL
from slipstick.models.blade_mesh import Plan, hexahedra, plan_numbers, plan_of
from slipstick.typing import Array, BoolArray, IntArray

SECTOR_SIZES = {"coarse": 20e-3, "small": 9e-3, "medium": 4.75e-3, "large": 3.15e-3}
"""Element sizes (m) for about 1 100, 5 000, 30 000 and 105 000 free degrees of freedom with the default shape."""

MOST_ELEMENTS = 10_000_000


@dataclass(frozen=True, kw_only=True)
class SectorShape:
    """Dimensions of the sector, in metres and degrees.

    The defaults make a disc with 24 blades of 0.14 m between radii 0.1 and 0.4 m.

    Parameters
    ----------
    sectors
        Number of blades.
    element_size
        Wanted edge length of the elements in the plan; along the radius it is ``stretch`` times that.
    bore, rim, tip
        Radii of the bore, of the rim of the disc where the blade begins, and of the tip of the shroud.
    shroud_height
        Of the shroud, within ``tip``.
    width, bore_width
        Of disc and shroud along the axis at the rim, and of the disc at the bore.
    chord, thickness, camber
        Of the blade: chord; largest thickness and height of the camber line over chord.
    edge_thickness
        Thickness of the edges over the largest thickness.
    stagger, twist
        Angle of the chord to the axis at the rim, and how much more it is at the shroud.
    shroud_gap
        Angle between neighbouring shrouds, over that of a sector: 0 for shrouds that touch.
    stretch
        Element height over element size.
    """

    sectors: int = 24
    element_size: float = SECTOR_SIZES["large"]
    bore: float = 0.1
    rim: float = 0.25
    tip: float = 0.4
    shroud_height: float = 0.01
    width: float = 0.08
    bore_width: float = 0.1
    chord: float = 0.04
    thickness: float = 0.12
    camber: float = 0.1
    edge_thickness: float = 0.4
    stagger: float = 5.0
    twist: float = 10.0
    shroud_gap: float = 0.0
    stretch: float = 1.5

    def __post_init__(self) -> None:
        gathered = Gathering()
        gathered.take(whole, ("sector", "sectors"), self.sectors, 3, 1000)
        signed = ("stagger", "twist", "camber", "shroud_gap")
        for f in fields(self)[1:]:
            least, expected = (-LARGEST, "a finite number") if f.name in signed else (SMALLEST, "a finite number > 0")
            gathered.take(number, ("sector", f.name), getattr(self, f.name), expected, above=least)
        gathered.end()
        faults = []
        if not self.bore < self.rim < self.tip - self.shroud_height:
            found = f"bore {self.bore:g}, rim {self.rim:g}, tip {self.tip:g} with a shroud of {self.shroud_height:g}"
            faults.append(Fault(("sector", "rim"), found=found, expected="bore < rim < tip - shroud_height"))
        if not 0.0 <= self.shroud_gap < 0.5:
            faults.append(
                Fault(("sector", "shroud_gap"), found=f"{self.shroud_gap:g}", expected="0 to 0.5 of a sector")
            )
        pitch = 2.0 * np.pi / self.sectors * (1.0 - max(self.shroud_gap, 0.0))
        for where, angle, radius in (
            ("stagger", self.stagger, self.rim),
            ("twist", self.stagger + self.twist, self.tip),
        ):
            outline = _turned(_aerofoil(self, *_OUTLINE), angle)
            ends = np.array([self.width, pitch * radius]) / 2.0
            if np.any(np.abs(outline).max(axis=0) >= ends) or _folded(outline, ends):
                remedy = "give a shorter or thicker blade, a smaller angle, a wider disc or more sectors"
                faults.append(Fault(("sector", where), "the blade does not fit on its sector", remedy=remedy))
        cells = (self.tip - self.bore) * self.chord * self.width / (self.stretch * self.element_size**3)
        if not self.element_size < self.chord or cells > MOST_ELEMENTS:
            found = f"{self.element_size:g}"
            faults.append(Fault(("sector", "element_size"), found=found, expected="well below the chord; give metres"))
        if faults:
            raise InputError(faults)


def sector_shape(size: str = "large", **dimensions: float) -> SectorShape:
    """The default sector with a "coarse", "small", "medium" or "large" mesh, or with other dimensions.

    Raises
    ------
    InputError
        For another size, or dimensions that make no sector.
    """
    if size not in SECTOR_SIZES:
        raise InputError(Fault("size", found=f"'{size}'", remedy=suggestion(str(size), tuple(SECTOR_SIZES))))
    return SectorShape(element_size=SECTOR_SIZES[size], **dimensions)  # type: ignore[arg-type]


def bladed_sector(shape: SectorShape | str = "small", *, material: Material = BLADE_STEEL) -> ImportedModel:
    """Finite element model of a parametric bladed sector, held at its bore: what ``ss.reduced_sector`` takes.

    Parameters
    ----------
    shape
        "coarse", "small", "medium" or "large" (about 1 100, 5 000, 30 000 and 105 000 dofs), or a
        :class:`SectorShape`; see ``slipstick.models.parametric_sector`` for axes, surfaces and element sets.

    Raises
    ------
    InputError
        For an unknown size, and what is no material.

    Examples
    --------
    >>> model = bladed_sector("coarse")
    >>> model.symmetry.sectors, model.n_dofs
    (24, 1113)
    """
    gathering = Gathering()
    shape = sector_shape(shape) if isinstance(shape, str) else shape
    gathering.take(one, "shape", shape, SectorShape, 'a size such as "small", or a SectorShape')
    gathering.take(one, "material", material, Material, "an ss.Material")
    gathering.end()
    mesh = sector_mesh(shape)
    everything = {kind: np.arange(len(block)) for kind, block in mesh.blocks.items()}
    mesh = replace(mesh, element_sets={**mesh.element_sets, "all": everything})
    model = elastic_model(mesh, {"all": material}, "bore")
    ring = CyclicSymmetry(sectors=shape.sectors, axis=Axis(), low="low", high="high")
    return replace(model, source="parametric bladed sector", units="SI", symmetry=ring)


def sector_mesh(shape: SectorShape) -> Mesh:
    """Mesh of the sector (see the module for axes, surfaces and element sets)."""
    plan = plan_of(*_divisions(shape))
    levels, layers = _levels(shape)
    in_block = layers != 1
    nodes = np.stack([_placed(shape, plan, r) for r in levels])
    numbers, kept = plan_numbers(plan, in_block)
    mesh = Mesh(nodes=nodes[kept], blocks={"hex20": hexahedra(plan, numbers, in_block)})
    level = np.broadcast_to(np.arange(len(levels))[:, None], kept.shape)[kept]
    column = np.broadcast_to(np.arange(plan.n_nodes), kept.shape)[kept]
    widths = np.where(in_block, len(plan.faces), plan.n_core_faces)
    parts = np.repeat(layers, widths)
    sets = {name: {"hex20": np.flatnonzero(parts == k)} for k, name in enumerate(("disc", "blade", "shroud"))}
    surfaces = _surfaces(boundary(mesh), plan, level, column, layers)
    return Mesh(nodes=mesh.nodes, blocks=mesh.blocks, element_sets=sets, surfaces=surfaces)


def _divisions(shape: SectorShape) -> tuple[int, int, int]:
    """Elements along the chord, across the thickness, and across the ring."""
    size = shape.element_size
    pitch = 2.0 * np.pi / shape.sectors * (shape.rim + shape.tip) / 2.0
    along = max(2, round(shape.chord / size))
    across = max(1, round(shape.chord * shape.thickness / size))
    ring = max(1, round((pitch - shape.chord * shape.thickness) / 4.0 / size))
    return along, across, ring


def _levels(shape: SectorShape) -> tuple[Array, IntArray]:
    """Radii of the node levels (2 n + 1,); for each of the n layers 0 in the disc, 1 in the blade, 2 in the shroud."""
    top = shape.tip - shape.shroud_height
    parts = [(shape.bore, shape.rim), (shape.rim, top), (top, shape.tip)]
    counts = [max(1, round((b - a) / (shape.stretch * shape.element_size))) for a, b in parts]
    radii = [np.linspace(a, b, 2 * n + 1)[:-1] for (a, b), n in zip(parts, counts, strict=True)]
    return np.append(np.concatenate(radii), shape.tip), np.repeat(np.arange(3), counts)


def _placed(shape: SectorShape, plan: Plan, r: float) -> Array:
    """Positions (n_plan_nodes, 3) at a radius: along the axis and along the circumference, rolled up."""
    top = shape.tip - shape.shroud_height
    risen = float(np.clip((r - shape.rim) / (top - shape.rim), 0.0, 1.0))
    sunk = float(np.clip((shape.rim - r) / (shape.rim - shape.bore), 0.0, 1.0))
    width = shape.width + (shape.bore_width - shape.width) * sunk
    pitch = 2.0 * np.pi / shape.sectors * r * (1.0 - shape.shroud_gap * risen)

    def section(u: Array, v: Array) -> Array:
        flat = _turned(_aerofoil(shape, u, v), shape.stagger + shape.twist * risen)
        return flat * np.array([width / shape.width, min(r / shape.rim, 1.0)])

    def outline(u: Array, v: Array) -> Array:
        return np.stack([(u - 0.5) * width, (v - 0.5) * pitch], axis=1)

    along, around = plan.place(section, outline).T
    angle = around / r
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), -along])


_OUTLINE = (np.repeat(np.linspace(0.0, 1.0, 21), 2), np.tile([0.0, 1.0], 21))


def _aerofoil(shape: SectorShape, u: Array, v: Array) -> Array:
    """Point (n, 2) of the section: u in [0, 1] along the chord, v across; a parabolic camber line and blunt edges."""
    bulge = 4.0 * u * (1.0 - u)
    relative = shape.edge_thickness + (1.0 - shape.edge_thickness) * bulge
    camber = shape.chord * shape.camber * (bulge - 2.0 / 3.0)
    return np.stack([shape.chord * (u - 0.5), camber + (v - 0.5) * shape.chord * shape.thickness * relative], axis=1)


def _folded(outline: Array, ends: Array) -> bool:
    """Whether lines from the edges of the section to the corners of the sector's outline cross the edges."""
    for corners, side in ((outline[[0, 1]], -1.0), (outline[[-2, -1]], 1.0)):
        edge = corners[1] - corners[0]
        for corner, v in zip(corners, (-1.0, 1.0), strict=True):
            line = np.array([side, v]) * ends - corner
            if side * (line[0] * edge[1] - line[1] * edge[0]) <= 0.05 * np.linalg.norm(line) * np.linalg.norm(edge):
                return True
    return False


def _turned(flat: Array, degrees: float) -> Array:
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    return np.asarray(flat @ np.array([[c, s], [-s, c]]))


def _surfaces(skin: Surface, plan: Plan, level: IntArray, column: IntArray, layers: IntArray) -> dict[str, Surface]:
    """Named surfaces of the boundary faces, by the place of their nodes in the plan and their levels."""
    faces = skin.faces["quad8"]
    low, high = level[faces].min(axis=1), level[faces].max(axis=1)
    rim, top = 2 * int(np.sum(layers == 0)), 2 * int(np.sum(layers < 2))
    flat, upright = low == high, low != high
    disc, shroud = high <= rim, low >= top
    blade = upright & ~disc & ~shroud
    out = plan.ring == 1.0
    core = plan.sides

    def on(marked: BoolArray) -> BoolArray:
        return np.asarray(marked[column[faces]].all(axis=1))

    before, after = on(out & (plan.core[:, 1] == 0.0)), on(out & (plan.core[:, 1] == 1.0))
    groups: Mapping[str, BoolArray] = {
        "bore": flat & (high == 0),
        "platform": flat & (high == rim),
        "shroud_bottom": flat & (low == top),
        "tip": flat & (low == 2 * len(layers)),
        "low": upright & disc & before,
        "high": upright & disc & after,
        "sides": upright & disc & ~before & ~after,
        "shroud_low": upright & shroud & before,
        "shroud_high": upright & shroud & after,
        "shroud_sides": upright & shroud & ~before & ~after,
        "concave": blade & on(core["concave"]),
        "convex": blade & on(core["convex"]),
        "edges": blade & ~on(core["concave"]) & ~on(core["convex"]),
    }
    return {name: Surface(faces={"quad8": faces[chosen]}) for name, chosen in groups.items()}
