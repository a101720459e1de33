"""Suspicions about meshes: the mass against that of the matrices, units by the size of the numbers."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.bending import bending
from scipy.sparse import csr_array

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.lumped import point_mass
from slipstick.fem.materials import Material
from slipstick.fem.unit_systems import NOT_STATED, stated_units
from slipstick.importers.mesh_checks import mass_warnings, material_warnings, unit_notes, variant_warnings
from slipstick.importers.mesh_model import MeshModel, assemble_mesh

STEEL = Material(young=2e11, poisson=0.3, density=7800.0)
MESH = box((2.0, 1.0, 1.0), (2, 2, 2), "hex8")


@pytest.mark.parametrize("fixed", [(), ("x0",), ("x0", "y1")])
@pytest.mark.parametrize("kind", ["hex8", "tet4", "wedge6"])
def test_the_mass_of_the_mesh_is_that_of_its_own_matrices_whatever_is_held(kind, fixed):
    mesh = box((2.0, 1.0, 1.0), (2, 2, 2), kind)
    model = assemble_mesh(MeshModel(mesh=mesh), source="box", material=STEEL, fixed=fixed)
    assert list(mass_warnings(model, mesh, STEEL)) == []
    assert list(mass_warnings(model, mesh, replace(STEEL, density=7800.0 * 1.009))) == []
    (said,) = mass_warnings(model, mesh, replace(STEEL, density=7800.0 * 1.2))
    assert "20 % apart" in said
    with pytest.raises(InputError, match="in the same units"):
        list(mass_warnings(model, mesh, replace(STEEL, density=7.8)))


def test_matrices_reduced_to_a_few_nodes_are_no_other_model():
    """Their mass is that of all of the mesh: Guyan reduction keeps rigid motions."""
    model = assemble_mesh(MeshModel(mesh=MESH), source="box", material=STEEL)
    ends = np.isin(model.dof_nodes, [1, 3, 7, 9, 19, 27])
    K, M = model.K.toarray(), model.M.toarray()
    T = np.zeros((len(K), ends.sum()))
    T[ends] = np.eye(ends.sum())
    T[~ends] = -np.linalg.solve(K[np.ix_(~ends, ~ends)], K[np.ix_(~ends, ends)])
    few = {"dof_nodes": model.dof_nodes[ends], "dof_components": model.dof_components[ends]}
    reduced = replace(model, K=csr_array(T.T @ K @ T), M=csr_array(T.T @ M @ T), **few)
    assert list(mass_warnings(reduced, MESH, STEEL)) == []
    (said,) = mass_warnings(reduced, MESH, replace(STEEL, density=1.3 * 7800.0))
    assert "as if the others were reduced" in said
    with pytest.raises(InputError, match="in the same units"):
        list(mass_warnings(reduced, MESH, replace(STEEL, density=7.8)))


def test_point_masses_of_the_mesh_count():
    lumped = tuple(point_mass(14, 1e5))
    model = assemble_mesh(MeshModel(mesh=MESH, lumped=lumped), source="box", material=STEEL)
    assert list(mass_warnings(model, MESH, STEEL, lumped)) == []


def test_a_mesh_with_other_nodes_is_told():
    model = assemble_mesh(MeshModel(mesh=MESH), source="box", material=STEEL)
    (said,) = mass_warnings(replace(model, dof_nodes=model.dof_nodes + 1000), MESH, STEEL)
    assert "no row of the matrices belongs to a node of the mesh" in said


def test_a_mass_that_cannot_be_compared_is_said():
    model = assemble_mesh(MeshModel(mesh=MESH), source="box", material=STEEL)
    (said,) = mass_warnings(model, MESH, {"nowhere": STEEL})
    assert "is not compared" in said


@pytest.mark.parametrize(
    ("young", "density", "system"),
    [
        (2.1e11, 7800.0, "SI (N, m, kg)"),
        (2.1e5, 7.8e-9, "N, mm, tonne"),
        (3.0e7, 7.3e-4, "lbf, inch, s"),
        (2.1e8, 7.8e-6, "mN, mm, kg"),
    ],
)
def test_steel_is_recognised_in_every_system(young, density, system):
    materials = {"steel": Material(young=young, poisson=0.3, density=density)}
    assert stated_units(NOT_STATED, materials) == f"not stated; E and density look like {system}"
    assert any(system in note for note in unit_notes(MESH, materials))
    assert "the largest dimension is 2 " in unit_notes(MESH, materials)[0]


def test_units_that_fit_nothing_or_two_systems_are_not_guessed():
    odd = Material(young=1.0, poisson=0.3, density=1.0)
    assert stated_units(NOT_STATED, {"odd": odd}) == stated_units(NOT_STATED, {}) == "not stated"
    assert (
        stated_units(NOT_STATED, {"a": STEEL, "b": Material(young=2.1e5, poisson=0.3, density=7.8e-9)}) == "not stated"
    )
    assert len(unit_notes(MESH, {"odd": odd})) == 1


def test_a_material_given_is_said_where_it_differs():
    assert list(material_warnings({"a": STEEL}, STEEL, "m")) == []
    assert list(material_warnings({"a": STEEL}, None, "m")) == []
    (said,) = material_warnings({"a": STEEL, "b": replace(STEEL, density=1.0)}, STEEL, "m")
    assert "density = 1)" in said
    assert "a (" not in said


def test_other_integration_is_said_for_the_elements_that_are_there():
    (said,) = variant_warnings(MESH, {"hex8": {"SOLID45": 8}, "tet4": {"C3D4H": 3}}, "m")
    assert said.startswith("m: 8 elements of type SOLID45 are computed as fully integrated hex8: up to ")


@pytest.mark.parametrize("length", [1.0, 3.0])
@pytest.mark.parametrize("across", [1, 2])
def test_what_is_said_of_bricks_in_bending_is_what_they_do(length, across):
    """A beam whose ends turn by a unit each: the energy of its bricks over that of beam theory."""
    mesh = box((8.0 * length, float(across), float(across)), (8, across, across), "hex8")
    (said,) = variant_warnings(mesh, {"hex8": {"C3D8I": 8}}, "m")
    number = float(re.search({1: r"up to (\S+) times", 2: r"across, (\S+) with two"}[across], said).group(1))
    assert bending(mesh) == pytest.approx(number, rel=0.05)  # two digits are said


@pytest.mark.parametrize("length", [1.0, 3.0])
@pytest.mark.parametrize("across", [1, 2, 4])
def test_what_is_said_of_bricks_of_mean_strain_in_bending_is_what_they_do(length, across):
    mesh = box((8.0 * length, float(across), float(across)), (8, across, across), "hex8r")
    (said,) = variant_warnings(mesh, {"hex8r": {"C3D8R": 8}}, "m")
    words = {1: r"bending is (\S+) times", 2: r"across, (\S+) with two", 4: r"two, (\S+) with four"}[across]
    assert bending(mesh) == pytest.approx(float(re.search(words, said).group(1)), rel=0.05)


def test_quadratic_ones_differ_by_less_the_more_cubic_they_are():
    flat, cube = (box((2.0, 2.0, height), (1, 1, 1), "hex20") for height in (1.0, 2.0))
    said = [next(variant_warnings(m, {"hex20": {"CHEXA of 20 nodes": 1}}, "m")) for m in (flat, cube)]
    assert [re.search(r"some (\S+) % too high", text).group(1) for text in said] == ["2", "0.6"]


def test_of_bricks_of_one_point_the_hourglass_stiffness_is_told():
    mesh = box((2.0, 1.0, 1.0), (2, 2, 2), "hex8r")
    counts = {"hex8r": {"SOLID185 with KEYOPT(2) = 1": 2, "C3D8R": 6}, "hex8": {"C3D8": 1}}
    said = list(variant_warnings(mesh, counts, "m"))
    assert said[0].startswith("m: 2 elements of type SOLID185 with KEYOPT(2) = 1 are computed by their mean strain")
    assert "0.005 G" in said[1]
    assert len(said) == 2
