"""HDF5 files that are not trusted: what is read lies in the file itself, and is no larger than the file can hold."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from math import prod
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from slipstick.typing import AnyArray

if TYPE_CHECKING:
    import h5py


CHECKED = ("v108", "v110")
"""Versions of the format whose headers have check sums, so that damage is found."""
BEST_COMPRESSION = 1100
"""No filter of HDF5 that loses nothing packs more tightly than this."""
_TEXT_BLOCK = 64 * 1024**2
_MOST_IN_ATTRIBUTE = 100_000
_HEAP = b"GCOL\x01\0\0\0"
_HEAP_OBJECT = struct.Struct("<H6xQ")


@contextmanager
def opened(path: Path) -> Iterator[h5py.File]:
    """The file for reading, once no damage is in it on which the library would loop for ever.

    Raises
    ------
    ValueError, OSError
        If it is damaged or no HDF5 file.
    """
    import h5py

    with path.open("rb") as stream, mmap(stream.fileno(), 0, access=ACCESS_READ) as data:
        at = data.find(_HEAP)
        while at >= 0:
            _require_sound_heap(data, at)
            at = data.find(_HEAP, at + 1)
    with h5py.File(path, "r") as file:
        yield file


def _require_sound_heap(data: mmap, at: int) -> None:
    """Texts lie in heaps, one object after the other; the library never ends on free space of no size."""
    end = min(at + int.from_bytes(data[at + 8 : at + 16], "little"), len(data))
    at += 16
    while at + _HEAP_OBJECT.size <= end:
        index, size = _HEAP_OBJECT.unpack_from(data, at)
        if index == 0 and size < _HEAP_OBJECT.size:
            raise ValueError("its heap of texts is damaged")
        at += size if index == 0 else _HEAP_OBJECT.size + -(-size // 8) * 8


def own_node(group: h5py.Group, name: str) -> h5py.Group | h5py.Dataset:
    """The group or data set ``name`` of a group; raises ValueError where a link leads to it from elsewhere."""
    import h5py

    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        raise ValueError(f"'{name}' is not there, or a link that leads elsewhere")
    return group[name]


def require_own(data: h5py.Dataset) -> None:
    """Raises ValueError for a data set that is stored elsewhere or claims more numbers than are stored."""
    import h5py

    name = data.name
    if not isinstance(data, h5py.Dataset) or data.external or data.is_virtual:
        raise ValueError(f"'{name}' is not stored in this file")
    if data.shape is None:
        raise ValueError(f"'{name}' is empty")
    if prod(data.shape) * data.dtype.itemsize > BEST_COMPRESSION * data.id.get_storage_size():
        raise ValueError(f"'{name}' claims {prod(data.shape)} entries, more than the file holds")


def texts(data: h5py.Dataset, file_size: int) -> NDArray[np.str_]:
    """The texts of a data set, read in blocks: in a damaged file many entries may name one and the same long text."""
    flat: list[str] = []
    block, total, longest = max(1, _TEXT_BLOCK // max(file_size, 1)), 0, 0
    for part in _blocks(data, block):
        lengths = [len(str(text)) for text in part]
        flat += [str(text) for text in part]
        total, longest = total + sum(lengths), max(longest, *lengths, 0)
        if total > file_size or len(flat) * longest > 16 * max(file_size, _TEXT_BLOCK):
            raise ValueError(f"'{data.name}' holds more text than the file")
    return np.array(flat, dtype=str).reshape(data.shape)


def _blocks(data: h5py.Dataset, block: int) -> Iterator[AnyArray]:
    if data.ndim != 1:
        if data.size > block:
            raise ValueError(f"'{data.name}' holds texts in more than one dimension")
        yield np.asarray(data.asstr()[...]).reshape(-1)
        return
    for start in range(0, data.size, block):
        yield data.asstr()[start : start + block]


def attributes(node: h5py.Dataset, skipped: set[str]) -> dict[str, Any]:
    """Attributes by name but those skipped; raises ValueError for lists of texts and for huge ones."""
    import h5py

    found = {}
    for name in node.attrs:
        if name in skipped:
            continue
        known = node.attrs.get_id(name)
        size = prod(known.shape)
        if size > (1 if h5py.check_string_dtype(known.dtype) else _MOST_IN_ATTRIBUTE):
            raise ValueError(f"attribute '{name}' of '{node.name}' is a list of {size}")
        found[name] = node.attrs[name]
    return found
