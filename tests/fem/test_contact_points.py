"""Contact points: directions along and out of a surface, shares by area, points by number."""

import numpy as np
import pytest
from helpers.faults import raises_fault

from slipstick.fem.contact_points import ContactPoints

NORMALS = np.array([[0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [1.0, 0.0, 0.0]])
POINTS = ContactPoints(positions=np.zeros((3, 3)), normals=NORMALS, areas=np.array([1.0, 2.0, 5.0]))


def test_tangents_are_unit_vectors_along_the_surface_nearest_to_the_direction():
    direction = np.array([1.0, 2.0, 3.0])
    found = POINTS.tangents(direction)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0)
    np.testing.assert_allclose(np.einsum("na,na->n", found, NORMALS), 0.0, atol=1e-15)
    np.testing.assert_allclose(found @ direction, np.linalg.norm(np.cross(NORMALS, direction), axis=1))
    np.testing.assert_allclose(POINTS.tangents(7.0 * direction), found, atol=1e-15)


def test_cosines_name_the_motion_of_each_point():
    assert POINTS.names == ("c1", "c2", "c3")
    assert POINTS.dofs[:4] == ("c1x", "c1y", "c1z", "c2x")
    assert POINTS.normal == [{"c1z": 1.0}, {"c2y": 0.6, "c2z": 0.8}, {"c3x": 1.0}]
    assert POINTS.tangential([0.0, 1.0, 0.0])[0] == {"c1y": 1.0}


@pytest.mark.parametrize(("points", "rows"), [("all", [0, 1, 2]), ([3, 1], [2, 0]), ([2], [1])])
def test_a_total_is_shared_by_area(points, rows):
    assert POINTS.chosen(points) == rows
    shares = POINTS.share(12.0, points)
    assert shares.sum() == pytest.approx(12.0)
    np.testing.assert_allclose(shares / shares[0], POINTS.areas[rows] / POINTS.areas[rows[0]])


@pytest.mark.parametrize("points", [[], [1, 1], [0], [4], "some", [1.5]])
def test_points_that_are_not_there(points):
    with raises_fault("points"):
        POINTS.chosen(points)


def test_resistance_needs_an_influence_matrix():
    with raises_fault("influence", says="the body has no influence matrix"):
        POINTS.resistance()
    R = np.array([[3.0, 1.0, 0.5], [1.0, 2.0, 0.2], [0.5, 0.2, 4.0]])
    hot = ContactPoints(positions=POINTS.positions, normals=NORMALS, areas=POINTS.areas, influence=R)
    np.testing.assert_array_equal(hot.resistance([3, 1], own=[10.0, 20.0]), [[14.0, 0.5], [0.5, 23.0]])
