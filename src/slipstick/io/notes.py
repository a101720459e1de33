"""Numbers, texts and arrays by name in few bytes: what is kept beside the numbers of a point. Nothing is executed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from slipstick.errors import InputError


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
    """What :func:`packed` was given.

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
