"""Surfaces, surface loads, contact nodes and patches."""

import numpy as np
import pytest
from helpers.faults import raises_fault

from slipstick.fem import contact_points
from slipstick.fem.boundary import boundary
from slipstick.fem.box import box
from slipstick.fem.contact_points import contact_patches, spread_nodes
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.geometry import nodal_normals
from slipstick.fem.loads import (
    area,
    area_weights,
    film_matrix,
    pressure_load,
)
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import elastic_model
from slipstick.solve.linear.factorisation import factorise

SIZE = (1.0, 2.0, 0.5)
AREAS = {"x0": 1.0, "x1": 1.0, "y0": 0.5, "y1": 0.5, "z0": 2.0, "z1": 2.0}


@pytest.mark.parametrize("kind", sorted(ELEMENTS))
def test_sides_of_a_box(kind):
    mesh = box(SIZE, (2, 3, 2), kind)
    for name, surface in mesh.surfaces.items():
        outward = np.zeros(3)
        outward["xyz".index(name[0])] = 1.0 if name[1] == "1" else -1.0
        shares, normals = area_weights(mesh, surface), nodal_normals(mesh, surface)
        assert area(mesh, surface) == pytest.approx(AREAS[name], rel=1e-13)
        assert shares.sum() == pytest.approx(AREAS[name], rel=1e-13)
        assert shares[surface.nodes].min() > 0.0
        np.testing.assert_allclose(normals[surface.nodes], np.tile(outward, (len(surface.nodes), 1)), atol=1e-14)
        force = pressure_load(mesh, surface, 2.0).reshape(-1, 3).sum(axis=0)
        np.testing.assert_allclose(force, -2.0 * AREAS[name] * outward, atol=1e-13)
        assert film_matrix(mesh, surface, 5.0).sum() == pytest.approx(5.0 * AREAS[name])
    skin = boundary(mesh)
    assert area(mesh, skin) == pytest.approx(7.0)
    assert np.abs(pressure_load(mesh, skin).reshape(-1, 3).sum(axis=0)).max() < 1e-13
    moment = np.cross(mesh.nodes, pressure_load(mesh, skin).reshape(-1, 3)).sum(axis=0)
    assert np.abs(moment).max() < 1e-13


def plate(n: int) -> Mesh:
    return box((1.0, 1.0, 0.5), (n, n, max(2, n // 2)), "hex20")


def test_contact_nodes_are_uniform_and_the_same_each_time():
    mesh = plate(8)
    top = mesh.surface("z1")
    nodes = spread_nodes(mesh, top, 4)
    np.testing.assert_array_equal(nodes, spread_nodes(mesh, top, 4))
    assert sorted(map(tuple, mesh.nodes[nodes][:, :2])) == [(0.25, 0.25), (0.25, 0.75), (0.75, 0.25), (0.75, 0.75)]
    nodes = spread_nodes(mesh, top, 9)
    distance = np.linalg.norm(mesh.nodes[nodes][:, None] - mesh.nodes[nodes][None], axis=2) + 9 * np.eye(9)
    assert len(set(nodes.tolist())) == 9
    assert distance.min() > 0.2
    assert len(set(spread_nodes(mesh, top, len(top.nodes)).tolist())) == len(top.nodes)
    with raises_fault("contacts", says="ask for 1 to"):
        spread_nodes(mesh, top, len(top.nodes) + 1)


def test_patches():
    mesh = plate(8)
    top = mesh.surface("z1")
    patches = contact_patches(mesh, top, spread_nodes(mesh, top, 4))
    np.testing.assert_allclose(patches.weights.sum(axis=0), 1.0, atol=1e-14)
    np.testing.assert_allclose(patches.points.normals, np.tile([0, 0, 1.0], (4, 1)), atol=1e-14)
    np.testing.assert_allclose(patches.points.areas, 0.25, rtol=1e-2)
    assert patches.points.areas.sum() == pytest.approx(1.0)
    assert patches.points.share(80.0).sum() == pytest.approx(80.0)
    np.testing.assert_allclose(patches.radii, np.sqrt(patches.points.areas / (2 * np.pi)))
    centroids = patches.weights.T @ mesh.nodes
    np.testing.assert_allclose(centroids, patches.points.positions, atol=2e-3)
    np.testing.assert_allclose(patches.points.tangents([3.0, 4.0, 7.0]), np.tile([0.6, 0.8, 0.0], (4, 1)), atol=1e-14)
    moved = np.tile([1.0, 2.0, 3.0], mesh.n_nodes)
    np.testing.assert_allclose(patches.directions(patches.points.tangents([3.0, 4.0, 0.0])).T @ moved, 2.2)
    with raises_fault("direction", says="is normal to the surface"):
        patches.points.tangents([0.0, 0.0, 1.0])
    with raises_fault("contacts", says="not on the surface"):
        contact_patches(mesh, top, mesh.surface("z0").nodes[:2])
    with raises_fault("contacts", statement="a contact node is given twice"):
        contact_patches(mesh, top, [top.nodes[0], top.nodes[0]])
    with raises_fault("contact patch at [0.0, 0.0, 0.5]", says="too little of the surface"):
        contact_patches(mesh, top, [top.nodes[0]], radius=1e-4)
    with raises_fault("contacts", found="float64 of shape (2,)", expected="node indices (n,) or positions (n, 3)"):
        contact_patches(mesh, top, [0.5, 0.7])


def test_patch_of_triangles_weighs_like_one_of_quadrilaterals():
    """The same integral: mean of x^2 over the patch; the shape functions hold it exactly."""
    means = []
    for kind in ("hex20", "tet10", "wedge15"):
        mesh = box((1.0, 1.0, 0.5), (6, 6, 2), kind)
        patches = contact_patches(mesh, mesh.surface("z1"), [[0.5, 0.5, 0.5]], radius=0.3)
        means.append(float((patches.weights.T @ ((mesh.nodes[:, 0] - 0.5) ** 2))[0]))
    np.testing.assert_allclose(means, 0.3**2 / 6, rtol=3e-3)  # int r^3 cos^2 (1 - r^2) / int r (1 - r^2)


@pytest.mark.verify
def test_patch_compliance_converges_and_point_compliance_does_not():
    steel = Material(young=1.0, poisson=0.3, density=1.0)
    patch, point = [], []
    for n in (4, 8, 16):
        mesh = plate(n)
        model = elastic_model(mesh, steel, "z0")
        patches = contact_patches(mesh, mesh.surface("z1"), [[0.5, 0.5, 0.5]], radius=0.2)
        vertical = 3 * int(patches.nodes[0]) + 2
        columns = np.zeros((3 * mesh.n_nodes, 2))
        columns[:, [0]] = patches.directions(patches.points.normals).toarray()
        columns[vertical, 1] = 1.0
        loads = model.restrict(columns)
        compliance = np.diag(loads.T @ factorise(model.K).solve(loads))
        patch.append(compliance[0])
        point.append(compliance[1])
    assert abs(patch[2] - patch[1]) < 0.01 * patch[2]
    assert abs(patch[2] - patch[1]) < 0.1 * abs(patch[1] - patch[0])
    assert point[1] > 1.2 * point[0]
    assert point[2] > 1.4 * point[1]


def test_the_nearest_of_many_as_by_brute_force():
    """Of those equally near, of which a grid has many, the first; and contact nodes each once."""
    x, y = np.meshgrid(np.arange(14.0), np.arange(11.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    rng = np.random.default_rng(4)
    between = points[::3] + np.array([0.5, 0.5, 0.0])
    for centres in (between, points[rng.permutation(len(points))[:40]], points[:3], points[:1]):
        whole = np.linalg.norm(points[:, None] - centres, axis=2)
        np.testing.assert_array_equal(contact_points.nearest_centres(points, centres), whole.argmin(axis=1))
        chosen = []
        for k in range(len(centres)):
            whole[chosen, k] = np.inf
            chosen.append(int(whole[:, k].argmin()))
        np.testing.assert_array_equal(contact_points._nearest_different(points, centres), chosen)
    crowded = np.repeat(points[:1], 30, axis=0)
    assert len(np.unique(contact_points._nearest_different(points, crowded))) == 30


def test_patches_of_many_contacts_by_all_faces():
    """The weights of each as integrals over the whole surface, of which only what lies in its radius counts."""
    mesh = box((2.0, 1.0, 0.3), (8, 5, 1), "hex20")
    surface = mesh.surface("z1")
    patches = contact_patches(mesh, surface, spread_nodes(mesh, surface, 40))
    for k in range(0, 40, 7):
        weights = np.zeros(mesh.n_nodes)
        for faces, values, places, areas, _ in contact_points._samples(mesh, surface):
            apart = np.linalg.norm(places - patches.points.positions[k], axis=2)
            np.add.at(weights, faces, (areas * np.maximum(1.0 - (apart / patches.radii[k]) ** 2, 0.0)) @ values)
        found = patches.weights[:, [k]].toarray().ravel()
        np.testing.assert_allclose(found, weights / weights.sum(), rtol=0, atol=1e-14)
    assert patches.points.areas.sum() == pytest.approx(2.0)
