"""Bulk data by hand."""

import pytest
from helpers.nastran import BULK

from slipstick.errors import InputError
from slipstick.importers.nastran.bulk import read_bulk
from slipstick.importers.nastran.cards import cards


def test_cards_in_every_field_format():
    found = {fields[0]: fields for _, name, fields in cards(BULK, {"GRID"}) if name == "GRID"}
    assert found["3"][:7] == ["3", "", "0.0", "0.0", "0.0", "", "123"]
    assert found["1"][:5] == ["1", "", "2.5D+0", "-1.5", "3.-1"]
    assert found["2"][:5] == ["2", "", "1.", "2.", "3."]


def test_bulk_data(tmp_path):
    (tmp_path / "m.bdf").write_text(BULK)
    data = read_bulk(tmp_path / "m.bdf")
    assert list(data.nodes) == [1, 2, 3]
    assert [place.tolist() for place in data.nodes.values()] == [[2.5, -1.5, 0.3], [1, 2, 3], [0, 0, 0]]
    assert data.held[0] == {(3, 0), (3, 1), (3, 2)}
    assert data.held[5] == {(1, 0), (1, 2), (2, 0), (2, 2)}
    assert data.scalar_points.tolist() == [9]


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("GRID,2,,1.", "GRID,2,7,1.", "coordinate system 7 is used, but no CORD card defines it"),
        ("GRID,2,,1.,2.,3.", "GRID,2,,1.,2.,3.,4", "coordinate system 4 is used, but no CORD card"),
        ("GRID,2,,1.", "GRID,2,,one", "line 7: GRID cannot be read"),
        ("SPC1,5,13,1,2", "SPC1,5,13,1,THRU,99999999999", "too long"),
    ],
)
def test_faults_of_bulk_data(tmp_path, old, new, sentence):
    (tmp_path / "m.bdf").write_text(BULK.replace(old, new))
    with pytest.raises(InputError, match=sentence):
        read_bulk(tmp_path / "m.bdf")
