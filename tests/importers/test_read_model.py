"""The choice of reader, and files that are not what they claim."""

import numpy as np
import pytest
from helpers.plain import check
from scipy.io import mmwrite
from scipy.sparse import coo_array

from slipstick.errors import InputError
from slipstick.importers.import_model import read_model


def test_a_mass_matrix_beside_a_mesh_gives_its_positions(plain):
    folder, K, M = plain
    mmwrite(folder / "K.mtx", coo_array(K))
    mmwrite(folder / "M.mtx", coo_array(M))
    (folder / "grid.bdf").write_text("GRID,4,,1.,2.,3.\nGRID,2,,4.,5.,6.\n")
    model = read_model([folder / name for name in ("K.mtx", "M.mtx", "map.txt", "grid.bdf")])
    check(model, K, M)
    assert model.positions(np.array([2, 4])).tolist() == [[4, 5, 6], [1, 2, 3]]


def test_unknown_missing_and_no_files(tmp_path):
    (tmp_path / "a.xyz").write_text("hello")
    with pytest.raises(InputError, match=r"mesh files of type '\.xyz' are not known; known are \.cdb"):
        read_model(tmp_path / "a.xyz")
    with pytest.raises(InputError, match="there is no such file") as caught:
        read_model([tmp_path / "b.full", tmp_path / "c.full"])
    assert len(caught.value.sentences) == 2
    with pytest.raises(InputError, match="no file to import"):
        read_model([])


@pytest.mark.parametrize(
    "suffix", [".full", ".cdb", ".hb", ".op4", ".pch", ".mtx", ".npz", ".sti", ".inp", ".msh", ".h5"]
)
@pytest.mark.parametrize(
    "content",
    [b"", b"\x00" * 100, b"hello\nworld\n" * 20, bytes(range(256)) * 8],
    ids=["empty", "zeros", "text", "bytes"],
)
def test_rubbish_in_every_format_is_one_sentence(tmp_path, suffix, content):
    path = tmp_path / f"k{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_model(path)
    assert all(len(sentence) < 300 and "\n" not in sentence for sentence in caught.value.sentences)
    assert len(caught.value.sentences) <= 2
