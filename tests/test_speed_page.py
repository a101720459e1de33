"""Figures of speed and of sampled accuracy on the pages are those of the table that `make bench` stored."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.benchmarks import benchmark

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "accuracy-and-speed.md").read_text(encoding="utf-8")
table = benchmark("table")
stored = table.of_page(PAGE)


@pytest.mark.parametrize(("page", "count"), list(zip(table.PAGES, (8, 2), strict=True)))
def test_tables_of_the_pages_are_the_stored_ones(page: Path, count: int) -> None:
    text = page.read_text(encoding="utf-8")
    assert table.filled(text) == text
    assert text.count("<!-- table ") == text.count("<!-- end -->") >= count


def test_the_text_and_the_numbers_of_the_stored_tables_agree() -> None:
    for path in sorted(table.RESULTS.glob("*.json")):
        assert path.with_suffix(".md").read_text(encoding="utf-8") == table.Stored.read(path).text()


def element(samples: int) -> dict[str, float]:
    name = "prefix sums" if samples else "exact"
    return dict(stored.rows("element", harmonics=10, evaluation=name, samples=samples)[0])


def claims() -> dict[str, float]:
    """What the page says above its tables, and what they say of it."""
    curves = [row["s, median"] for row in stored.rows("curves")]
    return {
        r"and all its derivatives takes about ([\d.]+) microseconds": element(0)["us, median"],
        r"with 512 samples costs ([\d.]+) times as much": element(512)["over exact"],
        r"its tangents are wrong by ([\d.]+) % in the median": 100.0 * element(512)["tangent error, median"],
        r"and its forces by ([\d.]+) % at worst": 100.0 * element(512)["force, worst"],
        r"with 8192 samples ([\d.]+) times": element(8192)["over exact"],
        r"takes ([\d.]+) s for a curve of the oscillator": min(curves),
        r"and ([\d.]+) s for one of a reduced blade": max(curves),
    }


@pytest.mark.parametrize("pattern", claims())
def test_the_page_claims_what_was_measured(pattern: str) -> None:
    words = pattern.replace(" ", r"\s+")
    found = re.search(words, PAGE)
    assert found, pattern
    digits = len(found[1].replace(".", "").lstrip("0"))
    assert float(found[1]) == float(f"{claims()[pattern]:.{digits}g}")


@pytest.mark.parametrize(
    ("pattern", "where"),
    [
        (
            r"it takes (\d+) to (\d+) times as long as ours, and its",
            lambda row: row["samples"] < 1024 and row["points"] < 100,
        ),
        (r"with 1024 samples it takes (\d+) to (\d+) times as long", lambda row: row["samples"] == 1024),
    ],
)
def test_the_page_says_how_long_the_other_code_takes(pattern: str, where: Callable[[dict[str, Any]], bool]) -> None:
    found = re.search(pattern.replace(" ", r"\s+"), PAGE)
    assert found
    ratios = [row["over ours"] for row in stored.rows("pyharm-curve") if row["samples"] and where(row)]
    assert (int(found[1]), int(found[2])) == (round(min(ratios)), round(max(ratios)))


@pytest.mark.verify
def test_rivals_give_the_same_numbers() -> None:
    """The best sampled form is no other approximation than the usual one."""
    import numpy as np

    rival, runs, elements = benchmark("aft_rival"), benchmark("aft_runs"), benchmark("element")
    state = elements.batch(range(4), 40)
    usual = rival.evaluate(range(4), **state, table=rival.tables(range(4), 64), version="tuned")
    best = runs.evaluate(runs.Tables(range(4), 64), **state)
    for a, b in zip(usual, best, strict=True):
        L = 14  # by the rubbing velocity a contact stuck all period has no derivative
        np.testing.assert_allclose(a[..., :L], b[..., :L], rtol=1e-9, atol=1e-9 * np.abs(a).max())
