"""The few texts that stand for numbers, in a case file as in Python: frequencies, phases, harmonics, period ratios."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator
from typing import Any

from slipstick.errors import Fault, InputError, Where

FREQUENCIES = {"rad/s": 1.0, "Hz": 2 * math.pi, "kHz": 2e3 * math.pi, "rpm": math.pi / 30}
"""Units that a frequency may be written and drawn in, and how many rad/s they are."""

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*([A-Za-z/°]+)\s*")
_FREQUENCY = {name.lower(): factor for name, factor in FREQUENCIES.items()}
_ANGLE = {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180}
_DURATION = {"s": 1.0, "min": 60.0, "h": 3600.0}
_RANGE = re.compile(r"(\d{1,18})\s*(?:\.\.\s*(\d{1,18}))?")

HIGHEST_HARMONIC = 10_000
MOST_HARMONICS = 500


class WithUnit(float):
    """A number that was written with its unit: whether that was meant need not be asked; ``text`` is what was written.

    >>> read_frequency("2 Hz").text
    '2 Hz'
    """

    text: str

    def __new__(cls, value: float, text: str = "") -> WithUnit:  # noqa: D102
        number = super().__new__(cls, value)
        number.text = text
        return number


def read_frequency(value: object) -> float:
    """A frequency in rad/s from a number (rad/s) or a text with its unit: Hz, kHz, rpm or rad/s.

    >>> read_frequency(2), round(read_frequency("0.5 Hz"), 4), round(read_frequency("3000 rpm"), 3)
    (2.0, 3.1416, 314.159)
    """
    return _quantity(value, _FREQUENCY, 'a number in rad/s, or text with a unit such as "0.32 Hz" or "3000 rpm"')


def frequency_unit(value: object) -> str | None:
    """The unit a frequency is written in, spelt as figures spell it; None for a plain number.

    >>> frequency_unit("0.5 hz"), frequency_unit(2.0)
    ('Hz', None)
    """
    match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
    return next((name for name in FREQUENCIES if match and name.lower() == match[2].lower()), None)


def read_angle(value: object) -> float:
    """An angle in rad from a number (rad) or a text with its unit: deg or rad.

    >>> round(read_angle("90 deg"), 4)
    1.5708
    """
    angle = _quantity(value, _ANGLE, 'a number in rad, or text with a unit such as "90 deg"')
    turns = isinstance(value, str) and "rad" not in value.lower()
    return WithUnit(math.fmod(angle, 2.0 * math.pi), str(value)) if turns else angle


def read_duration(value: object) -> float:
    """A time in seconds from a number (s) or a text with its unit: s, min or h.

    >>> read_duration("90"), read_duration("1.5 h")
    (90.0, 5400.0)
    """
    plain = float(value) if isinstance(value, str) and re.fullmatch(rf"\s*{_NUMBER}\s*", value) else value
    seconds = _quantity(plain, _DURATION, 'a time such as 3600, "90 s", "45 min" or "1.5 h"')
    if seconds <= 0:
        raise ValueError("expected a time > 0")
    return seconds


def unit_of_time_fault(where: Where, shown: str, time: str, angular: str) -> Fault:
    """A frequency in Hz, rpm or rad/s, shown as it is given, where the unit of time is another than the second."""
    described = f'{shown}, which counts in seconds, but the unit of time is "{time}"'
    return Fault(where, found=described, remedy=f"give a plain number in {angular}")


def _unexpected(expected: str) -> InputError:
    """Only what was expected is said here; what was found is known outside."""
    return InputError(Fault(expected=expected))


def _quantity(value: object, factors: dict[str, float], expected: str) -> float:
    text = value if isinstance(value, str) else value.text if isinstance(value, WithUnit) else None
    if isinstance(value, int | float) and not isinstance(value, bool):
        number, factor = float(value), 1.0
    else:
        match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
        known = factors.get(match[2].lower()) if match else None
        if match is None or known is None:
            raise _unexpected(expected)
        number, factor = float(match[1]), known
    if not math.isfinite(number * factor):
        raise _unexpected(f"a finite number: {expected}")
    return number * factor if text is None else WithUnit(number * factor, text)


def harmonic_orders(value: object) -> list[int]:
    """The orders in ``"0..10"``, ``"0, 1, 3..7"`` or a list of whole numbers; refused before any large list is made.

    >>> harmonic_orders("0, 1, 3..5"), harmonic_orders([0, 1, 3])
    ([0, 1, 3, 4, 5], [0, 1, 3])
    """
    orders: list[int] = []
    for first, last in _ranges(value):
        if last > HIGHEST_HARMONIC:
            highest = f"harmonic {last} is above the largest allowed, {HIGHEST_HARMONIC}"
            raise InputError(Fault(statement=highest, remedy="keep fewer harmonics"))
        if len(orders) + last - first + 1 > MOST_HARMONICS:
            many = f"more than {MOST_HARMONICS} harmonics"
            raise InputError(Fault(statement=many, remedy="keep fewer, 5 to 40 are usual"))
        orders.extend(range(first, last + 1))
    if not orders or orders[0] != 0 or any(a >= b for a, b in itertools.pairwise(orders)):
        raise _unexpected('increasing whole numbers starting at 0, such as "0..10" or [0, 1, 3, 5]')
    return orders


def _ranges(value: object) -> Iterator[tuple[int, int]]:
    items = value.split(",") if isinstance(value, str) else value
    if not isinstance(items, list) or len(items) > MOST_HARMONICS:
        raise _unexpected('text such as "0..10" or "0, 1, 3..7", or a list such as [0, 1, 3, 5]')
    for item in items:
        if isinstance(item, int) and not isinstance(item, bool) and item >= 0:
            yield item, item
            continue
        match = _RANGE.fullmatch(item.strip()) if isinstance(value, str) else None
        if match is None:
            text = f'"{item}"' if isinstance(item, str) else str(item).lower()
            wrong = f"{text[:60]} is not a whole number >= 0"
            raise InputError(Fault(statement=wrong, expected='such as "0..10" or [0, 1, 3, 5]'))
        yield int(match[1]), int(match[2] or match[1])


def ratio_of_periods(value: Any) -> tuple[int, int]:
    """``T_p / T_u`` from ``"3/2"`` or ``[3, 2]``.

    >>> ratio_of_periods("3/2"), ratio_of_periods([1, 1])
    ((3, 2), (1, 1))
    """
    parts = value
    if isinstance(value, str):
        parts = [int(p) if re.fullmatch(r"\s*\d{1,6}\s*", p) else p for p in value.split("/")]
    whole = isinstance(parts, list) and len(parts) == 2 and all(type(p) is int and 1 <= p <= 1000 for p in parts)
    if not whole:
        raise _unexpected('two whole numbers from 1 to 1000, such as "3/2" or [3, 2] (period of load / of rub)')
    return int(parts[0]), int(parts[1])
