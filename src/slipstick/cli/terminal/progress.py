"""What a run shows while it computes: a live line on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from slipstick.cli.terminal.guard import plain, say
from slipstick.progress import Position, duration

_EVERY = 5.0
"""Seconds between plain lines."""

_LIVE = (0, 4, 3, 1, 2)
"""What a narrow terminal keeps of where, point, step, states and time left, in this order."""

_WIDE, _BAR = 110, 20
"""From that width there is a bar of that width."""


def fitting(parts: Sequence[str], order: Sequence[int], width: int) -> str:
    """The parts that fit a width, those first in ``order`` before others; the first one is cut where it is too long.

    >>> fitting(("4.2 rad/s", "point 3", "slip 100 %"), (0, 2, 1), 25)
    '4.2 rad/s, slip 100 %'
    """
    kept: list[int] = []
    for place in order:
        longer = ", ".join(parts[i] for i in sorted([*kept, place]) if parts[i])
        if len(longer) <= width:
            kept.append(place)
    return ", ".join(parts[i] for i in sorted(kept) if parts[i]) or parts[order[0]][: max(width, 0)]


class Progress:
    """Shows points as they come; ``at`` is given the followed value and a text on the point."""

    def __init__(self, position: Position, unit: str) -> None:
        self._position, self._unit = position, unit
        self._last = time.monotonic()
        self.points = 0

    def at(self, value: float, step: float, states: str) -> None:
        """A point was found."""
        self.points += 1
        self._position.update(value)
        if time.monotonic() - self._last >= _EVERY:
            self._last = time.monotonic()
            *parts, left = self._parts(value, step, states)
            say(f"  {', '.join(filter(None, [*parts, f'{self._position.fraction:.0%}', left]))}")

    def go_on(self, points: int, value: float) -> None:
        """So many points were found before, the last of them at ``value``."""
        self.points = points
        self._position.go_on(value)

    def note(self, text: str) -> None:
        """A line of its own."""
        say(text)

    def _parts(self, value: float, step: float, states: str) -> tuple[str, ...]:
        """Where the branch is, point, step, states, time left (or nothing)."""
        left = self._position.left
        told = "" if left is None else f"about {duration(left)} left"
        return f"{value:.6g}{self._unit}", f"point {self.points}", f"step {step:.2g}", states, told


class Live(Progress):
    """The same on one line of a terminal, redrawn."""

    def __init__(self, position: Position, unit: str, bar: Any, beside: int) -> None:
        super().__init__(position, unit)
        self._bar, self._beside = bar, beside
        start = fitting(("looking for the first point",), (0,), bar.console.width - beside)
        self._task = bar.add_task(start, total=1.0)

    def at(self, value: float, step: float, states: str) -> None:
        """A point was found."""
        self.points += 1
        self._position.update(value)
        text = fitting(self._parts(value, step, states), _LIVE, self._bar.console.width - self._beside)
        self._bar.update(self._task, completed=self._position.fraction, description=text)

    def note(self, text: str) -> None:
        """A line above the moving one."""
        self._bar.console.print(plain(text), markup=False, highlight=False)


class Silent(Progress):
    """Counts, and shows nothing."""

    def at(self, value: float, step: float, states: str) -> None:
        """A point was found."""
        self.points += 1

    def note(self, text: str) -> None:
        """Nothing is shown."""


@contextmanager
def progress(start: float, stop: float, unit: str, *, quiet: bool = False) -> Iterator[Progress]:
    """The display that suits where the output goes."""
    position = Position(start, stop)
    if quiet:
        yield Silent(position, unit)
        return
    if not sys.stdout.isatty():
        yield Progress(position, unit)
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    console = Console(markup=False)
    wide = console.width >= _WIDE
    columns: list[Any] = [BarColumn(bar_width=_BAR)] if wide else []
    columns += [TextColumn("{task.percentage:>3.0f}%"), TextColumn("{task.description}", markup=False)]
    with Bar(*columns, console=console, transient=True, refresh_per_second=8) as bar:
        yield Live(position, unit, bar, len("100% ") + (_BAR + 1 if wide else 0))
