"""Harwell-Boeing files of other writers."""

import numpy as np
import pytest
from helpers.ansys import write_harwell_boeing
from scipy.sparse import coo_array

from slipstick.errors import InputError
from slipstick.importers.ansys.matrices import read_harwell_boeing


def test_unsymmetric_harwell_boeing_from_scipy(tmp_path):
    """A file of another writer: scipy's, RUA, several numbers a line."""
    from scipy.io import hb_write

    matrix = coo_array(np.diag(np.arange(1.0, 30.0)) + np.diag(np.full(28, -0.123456789), 1)).tocsc()
    hb_write(tmp_path / "a.hb", matrix)
    np.testing.assert_allclose(read_harwell_boeing(tmp_path / "a.hb").toarray(), matrix.toarray(), rtol=1e-14)


@pytest.mark.parametrize("right_side", [False, True])
def test_one_half_of_a_symmetric_matrix(tmp_path, right_side):
    a = np.random.default_rng(2).normal(size=(9, 9))
    a = np.where(abs(a) > 0.5, a, 0.0)
    a = a + a.T
    write_harwell_boeing(tmp_path / "a.hb", a, right_side=right_side)
    np.testing.assert_allclose(read_harwell_boeing(tmp_path / "a.hb").toarray(), np.tril(a), rtol=1e-15)


def test_every_cut_is_refused(tmp_path):
    path = tmp_path / "a.hb"
    write_harwell_boeing(path, np.diag([1.0, 2.0, 3.0]))
    text = path.read_text()
    last = text.rstrip().rfind("\n") + 1
    for length in range(1, last):
        path.write_text(text[:length])
        with pytest.raises(InputError):
            read_harwell_boeing(path)
