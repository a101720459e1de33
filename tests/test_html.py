"""What notebooks show of problems, branches and integrations in time."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.html import html_table, some

EVIL = "<script>alert(1)</script>&\"'"


class Cells(HTMLParser):
    """The texts of a table; every tag that is opened is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: set[str] = set()
        self.texts: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.tags.add(tag)
        if tag != "br":
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


def read(html: str) -> str:
    cells = Cells()
    cells.feed(html)
    assert not cells.open
    assert cells.tags <= {"table", "caption", "tr", "th", "td", "br"}
    return " | ".join(cells.texts)


def problem(**more: Any) -> ss.Problem:
    pair = damper(5.0, name=EVIL, normal_load=80.0)
    return one_mass(**{"contacts": pair, "harmonics": range(6), "title": EVIL} | more)


def test_of_a_problem() -> None:
    text = read(problem()._repr_html_())
    assert text.count(EVIL) == 2
    for words in ("MatrixStructure, 1 dof: x", "6.3246", "kt 100", "velocity 5", "11 unknowns", "x (harmonic 1)"):
        assert words in text
    assert "normal_load 80" in text
    assert "gap" not in text  # that makes a constant load, and stiffness that presses on nothing, were not given
    shaken = problem(loads=ss.Load(base="x", motion="displacement", cos=1.0))
    assert "relative to the moving support" in read(shaken._repr_html_())
    assert "contacts" not in read(problem(contacts=())._repr_html_())


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_of_a_branch() -> None:
    branch = ss.forced_response(problem(units={"length": "mm", "time": "s"}), omega=(4.0, 8.0))
    text = read(branch._repr_html_())
    ((omega, amplitude),) = branch.peaks("x")
    assert f"{amplitude:.6g} mm at {omega:.6g} rad/s" in text  # as on the terminal
    assert EVIL in text
    assert "completed" in text
    over = ss.parameter_response(problem(), f"{EVIL}.velocity", (5.0, 6.0), omega=4.0)
    assert f"{EVIL}.velocity from 5 to 6" in read(over._repr_html_())
    assert "largest" in read(over._repr_html_()) or "at" in read(over._repr_html_())
    linear = ss.linear_response(problem(), omega=np.linspace(2.0, 10.0, 50))
    assert "peaks of x" in read(linear._repr_html_())
    few = ss.forced_response(problem(), omega=(4.0, 8.0), options={"max_points": 3})
    assert few.message in read(few._repr_html_())


def test_of_an_integration_in_time() -> None:
    result = ss.transient(problem(), 5.0)
    text = read(result._repr_html_())
    assert f"amplitude {result.amplitude[0]:.5g}" in text
    assert "periodic after" in text
    assert re.search(r"slip\+ \d+%", text)
    assert EVIL in text


def test_tables_and_lists() -> None:
    assert read(html_table("a & b", [("<x>", "1\n2"), ("y", 3)])) == "a & b | <x> | 1 | 2 | y | 3"
    assert some(range(20), 3) == "0, 1, 2, ... (20)"
