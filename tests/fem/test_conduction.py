"""Steady conduction against closed forms."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.assembly import assemble
from slipstick.fem.box import box
from slipstick.fem.conduction import conductance, influence_matrix, steady_temperature
from slipstick.fem.contact_points import contact_patches, spread_nodes
from slipstick.fem.loads import area, film_matrix
from slipstick.fem.materials import Material

METAL = Material(young=1.0, poisson=0.3, conductivity=25.0)


@pytest.mark.parametrize(("kind", "tolerance"), [("hex20", 1e-4), ("tet10", 3e-4), ("wedge15", 3e-4), ("hex8", 1e-2)])
def test_fin_with_heat_at_its_tip(kind, tolerance):
    """theta_tip = q tanh(m L) / sqrt(h P k A); the fin formula itself neglects h a / k = 4e-4 across the fin."""
    length, side, film, heat = 0.1, 0.002, 100.0, 3.0
    mesh = box((length, side, side), (40, 1, 1), kind)
    matrix = conductance(mesh, assemble(mesh, METAL).conduction, dict.fromkeys(("y0", "y1", "z0", "z1"), film))
    tip = mesh.surface("x1")
    theta = steady_temperature(
        matrix, film_matrix(mesh, tip, heat / area(mesh, tip)).sum(axis=1), fixed=mesh.node_set("x0")
    )
    perimeter, section = 4 * side, side**2
    m = np.sqrt(film * perimeter / (25.0 * section))
    exact = heat * np.tanh(m * length) / np.sqrt(film * perimeter * 25.0 * section)
    biot = film * side / (25.0 * 4)
    assert theta[tip.nodes].mean() == pytest.approx(exact, rel=tolerance + biot)
    middle = np.abs(mesh.nodes[:, 0] - length / 2) < 1e-9
    inside = exact * np.sinh(m * length / 2) / np.sinh(m * length)
    assert theta[middle].mean() == pytest.approx(inside, rel=tolerance + 2 * biot)


def test_slab_between_film_and_fixed_temperature():
    mesh = box((0.5, 0.1, 0.1), (3, 2, 2), "tet10")
    matrix = conductance(mesh, assemble(mesh, METAL).conduction, {"x1": 50.0})
    theta = steady_temperature(matrix, np.zeros(mesh.n_nodes), fixed=mesh.node_set("x0"), values=100.0)
    exact = 100.0 * (1.0 - mesh.nodes[:, 0] * 50.0 / (25.0 + 50.0 * 0.5))
    np.testing.assert_allclose(theta, exact, atol=1e-10)


def test_disc_source_on_a_half_space():
    """Uniform flux over a disc of radius a: mean rise 8 q / (3 pi^2 k a); a large block stands for the half space."""
    a, size = 0.1, 3.0
    mesh = graded_block(size, a)
    top = mesh.surface("z1")
    matrix = conductance(mesh, assemble(mesh, METAL).conduction, {})
    centre = [[0.0, 0.0, size]]
    patches = contact_patches(mesh, top, centre, radius=a)
    rise = influence_matrix(matrix, patches.weights, fixed=mesh.node_set("far"))[0, 0]
    # a quarter of the space: a quarter of the heat gives the same rise
    exact = parabolic_mean(a, 25.0) * 4.0
    assert rise == pytest.approx(exact - 4.0 / (2 * np.pi * 25.0 * size), rel=0.03)


def parabolic_mean(a: float, k: float) -> float:
    """Mean, weighted by 1 - (r/a)^2, of the rise by one watt of the same density on a half space."""
    kappa = np.linspace(1e-6, 4000.0, 800_001)
    from scipy.special import jv

    transform = 8.0 * jv(2, kappa) / kappa**2  # Hankel transform of the density, one at kappa = 0
    return float(np.sum(transform**2) * (kappa[1] - kappa[0]) / (2 * np.pi * k * a))


def graded_block(size: float, a: float):
    """Quarter block [0, size]^3 with elements that grow away from the corner (0, 0, size)."""
    from slipstick.fem.boundary import surface_where
    from slipstick.fem.mesh import Mesh

    unit = box((1.0, 1.0, 1.0), (9, 9, 9), "hex20")
    grow = lambda s: size * (np.exp(4.0 * s) - 1.0) / (np.exp(4.0) - 1.0)  # noqa: E731
    nodes = grow(unit.nodes)
    nodes[:, 2] = size - grow(1.0 - unit.nodes[:, 2])
    mesh = Mesh(nodes=nodes, blocks=unit.blocks)
    far = (nodes[:, 0] > size - 1e-9) | (nodes[:, 1] > size - 1e-9) | (nodes[:, 2] < 1e-9)
    return Mesh(
        nodes=nodes,
        blocks=unit.blocks,
        surfaces={"z1": surface_where(mesh, nodes[:, 2] > size - 1e-9)},
        node_sets={"far": np.flatnonzero(far)},
    )


def test_influence_matrix():
    mesh = box((0.1, 0.1, 0.05), (8, 8, 4), "hex20")
    matrix = conductance(mesh, assemble(mesh, METAL).conduction, {"x0": 200.0, "z1": 200.0})
    patches = contact_patches(mesh, mesh.surface("z1"), spread_nodes(mesh, mesh.surface("z1"), 4))
    R = influence_matrix(matrix, patches.weights)
    np.testing.assert_array_equal(R, R.T)
    assert R.min() > 0.0
    assert np.all(np.diag(R) > R.sum(axis=1) - np.diag(R) - np.diag(R))
    np.testing.assert_allclose(influence_matrix(matrix, patches.weights, solve=_dense), R, rtol=1e-9)
    with pytest.raises(InputError, match="carries the heat away"):
        influence_matrix(assemble(mesh, METAL).conduction, patches.weights)
    with pytest.raises(InputError, match="convection coefficient"):
        conductance(mesh, matrix, {"x0": -1.0})


def _dense(A, B):
    return np.linalg.solve(A.toarray(), B)
