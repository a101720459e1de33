"""Elements: nodal bases, rigid bodies, patch tests, quadrature."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.meshes import quality

from slipstick.errors import InputError
from slipstick.fem.assembly import assemble
from slipstick.fem.boundary import boundary, face_counts
from slipstick.fem.box import box
from slipstick.fem.elements import ALIKE, ELEMENTS, FACES, serendipity, total_degree, wedge
from slipstick.fem.geometry import volume
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh

STEEL = Material(young=2.0, poisson=0.3, density=3.0, conductivity=1.5)
KINDS = sorted(ELEMENTS)


def distorted(kind: str, divisions=(2, 2, 2), amount=0.12) -> Mesh:
    """A box whose inner corner nodes are moved; edges stay straight, so linear fields stay in every space."""
    alike = ALIKE.get(kind, kind)
    linear = {"hex20": "hex8", "tet10": "tet4", "wedge15": "wedge6", "pyramid13": "pyramid5"}.get(alike, alike)
    from slipstick.fem.refine import quadratic

    mesh = box((1.0, 1.2, 0.9), divisions, linear)
    inside = np.ones(mesh.n_nodes, dtype=bool)
    inside[boundary(mesh).nodes] = False
    nodes = mesh.nodes.copy()
    nodes[inside] += np.random.default_rng(7).uniform(-amount, amount, (inside.sum(), 3))
    moved = Mesh(nodes=nodes, blocks=mesh.blocks)
    moved = quadratic(moved) if alike != linear else moved
    return replace(moved, blocks={kind: moved.blocks[alike]})


@pytest.mark.parametrize("kind", [*KINDS, *sorted(FACES)])
def test_basis_is_nodal_and_partitions_unity(kind):
    element = {**ELEMENTS, **FACES}[kind]
    values, gradients = element.at_mass_rule
    np.testing.assert_allclose(element.basis(element.basis.nodes)[0], np.eye(element.n_nodes), atol=1e-15)
    np.testing.assert_allclose(values.sum(axis=1), 1.0, atol=2e-15)
    np.testing.assert_allclose(gradients.sum(axis=1), 0.0, atol=4e-15)


@pytest.mark.parametrize("kind", [*KINDS, *sorted(FACES)])
def test_gradients_are_the_derivatives_of_the_values(kind):
    element = {**ELEMENTS, **FACES}[kind]
    points, step = element.rule.points, 1e-5
    for axis in range(points.shape[1]):
        shift = step * np.eye(points.shape[1])[axis]
        difference = (element.basis(points + shift)[0] - element.basis(points - shift)[0]) / (2 * step)
        np.testing.assert_allclose(element.basis(points)[1][:, :, axis], difference, atol=3e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_six_rigid_body_modes_and_no_mechanism(kind):
    mesh = distorted(kind, (2, 2, 1) if kind in ALIKE else (1, 1, 1))
    matrices = assemble(mesh, STEEL)
    eigenvalues = np.linalg.eigvalsh(matrices.stiffness.toarray()) / STEEL.young
    assert np.abs(eigenvalues[:6]).max() < 1e-14
    assert eigenvalues[6] > 1e-4
    heat = np.linalg.eigvalsh(matrices.conduction.toarray())
    assert abs(heat[0]) < 1e-14
    assert heat[1] > 1e-4


def test_single_hexahedra_have_no_hourglass_mode():
    for kind, block in (("hex8", 8), ("hex20", 20)):
        mesh = box((1.0, 1.0, 1.0), (1, 1, 1), kind)
        assert mesh.n_nodes == block
        eigenvalues = np.linalg.eigvalsh(assemble(mesh, STEEL).stiffness.toarray())
        assert (eigenvalues < 1e-10).sum() == 6


@pytest.mark.parametrize("kind", KINDS)
def test_patch_constant_strain_and_gradient(kind):
    mesh = distorted(kind)
    gradient = np.array([[0.3, -0.1, 0.2], [0.05, 0.4, -0.3], [0.1, 0.2, -0.25]])
    exact = (mesh.nodes @ gradient.T).ravel()
    matrices = assemble(mesh, STEEL)
    inside = np.ones(mesh.n_nodes, dtype=bool)
    inside[boundary(mesh).nodes] = False
    assert inside.any()
    free = np.repeat(inside, 3)
    K = matrices.stiffness.toarray()
    found = np.linalg.solve(K[np.ix_(free, free)], -K[np.ix_(free, ~free)] @ exact[~free])
    np.testing.assert_allclose(found, exact[free], atol=1e-12)
    strain = (gradient + gradient.T) / 2
    energy = STEEL.lame / 2 * np.trace(strain) ** 2 + STEEL.shear_modulus * (strain**2).sum()
    assert exact @ K @ exact / 2 == pytest.approx(energy * 1.08, rel=1e-12)
    H, theta = matrices.conduction.toarray(), mesh.nodes @ np.array([1.0, -2.0, 0.5])
    found = np.linalg.solve(H[np.ix_(inside, inside)], -H[np.ix_(inside, ~inside)] @ theta[~inside])
    np.testing.assert_allclose(found, theta[inside], atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_mass_and_volume(kind):
    mesh = distorted(kind)
    M = assemble(mesh, STEEL).mass
    assert volume(mesh) == pytest.approx(1.08, rel=1e-13)
    translation, spin = np.tile([1.0, 0, 0], mesh.n_nodes), np.cross([0, 0, 1.0], mesh.nodes).ravel()
    assert translation @ M @ translation == pytest.approx(3.0 * 1.08, rel=1e-12)
    assert spin @ M @ spin == pytest.approx(3.0 * 1.08 * (1.0 + 1.2**2) / 3, rel=1e-12)
    assert np.linalg.eigvalsh(M.toarray())[0] > 0.0
    assert abs(M - M.T).max() == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_every_inner_face_is_shared_by_two(kind):
    mesh = distorted(kind)
    assert all(counts.max() == 2 for _, counts in face_counts(mesh).values())
    assert 0.0 < quality(mesh)[kind].min() <= 1.0


def test_two_materials():
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")
    halves = Mesh(
        nodes=mesh.nodes,
        blocks=mesh.blocks,
        element_sets={"a": {"hex20": np.array([0])}, "b": {"hex20": np.array([1])}},
    )
    light = Material(young=1.0, poisson=0.2, density=1.0)
    mass = assemble(halves, {"a": light, "b": STEEL}).mass.sum() / 3
    assert mass == pytest.approx(4.0)
    with pytest.raises(InputError, match="no material"):
        assemble(halves, {"a": light})


def test_faults_name_the_element():
    mesh = box((1.0, 1.0, 1.0), (2, 1, 1), "hex8")
    block = mesh.blocks["hex8"].copy()
    block[1] = block[1][[4, 5, 6, 7, 0, 1, 2, 3]]
    with pytest.raises(InputError, match="hex8 element 2 is inside out"):
        assemble(Mesh(nodes=mesh.nodes, blocks={"hex8": block}), STEEL)
    with pytest.raises(InputError, match=r"outside 0\.\.11"):
        Mesh(nodes=mesh.nodes, blocks={"hex8": mesh.blocks["hex8"] + 1})
    with pytest.raises(InputError, match="not known") as fault:
        Mesh(nodes=mesh.nodes, blocks={"hex9": mesh.blocks["hex8"], "hex20": mesh.blocks["hex8"]})
    assert len(fault.value.sentences) == 2
    repeated = mesh.blocks["hex8"].copy()
    repeated[0, 1] = repeated[0, 0]
    with pytest.raises(InputError, match="hex8 element 1 uses a node twice"):
        Mesh(nodes=mesh.nodes, blocks={"hex8": repeated})
    with pytest.raises(InputError, match="it has: x0"):
        mesh.surface("top")
    with pytest.raises(InputError) as fault:
        Material(young=-1.0, poisson=0.5, density=np.nan)
    assert len(fault.value.sentences) == 3


EVERY = {**ELEMENTS, **FACES}


def test_sizes_of_the_spaces():
    assert [len(total_degree(3, d)) for d in (1, 2)] == [4, 10]
    assert [len(serendipity(2, d)) for d in (1, 2)] == [4, 8]
    assert [len(serendipity(3, d)) for d in (1, 2)] == [8, 20]
    assert [len(wedge(d)) for d in (1, 2)] == [6, 15]


@pytest.mark.parametrize("kind", sorted(EVERY))
def test_interpolation_reproduces_the_space(kind):
    basis = EVERY[kind].basis
    points = EVERY[kind].mass_rule.points
    values, gradients = basis(points)
    for exponents in basis.exponents:
        power = np.array(exponents)
        at = lambda x, power=power: np.prod(x**power, axis=1)  # noqa: E731
        np.testing.assert_allclose(values @ at(basis.nodes), at(points), atol=1e-13)
        for axis in range(points.shape[1]):
            lowered = power - (np.arange(power.size) == axis)
            slope = power[axis] * np.prod(points ** np.maximum(lowered, 0), axis=1)
            np.testing.assert_allclose(gradients[:, :, axis] @ at(basis.nodes), slope, atol=1e-13)


@pytest.mark.parametrize("kind", ["pyramid5", "pyramid13"])
def test_a_pyramid_conforms_with_its_neighbours(kind):
    """On a triangular face the functions of the nodes off that face vanish."""
    element = ELEMENTS[kind]
    for shape, local in element.faces:
        if shape.startswith("tri"):
            corners = element.basis.nodes[list(local[:3])]
            share = np.random.default_rng(0).dirichlet(np.ones(3), 20)
            values, _ = element.basis(share @ corners)
            off = [i for i in range(element.n_nodes) if i not in local]
            np.testing.assert_allclose(values[:, off], 0.0, atol=1e-13)
