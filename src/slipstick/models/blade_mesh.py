"""A parametric turbine blade: root block, twisted and tapered aerofoil, shroud block, in quadratic hexahedra.

The plan of the mesh is the same at every height: a core of quadrilaterals that follows the aerofoil section, and a ring
of quadrilaterals from its outline to that of a block. The aerofoil is the core alone; root and shroud are core and
ring. So the blocks meet the aerofoil face to face, without hanging nodes, whatever the mesh size.

Axes: z along the blade from the bottom of the root (z = 0) to the top of the shroud, the chord along x at the bottom of
the aerofoil, turning towards y with height. Named surfaces: "root" (bottom), "root_sides", "platform" (top of the root
around the aerofoil), "concave" (pressure side), "convex", "edges" (leading and trailing), "shroud_bottom",
"shroud_sides", "shroud_top".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import LARGEST, SMALLEST, Gathering, number, suggestion
from slipstick.fem.boundary import boundary
from slipstick.fem.mesh import Mesh, Surface
from slipstick.typing import Array, BoolArray, IntArray

ELEMENT_SIZES = {"small": 6.4e-3, "medium": 3.15e-3, "large": 2.06e-3}
"""Element sizes (m) for about 5 200, 30 000 and 104 000 free degrees of freedom with the default shape."""

_RANGES = {"twist": (-90.0, 90.0, "degrees"), "camber": (0.0, 0.25, "of the chord")}

MOST_ELEMENTS = 10_000_000
"""Elements of the box around a blade, at most."""

WETTED = ("platform", "concave", "convex", "edges", "shroud_bottom", "shroud_sides", "shroud_top")
"""Surfaces in the gas: convection acts here. The root sits in the disc."""


@dataclass(frozen=True, kw_only=True)
class BladeShape:
    """Dimensions of the blade, in metres and degrees.

    The defaults make a shrouded blade of 0.22 m like those of the last stages of small turbines: aspect ratio (aerofoil
    height over mean chord) near 4, thickness 15 % of the chord at the bottom and 10 % at the top, 40 degrees of
    twist, a taper of 0.62; in steel its first bending mode lies near 210 Hz, which is where the first excitation
    orders of such machines lie. The leading and trailing edges are blunt so that no hexahedron degenerates.

    Parameters
    ----------
    element_size
        Wanted edge length of the elements in the plan; along the height it is ``stretch`` times that.
    height, root_height, shroud_height
        Of the whole blade, of the root block, of the shroud block.
    chord, taper
        Chord at the bottom of the aerofoil, and the ratio of the top chord to it.
    thickness, thickness_taper
        Largest thickness over chord, and the ratio of the top value to the bottom one.
    edge_thickness
        Thickness of the edges over the largest thickness.
    camber, camber_taper
        Height of the camber line over chord, and the ratio of the top value to the bottom one.
    twist
        Angle between the bottom and the top chord.
    root_margin, shroud_margin
        Width of the block around the aerofoil; its long sides follow the camber line.
    stretch
        Element height over element size: bending needs fewer elements along the blade than across.
    """

    element_size: float = ELEMENT_SIZES["large"]
    height: float = 0.22
    root_height: float = 0.03
    shroud_height: float = 0.007
    chord: float = 0.06
    taper: float = 0.62
    thickness: float = 0.15
    thickness_taper: float = 0.7
    edge_thickness: float = 0.3
    camber: float = 0.12
    camber_taper: float = 0.7
    twist: float = 40.0
    root_margin: float = 0.007
    shroud_margin: float = 0.0045
    stretch: float = 1.5

    def __post_init__(self) -> None:
        gathered = Gathering()
        for f in fields(self):
            signed = f.name in ("twist", "camber")
            least, expected = (-LARGEST, "a finite number") if signed else (SMALLEST, "a finite number > 0")
            value = gathered.take(number, ("blade", f.name), getattr(self, f.name), expected, above=least)
            low, high, unit = _RANGES.get(f.name, (-LARGEST, LARGEST, ""))
            if value is not None and not low <= value <= high:
                gathered.faults.append(
                    Fault(("blade", f.name), found=f"{value:g}", expected=f"{low:g} to {high:g} {unit}")
                )
        gathered.end()
        faults = []
        if not self.height > self.root_height + self.shroud_height:
            described = f"{self.height}, which leaves no aerofoil above root_height + shroud_height"
            faults.append(Fault(("blade", "height"), found=described))
        if not faults and not self.element_size < self.chord:
            described = f"{self.element_size}, which is not below the chord, {self.chord}"
            faults.append(Fault(("blade", "element_size"), found=described, remedy="give metres"))
        across = self.chord / self.element_size
        if not faults and self.height / (self.stretch * self.element_size) * across * across > MOST_ELEMENTS:
            described = f"{self.element_size}, which makes too many elements"
            faults.append(Fault(("blade", "element_size"), found=described, remedy="give a larger one"))
        if faults:
            raise InputError(faults)


def blade_shape(size: str = "large", **dimensions: float) -> BladeShape:
    """The default blade with the "small", "medium" or "large" mesh, or with other dimensions of :class:`BladeShape`.

    Raises
    ------
    InputError
        For another size, or dimensions that make no blade.
    """
    if size not in ELEMENT_SIZES:
        raise InputError(Fault("size", found=f"'{size}'", remedy=suggestion(size, tuple(ELEMENT_SIZES))))
    return BladeShape(element_size=ELEMENT_SIZES[size], **dimensions)


def blade_mesh(shape: BladeShape | None = None) -> Mesh:
    """Mesh of the blade (see the module for axes and surfaces).

    Examples
    --------
    >>> mesh = blade_mesh(blade_shape("small"))
    >>> sorted(mesh.surfaces)
    ['concave', 'convex', 'edges', 'platform', 'root', 'root_sides', 'shroud_bottom', 'shroud_sides', 'shroud_top']
    """
    shape = shape or BladeShape()
    plan = plan_of(*_divisions(shape))
    levels, in_block = _levels(shape)
    nodes = np.stack([_section(shape, plan, z) for z in levels])
    numbers, kept = plan_numbers(plan, in_block)
    mesh = Mesh(nodes=nodes[kept], blocks={"hex20": hexahedra(plan, numbers, in_block)})
    level = np.broadcast_to(np.arange(len(levels))[:, None], kept.shape)[kept]
    column = np.broadcast_to(np.arange(plan.n_nodes), kept.shape)[kept]
    surfaces = _surfaces(boundary(mesh), plan, level, column, in_block)
    return Mesh(nodes=mesh.nodes, blocks=mesh.blocks, surfaces=surfaces)


def _divisions(shape: BladeShape) -> tuple[int, int, int]:
    """Elements along the chord, across the thickness, and across the ring."""
    size = shape.element_size
    along = max(4, round(shape.chord * (1.0 + shape.taper) / 2.0 / size))
    across = max(1, round(shape.chord * shape.thickness * 0.8 / size))
    ring = max(1, round((shape.root_margin + shape.shroud_margin) / 2.0 / size))
    return along, across, ring


def _levels(shape: BladeShape) -> tuple[Array, BoolArray]:
    """Heights of the node levels (2 n + 1,), and for each of the n layers of elements whether it belongs to a block."""
    top = shape.height - shape.shroud_height
    parts = [(0.0, shape.root_height, True), (shape.root_height, top, False), (top, shape.height, True)]
    counts = [max(1, round((b - a) / (shape.stretch * shape.element_size))) for a, b, _ in parts]
    heights = [np.linspace(a, b, 2 * n + 1)[:-1] for (a, b, _), n in zip(parts, counts, strict=True)]
    blocks = [np.full(n, block) for (_, _, block), n in zip(parts, counts, strict=True)]
    return np.append(np.concatenate(heights), shape.height), np.concatenate(blocks)


def _section(shape: BladeShape, plan: Plan, z: float) -> Array:
    """Positions (n_plan_nodes, 3) at a height; the blocks continue the section at their end of the aerofoil."""
    bottom, top = shape.root_height, shape.height - shape.shroud_height
    s = float(np.clip((z - bottom) / (top - bottom), 0.0, 1.0))
    margin = shape.root_margin if z <= bottom else shape.shroud_margin
    flat = plan.place(lambda u, v: _aerofoil(shape, s, u, v), lambda u, v: _block(shape, s, margin, u, v))
    angle = np.deg2rad(shape.twist) * s
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return np.column_stack([flat @ turn, np.full(len(flat), z)])


def _aerofoil(shape: BladeShape, s: float, u: Array, v: Array) -> Array:
    """Point (n, 2) of the section at relative height s: u in [0, 1] along the chord, v from concave to convex.

    A parabolic camber line and a thickness with blunt edges, across the chord, largest at 40 % of it.
    The centroid of the camber line is kept on the z axis, so that the blade stands straight.
    """
    chord, thickness = _chord_and_thickness(shape, s)
    bulge = u * (1.0 - u) ** 1.5 / (0.4 * 0.6**1.5)
    relative = shape.edge_thickness + (1.0 - shape.edge_thickness) * bulge
    return np.stack([chord * (u - 0.5), _camber(shape, s, u) + (v - 0.5) * thickness * relative], axis=1)


def _block(shape: BladeShape, s: float, margin: float, u: Array, v: Array) -> Array:
    """Outline of a block: as wide everywhere as the thickest section and two margins, arched along the camber line."""
    chord, thickness = _chord_and_thickness(shape, s)
    along = 0.5 + (u - 0.5) * (1.0 + 2.0 * margin / chord)
    return np.stack([chord * (along - 0.5), _camber(shape, s, along) + (v - 0.5) * (thickness + 2.0 * margin)], axis=1)


def _chord_and_thickness(shape: BladeShape, s: float) -> tuple[float, float]:
    chord = shape.chord * (1.0 + (shape.taper - 1.0) * s)
    return chord, chord * shape.thickness * (1.0 + (shape.thickness_taper - 1.0) * s)


def _camber(shape: BladeShape, s: float, u: Array) -> Array:
    chord, _ = _chord_and_thickness(shape, s)
    camber = chord * shape.camber * (1.0 + (shape.camber_taper - 1.0) * s)
    return camber * (4.0 * u * (1.0 - u) - 2.0 / 3.0)


def plan_numbers(plan: Plan, in_block: BoolArray) -> tuple[IntArray, BoolArray]:
    """Node numbers (n_levels, n_plan_nodes) and which of those places hold a node."""
    touches_block = np.zeros(2 * len(in_block) + 1, dtype=bool)
    for layer in np.flatnonzero(in_block):
        touches_block[2 * layer : 2 * layer + 3] = True
    corner_level = np.arange(len(touches_block)) % 2 == 0
    kept = (touches_block[:, None] | plan.in_core) & (corner_level[:, None] | plan.is_corner)
    numbers = np.full(kept.shape, -1, dtype=np.int64)
    numbers[kept] = np.arange(kept.sum())
    return numbers, kept


def hexahedra(plan: Plan, numbers: IntArray, in_block: BoolArray) -> IntArray:
    """Connectivity (n_elements, 20): plan corners and middles below, above, and corners at the middle level."""
    blocks = []
    for layer, block in enumerate(in_block):
        faces = plan.faces if block else plan.faces[: plan.n_core_faces]
        low, middle, high = numbers[2 * layer], numbers[2 * layer + 1], numbers[2 * layer + 2]
        corners, middles = faces[:, :4], faces[:, 4:]
        blocks.append(np.hstack([low[corners], high[corners], low[middles], high[middles], middle[corners]]))
    return np.concatenate(blocks)


def _surfaces(skin: Surface, plan: Plan, level: IntArray, column: IntArray, in_block: BoolArray) -> dict[str, Surface]:
    """Named surfaces of the boundary faces, by the place of their nodes in the plan and their levels."""
    faces = skin.faces["quad8"]
    low, high = level[faces].min(axis=1), level[faces].max(axis=1)
    root_top, shroud_bottom = 2 * int(np.argmin(in_block)), 2 * (len(in_block) - int(np.argmin(in_block[::-1])))
    flat, upright = low == high, low != high
    on_side = {name: marked[column[faces]].all(axis=1) for name, marked in plan.sides.items()}
    in_root, in_shroud = high <= root_top, low >= shroud_bottom
    groups = {
        "root": flat & (high == 0),
        "platform": flat & (high == root_top),
        "shroud_bottom": flat & (low == shroud_bottom),
        "shroud_top": flat & (low == 2 * len(in_block)),
        "root_sides": upright & in_root,
        "shroud_sides": upright & in_shroud,
        "concave": upright & ~in_root & ~in_shroud & on_side["concave"],
        "convex": upright & ~in_root & ~in_shroud & on_side["convex"],
        "edges": upright & ~in_root & ~in_shroud & ~on_side["concave"] & ~on_side["convex"],
    }
    return {name: Surface(faces={"quad8": faces[chosen]}) for name, chosen in groups.items()}


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Nodes and faces of the plan, by parameters; positions follow from the section.

    Attributes
    ----------
    core
        Parameters (u, v) in [0, 1]^2 of every node's foot in the core, (n_nodes, 2): for a node of the ring, the point
        of the outline it starts from.
    ring
        How far out in the ring each node lies, (n_nodes,): 0 in the core, 1 on the block's outline.
    faces
        (n_faces, 8) counter-clockwise, those of the core first (``n_core_faces``).
    is_corner, in_core
        Whether a node is a corner of faces; whether it belongs to the core, (n_nodes,).
    sides
        Nodes of the outline on the side v = 0 ("concave") and v = 1 ("convex"), (n_nodes,).
    """

    core: Array
    ring: Array
    faces: IntArray
    n_core_faces: int
    is_corner: BoolArray
    in_core: BoolArray
    sides: Mapping[str, BoolArray]

    @property
    def n_nodes(self) -> int:
        """Number of nodes of the plan."""
        return len(self.ring)

    def place(self, section: Callable[[Array, Array], Array], block: Callable[[Array, Array], Array]) -> Array:
        """Positions (n_nodes, 2): the section itself, and straight lines from its outline to that of a block around it.

        Both functions map (u, v) in [0, 1]^2 to the plane, (n, 2).
        """
        foot = section(*self.core.T)
        return foot + self.ring[:, None] * (block(*self.core.T) - foot)


def plan_of(along: int, across: int, ring: int) -> Plan:
    """Plan with ``along`` x ``across`` faces in the core and ``ring`` layers of faces around it."""
    lattice = np.arange((2 * along + 1) * (2 * across + 1)).reshape(2 * along + 1, 2 * across + 1)
    u, v = np.meshgrid(np.linspace(0, 1, 2 * along + 1), np.linspace(0, 1, 2 * across + 1), indexing="ij")
    outline = np.concatenate([lattice[:-1, 0], lattice[-1, :-1], lattice[:0:-1, -1], lattice[0, :0:-1]])
    around = np.vstack([outline, lattice.size + np.arange(2 * ring * len(outline)).reshape(2 * ring, -1)])
    closed = np.hstack([around, around[:, :1]])
    core = np.stack([u.ravel(), v.ravel()], axis=1)
    core = np.vstack([core, np.tile(core[outline], (2 * ring, 1))])
    out = np.concatenate([np.zeros(lattice.size), np.repeat(np.arange(1, 2 * ring + 1) / (2 * ring), len(outline))])
    core_faces, ring_faces = _quads(lattice), _quads(closed.T[::-1])
    return _compressed(core, out, np.vstack([core_faces, ring_faces]), len(core_faces), lattice.size)


def _quads(lattice: IntArray) -> IntArray:
    """8-node faces of a lattice with every second node a corner; counter-clockwise for axes to the right and up."""
    i, j = (2 * g.ravel() for g in np.meshgrid(*[np.arange(n // 2) for n in lattice.shape], indexing="ij"))
    steps = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    return np.stack([lattice[i + a, j + b] for a, b in steps], axis=1).astype(np.int64)


def _compressed(core: Array, ring: Array, faces: IntArray, n_core_faces: int, n_lattice: int) -> Plan:
    """Drop the lattice nodes in the middle of faces, which 8-node faces do not have."""
    used = np.unique(faces)
    number = np.full(len(core), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    corner = np.zeros(len(core), dtype=bool)
    corner[faces[:, :4]] = True
    core, ring, in_core = core[used], ring[used], used < n_lattice
    v = core[:, 1]
    return Plan(
        core=core,
        ring=ring,
        faces=number[faces],
        n_core_faces=n_core_faces,
        is_corner=corner[used],
        in_core=in_core,
        sides={"concave": in_core & (v == 0.0), "convex": in_core & (v == 1.0)},
    )
