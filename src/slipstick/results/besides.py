"""What is computed about solutions beside them: where it fails they are kept without it, and that is said."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeVar

import numpy as np

from slipstick.errors import reason_of
from slipstick.typing import Array

T = TypeVar("T")


class Besides:
    """Takes what can be had about solved points: truncation, stability, peaks, measures, what a law records.

    A point is worth more than what is told about it, so no failure here is let through; each kind is named once.
    """

    def __init__(self) -> None:
        self._reasons: dict[str, str] = {}
        self._counts: dict[str, int] = {}

    @property
    def sentences(self) -> list[str]:
        """One for each kind of what failed, with the reason of the first time."""
        return [
            f"{what} is not known at {_times(self._counts[what])}, where computing it failed: {reason}"
            for what, reason in self._reasons.items()
        ]

    def take(self, what: str, compute: Callable[[], T], otherwise: T) -> T:
        """What ``compute`` gives, or ``otherwise`` where it fails."""
        try:
            return compute()
        except Exception as error:
            self._reasons.setdefault(what, reason_of(error))
            self._counts[what] = self._counts.get(what, 0) + 1
            return otherwise

    def each(self, what: str, compute: Callable[[list[int]], Array], count: int, shape: tuple[int, ...]) -> Array:
        """Numbers (count, *shape) of points by their indices: all together, where that fails each alone; nan else."""
        unknown = np.full((1, *shape), np.nan)
        if count == 0:
            return unknown[:0]
        try:
            return compute(list(range(count)))
        except Exception:
            pass
        return np.concatenate([self.take(what, partial(compute, [i]), unknown) for i in range(count)])

    def said(self, compute: Callable[[], Sequence[str]]) -> list[str]:
        """What failed, and what ``compute`` finds wrong in the results."""
        nothing: Sequence[str] = ()
        doubts = self.take("what is suspicious in the results", compute, nothing)
        return [*self.sentences, *doubts]


def _times(count: int) -> str:
    return "1 place" if count == 1 else f"{count} places"
