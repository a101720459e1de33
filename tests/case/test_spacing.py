"""Requested points by their number and spacing."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.cli.examples import example

TEXT = example("oscillator").path.read_text(encoding="utf-8").replace("to = 15.0", "to = 5.0\nAT")


def case(at: str, *changes: tuple[str, str]) -> ss.Case:
    text = TEXT.replace("AT", at)
    for old, new in changes:
        text = text.replace(old, new)
    return ss.Case.from_text(text)


@pytest.mark.parametrize("at, values", [
    ('at = { count = 9, spacing = "log" }', np.geomspace(2.0, 5.0, 9)),
    ("at = { count = 9 }", np.linspace(2.0, 5.0, 9)), ('at = { count = 2, spacing = "linear" }', [2.0, 5.0]),
])  # fmt: skip
def test_the_curve_goes_through_them_all(at: str, values: np.ndarray) -> None:
    asked = case(at)
    np.testing.assert_array_equal(asked.requested, values)
    omega = asked.run().dataset.omega.values
    assert set(asked.requested) <= set(omega)
    back = case(at, ("from = 2.0", "from = 5.0"), ("to = 5.0", "to = 2.0"))
    assert set(back.requested) <= set(back.run().dataset.omega.values)


@pytest.mark.parametrize("at, words", [
    ("at = { count = 1 }", r"\.count: found 1; expected a whole number from 2 to 100000"),
    ("at = { count = 3.0 }", r"\.count: found 3.0"), ("at = { count = true }", r"\.count: found true"),
    ('at = { count = 3, spacing = "cubic" }', r'\.spacing: found "cubic"; expected "linear" or "log"'),
    ('at = { spacing = "log" }', ': found { spacing = "log" }; expected a list of values, or a table such as'),
    ("at = { count = 3, number = 4 }", ": found { count = 3, number = 4 }; expected a list"),
    ("at = 3.0", ": found 3.0; expected a list of values"),
])  # fmt: skip
def test_faults(at: str, words: str) -> None:
    with pytest.raises(ss.InputError, match=rf"\[response\] at{words}"):
        case(at)


def test_a_logarithm_needs_positive_ends() -> None:
    sweep = ("from = 2.0", 'parameter = "damper.velocity"\nomega = 4.0\nfrom = 0.0')
    with raises_fault("response", "at", "spacing", found='"log", which needs from and to > 0'):
        case('at = { count = 3, spacing = "log" }', sweep)
    assert case("at = { count = 3 }", sweep).requested == (0.0, 2.5, 5.0)
