"""Ctrl-C and polite kills while something is computed: they wait until nothing is half done.

An exception that a signal handler raises inside compiled code, or inside a library that holds a lock, breaks what it
meets. Inside ``held`` signals are noted, and raised by ``pass_on``, or at the end. Whoever is in a hurry sends another,
which waits inside ``unbroken`` alone.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_waiting: list[Callable[[], Any]] = []
"""What the handlers in force before are to be told."""
_unbroken = False
"""Whether what is done now is finished first, however many signals come."""


@contextmanager
def held() -> Iterator[None]:
    """Signals wait inside, and where it stands inside another one, to the end of that.

    In threads other than the main one, which are never interrupted, nothing changes.
    """
    before = _held_back() if threading.current_thread() is threading.main_thread() else {}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if before:
        pass_on()


@contextmanager
def unbroken() -> Iterator[None]:
    """Inside ``held``, for short work that must not be half done: further signals wait too, to the end of it."""
    global _unbroken
    _unbroken = True
    try:
        yield
    finally:
        _unbroken = False
    if len(_waiting) > 1:
        pass_on()


def pass_on() -> None:
    """Raise what has been waiting, if anything: a place where it is safe."""
    while _waiting:
        tell = _waiting.pop()
        _waiting.clear()
        tell()


def _held_back() -> dict[signal.Signals, Any]:
    """Put handlers that wait in the place of those that would raise; returns the latter."""
    before = {}
    for number in _SIGNALS:
        handler = signal.getsignal(number)
        if callable(handler) and not isinstance(handler, _Noting):  # neither ignored nor left to the system
            before[number] = handler
            signal.signal(number, _Noting(handler))
    return before


class _Noting:
    """Notes signals for the handler in whose place it stands."""

    def __init__(self, handler: Callable[[int, FrameType | None], Any]) -> None:
        self._handler = handler

    def __call__(self, number: int, frame: FrameType | None) -> None:
        again = bool(_waiting)
        _waiting.append(lambda: self._handler(number, frame))
        if again and not _unbroken:
            pass_on()
