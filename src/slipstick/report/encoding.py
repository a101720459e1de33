"""Arrays and texts as a page can hold them: base64 of little-endian numbers, JSON that cannot end its own element."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

_TYPES = {"f8": "<f8", "f4": "<f4", "u2": "<u2", "u1": "u1"}
_STEPS = 2.0**47 - 1.0
"""Steps of a six-byte number to each side of zero."""
_UNSAFE = {ord(c): f"\\u{ord(c):04x}" for c in "<>&\u2028\u2029"}


def packed(values: ArrayLike, kind: str = "f4") -> dict[str, Any]:
    """An array (n, ...) of ``f8``, ``f4``, ``u2`` or ``u1``; rows that are all alike are kept once.

    >>> packed([[1.0], [1.0]], "f8")
    {'kind': 'f8', 'shape': [2, 1], 'once': True, 'data': 'AAAAAAAA8D8='}
    """
    return _packed(np.ascontiguousarray(values, dtype=_TYPES[kind]), kind)


def _packed(array: NDArray[Any], kind: str, shape: tuple[int, ...] | None = None) -> dict[str, Any]:
    once = len(array) > 1 and array.size > 0 and _alike(array)
    data = base64.b64encode(array[:1].tobytes() if once else array.tobytes()).decode("ascii")
    return {"kind": kind, "shape": list(array.shape if shape is None else shape), "once": once, "data": data}


def _alike(array: NDArray[Any]) -> bool:
    """Whether all rows are the same, bit for bit."""
    rows = array.reshape(len(array), -1).view(np.uint8)
    return bool((rows == rows[0]).all())


def fixed(coefficients: ArrayLike) -> dict[str, Any]:
    """Coefficients (n, m, L) with 1e-14 of the largest of each (n, m) kept, in six bytes a number.

    The zero harmonic stays apart, in eight bytes: it may be far larger than the motion around it.
    """
    values = np.asarray(coefficients, dtype=float)
    rest = values[:, :, 1:]
    scale = np.abs(rest).max(axis=2, initial=0.0) / _STEPS
    steps = np.divide(rest, scale[:, :, None], out=np.zeros_like(rest), where=scale[:, :, None] > 0)
    whole = np.rint(np.nan_to_num(steps)).astype("<i8")
    six = np.ascontiguousarray(whole.view(np.uint8).reshape(*whole.shape, 8)[..., :6])
    return {"zero": packed(values[:, :, 0], "f8"), "scale": packed(scale, "f8"), "rest": _packed(six, "i6", rest.shape)}


def safe_json(content: Any) -> str:
    r"""JSON that may stand in a page: it holds no character that could end a script element, or begin markup.

    >>> safe_json("</script>")
    '"\\u003c/script\\u003e"'
    """
    return json.dumps(content, allow_nan=False, ensure_ascii=False, separators=(",", ":")).translate(_UNSAFE)
