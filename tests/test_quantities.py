"""Texts that stand for numbers."""

from __future__ import annotations

import math

import pytest
from helpers.counting import traced
from hypothesis import given
from hypothesis import strategies as st

from slipstick.quantities import harmonic_orders, ratio_of_periods, read_angle, read_frequency


@pytest.mark.parametrize(
    "value, expected",
    [
        (2, 2.0),
        (2.5, 2.5),
        ("0.32 Hz", 0.64 * math.pi),
        ("1.5kHz", 3000 * math.pi),
        ("3000 rpm", 100 * math.pi),
        ("3e3 RPM", 100 * math.pi),
        ("7 rad/s", 7.0),
        (".5 hz", math.pi),
    ],
)
def test_frequencies(value: object, expected: float) -> None:
    assert read_frequency(value) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("value", ["2", "Hz", "2 herz", "1e400 Hz", math.inf, math.nan, True, None, [1], "1,5 Hz", ""])
def test_faulty_frequencies(value: object) -> None:
    with pytest.raises(ValueError, match="expected a"):
        read_frequency(value)


def test_angles() -> None:
    assert read_angle("90 deg") == pytest.approx(math.pi / 2)
    assert read_angle("180°") == pytest.approx(math.pi)
    assert read_angle(1) == 1.0


@pytest.mark.parametrize(
    "value, expected",
    [("0..3", [0, 1, 2, 3]), ("0, 1, 3..5", [0, 1, 3, 4, 5]), ([0, 2], [0, 2]), ("0", [0]), (" 0 .. 2 ", [0, 1, 2])],
)
def test_harmonics(value: object, expected: list[int]) -> None:
    assert harmonic_orders(value) == expected


@pytest.mark.parametrize(
    "value",
    ["1..3", "0..", "a", "0,0", "3..1", [0, 1.5], [True], [0, -1], [], "", None, 5, {}, "0;1", "0..3..5", [0, "1"]],
)
def test_faulty_harmonics(value: object) -> None:
    with pytest.raises(ValueError, match=r"expected|whole"):
        harmonic_orders(value)


@pytest.mark.parametrize("value", ["0..100000000", "0..999999999999999999", "0..99999999999999999999", [0, 10**30]])
def test_huge_harmonics_are_refused_before_a_list_is_made(value: object) -> None:
    with traced() as memory, pytest.raises(ValueError, match=r"above|expected"):
        harmonic_orders(value)
    assert memory.peak < 100_000


def test_many_harmonics_are_refused() -> None:
    with pytest.raises(ValueError, match="more than 500"):
        harmonic_orders("0..600")


@given(st.text(max_size=20))
def test_any_text_gives_orders_or_a_sentence(text: str) -> None:
    try:
        orders = harmonic_orders(text)
    except ValueError:
        return
    assert orders[0] == 0


@pytest.mark.parametrize("value, expected", [("3/2", (3, 2)), ([3, 2], (3, 2)), (" 1 / 1 ", (1, 1))])
def test_period_ratios(value: object, expected: tuple[int, int]) -> None:
    assert ratio_of_periods(value) == expected


@pytest.mark.parametrize("value", ["3", "3/0", "3/2/1", [3], [3.0, 2], [True, 1], 1.5, None, "-1/2", "10000/1"])
def test_faulty_period_ratios(value: object) -> None:
    with pytest.raises(ValueError, match="two whole numbers"):
        ratio_of_periods(value)
