"""Points where two surfaces face each other, whose meshes need not match.

Each face of one surface is clipped against the faces of the other one that it faces, both projected along the mean of
their normals (Puso and Laursen 2004). On the polygons that are left, Gauss points integrate what the shape functions of
both sides carry: a constant pressure passes through exactly where faces are flat, and triangles or parallelograms. At
each point a line along the mean of both normals meets both surfaces. What moves is the difference of the two places,
each by the shape functions of its face, so that no rigid motion of touching surfaces strains a contact, and the forces
on both sides are equal and opposite, their moments too but for the lever arm of a gap.

Nothing here depends on the order of the two surfaces but the signs, nor on that of nodes and faces but the order of the
points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array, csr_array

from slipstick.fem.contact_points import ContactPoints, WeightedPoints, nearest_centres, spread
from slipstick.fem.elements import FACES, Rule, gauss, triangle
from slipstick.fem.geometry import nodal_normals
from slipstick.fem.loads import area_weights
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.ties import face_size, project
from slipstick.typing import Array, BoolArray, IntArray

OPPOSED = 0.5
"""Cosine between one normal and the opposite of the other one, at least, where faces face each other: 60 degrees."""

_ROUNDING = 1e-12
"""Lengths of this share of a face are rounding."""

_SLIVER = 1e-11
"""Polygons of this share of the smaller face are what rounding leaves of faces that meet along an edge."""

_STRAIGHT = 1e-4
"""Middles this close to those of their edges, over the size of the face, belong to edges that are cut as straight ones:
files have five or six digits. Places are always those of the shape functions."""

_PARALLELOGRAM = 1e-9
"""How far a quadrilateral may be from a parallelogram, over its size, for rules of low order."""

_CONVERGED = 1e-13
"""Steps in the coordinates of a face below it are rounding."""

_NEWTON_STEPS = 25
"""Newton iterations for the place where a line meets a face, at most."""

_CELLS = 10
"""Where points are many, those in one cell of a grid, this many each way in a patch, belong to one patch."""

_RESISTED = 1e-4
"""Rotations with less than this share of the resistance to the one that is resisted most do not count."""

_BESIDE = 1e-6
"""Nodes this far beside the other surface, over the length of an edge, do not face it."""


@dataclass(frozen=True, kw_only=True)
class Facing(WeightedPoints):
    """Points where the first surface faces the second one.

    Positions lie midway, normals are those of the first surface; the weights are those of the first surface less those
    of the second one.

    Attributes
    ----------
    gaps
        Distance along the normal from the first to the second surface, (n,); negative where they overlap.
    covered
        Area of each of the two surfaces that faces the other one.
    """

    gaps: Array
    covered: tuple[float, float]

    def among(self, kept: BoolArray) -> Facing:
        """Those marked."""
        p = self.points
        fewer = ContactPoints(positions=p.positions[kept], normals=p.normals[kept], areas=p.areas[kept])
        return replace(
            self, points=fewer, weights=csc_array(self.weights[:, np.flatnonzero(kept)]), gaps=self.gaps[kept]
        )


@dataclass(frozen=True, kw_only=True)
class _Faces:
    """Faces of a surface, and the flat polygons that stand for them while they are clipped.

    ``kinds`` (n_faces,) indices into ``_KINDS``; ``nodes`` (n_faces, 8) padded; ``low`` (n_faces,) whether rules
    of low order do. ``cells`` (m, 4, 3) polygons, triangles with their last corner twice; ``face`` (m,) of each.
    """

    kinds: IntArray
    nodes: IntArray
    low: BoolArray
    cells: Array
    face: IntArray

    @cached_property
    def centres(self) -> Array:
        """Middles of the polygons, (m, 3)."""
        return self.cells.mean(axis=1)

    @cached_property
    def radii(self) -> Array:
        """Distance of the farthest corner from the middle, (m,)."""
        return np.linalg.norm(self.cells - self.centres[:, None], axis=2).max(axis=1)

    @cached_property
    def areas_normals(self) -> tuple[Array, Array]:
        """Areas (m,) and unit normals (m, 3) of the polygons."""
        across = np.cross(self.cells[:, 2] - self.cells[:, 0], self.cells[:, 3] - self.cells[:, 1])
        size = np.linalg.norm(across, axis=1)
        return size / 2.0, across / np.where(size > 0.0, size, 1.0)[:, None]


_KINDS = tuple(FACES)
_CURVED: dict[str, tuple[tuple[int, ...], ...]] = {
    "tri6": ((0, 3, 5, 5), (3, 1, 4, 4), (5, 4, 2, 2), (3, 4, 5, 5)),
    "quad8": ((0, 4, 7, 7), (1, 5, 4, 4), (2, 6, 5, 5), (3, 7, 6, 6), (4, 5, 6, 7)),
}
"""Polygons of a face with curved edges."""


def _faces(mesh: Mesh, surface: Surface) -> _Faces:
    kinds, nodes, low, cells, face, n = [], [], [], [], [], 0
    for kind, block in surface.faces.items():
        if not len(block):
            continue
        corners, corner_count = mesh.nodes[block], FACES[kind].n_corners
        size = np.ptp(corners, axis=1).max(axis=1)
        straight = np.ones(len(block), dtype=bool)
        if corners.shape[1] > corner_count:
            ends = corners[:, np.array(FACES[kind].edges)]
            off = np.linalg.norm(corners[:, corner_count:] - ends.mean(axis=2), axis=2).max(axis=1)
            straight = off <= _STRAIGHT * size
        skew = np.zeros(len(block))
        if corner_count == 4:
            skew = np.linalg.norm(corners[:, 0] - corners[:, 1] + corners[:, 2] - corners[:, 3], axis=1)
        whole = (0, 1, 2, 3) if corner_count == 4 else (0, 1, 2, 2)
        numbers = n + np.arange(len(block))
        cells.append(corners[straight][:, whole])
        face.append(numbers[straight])
        for part in _CURVED.get(kind, ()):
            cells.append(corners[~straight][:, part])
            face.append(numbers[~straight])
        kinds.append(np.full(len(block), _KINDS.index(kind)))
        nodes.append(np.pad(block, ((0, 0), (0, 8 - block.shape[1]))))
        # cubic shape functions, and inverse maps that are no polynomials; curved faces are cut into smaller cells
        low.append(~straight | ((skew <= _PARALLELOGRAM * size) & (kind != "quad8")))
        n += len(block)
    return _Faces(
        kinds=np.concatenate(kinds), nodes=np.concatenate(nodes), low=np.concatenate(low),
        cells=np.concatenate(cells), face=np.concatenate(face),
    )  # fmt: skip


def facing_points(mesh: Mesh, first: Surface, second: Surface, within: float) -> Facing | None:
    """Gauss points on the common refinement of two surfaces; None where none lie within a distance."""
    a, b = _faces(mesh, first), _faces(mesh, second)
    i, j = _candidates(a, b, within)
    if not len(i):
        return None
    (areas_a, normals_a), (areas_b, normals_b) = a.areas_normals, b.areas_normals
    along = normals_a[i] - normals_b[j]
    along /= np.linalg.norm(along, axis=1)[:, None]
    middles = (a.centres[i] + b.centres[j]) / 2.0
    frame = _frame(along)
    sizes = np.minimum(np.sqrt(areas_a[i]), np.sqrt(areas_b[j]))
    flat_a, flat_b = (np.einsum("mka,mad->mkd", part - middles[:, None], frame) for part in (a.cells[i], b.cells[j]))
    polygons, counts = _clipped(flat_a, flat_b[:, ::-1], _ROUNDING * sizes)
    large = _areas(polygons, counts) > _SLIVER * sizes**2
    i, j = i[large], j[large]
    along, middles, frame = along[large], middles[large], frame[large]
    if not len(i):
        return None
    low = a.low[a.face[i]] & b.low[b.face[j]]
    owner, flat, shares = _gauss_points(polygons[large], counts[large], low)
    points = middles[owner] + np.einsum("pd,pad->pa", flat, frame[owner])
    return _met(mesh, a, b, a.face[i][owner], b.face[j][owner], points, along[owner], shares, within)


def _candidates(a: _Faces, b: _Faces, within: float) -> tuple[IntArray, IntArray]:
    """Pairs of polygons that face each other, near enough to meet."""
    from scipy.spatial import cKDTree

    reach = a.radii + b.radii.max() + within
    near = cKDTree(b.centres).query_ball_point(a.centres, reach * (1.0 + 1e-9))
    i = np.repeat(np.arange(len(near)), [len(one) for one in near])
    j = np.concatenate([np.empty(0, dtype=np.int64), *(np.asarray(one, dtype=np.int64) for one in near)])
    apart = np.linalg.norm(a.centres[i] - b.centres[j], axis=1)
    opposed = np.einsum("ma,ma->m", a.areas_normals[1][i], b.areas_normals[1][j]) < -OPPOSED
    kept = opposed & (apart <= (a.radii[i] + b.radii[j] + within) * (1.0 + 1e-9))
    return i[kept], j[kept]


def _frame(along: Array) -> Array:
    """Two unit vectors (m, 3, 2) across each of the unit vectors, counter-clockwise seen from its tip."""
    other = np.eye(3)[np.abs(along).argmin(axis=1)]
    first = np.cross(other, along)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(along, first)], axis=2)


def _clipped(polygons: Array, others: Array, rounding: Array) -> tuple[Array, IntArray]:
    """Convex polygons (m, 4, 2) inside others, both counter-clockwise: corners (m, k, 2), padded, and how many.

    Sutherland and Hodgman (1974), one edge of the other ones after the other.
    """
    polygons, counts = _without_repeated(polygons, np.full(len(polygons), polygons.shape[1]), rounding)
    for edge in range(others.shape[1]):
        start, side = others[:, edge], others[:, (edge + 1) % others.shape[1]] - others[:, edge]
        length = np.linalg.norm(side, axis=1)
        inward = np.stack([-side[:, 1], side[:, 0]], axis=1) / np.where(length > rounding, length, np.inf)[:, None]
        polygons, counts = _cut(polygons, counts, start, inward, rounding)
        polygons, counts = _without_repeated(polygons, counts, 10.0 * rounding)
    return polygons, counts


def _following(values: Array, counts: IntArray) -> Array:
    """Of each corner (m, k, ...) the value of the next one around its polygon."""
    k = values.shape[1]
    following = np.where(np.arange(1, k + 1) < counts[:, None], np.arange(1, k + 1), 0) % k
    return values[np.arange(len(values))[:, None], following]


def _cut(polygons: Array, counts: IntArray, start: Array, inward: Array, rounding: Array) -> tuple[Array, IntArray]:
    """What is left of polygons on one side of a line."""
    height = np.einsum("mkd,md->mk", polygons - start[:, None], inward)
    there = np.arange(polygons.shape[1]) < counts[:, None]
    inside = height >= -rounding[:, None]
    after, corners_after = _following(height, counts), _following(polygons, counts)
    crossing = there & (inside != _following(inside, counts))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(crossing, np.clip(height / (height - after), 0.0, 1.0), 0.0)
    met = polygons + share[..., None] * (corners_after - polygons)
    both = np.stack([polygons, met], axis=2).reshape(len(polygons), 2 * polygons.shape[1], 2)
    return _compact(both, np.stack([there & inside, crossing], axis=2).reshape(both.shape[:2]))


def _without_repeated(polygons: Array, counts: IntArray, distance: Array) -> tuple[Array, IntArray]:
    """Corners that are not where the next one is."""
    there = np.arange(polygons.shape[1]) < counts[:, None]
    apart = np.linalg.norm(_following(polygons, counts) - polygons, axis=2) > distance[:, None]
    return _compact(polygons, there & apart)


def _compact(corners: Array, kept: BoolArray) -> tuple[Array, IntArray]:
    counts = kept.sum(axis=1)
    order = np.argsort(~kept, axis=1, kind="stable")[:, : max(int(counts.max(initial=1)), 1)]
    return corners[np.arange(len(corners))[:, None], order], counts


def _areas(polygons: Array, counts: IntArray) -> Array:
    return _around(polygons, counts).sum(axis=1) / 2.0


def _around(polygons: Array, counts: IntArray) -> Array:
    """Twice the area of the triangles of each edge with the first corner, (m, k)."""
    own = polygons - polygons[:, :1]
    after = _following(own, counts)
    there = np.arange(polygons.shape[1]) < counts[:, None]
    return np.where(there, own[..., 0] * after[..., 1] - own[..., 1] * after[..., 0], 0.0)


def _gauss_points(polygons: Array, counts: IntArray, low: BoolArray) -> tuple[IntArray, Array, Array]:
    """Polygon, place (p, 2) and area of each point.

    A rule on triangles and quadrilaterals that does not depend on which corner is the first; other polygons are cut
    into triangles about their centroid.
    """
    owners, places, shares = [np.empty(0, dtype=np.int64)], [np.empty((0, 2))], [np.empty(0)]
    for order, at in ((0, np.flatnonzero(low)), (1, np.flatnonzero(~low))):
        for owner, shape, corners in _simple(polygons[at], counts[at]):
            rule = triangle((3, 7)[order]) if shape == "tri3" else gauss((2, 3)[order], 2)
            own, point, share = _mapped(corners, shape, rule)
            owners.append(at[owner[own]])
            places.append(point)
            shares.append(share)
    return np.concatenate(owners), np.concatenate(places), np.concatenate(shares)


def _simple(polygons: Array, counts: IntArray) -> Iterator[tuple[IntArray, str, Array]]:
    """Triangles and quadrilaterals that make up polygons."""
    for count, kind in ((3, "tri3"), (4, "quad4")):
        at = np.flatnonzero(counts == count)
        if len(at):
            yield at, kind, polygons[at, :count]
    at = np.flatnonzero(counts > 4)
    if len(at):
        own, number = polygons[at], counts[at]
        twice = _around(own, number)
        after = _following(own, number)
        middles = (own[:, :1] + own + after) / 3.0
        centroid = np.einsum("mk,mkd->md", twice, middles) / twice.sum(axis=1)[:, None]
        which, corner = np.nonzero(np.arange(own.shape[1]) < number[:, None])
        yield at[which], "tri3", np.stack([own[which, corner], after[which, corner], centroid[which]], axis=1)


def _mapped(corners: Array, kind: str, rule: Rule) -> tuple[IntArray, Array, Array]:
    """Points and areas of a rule on triangles or quadrilaterals (m, k, 2) of a plane."""
    values, gradients = FACES[kind].basis(rule.points)
    t = np.einsum("mnd,qne->mqde", corners, gradients)
    areas = (t[..., 0, 0] * t[..., 1, 1] - t[..., 1, 0] * t[..., 0, 1]) * rule.weights
    own = np.repeat(np.arange(len(corners)), len(rule.weights))
    return own, np.einsum("qn,mnd->mqd", values, corners).reshape(-1, 2), areas.ravel()


@dataclass(frozen=True, kw_only=True)
class _Met:
    """Where lines meet faces: shape functions (p, 8), places and unit normals (p, 3)."""

    values: Array
    places: Array
    normals: Array


def _meet(mesh: Mesh, faces: _Faces, face: IntArray, points: Array, along: Array) -> _Met:
    """Lines through points (p, 3) along unit vectors, each with the face of its number, by Newton's method."""
    out = _Met(values=np.zeros((len(points), 8)), places=np.zeros((len(points), 3)), normals=np.zeros((len(points), 3)))
    for number, kind in enumerate(_KINDS):
        at = np.flatnonzero(faces.kinds[face] == number)
        if not len(at):
            continue
        basis = FACES[kind].basis
        corners = mesh.nodes[faces.nodes[face[at], : FACES[kind].n_nodes]]
        ahead = along[at]
        local = np.full((len(at), 2), 1.0 / 3.0 if kind.startswith("tri") else 0.0)
        moving = np.arange(len(at))
        for _ in range(_NEWTON_STEPS):
            place, across = _place(basis, local[moving], corners[moving])
            step = _solved(across, ahead[moving], points[at[moving]] - place)
            local[moving] += step
            moving = moving[np.abs(step).max(axis=1) > _CONVERGED]
            if not len(moving):
                break
        place, across = _place(basis, local, corners)
        normal = np.cross(across[..., 0], across[..., 1])
        out.values[at, : corners.shape[1]] = basis(local)[0]
        out.places[at] = place
        out.normals[at] = normal / np.linalg.norm(normal, axis=1)[:, None]
    return out


def _place(basis: Callable[[Array], tuple[Array, Array]], local: Array, corners: Array) -> tuple[Array, Array]:
    values, gradients = basis(local)
    return np.einsum("pn,pna->pa", values, corners), np.einsum("pna,pnd->pad", corners, gradients)


def _solved(across: Array, ahead: Array, gap: Array) -> Array:
    """Steps (p, 2) in a face that bring its point onto the line, by Cramer's rule."""
    u, v = across[..., 0], across[..., 1]
    beside = np.cross(v, ahead)
    bottom = np.einsum("pa,pa->p", u, beside)
    first = np.einsum("pa,pa->p", gap, beside) / bottom
    second = np.einsum("pa,pa->p", gap, np.cross(ahead, u)) / bottom
    return np.stack([first, second], axis=1)


def _met(
    mesh: Mesh, a: _Faces, b: _Faces, i: IntArray, j: IntArray, points: Array, along: Array, shares: Array,
    within: float,
) -> Facing | None:  # fmt: skip
    """Points of both surfaces on lines along the mean of their normals; ``shares`` are areas across ``along``."""
    one, other = _meet(mesh, a, i, points, along), _meet(mesh, b, j, points, along)
    slant = [np.einsum("pa,pa->p", sign * part.normals, along) for sign, part in ((1.0, one), (-1.0, other))]
    normals = one.normals - other.normals
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    turned = np.abs(normals - along).max(axis=1, initial=0.0) > _ROUNDING
    if turned.any():
        middles = (one.places + other.places) / 2.0
        one, other = _meet(mesh, a, i, middles, normals), _meet(mesh, b, j, middles, normals)
    gaps = np.einsum("pa,pa->p", other.places - one.places, normals)
    kept = (np.abs(gaps) <= within) & (np.minimum(*slant) > OPPOSED / 2.0)
    if not kept.any():
        return None
    covered = [float((shares[kept] / part[kept]).sum()) for part in slant]
    parts = ((a.nodes[i], one.values, 1.0), (b.nodes[j], other.values, -1.0))
    return Facing(
        points=ContactPoints(
            positions=(one.places + other.places)[kept] / 2.0,
            normals=normals[kept],
            areas=(shares * (1.0 / slant[0] + 1.0 / slant[1]) / 2.0)[kept],
        ),
        weights=_weights(mesh, [(nodes[kept], sign * values[kept]) for nodes, values, sign in parts]),
        gaps=gaps[kept],
        covered=(covered[0], covered[1]),
    )


def _weights(mesh: Mesh, parts: list[tuple[IntArray, Array]]) -> csc_array:
    """Columns of nodes (p, 8) with values (p, 8), of both sides."""
    count = len(parts[0][0])
    column = np.tile(np.repeat(np.arange(count), 8), len(parts))
    rows, values = (np.concatenate([part[k].ravel() for part in parts]) for k in (0, 1))
    there = values != 0.0
    return csc_array((values[there], (rows[there], column[there])), shape=(mesh.n_nodes, count))


def facing_nodes(mesh: Mesh, first: Surface, second: Surface, within: float) -> Facing | None:
    """Nodes of the first surface, with their shares of its area, on the nearest places of the second one."""
    nodes = first.nodes
    feet = project(mesh, second, mesh.nodes[nodes])
    assert feet.normals is not None
    normals, apart = -feet.normals, feet.places - mesh.nodes[nodes]
    gaps = np.einsum("pa,pa->p", apart, normals)
    beside = np.linalg.norm(apart - gaps[:, None] * normals, axis=1)
    own, size = nodal_normals(mesh, first)[nodes], face_size(mesh, second)
    kept = (np.abs(gaps) <= within) & (beside <= _BESIDE * size) & (np.einsum("pa,pa->p", own, normals) > OPPOSED)
    if not kept.any():
        return None
    single = np.zeros_like(feet.weights[kept])
    single[:, 0] = 1.0
    itself = np.zeros_like(feet.nodes[kept])
    itself[:, 0] = nodes[kept]
    areas = area_weights(mesh, first)[nodes[kept]]
    return Facing(
        points=ContactPoints(positions=mesh.nodes[nodes[kept]] + apart[kept] / 2.0, normals=normals[kept], areas=areas),
        weights=_weights(mesh, [(itself, single), (feet.nodes[kept], -feet.weights[kept])]),
        gaps=gaps[kept],
        covered=(float(areas.sum()), float(areas.sum())),
    )


def thinned(facing: Facing, count: int, kt: float = 1.0, kn: float = 1.0) -> tuple[Facing, float, float]:
    """As many patches of points, each of which moves as their mean by area; and what that loses.

    Areas and first moments are kept. A patch has no resistance to a rotation of its own: the first number is the
    largest share, over all axes, of the resistance to a rigid rotation about the middle of the surface that is lost,
    with springs ``kt`` along the surface and ``kn`` across it, per area. The second one is the largest difference of
    a point's gap and that of its patch.
    """
    points, areas = facing.points, facing.points.areas
    owner = patches_of(points, count)
    size = int(owner.max()) + 1
    total: Array = np.asarray(np.bincount(owner, areas, minlength=size), dtype=float)
    mean = csr_array((areas / total[owner], (np.arange(len(owner)), owner)), shape=(len(owner), size))
    normals = mean.T @ points.normals
    fewer = Facing(
        points=ContactPoints(
            positions=mean.T @ points.positions,
            normals=normals / np.linalg.norm(normals, axis=1)[:, None],
            areas=total,
        ),
        weights=csc_array(facing.weights @ mean),
        gaps=mean.T @ facing.gaps,
        covered=facing.covered,
    )
    uneven = float(np.abs(facing.gaps - fewer.gaps[owner]).max())
    return fewer, _softer(points, fewer.points, kt, kn), uneven


def patches_of(points: ContactPoints, count: int) -> IntArray:
    """The patch of each point, (n,): points that are near, and look the same way."""
    areas = points.areas
    reach = np.sqrt(areas.sum() / count)
    features = np.hstack([points.positions, reach * points.normals])
    group = np.arange(len(areas))
    if len(areas) > _CELLS**2 * count:
        grid = np.round((features - features.min(axis=0)) * (_CELLS / reach)).astype(np.int64)
        group = np.unique(grid, axis=0, return_inverse=True)[1].ravel()
    shares: Array = np.asarray(np.bincount(group, areas), dtype=float)
    means = np.stack([np.bincount(group, areas * column) / shares for column in features.T], axis=1)
    owner = nearest_centres(means, spread(means, shares, min(count, len(shares))))
    return np.asarray(np.unique(owner, return_inverse=True)[1].ravel()[group])


def _softer(points: ContactPoints, fewer: ContactPoints, kt: float, kn: float) -> float:
    """The largest share of the resistance to a rotation that patches lose."""
    middle = np.average(points.positions, axis=0, weights=points.areas)
    whole, left = (_resistance(part.positions - middle, part.normals, part.areas, kt, kn) for part in (points, fewer))
    sizes, axes = np.linalg.eigh(whole)
    there = sizes > _RESISTED * sizes.max(initial=0.0)
    scaled = axes[:, there] / np.sqrt(sizes[there])
    return max(0.0, 1.0 - float(np.linalg.eigvalsh(scaled.T @ left @ scaled).min(initial=1.0)))


def _resistance(arms: Array, normals: Array, areas: Array, kt: float, kn: float) -> Array:
    """Moment by rotation (3, 3) of springs along the surface and across it."""
    turning = np.cross(np.eye(3)[None], arms[:, None])  # motion by a rotation about each axis, (n, axis, 3)
    pressing = np.einsum("nxa,na->nx", turning, normals)
    across = np.einsum("n,nx,ny->xy", areas, pressing, pressing)
    return np.asarray(kn * across + kt * (np.einsum("n,nxa,nya->xy", areas, turning, turning) - across))
