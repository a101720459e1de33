"""Arrays of numbers in a MATLAB file of version 5 to 7.3. Nothing in it is trusted or executed.

Version 7.3 is HDF5, read by h5py. Versions 5 to 7 are read here, arrays of numbers and structs alone: SciPy looks up
types that a file claims without a bound, so that single wrong bytes end the process (MathWorks, MAT-File Format, 2023,
chapter 1).
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator, Mapping
from math import prod
from pathlib import Path
from struct import unpack_from
from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import Fault, InputError, first_line
from slipstick.typing import AnyArray

if TYPE_CHECKING:
    import h5py

_MOST_BYTES = 2**31
"""Of all that is read of a file."""
_MOST_ARRAYS, _DEEPEST = 10_000, 8
_COMPRESSED = 15
"""Type of a compressed element of a file of version 5."""
_MATRIX, _STRUCT, _NUMBERS, _OF_COMPLEX = 14, 2, range(6, 16), 0x800
"""Type of an element that is a variable; classes of variables; the mark of complex ones."""
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""Types of numbers."""
_INDEXED = re.compile(r"([^()]+?)\s*\(([\d:,\s]+)\)")
_TOO_LARGE = "it holds more than two gigabytes: keep the variables that are needed"
_HDF5 = b"\x89HDF\r\n\x1a\n"
_HEADER = 128
_NEW_HEADER = 512
"""Bytes before the HDF5 part of a file of version 7.3."""


def matlab_arrays(file: Path) -> dict[str, AnyArray]:
    """Arrays of numbers, real or complex, by name; vectors have one dimension, ``rig.f`` is a field of a struct.

    Texts, cells, objects and arrays of structs are passed over.

    Raises
    ------
    InputError
        For a file that is none, or holds more than two gigabytes or ten thousand arrays.
    """
    try:
        with file.open("rb") as stream:
            head = stream.read(_NEW_HEADER + len(_HDF5))
        newer = _HDF5 in (head[: len(_HDF5)], head[_NEW_HEADER:])
        arrays: dict[str, AnyArray] = {}
        for name, values in _of_hdf5(file) if newer else _of_elements(file):
            arrays[name] = values.reshape(-1) if values.size == max(values.shape, default=1) else values
            if len(arrays) > _MOST_ARRAYS:
                raise ValueError(f"it holds more than {_MOST_ARRAYS} arrays: keep those that are needed")
    except Exception as error:  # whatever a file that is none leads to
        raise InputError(Fault(str(file), "cannot be read as a MATLAB file", remedy=first_line(error))) from None
    if not arrays:
        expected = "vectors such as frequencies and displacements"
        raise InputError(Fault(str(file), "holds no arrays of numbers", expected=expected))
    return arrays


def _of_elements(file: Path) -> Iterator[tuple[str, AnyArray]]:
    if file.stat().st_size > _MOST_BYTES:
        raise ValueError(_TOO_LARGE)
    data = memoryview(file.read_bytes())
    mark = bytes(data[_HEADER - 2 : _HEADER])
    if mark not in (b"IM", b"MI"):
        raise ValueError("it has no header of version 5 to 7.3; save it with -v7")
    order, left = "<" if mark == b"IM" else ">", _MOST_BYTES
    for kind, body in _elements(data[_HEADER:], order):
        if kind == _COMPRESSED:
            inflating = zlib.decompressobj()
            body = memoryview(inflating.decompress(body, left + 1))
            if (left := left - len(body)) < 0:
                raise ValueError(_TOO_LARGE)
            kind, body = next(_elements(body, order))
        if kind == _MATRIX:
            yield from _variables("", body, order)


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Types and contents of the elements in a part of a file; short ones have both in one word."""
    at = 0
    while at + 8 <= len(data):
        (word,) = unpack_from(f"{order}I", data, at)
        if word >> 16:
            kind, count, begin, step = word & 0xFFFF, word >> 16, at + 4, 8
        else:
            kind, begin = word, at + 8
            (count,) = unpack_from(f"{order}I", data, at + 4)
            step = 8 + count + (-count % 8 if kind != _COMPRESSED else 0)
        if begin + count > len(data) or (word >> 16 and count > 4):
            raise ValueError("it ends within an array")
        yield kind, data[begin : begin + count]
        at += step


def _variables(before: str, body: memoryview, order: str, depth: int = 0) -> Iterator[tuple[str, AnyArray]]:
    """An array, or those of a struct; nothing of other variables, as texts, cells and objects."""
    parts = _elements(body, order)
    (flags,) = unpack_from(f"{order}I", next(parts, (0, b""))[1], 0)
    of_class = flags & 0xFF
    if of_class not in _NUMBERS and of_class != _STRUCT:
        return
    dims = [int(n) for n in _numbers(*next(parts), order)]
    name = before + bytes(next(parts)[1]).decode("latin-1")
    if of_class == _STRUCT:
        (length,), (_, names) = _numbers(*next(parts), order), next(parts)
        if prod(dims) == 1 and depth < _DEEPEST:
            fields = [bytes(names[k : k + length]) for k in range(0, len(names), max(int(length), 1))]
            for field, (kind, inside) in zip(fields, parts, strict=False):
                if kind == _MATRIX and len(inside):
                    called = field.split(b"\0")[0].decode("latin-1")
                    yield from _variables(f"{name}.{called}", inside, order, depth + 1)
        return
    values = _numbers(*next(parts), order)
    if flags & _OF_COMPLEX:
        values = values + 1j * _numbers(*next(parts), order)
    if min(dims, default=0) < 0 or prod(dims) != values.size:
        raise ValueError(f"{name} has {values.size} numbers, not {' x '.join(map(str, dims))}")
    if values.size:
        yield name, values.reshape(dims, order="F")


def _numbers(kind: int, data: memoryview, order: str) -> AnyArray:
    if kind not in _TYPES:
        raise ValueError(f"it holds numbers of an unknown type {kind}")
    return np.frombuffer(data, dtype=f"{order}{_TYPES[kind]}")


def vector(arrays: Mapping[str, AnyArray], name: str) -> AnyArray | None:
    """A vector by its name in MATLAB: ``f``, a column ``H(:,2)``, a row ``H(2,:)``; None where there is none.

    >>> vector({"H": np.array([[1, 2], [3, 4]])}, "H(2, :)").tolist()
    [3, 4]
    """
    found = _INDEXED.fullmatch(name)
    if name in arrays or found is None:
        values = arrays.get(name)
        return values if values is not None and values.ndim == 1 else None
    values, places = arrays.get(found[1]), [word.strip() for word in found[2].split(",")]
    if values is None or len(places) != values.ndim or places.count(":") != 1:
        return None
    for word, n in zip(places, values.shape, strict=True):
        if word != ":" and not (word.isdigit() and len(word) < 10 and 1 <= int(word) <= n):
            return None
    return np.asarray(values[tuple(slice(None) if word == ":" else int(word) - 1 for word in places)])


def _of_hdf5(file: Path) -> Iterator[tuple[str, AnyArray]]:
    import h5py

    with h5py.File(file, "r") as held:
        left = _MOST_BYTES
        for name, data in _datasets(held, ""):
            left -= prod(data.shape) * data.dtype.itemsize
            if left < 0:
                raise ValueError(_TOO_LARGE)
            values = data[()]
            if values.dtype.names:
                values = values["real"] + 1j * values["imag"]
            yield name, np.asarray(values).T


def _datasets(group: h5py.Group, before: str, depth: int = 0) -> Iterator[tuple[str, h5py.Dataset]]:
    """Arrays of numbers that are stored in the file itself."""
    import h5py

    for key in group:
        name = f"{before}{key}"
        if name.startswith("#") or not isinstance(group.get(key, getlink=True), h5py.HardLink):
            continue
        node = group[key]
        if isinstance(node, h5py.Group):
            if depth < _DEEPEST:
                yield from _datasets(node, f"{name}.", depth + 1)
            continue
        complex_numbers = node.dtype.names == ("real", "imag")
        about = {word: node.attrs[word] for word in ("MATLAB_class", "MATLAB_empty") if word in node.attrs}
        texts = about.get("MATLAB_class", b"") in (b"char", b"cell", "char", "cell")
        if node.external or node.is_virtual or texts or "MATLAB_empty" in about or not node.shape:
            continue
        if complex_numbers or node.dtype.kind in "biuf":
            yield name, node
