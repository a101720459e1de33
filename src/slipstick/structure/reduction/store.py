"""What took long to compute, on disk: found again by the content of what it was made from, and told as it was made."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol, TypeVar
from zipfile import ZipFile

import numpy as np
from scipy import sparse

from slipstick import __version__
from slipstick.errors import InputError
from slipstick.replacing import make_folder, writing
from slipstick.structure.npz import read_any
from slipstick.typing import AnyArray


class Storable(Protocol):
    """What is kept as arrays."""

    def arrays(self) -> dict[str, Any]:
        """Numbers and texts by name."""


T = TypeVar("T", bound=Storable)


class Store:
    """A folder in which computed arrays are kept.

    Parameters
    ----------
    folder
        None: nothing is kept.
    kind
        First word of the files' names.
    matrices, about
        What they are made from: matrices (n, m), sparse or dense, and whatever a text tells apart.
    rooms
        Of the package whose code makes them; what other code stored is made again.
    """

    def __init__(
        self, folder: str | Path | None, kind: str, matrices: Iterable[Any], about: Iterable[Any], rooms: Iterable[str]
    ) -> None:
        self._folder, self._kind = None if folder is None else Path(folder), kind
        self._content = matrices, about, rooms

    @cached_property
    def key(self) -> str:
        """Changes with all that the content is made from."""
        matrices, about, rooms = self._content
        return content_key(matrices, [*about, code_digest(*rooms)])

    def kept(
        self, make: Callable[[], T], of: Callable[[Mapping[str, AnyArray]], T | None], part: str = ""
    ) -> tuple[T, bool]:
        """What was kept, and True; else what is made now, and False.

        ``of`` gives what arrays are, None or a KeyError, TypeError or ValueError where they are something else;
        ``part`` of the content has a file of its own. Raises InputError if the folder cannot be written.
        """
        if self._folder is None:
            return make(), False
        path = self._folder / f"{self._kind}-{self.key}{part}.npz"
        arrays = read(path)
        try:
            known = None if arrays is None else of(arrays)
        except (KeyError, TypeError, ValueError):
            known = None
        if known is not None:
            return known, True
        made = make()
        write(path, made.arrays())
        return made, False


def content_key(matrices: Iterable[Any], parameters: Iterable[Any]) -> str:
    """Hash of matrices (by the arrays of their sparse form) and of parameters (by their text)."""
    stored = (A if sparse.issparse(A) else sparse.csr_array(np.atleast_2d(A)) for A in matrices)
    arrays = [array for A in stored for array in (np.array(A.shape), A.indptr, A.indices, A.data)]
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
    """Store arrays under a name that appears only when the file is whole. Raises InputError if it cannot be written.

    As ``numpy.savez``, which before version 2.1 cannot be told to pickle nothing, and leaves its archive open where it
    cannot write.
    """
    make_folder(path.parent)
    with writing(path) as part, ZipFile(part, "w", allowZip64=True) as archive:
        for name, value in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, np.asanyarray(value), allow_pickle=False)
