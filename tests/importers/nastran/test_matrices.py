"""Matrices with the bulk data that says what their rows are, and punch files."""

from pathlib import Path

import numpy as np
import pytest
from helpers.nastran import BULK, K, write_binary, write_text

from slipstick.errors import InputError
from slipstick.importers.import_model import read_model
from slipstick.importers.roles import ImportOptions


@pytest.fixture
def g_set(tmp_path) -> tuple[Path, np.ndarray, np.ndarray]:
    """Matrices of all 19 dofs of the bulk data; rotations carry neither stiffness nor mass, as solids have them."""
    (tmp_path / "m.bdf").write_text(BULK)
    a = np.random.default_rng(4).normal(size=(19, 19))
    k, m = a @ a.T + np.eye(19), np.diag(np.arange(1.0, 20.0))
    rotations = [6 * node + axis for node in range(3) for axis in (3, 4, 5)]
    for matrix in (k, m):
        matrix[rotations] = 0.0
        matrix[:, rotations] = 0.0
    (tmp_path / "job.op4").write_bytes(write_binary({"KGG": k, "MGG": m}, "big"))
    return tmp_path, k, m


def test_op4_with_bulk_data(g_set):
    folder, k, m = g_set
    model = read_model([folder / "job.op4", folder / "m.bdf"])
    assert model.dofs == ("n1y", "n2y", "n9s")
    rows = [1, 7, 18]
    np.testing.assert_allclose(model.K.toarray(), k[np.ix_(rows, rows)], rtol=1e-15)
    np.testing.assert_allclose(model.M.toarray(), m[np.ix_(rows, rows)], rtol=1e-15)
    assert len(model.constrained) == 7
    assert any("9 dofs without any stiffness or mass were left out" in note for note in model.notes)
    assert model.notes[0] == "m.bdf: without effect here: CTETRA"
    np.testing.assert_array_equal(model.positions(np.array([1])), [[2.5, -1.5, 0.3]])


def test_op4_of_the_free_set_and_one_that_fits_nothing(g_set):
    folder, k, _ = g_set
    free = [r for r in range(19) if r not in (0, 2, 6, 8, 12, 13, 14)]
    a = k[np.ix_(free, free)] + np.eye(12)
    (folder / "ff.op4").write_text(write_text({"KFF": a, "MFF": np.eye(12)}, "dense"))
    model = read_model([folder / "ff.op4", folder / "m.bdf"])
    assert model.dofs[:4] == ("n1y", "n1rx", "n1ry", "n1rz")
    assert model.n_dofs == 12
    (folder / "bad.op4").write_text(write_text({"KXX": a[:5, :5], "MXX": np.eye(5)}, "dense"))
    with pytest.raises(InputError, match=r"K has 5 rows; by the bulk data m\.bdf the g-set 19, the free set 12"):
        read_model([folder / "bad.op4", folder / "m.bdf"])


def test_op4_matrices_must_be_told_apart(g_set):
    folder, k, m = g_set
    (folder / "two.op4").write_text(write_text({"KGG": k, "KAA": k, "MGG": m}, "dense"))
    files = [folder / "two.op4", folder / "m.bdf"]
    with pytest.raises(InputError, match=r"several stiffness matrices \(KGG, KAA\); say which, as K=KGG"):
        read_model(files)
    assert read_model(files, ImportOptions(names={"K": "KGG"})).n_dofs == 3
    with pytest.raises(InputError, match="holds no matrix KXX"):
        read_model(files, ImportOptions(names={"K": "KXX"}))
    with pytest.raises(InputError, match="no map from rows"):
        read_model(folder / "job.op4")


def test_two_constraint_sets_need_a_word(g_set):
    folder, *_ = g_set
    (folder / "m.bdf").write_text(BULK.replace("SPC1,5,13,1,2", "SPC1,5,13,1,2\nSPC,6,1,123"))
    files = [folder / "job.op4", folder / "m.bdf"]
    with pytest.raises(InputError, match=r"holds the constraint sets \[5, 6\]"):
        read_model(files)
    assert read_model(files, ImportOptions(constraints=6)).dofs == ("n2x", "n2y", "n2z", "n9s")


PUNCH = """\
$ symmetric halves: the column holds the rows from the diagonal on
DMIG    KAAX           0       6       2       0                       3
DMIG*   KAAX                           7               1
*                      7               1 4.000000000D+00
*                      7               2-1.000000000D+00
DMIG*   KAAX                           7               2
*                      7               2 3.000000000D+00
*                      8               0 5.000000000D-01
DMIG*   KAAX                           8               0
*                      8               0 2.000000000D+00
DMIG    MAAX    0       6       1       0                       3
DMIG    MAAX    7       1               7       1       1.0
DMIG,MAAX,7,2,,7,2,1.0
DMIG,MAAX,8,0,,8,0,.7
GRID,7,,1.,0.,0.
"""


def test_punch_by_hand(tmp_path):
    (tmp_path / "job.pch").write_text(PUNCH.replace("DMIG    KAAX           0       6", "DMIG    KAAX    0       6"))
    model = read_model(tmp_path / "job.pch")
    assert model.dofs == ("n7x", "n7y", "n8s")
    np.testing.assert_array_equal(model.K.toarray(), K)
    np.testing.assert_array_equal(model.M.toarray(), np.diag([1.0, 1.0, 0.7]))
    assert model.positions(np.array([7])).tolist() == [[1.0, 0.0, 0.0]]


def write_punch(matrices: dict[str, np.ndarray], pairs: list[tuple[int, int]], *, half: bool) -> str:
    lines = []
    for name, a in matrices.items():
        lines.append(f"{'DMIG':8s}{name:8s}{0:8d}{6 if half else 1:8d}{2:8d}{0:8d}{'':16s}{len(a):8d}")
        for j, (node, d) in enumerate(pairs):
            lines.append(f"{'DMIG*':8s}{name:16s}{node:16d}{d:16d}")
            rows = range(j, len(a)) if half else range(len(a))
            lines += [f"{'*':8s}{pairs[i][0]:16d}{pairs[i][1]:16d}{a[i, j]:16.9E}" for i in rows if a[i, j]]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("half", [True, False])
def test_punch_round_trip(tmp_path, matrices, half):
    pairs = [(node, d) for node in (40, 12) for d in range(1, 7)]
    (tmp_path / "j.pch").write_text(write_punch({"KAAX": matrices["KAA"], "MAAX": matrices["MAA"]}, pairs, half=half))
    model = read_model(tmp_path / "j.pch")
    order = [model.index(f"n{node}{['x', 'y', 'z', 'rx', 'ry', 'rz'][d - 1]}") for node, d in pairs]
    np.testing.assert_allclose(model.K.toarray()[np.ix_(order, order)], matrices["KAA"], rtol=1e-9)
    np.testing.assert_allclose(model.M.toarray()[np.ix_(order, order)], matrices["MAA"], rtol=1e-9)


def test_faults_of_punch_files(tmp_path):
    path = tmp_path / "j.pch"
    for content, sentence in (
        (BULK, "holds no DMIG matrix"),
        ("DMIG,KAAX,0,6,4,0,,,3\n", "DMIG KAAX is complex"),
        ("DMIG,KAAX,7,1,,7,1,1.0\n", "line 1: DMIG cannot be read .matrix KAAX has a column before its header"),
        ("DMIG,KAAX,0,6,2,0,,,1\nDMIG,KAAX,7,1,,7,1,abc\n", "line 2: DMIG cannot be read"),
        ("DMIG,KAAX,0,6,2,0,,,1\nDMIG,KAAX,7,1,,7,1,1.0\n", "no mass matrix M"),
    ):
        path.write_text(content)
        with pytest.raises(InputError, match=sentence):
            read_model(path)
