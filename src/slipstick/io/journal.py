"""An append-only journal of points beside a results file: what a killed run leaves can be read to the last point.

Layout: one line of JSON (names, sizes, attributes), then records of fixed size: check sum (CRC-32, 4 bytes) and the
numbers as little-endian float64. A record cut short by a kill or a full disk fails its check sum and ends the reading.
"""

from __future__ import annotations

import json
import os
import zlib
from dataclasses import asdict
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.results.schema import Declared, Layout

_MAGIC = "slipstick journal 2"
_LARGEST_HEADER = 64 * 1024**2
_LARGEST_FILE = 16 * 1024**3
_MOST_DIMENSIONS = 8


class Journal:
    """The journal being written."""

    def __init__(self, path: Path, layout: Layout) -> None:
        self.path, self._layout = path, layout
        header = json.dumps({"magic": _MAGIC, **asdict(layout)}) + "\n"
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        self._end = 0
        self._write(header.encode())

    def append(self, row: NDArray[np.float64]) -> None:
        """Write one point; on failure (a full disk) the journal keeps the points before it."""
        payload = row.astype("<f8").tobytes()
        self._write(zlib.crc32(payload).to_bytes(4, "little") + payload)

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
            os.close(self._file)
            self._file = -1
        if remove:
            self.path.unlink(missing_ok=True)


def journal_of(path: Path) -> Path:
    """Where the journal of a results file lies."""
    return path.with_name(path.name + ".journal")


def read_journal(path: Path) -> tuple[Layout, NDArray[np.float64]]:
    """Layout and rows (n_points, size) of every complete point.

    Raises
    ------
    InputError
        If the file is no journal, or cannot be read.
    """
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise InputError(f"{path}: larger than {_LARGEST_FILE >> 30} GB; expected the journal of a run")
        with path.open("rb") as stream:
            return _read(stream, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None


def _read(stream: IO[bytes], path: Path) -> tuple[Layout, NDArray[np.float64]]:
    layout = _layout(stream.readline(_LARGEST_HEADER), path)
    rows, length = [], 8 * layout.size
    if length <= path.stat().st_size:  # a point larger than the file is not even asked for
        while len(record := stream.read(4 + length)) == 4 + length:
            if zlib.crc32(record[4:]) != int.from_bytes(record[:4], "little"):
                break
            rows.append(np.frombuffer(record, dtype="<f8", offset=4))
    return layout, np.array(rows, dtype=float).reshape(len(rows), layout.size)


def _layout(line: bytes, path: Path) -> Layout:
    try:
        header = json.loads(line)
        if header.pop("magic") != _MAGIC:
            raise ValueError
        layout = Layout(
            labels={k: tuple(map(str, v)) for k, v in header["labels"].items()},
            variables={k: _declared(*v) for k, v in header["variables"].items()},
            attributes={k: v for k, v in header["attributes"].items() if isinstance(v, str | int | float)},
        )
        most = max(len(declared.dims) for declared in layout.variables.values())
        if not 0 < 8 * layout.size <= _LARGEST_FILE or most > _MOST_DIMENSIONS:
            raise ValueError
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError):
        raise InputError(f"{path}: not a journal of slipstick; expected one written by 'slipstick run'") from None
    return layout


def _declared(dims: Any, units: Any, long_name: Any, whole: Any, texts: Any) -> Declared:
    return Declared(tuple(map(str, dims)), str(units), str(long_name), bool(whole), tuple(map(str, texts)))
