"""Point masses and springs in the matrices of a model, against small systems by hand."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from slipstick.errors import InputError
from slipstick.fem.lumped import axial_spring, point_mass, spring, with_lumped

ROWS = [(1, 0), (1, 1), (1, 2)]
EMPTY = {name: csr_array((3, 3)) for name in "KM"}


def test_a_mass_moves_in_three_directions():
    found, rows = with_lumped(EMPTY, ROWS, point_mass(1, 2.5))
    assert rows == ROWS
    np.testing.assert_array_equal(found["M"].toarray(), 2.5 * np.eye(3))
    assert found["K"].nnz == 0


def test_a_mass_with_inertia_and_offset_has_the_energy_of_its_rigid_motion():
    inertia, offset = np.diag([1.0, 2.0, 3.0]) + 0.1, np.array([0.3, -0.2, 0.5])
    found, rows = with_lumped(EMPTY, ROWS, point_mass(1, 2.0, inertia, offset))
    assert rows == [(1, axis) for axis in range(6)]
    v, w = np.array([0.4, 0.1, -0.3]), np.array([0.2, -0.5, 0.7])
    twice = 2.0 * np.sum((v + np.cross(w, offset)) ** 2) + w @ inertia @ w
    q = np.concatenate([v, w])
    assert q @ found["M"].toarray() @ q == pytest.approx(twice)


def test_springs():
    ground, rows = with_lumped(EMPTY, ROWS, [spring(4.0, (1, 1))])
    np.testing.assert_array_equal(ground["K"].toarray(), np.diag([0.0, 4.0, 0.0]))
    between, rows = with_lumped(EMPTY, ROWS, [spring(4.0, (1, 1), (2, 0))])
    assert rows == [*ROWS, (2, 0)]
    np.testing.assert_array_equal(between["K"].toarray()[[1, 3]][:, [1, 3]], [[4.0, -4.0], [-4.0, 4.0]])


def test_a_spring_along_a_line_feels_its_length_alone():
    along = np.array([3.0, 0.0, 4.0])
    part = axial_spring(10.0, (1, 2), along, "a spring")
    u = np.array([0.0, 0.7, 0.0, 4.0, 0.0, -3.0])  # across the line
    assert u @ part.values @ u == pytest.approx(0.0)
    u = np.concatenate([along / 5.0, np.zeros(3)])
    assert u @ part.values @ u == pytest.approx(10.0)
    with pytest.raises(InputError, match=r"a spring: .* needs a distance"):
        axial_spring(10.0, (1, 2), np.zeros(3), "a spring")
