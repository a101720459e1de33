"""Deliveries of external superelements: rows by EXTRN, several matrices in a file, damping, what does not fit."""

from pathlib import Path

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.nastran import write_text
from helpers.superelement import Frame, pairs_of, write_delivery

import slipstick as ss
from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.box import box
from slipstick.importers.import_model import read_model
from slipstick.importers.nastran.bulk import read_bulk
from slipstick.importers.roles import ImportOptions

POINTS = {3: np.array([0.0, 0.0, 0.0]), 7: np.array([2.0, 1.0, 0.0]), 12: np.array([0.5, 3.0, 1.0])}


@pytest.fixture(scope="module")
def free() -> np.ndarray:
    """The stiffness of three points against each other: only rigid body motions are free. Two modes besides."""
    solid = ss.Material(young=1.0, poisson=0.3, density=1.0)
    from slipstick.fem.assembly import assemble

    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")
    K = assemble(mesh, solid).stiffness.toarray()
    at = np.concatenate([[n * 3 + a for a in range(3)] for n in (0, 3, 6)])
    rest = np.setdiff1d(np.arange(24), at)
    K = K[np.ix_(at, at)] - K[np.ix_(at, rest)] @ np.linalg.solve(K[np.ix_(rest, rest)], K[np.ix_(rest, at)])
    k = np.zeros((11, 11))
    k[:9, :9], k[9, 9], k[10, 10] = K, 4.0, 9.0
    return k


@pytest.fixture
def points() -> dict[int, np.ndarray]:
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")
    return dict(zip((3, 7, 12), mesh.nodes[[0, 3, 6]], strict=True))


@pytest.mark.parametrize("form", ["dense", "strings", "big"])
def test_rows_points_and_damping(tmp_path, free, points, form):
    """A held stiffness; structural damping that is a multiple of it is told as a loss factor."""
    k, m = free + np.eye(11), np.diag(np.arange(1.0, 12.0))
    frame = {7: Frame(number=4, origin=np.array([-1.0, -0.5, 0.0]))}
    write_delivery(tmp_path, points, frame, {"KAA": k, "MAA": m, "BAA": 0.1 * k, "K4AA": 0.03 * k}, form=form)
    with pytest.warns(SlipstickWarning, match=r"K4AA is not used: it is 0\.03 times the stiffness"):
        model = read_model([tmp_path / "se.op4", tmp_path / "se.pch"])
    assert model.dofs == (*(f"n{n}{a}" for n in (3, 7, 12) for a in "xyz"), "n995001s", "n995002s")
    np.testing.assert_allclose(model.K.toarray(), k, atol=1e-7)
    np.testing.assert_allclose(model.M.toarray(), m, atol=1e-7)
    np.testing.assert_allclose(model.C.toarray(), 0.1 * k, atol=1e-7)
    np.testing.assert_allclose(model.positions(np.array([3, 7, 12])), list(points.values()), atol=1e-9)


def test_structural_damping_of_another_shape_is_told(tmp_path, free, points):
    k = free + np.eye(11)
    write_delivery(tmp_path, points, {}, {"KAA": k, "MAA": np.eye(11), "K4AA": np.eye(11)})
    with pytest.warns(SlipstickWarning, match="it is no multiple of the stiffness"):
        read_model([tmp_path / "se.op4", tmp_path / "se.pch"])


def test_free_motions_that_are_not_rigid_are_warned_of(tmp_path, free, points):
    """Right positions and directions pass; a frame that was lost, or points exchanged, do not."""
    frame = {7: Frame(number=4, origin=np.array([-1.0, -0.5, 0.0]))}
    write_delivery(tmp_path, points, frame, {"KAA": free, "MAA": np.eye(11)})
    files = [tmp_path / "se.op4", tmp_path / "se.pch"]
    assert read_model(files).warnings == ()
    punch = (tmp_path / "se.pch").read_text()
    lines = punch.splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("GRID") and line[8:24].strip() == "7")
    lines[at + 1] = lines[at + 1][:24]
    (tmp_path / "se.pch").write_text("\n".join(lines))
    with pytest.warns(SlipstickWarning, match=r"moves freely in 6 ways, of which [0-5] are rigid body motions"):
        read_model(files)


def test_rows_that_do_not_ascend_are_told(tmp_path, free, points):
    k = free + np.eye(11)
    write_delivery(tmp_path, points, {}, {"KAA": k, "MAA": np.eye(11)}, spare=0)
    punch = (tmp_path / "se.pch").read_text()
    boundary = [(label, "123") for label in points]
    modes = [(995001, "0"), (995002, "0")]
    (tmp_path / "se.pch").write_text(
        punch.replace(pairs_of("EXTRN", boundary + modes), pairs_of("EXTRN", modes + boundary))
    )
    with pytest.warns(SlipstickWarning, match="in the order of its EXTRN card"):
        model = read_model([tmp_path / "se.op4", tmp_path / "se.pch"])
    assert model.dofs[:3] == ("n995001s", "n995002s", "n3x")


def test_ranges_on_extrn_and_sets(tmp_path):
    (tmp_path / "m.pch").write_text(
        "BEGIN SUPER=7\nEXTRN,3,THRU,5,12,9,0\nGRID,3,,0.,0.,0.\nASET1,12,3,THRU,5\nQSET,9,0\nBSET1,3,4\nENDDATA\n"
    )
    data = read_bulk(tmp_path / "m.pch")
    assert data.external == [(3, 0), (3, 1), (4, 0), (4, 1), (5, 0), (5, 1), (9, 6)]
    assert data.analysis_set == {*data.external, (4, 2)}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("BEGIN SUPER=1\nEXTRN,1,THRU,99999999,123\n", "is too long"),
        ("GRID,1,,0.,0.,0.\nBEGIN SUPER=1\nGRID,2,,0.,0.,0.\n", "belongs to an assembly with superelements"),
        ("BEGIN SUPER=1\nGRID,2,,0.,0.,0.\nBEGIN SUPER=2\n", "belongs to an assembly with superelements"),
        ("GRID,1,,0.,0.,0.,-1\n", "GRID 1 is a point of a fluid"),
        (
            "CORD2R,1,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nCORD2R,1,,0.,0.,0.,0.,0.,2.\n,1.,0.,0.\n",
            "defined again in another",
        ),
    ],
)
def test_faults(tmp_path, text, sentence):
    (tmp_path / "m.bdf").write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_bulk(tmp_path / "m.bdf")


def test_punched_superelement_with_loads(tmp_path):
    """DMIGPCH writes loads as a rectangular DMIG: they are listed, the matrices read."""
    punch = """\
BEGIN SUPER=7
EXTRN,7,12,8,0
CORD2R,1,,0.,0.,0.,0.,0.,1.
,0.,1.,0.
GRID,7,,1.,0.,0.,1
SPOINT,8
DMIG,KAAX,0,6,2,0,,,4
DMIG,KAAX,7,1,,7,1,4.,,,7,2,1.
DMIG,KAAX,7,2,,7,2,3.
DMIG,KAAX,7,3,,7,3,5.
DMIG,KAAX,8,0,,8,0,2.
DMIG,MAAX,0,6,2,0,,,4
DMIG,MAAX,7,1,,7,1,1.
DMIG,MAAX,7,2,,7,2,1.
DMIG,MAAX,7,3,,7,3,1.
DMIG,MAAX,8,0,,8,0,1.
DMIG,PAX,0,9,2,0,,,1
DMIG,PAX,1,,,7,1,1.
"""
    punch = punch.replace("7,1,4.,,,7,2,1.", "7,1,4.\n,7,2,1.")
    (tmp_path / "se.pch").write_text(punch)
    model = read_model(tmp_path / "se.pch")
    assert model.dofs == ("n7x", "n7y", "n7z", "n8s")
    expected = np.diag([3.0, 4.0, 5.0, 2.0])  # its x is the global y
    expected[0, 1] = expected[1, 0] = -1.0
    np.testing.assert_allclose(model.K.toarray(), expected, atol=1e-15)
    assert model.notes[0] == "se.pch: without effect here: DMIG PAX"


def test_holding_points_by_name(tmp_path, free, points):
    write_delivery(tmp_path, points, {}, {"KAA": free, "MAA": np.eye(11)}, spare=0)
    files = [tmp_path / "se.op4", tmp_path / "se.pch"]
    model = read_model(files, ImportOptions(fixed=("n3", "n7x")))
    assert model.dofs[:3] == ("n7y", "n7z", "n12x")
    assert [3, 2] in model.constrained.tolist()
    with raises_fault("fixed", says="no free dof 'n4'"):
        read_model(files, ImportOptions(fixed=("n4",)))


@pytest.mark.parametrize("suffix", [".op2", ".sub", ".asm"])
def test_files_that_are_not_read_say_the_way_round(tmp_path, suffix):
    path = tmp_path / f"se{suffix}"
    path.write_bytes(b"x")
    with pytest.raises(InputError, match=r"\.pch|\.mtx"):
        read_model(path)


def test_zero_matrices_stand_for_none(tmp_path):
    """BXX1 of size 1 is how a file without damping says so."""
    (tmp_path / "m.op4").write_text(
        write_text({"KXX": np.diag([2.0, 3.0]), "MXX": np.eye(2), "BXX1": np.zeros((1, 1))}, "dense")
    )
    Path(tmp_path / "m.bdf").write_text("GRID,1,,0.,0.,0.\nASET1,12,1\n")
    assert read_model([tmp_path / "m.op4", tmp_path / "m.bdf"]).C is None
