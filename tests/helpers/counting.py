"""Work counted, where a clock would measure the machine and what else runs on it."""

from __future__ import annotations

import itertools
import time
import tracemalloc
from collections.abc import Generator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest


def calls_of(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str) -> list[str]:
    """A list that grows by one with every call of a function of a module or class."""
    whole, made = getattr(owner, name), list[str]()

    def counted(*given: Any, **named: Any) -> Any:
        made.append(name)
        return whole(*given, **named)

    monkeypatch.setattr(owner, name, counted)
    return made


def ticking(monkeypatch: pytest.MonkeyPatch, *modules: Any) -> None:
    """Give these modules one clock, which goes on by a second each time that one of them looks at it."""
    clock = SimpleNamespace(**{**vars(time), "monotonic": itertools.count().__next__})
    for module in modules:
        monkeypatch.setattr(module, "time", clock)


@contextmanager
def traced() -> Generator[SimpleNamespace, None, None]:
    """The most bytes allocated at a time within the block, `peak`, once it has ended."""
    found = SimpleNamespace(peak=0)
    tracemalloc.start()
    try:
        yield found
    finally:
        found.peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
