"""MatrixMarket files: scipy's, and those that end other readers."""

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import coo_array

from slipstick.errors import InputError
from slipstick.importers.plain.matrix_file import read_matrix_market


@pytest.mark.parametrize("symmetry", ["symmetric", "general"])
@pytest.mark.parametrize("dense", [True, False])
def test_matrix_market_as_scipy_writes_it(tmp_path, symmetry, dense):
    a = np.random.default_rng(8).normal(size=(5, 5))
    a = a + a.T if symmetry == "symmetric" else a[:, :4]
    mmwrite(tmp_path / "a.mtx", a if dense else coo_array(a), symmetry=symmetry)
    found = read_matrix_market(tmp_path / "a.mtx")
    np.testing.assert_allclose(found if dense else found.toarray(), a, rtol=1e-15)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1.0\n", "claims 2 entries, holds 1"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n1 3 1.0\n", "an entry outside its 2 x 2"),
        ("%%MatrixMarket matrix coordinate real general\n2 2\n", "line of sizes"),
        ("%%MatrixMarket matrix coordinate real symmetric\n2 3 1\n1 1 1.0\n", "says symmetric but is 2 x 3"),
        ("%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 0\n", "complex values"),
        ("%%MatrixMarket matrix array real general\n99999999 99999999\n1.0\n", "claims 99999999 rows"),
        ("%%MatrixMarket matrix coordinate real general\n9 9 1000000000000\n1 1 1.0\n", "1000000000000 entries"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n1 one 1.0\n", "something else than numbers"),
    ],
)
def test_faults_of_matrix_market(tmp_path, text, sentence):
    (tmp_path / "a.mtx").write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_matrix_market(tmp_path / "a.mtx")


def test_what_ends_other_readers_of_matrix_market_is_one_sentence(tmp_path):
    """Cut off within an exponent, a zero byte; Fortran's exponent is read as what it means."""
    head = "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 2.0\n2 2 "
    path = tmp_path / "K.mtx"
    path.write_text(head + "1.0D+3\n")
    assert read_matrix_market(path).toarray().tolist() == [[2.0, 0.0], [0.0, 1000.0]]
    for spoilt in ("1e", "1.0\x005\n", "1.0\x00"):
        path.write_text(head + spoilt)
        with pytest.raises(InputError, match=r"K\.mtx: "):
            read_matrix_market(path)
