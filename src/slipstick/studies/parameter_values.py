"""Values of one parameter: a list or a range, or how it is distributed. Case files read them without a whole plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipstick.errors import IS_MISSING, UNKNOWN_KEY, Fault, InputError, Where
from slipstick.faults import MOST_ITEMS, number, numbers, shown, suggestion, table, text, whole, wrong
from slipstick.typing import Array

KEYS = ("from", "to", "count", "spacing")
"""Of a range."""
SPACINGS = ("linear", "log")
_VALUES = "a list of numbers such as [0, 1, 10], or a range such as { from = 1, to = 100, count = 5 }"
_BOX = "the ends of a range to sample, [0.1, 0.4] or { from = 0.1, to = 0.4 }, or a distribution of scipy.stats"


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


DISTRIBUTION = "distribution"
"""The key of a distribution in a table, beside its parameters."""
_EXPECTED = (
    "a distribution of scipy.stats such as scipy.stats.norm(0.3, 0.02), in a case file "
    '{ distribution = "norm", loc = 0.3, scale = 0.02 }'
)


@dataclass(frozen=True, kw_only=True)
class Range:
    """Evenly from ``low`` to ``high``, or evenly in the logarithm."""

    low: float
    high: float
    spacing: str

    def quantile(self, share: Array) -> Array:
        """What so large a share of the values stays below."""
        if self.spacing == "log":
            return np.exp(np.log(self.low) + share * (np.log(self.high) - np.log(self.low)))
        return np.asarray(self.low + share * (self.high - self.low))

    def __str__(self) -> str:
        """As it is kept with the results."""
        return f"{'log-uniform' if self.spacing == 'log' else 'uniform'} from {self.low:.9g} to {self.high:.9g}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Distribution:
    """A frozen distribution of scipy.stats; its tails may hold values that a parameter cannot have."""

    frozen: Any
    mean: float
    deviation: float
    """Standard deviation."""

    def quantile(self, share: Array) -> Array:
        """What so large a share of the values stays below."""
        return np.asarray(self.frozen.ppf(share), dtype=float)

    def __str__(self) -> str:
        """As it is kept with the results."""
        given = [f"{value:.9g}" for value in self.frozen.args]
        given += [f"{name}={value:.9g}" for name, value in self.frozen.kwds.items()]
        return f"{self.frozen.dist.name}({', '.join(given)})"


def is_distribution(value: object) -> bool:
    """Whether a value says how a parameter is distributed, rightly or not."""
    return DISTRIBUTION in value if isinstance(value, Mapping) else hasattr(value, "ppf")


def distribution(where: Where, value: object) -> Distribution:
    """A distribution as Python or a case file gives it; raises InputError for what is none."""
    if isinstance(value, Mapping):
        value = _by_name(where, value)
    if not all(hasattr(value, name) for name in ("ppf", "mean", "std", "dist", "args", "kwds")):
        raise wrong(where, value, _EXPECTED)
    frozen: Any = value
    moments = [float(frozen.mean()), float(frozen.std())] if np.ndim(frozen.mean()) == 0 else [np.nan, np.nan]
    ends = np.asarray(frozen.ppf([0.01, 0.5, 0.99]), dtype=float) if np.isfinite(moments).all() else np.array(np.nan)
    if not np.all(np.isfinite(ends)) or not moments[1] > 0.0:
        said = "a distribution of one number, with a mean and a standard deviation > 0"
        raise InputError(Fault(where, found=f"mean {moments[0]:g} and deviation {moments[1]:g}", expected=said))
    return Distribution(frozen=frozen, mean=moments[0], deviation=moments[1])


def sampled(where: Where, value: object) -> Range | Distribution:
    """What a parameter of samples is given as: the two ends of a range, or a distribution."""
    if is_distribution(value):
        return distribution(where, value)
    low, high, spacing = sampled_range(where, value)
    return Range(low=low, high=high, spacing=spacing)


def _by_name(where: Where, value: Mapping[Any, Any]) -> Any:
    """``{ distribution = "norm", loc = 0.3, scale = 0.02 }``: a continuous distribution of scipy.stats by its name."""
    from scipy import stats

    if DISTRIBUTION not in value:
        raise wrong(where, dict(value), _EXPECTED)
    name = text((*where, DISTRIBUTION), value[DISTRIBUTION], "the name of a distribution of scipy.stats")
    family = getattr(stats, name, None)
    if not isinstance(family, stats.rv_continuous):
        known = [n for n in dir(stats) if isinstance(getattr(stats, n), stats.rv_continuous)]
        raise InputError(Fault((*where, DISTRIBUTION), found=shown(name), remedy=suggestion(name, known)))
    shapes = [s.strip() for s in (family.shapes or "").split(",") if s.strip()]
    faults, given = [], {}
    for key, one in value.items():
        if key == DISTRIBUTION:
            continue
        if key not in (*shapes, "loc", "scale"):
            faults.append(Fault((*where, key), UNKNOWN_KEY, remedy=suggestion(str(key), [*shapes, "loc", "scale"])))
            continue
        try:
            given[key] = number((*where, key), one)
        except InputError as error:
            faults += error.faults
    if missing := [key for key in shapes if key not in value]:
        faults.append(Fault(where, f"{name} needs {', '.join(missing)}", remedy="give it beside distribution"))
    if faults:
        raise InputError(faults)
    try:
        return family(**given)
    except ValueError as error:
        raise InputError(Fault(where, f"{name} does not take these parameters: {error}")) from None
