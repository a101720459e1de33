"""Bricks of mean strain and of incompatible modes: no locking, and nothing else lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.bending import bending
from scipy.sparse.linalg import eigsh, spsolve

from slipstick.fem.assembly import HOURGLASS, assemble, conduction
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import elastic_model
from slipstick.fem.refine import quadratic
from slipstick.fem.strains import chosen_elements, strain_matrix

SOLID = Material(young=2.0, poisson=0.3, density=3.0, conductivity=1.5)
KINDS = ("hex8r", "hex8i")


def distorted(kind: str, divisions: tuple[int, int, int]) -> Mesh:
    mesh = box((1.0, 1.2, 0.9), divisions, kind)
    shift = np.random.default_rng(3).uniform(-0.08, 0.08, mesh.nodes.shape)
    return replace(mesh, nodes=mesh.nodes + shift)


@pytest.mark.parametrize("kind", KINDS)
def test_patch(kind):
    """A linear motion of the boundary goes on inside, however the elements are distorted."""
    mesh = distorted(kind, (3, 3, 3))
    K = assemble(mesh, SOLID).stiffness
    wanted = (mesh.nodes @ np.array([[0.3, -0.2, 0.5], [0.7, 0.1, -0.4], [0.2, 0.6, -0.8]]) + 1.0).ravel()
    outside = np.unique(np.concatenate([surface.nodes for surface in mesh.surfaces.values()]))
    held = np.zeros((mesh.n_nodes, 3), dtype=bool)
    held[outside] = True
    free = ~held.ravel()
    inside = spsolve(K[free][:, free].tocsc(), -(K[free][:, ~free] @ wanted[~free]))
    assert free.sum() == 24
    np.testing.assert_allclose(inside, wanted[free], atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_one_element_moves_freely_as_a_rigid_body_alone(kind):
    values = np.linalg.eigvalsh(assemble(distorted(kind, (1, 1, 1)), SOLID).stiffness.toarray())
    assert np.abs(values[:6]).max() < 1e-14
    assert values[6] > (1e-3 if kind == "hex8r" else 1e-2)  # the smallest is an hourglass motion


@pytest.mark.parametrize("kind", KINDS)
def test_heat_and_mass_are_those_of_the_full_brick(kind):
    one, full = (assemble(distorted(name, (2, 1, 1)), SOLID) for name in (kind, "hex8"))
    assert abs(one.mass - full.mass).max() == 0.0
    assert abs(one.conduction - full.conduction).max() < 1e-15
    assert abs(conduction(distorted(kind, (2, 1, 1)), SOLID) - full.conduction).max() < 1e-15


@pytest.mark.parametrize("length", [1.0, 4.0])
def test_incompatible_modes_bend_as_a_beam(length):
    """One element across is exact in pure bending, whatever its length."""
    assert bending(box((8.0 * length, 1.0, 1.0), (8, 1, 1), "hex8i")) == pytest.approx(1.0, rel=1e-10)


@pytest.mark.parametrize("across", [1, 2, 4])
def test_mean_strain_bends_by_steps_of_stress(across):
    """A stress of one step each has 1 - 1/n^2 of the energy, and the hourglass stiffness adds its share.

    To 0.5 %: the hourglass forces move the layers a little against each other.
    """
    size, shear = 1.0 / across, 1.0 / 2.6
    squares = 0.5 * (1.0 + 2.0 / size**2)  # of the mean gradients of bricks of length 1
    hourglass = HOURGLASS * shear * squares * 64.0 / 2.0  # per volume, of a pattern of amplitude 1
    strain = (1.0 / 12.0) / 2.0 * size**2  # energy of the slope of stress in one element, per curvature and volume
    amplitude = size / 4.0  # of the pattern in an element of this curvature
    wanted = 1.0 - 1.0 / across**2 + hourglass * amplitude**2 / (strain * across**2)
    assert bending(box((8.0, 1.0, 1.0), (8, across, across), "hex8r")) == pytest.approx(wanted, rel=5e-3)


@pytest.mark.parametrize("length, width", [(1.0, 1.0), (2.0, 1.0), (2.0, 0.5), (1.0, 2.0), (5.0, 0.5)])
def test_one_mean_strain_across_bends_by_its_edges(length, width):
    """By the hourglass stiffness alone; the second moment is that of the width, nu = 0.3."""
    wanted = 0.12 / 2.6 * (1.0 + length**2 + (length / width) ** 2)
    mesh = box((8.0 * length, width, 1.0), (8, 1, 1), "hex8r")
    assert bending(mesh) / width == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("kind, errors", [("hex8i", (6e-3, 2e-3)), ("hex8r", (0.16, 0.05))])
def test_a_cantilever_approaches_the_frequency_of_beam_theory(kind, errors):
    """Of Timoshenko's beam; from above by incompatible modes, from below by mean strain."""
    length, found = 20.0, []
    for across in (2, 4):
        mesh = box((length, 1.0, 1.0), (10 * across, across, across), kind)
        model = elastic_model(mesh, Material(young=1.0, poisson=0.0, density=1.0), "x0")
        found.append(float(np.sqrt(eigsh(model.K, 1, model.M, sigma=0.0, return_eigenvectors=False)[0])))
    slender = 1.8751040687**2 / length**2 / np.sqrt(12.0)
    for value, error in zip(found, errors, strict=True):
        assert abs(value / slender - 1.0) < error
    assert (found[0] < found[1]) == (kind == "hex8r")


@pytest.mark.parametrize("kind", KINDS)
def test_stress_at_the_middle_of_a_bent_beam(kind):
    """The strain of pure bending at the centroids, where both elements have it best; their nodes have the same."""
    mesh = box((4.0, 1.0, 1.0), (4, 2, 2), kind)
    x, y, z = (mesh.nodes - [0.0, 0.5, 0.5]).T
    u = np.stack([x * z, 0.0 * y, -(x**2) / 2.0], axis=1).ravel()
    places, matrix = strain_matrix(mesh, SOLID, chosen_elements(mesh, "all"), "elements")
    found = (matrix.T @ u).reshape(-1, 6)
    np.testing.assert_allclose(found[:, 0], places.positions[:, 2] - 0.5, atol=1e-13)
    np.testing.assert_allclose(found[:, 1:], 0.0, atol=1e-13)
    one = replace(mesh, blocks={kind: mesh.blocks[kind][:1]}, element_sets={}, element_labels=None)
    _, at_nodes = strain_matrix(one, SOLID, chosen_elements(one, "all"), "nodes")
    np.testing.assert_allclose((at_nodes.T @ u).reshape(-1, 6), np.tile(found[0], (8, 1)), atol=1e-13)


def test_bricks_of_all_kinds_become_the_same_quadratic_one():
    mesh = box((4.0, 1.0, 1.0), (4, 1, 1), "hex8")
    block = mesh.blocks["hex8"]
    mixed = Mesh(
        nodes=mesh.nodes,
        blocks={"hex8r": block[:1], "hex8": block[1:2], "hex8i": block[2:]},
        element_sets={"some": {"hex8r": np.array([0]), "hex8i": np.array([1])}},
        element_labels={"hex8r": np.array([7]), "hex8": np.array([5]), "hex8i": np.array([2, 9])},
    )
    fine = quadratic(mixed)
    np.testing.assert_array_equal(fine.blocks["hex20"], quadratic(mesh).blocks["hex20"])
    np.testing.assert_array_equal(fine.element_sets["some"]["hex20"], [0, 3])
    np.testing.assert_array_equal(fine.element_labels["hex20"], [7, 5, 2, 9])
    assert ELEMENTS["hex8r"].mean_strain
