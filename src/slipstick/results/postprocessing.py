"""Quantities computed from solved points: where one fails, the point remains without it and a warning tells why."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeVar

import numpy as np

from slipstick.errors import reason_of
from slipstick.typing import Array

T = TypeVar("T")


class Postprocessing:
    """Computes truncation, stability, peaks, measures and what laws record; no failure of these loses a point."""

    def __init__(self) -> None:
        self._reasons: dict[str, str] = {}
        self._counts: dict[str, int] = {}

    @property
    def failures(self) -> list[str]:
        """One sentence for each quantity that failed, with the reason of the first time."""
        return [
            f"{what} is not known at {_times(self._counts[what])}, where computing it failed: {reason}"
            for what, reason in self._reasons.items()
        ]

    def attempt(self, what: str, compute: Callable[[], T], otherwise: T) -> T:
        """The value of ``compute``, or ``otherwise`` where it fails."""
        try:
            return compute()
        except Exception as error:
            self._reasons.setdefault(what, reason_of(error))
            self._counts[what] = self._counts.get(what, 0) + 1
            return otherwise

    def attempt_each(
        self, what: str, compute: Callable[[list[int]], Array], count: int, shape: tuple[int, ...]
    ) -> Array:
        """Numbers (count, *shape) of points by their indices: all together, where that fails each alone; nan else."""
        unknown = np.full((1, *shape), np.nan)
        if count == 0:
            return unknown[:0]
        try:
            return compute(list(range(count)))
        except Exception:
            pass
        return np.concatenate([self.attempt(what, partial(compute, [i]), unknown) for i in range(count)])

    def warnings(self, compute: Callable[[], Sequence[str]]) -> list[str]:
        """Warnings: the failures, and those that ``compute`` returns."""
        nothing: Sequence[str] = ()
        found = self.attempt("what is suspicious in the results", compute, nothing)
        return [*self.failures, *found]


def _times(count: int) -> str:
    return "1 place" if count == 1 else f"{count} places"
