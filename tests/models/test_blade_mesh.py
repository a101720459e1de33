"""The parametric blade: sizes, conformity, surfaces, volume, first frequency."""

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.meshes import quality
from scipy.integrate import quad
from scipy.sparse.linalg import LinearOperator, eigsh

from slipstick.errors import InputError
from slipstick.fem.boundary import boundary, face_counts
from slipstick.fem.contact_points import contact_patches, spread_nodes
from slipstick.fem.geometry import nodal_normals, volume
from slipstick.fem.loads import area, pressure_load
from slipstick.fem.materials import Material
from slipstick.fem.model import elastic_model
from slipstick.models.blade_mesh import ELEMENT_SIZES, BladeShape, blade_mesh, blade_shape
from slipstick.solve.linear.factorisation import factorise

STEEL = Material(young=200e9, poisson=0.3, density=7850.0)


@pytest.fixture(scope="module")
def small():
    return blade_mesh(blade_shape("small"))


@pytest.mark.parametrize(
    ("size", "low", "high"), [("small", 4500, 5500), ("medium", 28e3, 32e3), ("large", 101_200, 106e3)]
)
def test_sizes_and_conformity(size, low, high):
    mesh = blade_mesh(blade_shape(size))
    free = 3 * (mesh.n_nodes - len(mesh.surface("root").nodes))
    assert low <= free <= high
    assert len(mesh.used_nodes) == mesh.n_nodes
    counts = face_counts(mesh)["quad8"][1]
    assert set(np.unique(counts)) == {1, 2}
    assert len(np.unique(np.round(mesh.nodes, 9), axis=0)) == mesh.n_nodes
    assert quality(mesh)["hex20"].min() > 0.08
    assert np.percentile(quality(mesh)["hex20"], 10) > 0.4
    assert sum(surface.n_faces for surface in mesh.surfaces.values()) == boundary(mesh).n_faces
    total = sum(area(mesh, surface) for surface in mesh.surfaces.values())
    assert total == pytest.approx(area(mesh, boundary(mesh)), rel=1e-12)
    assert np.abs(pressure_load(mesh, boundary(mesh)).reshape(-1, 3).sum(axis=0)).max() < 1e-15


def exact_volume(s: BladeShape) -> float:
    """Sections are cut across the blade, so the volume is the integral of their areas."""
    mean = s.edge_thickness + (1 - s.edge_thickness) * quad(lambda u: u * (1 - u) ** 1.5 / (0.4 * 0.6**1.5), 0, 1)[0]

    def chord(t):
        return s.chord * (1 + (s.taper - 1) * t)

    def thick(t):
        return chord(t) * s.thickness * (1 + (s.thickness_taper - 1) * t)

    def block(t, margin):
        return (chord(t) + 2 * margin) * (thick(t) + 2 * margin)

    length = s.height - s.root_height - s.shroud_height
    aerofoil = length * quad(lambda t: chord(t) * thick(t) * mean, 0, 1)[0]
    return aerofoil + s.root_height * block(0, s.root_margin) + s.shroud_height * block(1, s.shroud_margin)


def test_volume_and_areas_against_the_integrals():
    shape = blade_shape("medium")
    mesh = blade_mesh(shape)
    assert volume(mesh) == pytest.approx(exact_volume(shape), rel=2e-4)
    tip = shape.chord * shape.taper
    width = tip * shape.thickness * shape.thickness_taper + 2 * shape.shroud_margin
    assert area(mesh, mesh.surface("shroud_top")) == pytest.approx((tip + 2 * shape.shroud_margin) * width, rel=1e-4)
    errors = [volume(blade_mesh(BladeShape(element_size=h))) / exact_volume(shape) - 1 for h in (8e-3, 4e-3)]
    assert abs(errors[1]) < abs(errors[0]) / 4


def test_surfaces_face_where_they_should(small):
    top, root = small.surface("shroud_top"), small.surface("root")
    np.testing.assert_allclose(small.nodes[top.nodes][:, 2], 0.22)
    np.testing.assert_allclose(small.nodes[root.nodes][:, 2], 0.0)
    np.testing.assert_allclose(
        nodal_normals(small, top)[top.nodes], np.tile([0, 0, 1.0], (len(top.nodes), 1)), atol=1e-14
    )
    for name, sign in (("concave", -1.0), ("convex", 1.0)):
        surface = small.surface(name)
        low = surface.nodes[small.nodes[surface.nodes, 2] < 0.05]
        assert np.all(sign * nodal_normals(small, surface)[low, 1] > 0.5)
    push = pressure_load(small, small.surface("concave"), 1e3).reshape(-1, 3).sum(axis=0)
    assert push[1] > 0.0
    down = pressure_load(small, small.surface("platform")).reshape(-1, 3).sum(axis=0)
    assert down[2] == pytest.approx(-area(small, small.surface("platform")))


def test_first_frequency_and_contacts(small):
    model = elastic_model(small, STEEL, "root")
    solve = factorise(model.K).solve
    inverse = LinearOperator(model.K.shape, matvec=solve)
    value = eigsh(
        model.K, 1, model.M, sigma=0.0, OPinv=inverse, v0=np.ones(model.K.shape[0]), return_eigenvectors=False
    )
    assert np.sqrt(value[0]) / (2 * np.pi) == pytest.approx(209.2, rel=0.01)  # 209.18 Hz on the large mesh
    top = small.surface("shroud_top")
    patches = contact_patches(small, top, spread_nodes(small, top, 8))
    assert patches.points.areas.min() > 0.5 * patches.points.areas.max() / 1.6
    columns = model.restrict(patches.directions(patches.points.tangents([0.0, 1.0, 0.0]))).toarray()
    compliance = columns.T @ solve(columns)
    assert np.linalg.eigvalsh(compliance).min() > 0.0


def test_shape_faults_come_all_at_once():
    with pytest.raises(InputError) as fault:
        BladeShape(chord=-1.0, twist=100.0, camber=0.4, element_size=float("nan"))
    assert len(fault.value.sentences) == 4
    with raises_fault("blade", "height", says="leaves no aerofoil"):
        BladeShape(height=0.02)
    with raises_fault("blade", "element_size", found="5.0, which is not below the chord, 0.06"):
        BladeShape(element_size=5.0)
    with raises_fault("size", found="'huge'"):
        blade_shape("huge")
    assert set(ELEMENT_SIZES) == {"small", "medium", "large"}


def test_other_shapes_mesh_as_well():
    for change in ({"twist": -60.0}, {"camber": 0.0}, {"taper": 1.2}, {"edge_thickness": 0.8}, {"shroud_margin": 0.02}):
        mesh = blade_mesh(BladeShape(element_size=7e-3, **change))
        assert quality(mesh)["hex20"].min() > 0.0
