"""Meshes of input files written here: their matrices against those of CalculiX, their sets, materials, supports."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.abaqus import STEEL, needs_ccx, run, skewed, write_input
from scipy.sparse.linalg import eigsh

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS, gauss
from slipstick.fem.mesh import Mesh
from slipstick.fem.unit_systems import stated_units
from slipstick.importers.import_model import read_mesh, read_model
from slipstick.importers.roles import ImportOptions


@needs_ccx
@pytest.mark.parametrize("kind", ["hex20", "hex20r", "tet10", "wedge15", "tet4"])
def test_the_mesh_alone_assembles_to_calculix_matrices(tmp_path, kind):
    """Same elements, same integration of the stiffness: equal to the 14 digits of the file, dof by dof."""
    write_input(tmp_path / "job.inp", skewed(kind), step="*FREQUENCY, SOLVER=MATRIXSTORAGE\n6")
    run(tmp_path / "job.inp")
    theirs, ours = read_model(tmp_path / "job.sti"), read_model(tmp_path / "job.inp", quiet=True)
    assert sorted(ours.dofs) == sorted(theirs.dofs)
    rows = [ours.index(dof) for dof in theirs.dofs]
    assert abs(ours.K[rows][:, rows] - theirs.K).max() < 1e-12 * abs(theirs.K).max()


# the first six eigenvalues that CalculiX 2.20 (Debian) prints for the file that `write_input` writes of this mesh
CALCULIX = np.array([664513600.0, 8963832000.0, 15736210000.0, 19933900000.0, 41661890000.0, 58467390000.0])


def test_frequencies_of_reduced_bricks_are_those_of_calculix(tmp_path, monkeypatch):
    """With its 8 points for the mass to the digits printed; with our 27, as Abaqus has, the first one to 1e-4."""
    write_input(tmp_path / "m.inp", skewed("hex20r", (3, 2, 2)), step="*FREQUENCY\n6")
    exact = read_model(tmp_path / "m.inp")
    assert exact.warnings == ()
    assert any("the mass of C3D20R is integrated exactly" in note for note in exact.notes)
    monkeypatch.setitem(ELEMENTS, "hex20r", replace(ELEMENTS["hex20r"], mass_rule=gauss(2, 3)))
    alike = read_model(tmp_path / "m.inp")
    squares = [np.sort(eigsh(m.K, 6, m.M, sigma=0.0, return_eigenvectors=False)) for m in (alike, exact)]
    np.testing.assert_allclose(np.sqrt(squares[0]), np.sqrt(CALCULIX), rtol=3e-7)
    assert np.sqrt(squares[1][0]) == pytest.approx(np.sqrt(CALCULIX[0]), rel=1e-4)
    assert np.all(squares[1] < squares[0])  # points that miss mass make it lighter, never heavier


def test_bricks_of_one_point_are_told_unless_they_become_quadratic(tmp_path):
    write_input(tmp_path / "m.inp", skewed("hex8r"), step="*FREQUENCY\n6")
    model = read_model(tmp_path / "m.inp", quiet=True)
    said, single = model.warnings
    assert said.startswith("m.inp: 6 elements of type C3D8R are computed by their mean strain, with 0.005 G")
    assert single.startswith("m.inp: 6 hex8r elements, as 1, have no neighbour along one direction or more")
    assert read_model(tmp_path / "m.inp", ImportOptions(quadratic=True)).warnings == ()


def test_incompatible_bricks_are_computed_as_such(tmp_path):
    write_input(tmp_path / "m.inp", skewed("hex8i"), step="*FREQUENCY\n6")
    model = read_model(tmp_path / "m.inp")
    assert model.warnings == ()
    assert set(model.mesh.blocks) == {"hex8i"}


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ("*SECTION CONTROLS, NAME=EC, HOURGLASS=ENHANCED\n1., 1., 1.", True),
        ("*SECTION CONTROLS, NAME=EC, HOURGLASS=STIFFNESS\n1., 1., 1.", False),
        ("*SECTION CONTROLS, NAME=EC\n2., 1., 1.", True),
        ("*HOURGLASS STIFFNESS\n700.", True),
    ],
)
@pytest.mark.parametrize("kind", ["hex8r", "hex8i"])
def test_another_hourglass_stiffness_is_told_where_there_is_one(tmp_path, kind, more, told):
    write_input(tmp_path / "m.inp", skewed(kind), step="*FREQUENCY\n6")
    text = (tmp_path / "m.inp").read_text()
    (tmp_path / "m.inp").write_text(text.replace("*MATERIAL", f"{more}\n*MATERIAL"))
    said = [
        sentence for sentence in read_model(tmp_path / "m.inp", quiet=True).warnings if "asks for another" in sentence
    ]
    assert len(said) == (told and kind == "hex8r")


def test_input_file_sets_surfaces_materials(tmp_path):
    mesh = skewed("hex20")
    write_input(tmp_path / "m.inp", mesh, step="*FREQUENCY\n6")
    found = read_mesh(tmp_path / "m.inp")
    assert found.mesh.n_nodes == mesh.n_nodes
    assert found.materials == {"SOLID": STEEL}
    assert set(found.mesh.node_sets) == {"NALL", "ROOT", "ENDS"}
    assert {k: len(v) for k, v in found.mesh.element_sets["FIRST"].items()} == {"hex20": 2}
    assert found.mesh.surface("FACE").n_faces == 2
    assert found.mesh.surface("ROOT").n_faces == 2
    assert "N, mm, tonne" in stated_units(found.units, found.materials)
    labels = {3 * i + 5 for i in mesh.node_set("ROOT").tolist()}
    assert {node for node, axis in found.held if axis == 0} == labels
    order = np.argsort(found.mesh.labels)
    np.testing.assert_array_equal(found.mesh.nodes[order], mesh.nodes)


def test_held_directions_follow_the_mesh_to_quadratic(tmp_path):
    write_input(tmp_path / "m.inp", skewed("hex8"), step="*FREQUENCY\n6")
    model = read_model(tmp_path / "m.inp", ImportOptions(quadratic=True))
    reference = skewed("hex20")
    # every middle of an edge between held nodes is held too; the lone y support stays alone
    assert len(model.constrained) == 3 * len(reference.node_set("ROOT")) + 1
    assert model.n_dofs == 3 * reference.n_nodes - len(model.constrained)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("*Heading", "*INCLUDE, INPUT=other.inp\n*Heading", "line 2: \\*INCLUDE: there is no file other.inp"),
        ("210000., 0.3", "high, 0.3", "line .*: \\*ELASTIC cannot be read"),
        ("TYPE=C3D8", "TYPE=S4", "no solid element"),
        ("\n1, ", "\n1, 999999, ", "cannot be read"),
        ("\n38, ", "\n7777, ", "names node 38"),
        ("Root, Root", "Stem", r"line .*: \*NSET names STEM, which the file does not have"),
        ("first, GENERATE", "first, GENERATE\n1, 100000000000, 1", "range 1"),
    ],
)
def test_faults_of_input_files(tmp_path, old, new, sentence):
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "hex8")
    mesh = Mesh(nodes=mesh.nodes, blocks=mesh.blocks, node_sets={"ROOT": mesh.surface("x0").nodes})
    write_input(tmp_path / "m.inp", mesh, step="*FREQUENCY\n6")
    text = (tmp_path / "m.inp").read_text()
    assert old in text
    (tmp_path / "m.inp").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=sentence):
        read_mesh(tmp_path / "m.inp")
