"""Numbers and texts in a page: nothing is lost on the way, nothing can break out."""

from __future__ import annotations

import base64
import json
import zlib

import numpy as np
import pytest
from helpers.reports import decoded, decoded_coefficients, unplaned

from slipstick.report.encoding import fixed, gathered, packed, safe_json


@pytest.mark.parametrize("kind", ["f8", "f4", "u2", "u1"])
def test_an_array_comes_back(kind: str) -> None:
    values = np.arange(12.0).reshape(3, 4)
    assert (decoded(packed(values, kind)) == values).all()
    assert not packed(values, kind)["once"]


def test_rows_that_are_all_alike_are_kept_once() -> None:
    values = np.broadcast_to([1.0, np.nan, -0.0], (50, 3))
    found = packed(values, "f8")
    assert found["once"]
    assert len(found["bytes"]) == 24
    np.testing.assert_array_equal(decoded(found), values)
    assert not packed([[0.0], [-0.0]], "f8")["once"]


@pytest.mark.parametrize("shape", [(0,), (0, 3), (4, 0), (1, 2)])
def test_arrays_with_few_or_no_numbers(shape: tuple[int, ...]) -> None:
    assert packed(np.ones(shape))["shape"] == list(shape)
    assert fixed(np.ones((*shape[:1], 2, 3)), 5)["rest"]["shape"] == [shape[0], 2, 2]


@pytest.mark.parametrize("width, kept", [(3, 1.2e-7), (5, 1.9e-12), (6, 7.2e-15)])
def test_coefficients_keep_a_step_of_the_largest(width: int, kept: float) -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(size=(7, 3, 21)) * 10.0 ** rng.integers(-9, 9, size=(7, 3, 1))
    values[..., 0] *= 1e6  # a mean position far from zero takes nothing from the motion round it
    values[2, 1, 1:] = 0.0
    found = fixed(values, width)
    size = np.abs(values[..., 1:]).max(axis=2, keepdims=True)
    assert np.all(np.abs(decoded_coefficients(found) - values) <= kept * size)
    coarse = fixed(values, width, 1e-3 * size[..., 0])
    assert np.all(np.abs(decoded_coefficients(coarse) - values) <= 1e-3 * size)


def test_bytes_are_gathered() -> None:
    plain, text = gathered({"a": [packed([1.0, 2.0], "f8")], "b": "c", "d": packed([3, 4], "u1")})
    store = zlib.decompress(base64.b64decode(text))
    assert plain["b"] == "c"
    assert np.frombuffer(unplaned(store[slice(*plain["a"][0]["bytes"])], 8)).tolist() == [1.0, 2.0]
    assert list(store[slice(*plain["d"]["bytes"])]) == [3, 4]
    assert len(store) == 18


def test_json_cannot_end_its_element() -> None:
    text = "</script><!--<script>&\u2028\u2029 ß \U0001d49c"
    made = safe_json({"a": [text, 1.5, None]})
    assert not set("<>&\u2028\u2029") & set(made)
    assert json.loads(made) == {"a": [text, 1.5, None]}
    with pytest.raises(ValueError, match="JSON"):
        safe_json(float("nan"))
