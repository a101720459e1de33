"""Samples of large families of cases: others on every commit, so that all of them are run in time.

``make verify`` sets SLIPSTICK_SEED to the commit, shows it and keeps it with the results, so that a failure is found
again by it. Where it is not set, or "all", families are whole.

Tests marked ``verify(sample=5)`` are sampled when they are collected; ``sample`` is for what one test goes through.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterable
from hashlib import sha256
from typing import TypeVar

T = TypeVar("T")


def sample(family: Iterable[T], count: int, name: Callable[[T], Hashable] = str) -> list[T]:
    """As many cases of a family, in its order; ``name`` tells them from each other and from those of other families.

    Of a part of the family those are taken that are taken of the whole, and others beside them.
    """
    cases, seed = list(family), os.environ.get("SLIPSTICK_SEED", "all")
    if seed == "all" or count >= len(cases):
        return cases
    ranks = [sha256(f"{seed}: {name(case)}".encode()).digest() for case in cases]
    last = sorted(ranks)[count - 1]
    return [case for case, rank in zip(cases, ranks, strict=True) if rank <= last]
