"""Arrays from .npz files that are not trusted: no pickle, and every size is checked before memory is taken."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from math import prod
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import Fault, InputError
from slipstick.structure.checks import REAL_MODES, number_faults, real
from slipstick.typing import AnyArray

LARGEST_ARCHIVE = 4 * 1024**3
"""Bytes one file may unpack to."""


def array_shapes(path: Path, *, limit: int = LARGEST_ARCHIVE) -> dict[str, tuple[int, ...]]:
    """Names and shapes of the numeric arrays in a file, read from their headers alone.

    Raises
    ------
    InputError
        If there is no such file, it is no .npz archive, holds Python objects, or would unpack to more than ``limit``
        bytes.
    """
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    shapes: dict[str, tuple[int, ...]] = {}
    total = 0
    with readable(path), zipfile.ZipFile(path) as archive:
        for member in archive.infolist():
            name = member.filename.removesuffix(".npy")
            if name == member.filename:
                raise InputError(f"{path.name}: holds '{name}', not an array; expected an .npz file")
            if name in shapes:
                raise InputError(f"{path.name}: holds '{name}' twice; write it with numpy.savez")
            with archive.open(member) as stream:
                shapes[name], dtype = _header(stream)
            if dtype.hasobject:
                raise InputError(f"{path.name}: '{name}' holds Python objects; save plain numbers")
            size = prod(shapes[name]) * dtype.itemsize
            total += size
            if total > limit:
                raise InputError(f"{path.name}: unpacks to more than {limit / 1e9:.3g} GB; reduce the model first")
            if size > member.file_size:
                raise InputError(f"{path.name}: '{name}' claims {size} bytes, more than the file holds; it is damaged")
    return shapes


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Whatever numpy, zipfile and the decompressors say of a damaged or encrypted archive becomes one sentence."""
    try:
        yield
    except (InputError, MemoryError):
        raise
    except Exception:
        raise InputError(f"{path.name}: not a readable .npz file; write it with numpy.savez") from None


def _header(stream: object) -> tuple[tuple[int, ...], np.dtype]:
    version = np.lib.format.read_magic(stream)  # type: ignore[arg-type]
    reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = reader(stream)  # type: ignore[arg-type]
    return shape, dtype


def read_any(path: Path, *, limit: int = LARGEST_ARCHIVE) -> dict[str, AnyArray]:
    """All arrays of a file as they are, of numbers or texts; raises InputError as :func:`array_shapes` does."""
    array_shapes(path, limit=limit)
    with readable(path), np.load(path, allow_pickle=False) as data:
        return {name: data[name] for name in data.files}


def read_arrays(
    path: Path,
    required: Mapping[str, int],
    optional: Iterable[str] = (),
    *,
    limit: int = LARGEST_ARCHIVE,
    remedy: str = "",
) -> dict[str, NDArray[np.float64]]:
    """The named arrays of a file as finite floats.

    Parameters
    ----------
    path
        The .npz file.
    required
        Names that must be there, with their number of dimensions.
    optional
        Names read where present.
    remedy
        What to do about complex values.

    Raises
    ------
    InputError
        One sentence for each array that is missing, of the wrong number of dimensions, not real or not finite.
    """
    shapes = array_shapes(path, limit=limit)
    faults: list[str | Fault] = [
        f"{path.name}: has no array '{name}'; it holds {', '.join(sorted(shapes)) or 'nothing'}"
        for name in required
        if name not in shapes
    ]
    faults += [
        f"{path.name}: '{name}' has shape {shapes[name]}; expected {ndim} dimension{'s' * (ndim != 1)}"
        for name, ndim in required.items()
        if name in shapes and len(shapes[name]) != ndim
    ]
    if faults:
        raise InputError(faults)
    arrays = {name: array for name, array in read_any(path, limit=limit).items() if name in {*required, *optional}}
    faults = [fault for name, a in arrays.items() for fault in _faults(path.name, name, a, remedy)]
    if faults:
        raise InputError(faults)
    return {name: real(a) for name, a in arrays.items()}


def _faults(file: str, name: str, array: NDArray, remedy: str) -> list[str | Fault]:
    where = f"{file}: '{name}'"
    if array.dtype.kind not in "fiuc":
        return [f"{where} holds values of type {array.dtype}; expected finite real numbers"]
    if not np.all(np.isfinite(array)):
        return [f"{where} holds values that are not finite; expected finite real numbers"]
    return [*number_faults(where, array, remedy or REAL_MODES.get(name, ""))]
