"""Faults of the arrays of a structure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from slipstick.errors import Fault, InputError
from slipstick.faults import LARGEST, SMALLEST, Name, listed, shown, table
from slipstick.typing import AnyArray, Array, ComplexArray, Matrix, Sparse

DAMPING_ELSEWHERE = "give hysteretic damping as loss_factor"
"""Remedy for a complex matrix."""

_OUT_OF_RANGE = f"some entries are not finite or above {LARGEST:g}"
_CHECK_FIELDS = "look for empty fields, overflow, other units"

REAL_MODES = {
    "omega": (
        "give the frequencies of the undamped structure; an imaginary one is a negative squared frequency, an unstable "
        "structure"
    ),
    "mode_shapes": "give the real modes of the undamped structure, and damping as loss_factor or damping_ratio",
}
"""Remedies for complex modal arrays."""

ASYMMETRY = 1e-8
"""Largest difference between a row and its column, relative to the row's absolute sum, that passes as symmetric."""


def number_faults(name: Name, value: Any, remedy: str = "") -> list[Fault]:
    """Faults of an array, dense or sparse, that is not of real numbers; an imaginary part of exactly zero passes.

    >>> str(*number_faults("K", [[40.0 + 4.0j]]))
    'K is complex (imaginary parts up to 4 beside real ones up to 40); expected real numbers'
    """
    if value is None:
        return [Fault(name, "is missing", expected="real numbers")]
    try:
        array = np.asarray(value.tocoo().data if sparse.issparse(value) else value)
        if array.dtype.kind == "O":
            array = array.astype(complex)
    except (TypeError, ValueError, OverflowError) as error:
        return [Fault(name, f"not made of real numbers ({error})", remedy="give rows of equal length")]
    if array.dtype.kind not in "biufc":
        return [Fault(name, found=shown(value), expected="real numbers")]
    if array.dtype.kind != "c" or not array.imag.any():
        return []
    sizes = f"imaginary parts up to {abs(array.imag).max():.3g} beside real ones up to {abs(array.real).max():.3g}"
    return [Fault(name, f"is complex ({sizes})", expected="real numbers", remedy=remedy)]


def complex_numbers(value: Any) -> ComplexArray | None:
    """An array of finite complex numbers, none of them above ``LARGEST``; None where it is not one."""
    try:
        array = np.asarray(value)
        if array.dtype.kind == "O":
            array = np.asarray(value, dtype=complex)
    except (TypeError, ValueError, OverflowError):
        return None
    if array.dtype.kind not in "biufc":
        return None
    found = array.astype(complex)
    return found if np.all(np.abs(found) <= LARGEST) else None


def real(value: Any) -> Any:
    """A float array, dense or sparse as it came, of a value in which :func:`number_faults` finds none."""
    if sparse.issparse(value):
        return value if value.dtype == np.float64 else value.real.astype(float)
    array = np.asarray(value)
    return np.array(array.astype(complex).real if array.dtype.kind in "cO" else array, dtype=float)


def array_faults(
    name: Name, value: Any, shape: Sequence[int], *, positive: bool = False, non_negative: bool = False
) -> list[Fault]:
    """Faults of a real array that must have ``shape`` and finite entries."""
    if value.shape != tuple(shape):
        return [Fault(name, found=f"shape {value.shape}", expected=str(tuple(shape)))]
    if faults := entry_faults(name, value):
        return faults
    if positive and np.any(value < SMALLEST):
        return [Fault(name, f"the smallest entry is {value.min():g}", expected="all positive")]
    if non_negative and np.any(value < 0):
        return [Fault(name, f"the smallest entry is {value.min():g}", expected="none negative")]
    return []


class MirroredPair(NamedTuple):
    """An entry (row, column) and its mirror image (column, row) that differ."""

    row: int
    column: int
    entry: float
    mirrored: float


def asymmetry(A: Matrix, tolerance: float = ASYMMETRY) -> MirroredPair | None:
    """Largest difference in the first row that differs from its column; None for a symmetric matrix.

    Two products with a random vector, no transposed copy: rows and columns that differ give different sums.

    >>> from scipy import sparse
    >>> asymmetry(sparse.csr_array([[2.0, 1.0], [0.0, 2.0]]))
    MirroredPair(row=0, column=1, entry=1.0, mirrored=0.0)
    """
    x = np.random.default_rng(1).uniform(0.5, 1.5, A.shape[0])
    difference = np.abs(A @ x - A.T @ x)
    wrong = np.flatnonzero(difference > tolerance * np.maximum(abs(A) @ x, np.finfo(float).tiny))
    if not len(wrong):
        return None
    i = int(wrong[0])
    row, column = (np.ravel(dense(each)) for each in _cross(A, i))
    j = int(np.argmax(np.abs(row - column)))
    return MirroredPair(i, j, float(row[j]), float(column[j]))


def _cross(A: Sparse, i: int) -> tuple[Any, Any]:
    """Row and column ``i``."""
    return (A.tocsr()[[i]], A.tocsc()[:, [i]]) if sparse.issparse(A) else (A[i], A[:, i])


def symmetry_faults(name: Name, value: Any, *, tolerance: float = ASYMMETRY) -> list[Fault]:
    """Faults of a square matrix (dense or sparse) that must be symmetric, see ``asymmetry``."""
    pair = asymmetry(value, tolerance)
    if pair is None:
        return []
    i, j = pair.row + 1, pair.column + 1
    return [
        Fault(
            name,
            f"not symmetric (entry ({i}, {j}) is {pair.entry:.6g}, entry ({j}, {i}) is {pair.mirrored:.6g})",
            remedy="give the full symmetric matrix, not one triangle",
        )
    ]


def within_range(entries: AnyArray) -> bool:
    """Whether all entries of an array are finite and at most ``LARGEST``."""
    return bool(np.all(np.abs(entries) <= LARGEST))


def entry_faults(name: Name, entries: AnyArray) -> list[Fault]:
    """Faults of an array that is not :func:`within_range`."""
    return [] if within_range(entries) else [Fault(name, _OUT_OF_RANGE, remedy=_CHECK_FIELDS)]


def checked_names(dofs: Iterable[str]) -> tuple[tuple[str, ...], list[Fault]]:
    """Names of the degrees of freedom and their faults."""
    try:
        names = (dofs,) if isinstance(dofs, str) else listed("dofs", dofs, "a name for each degree of freedom")
    except InputError as error:
        return (), list(error.faults)
    if not names:
        return names, [Fault("dofs", "none given", remedy="name every degree of freedom of the structure")]
    wrong = [n for n in names if not isinstance(n, str) or not n]
    if wrong:
        return names, [Fault("dofs", found=shown(wrong[0]), expected="non-empty names")]
    double = [name for name, count in Counter(names).items() if count > 1]
    if double:
        name = shown(min(double))
        return names, [Fault("dofs", f"the name {name} is used more than once", remedy="names must differ")]
    return names, []


def dense(matrix: Any) -> Array:
    """A matrix, dense or sparse, as an array."""
    return np.asarray(matrix.toarray() if sparse.issparse(matrix) else matrix)


def beside(*blocks: Any) -> Any:
    """Matrices of as many rows side by side: sparse where one of them is, else an array."""
    if any(sparse.issparse(block) for block in blocks):
        return sparse.hstack([sparse.csc_array(block) for block in blocks], format="csc")
    return np.hstack(blocks)


def directions(name: str, value: Any, n_dofs: int) -> Array:
    """Direction vectors as a float array (n_dofs, k); raises InputError if they do not fit."""
    return dense(any_directions(name, value, n_dofs))


def any_directions(name: str, value: Any, n_dofs: int) -> Any:
    """Direction vectors (n_dofs, k), by columns where they are sparse; InputError if they do not fit."""
    array = sparse.csc_array(value, dtype=float) if sparse.issparse(value) else np.asarray(value, dtype=float)
    entries = array if isinstance(array, np.ndarray) else array.data
    if array.ndim != 2 or array.shape[0] != n_dofs or not np.all(np.isfinite(entries)):
        raise InputError(
            Fault(name, found=f"shape {array.shape}", expected=f"({n_dofs}, number of directions), finite")
        )
    return array


def named_shapes(load_shapes: Any, faults: list[Fault]) -> dict[str, Any]:
    """Distributed loads by name, none for None; other types add a fault."""
    try:
        return {} if load_shapes is None else table("load_shapes", load_shapes, "a dict of loads by name")
    except InputError as error:
        faults += error.faults
        return {}


def shape_forces(load_shapes: Any, n: int, faults: list[Fault]) -> dict[str, Array]:
    """Distributed loads as forces (n,) by name; wrong ones are zero and add a fault."""
    forces: dict[str, Array] = {}
    for name, value in named_shapes(load_shapes, faults).items():
        where = ("load shape", name)
        wrong = number_faults(where, value)
        forces[name] = np.zeros(n) if wrong else real(value)
        faults += wrong or array_faults(where, forces[name], (n,))
    return forces


def damping_faults(loss_factor: Any, damping: Any) -> Iterator[Fault]:
    """Faults of a loss factor and a factor on viscous damping: one number >= 0 each."""
    for name, value in (("loss_factor", loss_factor), ("damping", damping)):
        yield from number_faults(name, value) or array_faults(name, real(value), (), non_negative=True)


def known_shapes(shapes: Sequence[str], available: Mapping[str, object]) -> None:
    """InputError for names of load shapes that do not exist."""
    listed = ", ".join(available) or "none"
    faults = [
        Fault(("load shape", s), "is unknown", remedy=f"the structure has: {listed}")
        for s in shapes
        if s not in available
    ]
    if faults:
        raise InputError(faults)
