"""Coordinate systems against rotations worked out by hand."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.importers.nastran.bulk import Definition, Frame, Frames, read_bulk

ORIGIN, UP, ALONG = [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0]  # z along y, x along z, so y along x
TURNED = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])


def frames(**cards: Definition) -> Frames:
    return Frames({int(name[1:]): card for name, card in cards.items()}, {}, "m.bdf")


@pytest.mark.parametrize(
    ("kind", "given", "local", "axes"),
    [
        ("R", (2.0, 3.0, 4.0), (2.0, 3.0, 4.0), np.eye(3)),
        ("C", (2.0, 90.0, 4.0), (0.0, 2.0, 4.0), [[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
        ("S", (2.0, 90.0, 90.0), (0.0, 2.0, 0.0), [[0, 0, -1], [1, 0, 0], [0, -1, 0]]),
        ("C", (0.0, 70.0, 4.0), (0.0, 0.0, 4.0), np.eye(3)),  # on the axis there is no radius
    ],
)
def test_positions_and_directions(kind, given, local, axes):
    frame = frames(n7=Definition(kind=kind, points=np.array([ORIGIN, UP, ALONG]), within=0)).frame(7)
    np.testing.assert_allclose(frame.axes, TURNED, atol=1e-15)
    at = frame.position(np.array(given))
    np.testing.assert_allclose(at, np.array(ORIGIN) + TURNED @ local, atol=1e-15)
    np.testing.assert_allclose(frame.directions(at), TURNED @ axes, atol=1e-15)


def test_directions_are_right_handed_and_follow_the_angles():
    rng = np.random.default_rng(1)
    for kind in "RCS":
        frame = Frame(kind=kind, origin=rng.normal(size=3), axes=np.linalg.qr(rng.normal(size=(3, 3)))[0])
        here = rng.uniform(0.5, 1.0, 3) * (1.0, 60.0, 60.0)
        steps = np.diag([1e-6, 1e-4, 1e-4])
        moved = [frame.position(here + d) - frame.position(here - d) for d in steps]
        expected = np.stack([m / np.linalg.norm(m) for m in moved], axis=1)
        np.testing.assert_allclose(frame.directions(frame.position(here)), expected, atol=1e-7)


SYSTEMS = """\
BEGIN BULK
CORD2R,1,,1.,0.,0.,1.,1.,0.
,1.,0.,1.
CORD2C         2       1      0.      0.      0.      0.      0.      1.
              1.      0.      0.
CORD1R,3,11,12,13
GRID,11,0,1.,0.,0.
GRID,12,1,0.,0.,1.
GRID,13,2,1.,0.,0.
GRID,14,3,2.,3.,4.,3
GRDSET,,1,,,,2
GRID,15,,2.,0.,1.
ENDDATA
"""


def test_systems_within_systems_by_cards(tmp_path):
    """Three ways to the same system; blank fields take what GRDSET says."""
    (tmp_path / "m.bdf").write_text(SYSTEMS)
    data = read_bulk(tmp_path / "m.bdf")
    where = {node: place.tolist() for node, place in data.nodes.items()}
    np.testing.assert_allclose(where[14], np.array(ORIGIN) + TURNED @ [2.0, 3.0, 4.0], atol=1e-14)
    np.testing.assert_allclose(where[15], np.array(ORIGIN) + TURNED @ [2.0, 0.0, 1.0], atol=1e-14)
    np.testing.assert_allclose(data.directions[14], TURNED, atol=1e-14)
    np.testing.assert_allclose(data.directions[15], TURNED, atol=1e-14)


def test_faults_of_systems():
    line = np.array([ORIGIN, UP, UP])
    itself = frames(
        n1=Definition(kind="R", points=np.eye(3), within=2), n2=Definition(kind="R", points=np.eye(3), within=1)
    )
    for found, number, sentence in (
        (frames(), 5, "coordinate system 5 is used, but no CORD card defines it"),
        (
            frames(n5=Definition(kind="R", points=line, within=0)),
            5,
            "three points of coordinate system 5 lie on a line",
        ),
        (itself, 1, "is defined by itself"),
        (frames(n5=Definition(kind="R", points=np.array([1, 2, 3]))), 5, "uses grid point 1, which is not in the file"),
    ):
        with pytest.raises(InputError, match=sentence):
            found.frame(number)


def test_a_chain_that_is_too_long_is_refused():
    chain = {f"n{i}": Definition(kind="R", points=np.eye(3), within=i - 1) for i in range(1, 3000)}
    with pytest.raises(InputError, match="is defined by itself"):
        frames(**chain).frame(2999)
