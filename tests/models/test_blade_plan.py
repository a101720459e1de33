"""The plan of the blade mesh: faces that fill the block around the section, counter-clockwise and conforming."""

import numpy as np
import pytest

from slipstick.fem.elements import FACES
from slipstick.models.blade_mesh import plan_of


def section(u, v):
    return np.stack([u, 0.2 * v + 0.1 * u], axis=1)


def block(u, v):
    """The outline of the section goes to that of a larger square."""
    return np.stack([3.0 * u - 1.0, 3.0 * v - 1.0], axis=1)


def areas(points, faces):
    """Area of each 8-node face, by the face's own rule."""
    element = FACES["quad8"]
    _, gradients = element.at_rule
    jacobian = np.einsum("fna,qnd->fqad", points[faces], gradients)
    return np.linalg.det(jacobian) @ element.rule.weights


@pytest.mark.parametrize(("along", "across", "ring"), [(1, 1, 1), (4, 2, 1), (6, 3, 2)])
def test_faces_fill_the_section_and_the_block_around_it(along, across, ring):
    plan = plan_of(along, across, ring)
    points = plan.place(section, block)
    found = areas(points, plan.faces)
    assert found.min() > 0
    assert len(plan.faces) == along * across + 2 * (along + across) * ring
    assert found[: plan.n_core_faces].sum() == pytest.approx(0.2)
    assert found.sum() == pytest.approx(9.0)
    assert len(np.unique(points.round(9), axis=0)) == plan.n_nodes
    assert set(np.unique(plan.faces)) == set(range(plan.n_nodes))


def test_every_edge_is_shared_by_two_or_lies_outside():
    plan = plan_of(3, 2, 2)
    edges = np.concatenate([plan.faces[:, [a, (a + 1) % 4, 4 + a]] for a in range(4)])
    keys, counts = np.unique(np.sort(edges[:, :2], axis=1), axis=0, return_counts=True)
    assert set(counts.tolist()) == {1, 2}
    points = plan.place(section, block)
    outer = keys[counts == 1]
    assert np.all(np.abs(np.abs(points[outer] - 0.5) - 1.5).min(axis=2) < 1e-12)
    middles = {}
    for a, b, m in edges:
        assert middles.setdefault((min(a, b), max(a, b)), m) == m


def test_sides_and_corners():
    plan = plan_of(3, 2, 1)
    points = plan.place(section, block)
    assert np.array_equal(np.flatnonzero(plan.is_corner), np.unique(plan.faces[:, :4]))
    assert plan.in_core.sum() == len(np.unique(plan.faces[: plan.n_core_faces]))
    for name, v in (("concave", 0.0), ("convex", 0.2)):
        side = points[plan.sides[name]]
        np.testing.assert_allclose(side[:, 1] - 0.1 * side[:, 0], v, atol=1e-15)
        assert len(side) == 7
