"""Assembled matrices from Ansys: the binary .full file, and HBMAT's Harwell-Boeing files with their mapping.

The .full file is read by ``ansys-mapdl-reader``. Its compiled part trusts the file, so the record structure is checked
here first: a damaged file would end the whole process.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.io.dof_map import read_dof_map
from slipstick.io.extras import require
from slipstick.io.harwell_boeing import read_harwell_boeing
from slipstick.io.raw_model import DofMap, Nodes, RawModel

_DAMAGED = "the file is damaged or truncated, or not an Ansys .full file"


def read_full(path: Path) -> RawModel:
    """Stiffness, mass and map of a .full file (modal analysis, symmetric, consistent mass).

    Raises
    ------
    InputError
        If the extra is not installed, or the file is damaged, lumped, unsymmetric or without mass.
    """
    reader = require("ansys.mapdl.reader.full", "ansys-mapdl-reader")
    _check_records(path)
    try:
        file = reader.FullFile(str(path))
        _check_matrix(path, file._header, "ptrSTF", "ntermK")
        _check_matrix(path, file._header, "ptrMAS", "ntermM")
        reference, stiffness, mass = file.load_km(sort=False)
    except NotImplementedError as error:
        text = str(error).replace("Unable to read", "holds")
        raise InputError(f"{path.name}: {text}; solve a modal analysis with LUMPM,OFF and symmetric matrices") from None
    except InputError:
        raise
    except Exception:
        raise InputError(f"{path.name}: {_DAMAGED}") from None
    if reference[:, 1].max(initial=0) > 5:
        raise InputError(f"{path.name}: has other than displacement degrees of freedom; export a structural analysis")
    held = np.asarray(file.const, dtype=np.int64).reshape(-1, 2)
    table = reference.astype(np.int64)
    dof_map = DofMap(nodes=table[:, 0], components=table[:, 1])
    return RawModel(matrices={"K": stiffness, "M": mass}, dof_map=dof_map, nodes=Nodes(held=held))


def _check_records(path: Path) -> None:
    """The first four records (two headers, directions, nodes) must lie in the file."""
    words = _words(path)
    position = 0
    for _ in range(4):
        position = _next_record(words, position, path)


def _words(path: Path) -> NDArray[np.int32]:
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    if path.stat().st_size < 4 * 206:
        raise InputError(f"{path.name}: {_DAMAGED}")
    return np.memmap(path, dtype="<i4", mode="r", shape=(path.stat().st_size // 4,))


def _next_record(words: NDArray[np.int32], position: int, path: Path) -> int:
    """Position after the record [length, flags, data, length] at ``position``."""
    length = int(words[position]) if 0 <= position < len(words) - 2 else -1
    end = position + length + 3
    if length < 0 or end > len(words) or int(words[end - 1]) != length:
        raise InputError(f"{path.name}: {_DAMAGED}")
    return end


def _check_matrix(path: Path, header: dict[str, Any], pointer: str, terms: str) -> None:
    """A matrix is a pair of records (columns, values) for each equation: all must lie in the file."""
    words = _words(path)
    equations, position = int(header["neqn"]), int(header[pointer])
    count = int(header[f"{terms}l"]) + 2**32 * int(header[f"{terms}h"] if terms != "ntermM" else 0)
    if count == 0 or position <= 0:
        what = "mass" if terms == "ntermM" else "stiffness"
        raise InputError(f"{path.name}: holds no {what} matrix; write it from a modal analysis")
    if not 0 < equations <= len(words) or not 0 < count <= len(words):
        raise InputError(f"{path.name}: claims {equations} equations and {count} terms; {_DAMAGED}")
    for _ in range(equations):
        middle = _next_record(words, position, path)
        columns = np.abs(np.asarray(words[position + 2 : middle - 1], dtype=np.int64))
        compressed = int(words[position + 1]) & 0x3C000000
        if not compressed and len(columns) and not 1 <= columns.min() <= columns.max() <= equations:
            raise InputError(f"{path.name}: {_DAMAGED}")
        position = _next_record(words, middle, path)


def read_hbmat(files: dict[str, Path], mapping: Path | None) -> RawModel:
    """HBMAT matrices by name; the mapping is ``mapping`` or the .mapping file beside the first one.

    Raises
    ------
    InputError
        If a file is damaged. A missing map is refused when the model is built.
    """
    matrices = {name: read_harwell_boeing(path) for name, path in files.items()}
    found = mapping or next(filter(None, (_mapping_beside(path) for path in files.values())), None)
    if found is None:
        return RawModel(matrices=matrices)
    dof_map, nodes = read_dof_map(found)
    return RawModel(matrices=matrices, dof_map=dof_map, nodes=nodes)


def _mapping_beside(path: Path) -> Path | None:
    names = (path.with_suffix(suffix) for suffix in (".mapping", ".MAPPING", ".map"))
    return next((name for name in names if name.is_file()), None)
