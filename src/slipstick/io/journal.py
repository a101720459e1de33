"""Append-only journal of points next to a results file: after a killed run it can be read up to the last point.

Layout: one line, the check sum (CRC-32) of the rest of it and JSON (names, sizes, attributes, what identifies the run);
then one record a point: its length (8 bytes), its check sum (4 bytes), that of these 12 bytes (4 bytes), the numbers of
the point as little-endian float64, and a note from which the run goes on. A record cut short by a kill or a full disk
ends the reading; so does a damaged one, which is named.
"""

from __future__ import annotations

import errno
import io
import json
import os
import time
import zlib
from array import array
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.replacing import replacing
from slipstick.results.schema import Declared, Layout

_MAGIC = "slipstick journal 4"
_LARGEST_HEADER = 64 * 1024**2
_LARGEST_FILE = 16 * 1024**3
_MOST_DIMENSIONS = 8
_HEAD = 16
_SHARE = 10.0
"""Time between two synchronisations with the disk, over the time that the last one took."""


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """A journal that was read: its points stay on the disk until they are used.

    Attributes
    ----------
    path, layout
        Path of the file, and layout of a point.
    about
        Texts and numbers that identify the run, as in ``Journal``.
    places
        Bytes up to the numbers of each point.
    ends
        Bytes up to the first point, and up to the end of each.
    damage
        What ended the reading before the end of the file, where that is damage and not a record cut short.
    """

    path: Path
    layout: Layout
    about: dict[str, Any]
    places: list[int]
    ends: list[int]
    damage: str = ""

    def __len__(self) -> int:
        return len(self.places)

    @property
    def rows(self) -> NDArray[np.float64]:
        """The numbers of all points, (n_points, size)."""
        return self.part(0, len(self))

    def part(self, first: int, last: int) -> NDArray[np.float64]:
        """The numbers of points ``first`` to before ``last``; raises InputError where they cannot be read any more."""
        with self._opened() as stream:
            return _numbers(stream, self.places[first:last], slice(0, self.layout.size))

    def note(self, point: int) -> bytes:
        """What was noted with a point; raises InputError where it cannot be read any more."""
        with self._opened() as stream:
            return self._note(stream, point)

    def notes(self) -> Iterator[bytes]:
        """What was noted with each point, one after the other."""
        with self._opened() as stream:
            for point in range(len(self)):
                yield self._note(stream, point)

    def _note(self, stream: io.FileIO, point: int) -> bytes:
        begin = stream.seek(self.places[point] + 8 * self.layout.size)
        note = bytearray(self.ends[1:][point] - begin)
        _fill(memoryview(note), stream)
        return bytes(note)

    @contextmanager
    def _opened(self) -> Iterator[io.FileIO]:
        try:
            with self.path.open("rb", buffering=0) as stream:
                yield stream
        except OSError as error:
            raise _unreadable(self.path, error) from None


class Journal:
    """The journal being written.

    Every point is the operating system's at once, so that it survives the end of the process; and the disk's as often
    as that costs at most a tenth of the running time, so that it survives the loss of power.

    Parameters
    ----------
    path, layout
        Path of the file, and layout of a point.
    about
        Texts and numbers by name that identify the run.
    keep, places
        Bytes of an earlier journal to be continued, and the places of its points, as in ``Recorded``; by default a new
        file is begun.
    """

    def __init__(
        self, path: Path, layout: Layout, about: Mapping[str, Any] | None = None, keep: int = 0,
        places: Sequence[int] = (),
    ) -> None:  # fmt: skip
        self.path, self._layout, self._places = path, layout, array("q", places)  # eight bytes a point
        if not keep:
            header = json.dumps({"magic": _MAGIC, **asdict(layout), "about": dict(about or {})}).encode()
            keep = _begin(path, b"%08x " % zlib.crc32(header) + header + b"\n")
        self._file = os.open(path, os.O_RDWR | getattr(os, "O_BINARY", 0))
        os.ftruncate(self._file, keep)
        os.lseek(self._file, keep, os.SEEK_SET)
        self._end, self._cost, self._when = keep, 0.0, 0.0
        self.removed = False

    def __len__(self) -> int:
        return len(self._places)

    def append(self, row: NDArray[np.float64], note: Mapping[str, Any] | None = None) -> None:
        """Write one point; on failure (a full disk) the journal keeps the points before it."""
        payload = row.astype("<f8").tobytes() + (packed_notes(note) if note is not None else b"")
        place = self._end + _HEAD
        head = len(payload).to_bytes(8, "little") + _crc(payload)
        self._write(head + _crc(head) + payload)
        self._places.append(place)
        if time.perf_counter() - self._when > _SHARE * self._cost:
            self.sync()

    def rows(self, first: int, last: int) -> NDArray[np.float64]:
        """The numbers of points ``first`` to before ``last``, (n_points, size), read from the file."""
        return self._numbers(self._places[first:last], slice(0, self._layout.size))

    def columns(self, name: str) -> NDArray[np.float64]:
        """The numbers of one variable at all points, (n_points, numbers), read from the file."""
        return self._numbers(self._places, self._layout.columns[name])

    def _numbers(self, places: Sequence[int], columns: slice) -> NDArray[np.float64]:
        if self._file < 0:
            with self.path.open("rb", buffering=0) as stream:
                return _numbers(stream, places, columns)
        try:
            with io.FileIO(self._file, closefd=False) as stream:
                return _numbers(stream, places, columns)
        finally:
            os.lseek(self._file, self._end, os.SEEK_SET)

    def sync(self) -> None:
        """Bring what was written to the disk itself."""
        begin = time.perf_counter()
        os.fsync(self._file)
        self._when = time.perf_counter()
        self._cost = self._when - begin

    def _write(self, data: bytes) -> None:
        view = memoryview(data)
        try:
            while view:
                view = view[os.write(self._file, view) :]
        except OSError:
            os.ftruncate(self._file, self._end)
            os.lseek(self._file, self._end, os.SEEK_SET)
            raise
        self._end += len(data)

    def close(self, *, remove: bool) -> None:
        """Close, and remove the file where the results file holds everything."""
        if self._file >= 0:
            if not remove:
                self.sync()
            os.close(self._file)
            self._file = -1
        if remove:
            self.path.unlink(missing_ok=True)
            self.removed = True


def _begin(path: Path, header: bytes) -> int:
    """Make a journal with its header in one step, so that no reader finds it incomplete; return its size."""
    with replacing(path) as temporary:
        temporary.write_bytes(header)
    return len(header)


def journal_of(path: Path) -> Path:
    """Where the journal of a results file lies."""
    return path.with_name(path.name + ".journal")


def read_journal(path: Path) -> Recorded:
    """Everything up to the last complete point.

    Raises
    ------
    InputError
        If the file is no journal, or cannot be read.
    """
    try:
        size = path.stat().st_size
        if size > _LARGEST_FILE:
            raise InputError(f"{path}: larger than {_LARGEST_FILE >> 30} GB; expected the journal of a run")
        with path.open("rb") as stream:
            line = stream.readline(_LARGEST_HEADER)
            layout, about = _header(line, path)
            begin = stream.tell()
            records, damage = _records(stream, 8 * layout.size, size)
    except OSError as error:
        raise _unreadable(path, error) from None
    if damage:
        damage = f"{path}: {damage} after {len(records)} points; what it holds beyond them is left out"
    return Recorded(
        path=path, layout=layout, about=about, places=[place for place, _ in records],
        ends=[begin, *(end for _, end in records)], damage=damage,
    )  # fmt: skip


def _unreadable(path: Path, error: OSError) -> InputError:
    return InputError(f"{path}: cannot be read ({error.strerror or error})")


def _fill(buffer: memoryview, stream: io.FileIO) -> None:
    """Fill it with what comes next in a file; raises OSError where that ends before."""
    at = 0
    while at < len(buffer):
        count = stream.readinto(buffer[at:])
        if not count:
            raise OSError(errno.EIO, "it was cut short meanwhile")
        at += count


def _numbers(stream: io.FileIO, places: Sequence[int], columns: slice) -> NDArray[np.float64]:
    """Some of the numbers of points (n_points, n_columns), where the numbers of a point begin at ``places``."""
    rows = np.empty((len(places), columns.stop - columns.start), dtype="<f8")
    for row, place in zip(rows, places, strict=True):
        stream.seek(place + 8 * columns.start)
        _fill(row.view(np.uint8).data, stream)
    return rows.astype(float, copy=False)


_Records = list[tuple[int, int]]


def _records(stream: IO[bytes], least: int, size: int) -> tuple[_Records, str]:
    """Begin and end of each record of at least ``least`` bytes, up to ``size``; "damaged" if the reading ended so."""
    records: _Records = []
    while True:
        head = stream.read(_HEAD)
        if len(head) < _HEAD or not any(head):  # a loss of power may leave zeros that nobody wrote
            return records, ""
        length, begin = int.from_bytes(head[:8], "little"), stream.tell()
        if _crc(head[:12]) != head[12:] or length < least:
            return records, "damaged"
        if length > size - begin:
            return records, ""
        if _crc(stream.read(length)) != head[8:12]:
            return records, "damaged"
        records.append((begin, begin + length))


def _crc(data: bytes) -> bytes:
    return zlib.crc32(data).to_bytes(4, "little")


def _header(line: bytes, path: Path) -> tuple[Layout, dict[str, Any]]:
    try:
        check, text = line[:9], line[9:]
        if check != b"%08x " % zlib.crc32(text.rstrip(b"\n")):
            raise ValueError
        header = json.loads(text)
        if header.pop("magic") != _MAGIC:
            raise ValueError
        layout = Layout(
            labels={k: tuple(map(str, v)) for k, v in header["labels"].items()},
            variables={k: _declared(*v) for k, v in header["variables"].items()},
            attributes=_plain(header["attributes"]),
        )
        most = max(len(declared.dims) for declared in layout.variables.values())
        if not 0 < 8 * layout.size <= _LARGEST_FILE or most > _MOST_DIMENSIONS:
            raise ValueError
        return layout, _plain(header["about"])
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError):
        ours = line[9:].startswith(b'{"magic": "slipstick journal')
        if ours and not line.endswith(b"\n"):
            raise InputError(f"{path}: the journal is cut short in its header: no point in it can be read") from None
        raise InputError(
            f"{path}: damaged, or not a journal of slipstick; expected one written by 'slipstick run'"
        ) from None


def _plain(attributes: Any) -> dict[str, Any]:
    return {str(k): v for k, v in attributes.items() if isinstance(v, str | int | float)}


def _declared(dims: Any, units: Any, long_name: Any, whole: Any, texts: Any) -> Declared:
    return Declared(tuple(map(str, dims)), str(units), str(long_name), bool(whole), tuple(map(str, texts)))


def packed_notes(values: Mapping[str, Any]) -> bytes:
    """Values by name: numbers, texts, lists of them, and arrays (n,) of floats, which keep every bit.

    >>> unpacked(packed_notes({"a": np.array([0.1, 2.0]), "b": [1, "x"]}))
    {'b': [1, 'x'], 'a': array([0.1, 2. ])}
    """
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    plain = {name: value for name, value in values.items() if name not in arrays}
    line = json.dumps({"values": plain, "arrays": {name: value.size for name, value in arrays.items()}}) + "\n"
    return line.encode() + b"".join(value.astype("<f8").tobytes() for value in arrays.values())


def unpacked(data: bytes) -> dict[str, Any]:
    """The values that :func:`packed_notes` was called with.

    Raises
    ------
    InputError
        If it is nothing of that kind.
    """
    line, _, rest = data.partition(b"\n")
    try:
        header = json.loads(line)
        values, at = dict(header["values"]), 0
        for name, size in header["arrays"].items():
            if not 0 <= size <= (len(rest) - at) // 8:
                raise ValueError
            values[name] = np.frombuffer(rest, dtype="<f8", count=size, offset=at).astype(float)
            at += 8 * size
        return values
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise InputError("a note in the journal is damaged; expected one written by 'slipstick run'") from None
