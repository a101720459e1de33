"""Checks of given values."""

import pytest

from slipstick.errors import InputError
from slipstick.faults import SMALLEST, number


@pytest.mark.parametrize("value", [1e-101, -1e-200, 5e-324])
def test_numbers_whose_products_vanish_are_refused(value: float) -> None:
    with pytest.raises(
        InputError, match=r"sin: found .*; expected a finite number, 0 or above 1e-100: check the units"
    ):
        number("sin", value)


def test_zero_and_the_smallest_number_are_numbers() -> None:
    assert number("sin", 0.0) == 0.0
    assert number("sin", -SMALLEST) == -SMALLEST
