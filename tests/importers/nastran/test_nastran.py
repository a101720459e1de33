"""Nastran files by hand from the documented formats, and by an independent writer here."""

import struct
from pathlib import Path

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.importers.nastran.bulk import read_bulk
from slipstick.importers.nastran.cards import cards
from slipstick.importers.nastran.op4 import read_op4
from slipstick.importers.read_model import read_model
from slipstick.importers.roles import ImportOptions

DENSE = """\
       3       3       6       2KGG     1P,3E23.16
       1       1       2
 4.0000000000000000E+00-1.0000000000000000E+00
       2       1       3
-1.0000000000000000E+00 3.0000000000000000E+00 5.0000000000000000E-01
       3       2       2
 5.0000000000000000E-01 2.0000000000000000E+00
       4       1       1
 1.0000000000000000E+00
       3       3       6       2MGG     1P,3E23.16
       1       1       1
 1.0000000000000000E+00
       3       3       1
 7.0000000000000000D-01
       4       1       1
 1.0000000000000000E+00
"""
# strings: the header counts words of 4 bytes, two a value; IS = row + 65536 (words + 1), here 196609 = row 1, 2 words
SPARSE = """\
       3       3       6       2KGG     1P,3E23.16
       1       0       5
  327681
 4.0000000000000000E+00-1.0000000000000000E+00
       2       0       7
  458753
-1.0000000000000000E+00 3.0000000000000000E+00 5.0000000000000000E-01
       3       0       5
  327682
 5.0000000000000000E-01 2.0000000000000000E+00
       4       1       1
 1.0000000000000000E+00
       3      -3       6       2MGG     1P,3E23.16
       1       0       8
       3       1
 1.0000000000000000E+00
       3       3
 0.0000000000000000E+00
       3       0       4
       3       3
 7.0000000000000000E-01
       4       1       1
 1.0000000000000000E+00
"""
K = np.array([[4.0, -1.0, 0.0], [-1.0, 3.0, 0.5], [0.0, 0.5, 2.0]])
M = np.diag([1.0, 0.0, 0.7])


@pytest.mark.parametrize("text", [DENSE, SPARSE], ids=["dense", "strings"])
def test_text_by_hand(tmp_path, text):
    (tmp_path / "a.op4").write_text(text)
    found = read_op4(tmp_path / "a.op4")
    np.testing.assert_array_equal(found["KGG"].toarray(), K)
    np.testing.assert_array_equal(found["MGG"].toarray(), M)


def runs(column: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """First row (from 1) and values of each run without zeros."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], column != 0, [0]])))
    return [(int(a) + 1, column[a:b]) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def write_text(matrices: dict[str, np.ndarray], form: str) -> str:
    lines = []
    for name, a in matrices.items():
        rows = -len(a) if form == "big" else len(a)
        lines.append(f"{a.shape[1]:8d}{rows:8d}{6:8d}{2:8d}{name:8s}1P,3E24.16")
        for j, column in enumerate(a.T, 1):
            strings = runs(column)
            if not strings:
                continue
            if form == "dense":
                first, last = strings[0][0], strings[-1][0] + len(strings[-1][1]) - 1
                parts = [(f"{j:8d}{first:8d}{last - first + 1:8d}", column[first - 1 : last])]
            else:
                extra = 2 if form == "big" else 1
                total = sum(2 * len(v) + extra for _, v in strings)
                lines.append(f"{j:8d}{0:8d}{total:8d}")
                heads = {
                    "big": lambda r, v: f"{2 * len(v) + 1:8d}{r:8d}",
                    "strings": lambda r, v: f"{r + 65536 * (2 * len(v) + 1):8d}",
                }
                parts = [(heads[form](r, v), v) for r, v in strings]
            for head, values in parts:
                lines.append(head)
                words = [f"{v:24.16E}" for v in values]
                lines += ["".join(words[i : i + 3]) for i in range(0, len(words), 3)]
        lines += [f"{a.shape[1] + 1:8d}{1:8d}{1:8d}", f"{1.0:24.16E}"]
    return "\n".join(lines) + "\n"


def write_binary(
    matrices: dict[str, np.ndarray], form: str, order: str = "<", kind: int = 2, wide: bool = False
) -> bytes:
    integer, size = ("q", 8) if wide else ("i", 4)
    real, each = ("d", 8 // size) if kind == 2 or wide else ("f", 1)
    out = b""

    def record(data: bytes) -> bytes:
        return struct.pack(f"{order}i", len(data)) + data + struct.pack(f"{order}i", len(data))

    def ints(*values: int) -> bytes:
        return struct.pack(f"{order}{len(values)}{integer}", *values)

    def reals(values) -> bytes:
        return struct.pack(f"{order}{len(values)}{real}", *values)

    for name, a in matrices.items():
        rows = -len(a) if form == "big" else len(a)
        out += record(ints(a.shape[1], rows, 6, kind) + name.ljust(2 * size).encode())
        for j, column in enumerate(a.T, 1):
            strings = runs(column)
            if form == "dense" and strings:
                first, last = strings[0][0], strings[-1][0] + len(strings[-1][1]) - 1
                values = column[first - 1 : last]
                out += record(ints(j, first, each * len(values)) + reals(values))
            elif strings:
                body = b""
                for row, v in strings:
                    words = each * len(v)
                    body += ints(words + 1, row) if form == "big" else ints(row + 65536 * (words + 1))
                    body += reals(v)
                out += record(ints(j, 0, len(body) // size) + body)
        out += record(ints(a.shape[1] + 1, 1, each) + reals([1.0]))
    return out


@pytest.fixture(scope="module")
def matrices() -> dict[str, np.ndarray]:
    a = np.random.default_rng(3).normal(size=(12, 12)).astype(np.float32).astype(float)
    a = a + a.T + 30 * np.eye(12)
    a[np.abs(a) < 0.8] = 0.0
    return {"KAA": a.astype(np.float32).astype(float), "MAA": np.diag(np.arange(1.0, 13.0))}


@pytest.mark.parametrize("form", ["dense", "strings", "big"])
def test_text_round_trip(tmp_path, matrices, form):
    (tmp_path / "a.op4").write_text(write_text(matrices, form))
    for name, found in read_op4(tmp_path / "a.op4").items():
        np.testing.assert_array_equal(found.toarray(), matrices[name])


@pytest.mark.parametrize("form", ["dense", "strings", "big"])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("kind", "wide"), [(1, False), (2, False), (2, True)])
def test_binary_round_trip(tmp_path, matrices, form, order, kind, wide):
    (tmp_path / "a.op4").write_bytes(write_binary(matrices, form, order, kind, wide))
    found = read_op4(tmp_path / "a.op4")
    assert set(found) == set(matrices)
    for name in found:
        np.testing.assert_array_equal(found[name].toarray(), matrices[name])


BULK = f"""\
SOL 103
BEGIN BULK
$ small, large and free fields, in one file
GRID    3               0.0     0.0     0.0             123
{"GRID*":8s}{1:16d}{"":16s}{"2.5D+0":>16s}{"-1.5":>16s}
{"*":8s}{"3.-1":>16s}
GRID,2,,1.,2.,3.
SPOINT,9
SPC1,5,13,1,2
CTETRA,1,1,1,2,3
ENDDATA
"""


def test_cards_in_every_field_format():
    found = {fields[0]: fields for _, name, fields in cards(BULK, {"GRID"}) if name == "GRID"}
    assert found["3"][:7] == ["3", "", "0.0", "0.0", "0.0", "", "123"]
    assert found["1"][:5] == ["1", "", "2.5D+0", "-1.5", "3.-1"]
    assert found["2"][:5] == ["2", "", "1.", "2.", "3."]


def test_bulk_data(tmp_path):
    (tmp_path / "m.bdf").write_text(BULK)
    data = read_bulk(tmp_path / "m.bdf")
    assert data.nodes.ids.tolist() == [1, 2, 3]
    assert data.nodes.coordinates.tolist() == [[2.5, -1.5, 0.3], [1, 2, 3], [0, 0, 0]]
    assert data.held[0] == {(3, 0), (3, 1), (3, 2)}
    assert data.held[5] == {(1, 0), (1, 2), (2, 0), (2, 2)}
    assert data.scalar_points.tolist() == [9]


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
    assert "9 dofs without any stiffness or mass were left out" in model.notes[-1]
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
    with pytest.raises(InputError, match="holds no matrix KXX; it holds KGG, KAA, MGG"):
        read_model(files, ImportOptions(names={"K": "KXX"}))
    with pytest.raises(InputError, match="no map from rows"):
        read_model(folder / "job.op4")


def test_two_constraint_sets_need_a_word(g_set):
    folder, *_ = g_set
    (folder / "m.bdf").write_text(BULK.replace("SPC1,5,13,1,2", "SPC1,5,13,1,2\nSPC,6,1,123"))
    files = [folder / "job.op4", folder / "m.bdf"]
    with pytest.raises(InputError, match=r"holds the constraint sets \[5, 6\]; say which one is in force"):
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


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("GRID,2,,1.", "GRID,2,7,1.", "GRID 2 has its position in coordinate system 7; only the basic system"),
        ("GRID,2,,1.,2.,3.", "GRID,2,,1.,2.,3.,4", "GRID 2 has its displacement in coordinate system 4"),
        ("GRID,2,,1.", "GRID,2,,one", "line 7: GRID cannot be read"),
        ("SPC1,5,13,1,2", "SPC1,5,13,1,THRU,99999999999", "too long"),
    ],
)
def test_faults_of_bulk_data(tmp_path, old, new, sentence):
    (tmp_path / "m.bdf").write_text(BULK.replace(old, new))
    with pytest.raises(InputError, match=sentence):
        read_bulk(tmp_path / "m.bdf")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (DENSE[:200].encode(), "damaged or truncated"),
        (
            DENSE.replace("       3       3       6       2KGG", f"{3:8d}{10**12:15d}{6:8d}{2:8d}KGG").encode(),
            "op4|rows",
        ),
        (DENSE.replace("6       2KGG", "6       4KGG").encode(), "matrix KGG is complex; expected a real one"),
        (DENSE.replace("       2       1       3\n", "       2       2       3\n").encode(), "outside its 3 x 3"),
        (b"hello world\n", "not a readable op4 file"),
        (b"\x18\x00\x00\x00\x00\x00", "not a readable op4 file"),
        (struct.pack("<i4i", 24, 10**9, 10**9, 6, 2) + b"KGG     " + struct.pack("<i", 24), "claims 1000000000 rows"),
    ],
)
def test_faults_of_op4(tmp_path, content, sentence):
    (tmp_path / "a.op4").write_bytes(content)
    with pytest.raises(InputError, match=sentence) as caught:
        read_op4(tmp_path / "a.op4")
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize("form", ["dense", "strings", "big"])
def test_every_cut_of_an_op4_file_is_refused(tmp_path, matrices, form):
    data = write_binary(matrices, form)
    first_end = len(write_binary({"KAA": matrices["KAA"]}, form))
    for length in range(1, len(data), 37):
        if length == first_end:
            continue
        (tmp_path / "a.op4").write_bytes(data[:length])
        with pytest.raises(InputError):
            read_op4(tmp_path / "a.op4")


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
