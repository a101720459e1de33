"""Arrays from .npz files that are not trusted: no pickle, and every size is checked before memory is taken."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Iterable, Mapping
from math import prod
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.structure.checks import REAL_MODES, number_faults, real

LARGEST = 4 * 1024**3
"""Bytes one file may unpack to."""


def array_shapes(path: Path, *, limit: int = LARGEST) -> dict[str, tuple[int, ...]]:
    """Names and shapes of the numeric arrays in a file, read from their headers alone.

    Raises
    ------
    InputError
        If the file is no .npz archive, holds Python objects, or would unpack to more than ``limit`` bytes.
    """
    shapes, total = {}, 0
    try:
        with zipfile.ZipFile(path) as archive:
            for member in archive.infolist():
                if not member.filename.endswith(".npy"):
                    raise InputError(f"{path.name}: holds '{member.filename}', not an array; expected an .npz file")
                with archive.open(member) as stream:
                    shape, dtype = _header(stream)
                if dtype.hasobject:
                    raise InputError(f"{path.name}: '{member.filename[:-4]}' holds Python objects; save plain numbers")
                total += prod(shape) * dtype.itemsize
                if total > limit:
                    raise InputError(f"{path.name}: unpacks to more than {limit / 1e9:.3g} GB; reduce the model first")
                shapes[member.filename[:-4]] = shape
    except (zipfile.BadZipFile, zlib.error, OSError, ValueError, EOFError, NotImplementedError) as error:
        if isinstance(error, InputError):
            raise
        raise _unreadable(path) from None
    return shapes


def _unreadable(path: Path) -> InputError:
    return InputError(f"{path.name}: not a readable .npz file; write it with numpy.savez")


def _header(stream: object) -> tuple[tuple[int, ...], np.dtype]:
    version = np.lib.format.read_magic(stream)  # type: ignore[arg-type]
    reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = reader(stream)  # type: ignore[arg-type]
    return shape, dtype


def read_arrays(
    path: Path, required: Mapping[str, int], optional: Iterable[str] = (), *, limit: int = LARGEST, remedy: str = ""
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
    problems = [
        f"{path.name}: has no array '{name}'; it holds {', '.join(sorted(shapes)) or 'nothing'}"
        for name in required
        if name not in shapes
    ]
    problems += [
        f"{path.name}: '{name}' has shape {shapes[name]}; expected {ndim} dimension{'s' * (ndim != 1)}"
        for name, ndim in required.items()
        if name in shapes and len(shapes[name]) != ndim
    ]
    if problems:
        raise InputError(problems)
    try:
        with np.load(path, allow_pickle=False) as data:
            arrays = {name: data[name] for name in (*required, *optional) if name in shapes}
    except (zipfile.BadZipFile, zlib.error, ValueError, EOFError):
        raise _unreadable(path) from None
    problems = [fault for name, a in arrays.items() for fault in _faults(path.name, name, a, remedy)]
    if problems:
        raise InputError(problems)
    return {name: real(a) for name, a in arrays.items()}


def _faults(file: str, name: str, array: NDArray, remedy: str) -> list[str]:
    where = f"{file}: '{name}'"
    if array.dtype.kind not in "fiuc":
        return [f"{where} holds values of type {array.dtype}; expected finite real numbers"]
    if not np.all(np.isfinite(array)):
        return [f"{where} holds values that are not finite; expected finite real numbers"]
    return number_faults(where, array, remedy or REAL_MODES.get(name, ""))
