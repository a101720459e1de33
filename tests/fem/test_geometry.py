"""Jacobians against numpy, gradients of linear fields, areas and volumes of moved bodies."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.geometry import (
    determinant_and_inverse,
    face_geometry,
    quality,
    require_positive,
    solid_gradients,
    volume,
)

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
