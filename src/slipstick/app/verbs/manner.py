"""How a computation goes, and which of its ends can be gone on from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from slipstick.app.case.body import silent
from slipstick.app.terminal.answers import Answer
from slipstick.app.terminal.guard import say
from slipstick.errors import Outcome

UNFINISHED = (Outcome.INTERRUPTED, Outcome.TIME_LIMIT)
"""Outcomes of a run that can be gone on with."""


@dataclass(frozen=True, kw_only=True)
class Manner:
    """How a run goes: what is drawn and shown, and after how many seconds it ends."""

    figures: bool = True
    report: bool = True
    quiet: bool = False
    time_limit: float | None = None
    answer: Answer | None = None
    """What is found goes here too."""

    @property
    def tell(self) -> Callable[[str], None]:
        """What is said on the way."""
        return silent if self.quiet else say


PLAIN = Manner()
