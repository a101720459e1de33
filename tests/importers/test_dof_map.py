"""Maps in every form, and maps that are none."""

import pytest

from slipstick.errors import InputError
from slipstick.importers.dof_map import read_dof_map


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
    found = read_dof_map(tmp_path / "map.txt")
    assert [tuple(row) for row in found.rows.tolist()] == dofs


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
