"""MatrixMarket, npz and Gmsh files, the choice of reader, and what happens with files that are not what they claim."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import coo_array, save_npz, tril

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.geometry import volume
from slipstick.fem.materials import Material
from slipstick.importers import extras
from slipstick.importers.dof_map import read_dof_map
from slipstick.importers.import_model import import_model, summary
from slipstick.importers.mesh_files import read_mesh
from slipstick.importers.plain.matrix_market import read_matrix_market
from slipstick.importers.read_model import read_model
from slipstick.importers.roles import ImportOptions

STEEL = Material(young=2e11, poisson=0.3, density=7800.0)


@pytest.fixture
def plain(tmp_path):
    a = np.random.default_rng(1).normal(size=(6, 6))
    K, M = a @ a.T + np.eye(6), np.diag(np.arange(1.0, 7.0))
    (tmp_path / "map.txt").write_text("".join(f"{node} {d}\n" for node in (4, 2) for d in "xyz"))
    return tmp_path, K, M


def check(model, K, M):
    assert model.dofs == ("n4x", "n4y", "n4z", "n2x", "n2y", "n2z")
    np.testing.assert_allclose(model.K.toarray(), K, rtol=1e-14)
    np.testing.assert_allclose(model.M.toarray(), M, rtol=1e-14)


@pytest.mark.parametrize("symmetry", ["symmetric", "general"])
def test_matrix_market(plain, symmetry):
    folder, K, M = plain
    mmwrite(folder / "K.mtx", coo_array(K), symmetry=symmetry)
    mmwrite(folder / "M.mtx", coo_array(M), symmetry=symmetry)
    check(read_model([folder / "K.mtx", folder / "M.mtx", folder / "map.txt"]), K, M)


@pytest.mark.parametrize("symmetry", ["symmetric", "general"])
@pytest.mark.parametrize("dense", [True, False])
def test_matrix_market_as_scipy_writes_it(tmp_path, symmetry, dense):
    a = np.random.default_rng(8).normal(size=(5, 5))
    a = a + a.T if symmetry == "symmetric" else a[:, :4]
    mmwrite(tmp_path / "a.mtx", a if dense else coo_array(a), symmetry=symmetry)
    found = read_matrix_market(tmp_path / "a.mtx")
    np.testing.assert_allclose(found if dense else found.toarray(), a, rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1.0\n", "claims 2 entries, holds 1"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n1 3 1.0\n", "an entry outside its 2 x 2"),
        ("%%MatrixMarket matrix coordinate real general\n2 2\n", "line of sizes"),
        ("%%MatrixMarket matrix coordinate real symmetric\n2 3 1\n1 1 1.0\n", "says symmetric but is 2 x 3"),
        ("%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 0\n", "complex values"),
        ("%%MatrixMarket matrix array real general\n99999999 99999999\n1.0\n", "claims 99999999 rows"),
        ("%%MatrixMarket matrix coordinate real general\n9 9 1000000000000\n1 1 1.0\n", "1000000000000 entries"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n1 one 1.0\n", "something else than numbers"),
    ],
)
def test_faults_of_matrix_market(tmp_path, text, sentence):
    (tmp_path / "a.mtx").write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_matrix_market(tmp_path / "a.mtx")


def test_scipy_npz_of_one_half(plain):
    folder, K, M = plain
    save_npz(folder / "stiffness.npz", tril(coo_array(K)).tocsr())
    save_npz(folder / "mass.npz", coo_array(M).tocsr())
    check(read_model([folder / "stiffness.npz", folder / "mass.npz", folder / "map.txt"]), K, M)
    with pytest.raises(InputError, match="no map from rows"):
        read_model([folder / "stiffness.npz", folder / "mass.npz"])


def test_npz_bundle(plain):
    folder, K, M = plain
    nodes = {"nodes": [2, 4], "coordinates": [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]}
    np.savez(folder / "b.npz", K=K, M=M, dof_nodes=[4] * 3 + [2] * 3, dof_components=[1, 2, 3] * 2, **nodes)
    model = read_model(folder / "b.npz")
    check(model, K, M)
    assert model.positions(np.array([4])).tolist() == [[3.0, 4.0, 5.0]]
    np.savez(folder / "c.npz", K=K, M=M)
    with pytest.raises(InputError, match="has no dof_nodes and no dof_components, the map"):
        read_model(folder / "c.npz")


def test_matrices_that_do_not_fit_each_other(plain):
    folder, K, M = plain
    mmwrite(folder / "K.mtx", coo_array(K))
    mmwrite(folder / "M.mtx", coo_array(M[:3, :3]))
    with pytest.raises(InputError, match=r"matrices of different size \(K is 6 x 6, M is 3 x 3\)"):
        read_model([folder / "K.mtx", folder / "M.mtx", folder / "map.txt"])


@pytest.mark.parametrize(
    ("text", "dofs"),
    [
        ("12.1\n12.3\n", [(12, 0), (12, 2)]),
        ("n12x\nn12rz\n", [(12, 0), (12, 5)]),
        ("Matrix Eqn  Node  DOF\n 2 7 UZ\n 1 7 UX\n", [(7, 0), (7, 2)]),
        ("node,direction\n7,1\n\n# comment\n9,s\n", [(7, 0), (9, 6)]),
    ],
)
def test_maps(tmp_path, text, dofs):
    (tmp_path / "map.txt").write_text(text)
    found, _ = read_dof_map(tmp_path / "map.txt")
    assert list(zip(found.nodes.tolist(), found.components.tolist(), strict=True)) == dofs


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("12.1\nbad\n", "line 2: found 'bad'"),
        ("1 7 UX\n3 7 UY\n", r"row numbers are not 1\.\.2, each once"),
        ("1 7 TEMP\n", "line 1: 'TEMP' is not a direction"),
        ("1 2 3 4\n", "line 1: found 4 words"),
        ("# nothing\n", "holds no line 'node direction'"),
    ],
)
def test_faults_of_maps(tmp_path, text, sentence):
    (tmp_path / "map.txt").write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_dof_map(tmp_path / "map.txt")


@pytest.fixture
def gmsh(tmp_path) -> Path:
    """A box with a volume and a surface group, written by meshio."""
    meshio = pytest.importorskip("meshio")
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "tet4")
    face = mesh.surface("x1").faces["tri3"][:, ::-1]  # inward: the import turns it outward
    tetrahedra = mesh.blocks["tet4"]
    tags = [np.full(len(tetrahedra), 1), np.full(len(face), 2)]
    data = meshio.Mesh(
        mesh.nodes,
        [("tetra", tetrahedra), ("triangle", face)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"body": np.array([1, 3]), "tip": np.array([2, 2])},
    )
    data.write(tmp_path / "box.msh", file_format="gmsh22", binary=False)
    return tmp_path / "box.msh"


def test_gmsh(gmsh):
    found = read_mesh(gmsh)
    assert volume(found.mesh) == pytest.approx(2.0)
    assert set(found.mesh.element_sets) == {"body"}
    tip = found.mesh.surface("tip")
    corners = found.mesh.nodes[tip.faces["tri3"]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(normals[:, 0] > 0.0)
    assert 0.5 * normals[:, 0].sum() == pytest.approx(1.0)


def test_gmsh_to_a_model_with_options(gmsh, tmp_path):
    model = import_model(gmsh, output=tmp_path / "m.h5", material=STEEL, fixed=["tip"], quadratic=True, units="SI")
    notes = summary(model)
    assert set(model.mesh.blocks) == {"tet10"}
    assert model.units == "SI"
    assert notes[0].startswith("box.msh: ")
    assert notes[1].startswith("units: SI; the mass that moves along x is 1.")  # of 15600, less what is fixed
    assert notes[1].endswith("the largest dimension 2")
    assert {kind: len(part) for kind, part in model.mesh.element_sets["all"].items()} == {
        "tet10": model.mesh.n_elements
    }
    assert model.materials == {"all": STEEL}
    assert read_model(tmp_path / "m.h5").dofs == model.dofs
    with pytest.raises(InputError, match="node set 'root' is not in the mesh; it has"):
        read_model(gmsh, ImportOptions(material=STEEL, fixed=["root"]))
    with pytest.raises(InputError, match="is a mesh without material"):
        read_model(gmsh)


@pytest.mark.parametrize("cut", [20, 200, 700])
def test_gmsh_cut(gmsh, cut):
    gmsh.write_text(gmsh.read_text()[:cut])
    with pytest.raises(InputError):
        read_mesh(gmsh)


def test_gmsh_that_claims_too_much(gmsh):
    text = gmsh.read_text()
    for section in ("$Nodes\n", "$Elements\n"):
        at = text.index(section) + len(section)
        gmsh.write_text(text[:at] + "1000000000000" + text[text.index("\n", at) :])
        with pytest.raises(InputError):
            read_mesh(gmsh)


def test_a_mass_matrix_beside_a_mesh_gives_its_positions(plain):
    folder, K, M = plain
    mmwrite(folder / "K.mtx", coo_array(K))
    mmwrite(folder / "M.mtx", coo_array(M))
    (folder / "grid.bdf").write_text("GRID,4,,1.,2.,3.\nGRID,2,,4.,5.,6.\n")
    model = read_model([folder / name for name in ("K.mtx", "M.mtx", "map.txt", "grid.bdf")])
    check(model, K, M)
    assert model.positions(np.array([2, 4])).tolist() == [[4, 5, 6], [1, 2, 3]]


def test_unknown_missing_and_no_files(tmp_path):
    (tmp_path / "a.xyz").write_text("hello")
    with pytest.raises(InputError, match=r"mesh files of type '\.xyz' are not known; known are \.cdb"):
        read_model(tmp_path / "a.xyz")
    with pytest.raises(InputError, match="there is no such file") as caught:
        read_model([tmp_path / "b.full", tmp_path / "c.full"])
    assert len(caught.value.problems) == 2
    with pytest.raises(InputError, match="no file to import"):
        read_model([])


@pytest.mark.parametrize(
    "suffix", [".full", ".cdb", ".hb", ".op4", ".pch", ".mtx", ".npz", ".sti", ".inp", ".msh", ".h5"]
)
@pytest.mark.parametrize(
    "content",
    [b"", b"\x00" * 100, b"hello\nworld\n" * 20, bytes(range(256)) * 8],
    ids=["empty", "zeros", "text", "bytes"],
)
def test_rubbish_in_every_format_is_one_sentence(tmp_path, suffix, content):
    path = tmp_path / f"k{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_model(path)
    assert all(len(problem) < 300 and "\n" not in problem for problem in caught.value.problems)
    assert len(caught.value.problems) <= 2


def test_a_missing_extra_says_how_to_get_it():
    with pytest.raises(InputError, match=r"package mapdl-archive, which is not installed: pip install slipstick\[fe\]"):
        extras.require("no_such_module_at_all", "mapdl-archive")


def test_importing_the_readers_loads_none_of_the_extras():
    code = (
        "import sys, slipstick.importers.read_model\n"
        "import slipstick.importers.ansys.full, slipstick.importers.ansys.archive\n"
        "import slipstick.importers.nastran.matrices\n"
        "heavy = {'pyvista', 'vtk', 'meshio', 'mapdl_archive', 'ansys', 'h5py', 'matplotlib'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env=dict(os.environ), timeout=60)


def test_what_ends_other_readers_of_matrix_market_is_one_sentence(tmp_path):
    """Cut off within an exponent, a zero byte; Fortran's exponent is read as what it means."""
    head = "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 2.0\n2 2 "
    path = tmp_path / "K.mtx"
    path.write_text(head + "1.0D+3\n")
    assert read_matrix_market(path).toarray().tolist() == [[2.0, 0.0], [0.0, 1000.0]]
    for spoilt in ("1e", "1.0\x005\n", "1.0\x00"):
        path.write_text(head + spoilt)
        with pytest.raises(InputError, match=r"K\.mtx: "):
            read_matrix_market(path)
