"""Directions, radius and angle about an axis: closed forms, and the same after a rotation of everything."""

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy.spatial.transform import Rotation

from slipstick.errors import InputError
from slipstick.fem.axis import Axis

PLACES = np.array([[3.0, 0.0, 7.0], [0.0, 2.0, -1.0], [-1.0, 0.0, 0.0], [1.0, -1.0, 0.0]])


def test_about_z():
    axis = Axis()
    np.testing.assert_allclose(axis.radius(PLACES), [3.0, 2.0, 1.0, np.sqrt(2.0)])
    np.testing.assert_allclose(np.abs(axis.angle(PLACES)), [0.0, np.pi / 2, np.pi, np.pi / 4])
    assert axis.angle(PLACES)[3] < 0.0
    frame = axis.frame(PLACES)
    np.testing.assert_allclose(frame["radial"][:3], [[1, 0, 0], [0, 1, 0], [-1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(frame["circumferential"][:3], [[0, 1, 0], [-1, 0, 0], [0, -1, 0]], atol=1e-15)
    np.testing.assert_allclose(frame["axial"], np.tile([0, 0, 1], (4, 1)))


def test_turned_and_moved_together_nothing_changes():
    turn, away = Rotation.from_rotvec([0.3, -1.1, 0.7]), np.array([5.0, -2.0, 1.0])
    moved = Axis(point=away, direction=4.0 * turn.apply([0, 0, 1]), zero=turn.apply([2, 0, 1]))
    places = turn.apply(PLACES) + away
    np.testing.assert_allclose(moved.radius(places), Axis().radius(PLACES), rtol=1e-13)
    turned = np.exp(1j * moved.angle(places)) / np.exp(1j * Axis().angle(PLACES))
    np.testing.assert_allclose(turned, 1.0, atol=1e-13)
    for word, vectors in Axis().frame(PLACES).items():
        np.testing.assert_allclose(moved.frame(places)[word], turn.apply(vectors), atol=1e-13)


def test_angles_grow_as_the_circumferential_direction_points():
    axis = Axis(direction=(1, 2, -1), zero=(0, 0, 1), point=(0.1, 0.2, 0.3))
    step = 1e-6 * axis.frame(PLACES)["circumferential"]
    np.testing.assert_allclose(
        (axis.angle(PLACES + step) - axis.angle(PLACES - step)) / 2e-6, 1.0 / axis.radius(PLACES), rtol=1e-8
    )


def test_where_the_angle_is_zero():
    assert np.allclose(Axis(direction=(1, 0, 0)).zero, (0, 1, 0))
    assert np.allclose(Axis(direction=(0, 1, 0)).zero, (1, 0, 0))
    assert Axis.of({"direction": (0, 0, 1), "zero": (0, 3, 5)}).angle([[0.0, 2.0, 0.0]]) == pytest.approx([0.0])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"direction": (0, 0, 0)}, "axis, direction: found (0, 0, 0); expected a vector other than zero"),
        ({"direction": (0, 1)}, "axis, direction: found (0, 1); expected three finite numbers"),
        ({"direction": (0, 0, 1), "zero": (0, 0, 2)}, "expected a direction that is not along the axis"),
        ({"point": (0, 0, 0)}, "axis: found"),
        ({"direction": (0, 0, 1), "speed": 3}, "axis: found"),
        ("z", "axis: found 'z'"),
    ],
)
def test_faults(given, said):
    with pytest.raises(InputError) as raised:
        Axis.of(given)
    assert said in str(raised.value)


def test_a_place_on_the_axis_has_no_frame():
    with raises_fault("axis", says="point 2 lies on it"):
        Axis().frame([[1.0, 0.0, 0.0], [0.0, 0.0, 4.0]])


def test_one_place_on_a_skew_axis_has_no_frame():
    """Its distance is what rounding leaves of it, not 0."""
    axis = Axis(point=(0.1, 0.2, 0.3), direction=(1.0, 1.0, 1.0))
    with raises_fault("axis", says="point 1 lies on it"):
        axis.frame([np.array([0.1, 0.2, 0.3]) + 0.7 / 3.0])
