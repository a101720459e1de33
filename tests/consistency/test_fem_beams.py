"""Vibration of beams and observed orders of convergence."""

import numpy as np
import pytest
import scipy.linalg
from scipy.sparse.linalg import LinearOperator, eigsh

from slipstick.errors import InputError
from slipstick.fem.assembly import assemble
from slipstick.fem.box import box
from slipstick.fem.conduction import steady_temperature
from slipstick.fem.geometry import volume
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import elastic_model
from slipstick.fem.refine import quadratic
from slipstick.solve.linear.factorisation import factorise

STEEL = Material(young=200e9, poisson=0.0, density=7850.0)


def frequencies(model, count: int):
    factors = factorise(model.K)
    inverse = LinearOperator(model.K.shape, matvec=factors.solve)
    start = np.linspace(1.0, 2.0, model.K.shape[0])
    values = eigsh(model.K, count, model.M, sigma=0.0, OPinv=inverse, v0=start, return_eigenvectors=False)
    return np.sqrt(np.sort(values))


@pytest.mark.parametrize(("kind", "tolerance"), [("hex20", 6e-4), ("tet10", 6e-3), ("wedge15", 2e-3)])
def test_cantilever_against_timoshenko(kind, tolerance):
    length, b, h = 1.0, 0.05, 0.08
    model = elastic_model(box((length, b, h), (20, 2, 2), kind), STEEL, "x0")
    found = frequencies(model, 4)
    exact = sorted([*timoshenko(length, b, h)[:2], *timoshenko(length, h, b)[:2]])
    np.testing.assert_allclose(found, exact, rtol=tolerance)
    euler = 1.8751041**2 * np.sqrt(200e9 * b**2 / 12 / (7850.0 * length**4))
    assert found[0] == pytest.approx(euler, rel=6e-3)


def timoshenko(length: float, b: float, h: float, n: int = 40):
    """Bending in h of a cantilever, shear factor 5/6 (Poisson 0), by a Legendre-Ritz method, converged."""
    area, inertia, shear = b * h, b * h**3 / 12, 100e9 * 5 / 6
    x, w = np.polynomial.legendre.leggauss(60)
    s, w = (x + 1) / 2, w / 2 * length
    phi = np.stack([s * np.polynomial.legendre.legval(x, np.eye(n)[k]) for k in range(n // 2)])
    base = [np.polynomial.legendre.Legendre(np.eye(n)[k]) * np.polynomial.Legendre([0.5, 0.5]) for k in range(n // 2)]
    slope = np.stack([p.deriv()(x) * 2 / length for p in base])
    zero = np.zeros_like(phi)
    deflection, rotation = np.vstack([phi, zero]), np.vstack([zero, phi])
    shear_strain = np.vstack([slope, -phi])
    bending = np.vstack([zero, slope])
    K = (shear_strain * (shear * area * w)) @ shear_strain.T + (bending * (200e9 * inertia * w)) @ bending.T
    M = (deflection * (7850.0 * area * w)) @ deflection.T + (rotation * (7850.0 * inertia * w)) @ rotation.T
    return np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True)[:5])


@pytest.mark.parametrize(
    ("kind", "order"), [("hex8", 2), ("tet4", 2), ("wedge6", 2), ("hex20", 4), ("tet10", 4), ("wedge15", 4)]
)
def test_frequencies_converge_with_twice_the_degree(kind, order):
    """Fixed-fixed bar in shear-free axial vibration: omega = pi / L sqrt(E / rho) with Poisson 0, error O(h^(2 p))."""
    errors = []
    exact = np.pi / 2 * np.sqrt(200e9 / 7850.0)
    for n in (3, 6):
        mesh = box((2.0, 0.5, 0.5), (n, 1, 1), kind)
        matrices = assemble(mesh, STEEL)
        inside = np.flatnonzero((mesh.nodes[:, 0] > 1e-9) & (mesh.nodes[:, 0] < 2 - 1e-9))
        axial = 3 * inside
        K, M = (m[axial][:, axial].toarray() for m in (matrices.stiffness, matrices.mass))
        lowest = scipy.linalg.eigh(K, M, eigvals_only=True, subset_by_index=[0, 0])[0]
        errors.append(np.sqrt(lowest) / exact - 1.0)
    assert min(errors) > 0.0
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.35)


@pytest.mark.parametrize(
    ("kind", "order"), [("hex8", 2), ("tet4", 2), ("wedge6", 2), ("hex20", 3), ("tet10", 3), ("wedge15", 3)]
)
def test_temperature_converges_in_the_mean_square(kind, order):
    """-div grad theta = 0 with theta = sin(pi x) sinh(pi y) all round: error O(h^(p + 1)) or better."""
    errors = []
    for n in (4, 8):
        mesh = box((1.0, 1.0, 0.5), (n, n, n), kind)
        matrices = assemble(mesh, Material(young=1.0, poisson=0.0, density=1.0, conductivity=1.0))
        exact = np.sin(np.pi * mesh.nodes[:, 0]) * np.sinh(np.pi * mesh.nodes[:, 1]) / np.sinh(np.pi)
        held = np.unique(np.concatenate([mesh.surface(s).nodes for s in ("x0", "x1", "y0", "y1", "z0", "z1")]))
        theta = steady_temperature(matrices.conduction, np.zeros(mesh.n_nodes), fixed=held, values=exact[held])
        gap = theta - exact
        errors.append(np.sqrt(gap @ matrices.mass[::3, ::3] @ gap))
    assert np.log2(errors[0] / errors[1]) > order - 0.4


def test_linear_mesh_made_quadratic():
    coarse = box((1.0, 1.0, 1.0), (2, 2, 2), "wedge6")
    coarse = Mesh(
        nodes=coarse.nodes,
        blocks=coarse.blocks,
        surfaces=coarse.surfaces,
        node_sets={"top": np.flatnonzero(coarse.nodes[:, 2] == 1.0)},
        node_labels=np.arange(coarse.n_nodes) * 10 + 10,
    )
    fine = quadratic(coarse)
    assert volume(fine) == pytest.approx(1.0)
    assert set(fine.node_set("top")) == set(np.flatnonzero(fine.nodes[:, 2] == 1.0))
    assert set(fine.surface("z1").nodes) == set(fine.node_set("top"))
    assert fine.labels[coarse.n_nodes] == coarse.labels[-1] + 1
    assert quadratic(fine) is fine


def test_model_names_and_constraints():
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex20")
    model = elastic_model(mesh, STEEL, "z0")
    assert len(model.dofs) == model.K.shape[0] == 3 * 12
    free = int(model.free[0] // 3)
    assert model.dofs[:3] == tuple(f"n{free + 1}{axis}" for axis in "xyz")
    np.testing.assert_array_equal(model.indices(np.array([free])), [[0, 1, 2]])
    np.testing.assert_array_equal(model.restrict(np.arange(60.0)), model.free)
    for fixed, sentence in (("bottom", "not in the mesh"), ([], "would float"), (np.arange(20), "every node is fixed")):
        with pytest.raises(InputError, match=sentence):
            elastic_model(mesh, STEEL, fixed)
    with pytest.raises(InputError, match="density"):
        elastic_model(mesh, Material(young=1.0, poisson=0.3), "z0")
    with pytest.raises(InputError, match="is fixed"):
        model.indices(mesh.node_set("z0"))


def test_loose_nodes_are_left_out():
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")
    loose = Mesh(nodes=np.vstack([mesh.nodes, [[5.0, 5.0, 5.0]]]), blocks=mesh.blocks, surfaces=mesh.surfaces)
    model = elastic_model(loose, STEEL, "z0")
    assert len(model.dofs) == 12
