"""What a study shows while it computes: how many cases are done, how many failed, the time left."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from slipstick.cli.terminal.guard import plain, say
from slipstick.cli.terminal.progress import fitting
from slipstick.progress import Position, duration

_EVERY = 5.0
"""Seconds between plain lines."""
_WIDE, _BAR = 110, 20
"""From that width there is a bar of that width."""


class CasesProgress:
    """Shows cases as they are done, a plain line now and then."""

    def __init__(self, total: int) -> None:
        self._position, self._total = Position(0.0, float(max(total, 1))), total
        self._last, self.width = time.monotonic(), 78
        self.done = self.failed = 0

    def case(self, *, failed: bool) -> None:
        """A case is done."""
        self.done += 1
        self.failed += failed
        self._position.update(float(self.done))
        self.show()

    def show(self) -> None:
        """Bring what is shown up to date."""
        if time.monotonic() - self._last >= _EVERY:
            self._last = time.monotonic()
            say(f"  {self.text}")

    @property
    def text(self) -> str:
        """How far it is, in one line of a terminal."""
        left = self._position.left
        failed = f"{self.failed} did not complete" if self.failed else ""
        told = "" if left is None else f"about {duration(left)} left"
        return fitting((f"{self.done} of {self._total} cases", failed, told), (0, 2, 1), self.width)

    def note(self, text: str) -> None:
        """A line of its own."""
        say(text)


class LiveCases(CasesProgress):
    """The same on one line of a terminal, redrawn."""

    def __init__(self, total: int, bar: Any) -> None:
        super().__init__(total)
        self.width = bar.console.width - len("100% ") - (_BAR + 1 if bar.console.width >= _WIDE else 0)
        self._bar, self._task = bar, bar.add_task(self.text, total=max(total, 1))

    def show(self) -> None:
        """Bring what is shown up to date."""
        self._bar.update(self._task, completed=self.done, description=self.text)

    def note(self, text: str) -> None:
        """A line above the moving one."""
        self._bar.console.print(plain(text), markup=False, highlight=False)


class SilentCases(CasesProgress):
    """Counts, and shows nothing."""

    def show(self) -> None:
        """Nothing is shown."""

    def note(self, text: str) -> None:
        """Nothing is shown."""


@contextmanager
def cases_progress(total: int, *, quiet: bool = False) -> Iterator[CasesProgress]:
    """The display that suits where the output goes."""
    if quiet or not sys.stdout.isatty():
        yield SilentCases(total) if quiet else CasesProgress(total)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    console = Console(markup=False)
    columns: list[Any] = [BarColumn(bar_width=_BAR)] if console.width >= _WIDE else []
    columns += [TextColumn("{task.percentage:>3.0f}%"), TextColumn("{task.description}", markup=False)]
    with Progress(*columns, console=console, transient=True, refresh_per_second=8) as bar:
        yield LiveCases(total, bar)
