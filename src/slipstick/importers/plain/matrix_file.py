"""One real matrix from a file: .npz (dense, or scipy's sparse format) or MatrixMarket .mtx.

It stands apart from the importers' decks: a case with matrices in files loads no meshes.

MatrixMarket (R. F. Boisvert, R. Pozo, K. A. Remington, NISTIR 5935, 1996) is read here: scipy's compiled reader, eight
times as fast (1.17.1: 0.14 against 1.2 s for 1.7 million entries), ends the process on files cut off within a number or
with a zero byte, and reads Fortran's 1.0D+3 as 1.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import issparse

from slipstick.errors import InputError
from slipstick.importers.findings import DAMAGED, refused
from slipstick.importers.text_numbers import number_table, read_bytes, require_plausible, whole_numbers
from slipstick.structure.checks import DAMPING_ELSEWHERE, number_faults, real
from slipstick.structure.npz import LARGEST_ARCHIVE, array_shapes, read_any, read_arrays
from slipstick.typing import Array, Matrix, Sparse

_SPARSE = {"format", "shape", "data", "indices", "indptr"}


def read_matrix(path: Path, *, limit: int = LARGEST_ARCHIVE) -> Matrix:
    """A matrix (n, m) as a dense array or a scipy sparse array.

    Raises
    ------
    InputError
        If the file is not one of the known formats, is too large, or holds more than one matrix.
    """
    readers = {".npz": _from_npz, ".mtx": _from_matrix_market}
    if path.suffix.lower() not in readers:
        raise refused(path.name, found=f"a file of type '{path.suffix}'", expected=".npz or .mtx")
    matrix = readers[path.suffix.lower()](path, limit)
    values = matrix.data if issparse(matrix) else matrix
    if not np.all(np.isfinite(values)):
        raise refused(path.name, "holds values that are not finite", expected="finite real numbers")
    return matrix


def _from_npz(path: Path, limit: int) -> Matrix:
    shapes = array_shapes(path, limit=limit)
    if set(shapes) >= _SPARSE:
        return _sparse_npz(path, limit)
    if len(shapes) != 1:
        raise refused(path.name, f"holds the arrays {', '.join(shapes) or '(none)'}", expected="one matrix alone")
    name = next(iter(shapes))
    return read_arrays(path, {name: 2}, limit=limit, remedy=DAMPING_ELSEWHERE)[name]


def _sparse_npz(path: Path, limit: int) -> Matrix:
    from scipy.sparse import bsr_array, csc_array, csr_array

    arrays = read_any(path, limit=limit)
    kinds = {"csr": csr_array, "csc": csc_array, "bsr": bsr_array}
    try:
        shape = tuple(int(size) for size in arrays["shape"])
        for size in shape:
            require_plausible(size, 0, path)
        name = arrays["format"].item()
        kind = kinds[name.decode() if isinstance(name, bytes) else str(name)]
        matrix = csr_array(kind((arrays["data"], arrays["indices"], arrays["indptr"]), shape=shape))
        matrix.check_format(full_check=True)
    except (ValueError, TypeError, KeyError, OverflowError, UnicodeError) as error:
        raise refused(
            path.name, f"not a sound sparse matrix ({error})", remedy="write it with scipy's save_npz"
        ) from None
    return _real(path, matrix)


def _from_matrix_market(path: Path, limit: int) -> Matrix:
    if path.is_file() and path.stat().st_size > limit:
        raise refused(path.name, f"needs more than {limit / 1e9:.3g} GB", remedy="reduce the model first")
    return read_matrix_market(path)


def _real(path: Path, matrix: Matrix) -> Matrix:
    faults = number_faults(f"{path.name}:", matrix, DAMPING_ELSEWHERE)
    if faults:
        raise InputError(faults)
    return real(matrix)


def read_matrix_market(path: Path) -> Matrix:
    """The matrix with both halves: (rows, columns), a dense array or a scipy sparse array.

    Raises
    ------
    InputError
        If the file is not a real MatrixMarket matrix, or is damaged or truncated.
    """
    data = read_bytes(path)
    head, _, rest = data.partition(b"\n")
    words = head.decode("latin-1").lower().split()
    if len(words) != 5 or words[:2] != ["%%matrixmarket", "matrix"] or words[2] not in ("coordinate", "array"):
        raise refused(path.name, "not a readable MatrixMarket file", remedy="its first line names no matrix")
    if words[3] not in ("real", "integer", "double"):
        raise refused(path.name, f"holds {words[3]} values", expected=f"real numbers: {DAMPING_ELSEWHERE}")
    if words[4] not in ("general", "symmetric"):
        raise refused(path.name, f"holds a {words[4]} matrix", expected="a general or symmetric one")
    while rest.startswith((b"%", b"\n", b"\r")):
        rest = rest.partition(b"\n")[2]
    sizes, _, body = rest.partition(b"\n")
    reader = _coordinates if words[2] == "coordinate" else _dense
    return reader(sizes, body, words[4] == "symmetric", path)


def _sizes(line: bytes, count: int, path: Path) -> list[int]:
    words = line.split()
    if len(words) != count or not all(word.isdigit() for word in words):
        raise refused(path.name, "its line of sizes cannot be read", remedy=DAMAGED)
    return [int(word) for word in words]


def _coordinates(sizes: bytes, body: bytes, symmetric: bool, path: Path) -> Sparse:
    from scipy.sparse import coo_array, csr_array

    rows, columns, entries = _sizes(sizes, 3, path)
    require_plausible(rows, entries, path)
    require_plausible(columns, entries, path)
    table = number_table(body, 3, path) if entries else np.empty((0, 3))
    if len(table) != entries:
        raise refused(path.name, f"claims {entries} entries, holds {len(table)}", remedy=DAMAGED)
    i, j = (whole_numbers(table[:, k], "row and column numbers", path) - 1 for k in (0, 1))
    if entries and (i.max() >= rows or j.max() >= columns):
        raise refused(path.name, f"has an entry outside its {rows} x {columns}", remedy=DAMAGED)
    matrix = csr_array(coo_array((table[:, 2], (i, j)), shape=(rows, columns)))
    if not symmetric:
        return matrix
    off = i != j
    mirror = coo_array((table[off, 2], (j[off], i[off])), shape=(_square(rows, columns, path),) * 2)
    return matrix + csr_array(mirror)


def _dense(sizes: bytes, body: bytes, symmetric: bool, path: Path) -> Array:
    rows, columns = _sizes(sizes, 2, path)
    expected = rows * (rows + 1) // 2 if symmetric else rows * columns
    require_plausible(max(rows, columns), expected, path)
    values = number_table(body, 1, path).ravel()
    if len(values) != expected:
        raise refused(path.name, f"claims {expected} values, holds {len(values)}", remedy=DAMAGED)
    if not symmetric:
        return values.reshape(columns, rows).T.copy()
    full = np.zeros((_square(rows, columns, path),) * 2)
    full[np.triu_indices(rows)] = values  # the lower half by columns is the upper half by rows
    return full + np.triu(full, 1).T


def _square(rows: int, columns: int, path: Path) -> int:
    if rows != columns:
        raise refused(path.name, f"says symmetric but is {rows} x {columns}", remedy=DAMAGED)
    return rows
