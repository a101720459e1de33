"""Many requested points of a range in a few words: how many, and spread how."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

MOST_VALUES = 100_000
SPACINGS = ("linear", "log")
_EXPECTED = 'a list of values, or a table such as { count = 50, spacing = "log" }'


@dataclass(frozen=True, kw_only=True)
class Spacing:
    """``count`` values from the first end of a range to the last, both included.

    >>> Spacing(count=3, spacing="log").values(1.0, 100.0)
    (1.0, 10.0, 100.0)
    """

    count: int
    spacing: str = "linear"

    def values(self, start: float, stop: float) -> tuple[float, ...]:
        """The values."""
        import numpy as np

        spread = np.geomspace if self.spacing == "log" else np.linspace
        return tuple(spread(start, stop, self.count).tolist())


def spacing_or_list(value: Any) -> list[Any] | Spacing:
    """What ``at`` of a case gives; ValueError with a sentence for anything else."""
    if isinstance(value, list):
        return value
    if not isinstance(value, Mapping) or "count" not in value or set(value) - {"count", "spacing"}:
        raise ValueError(f"expected {_EXPECTED}")
    count, spacing = value["count"], value.get("spacing", "linear")
    if type(count) is not int or not 2 <= count <= MOST_VALUES:
        raise ValueError(f"count must be a whole number from 2 to {MOST_VALUES}; expected {_EXPECTED}")
    if spacing not in SPACINGS:
        raise ValueError(f'spacing must be "linear" or "log"; expected {_EXPECTED}')
    return Spacing(count=count, spacing=spacing)
