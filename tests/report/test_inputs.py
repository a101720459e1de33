"""Tables of inputs in a page: what they say of the model, its modes, loads and contacts, and who wrote the case."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.blocks import worn
from helpers.oscillator import UNITS, damper, one_mass
from helpers.pages import needs_node, opened
from helpers.reports import branch, planar_branch

import slipstick as ss
from slipstick.case.case import Case
from slipstick.case.script import python_script
from slipstick.report.content import content_of
from slipstick.report.inputs import MOST_LOADS, inputs_of, inputs_of_case

CASE = """
format = 1
title = "One mass"
author = "A. Engineer"
remarks = "First line\\nsecond <b>line</b>"
harmonics = "0..2"
[structure]
kind = "matrices"
dofs = ["x"]
mass = [[1.0]]
damping = [[0.4]]
stiffness = [[40.0]]
[[load]]
dof = "x"
sin = 100.0
[[contact]]
name = "damper"
tangential = "x"
kt = 100.0
mu = 0.3
normal_load = 800.0
[response]
from = 3.0
to = 4.0
max_points = 4
"""


def tables(problem: ss.Problem, unit: str = "rad/s", **attributes: str) -> dict[str, Any]:
    return {table["title"]: table for table in inputs_of(problem, attributes, unit)}


def records(table: dict[str, Any]) -> list[dict[str, str]]:
    return [dict(zip(table["head"], row, strict=True)) for row in table["rows"]]


def test_modes_of_one_mass_in_closed_form() -> None:
    problem = one_mass(damper(), units=UNITS)
    modes = tables(problem, "Hz")["Modes without contacts"]
    assert modes["head"][1] == "undamped frequency [Hz]"
    ((number, frequency, ratio),) = modes["rows"]
    assert number == "1"
    assert float(frequency) == pytest.approx(math.sqrt(40.0) / (2.0 * math.pi), rel=1e-5)
    assert float(ratio) == pytest.approx(0.4 / (2.0 * math.sqrt(40.0)), rel=1e-3)


def test_model_and_loads_with_their_units() -> None:
    loads = [ss.Load(dof="x", sin=100.0), ss.Load(dof="x", harmonic=0, cos=-5.0)]
    made = tables(one_mass(damper(), units=UNITS, loads=loads))
    model = dict(made["Model"]["rows"])
    assert model["masses"] == "x 1 N s^2/mm"
    assert model["units"].startswith("mm, N, s")
    assert records(made["Loads"]) == [
        {"on": "x", "as": "force", "harmonic": "1", "amplitude": "100 N", "phase": f"{-math.pi / 2.0:.4g} rad"},
        {"on": "x", "as": "force", "harmonic": "0", "amplitude": "-5 N", "phase": "-"},
    ]


def test_many_loads_are_counted() -> None:
    loads = [ss.Load(dof="x", harmonic=m, cos=1.0) for m in range(1, MOST_LOADS + 4)]
    rows = tables(one_mass(damper(), loads=loads, harmonics=range(MOST_LOADS + 4)))["Loads"]["rows"]
    assert len(rows) == MOST_LOADS + 1
    assert rows[-1][0] == "and 3 more"


def test_contacts_of_one_kind_are_one_row() -> None:
    """Those that differ in a number give its range; another law or another port is another row."""
    pairs = [damper(10.0, name="a"), damper(10.0, name="b", mu=0.4)]
    rows = records(tables(one_mass(*pairs, units=UNITS))["Contacts"])
    assert len(rows) == 1
    (row,) = rows
    assert row["contacts"] == "2: a, b"
    assert (row["kt"], row["mu"], row["normal load"]) == ("100 N/mm", "0.3 to 0.4", "800 N")
    assert row["rubbing"] == "rubbing at 10 mm/s"
    problem = branch().problem
    assert problem is not None
    joint, tip = records(tables(problem)["Contacts"])
    assert (joint["contacts"], joint["along"], joint["kn"]) == ("joint", "tangential a - b", "-")
    assert (tip["along"], tip["kn"]) == ("tangential b and normal z", "60")
    assert "sin1 0.1" in tip["rubbing"]
    assert "normal_cos2 0.02" in tip["rubbing"]


def test_every_number_of_a_kind_lies_in_its_range() -> None:
    rng = np.random.default_rng(3)
    values = rng.uniform(0.1, 0.9, size=30)
    pairs = [damper(name=f"c{k}", mu=value) for k, value in enumerate(values)]
    (row,) = records(tables(one_mass(*pairs))["Contacts"])
    low, high = map(float, row["mu"].split(" to "))
    np.testing.assert_allclose([low, high], [values.min(), values.max()], rtol=1e-5)
    assert row["contacts"].endswith("(30)")


def test_laws_of_other_kinds_and_planes() -> None:
    for made in (branch(spring=True), planar_branch(), worn()):
        problem = made.problem
        assert problem is not None
        names = {name for pair in problem.contacts for name in pair.elements}
        rows = records(tables(problem)["Contacts"])
        assert len({row["law"] for row in rows}) == len({type(pair.contact) for pair in problem.contacts})
        assert all(any(name in row["contacts"] for row in rows) for name in names)


def test_author_remarks_and_origin_of_a_case() -> None:
    case = Case.from_text(CASE)
    content = content_of(case.run(), "a", contacts=1, dofs=1)
    assert (content["author"], content["remarks"]) == ("A. Engineer", "First line\nsecond <b>line</b>")
    model = dict(content["inputs"][0]["rows"])
    assert model["from"] == 'kind "matrices" of the case file'
    assert not {"author", "remarks"} & {name for name, _ in content["about"]}
    plain = Case.from_text(CASE.replace('author = "A. Engineer"', ""))
    assert "author" not in plain.names


def test_the_script_of_a_case_names_its_author(tmp_path: Path) -> None:
    script = python_script(CASE, "case.toml", tmp_path)
    compile(script, "case.py", "exec")
    head = script.split('"""')[1]
    assert "Author: A. Engineer" in head
    assert "second <b>line</b>" in head


def test_results_without_a_problem_have_no_inputs() -> None:
    assert inputs_of(None, {}, "rad/s") == []


@needs_node
def test_the_page_shows_inputs_as_text() -> None:
    content = content_of(Case.from_text(CASE).run(), "a", contacts=1, dofs=1)
    titles, words, head = opened(
        {"results": [content]},
        """const titles = IDS.inputs.querySelectorAll("h3").map((own) => own.textContent);
        return [titles, IDS.inputs.textContent, IDS.head.textContent]""",
    )
    assert titles == [table["title"] for table in content["inputs"]]
    assert "100" in words
    assert "second <b>line</b>" in head
    assert "A. Engineer" in head


@needs_node
def test_wear_draws_depth_and_load_below_the_amplitude() -> None:
    made = worn()
    content = content_of(made, "a", contacts=2, dofs=2)
    keys, depth, words = opened(
        {"results": [content]},
        """const { below, curve } = app.curves;
        const keys = [curve.key, ...below.map((own) => own.curve.key)];
        return [keys, [...below[0].lines[0].y], app.curves.readout.textContent]""",
    )
    assert keys == ["amplitude", "worn_depth", "normal_load"]
    name = content["contacts"]["names"]
    assert any(np.allclose(depth, made.dataset.worn_depth.sel(contact=one).values, rtol=1e-6) for one in name)
    assert "worn depth" in words
    assert "normal load" in words


@needs_node
def test_few_bars_are_narrow_and_no_card_is_as_wide_as_the_page() -> None:
    half, odd, last = opened(
        {"results": [content_of(planar_branch(), "a", contacts=3, dofs=2)]},
        """app.set({ contact: "foot" });
        const cards = Object.values(app.panels).filter((own) => own?.card && !own.card.hidden).map((own) => own.card);
        return [[barHalf(2), barHalf(20)], cards.length % 2, cards.map((card) => "data-last" in card.attributes)]""",
    )
    assert half == [0.12, 0.38]
    assert odd == 1
    assert last == [False, False, True, True, True]


def test_a_page_without_a_problem_shows_what_the_case_gives() -> None:
    model, loads, contacts = inputs_of(None, {"case": CASE}, "rad/s")
    assert ["stiffness", "[[40]]"] in model["rows"]
    assert ["harmonics", "0..2"] in model["rows"]
    assert records(loads) == [{"dof": "x", "sin": "100"}]
    assert records(contacts)[0]["normal load"] == "800"
    assert inputs_of_case("no case [") == []
    assert inputs_of_case("structure = 3\nload = 2") == []
