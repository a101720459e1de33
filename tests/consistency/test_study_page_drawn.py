"""The page of a study without a browser: its map, curves and table are the cases, and clicks choose among them."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.pages import needs_node, opened

from slipstick.report.encoding import packed

pytestmark = needs_node
WIDE, HIGH, LEFT, RIGHT, TOP, BOTTOM = 770, 508, 74, 14, 14, 52
"""Of the drawing, in a card as wide as that of browser.js."""


@cache
def content(grid: bool = True) -> dict[str, Any]:
    """Six cases of two parameters, of which one failed and one is not computed; three of them have curves."""
    mu, load = np.repeat([0.1, 0.2, 0.4], 2), np.tile([1.0, 3.0], 3)
    peak = np.array([4.0, 9.0, 3.0, 8.0, np.nan, 7.0])
    cases = [{"outcome": "COMPLETED", "message": "", "points": 3, "seconds": 0.5 + i} for i in range(6)]
    cases[4] = {"outcome": "NO_FIRST_POINT", "message": "nothing there", "points": 0, "seconds": 9.0}
    cases[5] = {"outcome": "", "message": "", "points": 0, "seconds": None}
    x, unit = np.array([1.0, 2.0, 3.0, 4.0]), {"units": "mm", "after": " mm"}
    return {
        "outcome": {"ok": False, "text": "5 of 6"}, "warnings": ["odd"],
        "about": [["by", "me"]], "case": "", "case_file": "c.toml", "inputs": [], "scatter": None,
        "method": "grid over mu, load", "grid": grid, "first": "y",
        "parameters": [{"name": "mu", "units": "", "values": packed(mu, "f8")},
            {"name": "load", "units": "N", "values": packed(load, "f8")}],
        "dofs": [
            {"name": "y", **unit, "peak": packed(peak, "f8"), "at": packed(10 * peak, "f8")},
            {"name": "x", **unit, "peak": packed(peak[::-1], "f8"), "at": packed(peak[::-1], "f8")},
        ],
        "followed": {"key": "omega", "label": "Frequency", "units": "rad/s"}, "cases": cases, "file": "study.nc",
        "frequency": {"unit": "rad/s", "factors": {"rad/s": 1.0, "Hz": 0.5 / np.pi}},
        "left_out": "3 of 6 curves are in this page",
        "curves": [
            {"case": i, "x": packed(x, "f8"), "y": [packed(x * (i + 1), "f8"), packed(x**2, "f8")],
             "part": packed([0, 0, 1, 1], "u1")}
            for i in (0, 1, 2)
        ],
    }  # fmt: skip


def drawn(script: str, *, grid: bool = True, address: str = "") -> Any:
    return opened(content(grid), script, study=True, address=address)


def test_scales_ticks_and_cells() -> None:
    found = drawn("""
      const plain = new Scale([0, 10, NaN]), wide = new Scale([1, 1000]), one = new Scale([4]),
        none = new Scale([]), aired = new Scale([0, 1], 0.1), zero = new Scale([0]),
        blades = new Scale([-0.5, 23.5], 0, true);
      const both = new Scale([-100, -1, 0, 1, 100]), from = new Scale([0, 0.1, 1, 10, 1000]);
      const cells = new Cells([4, 1, 2, NaN, 2]), alone = new Cells([3]), many = new Cells(Array.from({ length: 25 },
        (_, i) => i)), far = new Scale([0, 1e-9, 1e3]);
      const boxes = (own) => own.values.map((v) => [v, own.at(v), own.cell(v)]);
      return { blades: [blades.log, blades.at(11.5), blades.ticks()],
        plain: [plain.at(5), plain.ticks()], wide: [wide.log, wide.at(10), wide.ticks()], near: new Scale([1,
        99]).log, one: [one.low, one.high, zero.low, zero.high], none: [none.low, none.high],
        aired: [aired.low, aired.high], cells: [boxes(cells), cells.ticks()], alone: boxes(alone),
        many: many.ticks(), far: far.ticks(),
        both: [both.log, both.ticks(), both.ticks().map((v) => both.at(v)), [-100, -10, 0, 10,
        100].map((v) => both.at(v))], from: [from.log, from.ticks(), [0, 0.1, 1, 10, 100, 1000].map((v) => from.at(v))],
        few: new Scale([20, 35, 2500]).ticks(),
        two: new Scale([0.5, 60]).ticks(), steps: [new Scale([0, 1]).ticks(), new Scale([-3, 3]).ticks()] }""")
    assert found["blades"] == [False, 0.5, [0, 5, 10, 15, 20]]
    assert found["plain"] == [0.5, [0, 2, 4, 6, 8, 10]]
    assert found["wide"] == [True, pytest.approx(1 / 3), [1, 10, 100, 1000]]
    assert not found["near"]
    assert found["one"] == [2, 6, -0.5, 0.5]
    assert found["none"] == [0, 1]
    assert found["aired"] == pytest.approx([-0.1, 1.1])
    third = [[1, 1 / 6, [0, 1 / 3]], [2, 1 / 2, [1 / 3, 2 / 3]], [4, 5 / 6, [2 / 3, 1]]]
    for own, (value, middle, ends) in zip(found["cells"][0], third, strict=True):
        assert own == [value, pytest.approx(middle), pytest.approx(ends)]
    assert found["cells"][1] == [1, 2, 4]
    assert found["alone"] == [[3, 0.5, [0, 1]]]
    assert found["many"] == [0, 3, 6, 9, 12, 15, 18, 21, 24]  # no more than can be read
    log, ticks, places, at = found["both"]
    assert log
    assert ticks == sorted(ticks)
    assert {-100, -10, 0, 10, 100} <= set(ticks)
    assert min(places) >= -1e-9
    assert max(places) <= 1 + 1e-9
    assert at == pytest.approx([1 - v for v in reversed(at)])  # the same both ways
    assert at[2] == 0.5
    log, ticks, at = found["from"]
    assert log
    assert ticks[0] == 0
    assert at[0] == 0
    assert at[-1] == 1
    least = 0.1
    assert at == pytest.approx(np.log10(1 + np.array([0, 0.1, 1, 10, 100, 1000]) / least) / np.log10(1 + 1000 / least))
    assert found["far"][0] == 0
    assert 3 <= len(found["far"]) <= 8
    assert found["few"] == [100] or found["few"][0] >= 20
    assert found["two"] == pytest.approx([0.5, 1, 2, 5, 10, 20, 50])
    assert found["steps"][0] == pytest.approx([0, 0.2, 0.4, 0.6, 0.8, 1.0])
    assert found["steps"][1] == [-2, 0, 2]


def test_the_map_of_a_grid_is_tiled_by_its_cases() -> None:
    cells, labels, classes, crosses, title, note = drawn("""
      const own = $("map"), shown = classed(own, "mark");
      return [shown.map(({ attributes: a }) => [a.x, a.y, a.width, a.height].map(Number)),
        shown.map(({ attributes: a }) => a["aria-label"]), shown.map(({ attributes: a }) => [a.class,
      a.fill ?? null]),
        classed(own, "failed").map(({ attributes: a }) => a.d), tagged(own, "svg")[0].attributes["aria-label"],
          own.textContent]""")
    width, height = WIDE - LEFT - RIGHT, HIGH - TOP - BOTTOM
    x = LEFT + width * np.arange(4) / 3  # of equal width, however the values lie
    for i, (left, top, w, h) in enumerate(cells):
        column, row = divmod(i, 2)
        assert [left, w] == pytest.approx([x[column], width / 3])
        assert [top, h] == pytest.approx([TOP + (1 - row) * height / 2, height / 2])
    assert labels[0] == "case 0: mu = 0.1, load = 1; peak 4 mm"
    assert labels[4] == "case 4: mu = 0.4, load = 1; nothing there"
    assert labels[5] == "case 5: mu = 0.4, load = 3; not computed yet"
    assert [name for name, _ in classes] == ["mark"] * 4 + ["mark missing", "mark"]
    assert classes[4][1] is None
    colours = [
        tuple(map(int, re.findall(r"\d+", fill)))
        for _, fill in (classes[2], classes[0], classes[5], classes[3], classes[1])
    ]
    assert np.all(np.diff([sum(colour[:2]) for colour in colours]) > 0)  # the higher the peak the lighter
    middle = (x[2] + x[3]) / 2, TOP + 0.75 * height
    assert len(crosses) == 1
    assert [float(v) for v in re.findall(r"[-\d.]+", crosses[0])[:2]] == pytest.approx([middle[0] - 5, middle[1] - 5])
    assert title == "peak of y [mm] over mu"
    assert "choose a case" not in note  # there is no third parameter


def test_over_one_parameter_the_peaks_of_like_cases_are_joined() -> None:
    found = drawn("""
      app.set({ by: "" });
      const path = () => classed($("map"), "line")[0].attributes.d, places = () => classed($("map"),
        "mark").map(({ attributes: a }) => [a.cx, a.cy].map(Number));
      const first = [path(), places(), $("map").textContent, app.shown()];
      app.set({ case: 1 });
      const second = [path(), app.shown(), classed($("map"), "around").length];
      app.set({ over: "load", by: "mu" }); app.set({ over: "mu" });
      return [first, second, app.view.by, tagged($("choices"), "option").map((o) => o.textContent)]""")
    (path, places, text, shown), (other, chosen, marks), by, options = found
    assert shown == {"cases": [0, 2, 4], "fixed": ["load = 1"]}  # those like the case with the smallest peak
    assert chosen == {"cases": [1, 3, 5], "fixed": ["load = 3"]}
    assert "at load = 1; choose a case to see the others like it" in text
    assert marks == 1
    x = LEFT + (WIDE - LEFT - RIGHT) * (np.array([0.1, 0.2, 0.4]) - 0.085) / 0.33  # air of 5 % at each end
    low, high = 3.0 - 0.08, 4.0 + 0.08
    y = HIGH - BOTTOM - (HIGH - TOP - BOTTOM) * (np.array([4.0, 3.0]) - low) / (high - low)
    np.testing.assert_allclose([p[0] for p in places], x, atol=1e-6)
    np.testing.assert_allclose([p[1] for p in places], [*y, HIGH - BOTTOM - 8], atol=1e-6)
    numbers = [float(v) for v in re.findall(r"[-\d.]+", path)]
    np.testing.assert_allclose(numbers, np.stack([x[:2], y], axis=1).ravel(), atol=0.051)
    assert re.sub(r"[^ML]", "", path) == "ML"
    assert re.sub(r"[^ML]", "", other) == "MLL"
    assert by == ""
    assert options[-3:] == ["load", "nothing else", "load"] or "nothing else" in options


def test_in_a_list_every_case_is_a_dot() -> None:
    places, lines_, shown = drawn(
        """
      return [classed($("map"), "mark").map(({ tag, attributes: a }) => [tag, Number(a.cx), Number(a.cy)]),
        classed($("map"), "line").length, app.shown()]""",
        grid=False,
    )
    assert shown == {"cases": [0, 1, 2, 3, 4, 5], "fixed": []}
    assert lines_ == 0
    assert {tag for tag, _, _ in places} == {"circle"}
    x = LEFT + (WIDE - LEFT - RIGHT) * (np.repeat([0.1, 0.2, 0.4], 2) - 0.085) / 0.33
    y = HIGH - BOTTOM - (HIGH - TOP - BOTTOM) * (np.tile([1.0, 3.0], 3) - 0.9) / 2.2
    np.testing.assert_allclose([p[1:] for p in places], np.stack([x, y], axis=1), atol=1e-6)


def test_percentiles_of_samples_are_a_band() -> None:
    sampled, x = content(grid=False), np.array([0.0, 1.0, 2.0])
    y = [packed(np.array(values), "f8") for values in ([np.nan, 1.0, 2.0], [3.0, 2.0, 3.0], [5.0, 3.0, 4.0])]
    one = {"y": y, "peak": packed([1.0, 2.0, 4.0], "f8"), "at": packed([10.0, 11.0, 12.0], "f8")}
    sampled["band"] = {"percentiles": [5.0, 50.0, 95.0], "x": packed(x, "f8"), "dofs": [one, one]}
    script = """return [tagged($("band"), "path").map(({ attributes: a }) => [a.class, a.d]), $("band").textContent,
      $("band").hidden]"""
    paths, text, hidden = opened(sampled, script, study=True)
    (_, area), (_, line) = paths
    assert [len(area.split("L")), len(line.split("L")), area[-1]] == [4, 2, "Z"]  # where the lowest is not known, none
    assert "Peak of y: 2 mm (1 to 4) at 11 rad/s (10 to 12): 50 % of the samples, and from 5 to 95 %." in text
    assert not hidden
    assert drawn('return $("band").hidden', grid=True)


def test_curves_are_those_of_the_cases_shown() -> None:
    found = drawn("""
      const paths = () => tagged($("curves"), "path").map(({ attributes: a }) => [a.class, a.d, a.stroke ?? null]);
      const all = paths(), text = $("curves").textContent;
      app.set({ dof: "x", case: 0 });
      const other = paths();
      app.set({ by: "" });
      const like = paths().length;
      tagged($("curves"), "path").find((path) => path.attributes.class !== "chosen-line").listeners.click();
      return [all, text, other, like, app.view.case]""")
    paths, text, other, like, chosen = found
    assert "Frequency [rad/s]" in text
    assert "amplitude of y [mm]" in text
    assert "3 of 6 curves are in this page" in text
    across = LEFT + (WIDE - LEFT - RIGHT) * np.arange(4) / 3
    low, high = 1.0 - 0.04 * 11, 12.0 + 0.04 * 11
    for i, (name, path, stroke) in enumerate(paths):
        assert name == "line mark"
        assert stroke.startswith("rgb(")
        up = HIGH - BOTTOM - (HIGH - TOP - BOTTOM) * ((i + 1) * np.arange(1, 5) - low) / (high - low)
        np.testing.assert_allclose(
            [float(v) for v in re.findall(r"[-\d.]+", path)], np.stack([across, up], axis=1).ravel(), atol=0.051
        )
        assert re.sub(r"[^ML]", "", path) == "MLML"  # two parts
    assert paths[0][2] == paths[1][2] != paths[2][2]  # by the friction coefficient
    assert [name for name, _, _ in other] == ["line mark", "line mark", "chosen-line"]  # the one chosen on top
    assert like == 2
    assert chosen == 2


def test_the_table_is_sorted_and_filtered() -> None:
    found = drawn("""
      const rows = () => table($("cases")), order = () => rows().slice(1).map((row) => row[0]),
        head = (text) => click(button($("cases"), text));
      const seen = { all: rows() };
      head("peak of y [mm]"); seen.up = order(); head("peak of y [mm]"); seen.down = order(); head("load [N]");
        seen.load = order(); head("outcome"); seen.outcome = order(); head("time [s]"); seen.time = order();
      head("case");
      seen.sorted = tagged($("cases"), "th").map((th) => th.attributes["aria-sort"] ?? null);
      app.set({ show: "bad" }); seen.bad = order(); seen.count = $("count").textContent; app.set({ show: "" });
      const input = tagged($("cases"), "input")[0];
      input.listeners.input({ target: { value: "NOTHING" } });
      seen.words = order(); seen.kept = tagged($("cases"), "input")[0] === input;
        seen.number = $("count").textContent; seen.address = location.hash;
      app.set({ words: "" });
      click(tagged($("case-2"), "a")[0]);
      seen.chosen = [app.view.case, $("case-2").attributes.class, $("case-4").attributes.class,
        $("case-0").attributes.class];
      return seen""")
    all_ = found["all"]
    assert all_[0] == ["case", "mu", "load [N]", "peak of y [mm]", "at frequency [rad/s]", "time [s]", "outcome"]
    assert all_[1] == ["0", "0.1", "1", "4", "40", "0.5", "completed"]
    assert all_[5] == ["4", "0.4", "1", "–", "–", "9", "NO_FIRST_POINT: nothing there"]
    assert all_[6][5:] == ["–", "not computed yet"]
    assert found["up"] == ["2", "0", "5", "3", "1", "4"]  # no number last
    assert found["down"][-5:] == ["1", "3", "5", "0", "2"]
    assert found["load"] == ["0", "2", "4", "1", "3", "5"]
    assert found["outcome"] == ["5", "0", "1", "2", "3", "4"]
    assert found["time"] == ["0", "1", "2", "3", "4", "5"]
    assert found["sorted"] == ["ascending", None, None, None, None, None, None]
    assert found["bad"] == ["4", "5"]
    assert found["count"] == "2 of 6"
    assert found["words"] == ["4"]
    assert found["kept"]
    assert found["number"] == "1 of 6"
    assert "words=NOTHING" in found["address"]
    assert found["chosen"] == [2, "chosen", "bad", ""]


def test_a_case_is_chosen_and_let_go_in_the_map() -> None:
    found = drawn("""
      const mark = (i) => classed($("map"), "mark")[i], seen = [];
      click(mark(3)); seen.push(app.view.case); click(mark(3)); seen.push(app.view.case);
      press(mark(1), " "); seen.push(app.view.case); press(mark(2), "x"); seen.push(app.view.case);
      return [seen, location.hash]""")
    assert found[0] == [3, None, 1, 1]
    assert "case=1" in found[1]


def test_the_address_is_read_and_what_is_strange_in_it_is_not() -> None:
    script = "return [app.view, (location.hash = '#dof=x&case=3', heard.hashchange(), app.view.case), app.dof.name]"
    assert drawn("app.set({ by: '' }); return location.hash").count("by=") == 1  # nothing else is a choice too
    assert drawn("return app.view.by", address="#by=") == ""
    view, case, dof = drawn(script, address="#dof=x&over=load&by=mu&case=2&show=bad&sort=load&down=1&words=a")
    assert view == {
        "dof": "x",
        "over": "load",
        "by": "mu",
        "case": 2,
        "show": "bad",
        "words": "a",
        "sort": "load",
        "down": True,
        "unit": "rad/s",
    }
    assert (case, dof) == (3, "x")
    start = {
        "dof": "y",
        "over": "mu",
        "by": "load",
        "case": None,
        "show": "",
        "words": "",
        "sort": "number",
        "down": False,
        "unit": "rad/s",
    }
    for address in ("", "#dof=q&over=q&by=q&case=99&show=q&sort=q&down=0", "#case=-1"):
        assert drawn("return app.view", address=address) == start


def test_the_head_tells_outcome_method_and_warnings() -> None:
    text, facts, verdict, foot, bars = (
        drawn("""return [$("head").textContent, classed($("head"), "facts")[0].textContent, classed($("head"),
      "verdict")[0].attributes.class, $("foot").textContent,
      tagged($("map"), "svg").map((svg) => svg.attributes["aria-label"])]""")
    )
    assert "Warning: odd" in text
    assert facts == "6 cases · 1 did not complete · grid over mu, load · c.toml"
    assert verdict == "verdict early"
    assert foot.startswith("Written by slipstick 1, now.")
    assert foot.endswith("the address keeps the choice.")
    assert bars[1] == "Colours of peak of y [mm]"


def test_conditions_and_words_filter_the_cases() -> None:
    wanted = {
        "mu=0.2": [2, 3], "mu = 2e-1": [2, 3], "mu>=0.2": [2, 3, 4, 5], "mu > 0.2": [4, 5], "load<=1": [0, 2, 4],
        "mu<0.4 load=3": [1, 3], "mu=0.4 nothing": [4], "NO_FIRST": [4], "not computed": [5], "mu=0.3": [],
        "": [*range(6)],
        "kn=1": [], "load=0": [], "mu>0.1,load<2": [2, 4],
    }  # fmt: skip
    texts = ", ".join(f"'{text}'" for text in wanted)
    found = drawn(f"return [{texts}].map((text) => [0, 1, 2, 3, 4, 5].filter(app.filter(text)))")
    assert dict(zip(wanted, found, strict=True)) == wanted


def test_frequencies_are_in_the_unit_chosen_and_a_case_says_how_its_loops_are_had() -> None:
    table_, other, curve, said, none, address = drawn("""
      const heads = () => table($("cases")).slice(0, 2).map((row) => row[4]), first = heads();
      click(button($("choices"), "Hz")); app.set({ case: 2 });
      const seen = [first, heads(), $("curves").textContent, $("chosen").textContent];
      click(button($("choices"), "none"));
      return [...seen, $("chosen") === null || app.view.case === null, location.hash]""")
    assert table_ == ["at frequency [rad/s]", "40"]
    assert other[0] == "at frequency [Hz]"
    assert float(other[1]) == pytest.approx(40 / (2 * np.pi), rel=1e-4)
    assert "Frequency [Hz]" in curve
    assert "case 2: mu = 0.2, load = 1; peak 3 mm at 4.7746 Hz" in said
    assert "slipstick report study.nc --case 2" in said
    assert none
    assert "unit=Hz" in address


def test_a_page_that_becomes_wider_is_drawn_once_it_stays_so() -> None:
    script = """
      const queue = new Map(); let next = 1, drawn = 0;
      globalThis.setTimeout = (f) => { queue.set(next, f); return next++; };
      globalThis.clearTimeout = (i) => queue.delete(i);
      app.draw = () => { drawn += 1; };
      heard.resize();
      const same = queue.size;
      innerWidth = 900; heard.resize(); innerWidth = 800; heard.resize(); heard.resize();
      const waiting = queue.size;
      queue.forEach((f) => f());
      return [same, waiting, drawn]"""
    assert drawn(script) == [0, 1, 1]
