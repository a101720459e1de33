"""Jacobians against numpy, gradients of linear fields, areas and volumes of moved bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.meshes import quality

from slipstick.errors import InputError
from slipstick.fem.assembly import assemble
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.geometry import (
    determinant_and_inverse,
    face_geometry,
    hourglass_warnings,
    require_positive,
    solid_gradients,
    volume,
)
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh

A = np.array([[1.2, 0.3, -0.1], [0.2, 0.9, 0.4], [-0.3, 0.1, 1.1]])
KINDS = sorted(ELEMENTS)


def turned(kind):
    mesh = box((1.0, 2.0, 0.5), (2, 2, 1), kind)
    return replace(mesh, nodes=mesh.nodes @ A.T + [3.0, -1.0, 7.0])


def test_cofactors_are_the_inverse():
    matrices = np.random.default_rng(0).normal(size=(4, 5, 3, 3))
    determinant, inverse = determinant_and_inverse(matrices)
    np.testing.assert_allclose(determinant, np.linalg.det(matrices), rtol=1e-11)
    np.testing.assert_allclose(inverse @ matrices, np.tile(np.eye(3), (4, 5, 1, 1)), atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_volume_changes_by_the_determinant(kind):
    mesh = turned(kind)
    assert volume(mesh) == pytest.approx(np.linalg.det(A), rel=1e-13)
    for element, block in mesh.items():
        gradients, weights = solid_gradients(mesh, element, 0, block)
        slope = np.array([0.3, -2.0, 1.0])
        field = (mesh.nodes @ slope)[block]
        found = np.einsum("eqna,en->eqa", gradients, field)
        np.testing.assert_allclose(found, np.broadcast_to(slope, found.shape), atol=1e-11)
        assert weights.sum() == pytest.approx(volume(mesh))


@pytest.mark.parametrize("kind", KINDS)
def test_normals_point_out_and_close_the_body(kind):
    """The area vectors of a closed surface sum to zero, and by them the volume is that of the divergence theorem."""
    from slipstick.fem.boundary import boundary

    mesh = turned(kind)
    total, flux = np.zeros(3), 0.0
    for faces, values, weights, normals in face_geometry(mesh, boundary(mesh)):
        vectors = weights[..., None] * normals
        total += vectors.sum(axis=(0, 1))
        flux += float(np.einsum("mqa,qn,mna->", vectors, values, mesh.nodes[faces])) / 3
    np.testing.assert_allclose(total, 0.0, atol=1e-12)
    assert flux == pytest.approx(volume(mesh), rel=1e-12)


def test_quality_is_one_for_a_parallelepiped_and_falls_with_distortion():
    mesh = turned("hex8")
    np.testing.assert_allclose(quality(mesh)["hex8"], 1.0, rtol=1e-12)
    nodes = mesh.nodes.copy()
    nodes[0] = 0.6 * nodes[0] + 0.4 * nodes[mesh.blocks["hex8"][0]].mean(axis=0)
    assert quality(replace(mesh, nodes=nodes))["hex8"][0] < 0.9


def test_elements_that_cannot_be_used_are_named_with_their_label():
    mesh = box((1.0, 1.0, 1.0), (2, 1, 1), "hex8")
    labelled = replace(mesh, element_labels={"hex8": np.array([70, 71])})
    (element, _) = next(labelled.items())
    require_positive(labelled, element, 0, np.ones((2, 8)))
    with pytest.raises(InputError, match="hex8 element 71 is inside out"):
        require_positive(labelled, element, 0, np.array([[1.0] * 8, [-1.0] * 8]))
    with pytest.raises(InputError, match="hex8 element 71 is too distorted"):
        require_positive(labelled, element, 1, np.array([[-1.0] + [1.0] * 7]))


SOLID = Material(young=1.0, poisson=0.3, density=1.0)


def free_motions(mesh: Mesh) -> int:
    squares = np.linalg.eigvalsh(assemble(mesh, SOLID).stiffness.toarray())
    return int((squares < 1e-10 * squares[-1]).sum())


@pytest.mark.parametrize(
    ("divisions", "more", "said"),
    [((1, 1, 1), 6, 1), ((3, 1, 1), 4, 3), ((1, 1, 2), 3, 2), ((2, 2, 1), 0, 0), ((1, 2, 3), 0, 0), ((2, 2, 2), 0, 0)],
)
def test_rows_of_single_elements_are_named_and_those_alone(divisions, more, said):
    """Motions without stiffness besides the six rigid ones, of bricks in line."""
    mesh = box(tuple(map(float, divisions)), divisions, "hex20r")
    assert free_motions(mesh) == 6 + more
    warnings = list(hourglass_warnings(mesh, "m"))
    assert len(warnings) == (said > 0)
    assert all(text.startswith(f"m: {said} hex20r elements, as 1, have") for text in warnings)
    full = Mesh(nodes=mesh.nodes, blocks={"hex20": mesh.blocks["hex20r"]})
    assert free_motions(full) == 6
    assert list(hourglass_warnings(full, "m")) == []


def test_neighbours_of_any_type_count():
    """A fin of two bricks on a block is named, one brick between two of another type in two directions is not."""
    mesh = box((4.0, 2.0, 2.0), (4, 2, 2), "hex20r")
    block = mesh.blocks["hex20r"]
    middles = mesh.nodes[block].mean(axis=1)
    fin = (middles[:, 0] > 2.0) & ((middles[:, 1] > 1.0) | (middles[:, 2] > 1.0))
    (said,) = hourglass_warnings(Mesh(nodes=mesh.nodes, blocks={"hex20r": block[~fin]}), "m")
    assert said.startswith("m: 2 hex20r elements")
    plate = box((2.0, 2.0, 1.0), (2, 2, 1), "hex20r")
    one, others = plate.blocks["hex20r"][:1], plate.blocks["hex20r"][1:]
    assert list(hourglass_warnings(Mesh(nodes=plate.nodes, blocks={"hex20r": one, "hex20": others}), "m")) == []


def test_a_row_that_is_bent_hides_motions_of_hardly_any_stiffness():
    """Not singular, and a natural frequency 80 % below that of full integration: the number of the warning."""
    from scipy.linalg import eigh

    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")
    nodes = mesh.nodes + 0.05 * np.sin(3.0 * mesh.nodes[:, [1, 2, 0]] + 1.0)
    free = np.setdiff1d(np.arange(3 * mesh.n_nodes), (3 * mesh.surface("x0").nodes[:, None] + np.arange(3)).ravel())
    first = {}
    for kind in ("hex20", "hex20r"):
        matrices = assemble(Mesh(nodes=nodes, blocks={kind: mesh.blocks["hex20"]}), SOLID)
        K, M = (matrix[free][:, free].toarray() for matrix in (matrices.stiffness, matrices.mass))
        first[kind] = np.sqrt(eigh(K, M, eigvals_only=True)[0])
    assert 0.15 < first["hex20r"] / first["hex20"] < 0.25
