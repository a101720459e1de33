"""Tests ask no clock how long something took: a busy machine would fail what is right. They count work instead."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
CLOCK = re.compile(
    r"\b(perf_counter|process_time|thread_time|monotonic|time\.time|getrusage|timeit|default_timer)(_ns)?\(\)"
    r"|\b(perf_counter|process_time|thread_time|getrusage|timeit)(_ns)?\([^()s]"
)
SHORTEST = 300.0
"""Seconds: a shorter wait for another process or thread may be over before a busy machine has come to it."""
WAIT = re.compile(r"\btimeout ?= ?([\d.]+)|\.wait\(([\d.]+)\)|\.join\(([\d.]+)\)")
ALLOWED = {
    "cli/test_cli.py": "the end of a wait for a file, which guards against a hang",
    "hostile/kills.py": "the length of a run, within which the moments of its kills are drawn",
    "hostile/study_kills.py": "the length of a run, within which the moments of its kills are drawn",
}


def lines() -> list[tuple[str, str]]:
    files = sorted(path for path in TESTS.rglob("*.py") if path != Path(__file__))
    return [
        (str(path.relative_to(TESTS).as_posix()), line)
        for path in files
        for line in path.read_text(encoding="utf-8").splitlines()
    ]


def test_no_test_asks_a_clock() -> None:
    found = {(name, line.strip()) for name, line in lines() if CLOCK.search(line)}
    assert {(name, line) for name, line in found if name not in ALLOWED} == set()
    assert {name for name, _ in found} == set(ALLOWED)


def test_whoever_is_waited_for_has_minutes() -> None:
    waits = [
        (name, line.strip())
        for name, line in lines()
        if (match := WAIT.search(line)) and float(next(filter(None, match.groups()))) < SHORTEST
    ]
    assert waits == []


@pytest.mark.parametrize(
    "line",
    ["begin = time.process_time()", "took = perf_counter() - began", "x = time.monotonic_ns()", "a = time.time()"],
)
def test_clocks_are_seen(line: str) -> None:
    assert CLOCK.search(line)
    assert not CLOCK.search("def perf_counter(self) -> float:")
