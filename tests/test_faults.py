"""Checks of given values."""

from importlib import import_module

import pytest
from helpers.faults import raises_fault

from slipstick.errors import InputError
from slipstick.faults import LARGEST, SMALLEST, number, numbers


@pytest.mark.parametrize("value", [1e-101, -1e-200, 5e-324])
def test_numbers_whose_products_vanish_are_refused(value: float) -> None:
    with raises_fault("sin", says="expected a finite number, 0 or above 1e-100: check the units"):
        number("sin", value)


def test_zero_and_the_smallest_number_are_numbers() -> None:
    assert number("sin", 0.0) == 0.0
    assert number("sin", -SMALLEST) == -SMALLEST


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ([1.0, 1e200], "finite real numbers, none above 1e+100: check the units"),
        ([1e200, float("nan")], "finite real numbers"),
        ([1.0, float("inf")], "finite real numbers"),
        ([[1.0], [1.0, 2.0]], "finite real numbers"),
        (["1"], "finite real numbers"),
    ],
)
def test_numbers_that_are_too_large_are_told_from_those_that_are_none(value: object, expected: str) -> None:
    with pytest.raises(InputError) as raised:
        numbers("x", value)
    assert raised.value.faults[0].expected == expected
    assert numbers("x", [-LARGEST, LARGEST]).tolist() == [-LARGEST, LARGEST]
    assert numbers("x", []).shape == (0,)


@pytest.mark.parametrize(
    "place, name, meant",
    [
        ("slipstick", "response_forced", "forced_response"),
        ("slipstick", "FORCED_RESPONSE", "forced_response"),
        ("slipstick.models", "jefcott_rotor", "jeffcott_rotor"),
        ("slipstick.plots", "map_study", "study_map"),
    ],
)
def test_a_public_name_that_is_misspelt_is_named(place: str, name: str, meant: str) -> None:
    with pytest.raises(AttributeError, match=f"did you mean '{meant}'"):
        getattr(import_module(place), name)
