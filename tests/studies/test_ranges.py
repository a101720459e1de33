"""Values of one parameter as they may be given."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.studies.parameter_values import parameter_values, sampled_range


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (3, [3.0]),
        ([1, 2.5], [1.0, 2.5]),
        (np.array([4.0]), [4.0]),
        ({"from": 0, "to": 1, "count": 3}, [0.0, 0.5, 1.0]),
        ({"from": 1, "to": 100, "count": 3, "spacing": "log"}, [1.0, 10.0, 100.0]),
        ({"from": 2, "to": -2, "count": 2}, [2.0, -2.0]),
    ],
)
def test_values(given: Any, expected: list[float]) -> None:
    assert parameter_values(("mu",), given) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ([], "mu: found an empty list; expected at least one value"),
        ("0..3", "mu: found '0..3'; expected a list of numbers"),
        ([[1, 2]], "expected a list of numbers"),
        ([1, float("nan")], "expected a list of numbers"),
        ({"from": 1, "to": 2}, "mu, count is missing"),
        ({"to": 2, "count": 3}, "mu, from is missing"),
        ({"from": 1, "to": 2, "count": 1}, "mu, count: found 1; expected a whole number from 2"),
        ({"from": 1, "to": 1, "count": 3}, "expected two different ends"),
        ({"from": 0, "to": 1, "count": 3, "spacing": "log"}, 'expected ends > 0 with spacing = "log"'),
        (
            {"from": 1, "to": 2, "count": 3, "spacing": "even"},
            'mu, spacing: found \'even\'; expected "linear" or "log"',
        ),
        ({"from": 1, "to": 2, "number": 3}, "mu, number: unknown key; there are from"),
    ],
)
def test_what_is_no_value(given: Any, sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        parameter_values(("mu",), given)
    assert sentence in str(caught.value)


def test_boxes_of_samples() -> None:
    assert sampled_range(("mu",), [0.1, 0.4]) == (0.1, 0.4, "linear")
    assert sampled_range(("mu",), {"from": 1, "to": 9, "spacing": "log"}) == (1.0, 9.0, "log")
    for given, sentence in (([1, 2, 3], "ends of a range"), ({"from": 1, "to": 2, "count": 9}, "samples are counted")):
        with pytest.raises(InputError, match=sentence):
            sampled_range(("mu",), given)
