"""One matrix from a file: the same whatever the form, and a sentence for what is none."""

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import bsr_array, coo_array, csc_array, csr_array, save_npz

from slipstick.errors import InputError
from slipstick.importers.plain.matrix_file import read_matrix

A = np.array([[4.0, -1.0, 0.0, 0.0], [0.5, 3.0, 0.0, 2.0], [0.0, 0.0, 0.0, 1e-30], [7.0, 0.0, 0.0, 1e30]])


@pytest.mark.parametrize(
    "write",
    [
        lambda path: np.savez(path.with_suffix(".npz"), A),
        lambda path: np.savez(path.with_suffix(".npz"), some_name=A),
        *(
            lambda path, kind=kind: save_npz(path.with_suffix(".npz"), kind(A))
            for kind in (csr_array, csc_array, bsr_array)
        ),
        lambda path: mmwrite(path.with_suffix(".mtx"), A, precision=17),
        lambda path: mmwrite(path.with_suffix(".mtx"), coo_array(A), precision=17),
    ],
    ids=["npz", "named", "csr", "csc", "bsr", "dense mtx", "mtx"],
)
def test_every_form_holds_the_same_matrix(tmp_path, write):
    write(tmp_path / "a")
    (path,) = tmp_path.iterdir()
    found = read_matrix(path)
    np.testing.assert_array_equal(found if isinstance(found, np.ndarray) else found.toarray(), A)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"a": A, "b": A}, "holds the arrays a, b; expected one matrix alone"),
        ({"a": np.where(A == 4.0, np.nan, A)}, "values that are not finite"),
        ({"a": A * 1j}, "complex"),
    ],
)
def test_what_is_no_real_matrix_is_said(tmp_path, content, said):
    np.savez(tmp_path / "a.npz", **content)
    with pytest.raises(InputError, match=said):
        read_matrix(tmp_path / "a.npz")


def test_a_sparse_file_whose_indices_are_wild_is_refused(tmp_path):
    sound = csr_array(A)
    for name, wild in (("indices", [99] * sound.nnz), ("indptr", [0, 99, 1, 2, 3]), ("shape", [10**12, 4])):
        parts = {"data": sound.data, "indices": sound.indices, "indptr": sound.indptr, "shape": (4, 4)}
        np.savez(tmp_path / "a.npz", format=b"csr", **(parts | {name: np.array(wild)}))
        with pytest.raises(InputError, match=r"^a\.npz: "):
            read_matrix(tmp_path / "a.npz")


def test_types_and_sizes_are_checked_before_anything_is_read(tmp_path):
    with pytest.raises(InputError, match=r"found a file of type '\.txt'; expected \.npz or \.mtx"):
        read_matrix(tmp_path / "a.txt")
    mmwrite(tmp_path / "a.mtx", A)
    with pytest.raises(InputError, match="needs more than"):
        read_matrix(tmp_path / "a.mtx", limit=10)
