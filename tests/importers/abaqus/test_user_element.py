"""Substructures in the *USER ELEMENT form, as Abaqus writes them."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.importers.import_model import read_model

TEXT = """\
**
** SUBSTRUCTURE  Z1
*USER ELEMENT, NODES=          3, LINEAR
** ELEMENT NODES
**         11,         14,
**         20,
1, 2
3, 3
*MATRIX,TYPE=STIFFNESS
 4.0 ,
 -1.0 , 5.0
 0.0 , 0.0 , 6.0
 0.0 , 0.5 , 0.0 , 7.0
 0.0 , 0.0 , 0.0 , 0.0
 8.0
*MATRIX,TYPE=MASS
 1.0 , 0.0 , 2.0 , 0.0
 0.0 , 3.0 , 0.0 , 0.0 , 0.0 , 4.0
 0.0 , 0.0 , 0.0 , 0.0 , 5.0
"""
K = np.diag([4.0, 5.0, 6.0, 7.0, 8.0])
K[0, 1] = K[1, 0] = -1.0
K[1, 3] = K[3, 1] = 0.5


def test_one_file_with_both_matrices(tmp_path):
    """The second node has the directions of the first; the third its own."""
    (tmp_path / "sub.mtx").write_text(TEXT)
    model = read_model(tmp_path / "sub.mtx")
    assert model.dofs == ("n11x", "n11y", "n14x", "n14y", "n20z")
    np.testing.assert_array_equal(model.K.toarray(), K)
    np.testing.assert_array_equal(model.M.toarray(), np.diag([1.0, 2.0, 3.0, 4.0, 5.0]))


def test_a_file_for_each_matrix(tmp_path):
    head, _, rest = TEXT.partition("*MATRIX,TYPE=STIFFNESS\n")
    stiffness, _, mass = rest.partition("*MATRIX,TYPE=MASS\n")
    (tmp_path / "k.mtx").write_text(f"{head}*MATRIX,TYPE=STIFFNESS\n{stiffness}")
    (tmp_path / "m.mtx").write_text(f"{head}*MATRIX,TYPE=MASS\n{mass}")
    np.testing.assert_array_equal(read_model([tmp_path / "k.mtx", tmp_path / "m.mtx"]).K.toarray(), K)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (" 8.0\n", "\n", "found 14 entries, expected 15 for 5 dofs"),
        ("3, 3\n", "4, 3\n", "node list of its .USER ELEMENT cannot be read"),
        ("TYPE=MASS", "TYPE=STIFFNESS", "found 30 entries"),
        ("*MATRIX,TYPE=MASS", "*USER ELEMENT, NODES= 3, LINEAR", "holds several .USER ELEMENT"),
    ],
)
def test_faults(tmp_path, old, new, sentence):
    (tmp_path / "sub.mtx").write_text(TEXT.replace(old, new))
    with pytest.raises(InputError, match=sentence):
        read_model(tmp_path / "sub.mtx")


def test_matrices_without_use_are_warned_of(tmp_path):
    (tmp_path / "sub.mtx").write_text(TEXT + "*MATRIX,TYPE=STRUCTURAL DAMPING\n 1.0\n")
    with pytest.warns(match="TYPE=STRUCTURALDAMPING is not used"):
        read_model(tmp_path / "sub.mtx")


def test_internal_nodes_are_generalised_coordinates(tmp_path):
    """*MATRIX OUTPUT numbers Abaqus' own nodes below 0."""
    lines = "11,1, 11,1, 4.\n-1,1, -1,1, 2.\n-1,2, -1,2, 3.\n-2,1, -2,1, 5.\n11,1, -1,2, 0.5\n"
    (tmp_path / "j_STIF1.mtx").write_text(lines)
    (tmp_path / "j_MASS1.mtx").write_text("11,1, 11,1, 1.\n-1,1, -1,1, 1.\n-1,2, -1,2, 1.\n-2,1, -2,1, 1.\n")
    model = read_model([tmp_path / "j_STIF1.mtx", tmp_path / "j_MASS1.mtx"])
    order = [model.index(name) for name in ("n11x", "n101s", "n102s", "n103s")]
    expected = np.diag([4.0, 2.0, 3.0, 5.0])
    expected[0, 2] = expected[2, 0] = 0.5
    np.testing.assert_array_equal(model.K.toarray()[np.ix_(order, order)], expected)
    assert "3 dofs of Abaqus' internal nodes are generalised coordinates: n101s to n103s" in model.notes


def test_two_formats_at_once_are_refused(tmp_path):
    (tmp_path / "k.mtx").write_text("11,1, 11,1, 4.\n")
    (tmp_path / "m.mtx").write_text("1 1 1.0\n")
    with pytest.raises(InputError, match="export them in one format"):
        read_model([tmp_path / "k.mtx", tmp_path / "m.mtx"])
