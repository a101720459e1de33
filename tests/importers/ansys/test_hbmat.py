"""HBMAT's Harwell-Boeing files with their mapping, written here."""

import numpy as np
import pytest
from helpers.ansys import write_harwell_boeing, write_mapping

from slipstick.errors import InputError
from slipstick.importers.import_model import read_model


@pytest.fixture
def hbmat(tmp_path):
    a = np.random.default_rng(5).normal(size=(8, 8))
    K, M = a @ a.T + 8 * np.eye(8), np.diag(np.arange(1.0, 9.0))
    dofs = [(node, label) for node in (7, 4) for label in ("UX", "UY", "UZ", "ROTZ")]
    write_harwell_boeing(tmp_path / "beam_K.matrix", K, right_side=True)
    write_harwell_boeing(tmp_path / "beam_M.matrix", M)
    write_mapping(tmp_path / "beam_K.mapping", dofs)
    return tmp_path, K, M


def test_hbmat_with_mapping(hbmat):
    folder, K, M = hbmat
    model = read_model([folder / "beam_K.matrix", folder / "beam_M.matrix"])
    assert model.dofs == ("n7x", "n7y", "n7z", "n7rz", "n4x", "n4y", "n4z", "n4rz")
    np.testing.assert_allclose(model.K.toarray(), K, rtol=1e-15)
    np.testing.assert_allclose(model.M.toarray(), M, rtol=1e-15)


def test_hbmat_without_mapping_says_so(hbmat):
    folder, *_ = hbmat
    (folder / "beam_K.mapping").unlink()
    with pytest.raises(InputError, match="no map from rows to nodes and directions"):
        read_model([folder / "beam_K.matrix", folder / "beam_M.matrix"])


def test_hbmat_that_claims_or_lacks_numbers(hbmat):
    folder, *_ = hbmat
    path = folder / "beam_K.matrix"
    text = path.read_text()
    size = f"{8:14d}{8:14d}"
    for spoilt, sentence in (
        (text[:700], "truncated"),
        (text.replace(size, f"{10**12:14d}{10**12:14d}", 1), "claims 1000000000000 rows"),
        (text.replace("RSA", "CSA", 1), "type CSA"),
        (text.replace("D+0", "D#0", 1), "something else than numbers"),
        ("no matrix at all", "not a Harwell-Boeing text file"),
    ):
        path.write_text(spoilt)
        with pytest.raises(InputError, match=sentence):
            read_model([path, folder / "beam_M.matrix"])
