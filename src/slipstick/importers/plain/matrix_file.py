"""One real matrix from a file: .npz (dense, or scipy's sparse format) or MatrixMarket .mtx."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slipstick.errors import InputError
from slipstick.importers.text_numbers import require_plausible
from slipstick.structure.checks import DAMPING_ELSEWHERE, number_faults, real
from slipstick.structure.npz import LARGEST_ARCHIVE, array_shapes, read_any, read_arrays
from slipstick.typing import Matrix

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
        raise InputError(f"{path.name}: found a file of type '{path.suffix}'; expected .npz or .mtx")
    matrix = readers[path.suffix.lower()](path, limit)
    values = matrix.data if hasattr(matrix, "tocsr") else matrix
    if not np.all(np.isfinite(values)):
        raise InputError(f"{path.name}: holds values that are not finite; expected finite real numbers")
    return matrix


def _from_npz(path: Path, limit: int) -> Matrix:
    shapes = array_shapes(path, limit=limit)
    if set(shapes) >= _SPARSE:
        return _sparse_npz(path, limit)
    if len(shapes) != 1:
        raise InputError(f"{path.name}: holds the arrays {', '.join(shapes) or '(none)'}; expected one matrix alone")
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
        raise InputError(f"{path.name}: not a sound sparse matrix ({error}); write it with scipy's save_npz") from None
    return _real(path, matrix)


def _from_matrix_market(path: Path, limit: int) -> Matrix:
    from slipstick.importers.plain.matrix_market import read_matrix_market

    if path.is_file() and path.stat().st_size > limit:
        raise InputError(f"{path.name}: needs more than {limit / 1e9:.3g} GB; reduce the model first")
    return read_matrix_market(path)


def _real(path: Path, matrix: Matrix) -> Matrix:
    faults = number_faults(f"{path.name}:", matrix, DAMPING_ELSEWHERE)
    if faults:
        raise InputError(faults)
    return real(matrix)
