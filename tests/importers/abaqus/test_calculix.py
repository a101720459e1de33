"""CalculiX runs here and writes matrices, frequencies and a substructure; Abaqus files are written by hand."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from helpers.abaqus import needs_ccx, printed_eigenvalues, run, skewed, write_input
from scipy.linalg import eigh
from scipy.sparse import coo_array

from slipstick.errors import InputError
from slipstick.importers.import_model import read_model
from slipstick.importers.roles import ImportOptions


@needs_ccx
@pytest.mark.parametrize("kind", ["hex8", "hex20", "tet10", "wedge15"])
def test_frequencies_are_those_calculix_prints(tmp_path, kind):
    mesh = skewed(kind)
    write_input(tmp_path / "job.inp", mesh, step="*FREQUENCY, SOLVER=MATRIXSTORAGE\n6")
    write_input(tmp_path / "modes.inp", mesh, step="*FREQUENCY\n6")
    run(tmp_path / "job.inp")
    run(tmp_path / "modes.inp")
    model = read_model([tmp_path / "job.sti", tmp_path / "job.inp"])
    ours = eigh(model.K.toarray(), model.M.toarray(), eigvals_only=True)[:6]
    # the print has 7 digits: 1e-6 in the eigenvalue is 5e-7 in the frequency
    np.testing.assert_allclose(ours, printed_eigenvalues(tmp_path / "modes.dat"), rtol=1e-6)
    assert model.n_dofs == 3 * mesh.n_nodes - 3 * len(mesh.node_set("ROOT")) - 1
    np.testing.assert_allclose(model.positions(model.dof_nodes[:5]), mesh.nodes[(model.dof_nodes[:5] - 5) // 3])


@needs_ccx
def test_matrices_with_their_mesh_take_contacts_on_a_surface(tmp_path):
    """The model of the files .sti, .mas, .dof and .inp is the same elastic model as the mesh alone gives."""

    write_input(tmp_path / "job.inp", skewed("hex20"), step="*FREQUENCY, SOLVER=MATRIXSTORAGE\n6")
    run(tmp_path / "job.inp")
    theirs = read_model([tmp_path / "job.sti", tmp_path / "job.inp"])
    ours = read_model(tmp_path / "job.inp")
    order = np.argsort(theirs.free)
    np.testing.assert_array_equal(theirs.free[order], ours.free)
    assert abs(theirs.K[order][:, order] - ours.K).max() < 1e-12 * abs(ours.K).max()
    assert theirs.mesh.surface("FACE").n_faces == ours.mesh.surface("FACE").n_faces == 2


@needs_ccx
def test_substructure_in_the_user_element_form(tmp_path):
    """The block of the retained dofs (2.20 writes it uncondensed) or its Schur complement, dof by dof."""
    mesh = skewed("hex8")
    free = np.setdiff1d(np.arange(mesh.n_nodes - 1), mesh.node_set("ROOT"))
    kept = [(3 * free[-1] + 5, 1), (3 * free[-1] + 5, 3), (3 * free[2] + 5, 2)]
    retained = "\n".join(f"{node}, {d}, {d}" for node, d in kept)
    write_input(tmp_path / "job.inp", mesh, step="*FREQUENCY, SOLVER=MATRIXSTORAGE\n6")
    step = f"*SUBSTRUCTURE GENERATE\n*RETAINED NODAL DOFS, SORTED=NO\n{retained}\n"
    step += "*SUBSTRUCTURE MATRIX OUTPUT, STIFFNESS=YES, OUTPUT FILE=USER DEFINED, FILE NAME=sub"
    write_input(tmp_path / "sub.inp", mesh, step=step)
    run(tmp_path / "job.inp")
    run(tmp_path / "sub.inp")
    full = read_model(tmp_path / "job.sti")
    from slipstick.importers.abaqus.calculix import read_abaqus_matrices

    raw = read_abaqus_matrices({"K": tmp_path / "sub.mtx"})
    pairs = list(zip(raw.rows[:, 0].tolist(), (raw.rows[:, 1] + 1).tolist(), strict=True))
    assert pairs == kept
    a = [full.index(f"n{node}{'xyz'[d - 1]}") for node, d in pairs]
    b = np.setdiff1d(np.arange(full.n_dofs), a)
    K = full.K.toarray()
    schur = K[np.ix_(a, a)] - K[np.ix_(a, b)] @ np.linalg.solve(K[np.ix_(b, b)], K[np.ix_(b, a)])
    found = np.tril(raw.matrices["K"].toarray())
    assert any(np.allclose(found, np.tril(block), rtol=1e-10, atol=0.0) for block in (K[np.ix_(a, a)], schur))


@pytest.fixture
def storage(tmp_path):
    """What MATRIXSTORAGE writes, by hand: the upper half, 3 dofs."""
    (tmp_path / "job.sti").write_text("1 1  4.0000000000000e+00\n1 2 -1.0e+00\n2 2  3.0e+00\n3 3  2.0e+00\n")
    (tmp_path / "job.mas").write_text("1 1  1.0e+00\n2 2  1.0e+00\n3 3  1.0e+00\n")
    (tmp_path / "job.dof").write_text("10.1\n10.3\n2.2\n")
    return tmp_path


def test_storage_by_hand(storage):
    model = read_model(storage / "job.sti")
    assert model.dofs == ("n10x", "n10z", "n2y")
    assert model.K.toarray().tolist() == [[4, -1, 0], [-1, 3, 0], [0, 0, 2]]


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("job.mas", None, "the mass matrix, job.mas, is not beside it"),
        ("job.dof", None, "the map of its rows, job.dof, is not beside it"),
        ("job.sti", "", "job.sti: the file is empty"),
        ("job.sti", "1 1 4.0\n2 2", "expected rows of 3"),
        ("job.sti", "1 1 4.0\nerror in matrix\n", "something else than numbers"),
        ("job.sti", "1 1 4.0\n1 1000000000000 2.0\n", "row or column 1000000000000, the dof map has 3 entries"),
        ("job.sti", "1 1 4.0\n0 2 2.0\n", "whole numbers from 1 up"),
        ("job.sti", "1 1 4.0\n1.5 2 2.0\n", "whole numbers from 1 up"),
        ("job.dof", "10.1\n10.9\n2.2\n", "line 2: '9' is not a direction"),
        ("job.dof", "10.1\n10.1\n2.2\n", "names node 10, direction 1, more than once"),
        ("job.dof", "10.1\n10.3\n", "the dof map has 2 entries"),
    ],
)
def test_faults_of_storage(storage, name, content, sentence):
    if content is None:
        (storage / name).unlink()
    else:
        (storage / name).write_text(content)
    with pytest.raises(InputError, match=sentence) as caught:
        read_model(storage / "job.sti")
    assert len(caught.value.sentences) == 1


def write_abaqus(path: Path, matrix: np.ndarray, dofs: list[tuple[int, int]], *, half: bool) -> None:
    rows = ["** MATRIX OUTPUT", "*MATRIX INPUT"] if half else []
    for i, (node, d) in enumerate(dofs):
        for j, (other, e) in enumerate(dofs[: i + 1] if half else dofs):
            if matrix[i, j]:
                rows.append(f"{node},{d}, {other},{e}, {matrix[i, j]:.16e}")
    path.write_text("\n".join(rows) + "\n")


@pytest.mark.parametrize("half", [True, False])
def test_abaqus_matrix_input_with_held_dofs(tmp_path, half):
    a = np.random.default_rng(2).normal(size=(6, 6))
    K, M = a @ a.T + 6 * np.eye(6), np.diag(np.arange(1.0, 7.0))
    K[3, 3] = 1e36  # how Abaqus marks a held dof
    dofs = [(12, 1), (12, 2), (12, 3), (3, 1), (3, 2), (3, 6)]
    write_abaqus(tmp_path / "job_STIF1.mtx", K, dofs, half=half)
    write_abaqus(tmp_path / "job_MASS1.mtx", M, dofs, half=half)
    model = read_model([tmp_path / "job_STIF1.mtx", tmp_path / "job_MASS1.mtx"])
    assert model.constrained.tolist() == [[3, 0]]
    assert model.dofs == ("n3y", "n3rz", "n12x", "n12y", "n12z")
    order = [4, 5, 0, 1, 2]
    np.testing.assert_allclose(model.K.toarray(), K[np.ix_(order, order)], rtol=1e-15)
    np.testing.assert_allclose(model.M.toarray(), M[np.ix_(order, order)], rtol=1e-15)


def test_abaqus_coordinate_format_needs_a_map(tmp_path):
    K = coo_array(np.array([[4.0, 1.0], [1.0, 3.0]]))
    for name, factor in (("j_STIF1.mtx", 1.0), ("j_MASS1.mtx", 0.5)):
        rows = zip(*K.coords, K.data, strict=True)
        (tmp_path / name).write_text("".join(f"{i + 1} {j + 1} {factor * v:.15e}\n" for i, j, v in rows))
    files = [tmp_path / "j_STIF1.mtx", tmp_path / "j_MASS1.mtx"]
    with pytest.raises(InputError, match="no map from rows"):
        read_model(files)
    (tmp_path / "map.txt").write_text("# node direction x y z\n4 1 0.5 0 0\n4 UY 0.5 0 0\n")
    model = read_model([*files, tmp_path / "map.txt"])
    assert model.dofs == ("n4x", "n4y")
    assert model.positions(np.array([4])).tolist() == [[0.5, 0.0, 0.0]]
    shutil.copy(files[1], tmp_path / "other.mtx")
    with pytest.raises(InputError, match="say which is the mass"):
        read_model([files[0], tmp_path / "other.mtx"])
    assert read_model(files[0], ImportOptions(mass=tmp_path / "other.mtx", dof_map=tmp_path / "map.txt")).n_dofs == 2


@pytest.mark.parametrize(("line", "count"), [("1 2", 2), ("1,1,1,1", 4), ("1, 2, 3, 4, 5, 6", 6)])
def test_lines_of_another_length_are_told(tmp_path, line, count):
    from slipstick.importers.abaqus.calculix import read_abaqus_matrices

    (tmp_path / "k.mtx").write_text(f"** a matrix\n{line}\n{line}\n")
    with pytest.raises(InputError, match=f"k.mtx: found {count} numbers a line; expected 'node, direction"):
        read_abaqus_matrices({"K": tmp_path / "k.mtx"})
