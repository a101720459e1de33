"""Own directions of nodes: what is said along them, said in global directions."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.equations import NodalEquation, cylindrical, in_global, rectangular, supports
from slipstick.structure.constraints import Dependent

AXES = rectangular(np.array([1.0, 2.0, 0.5]), np.array([-1.0, 1.0, 0.0]))


def test_axes_are_orthonormal_and_right_handed():
    for axes in (AXES, cylindrical(np.zeros(3), np.array([0.0, 0.0, 2.0]), np.array([1.0, 1.0, 5.0]))):
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
        assert np.linalg.det(axes) == pytest.approx(1.0)


def test_cylindrical_directions():
    axes = cylindrical(np.zeros(3), np.array([0.0, 0.0, 2.0]), np.array([0.0, 3.0, 7.0]))
    np.testing.assert_allclose(axes, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-15)
    on_the_axis = cylindrical(np.zeros(3), np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.0, 7.0]))
    np.testing.assert_allclose(on_the_axis @ on_the_axis.T, np.eye(3), atol=1e-15)


def test_points_on_a_line_are_no_axes():
    with pytest.raises(InputError, match="points on one line"):
        rectangular(np.array([1.0, 0.0, 0.0]), np.array([2.0, 0.0, 0.0]))


def test_an_equation_along_own_directions():
    (plain, turned) = in_global(
        [NodalEquation(terms=((1, 0, 1.0), (2, 2, -1.0))), NodalEquation(terms=((3, 1, 2.0), (1, 0, 1.0)))], {3: AXES}
    )
    assert plain.terms == ((1, 0, 1.0), (2, 2, -1.0))
    u = np.array([0.3, -0.7, 0.2])
    value = sum(factor * u[axis] for node, axis, factor in turned.terms if node == 3)
    assert value == pytest.approx(2.0 * AXES[1] @ u)
    assert turned.dependent is Dependent.ANY


def test_supports_along_own_directions():
    held = {(1, 0), (3, 2), (4, 0), (4, 1), (4, 2)}
    plain, along = supports(held, {3: AXES, 4: AXES}, "a file")
    assert plain == {(1, 0), (4, 0), (4, 1), (4, 2)}  # all three of a node are the global ones
    (equation,) = along
    u = np.cross(AXES[2], [0.1, 0.2, 0.3])  # across the third direction
    assert sum(factor * u[axis] for _, axis, factor in equation.terms) == pytest.approx(0.0)
