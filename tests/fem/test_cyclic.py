"""Faces of a sector: paired by rotation, refused with the worst node, and nodes on the axis."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.ring_mesh import ring_model, ring_of
from scipy.sparse import csr_array

from slipstick.errors import InputError
from slipstick.fem.axis import Axis
from slipstick.fem.boundary import surface_where
from slipstick.fem.box import box
from slipstick.fem.cyclic import CyclicSymmetry, joined, paired, rotation, turned
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import elastic_model
from slipstick.fem.refine import quadratic
from slipstick.fem.ties import project, tie_equations
from slipstick.models.blade import BLADE_STEEL
from slipstick.models.reduced_sector import Phases
from slipstick.solve.linear.lanczos import modes
from slipstick.structure.reduction.request import Accuracy

N = 6


def wedge(inner: float = 1.0, kind: str = "hex20") -> Mesh:
    """A sector of a disc about z, between two radii; with ``inner`` 0 it ends in the axis."""
    flat = box((1.0, 1.0, 0.4), (2, 2, 1), kind)
    x, angle, z = flat.nodes[:, 0], 2.0 * np.pi / N * flat.nodes[:, 1], flat.nodes[:, 2]
    r = inner + 2.0 * x
    return Mesh(
        nodes=np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1), blocks=flat.blocks, surfaces=flat.surfaces
    )


def pie(shift: float = 0.0) -> Mesh:
    """A sector that ends in the axis: tetrahedra of wedges, with nodes on it that are one; see ``graded``."""
    flat = box((1.0, 1.0, 0.4), (3, 2, 1), "tet4")
    x, y, z = flat.nodes.T
    r, angle = 2.0 * (x + shift * y * x * (1.0 - x)), 2.0 * np.pi / N * y
    places = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
    _, first, number = np.unique(places.round(9), axis=0, return_index=True, return_inverse=True)
    blocks = {kind: number.ravel()[block] for kind, block in flat.blocks.items()}
    sound = {kind: part[[len(set(row)) == len(row) for row in part.tolist()]] for kind, part in blocks.items()}
    used = np.unique(np.concatenate([part.ravel() for part in sound.values()]))
    place = np.full(len(first), -1)
    place[used] = np.arange(len(used))
    return quadratic(Mesh(nodes=places[first][used], blocks={kind: place[part] for kind, part in sound.items()}))


def symmetry(**other: Any) -> CyclicSymmetry:
    return replace(CyclicSymmetry(sectors=N, axis=Axis(), low=(), high=()), **other)


def faces(mesh: Mesh) -> tuple[Any, Any]:
    angle = np.arctan2(mesh.nodes[:, 1], mesh.nodes[:, 0])
    axis = np.hypot(*mesh.nodes.T[:2]) < 1e-9
    low = np.flatnonzero((np.abs(angle) < 1e-9) | axis)
    return low, np.flatnonzero((np.abs(angle - 2.0 * np.pi / N) < 1e-9) | axis)


def pair(mesh: Mesh, low: Any, high: Any, what: CyclicSymmetry, tolerance: float | None = None) -> Any:
    return paired(what, mesh.labels[low], mesh.labels[high], (mesh.nodes[low], mesh.nodes[high]), tolerance)


def test_faces_are_paired_whichever_way_they_lie() -> None:
    mesh = wedge()
    low, high = faces(mesh)
    found = pair(mesh, low, high, symmetry())
    back = pair(mesh, high, low, symmetry())
    assert np.allclose(found.turn, rotation(Axis(), 2.0 * np.pi / N))
    assert np.allclose(back.turn, found.turn.T)
    places = dict(zip(mesh.labels.tolist(), mesh.nodes, strict=True))
    for a, b in zip(found.low.tolist(), found.high.tolist(), strict=True):
        assert np.allclose(turned(Axis(), found.turn, places[a][None])[0], places[b])


def test_the_worst_node_and_its_distance_are_named() -> None:
    mesh = wedge()
    low, high = faces(mesh)
    nodes = mesh.nodes.copy()
    nodes[high[3]] += [0.0, 0.0, 0.01]
    spoilt = replace(mesh, nodes=nodes)
    with pytest.raises(InputError, match=rf"node {mesh.labels[high[3]]} of high is 0.01 from the nearest node of low"):
        pair(spoilt, low, high, symmetry())
    assert pair(spoilt, low, high, symmetry(), tolerance=0.02).distance == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ({"sectors": 8}, "turned by 360/8 degrees.* they lie 60 degrees apart"),
        ({"axis": Axis(direction=(1, 0, 0))}, "check sectors, axis and faces"),
        ({"axis": Axis(point=(0.5, 0, 0))}, "check sectors, axis and faces"),
    ],
)
def test_another_angle_or_axis_is_told(what: dict[str, Any], said: str) -> None:
    mesh = wedge()
    with pytest.raises(InputError, match=said):
        pair(mesh, *faces(mesh), symmetry(**what))


def test_faces_of_different_size_are_refused() -> None:
    mesh = wedge()
    low, high = faces(mesh)
    with pytest.raises(InputError, match=r"nodes of low and \d+ of high; node \d+ of low is .* from its place on high"):
        pair(mesh, low, high[:-2], symmetry())
    with pytest.raises(InputError, match="has no nodes"):
        pair(mesh, low[:0], high, symmetry())


def test_faces_are_held_alike() -> None:
    mesh = wedge()
    low, high = faces(mesh)
    found = pair(mesh, low, high, symmetry())
    held = elastic_model(mesh, BLADE_STEEL, np.union1d(mesh.surfaces["x0"].nodes, high[-1:]))
    nodes = mesh.labels[held.free // 3]
    with pytest.raises(InputError, match=rf"node {mesh.labels[high[-1]]} is held otherwise than node \d+ of low"):
        joined(nodes, held.free % 3, found, symmetry(), np.zeros(0, dtype=np.int64))
    with pytest.raises(InputError, match="depends on others by an equation"):
        joined(nodes, held.free % 3, found, symmetry(), found.low[:1])


def phases(mesh: Mesh, fixed: Any) -> Phases:
    held = elastic_model(mesh, BLADE_STEEL, fixed)
    found = pair(mesh, *faces(mesh), symmetry())
    how = joined(mesh.labels[held.free // 3], held.free % 3, found, symmetry(), np.zeros(0, dtype=np.int64))
    keep = csr_array(([1.0], ([0], [0])), shape=(len(held.free), 1))
    return Phases(how, held.K, held.M, keep, Accuracy(modes=12), cache=None, listener=None)


@pytest.mark.parametrize("on_axis", [False, True])
def test_frequencies_are_those_of_the_ring(on_axis: bool) -> None:
    mesh = pie() if on_axis else wedge()
    radius = np.hypot(*mesh.nodes.T[:2])
    fixed = np.flatnonzero(radius > 2.0 - 1e-9) if on_axis else mesh.surfaces["x0"].nodes
    ring, _ = ring_model(mesh, N, np.union1d(*faces(mesh)), fixed)
    exact = modes(ring.K, ring.M, 24).omega
    sector = phases(mesh, fixed)
    found = []
    for k in range(N // 2 + 1):
        made = sector(k)
        assert made.complete
        omega = made.omega
        found += [*omega] if k in (0, N // 2) else [*omega, *omega]
    assert np.allclose(np.sort(found)[:24], exact, rtol=1e-9)
    sizes = [sector.matrices(k)[0].shape[0] for k in range(N)]
    assert sum(sizes) == ring.K.shape[0]
    assert len(set(sizes)) == (2 if on_axis else 1)


def graded(cells: int, shift: float = 0.6) -> Mesh:
    """A sector whose radial divisions move with the angle: its faces have as many nodes, which do not meet."""
    flat = box((1.0, 1.0, 0.4), (cells, cells, 1), "hex20")
    x, y, z = flat.nodes.T
    r, angle = 1.0 + 2.0 * (x + shift * y * x * (1.0 - x)), 2.0 * np.pi / N * y
    places = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
    return Mesh(nodes=places, blocks=flat.blocks, surfaces=flat.surfaces)


def together(mesh: Mesh, fixed: Any = None) -> Any:
    """The faces joined, of the whole sector or without nodes that are fixed, and the model without them."""
    low, high = faces(mesh)
    found = paired(symmetry(), mesh.labels[low], mesh.labels[high], (mesh.nodes[low], mesh.nodes[high]), None, mesh)
    nodes, parts, held = np.repeat(mesh.labels, 3), np.tile(np.arange(3), mesh.n_nodes), None
    if fixed is not None:
        held = elastic_model(mesh, BLADE_STEEL, fixed)
        nodes, parts = held.dof_nodes, held.dof_components
    return found, joined(nodes, parts, found, symmetry(), np.zeros(0, dtype=np.int64)), held


def frequencies(mesh: Mesh, count: int = 4, fixed: Any = None) -> list[Any]:
    _, how, held = together(mesh, mesh.surfaces["x0"].nodes if fixed is None else fixed)
    keep = csr_array(([1.0], ([0], [0])), shape=(held.n_dofs, 1))
    sector = Phases(how, held.K, held.M, keep, Accuracy(modes=count), cache=None, listener=None)
    return [sector(k).omega for k in range(N // 2 + 1)]


def test_a_sector_whose_faces_are_meshed_differently_turns_and_moves_along_the_axis_freely() -> None:
    mesh = graded(3)
    found, how, _ = together(mesh)
    assert found.between > 10
    assert found.distance < 1e-12
    x, y, z = mesh.nodes.T
    for field in (np.stack([0 * x, 0 * x, 1 + 0 * x], axis=1), np.stack([-y, x, 0 * z], axis=1)):
        whole = field.ravel()
        assert np.allclose(how.motion(0) @ whole[how.rows], whole, atol=1e-12)


@pytest.mark.parametrize("on_axis", [False, True])
def test_frequencies_of_faces_meshed_differently_are_those_of_the_ring_whose_sectors_are_glued(on_axis: bool) -> None:
    mesh = pie(shift=0.3) if on_axis else graded(2)
    radius = np.hypot(*mesh.nodes.T[:2])
    fixed = np.flatnonzero(radius > 2.0 - 1e-9) if on_axis else mesh.surfaces["x0"].nodes
    axis = np.flatnonzero(radius < 1e-9)
    ring, number = ring_of(mesh, N, axis)
    model = elastic_model(ring, BLADE_STEEL, np.unique(number[:, fixed]))
    low, high = faces(mesh)
    equations: list[Any] = []
    for own, following in zip(number, np.roll(number, -1, axis=0), strict=True):
        onto, nodes = (
            surface_where(ring, np.isin(np.arange(ring.n_nodes), following[low])),
            own[np.setdiff1d(high, axis)],
        )
        equations += tie_equations(ring, nodes, project(ring, onto, ring.nodes[nodes]), "glue")
    glued = model.constrain(equations)
    exact = modes(glued.K, glued.M, 16).omega
    found = frequencies(mesh, 6, fixed)
    every = np.sort([w for k, omega in enumerate(found) for w in np.repeat(omega, 1 if k in (0, N // 2) else 2)])
    assert len(axis) == (0 if not on_axis else 3)
    assert np.allclose(every[:16], exact, rtol=1e-8)


def test_frequencies_of_faces_meshed_differently_converge_to_those_of_faces_that_meet() -> None:
    exact = np.array(frequencies(graded(6, shift=0.0)))
    met = np.abs(np.array(frequencies(graded(4, shift=0.0))) / exact - 1.0).max()
    coarse, fine = (np.abs(np.array(frequencies(graded(cells))) / exact - 1.0).max() for cells in (2, 4))
    assert fine < coarse / 4.0
    assert fine < 2.0 * met


def test_faces_that_lie_apart_are_refused_however_they_are_meshed() -> None:
    mesh = graded(2)
    low, high = faces(mesh)
    at = mesh.nodes[low], mesh.nodes[high]
    with pytest.raises(InputError, match="check sectors, axis and faces"):
        paired(symmetry(sectors=7), mesh.labels[low], mesh.labels[high], at, None, mesh)
    with pytest.raises(InputError, match="from the nearest node of low"):
        paired(symmetry(), mesh.labels[low], mesh.labels[high], at)  # no mesh, no faces
    shorter = mesh.labels[high[np.hypot(*mesh.nodes[high].T[:2]) < 2.5]]
    with pytest.raises(InputError, match="high: found"):
        paired(symmetry(), mesh.labels[low], shorter, (at[0], mesh.nodes[shorter - 1]), None, mesh)
