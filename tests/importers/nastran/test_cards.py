"""Nastran cards beside matrices: what changes their rows is applied or refused, the rest is listed with its count."""

from pathlib import Path

import numpy as np
import pytest
from helpers.nastran import write_text

from slipstick.errors import InputError, SlipstickWarning
from slipstick.importers.import_model import read_model
from slipstick.importers.nastran.bulk import read_bulk

BULK = """\
SOL 103
BEGIN BULK
GRID    3               0.0     0.0     0.0             123
GRID,1,,2.5,-1.5,.3
GRID,2,,1.,2.,3.
SPOINT,9
SPC1,5,13,1,2
CTETRA,1,1,1,2,3
ENDDATA
"""


def write_op4(path: Path, matrices: dict[str, np.ndarray]) -> None:
    path.write_text(write_text(matrices, "dense"))


def test_a_star_in_column_eight_is_a_large_field(tmp_path):
    """GRID   * has 16 columns a field as GRID* has; a card with blanks before its name is none that goes on."""
    grid = f"{'GRID':7s}*{4:16d}{'':16s}{'1.5':>16s}{'2.5':>16s}\n{'*':8s}{'3.5':>16s}\nGRID*,6,,1.,2.\n*,3.\n"
    (tmp_path / "m.bdf").write_text(BULK.replace("ENDDATA", grid + "  GRID,5,,1.,2.,3.\nENDDATA\nGRID,99,,0.,0.,0."))
    data = read_bulk(tmp_path / "m.bdf")
    assert list(data.nodes) == [1, 2, 3, 4, 5, 6]
    assert data.nodes[4].tolist() == [1.5, 2.5, 3.5]
    assert data.nodes[6].tolist() == [1.0, 2.0, 3.0]


def test_numbers_beyond_the_fields_of_a_line_are_no_names_of_continuations(tmp_path):
    (tmp_path / "m.bdf").write_text(BULK.replace("GRID,1,,", "GRID*,1,,"))
    with pytest.raises(InputError, match=r"'GRID\*,1,,2.5,-1.5,.3' has 5 fields"):
        read_bulk(tmp_path / "m.bdf")


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("RBE1,9,1,123456\n,UM,2,123", "RBE1 couples nodes rigidly"),
        ("RSPLINE,9,,1,2,123,3", "RSPLINE couples nodes by a spline"),
        ("SPC,5,9,0,0.5", "SPC prescribes a displacement that is not 0"),
        ("SPCD,5,1,2,0.5", "SPCD prescribes a motion"),
        ("CYJOIN,1,,1,2", "CYJOIN ties the two sides of a sector"),
    ],
)
def test_cards_that_couple_are_refused_beside_matrices_that_lack_them(tmp_path, card, said):
    """In KGG they are not yet; in the matrices of the analysis set they are."""
    folder = tmp_path
    write_op4(folder / "job.op4", {"KGG": 9 * np.eye(19), "MGG": np.eye(19)})
    (folder / "m.bdf").write_text(BULK.replace("ENDDATA", card + "\nENDDATA"))
    with pytest.raises(InputError) as caught:
        read_model([folder / "job.op4", folder / "m.bdf"])
    assert f"m.bdf, line 9: {said}" in str(caught.value)
    (folder / "m.bdf").write_text(BULK.replace("ENDDATA", card + "\nASET1,2,1,2\nENDDATA"))
    write_op4(folder / "aa.op4", {"KAA": 9 * np.eye(2), "MAA": np.eye(2)})
    with pytest.warns(SlipstickWarning, match=r"a dof it removes can carry no"):
        model = read_model([folder / "aa.op4", folder / "m.bdf"])
    assert model.dofs == ("n1y", "n2y")


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("INCLUDE 'more.bdf'", "line 9: INCLUDE is not read"),
        ("GRDSET,,,,,,,x", "line 9: GRDSET cannot be read"),
        ("GRDSET,,x", "line 9: GRDSET cannot be read"),
        ("GRID,77,1.5,0.,0.,0.", "line 9: GRID cannot be read"),
        ("GRID,77,,0.,0.,0.,ALL", "line 9: GRID cannot be read"),
        ("SPOINT,99999999999999999999", "line 9: SPOINT cannot be read"),
        ("SESET,1,1,2", "SESET belongs to an assembly with superelements"),
        ("BEGIN SUPER=1", "belongs to an assembly with superelements"),
        ("EPOINT,7", "EPOINT adds extra points"),
        ("GRDSET,,3", "coordinate system 3 is used, but no CORD card"),
        ("GRID,2,,9.,9.,9.", "line 9: GRID 2 is given again at another place"),
    ],
)
def test_cards_that_leave_the_rows_unclear_are_refused(tmp_path, card, said):
    (tmp_path / "m.bdf").write_text(BULK.replace("ENDDATA", card + "\nENDDATA"))
    with pytest.raises(InputError) as caught:
        read_bulk(tmp_path / "m.bdf")
    assert said in str(caught.value)


def test_cards_without_effect_are_listed_and_strange_ones_warned_of(tmp_path):
    more = "CONM2,7,1,,2.\nCELAS2,8,1.,1,1\nCELAS2,9,1.,2,1\nPSOLID,1,1,,2\nMAT1,1,1.,,.3\nHOLLA,1\nHOLLA,2\nENDDATA"
    (tmp_path / "m.bdf").write_text(BULK.replace("ENDDATA", more))
    findings = read_bulk(tmp_path / "m.bdf").findings
    assert findings.notes == ("m.bdf: without effect here: CTETRA, CONM2, CELAS2 (2), PSOLID, MAT1",)
    assert findings.warnings == ("m.bdf, line 14 and 1 more: HOLLA is not understood: it has no effect here",)


def test_default_supports_and_sums_of_constraint_sets(tmp_path):
    more = "GRDSET,,,,,,,456\nSPC,6,2,2,,9\nSPCADD,7,5,6\nENDDATA"
    (tmp_path / "m.bdf").write_text(BULK.replace("ENDDATA", more))
    data = read_bulk(tmp_path / "m.bdf")
    assert data.held[0] == {(3, 0), (3, 1), (3, 2), *((node, axis) for node in (1, 2) for axis in (3, 4, 5))}
    assert data.held[7] == {(1, 0), (1, 2), (2, 0), (2, 1), (2, 2), (9, 6)}
    assert data.combined == {5, 6}
