"""Polynomial spaces: their sizes, and that nodal bases reproduce every function of the space."""

import numpy as np
import pytest

from slipstick.fem.elements import ELEMENTS, FACES
from slipstick.fem.shapes import serendipity, total_degree, wedge

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
