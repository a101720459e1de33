"""Reductions on disk, found again by the content of what they were made from."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from slipstick import __version__
from slipstick.errors import InputError
from slipstick.replacing import replacing
from slipstick.structure.npz import read_any
from slipstick.typing import AnyArray


def content_key(matrices: Iterable[Any], parameters: Iterable[Any]) -> str:
    """Hash of sparse matrices (by their arrays) and of parameters (by their text)."""
    arrays = [array for A in matrices for array in (np.array(A.shape), A.indptr, A.indices, A.data)]
    with ThreadPoolExecutor(2) as pool:  # hashing leaves the interpreter lock
        digests = list(pool.map(_digest, arrays))
    text = repr((digests, list(parameters)))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def code_digest(*rooms: str) -> str:
    """Hash of the code in some rooms of the package: what other code stored is made again."""
    return folders_digest(Path(__file__).parents[2] / room for room in rooms)


def folders_digest(folders: Iterable[Path]) -> str:
    """Hash of the Python files below folders, and of the version for what is installed without its sources."""
    digest = hashlib.sha256(__version__.encode())
    for path in sorted(path for folder in folders for path in folder.rglob("*.py")):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


def _digest(array: AnyArray) -> str:
    contiguous = np.ascontiguousarray(array)
    return hashlib.sha256(contiguous.view(np.uint8).reshape(-1).data).hexdigest() + str(array.dtype)


def read(path: Path) -> dict[str, AnyArray] | None:
    """Arrays of a stored reduction; None when there is none or it cannot be read (it is then made again)."""
    try:
        return read_any(path)
    except InputError:
        return None


def write(path: Path, arrays: dict[str, Any]) -> None:
    """Store arrays under a name that appears only when the file is whole. Raises InputError if it cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part, part.open("wb") as file:
            np.savez(file, **arrays)  # its allow_pickle is younger than numpy 2.1, which stores it as an array
    except OSError as error:
        raise InputError(
            f"the reduction cannot be stored in {path.parent}: {error.strerror}; choose another folder"
        ) from error
