"""Entries of DMIG matrices."""

import pytest

from slipstick.importers.nastran.bulk import DirectMatrix, pair, sparse


def test_pairs_and_places():
    assert pair("7", "2") == (7, 1)
    assert pair("8", "") == pair("8", "0") == (8, 6)
    with pytest.raises(ValueError, match="direction 7"):
        pair("8", "7")
    matrix = DirectMatrix(name="K", symmetric=True, rows=[(8, 6)], columns=[(7, 1)], values=[3.0])
    assert sparse(matrix, [(7, 1), (8, 6)]).toarray().tolist() == [[0.0, 0.0], [3.0, 0.0]]
