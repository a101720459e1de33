"""How far a computation is: shown in a notebook or on a terminal by a listener that Python gives it."""

from __future__ import annotations

import html
import sys
import time
from typing import Any

from slipstick.analysis.road.events import (
    CaseDone,
    Listener,
    PointFound,
    Searching,
    StageProgress,
    Started,
    Stopped,
    Working,
)

_PAUSE = 0.2
"""Seconds between two pictures."""


def duration(seconds: float) -> str:
    """Seconds as a reader likes them.

    >>> duration(0.123), duration(75), duration(7300)
    ('0.12 s', '1 min 15 s', '2 h 1 min')
    """
    if seconds < 60:
        return f"{seconds:.2g} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes} min {rest} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


class Position:
    """How far along its range a branch is."""

    def __init__(self, start: float, stop: float) -> None:
        self._start, self._length = start, (stop - start) or 1.0
        self._begin = time.monotonic()
        self.fraction = self._first = 0.0

    def go_on(self, value: float) -> None:
        """The branch was followed up to ``value`` before."""
        self.update(value)
        self._first = self.fraction

    def update(self, value: float) -> None:
        """The branch is at ``value`` of the followed quantity; turning back never lowers the fraction."""
        self.fraction = max(self.fraction, min((value - self._start) / self._length, 1.0))

    @property
    def left(self) -> float | None:
        """Seconds left at the pace so far, once there is something to judge by."""
        elapsed, done = time.monotonic() - self._begin, self.fraction - self._first
        return elapsed * (1.0 - self.fraction) / done if done > 0.02 else None


class Progress(Listener):
    """Shows how far an analysis or a study is: ``listeners=ss.Progress()``; of reductions ``listener=ss.Progress()``.

    In a notebook a bar that moves, on a terminal a line that is written over, elsewhere the last line alone. Nothing of
    the results depends on it.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> damper = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    >>> problem = ss.Problem(structure, contacts=ss.ContactPair(name="damper", tangential="x", contact=damper),
    ...                      loads=ss.Load(dof="x", sin=100.0), harmonics=range(6))
    >>> shown = ss.Progress()
    >>> branch = ss.forced_response(problem, omega=(10.0, 12.0), listeners=shown)  # doctest: +ELLIPSIS
    100 %, ... points, completed in ...
    """

    def __init__(self) -> None:
        self._position = Position(0.0, 1.0)
        self._handle: Any = None
        self._last, self._width, self._points = 0.0, 0, 0

    def started(self, event: Started) -> None:
        """A branch begins."""
        self._position, self._handle, self._points, self._last = Position(0.0, 1.0), None, 0, 0.0
        self._show("looking for the first point")

    def searching(self, event: Searching) -> None:
        """The first point has been sought for a while."""
        self._show(f"looking for the first point: {', '.join(event.parts)}")

    def point_found(self, event: PointFound) -> None:
        """A point was found."""
        self._position.update(event.progress)
        self._points = event.number
        self._show(f"at {event.parameter:.6g}, point {event.number}{self._left}")

    def working(self, event: Working) -> None:
        """It takes long: what is done meanwhile."""
        self._position.update(event.progress)
        self._show(f"{event.text}{self._left}")

    def stage(self, event: StageProgress) -> None:
        """A stage of a reduction."""
        if event.done == 0:
            self._position = Position(0.0, 1.0)
        self._position.update(event.done / max(event.total, 1))
        self._show(event.stage)

    def stopped(self, event: Stopped) -> None:
        """The computation ended."""
        words = event.outcome.name.lower().replace("_", " ")
        if event.outcome.ok:
            self._position.update(1.0)
        self._end(f"{event.points} points, {words} in {duration(event.seconds)}")

    def case_done(self, event: CaseDone) -> None:
        """A case of a study was computed."""
        if event.done == 1:
            self._handle, self._last = None, 0.0
            self._position = self._position if self._position.fraction == 0.0 else Position(0.0, 1.0)
        self._position.update(event.done / event.total)
        text = f"case {event.done} of {event.total}{self._left}"
        if event.done == event.total:
            self._end(text)
        else:
            self._show(text)

    @property
    def _left(self) -> str:
        left = self._position.left
        return "" if left is None else f", about {duration(left)} left"

    def _show(self, text: str) -> None:
        now = time.monotonic()
        if now - self._last < _PAUSE:
            return
        self._last = now
        if (notebook := _notebook()) is not None:
            self._draw(notebook, text)
        elif sys.stdout.isatty():
            self._write(self._line(text), end="")

    def _end(self, text: str) -> None:
        if (notebook := _notebook()) is not None:
            self._draw(notebook, text)
        else:
            self._write(self._line(text), end="\n")

    def _line(self, text: str) -> str:
        return f"{self._position.fraction:.0%}, {text}".replace("%", " %", 1)

    def _draw(self, notebook: Any, text: str) -> None:
        """A bar and the text, in the place of those before."""
        bar = f'<progress value="{self._position.fraction:.4f}" max="1"></progress>'
        picture = notebook.HTML(f"{bar} {html.escape(self._line(text))}")
        if self._handle is None:
            self._handle = notebook.display(picture, display_id=True)
        else:
            self._handle.update(picture)

    def _write(self, line: str, *, end: str) -> None:
        before = "\r" if sys.stdout.isatty() else ""
        print(before + line.ljust(self._width if before else 0), end=end, flush=True)
        self._width = len(line) if not end else 0


def _notebook() -> Any:
    """``IPython.display`` where this runs in the kernel of a notebook, else None."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    if shell is None or not hasattr(shell, "kernel"):
        return None
    from importlib import import_module

    return import_module("IPython.display")
