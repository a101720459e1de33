"""What a run or a study shows while it computes: a live line on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.road.events import Searching, StrategyTried, Working
from slipstick.cli.terminal.guard import plain, say
from slipstick.progress import Position, duration
from slipstick.runs.run import CaseRun, GoingOn, PointKept, RunListener

if TYPE_CHECKING:
    from rich.progress import Progress

_EVERY = 5.0
"""Seconds between plain lines."""

_KEPT = (0, 4, 3, 1, 2)
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


class _Display:
    """A plain line now and then; none where it is to be ``quiet``."""

    def __init__(self, position: Position, quiet: bool) -> None:
        self._position, self._last, self._quiet = position, time.monotonic(), quiet

    def note(self, text: str) -> None:
        """A line of its own."""
        if not self._quiet:
            say(text)

    def _now_and_then(self, line: Callable[[], str]) -> None:
        if time.monotonic() - self._last >= _EVERY:
            self._last = time.monotonic()
            self.note(f"  {line()}")

    @property
    def _left(self) -> str:
        left = self._position.left
        return "" if left is None else f"about {duration(left)} left"


class _Live:
    """One line of a terminal, redrawn."""

    def _begin(self, bar: Progress, text: str, total: float) -> None:
        self._bar, self._task = bar, bar.add_task(text, total=total)

    def note(self, text: str) -> None:
        """A line above the moving one."""
        self._bar.console.print(plain(text), markup=False, highlight=False)


class CurveDisplay(_Display):
    """Shows points as they come; ``at`` is given the followed value and a text on the point."""

    def __init__(self, position: Position, unit: str, *, quiet: bool = False) -> None:
        super().__init__(position, quiet)
        self._unit = unit
        self.points = 0

    def at(self, value: float, step: float, states: str, *, share: float | None = None) -> None:
        """A point was found; ``share`` of the range where that is not told by the value."""
        self.points += 1
        self._position.update(value if share is None else share)
        self.show(value, step, states)

    def show(self, value: float, step: float, states: str) -> None:
        """Bring what is shown up to date."""
        self._now_and_then(lambda: self._line(*self._parts(value, step, states)))

    def search(self, parts: Sequence[str]) -> None:
        """How the first point is sought, the most important part first."""
        self._now_and_then(lambda: ", ".join(parts))

    def go_on(self, points: int, value: float) -> None:
        """So many points were found before, the last of them at ``value``."""
        self.points = points
        self._position.go_on(value)

    def _line(self, *parts: str) -> str:
        *first, left = parts
        return ", ".join(filter(None, [*first, f"{self._position.fraction:.0%}", left]))

    def _parts(self, value: float, step: float, states: str) -> tuple[str, ...]:
        """Where the branch is, point, step, states, time left (or nothing)."""
        length = f"step {step:.2g}" if np.isfinite(step) else ""
        return f"{value:.6g}{self._unit}", f"point {self.points}", length, states, self._left


class LiveCurve(_Live, CurveDisplay):
    """The same on one line of a terminal, redrawn."""

    def __init__(self, position: Position, unit: str, bar: Progress) -> None:
        super().__init__(position, unit)
        self._begin(bar, fitting(("looking for the first point",), (0,), _width(bar)), 1.0)

    def search(self, parts: Sequence[str]) -> None:
        """How the first point is sought."""
        self._bar.update(self._task, description=fitting(parts, range(len(parts)), _width(self._bar)))

    def show(self, value: float, step: float, states: str) -> None:
        """Bring what is shown up to date."""
        text = fitting(self._parts(value, step, states), _KEPT, _width(self._bar))
        self._bar.update(self._task, completed=self._position.fraction, description=text)


class StudyDisplay(_Display):
    """Shows how many cases are done, how many failed, the time left."""

    def __init__(self, total: int, *, quiet: bool = False) -> None:
        super().__init__(Position(0.0, float(max(total, 1))), quiet)
        self._total, self.width = total, 78
        self.done = self.failed = 0

    def case(self, *, failed: bool) -> None:
        """A case is done."""
        self.done += 1
        self.failed += failed
        self._position.update(float(self.done))
        self.show()

    def show(self) -> None:
        """Bring what is shown up to date."""
        self._now_and_then(lambda: self.text)

    @property
    def text(self) -> str:
        """How far it is, in one line of a terminal."""
        failed = f"{self.failed} did not complete" if self.failed else ""
        return fitting((f"{self.done} of {self._total} cases", failed, self._left), (0, 2, 1), self.width)


class LiveStudy(_Live, StudyDisplay):
    """The same on one line of a terminal, redrawn."""

    def __init__(self, total: int, bar: Progress) -> None:
        super().__init__(total)
        self.width = _width(bar)
        self._begin(bar, self.text, max(total, 1))

    def show(self) -> None:
        """Bring what is shown up to date."""
        self._bar.update(self._task, completed=self.done, description=self.text)


@contextmanager
def curve_display(start: float, stop: float, unit: str, *, quiet: bool = False) -> Iterator[CurveDisplay]:
    """The display of a curve that suits where the output goes."""
    position = Position(start, stop)
    if quiet or not sys.stdout.isatty():
        yield CurveDisplay(position, unit, quiet=quiet)
        return
    with _moving() as bar:
        yield LiveCurve(position, unit, bar)


@contextmanager
def study_display(total: int, *, quiet: bool = False) -> Iterator[StudyDisplay]:
    """The display of a study that suits where the output goes."""
    if quiet or not sys.stdout.isatty():
        yield StudyDisplay(total, quiet=quiet)
        return
    with _moving() as bar:
        yield LiveStudy(total, bar)


def _moving() -> Progress:
    """A line that is redrawn, with a bar where there is room for it."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, ProgressColumn, TextColumn

    console = Console(markup=False)
    columns: list[ProgressColumn] = [BarColumn(bar_width=_BAR)] if console.width >= _WIDE else []
    columns += [TextColumn("{task.percentage:>3.0f}%"), TextColumn("{task.description}", markup=False)]
    return Progress(*columns, console=console, transient=True, refresh_per_second=8)


def _width(bar: Progress) -> int:
    """What a line has for its text."""
    width = bar.console.width
    return width - len("100% ") - (_BAR + 1 if width >= _WIDE else 0)


class ShownCurve(RunListener):
    """Shows a run: how its first point is sought, and each point once it is kept."""

    def __init__(self, run: CaseRun, display: CurveDisplay) -> None:
        self._case, self._display = run.case, display
        broke_off = "the branch broke off: it is followed from the other end too"
        self._onward = run.case.further[run.table].onward if run.table else broke_off
        self._factor, self._unit = run.shown_in
        begin, end = (value / self._factor for value in run.span)
        self._share: Callable[[PointKept], float | None] = lambda _: None
        if run.table:  # what is followed, and from where to where, may not be known at the beginning
            self._share = lambda event: begin + event.progress * (end - begin)
        self._last: float | None = None
        self._part = 1

    def searching(self, event: Searching) -> None:
        """Show how far the search for the first point is."""
        where = f"first point at {self._case.frequency_text(event.omega)}"
        self._display.search((where, *event.parts))

    def working(self, event: Working) -> None:
        """Show what is done where no point comes for a while."""
        self._display.search((event.text,))

    def strategy_tried(self, event: StrategyTried) -> None:
        """Show how the first point is sought."""
        why = f": {event.reason.text}" if event.reason else ""
        result = "found" if event.found else f"not found{why}"
        self._display.note(f"  first point at {self._case.frequency_text(event.omega)}, {event.name}: {result}")

    def going_on(self, event: GoingOn) -> None:
        """The time left is judged by what comes from here on."""
        self._part, self._last = event.part, event.value / self._factor
        self._display.go_on(event.points, self._last)

    def point_kept(self, event: PointKept) -> None:
        """Show where the branch is."""
        value = event.value / self._factor
        if event.point.part != self._part:
            self._part, self._last = event.point.part, None
            where = f"{value:.6g}{self._unit}"
            self._display.note(f"  {self._onward}, from {where}")
        step = abs(value - self._last) if self._last is not None else 0.0
        self._last = value
        self._display.at(value, step, states_text(event.values), share=self._share(event))


def states_text(record: Mapping[str, Any]) -> str:
    """How the contacts share stick, slip and separation, averaged over those that have such states; else nothing.

    >>> states_text({"stick_fraction": [0.25], "slip_fraction": [0.75], "separation_fraction": [0.0]})
    'stick 25 % slip 75 %'
    """
    parts = []
    for name in ("stick", "slip", "separation"):
        value = np.asarray(record.get(f"{name}_fraction", ()), dtype=float)
        known = value[np.isfinite(value)]
        parts.append((name, float(known.mean()) if known.size else 0.0))
    return " ".join(f"{name} {part:.0%}".replace("%", " %") for name, part in parts if part > 0.0005)
