"""Contact pressures and gaps of another code, from a table of nodes or elements, at the points of a pair of surfaces.

Values are interpolated by moving least squares of first degree in the plane of each point (Lancaster and Salkauskas
1981, Math. Comput. 37, 141-158). Where areas are known the pressures then get the resultant force and moment of the
table, by the factor nearest to 1 that is linear in the position.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import LARGEST
from slipstick.fem.contact_points import ContactPoints
from slipstick.fem.elements import ELEMENTS, FACES
from slipstick.fem.extras import read_by_meshio
from slipstick.fem.geometry import face_geometry, tangents
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.model import FiniteElementModel
from slipstick.fem.ties import project
from slipstick.fem.unit_systems import system
from slipstick.results.measured_columns import read_columns
from slipstick.typing import Array, IntArray
from slipstick.units import SIZES

NAMES: Mapping[str, tuple[str, ...]] = {
    "x": ("x", "xcoord", "xcoordinate", "xlocation", "coordcoor1", "coor1"),
    "y": ("y", "ycoord", "ycoordinate", "ylocation", "coordcoor2", "coor2"),
    "z": ("z", "zcoord", "zcoordinate", "zlocation", "coordcoor3", "coor3"),
    "node": ("node", "nodelabel", "nodeid", "nodenumber", "grid"),
    "element": ("element", "elementlabel", "elementid", "elementnumber"),
    "pressure": ("pressure", "p", "press", "cpress", "contpres", "contactpressure"),
    "gap": ("gap", "copen", "contgap", "opening"),
    "area": ("area", "cnarea", "nodalarea"),
}
"""What columns are called, in small letters and without other signs."""

_PRESSURES = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "bar": 1e5, "N/mm^2": 1e6, "psi": 6894.757293168}
_FEWEST, _MOST = 12, 200
"""Values that each one is made of."""
_RIDGE = 1e-10
"""Of the fit, so that values on a line make a constant across it."""
_FAR = 3.0
"""Points this many spacings of the table away from it, and more than their own size, have no value."""
_KEPT = 1e-9
"""Resultants that differ by this share are kept."""
_SCALES = {1e3: ("m", "mm"), 1e-3: ("mm", "m"), 25.4: ("inch", "mm"), 1 / 25.4: ("mm", "inch")}
"""Units of a table and of a model, by how many times the model's numbers are larger."""
_TURNED = 1e-5
"""Resultants that the normals of a surface give so little of are not corrected: a ring has no moment about its axis."""
_LEFT, _LARGE = 0.01, 0.3
"""Resultants that are not kept, and differences from the file, that are warned of above it."""


@dataclass(frozen=True, kw_only=True)
class MappedPressure:
    """Pressures, and gaps where the table has some, at points.

    Attributes
    ----------
    pressures
        Force over area at each point, (n,), >= 0.
    gaps
        Distances at each point, (n,); None: the table has none.
    force, moment
        Of the pressures on the second surface, (3,); the moment is about the middle of the points.
    error
        Difference of the table and of the pressures put back at its places, over the table: root mean squares.
    notes, warnings
        What was found; what is suspicious.
    """

    pressures: Array
    gaps: Array | None
    force: Array
    moment: Array
    error: float
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class _Table:
    """Values at places (m, 3), and the areas they stand for where these are known."""

    places: Array
    pressures: Array
    gaps: Array | None
    areas: Array | None

    def among(self, kept: Array) -> _Table:
        return _Table(
            places=self.places[kept], pressures=self.pressures[kept],
            gaps=None if self.gaps is None else self.gaps[kept],
            areas=None if self.areas is None else self.areas[kept],
        )  # fmt: skip


def mapped_pressure(
    model: FiniteElementModel, surfaces: tuple[Surface, Surface], points: ContactPoints, file: Path, *,
    columns: Mapping[str, str] | None = None, within: float,
) -> MappedPressure:  # fmt: skip
    """The pressures of a file at the points of a pair of surfaces.

    Parameters
    ----------
    model
        With the mesh of both surfaces; labels of nodes and elements are its own.
    surfaces
        The two, of which normals are those of the first.
    points
        Where pressures are wanted.
    file
        A table (.csv, .dat, .rpt of Abaqus, .mat) with a pressure, and x, y, z or node or element in each row; or a
        mesh that meshio reads (.vtu, .vtk) with a pressure at its points or cells.
    columns
        Names of columns by what they are, ``{"pressure": "CPRESS"}``: those of ``NAMES``.
    within
        Rows farther from both surfaces belong to other ones.

    Raises
    ------
    InputError
        For files that are no such tables, labels that the model does not have, places that are not near the surfaces,
        pressures that pull, resultants that no pressure at the points has.
    """
    mesh = model.in_mesh("pressures of a file")
    found: list[str] = []
    doubts: list[str] = []
    table = _read(model, mesh, surfaces, file, columns, doubts)
    table = _near(mesh, surfaces, points, table, file, within, found, doubts)
    values = table.pressures[:, None] if table.gaps is None else np.stack([table.pressures, table.gaps], axis=1)
    at = _interpolated(table.places, values, points.positions, points.normals)
    pressures = np.maximum(at[:, 0], 0.0)
    spacing = _spacing(table.places)
    away = _distances(table.places, points.positions) > np.maximum(_FAR * spacing, np.sqrt(points.areas))
    if away.any():
        share = points.areas[away].sum() / points.areas.sum()
        doubts.append(f"{100 * share:.3g} % of the area lies too far from the points of {file.name}: no pressure there")
        pressures = np.where(away, 0.0, pressures)
    if table.areas is None:
        found.append(f"{file.name} has no area: force and moment are those of the interpolated pressures")
    else:
        pressures = _balanced(mesh, surfaces, points, table, pressures, file, found, doubts)
    force, moment = _resultant(points.positions, points.normals, points.areas * pressures, _middle(points))
    error = _error(points, pressures, table)
    found.append(
        f"pressures of {file.name}: {len(table.places)} points, force {np.linalg.norm(force):.6g}, up to "
        f"{pressures.max():.4g}; interpolated back to the points of the file they differ by {100 * error:.2g} % (rms)"
    )
    if error > _LARGE:
        doubts.append(f"pressures of {file.name} differ by {100 * error:.2g} % (rms) from the file: give more points")
    return MappedPressure(
        pressures=pressures, gaps=None if table.gaps is None else at[:, 1], force=force, moment=moment, error=error,
        notes=tuple(found), warnings=tuple(doubts),
    )  # fmt: skip


def _read(
    model: FiniteElementModel, mesh: Mesh, surfaces: tuple[Surface, Surface], file: Path,
    columns: Mapping[str, str] | None, doubts: list[str],
) -> _Table:  # fmt: skip
    if file.suffix.lower() in (".vtu", ".vtk"):
        table = _of_mesh(file, columns)
    else:
        table = _of_columns(model, mesh, surfaces, file, columns, doubts)
    numbers = [part for part in (table.places, table.pressures, table.gaps, table.areas) if part is not None]
    if any(np.nanmax(np.abs(part), initial=0.0) > LARGEST for part in numbers):
        raise InputError(Fault(str(file), f"has numbers beyond {LARGEST:g}", remedy="check its columns and units"))
    if not np.isfinite(table.places).all() or (table.areas is not None and not np.isfinite(table.areas).all()):
        raise InputError(Fault(str(file), "has places or areas that are no finite numbers"))
    known = np.isfinite(table.pressures)
    if table.gaps is not None:
        known &= np.isfinite(table.gaps)
    if not known.any():
        raise InputError(Fault(str(file), "has no pressure that is a finite number"))
    if not known.all():
        doubts.append(f"{(~known).sum()} rows of {file.name} have no value and are left out")
        table = table.among(known)
    pulling = table.pressures < 0.0
    if pulling.all() or table.pressures.max() <= 0.0:
        least, most = table.pressures.min(), table.pressures.max()
        what = f"has no pressure above 0: its pressures go from {least:.4g} to {most:.4g}"
        raise InputError(Fault(str(file), what, remedy="compression is > 0: change the sign"))
    if pulling.any():
        low = f"down to {table.pressures.min():.4g}"
        doubts.append(f"{pulling.sum()} pressures of {file.name} are below 0, {low}: they count as 0")
        table = replace(table, pressures=np.maximum(table.pressures, 0.0))
    return table


def _of_columns(
    model: FiniteElementModel, mesh: Mesh, surfaces: tuple[Surface, Surface], file: Path,
    columns: Mapping[str, str] | None, doubts: list[str],
) -> _Table:  # fmt: skip
    read = read_columns(file, columns)
    named = {what: name for what in NAMES for name in read.values if (columns or _plain(name) in NAMES[what])}
    if columns:
        named = {name: name for name in read.values if name in NAMES}
    have = {what: np.asarray(read.values[name], dtype=float) for what, name in named.items()}
    units = {what: read.units[name] for what, name in named.items()}
    names = ", ".join(read.names)
    if "pressure" not in have:
        what = f"has no column of pressures; its columns are {names}"
        raise InputError(Fault(str(file), what, remedy='name it: columns = { pressure = "CPRESS" }'))
    for what, unit in units.items():
        if unit:
            have[what] = have[what] * _factor(model, file, what, unit, doubts)
    if {"x", "y", "z"} <= have.keys():
        places: Array = np.stack([have[axis] for axis in "xyz"], axis=1)
        order: IntArray = np.arange(len(places))
        areas: Array | None = None
    elif "node" in have:
        return _at_nodes(mesh, surfaces, have, file, doubts)
    elif "element" in have:
        order, places, areas = _at_elements(mesh, surfaces, have["element"], file)
    else:
        what = f"does not say where its pressures are; its columns are {names}"
        remedy = 'give x, y and z, or node, or element: columns = { node = "Node Label" }'
        raise InputError(Fault(str(file), what, remedy=remedy))
    own = have.get("area")
    if own is not None and np.any(own < 0.0):
        raise InputError(Fault(str(file), "has areas below 0"))
    if own is not None and not np.any(own > 0.0):
        raise InputError(Fault(str(file), "has no area above 0", remedy="leave the column of areas out"))
    return _Table(
        places=places, pressures=have["pressure"][order], gaps=None if "gap" not in have else have["gap"][order],
        areas=areas if own is None else own[order],
    )  # fmt: skip


def _plain(name: str) -> str:
    """
    >>> _plain("Node Label"), _plain("COORD.COOR1")
    ('nodelabel', 'coordcoor1')
    """
    return "".join(letter for letter in name.lower() if letter.isalnum())


def _factor(model: FiniteElementModel, file: Path, what: str, unit: str, doubts: list[str]) -> float:
    """Factor from a unit of the file to that of the model."""
    try:
        own = system(model.units)
    except InputError:
        doubts.append(f"{what} of {file.name} is in {unit}, and the model does not say its units: taken as its own")
        return 1.0
    size = _PRESSURES.get(unit) if what == "pressure" else SIZES["length"].get(unit.removesuffix("^2"))
    if size is None:
        known = ", ".join(_PRESSURES if what == "pressure" else SIZES["length"])
        raise InputError(Fault((str(file), what), found=f"the unit {unit!r}", expected=known))
    if what == "pressure":
        return size * own.length**2 / own.force
    return float((size / own.length) ** (2 if what == "area" else 1))


def _at_nodes(
    mesh: Mesh, surfaces: tuple[Surface, Surface], have: Mapping[str, Array], file: Path, doubts: list[str]
) -> _Table:
    """The field that values at nodes make on one of the surfaces: the first one that has pressures."""
    labels = have["node"]
    there = np.isfinite(labels) & np.isfinite(have["pressure"])
    rows = {int(labels[row]): int(row) for row in np.flatnonzero(there)}  # later rows are later steps
    row_of = np.array([rows.get(int(label), -1) for label in mesh.labels.tolist()], dtype=np.int64)
    known = [surface.nodes[row_of[surface.nodes] >= 0] for surface in surfaces]
    if not any(map(len, known)):
        some = ", ".join(f"{label:.10g}" for label in labels[:3])
        what = f"names nodes ({some}, ...) of which neither surface has any"
        raise InputError(Fault(str(file), what, remedy="give the table of this pair, or x, y and z"))
    pressed = [float(have["pressure"][row_of[nodes]].max(initial=0.0)) > 0.0 for nodes in known]
    side = next((i for i in (0, 1) if pressed[i]), int(len(known[1]) > len(known[0])))
    if len(known[side]) < len(surfaces[side].nodes):
        lacking = np.setdiff1d(surfaces[side].nodes, known[side])
        what = f"{len(lacking)} nodes of the surface, as node {mesh.labels[lacking[0]]}: no pressure there"
        doubts.append(f"{file.name} lacks {what}")
    values = {
        what: np.where(row_of >= 0, np.nan_to_num(have[what])[row_of], 0.0)
        for what in ("pressure", "gap")
        if what in have
    }
    return _field_of(mesh.nodes, surfaces[side].faces, values)


def _field_of(nodes: Array, faces: Mapping[str, IntArray], values: Mapping[str, Array]) -> _Table:
    """Values at nodes as a field on faces: at their points of integration, each with its area."""
    places, areas = [], []
    found: dict[str, list[Array]] = {what: [] for what in values}
    for kind, part in faces.items():
        if not len(part):
            continue
        rule = FACES[kind].rule
        shapes, gradients = FACES[kind].basis(rule.points)
        along = tangents(nodes[part], gradients)
        across = np.cross(along[..., 0], along[..., 1])
        areas.append((np.linalg.norm(across, axis=-1) * rule.weights).ravel())
        places.append(np.einsum("qn,mna->mqa", shapes, nodes[part]).reshape(-1, 3))
        for what, at in values.items():
            found[what].append(np.einsum("qn,mn->mq", shapes, at[part]).ravel())
    fields = {what: np.concatenate(parts) for what, parts in found.items()}
    return _Table(
        places=np.concatenate(places), pressures=fields["pressure"], gaps=fields.get("gap"),
        areas=np.concatenate(areas),
    )  # fmt: skip


def _at_elements(
    mesh: Mesh, surfaces: tuple[Surface, Surface], labels: Array, file: Path
) -> tuple[IntArray, Array, Array]:
    """Rows, places and areas of the faces that elements have on one of the surfaces, the first one that has some."""
    rows = {int(label): row for row, label in enumerate(labels) if np.isfinite(label)}
    for surface in surfaces:
        owner = _owners(mesh, surface)
        order, places, areas = [], [], []
        for faces, values, weights, _ in face_geometry(mesh, surface):
            middles = np.einsum("mq,qn,mna->ma", weights, values, mesh.nodes[faces])
            for face, middle, size in zip(faces.tolist(), middles, weights.sum(axis=1), strict=True):
                row = rows.get(owner.get(tuple(sorted(face[: _corners(len(face))])), -1))
                if row is not None:
                    order.append(row)
                    areas.append(size)
                    places.append(middle / size)
        if order:
            return np.array(order, dtype=np.int64), np.array(places), np.array(areas)
    some = ", ".join(f"{label:.10g}" for label in labels[:3])
    what = f"names elements ({some}, ...) that have no face on either surface"
    raise InputError(Fault(str(file), what, remedy="give the table of this pair, or x, y and z"))


def _corners(count: int) -> int:
    return {3: 3, 6: 3}.get(count, 4)


def _owners(mesh: Mesh, surface: Surface) -> dict[tuple[int, ...], int]:
    """Label of the element of each face at a surface, by its corners."""
    marked = np.zeros(mesh.n_nodes, dtype=bool)
    marked[surface.nodes] = True
    found: dict[tuple[int, ...], int] = {}
    for kind, block in mesh.blocks.items():
        labels = (mesh.element_labels or {}).get(kind, np.arange(1, len(block) + 1))
        for shape, local in ELEMENTS[kind].faces:
            part = block[:, list(local[: FACES[shape].n_corners])]
            at = np.flatnonzero(marked[part].all(axis=1))
            found |= {tuple(sorted(face)): int(labels[i]) for i, face in zip(at, part[at].tolist(), strict=True)}
    return found


def _of_mesh(file: Path, columns: Mapping[str, str] | None) -> _Table:
    """Points or faces of a file that meshio reads."""
    if not file.is_file():
        raise InputError(Fault(str(file), "there is no such file"))
    data = read_by_meshio(file)
    points = np.asarray(data.points, dtype=float)
    if not np.isfinite(points).all() or np.abs(points).max(initial=0.0) > LARGEST:
        raise InputError(Fault(str(file), "has points that are no finite numbers"))
    points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    flat = [(block.data, i) for i, block in enumerate(data.cells) if block.type.startswith(("triangle", "quad"))]
    faces = [(np.asarray(cells)[:, : _corners(cells.shape[1])], i) for cells, i in flat]
    if any(cells.size and not 0 <= cells.min() <= cells.max() < len(points) for cells, _ in faces):
        raise InputError(Fault(str(file), f"has faces with points beyond its {len(points)}"))
    for fields, of_cells in ((data.point_data, False), (data.cell_data, True)):
        names = {what: _field(fields, what, columns) for what in ("pressure", "gap")}
        if names["pressure"] is None:
            continue
        given = {what: n for what, n in names.items() if n is not None}
        for n in given.values():
            if not of_cells and np.ndim(fields[n]) != 1:
                raise InputError(Fault((str(file), n), "has several components", expected="one number"))
        if not of_cells:
            values = {what: np.asarray(fields[n], dtype=float) for what, n in given.items()}
            shapes = {f"{'tri' if k == 3 else 'quad'}{k}": [c for c, _ in faces if c.shape[1] == k] for k in (3, 4)}
            if faces:
                return _field_of(points, {kind: np.concatenate(c) for kind, c in shapes.items() if c}, values)
            return _Table(places=points, pressures=values["pressure"], gaps=values.get("gap"), areas=None)
        if not faces:
            break
        places = np.concatenate([points[cells].mean(axis=1) for cells, _ in faces])
        values = {
            what: np.concatenate([np.asarray(fields[n][i], dtype=float).ravel() for _, i in faces])
            for what, n in given.items()
        }
        areas = np.concatenate([_areas(points, cells) for cells, _ in faces])
        if any(len(each) != len(areas) for each in values.values()):
            raise InputError(Fault(str(file), "has several components of its pressure", expected="one number"))
        return _Table(places=places, pressures=values["pressure"], gaps=values.get("gap"), areas=areas)
    known = ", ".join([*data.point_data, *data.cell_data]) or "none"
    what = f"has no pressure at its points or faces; its fields are {known}"
    raise InputError(Fault(str(file), what, remedy='name it: columns = { pressure = "CPRESS" }'))


def _field(fields: Mapping[str, object], what: str, columns: Mapping[str, str] | None) -> str | None:
    wanted = (columns or {}).get(what)
    if wanted is not None:
        return wanted if wanted in fields else None
    return next((name for name in fields if _plain(name) in NAMES[what]), None)


def _areas(points: Array, cells: IntArray) -> Array:
    """Areas of triangles or quadrilaterals."""
    corners = points[cells]
    across = np.cross(corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1])
    return np.asarray(np.linalg.norm(across, axis=1) / 2.0)


def _near(
    mesh: Mesh, surfaces: tuple[Surface, Surface], points: ContactPoints, table: _Table, file: Path, within: float,
    found: list[str], doubts: list[str],
) -> _Table:  # fmt: skip
    """The rows near the surfaces."""
    away = np.min([project(mesh, surface, table.places).distances for surface in surfaces], axis=0)
    near = away <= within
    if near.all():
        return table
    if not near.any():
        span, own = (float(np.ptp(part, axis=0).max()) for part in (points.positions, table.places))
        ratio = span / own if own > 0.0 else 1.0
        like = next((units for scale, units in _SCALES.items() if abs(ratio / scale - 1.0) < 0.3), None)
        what = f"lies at least {away.min():.3g} from the surfaces, more than {within:.3g}"
        hint = (
            f"; they span {own:.3g}, the contact points {span:.3g}: are they in {like[0]}, not {like[1]}?"
            if like
            else ""
        )
        remedy = "give points in the coordinates and units of the model, or a larger within"
        raise InputError(Fault(str(file), what + hint, remedy=remedy))
    pressing = table.pressures * (1.0 if table.areas is None else table.areas)
    share = pressing[~near].sum() / pressing.sum()
    what = f"{(~near).sum()} of {len(near)} rows of {file.name} lie more than {within:.3g} from the surfaces: left out"
    if share > 0.01:
        doubts.append(f"{what}, with {100 * share:.3g} % of the load")
    else:
        found.append(what)
    return table.among(near)


def _spacing(places: Array) -> float:
    """The usual distance of a place to the next one."""
    from scipy.spatial import cKDTree

    if len(places) < 2:
        return 0.0
    apart = cKDTree(places).query(places, k=2)[0][:, 1]
    return float(np.median(apart))


def _distances(places: Array, at: Array) -> Array:
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(places).query(at)[0])


def _interpolated(places: Array, values: Array, at: Array, normals: Array) -> Array:
    """Values (n, c) at points by moving least squares of values (m, c) at places; linear ones are exact."""
    from scipy.spatial import cKDTree

    count = min(len(places), int(np.clip(np.ceil(3 * len(places) / len(at)), _FEWEST, _MOST)))
    apart, near = cKDTree(places).query(at, k=count)
    apart, near = apart.reshape(len(at), count), near.reshape(len(at), count)
    reach = np.maximum(apart.max(axis=1) * 1.001, np.finfo(float).tiny)
    weights = (1.0 - apart / reach[:, None]) ** 2
    other = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(other, normals)
    frame = np.stack([first, np.cross(normals, first)], axis=2)
    local = np.einsum("nka,nad->nkd", places[near] - at[:, None], frame) / reach[:, None, None]
    basis = np.concatenate([np.ones((*near.shape, 1)), local], axis=2)
    normal_matrix = np.einsum("nki,nk,nkj->nij", basis, weights, basis)
    normal_matrix += _RIDGE * weights.sum(axis=1)[:, None, None] * np.diag([0.0, 1.0, 1.0])
    right = np.einsum("nki,nk,nkc->nic", basis, weights, values[near])
    fitted = np.linalg.solve(normal_matrix, right)[:, 0]
    low, high = values[near].min(axis=1), values[near].max(axis=1)
    return np.clip(fitted, low - (high - low) / 2.0, high + (high - low) / 2.0)


def _middle(points: ContactPoints) -> Array:
    return np.asarray(np.average(points.positions, axis=0, weights=points.areas))


def _resultant(places: Array, normals: Array, sizes: Array, about: Array) -> tuple[Array, Array]:
    """Force and moment of forces along normals."""
    forces = sizes[:, None] * normals
    return forces.sum(axis=0), np.cross(places - about, forces).sum(axis=0)


def _balanced(
    mesh: Mesh, surfaces: tuple[Surface, Surface], points: ContactPoints, table: _Table, pressures: Array, file: Path,
    found: list[str], doubts: list[str],
) -> Array:  # fmt: skip
    """Pressures with the resultant force and moment of the table."""
    assert table.areas is not None
    about, size = _middle(points), max(float(np.ptp(points.positions, axis=0).max()), np.finfo(float).tiny)
    feet = [project(mesh, surface, table.places) for surface in surfaces]
    closer = feet[0].distances <= feet[1].distances
    outward = [np.asarray(foot.normals) for foot in feet]
    normals = np.where(closer[:, None], outward[0], -outward[1])

    def six(places: Array, across: Array, sizes: Array) -> Array:
        force, moment = _resultant(places, across, sizes, about)
        return np.concatenate([force, moment / size])

    wanted = six(table.places, normals, table.areas * table.pressures)
    forces = points.areas * pressures
    have = six(points.positions, points.normals, forces)
    scale = float(np.linalg.norm(wanted))
    if not scale > 0.0:
        raise InputError(Fault(str(file), "has no pressure on an area", remedy="check its areas, or leave them out"))
    shapes = np.concatenate([points.normals, np.cross(points.positions - about, points.normals) / size], axis=1)
    gram = np.einsum("ni,n,nj->ij", shapes, forces, shapes)
    factor = 1.0 + shapes @ (np.linalg.pinv(gram, rcond=_TURNED, hermitian=True) @ (wanted - have))
    left = float(np.linalg.norm(six(points.positions, points.normals, forces * factor) - wanted)) / scale
    changed = float(np.linalg.norm(have - wanted)) / scale
    pressed = forces > 0.0
    if not pressed.any() or factor[pressed].min() < 0.0:
        what = f"has a force and moment that no pressures at the contact points keep: they differ by {changed:.2g}"
        raise InputError(Fault(str(file), what, remedy="give more points, or a table that lies on this pair alone"))
    kept = f"force and moment of {file.name} are kept: interpolated they differed by {100 * changed:.2g} %"
    if left > _LEFT:
        what = f"{100 * left:.2g} % of force and moment of {file.name} are not kept"
        doubts.append(f"{what}: the contact points are too few, or their normals differ from those of the file")
    else:
        found.append(kept + (f", {100 * left:.2g} % still differ" if left > _KEPT else ""))
    return np.asarray(pressures * factor)


def _error(points: ContactPoints, pressures: Array, table: _Table) -> float:
    """Root mean square of what putting pressures back at the places of the table changes, over that of the table."""
    from scipy.spatial import cKDTree

    near = cKDTree(points.positions).query(table.places)[1]
    back = _interpolated(points.positions, pressures[:, None], table.places, points.normals[near])[:, 0]
    weights = np.ones(len(back)) if table.areas is None else table.areas
    return float(np.sqrt(weights @ (back - table.pressures) ** 2 / (weights @ table.pressures**2)))
