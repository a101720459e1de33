"""Samples of large families of cases: others on every commit, so that all of them are run in time.

``make verify`` sets SLIPSTICK_SEED to the commit, prints it and keeps it with the results, so that a failure is found
again by it. Where it is not set, or "all", families are whole.
"""

from __future__ import annotations

import os
import random
from collections.abc import Iterable
from typing import TypeVar

T = TypeVar("T")


def seed() -> str | None:
    """What the samples are drawn by; None where families are taken whole."""
    found = os.environ.get("SLIPSTICK_SEED", "all")
    return None if found == "all" else found


def sample(family: Iterable[T], count: int, name: str) -> list[T]:
    """As many cases of a family, in its order; `name` draws families of one size independently."""
    cases = list(family)
    if (by := seed()) is None or count >= len(cases):
        return cases
    chosen = random.Random(f"{by}: {name}").sample(range(len(cases)), count)
    return [cases[i] for i in sorted(chosen)]
