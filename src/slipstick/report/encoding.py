"""Encoding of arrays and texts in a page: little-endian numbers, deflated; JSON that cannot close its own element."""

from __future__ import annotations

import base64
import json
import zlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Indices = NDArray[np.intp]
SMALLEST_STEP = 2.0**-600
"""Step of a motion that is zero."""
_TYPES = {"f8": "<f8", "f4": "<f4", "u2": "<u2", "u1": "u1"}
_UNSAFE = {ord(c): f"\\u{ord(c):04x}" for c in "<>&\u2028\u2029"}


def packed(values: ArrayLike, kind: str = "f8") -> dict[str, Any]:
    r"""An array (n, ...) of ``f8``, ``f4``, ``u2`` or ``u1``; rows that are all equal are stored once.

    The first bytes of all numbers come first, then the second ones, and so on: neighbours along a curve are alike in
    their high bytes, so that they deflate better.

    >>> packed([[1.0], [1.0]], "f4")
    {'kind': 'f4', 'shape': [2, 1], 'once': True, 'bytes': b'\x00\x00\x80?'}
    """
    return _packed(np.ascontiguousarray(values, dtype=_TYPES[kind]), kind)


def _packed(array: NDArray[Any], kind: str, shape: tuple[int, ...] | None = None) -> dict[str, Any]:
    once = len(array) > 1 and array.size > 0 and _alike(array)
    kept = array[:1] if once else array
    width = int(kind[1:])
    planes = np.frombuffer(kept.tobytes(), np.uint8).reshape(-1, width).T.tobytes()
    return {"kind": kind, "shape": list(array.shape if shape is None else shape), "once": once, "bytes": planes}


def _alike(array: NDArray[Any]) -> bool:
    """Whether all rows are the same, bit for bit."""
    rows = array.reshape(len(array), -1).view(np.uint8)
    return bool((rows == rows[0]).all())


def fixed(coefficients: ArrayLike, width: int, step: ArrayLike = 0.0) -> dict[str, Any]:
    """Coefficients (n, m, L) as whole numbers of ``width`` bytes, at most 6, each (n, m) in its own steps.

    A step is a power of two: the next one above ``step`` (n, m), and above 2^(1 - 8 width) of the largest
    coefficient. The mean, which may be far larger, has eight bytes of its own, rounded to the same steps.
    """
    values = np.asarray(coefficients, dtype=float)
    least = np.abs(values[:, :, 1:]).max(axis=2, initial=0.0) / (2.0 ** (8 * width - 1) - 1.0)
    scale = np.exp2(np.ceil(np.log2(np.maximum(np.maximum(least, step), SMALLEST_STEP))))
    whole = np.rint(np.nan_to_num(values / scale[:, :, None], posinf=0.0, neginf=0.0))
    zero = packed(whole[:, :, 0] * scale, "f8")
    rest = whole[:, :, 1:].astype("<i8")
    kept = np.ascontiguousarray(rest.view(np.uint8).reshape(*rest.shape, 8)[..., :width])
    return {"zero": zero, "scale": packed(scale, "f8"), "rest": _packed(kept, f"i{width}", rest.shape)}


def gathered(content: object) -> tuple[Any, str]:
    """Content with all its bytes in one place, deflated, in base64; each is replaced by its place there."""
    parts: list[bytes] = []
    plain = _without_bytes(content, parts, [0])
    return plain, base64.b64encode(zlib.compress(b"".join(parts))).decode("ascii")


def _without_bytes(content: object, parts: list[bytes], end: list[int]) -> Any:
    if isinstance(content, bytes):
        start = end[0]
        parts.append(content)
        end[0] += len(content)
        return [start, end[0]]
    if isinstance(content, dict):
        return {key: _without_bytes(value, parts, end) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_without_bytes(value, parts, end) for value in content]
    return content


def safe_json(content: object) -> str:
    r"""JSON that may stand in a page: it holds no character that could end a script element, or begin markup.

    >>> safe_json("</script>")
    '"\\u003c/script\\u003e"'
    """
    return json.dumps(content, allow_nan=False, ensure_ascii=False, separators=(",", ":")).translate(_UNSAFE)
