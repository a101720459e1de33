"""Safe writing and reading of HDF5 files: a full disk raises an error, and a file that is read is not trusted.

All data that is read lies in the file itself and is no larger than the file can hold.

Damage is detected in three ways. Arrays of numbers carry Fletcher's check sum, and headers that of the format: any
reader checks these. HDF5 has none for texts and attributes, so our files end with a seal of 24 bytes behind the end
that HDF5 records: a signature and the hash of all bytes before it. Other programs ignore the seal. One that changes
the file in place cuts it off, which leaves a file without a seal, like older ones.
"""

from __future__ import annotations

import hashlib
import io
import os
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import prod
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.interrupts import held
from slipstick.typing import AnyArray

if TYPE_CHECKING:
    import h5py


CHECKED = ("v110", "v110")
"""Versions of the format whose headers and indices have check sums, so that damage is found."""
BEST_COMPRESSION = 1100
"""Largest ratio of compression of the lossless filters of HDF5."""
_TEXT_BLOCK = 64 * 1024**2
_MOST_IN_ATTRIBUTE = 100_000
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_SEAL = b"sealed:\0"
_HASH = 16
_LARGEST_CHUNK = 16 * 1024**2
"""Bytes: HDF5 holds two copies of a piece while it makes or tests its check sum."""
_KEPT_PIECE = 1024**2
"""Bytes of a piece that HDF5 keeps in memory until it is full."""
_BLOCK = 1024**2
_HEAP = b"GCOL\x01\0\0\0"
_HEAP_OBJECT = struct.Struct("<H6xQ")


@contextmanager
def opened(path: Path) -> Iterator[h5py.File]:
    """The file for reading, once it is as it was written and holds nothing on which the library would loop for ever.

    Raises
    ------
    InputError
        If its seal is broken.
    ValueError, OSError
        If it is damaged in another way, or no HDF5 file.
    """
    import h5py

    with path.open("rb") as stream, mmap(stream.fileno(), 0, access=ACCESS_READ) as data:
        whole, heaps = _looked_through(stream)
        if not whole:
            raise InputError(
                f"{path}: damaged since it was written: its check sum does not match; take a copy, or compute it again"
            )
        for at in heaps:
            _require_sound_heap(data, at)
    with h5py.File(path, "r") as file:
        yield file


@contextmanager
def created(path: Path) -> Iterator[tuple[h5py.File, Callable[[], None]]]:
    """A new file, sealed at the end, and a function that raises the first error of writing, if there was one.

    HDF5 crashes where it cannot write, as on a full disk, at the latest when the process ends. So errors are hidden
    from it: bytes that could not be written stay in memory until the file is closed, and the error is raised then.
    Long writers call the function in between. Signals wait.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    import h5py

    with held():
        with path.open("w+b", buffering=0) as raw:
            target = _Target(raw)
            try:
                with h5py.File(target, "w", track_order=True, libver=CHECKED, rdcc_nbytes=_KEPT_PIECE) as file:
                    yield file, target.check
            finally:
                target.check()
        seal(path)


class _Target(io.RawIOBase):
    """A file for HDF5 to write, which never fails; ``check`` raises what went wrong."""

    def __init__(self, raw: io.FileIO) -> None:
        self._raw, self._at = raw, 0
        self._held: list[tuple[int, bytes]] = []
        self._failure: BaseException | None = None

    def check(self) -> None:
        """Raise what went wrong, if anything did."""
        if self._failure is not None:
            raise self._failure

    def write(self, data: Any) -> int:
        view = memoryview(data).cast("B")
        if self._failure is None:
            try:
                self._raw.seek(self._at)
                left = view
                while left:
                    left = left[self._raw.write(left) :]
            except BaseException as error:  # an interrupt, too, would be a failure to write
                self._failure = error.with_traceback(None)  # which holds the view of memory of HDF5
        if self._failure is not None:
            self._held.append((self._at, bytes(view)))
        self._at += len(view)
        return len(view)

    def readinto(self, buffer: Any) -> int:
        """What was written; zeros where nothing was."""
        view = memoryview(buffer).cast("B")
        view[:] = bytes(len(view))
        self._raw.seek(self._at)
        at = 0
        while at < len(view) and (count := self._raw.readinto(view[at:])):
            at += count
        for begin, data in self._held:
            first, last = max(begin, self._at), min(begin + len(data), self._at + len(view))
            if first < last:
                view[first - self._at : last - self._at] = data[first - begin : last - begin]
        self._at += len(view)
        return len(view)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        if whence == os.SEEK_END:
            offset += max([self._raw.seek(0, os.SEEK_END), *(begin + len(data) for begin, data in self._held)])
        elif whence == os.SEEK_CUR:
            offset += self._at
        self._at = offset
        return offset

    def tell(self) -> int:
        return self._at

    def truncate(self, size: int | None = None) -> int:
        size = self._at if size is None else size
        try:
            self._raw.truncate(size)
        except BaseException as error:
            self._failure = self._failure or error
        return size

    def readable(self) -> bool:
        return True

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True


def seal(path: Path) -> None:
    """Append the hash of a closed file to it."""
    with path.open("rb") as stream:
        digest = hashlib.file_digest(stream, _hash).digest()
    with path.open("ab") as stream:
        stream.write(_SEAL + digest)


def _hash(data: bytes = b"") -> Any:
    return hashlib.blake2b(data, digest_size=_HASH)


def _looked_through(stream: io.BufferedIOBase) -> tuple[bool, list[int]]:
    """Whether a file is what its seal says, and where in it heaps of texts may begin.

    One that ends where HDF5 says it ends has no seal. It is read block by block, not through the map of it: the whole
    of that would count as memory of the process.
    """
    size, begin = stream.seek(0, os.SEEK_END), b""
    end, digest, heaps = max(size - len(_SEAL) - _HASH, 0), _hash(), list[int]()
    stream.seek(0)
    at, before = 0, b""
    while block := stream.read(_BLOCK):
        begin = begin or block[:36]
        digest.update(block[: max(end - at, 0)])
        heaps += _found(before + block, at - len(before))
        at, before = at + len(block), block[1 - len(_HEAP) :]
    ours = begin[:8] == _SIGNATURE and begin[8:9] in b"\2\3"  # older ones are not
    if not ours or size <= int.from_bytes(begin[28:36], "little"):
        return True, heaps
    stream.seek(end)
    return stream.read() == _SEAL + digest.digest(), heaps


def _found(data: bytes, first: int) -> Iterator[int]:
    """Where heaps of texts may begin in a part of a file that itself begins at ``first``."""
    at = data.find(_HEAP)
    while at >= 0:
        yield first + at
        at = data.find(_HEAP, at + 1)


def check_summed(
    shape: tuple[int, ...], itemsize: int, limits: tuple[int | None, ...] | None = None, rows: int | None = None
) -> dict[str, Any]:
    """Options of a data set that is stored with its check sum, in pieces that HDF5 can hold; ``limits`` where it grows.

    A single number has no place for one, and nothing needs none. ``rows`` are those of a piece, if that is larger than
    HDF5 keeps in memory until it is full.
    """
    if not shape or (limits is None and 0 in shape):
        return {}
    count, row = max(shape[0], 1), itemsize * prod(max(n, 1) for n in shape[1:])
    if rows is None or count * row <= _KEPT_PIECE:
        rows = -(-count // min(-(-count * row // _LARGEST_CHUNK), count))
    chunks = (min(count, rows), *(max(n, 1) for n in shape[1:]))
    return {"chunks": chunks, "fletcher32": True, "maxshape": limits}


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
    if data.size <= block:
        yield np.asarray(data.asstr()[...]).reshape(-1)
    elif (row := prod(data.shape[1:])) <= block:
        for start in range(0, len(data), block // row):
            yield np.asarray(data.asstr()[start : start + block // row]).reshape(-1)
    else:
        for index in np.ndindex(data.shape[:-1]):
            for start in range(0, data.shape[-1], block):
                yield data.asstr()[(*index, slice(start, start + block))]


def attributes(node: h5py.Dataset, skipped: set[str]) -> dict[str, Any]:
    """Attributes by name but those skipped; raises ValueError for lists of texts and for huge ones."""
    import h5py

    kept = {}
    for name in node.attrs:
        if name in skipped:
            continue
        known = node.attrs.get_id(name)
        size = prod(known.shape)
        if size > (1 if h5py.check_string_dtype(known.dtype) else _MOST_IN_ATTRIBUTE):
            raise ValueError(f"attribute '{name}' of '{node.name}' is a list of {size}")
        kept[name] = node.attrs[name]
    return kept
