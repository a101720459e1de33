"""Examples of other codes, rebuilt: their numbers, closed forms, and a sampled balance written for these tests."""

from __future__ import annotations

import re

import numpy as np
import pytest
from other_codes import (
    CASES,
    PAGE,
    QUICK,
    Row,
    elastic_friction,
    filled,
    jeffcott,
    on_page,
    quiet,
    sampled_friction,
    tables_of,
)
from sampled_balance import jenkins

import slipstick as ss

QUICK_CASES = [pytest.param(name, marks=() if name in QUICK else pytest.mark.verify, id=name) for name in CASES]


@pytest.mark.parametrize("name", QUICK_CASES)
def test_numbers_of_other_codes(name: str) -> None:
    """Every row holds, and the page shows the first of each kind, its last digit apart."""
    rows = list(CASES[name]())
    assert [row for row in rows if not row.holds()] == []
    shown = tables_of(PAGE.read_text(encoding="utf-8"))[name].splitlines()[2:]
    for line, (row, others) in zip(shown, on_page(rows), strict=True):
        assert same(line, row, others), (line, row.text(others))


def same(line: str, row: Row, others: int) -> bool:
    """Whether a line of the page shows a row: what is found here may differ by what the row allows."""
    shown, made = (re.split(r" *\| *", text.strip("| ")) for text in (line, row.text(others)))
    if not row.other:
        return shown == made
    near = abs(float(shown[2]) - row.here) <= 2.0 * row.within * abs(row.here)
    return near and [shown[i] for i in (0, 1, 3)] == [made[i] for i in (0, 1, 3)]


def test_the_page_has_a_table_for_every_case() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert list(tables_of(page)) == list(CASES)
    assert filled(page, {}) == page


def test_the_march_of_the_reference_is_a_masing_loop() -> None:
    """Energy a period of a spring and slider under a cosine, 4 limit (a - limit/kt), from the samples."""
    t = np.arange(4096) * (2.0 * np.pi / 4096)
    f = jenkins(3.0 * np.cos(t), 2.0, 1.5)
    assert -np.mean(f * 3.0 * np.sin(t)) * 2.0 * np.pi == pytest.approx(4.0 * 1.5 * (3.0 - 1.5 / 2.0), rel=1e-6)


def test_what_sampling_costs() -> None:
    """At one point of the long case: 4096 samples lead to our solution, tmdsimpy's 128 samples to tmdsimpy's."""
    omega = 3.485669763038983
    branch = quiet(lambda: ss.forced_response(elastic_friction(300.0), omega=(3.2, 3.6), at=omega))
    (p,) = np.flatnonzero(branch.dataset.kind.values == "requested")
    X = branch.dataset.displacement.values[p]
    assert 0.1 < branch.dataset.slip_fraction.values[p, 0] < 1.0
    fine, coarse = (sampled_friction(300.0, samples).solved(X, omega) for samples in (4096, 128))
    assert np.abs(X - fine).max() < 1e-6 * np.abs(X).max()
    assert np.hypot(*coarse[0, 1:3]) == pytest.approx(205.0953598050209, rel=1e-9)


def test_whirl_on_a_stator_is_circular() -> None:
    """Full annular rub: one harmonic, y a quarter of a turn behind x, although three are kept."""
    branch = quiet(lambda: ss.forced_response(jeffcott(0.1), omega=(0.3, 0.5)))
    X = branch.dataset.displacement.values
    scale = np.abs(X).max()
    assert np.abs(X[:, 0, 1] - X[:, 1, 2]).max() < 1e-9 * scale
    assert np.abs(X[:, 0, 2] + X[:, 1, 1]).max() < 1e-9 * scale
    assert np.abs(X[:, :, 3:]).max() < 1e-9 * scale
    assert np.abs(X[:, :, 0]).max() < 1e-9 * scale
