"""Array files that are not trusted."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.io import mmwrite

from slipstick.errors import InputError
from slipstick.importers.plain.matrix_file import read_matrix
from slipstick.structure.npz import array_shapes, read_arrays


def header_only(path: Path, shape: tuple[int, ...], *, descr: str = "<f8") -> None:
    """An archive whose header claims an array that is not there."""
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": descr, "fortran_order": False, "shape": shape})
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.npy", stream.getvalue())


def test_arrays_and_shapes(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, omega=np.arange(3), shapes=np.ones((2, 3)), extra=np.zeros(1))
    assert array_shapes(path) == {"omega": (3,), "shapes": (2, 3), "extra": (1,)}
    arrays = read_arrays(path, {"omega": 1, "shapes": 2}, ("extra", "absent"))
    assert set(arrays) == {"omega", "shapes", "extra"}
    assert arrays["omega"].dtype == float


def test_all_faults_at_once(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, omega=np.ones((2, 2)))
    with pytest.raises(InputError) as error:
        read_arrays(path, {"omega": 1, "shapes": 2})
    assert error.value.sentences == (
        "a.npz: has no array 'shapes'; it holds omega",
        "a.npz: 'omega' has shape (2, 2); expected 1 dimension",
    )


def test_a_claimed_size_is_refused_before_memory_is_taken(tmp_path: Path) -> None:
    header_only(tmp_path / "a.npz", (10**9, 10**9))
    with pytest.raises(InputError, match="unpacks to more than"):
        read_arrays(tmp_path / "a.npz", {"a": 2})


def test_a_truncated_array_is_refused(tmp_path: Path) -> None:
    header_only(tmp_path / "a.npz", (100, 100))
    with pytest.raises(InputError, match="more than the file holds"):
        read_arrays(tmp_path / "a.npz", {"a": 2})


def test_no_pickle_is_ever_read(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, a=np.array([{"x": 1}], dtype=object))
    with pytest.raises(InputError, match="Python objects"):
        read_arrays(path, {"a": 1})


@pytest.mark.parametrize("value", [np.array([np.nan]), np.array([1j]), np.array(["x"])])
def test_only_finite_real_numbers(tmp_path: Path, value: np.ndarray) -> None:
    np.savez(tmp_path / "a.npz", a=value)
    with pytest.raises(InputError, match=r"expected (finite )?real numbers"):
        read_arrays(tmp_path / "a.npz", {"a": 1})


@pytest.mark.parametrize("content", [b"", b"PK nothing", b"\x93NUMPY"])
def test_what_is_no_archive(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(InputError, match="not a readable"):
        array_shapes(tmp_path / "a.npz")


def test_matrices_dense_sparse_and_matrix_market(tmp_path: Path) -> None:
    K = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    np.savez(tmp_path / "dense.npz", K=K)
    sparse.save_npz(tmp_path / "sparse.npz", sparse.csr_array(K))
    mmwrite(tmp_path / "general.mtx", sparse.coo_array(K))
    mmwrite(tmp_path / "half.mtx", sparse.coo_array(K), symmetry="symmetric")
    mmwrite(tmp_path / "array.mtx", K)
    assert (read_matrix(tmp_path / "dense.npz") == K).all()
    for name in ("sparse.npz", "general.mtx", "half.mtx"):
        assert (read_matrix(tmp_path / name).toarray() == K).all()
    assert (np.asarray(read_matrix(tmp_path / "array.mtx")) == K).all()


@pytest.mark.parametrize(
    "content, words",
    [
        ("nothing", "not a readable MatrixMarket"),
        ("%%MatrixMarket matrix array real general\n1000000 1000000\n", "claims 1000000 rows"),
        ("%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 0\n", "complex values"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1\n", "claims 2 entries"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n5 5 1\n", "an entry outside its 2 x 2"),
        ("%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 nan\n", "not finite"),
    ],
)
def test_faulty_matrix_market_files(tmp_path: Path, content: str, words: str) -> None:
    (tmp_path / "m.mtx").write_text(content)
    with pytest.raises(InputError, match=words):
        read_matrix(tmp_path / "m.mtx")


def test_faulty_matrix_archives(tmp_path: Path) -> None:
    np.savez(tmp_path / "two.npz", a=np.eye(2), b=np.eye(2))
    with pytest.raises(InputError, match="expected one matrix alone"):
        read_matrix(tmp_path / "two.npz")
    np.savez(
        tmp_path / "bad.npz",
        format=np.array(b"csr"),
        shape=np.array([2, 2]),
        data=np.ones(1),
        indices=np.array([7]),
        indptr=np.array([0, 1, 1]),
    )
    with pytest.raises(InputError, match="not a sound sparse matrix"):
        read_matrix(tmp_path / "bad.npz")
    (tmp_path / "m.csv").write_text("1")
    with pytest.raises(InputError, match=r"expected \.npz or \.mtx"):
        read_matrix(tmp_path / "m.csv")


def _encrypted(path: Path) -> None:
    """The flag of encryption on a sound archive."""
    data = bytearray(path.read_bytes())
    for signature, at in ((b"PK\3\4", 6), (b"PK\1\2", 8)):
        data[data.index(signature) + at] |= 1
    path.write_bytes(data)


def _damaged(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[60:80] = b"\xff" * 20
    path.write_bytes(data)


def _twice(path: Path) -> None:
    with zipfile.ZipFile(path, "a") as archive, pytest.warns(UserWarning, match="Duplicate"):
        archive.writestr("a.npy", archive.read("a.npy"))


def _structured(path: Path) -> None:
    np.savez(path, a=np.zeros((2, 2), [("x", "f8")]))


def _header_that_is_no_header(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.npy", b"\x93NUMPY\x01\x00\x10\x00" + b"{'descr': (((((  ")


@pytest.mark.parametrize("spoil", [_encrypted, _damaged, _twice, _structured, _header_that_is_no_header])
@pytest.mark.parametrize("compressed", [False, True])
def test_strange_archives_are_refused(tmp_path: Path, spoil: Callable[[Path], None], compressed: bool) -> None:
    path = tmp_path / "a.npz"
    (np.savez_compressed if compressed else np.savez)(path, a=np.arange(400.0).reshape(20, 20))
    spoil(path)
    with pytest.raises(InputError, match=r"a\.npz: "):
        read_matrix(path)


def test_a_sparse_matrix_that_claims_rows_it_cannot_have(tmp_path: Path) -> None:
    one = np.zeros(1, int)
    np.savez(
        tmp_path / "a.npz", format=b"coo", shape=[10**9, 10**9], row=one, col=one, data=[1.0], indices=one, indptr=one
    )
    with pytest.raises(InputError, match="claims 1000000000 rows"):
        read_matrix(tmp_path / "a.npz")
