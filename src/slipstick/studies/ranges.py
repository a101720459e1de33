"""Values of one parameter: a list, or a range with a count and a spacing. Case files read them without a whole plan."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from slipstick.errors import IS_MISSING, UNKNOWN_KEY, Fault, InputError, Where
from slipstick.faults import MOST_ITEMS, number, numbers, shown, suggestion, table, text, whole, wrong
from slipstick.typing import Array

KEYS = ("from", "to", "count", "spacing")


SPACINGS = ("linear", "log")


_VALUES = "a list of numbers such as [0, 1, 10], or a range such as { from = 1, to = 100, count = 5 }"


_BOX = (
    "the two ends of a range such as [0.1, 0.4], or { from = 0.1, to = 0.4 }, to be sampled, or a distribution of "
    "scipy.stats"
)


def parameter_values(where: Where, value: object) -> Array:
    """Values (n,) of a grid or a list, n >= 1.

    >>> parameter_values(("mu",), {"from": 1, "to": 100, "count": 3, "spacing": "log"})
    array([  1.,  10., 100.])
    """
    if isinstance(value, Mapping):
        low, high, spacing = _ends(where, value)
        if "count" not in value:
            raise InputError(Fault((*where, "count"), IS_MISSING, remedy="give how many values, from and to included"))
        count = whole((*where, "count"), value["count"], 2, MOST_ITEMS)
        return np.geomspace(low, high, count) if spacing == "log" else np.linspace(low, high, count)
    if isinstance(value, str | bytes):
        raise wrong(where, value, _VALUES)
    values = np.atleast_1d(numbers(where, value, _VALUES))
    if values.ndim != 1:
        raise wrong(where, value, _VALUES)
    if not values.size:
        raise InputError(Fault(where, found="an empty list", expected="at least one value"))
    return values


def sampled_range(where: Where, value: object) -> tuple[float, float, str]:
    """Lower and upper end and spacing of a range that is sampled.

    >>> sampled_range(("mu",), [0.1, 0.4])
    (0.1, 0.4, 'linear')
    """
    if isinstance(value, Mapping):
        if "count" in value:
            said = "it is given, but samples are counted together"
            raise InputError(Fault((*where, "count"), said, remedy="leave it out and give samples = 64"))
        return _ends(where, value)
    if isinstance(value, str | bytes) or (values := numbers(where, value, _BOX)).shape != (2,):
        raise wrong(where, value, _BOX)
    return float(values[0]), float(values[1]), "linear"


def _ends(where: Where, value: Mapping[str, Any]) -> tuple[float, float, str]:
    entries = table(where, value, _VALUES)
    for key in entries:
        if key not in KEYS:
            raise InputError(Fault((*where, key), UNKNOWN_KEY, remedy=suggestion(key, KEYS)))
    for key in ("from", "to"):
        if key not in entries:
            raise InputError(Fault((*where, key), IS_MISSING, remedy="give both ends of the range"))
    low, high = number((*where, "from"), entries["from"]), number((*where, "to"), entries["to"])
    spacing = text((*where, "spacing"), entries.get("spacing", "linear"), '"linear" or "log"')
    if spacing not in SPACINGS:
        raise wrong((*where, "spacing"), spacing, '"linear" or "log"')
    if low == high:
        raise InputError(Fault(where, found=shown(dict(entries)), expected="two different ends"))
    if spacing == "log" and not (low > 0 and high > 0):
        raise InputError(Fault(where, found=f"from {low:g} to {high:g}", expected='ends > 0 with spacing = "log"'))
    return low, high, spacing
