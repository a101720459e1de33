"""Nodes on faces and sides of a sector: linear motions go through a tie, turned ones from side to side."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.axis import Axis
from slipstick.fem.box import box
from slipstick.fem.cyclic import CyclicSymmetry, cyclic_equations
from slipstick.fem.equations import NodalEquation
from slipstick.fem.mesh import Mesh
from slipstick.fem.refine import quadratic
from slipstick.fem.ties import face_size, project, tie_equations


def value(equation: NodalEquation, motion: dict[tuple[int, int], float]) -> float:
    return sum(factor * motion[node, axis] for node, axis, factor in equation.terms)


@pytest.mark.parametrize("kind", ["hex8", "hex20", "tet10", "wedge15"])
def test_points_of_a_bent_surface_are_found_on_it(kind):
    mesh = box((1.0, 1.0, 0.4), (3, 3, 1), kind)
    bent = replace(mesh, nodes=mesh.nodes + 0.1 * np.outer(mesh.nodes[:, 0] ** 2, [0.0, 0.0, 1.0]))
    top = bent.surfaces["z1"]
    random = np.random.default_rng(2)
    for faces in filter(len, top.faces.values()):
        face = bent.nodes[faces[random.integers(len(faces), size=20)]]
        shares = random.dirichlet(np.ones(face.shape[1]), size=20)
        inside = np.einsum("mn,mna->ma", shares, face)  # near the surface, not on it
        found = project(bent, top, inside)
        again = project(bent, top, found.places)
        assert again.distances.max() < 1e-9
        np.testing.assert_allclose(again.places, found.places, atol=1e-9)
        np.testing.assert_allclose(found.weights.sum(axis=1), 1.0)
        assert np.all(found.distances <= np.linalg.norm(face - inside[:, None], axis=2).min(axis=1) + 1e-12)


def test_a_point_beyond_the_edge_is_as_far_as_the_edge():
    mesh = box((1.0, 1.0, 1.0), (2, 2, 2), "hex20")
    found = project(mesh, mesh.surfaces["z1"], np.array([[1.3, 0.4, 1.4]]))
    assert found.distances == pytest.approx(0.5)
    np.testing.assert_allclose(found.places, [[1.0, 0.4, 1.0]], atol=1e-12)


@pytest.mark.parametrize("kind", ["hex8", "hex20", "tet10"])
def test_a_linear_motion_goes_through_a_tie_of_meshes_that_do_not_match(kind):
    lower, upper = box((1.0, 1.0, 0.5), (3, 2, 1), kind), box((1.0, 1.0, 0.5), (2, 4, 1), "hex20")
    n = lower.n_nodes
    nodes = np.vstack([lower.nodes, upper.nodes + np.array([0.0, 0.0, 0.5])])
    blocks = dict(lower.blocks)
    blocks["hex20"] = (
        np.vstack([blocks["hex20"], upper.blocks["hex20"] + n]) if kind == "hex20" else (upper.blocks["hex20"] + n)
    )
    mesh = Mesh(nodes=nodes, blocks=blocks)
    own = upper.surfaces["z0"].nodes + n
    found = project(mesh, lower.surfaces["z1"], nodes[own])
    assert found.distances.max() < 1e-12
    field = nodes @ np.random.default_rng(1).normal(size=(3, 3)) + 0.3
    motion = {(int(mesh.labels[i]), axis): field[i, axis] for i in range(len(nodes)) for axis in range(3)}
    equations = list(tie_equations(mesh, own, found, "t"))
    assert len(equations) == 3 * len(own)
    assert max(abs(value(equation, motion)) for equation in equations) < 1e-12


def ring_sector(sectors: int, kind: str = "hex20") -> Mesh:
    """A sector of a ring about z."""
    flat = box((1.0, 1.0, 0.3), (2, 2, 1), {"hex20": "hex8"}.get(kind, kind))
    radius, angle = 1.0 + flat.nodes[:, 0], 2.0 * np.pi / sectors * flat.nodes[:, 1]
    turned = np.stack([radius * np.cos(angle), radius * np.sin(angle), flat.nodes[:, 2]], axis=1)
    mesh = replace(flat, nodes=turned)
    return quadratic(mesh) if kind == "hex20" else mesh


@pytest.mark.parametrize("faces", [True, False])
@pytest.mark.parametrize("swapped", [True, False])
def test_motions_alike_in_all_sectors_pass_from_side_to_side(faces, swapped):
    mesh = ring_sector(9)
    sector = CyclicSymmetry(sectors=9, axis=Axis(point=(0.0, 0.0, -1.0)), low=(), high=())
    one, other = ("y1", "y0") if swapped else ("y0", "y1")
    to = mesh.surfaces[other] if faces else mesh.surfaces[other].nodes
    x, y, _ = mesh.nodes.T
    radius = np.hypot(x, y)
    u = np.stack([(0.3 * x - 0.7 * y) / radius, (0.3 * y + 0.7 * x) / radius, radius**2], axis=1)
    motion = {(int(mesh.labels[i]), axis): u[i, axis] for i in range(mesh.n_nodes) for axis in range(3)}
    equations = list(cyclic_equations(mesh, sector, mesh.surfaces[one].nodes, to, tolerance=1e-9, where="c"))
    assert len(equations) == 3 * len(mesh.surfaces[one].nodes)
    assert max(abs(value(equation, motion)) for equation in equations) < 1e-9


def test_a_wrong_number_of_sectors_is_refused():
    mesh = ring_sector(9)
    sector = CyclicSymmetry(sectors=8, axis=Axis(), low=(), high=())
    with pytest.raises(InputError, match=r"c: node \d+ of one side is"):
        list(cyclic_equations(mesh, sector, mesh.surfaces["y0"].nodes, mesh.surfaces["y1"], tolerance=0.05, where="c"))


def test_face_size_is_the_length_of_its_edges():
    mesh = box((2.0, 1.0, 1.0), (2, 2, 1), "hex20")
    assert face_size(mesh, mesh.surfaces["z1"]) == pytest.approx(0.75)


def test_no_points_and_faces_without_area():
    """Nothing is found of nothing; a face that is a line has its nearest place on the line."""
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")
    assert project(mesh, mesh.surfaces["z1"], np.empty((0, 3))).distances.shape == (0,)
    flat = replace(mesh, nodes=np.where(mesh.nodes[:, 2:] == 1.0, mesh.nodes * [1.0, 0.0, 1.0], mesh.nodes))
    found = project(flat, flat.surfaces["z1"], np.array([[0.25, 0.0, 3.0]]))
    np.testing.assert_allclose(found.places, [[0.25, 0.0, 1.0]], atol=1e-12)
