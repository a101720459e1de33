"""Surface integrals on curved and flat faces: resultants and moments that closed forms give."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.fem.box import box
from slipstick.fem.geometry import nodal_normals
from slipstick.fem.loads import area, area_weights, film_matrix, pressure_load


def quarter_tube(kind="hex20", radius=2.0, height=3.0):
    """A quarter of a tube of unit thickness; "x1" is its outside."""
    mesh = box((1.0, 1.0, height), (1, 12, 2), kind)
    r, angle = radius - 1.0 + mesh.nodes[:, 0], 0.5 * np.pi * mesh.nodes[:, 1]
    return replace(mesh, nodes=np.stack([r * np.cos(angle), r * np.sin(angle), mesh.nodes[:, 2]], axis=1))


def test_pressure_on_a_quarter_tube_has_the_resultant_of_its_projection():
    mesh = quarter_tube()
    outside = mesh.surface("x1")
    force = pressure_load(mesh, outside, 5.0).reshape(-1, 3).sum(axis=0)
    np.testing.assert_allclose(force, [-5.0 * 2.0 * 3.0, -5.0 * 2.0 * 3.0, 0.0], rtol=1e-4, atol=1e-10)
    assert area(mesh, outside) == pytest.approx(np.pi * 3.0, rel=1e-5)
    normals = nodal_normals(mesh, outside)[outside.nodes]
    radial = mesh.nodes[outside.nodes] * [0.5, 0.5, 0.0]
    np.testing.assert_allclose(normals, radial, atol=0.05)  # at the ends half the angle of a face, 0.065


def test_a_film_is_symmetric_and_takes_heat_out():
    mesh = quarter_tube("wedge15")
    outside = mesh.surface("x1")
    film = film_matrix(mesh, outside, 4.0)
    assert film.sum() == pytest.approx(4.0 * area(mesh, outside))
    assert abs(film - film.T).max() < 1e-14
    assert np.linalg.eigvalsh(film.toarray()).min() > -1e-13


def test_shares_of_the_area_are_positive_where_consistent_ones_are_not():
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex20")
    side = mesh.surface("z1")
    assert film_matrix(mesh, side, 1.0).sum(axis=1).min() < 0.0
    assert area_weights(mesh, side)[side.nodes].min() > 0.0
    assert area_weights(mesh, side).sum() == pytest.approx(1.0)
