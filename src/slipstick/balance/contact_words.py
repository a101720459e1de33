"""Contacts in words: their directions, the quantities to show, and their rubbing motion.

The command line imports this when it starts: numpy is loaded where it is needed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from slipstick.html import some

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.typing import Array
    from slipstick.units import Units

SLIDING = ("cos", "sin", "second_cos", "second_sin")
"""Periodic parts of the rubbing motion along the surface."""


def velocities_of(pair: ContactPair, k: int) -> tuple[Array, Array]:
    """Constant velocities along the one or two directions of the surface, and what each rad/s adds to them."""
    import numpy as np

    from slipstick.contact.rubbing import SECOND, VELOCITIES

    befores = ("", SECOND) if "second" in pair.contact.ports else ("",)
    both = np.array([[pair.values(before + name)[k] for before in befores] for name in VELOCITIES], dtype=float)
    return both[0], both[1]


def rubbing_words(pair: ContactPair, k: int, units: Units) -> str:
    """The rubbing motion of the k-th contact in a few words."""
    import numpy as np

    along, across = orders_of(pair, k, *SLIDING), orders_of(pair, k, "normal_cos", "normal_sin")
    speeds, swept = velocities_of(pair, k)
    said = [speed_words(float(v), float(s), units) for v, s in zip(speeds, swept, strict=True)]
    at = f"({', '.join(said)})" if len(said) > 1 else said[0]
    words = [f"rubbing at {at}" if np.any(speeds) or np.any(swept) or along else "no rubbing"]
    words += [f"periodic part of order {some(along)}"] if along else []
    words += [f"moving along the normal with order {some(across)}"] if across else []
    return " and ".join(words)


def orders_of(pair: ContactPair, k: int, *parts: str) -> list[int]:
    """Orders of these parts of the rubbing motion of the k-th contact that are not zero."""
    return sorted({m for p in parts for m in pair.rubbing.parts[p] if pair.values(f"{p}{m}")[k] != 0.0})


def speed_words(velocity: float, swept: float, units: Units) -> str:
    """A constant velocity, and what each rad/s adds to it."""
    speed = [f"{velocity:g}{units.after('length/time')}"] if velocity or not swept else []
    speed += [f"{swept:g}{units.after('length')} x omega"] if swept else []
    return " + ".join(speed)


def shown_quantities(pair: ContactPair, k: int) -> list[str]:
    """Quantities that are printed: of a friction contact the normal load at rest instead of the gap that makes it."""
    load = "normal_load" in pair.quantities and pair.values("normal_load")[k] > 0
    hidden = {"gap"} if load else {"normal_load"}
    hidden |= {"kn"} if pair.direction("normal", k) is None else set()
    return [q for q in pair.quantities if q not in hidden and not pair.rubbing.is_component(q)]


def direction_words(cosines: Mapping[str, float] | None) -> str:
    """A direction as a sum, of many dofs its beginning.

    >>> direction_words({"x1": 1.0, "x2": -1.0}), direction_words({"x": -0.6, "y": 0.8})
    ('x1 - x2', '-0.6 x + 0.8 y')
    """
    words: list[str] = []
    for dof, c in (cosines or {}).items():
        size = dof if abs(c) == 1 else f"{abs(c):g} {dof}"
        words += [("- " if c < 0 else "+ ") + size] if words else [("-" if c < 0 else "") + size]
    if len(words) > _MOST_DOFS:
        return f"{' '.join(words[:_SHOWN_DOFS])} + ... ({len(words)} dofs)"
    return " ".join(words)


_MOST_DOFS, _SHOWN_DOFS = 5, 2
"""Dofs of a direction that are all named, and how many are of one with more."""
