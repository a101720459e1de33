"""Thermal strain against closed forms: free bodies, clamped and graded ones, two metals; stiffness at a temperature."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy.sparse.linalg import spsolve

import slipstick as ss
from slipstick.fem.assembly import assemble
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.expansion import at_temperature, expansion_load, free_strain, temperature_field
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import elastic_model
from slipstick.fem.strains import chosen_elements, strain_matrix, strain_values

E, NU, ALPHA, COLD = 3.0, 0.25, 2e-3, 20.0
SOLID = Material(young=E, poisson=NU, density=1.0, expansion=ALPHA, reference=COLD)
QUADRATIC = [kind for kind in ELEMENTS if kind.endswith(("20", "20r", "10", "15", "13"))]


def distorted(kind: str, size=(1.0, 1.3, 0.8), divisions=(2, 2, 2)) -> Mesh:
    mesh = box(size, divisions, kind)
    nodes = mesh.nodes @ np.array([[1.0, 0.1, 0.0], [0.2, 1.0, -0.1], [0.0, 0.3, 1.0]])
    return replace(mesh, nodes=nodes + 0.03 * np.sin(7.0 * nodes[:, [1, 2, 0]] + 3.0 * nodes))


def sheared(kind: str) -> Mesh:
    mesh = box((1.0, 1.3, 0.8), (2, 2, 2), kind)
    return replace(mesh, nodes=mesh.nodes @ np.array([[1.0, 0.1, 0.0], [0.2, 1.0, -0.1], [0.0, 0.3, 1.0]]))


def displacement(mesh: Mesh, materials, field, held: np.ndarray, initial=None) -> np.ndarray:
    """Motion (n_nodes, 3) of a body of which some dofs are held."""
    K, f = assemble(mesh, materials).stiffness, expansion_load(mesh, materials, field, initial)
    free, u = np.setdiff1d(np.arange(3 * mesh.n_nodes), held), np.zeros(3 * mesh.n_nodes)
    u[free] = spsolve(K[free][:, free].tocsc(), f[free])
    return u.reshape(-1, 3)


def stresses(mesh: Mesh, materials, field, u, at="elements", initial=None):
    """Stress (n_places, 6) and the positions."""
    chosen = chosen_elements(mesh, "all")
    places, rows = strain_matrix(mesh, materials, chosen, at)
    free = strain_values(mesh, materials, chosen, at, free_strain(mesh, materials, field, initial))
    strain = (rows.T @ u.ravel() - free).reshape(-1, 6, 1)
    return places.stress(strain, np.arange(len(strain)))[..., 0], places.positions


def three_points(mesh: Mesh) -> np.ndarray:
    """Dofs that stop rigid motions without a force."""
    a, b, c = (int(np.argmax(mesh.nodes @ np.array(v))) for v in ((-1, -2, -4), (1, -2, -4), (-1, 2, -4)))
    del b, c
    origin = mesh.nodes[a]
    relative = mesh.nodes - origin
    b = int(np.argmax(np.abs(relative[:, 0])))
    c = int(np.argmax(np.linalg.norm(np.cross(relative, relative[b]), axis=1)))
    rigid = np.zeros((3 * mesh.n_nodes, 6))
    for axis in range(3):
        rigid[axis::3, axis] = 1.0
        rigid[:, 3 + axis] = np.cross(np.eye(3)[axis], relative).ravel()
    chosen: list[int] = []
    for dof in (3 * i + d for i in (a, b, c) for d in range(3)):
        if np.linalg.matrix_rank(rigid[[*chosen, dof]], tol=1e-6) > len(chosen):
            chosen.append(dof)
    return np.array(chosen)


@pytest.mark.parametrize("kind", list(ELEMENTS))
def test_a_free_body_grows_without_stress(kind):
    """Uniform temperature, distorted elements: ``u = alpha dT x``, no stress at elements or nodes."""
    mesh = distorted(kind)
    field, held = np.full(mesh.n_nodes, COLD + 40.0), three_points(mesh)
    u = displacement(mesh, SOLID, field, held)
    stretched = (mesh.nodes[:, None] - mesh.nodes[None]) * (ALPHA * 40.0)
    moved = u[:, None] - u[None]
    along = np.einsum("ijk,ijk->ij", moved - stretched, mesh.nodes[:, None] - mesh.nodes[None])
    assert np.abs(along).max() < 5e-11  # distances grow; rotations are what the three points make of them
    for at in ("elements", "nodes"):
        stress, _ = stresses(mesh, SOLID, field, u, at)
        assert np.abs(stress).max() < 1e-10 * E * ALPHA * 40.0


@pytest.mark.parametrize("kind", QUADRATIC)
def test_a_linear_temperature_leaves_a_free_body_without_stress(kind):
    """Its thermal strain is compatible (Boley and Weiner 1960, 9.3); straight quadratic elements have the motion."""
    mesh = sheared(kind)
    field = COLD + mesh.nodes @ np.array([30.0, -20.0, 10.0])
    u = displacement(mesh, SOLID, field, three_points(mesh))
    for at in ("elements", "nodes"):
        stress, _ = stresses(mesh, SOLID, field, u, at)
        assert np.abs(stress).max() < 1e-11 * E * ALPHA * 30.0


@pytest.mark.parametrize("kind", list(ELEMENTS))
def test_a_clamped_bar(kind):
    """Both ends held along it, free across: the stress is ``-E alpha dT`` and nothing else, and so are the forces."""
    mesh = box((4.0, 1.0, 1.0), (4, 2, 2), kind)
    x, y, z = mesh.nodes.T
    nodes = np.arange(mesh.n_nodes)
    ends = nodes[(x < 1e-9) | (x > 4.0 - 1e-9)]
    held = np.concatenate([3 * ends, 3 * nodes[y < 1e-9] + 1, 3 * nodes[z < 1e-9] + 2])
    field = np.full(mesh.n_nodes, COLD + 50.0)
    u = displacement(mesh, SOLID, field, held)
    stress, _ = stresses(mesh, SOLID, field, u)
    np.testing.assert_allclose(stress, np.outer(np.ones(len(stress)), [-E * ALPHA * 50.0, 0, 0, 0, 0, 0]), atol=1e-13)
    reaction = assemble(mesh, SOLID).stiffness @ u.ravel() - expansion_load(mesh, SOLID, field)
    assert reaction[3 * nodes[x > 3.9]].sum() == pytest.approx(-E * ALPHA * 50.0, rel=1e-11)


def bimetal(kind: str, along: int, across: int):
    """Deflection at the end of a heated strip of two layers, over that of Timoshenko (1925)."""
    length, h = 20.0, 1.0
    mesh = box((length, 1.0, h), (along, 1, 2 * across), kind)
    lower = np.array([mesh.nodes[row, 2].mean() < h / 2 for row in mesh.blocks[kind]])
    sets = {"low": {kind: np.flatnonzero(lower)}, "high": {kind: np.flatnonzero(~lower)}}
    mesh = replace(mesh, element_sets=sets)
    a1, a2, n = 1e-3, 3e-3, 2.0
    parts = {
        "low": Material(young=1.0, poisson=0.0, density=1.0, expansion=a1, reference=0.0),
        "high": Material(young=n, poisson=0.0, density=1.0, expansion=a2, reference=0.0),
    }
    x, y, z = mesh.nodes.T
    nodes = np.arange(mesh.n_nodes)
    root = nodes[x < 1e-9]
    held = np.concatenate([3 * root, 3 * nodes[y < 1e-9] + 1, 3 * root[z[root] < 1e-9] + 2])
    u = displacement(mesh, parts, np.full(mesh.n_nodes, 10.0), held)
    tip = u[(x > length - 1e-9) & (z < 1e-9), 2].mean()
    m = 1.0
    curvature = 6.0 * (a2 - a1) * 10.0 * (1 + m) ** 2 / (h * (3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n))))
    return tip / (-curvature * length**2 / 2.0)


@pytest.mark.parametrize(("kind", "within"), [("hex20", 2e-3), ("hex20r", 2e-3), ("hex8i", 6e-3)])
def test_a_bimetal_strip(kind, within):
    assert bimetal(kind, 20, 2) == pytest.approx(1.0, abs=within)


@pytest.mark.parametrize(
    ("kind", "order"), [("hex8", 2.0), ("tet4", 1.6), ("hex8r", 1.9), ("hex8i", 2.0), ("hex20", 3.5)]
)
def test_observed_order_of_a_graded_body(kind, order):
    """A free cube at ``T = COLD + 30 sin(2 x)``: energy of the stress against that of the finest mesh by extrapolation.

    The thermal energy ``u f / 2`` converges as the square of the strains.
    """
    energies = []
    for n in (2, 4, 8):
        mesh = box((1.0, 1.0, 1.0), (n, n, n), kind)
        held = three_points(mesh)
        field = COLD + 30.0 * np.sin(2.0 * mesh.nodes[:, 0])
        u = displacement(mesh, SOLID, field, held)
        energies.append(float(u.ravel() @ expansion_load(mesh, SOLID, field)))
    observed = np.log2(abs((energies[0] - energies[1]) / (energies[1] - energies[2])))
    assert observed > order - 0.25


@pytest.mark.parametrize("kind", ["hex8", "hex8i", "hex8r", "hex20r", "tet10"])
def test_stress_of_a_slab_held_across(kind):
    """``T = COLD + 30 z``, held in x and y all over: ``s_xx = s_yy = -E alpha dT / (1 - nu)``, free along z."""
    mesh = box((1.0, 1.0, 1.0), (2, 2, 8), kind)
    nodes = np.arange(mesh.n_nodes)
    held = np.concatenate([3 * nodes, 3 * nodes + 1, 3 * nodes[mesh.nodes[:, 2] < 1e-9] + 2])
    field = COLD + 30.0 * mesh.nodes[:, 2]
    u = displacement(mesh, SOLID, field, held)
    stress, positions = stresses(mesh, SOLID, field, u)
    wanted = -E * ALPHA * 30.0 * positions[:, 2] / (1.0 - NU)
    np.testing.assert_allclose(
        stress[:, 0], wanted, atol=2e-3 * E * ALPHA * 30.0 / (1.0 - NU) if kind == "tet10" else 1e-12
    )
    np.testing.assert_allclose(stress[:, 2], 0.0, atol=5e-3 * E * ALPHA * 30.0)


def test_the_coefficient_is_secant_and_starts_at_the_initial_temperature():
    """Abaqus, Thermal expansion: ``alpha(T)(T - T0) - alpha(Ti)(Ti - T0)``."""
    solid = Material(young=1.0, poisson=0.3, expansion=[(0.0, 1e-5), (100.0, 2e-5)], reference=10.0)
    assert solid.free_strain(60.0) == pytest.approx(1.6e-5 * 50.0)
    assert solid.free_strain(60.0, 30.0) == pytest.approx(1.6e-5 * 50.0 - 1.3e-5 * 20.0)
    assert Material(young=1.0, poisson=0.3, expansion=1e-5).free_strain(60.0, 20.0) == pytest.approx(4e-4)


def test_fields_by_set():
    mesh = box((3.0, 1.0, 1.0), (3, 1, 1), "hex8")
    field = temperature_field(mesh, {"all": 20.0, "x1": 300.0})
    np.testing.assert_array_equal(field, np.where(mesh.nodes[:, 0] > 2.9, 300.0, 20.0))
    np.testing.assert_array_equal(temperature_field(mesh, 55.0), 55.0)
    with raises_fault("temperature", "x9", remedy="there are x0, x1, y0, y1, z0, z1"):
        temperature_field(mesh, {"all": 20.0, "x9": 300.0})
    with raises_fault("temperature", remedy='give that of the rest as "all"'):
        temperature_field(mesh, {"x1": 300.0})
    with raises_fault("temperature", found="[20.0, 30.0]"):
        temperature_field(mesh, [20.0, 30.0])
    with raises_fault("temperature", found="'hot'"):
        temperature_field(mesh, "hot")


TABLE = [(20.0, 2.0), (100.0, 1.0)]


def test_faults_of_materials_and_temperatures():
    mesh, field = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8"), np.full(8, 50.0)
    with raises_fault(
        "materials", "all", "expansion", remedy="give expansion, 1/temperature (0 for a material that does not expand)"
    ):
        expansion_load(mesh, Material(young=1.0, poisson=0.3), field)
    with raises_fault("materials", "all", "reference"):
        expansion_load(mesh, Material(young=1.0, poisson=0.3, expansion=1e-5), field)
    with raises_fault(
        "materials", "all", "expansion", found="a temperature of 120", expected="20 to 100, which its table covers"
    ):
        expansion_load(mesh, Material(young=1.0, poisson=0.3, expansion=TABLE, reference=20.0), field + 70.0)
    with raises_fault("material", "young", found="[(100.0, 1.0), (20.0, 2.0)]"):
        Material(young=TABLE[::-1], poisson=0.3)
    with raises_fault("material", "young"):
        Material(young=[(20.0, 2.0), (100.0, 0.0)], poisson=0.3)
    with raises_fault("material", "tables", "density"):
        Material(young=1.0, poisson=0.3, tables={"density": TABLE})
    with raises_fault("material", "young", remedy="keep one of them"):
        Material(young=1.0, poisson=0.3, tables={"young": TABLE})


def test_a_table_is_kept_when_something_else_is_replaced():
    solid = replace(Material(young=TABLE, poisson=0.3, reference=60.0), density=7.0)
    assert solid.young == 1.5
    assert float(solid.at(80.0).young) == 1.25
    assert solid == Material(young=TABLE, poisson=0.3, reference=60.0, density=7.0)


def bar(young):
    mesh = box((4.0, 1.0, 1.0), (4, 1, 1), "hex20")
    return elastic_model(mesh, Material(young=young, poisson=0.3, density=1.0, expansion=1e-3, reference=20.0), ["x0"])


def test_stiffness_at_a_temperature():
    hot = at_temperature(bar(TABLE), 60.0)
    assert abs(hot.K - bar(1.5).K).max() < 1e-14
    assert hot.notes[-1] == "stiffness at a temperature of 60; that of thermal stress is left out"
    places, _ = strain_matrix(hot.mesh, hot.materials, chosen_elements(hot.mesh, "all"), "nodes")
    np.testing.assert_allclose(places.young, 1.5)
    assert len(places.young) == hot.mesh.n_nodes
    again = at_temperature(hot, 20.0)
    assert abs(again.K - bar(2.0).K).max() < 1e-14
    graded = at_temperature(bar(TABLE), 20.0 + 20.0 * bar(1.0).mesh.nodes[:, 0])
    places, _ = strain_matrix(graded.mesh, graded.materials, chosen_elements(graded.mesh, "all"))
    np.testing.assert_allclose(places.young, 2.0 - (20.0 * places.positions[:, 0]) / 80.0)
    assert graded.notes[-1].startswith("stiffness at a temperature of 20 to 100;")


def test_a_free_body_of_a_graded_stiffness_grows_without_stress():
    """The thermal stress has the moduli of the stiffness: none is left."""
    mesh = replace(distorted("hex20"), temperature=None)
    mesh = replace(mesh, temperature=60.0 + 20.0 * np.sin(3.0 * mesh.nodes[:, 0]))
    solid = Material(young=TABLE, poisson=0.3, density=1.0, expansion=1e-3, reference=20.0)
    field = np.full(mesh.n_nodes, 90.0)
    u = displacement(mesh, solid, field, three_points(mesh))
    assert np.abs(stresses(mesh, solid, field, u)[0]).max() < 1e-12


def test_faults_of_a_model_at_a_temperature():
    with raises_fault("materials", remedy="give young as a table: [(20.0, 2.1e11), (600.0, 1.7e11)]"):
        at_temperature(bar(2.0), 60.0)
    with raises_fault(
        "materials", "all", "young", found="a temperature of 600", expected="20 to 100, which its table covers"
    ):
        at_temperature(bar(TABLE), 600.0)
    turning = ss.at_speed(bar(TABLE), 1e-3, axis={"point": (0, 0, 0), "direction": (0, 1, 0)})
    with raises_fault("model", remedy="take the temperature first, then ss.at_speed"):
        at_temperature(turning, 60.0)


def test_tables_are_read_at_temperatures_of_nodes():
    """Quadratic shape functions overshoot where a face alone is hot: beyond the table nothing is asked."""
    mesh = box((1.0, 1.0, 1.0), (2, 1, 1), "hex20")
    table = [(20.0, 1e-3), (120.0, 2e-3)]
    solid = Material(young=1.0, poisson=0.3, expansion=table, reference=20.0)
    field = temperature_field(mesh, {"all": 20.0, "x1": 120.0})
    strain = free_strain(mesh, solid, field)["hex20"]
    assert strain.min() < 0.0
    assert strain.max() < 0.2
