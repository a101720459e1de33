"""Many requested points of a range in a few words: how many, and spread how."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from slipstick.case.sentences import toml, unexpected
from slipstick.errors import Fault, InputError
from slipstick.studies.ranges import SPACINGS

MOST_VALUES = 100_000
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
    """What ``at`` of a case gives; InputError for anything else."""
    if isinstance(value, list):
        return value
    if not isinstance(value, Mapping) or "count" not in value or set(value) - {"count", "spacing"}:
        raise unexpected(_EXPECTED)
    count, spacing = value["count"], value.get("spacing", "linear")
    faults = []
    if type(count) is not int or not 2 <= count <= MOST_VALUES:
        faults.append(Fault("count", found=toml(count), expected=f"a whole number from 2 to {MOST_VALUES}"))
    if spacing not in SPACINGS:
        faults.append(Fault("spacing", found=toml(spacing), expected='"linear" or "log"'))
    if faults:
        raise InputError(faults)
    return Spacing(count=count, spacing=spacing)
