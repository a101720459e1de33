"""The page of a report without a browser: what it draws and says is what the branch holds,
      and keys and clicks move it.

The scripts run in node with a stand-in for the browser; the page in Chromium itself is test_report_in_browser.py.
"""

from __future__ import annotations

import re
import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers import blocks
from helpers.pages import needs_node, opened
from helpers.reports import branch as made_branch
from helpers.reports import planar_branch
from scipy.interpolate import PchipInterpolator

import slipstick as ss
from slipstick.report.content import content_of
from slipstick.report.encoding import packed
from slipstick.results.deflection import deflection_of
from slipstick.results.peaks import peak_points

pytestmark = needs_node
RAISED = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


@cache
def branch() -> ss.Branch:
    return made_branch(spring=True)


def content(most: int = 12, **more: Any) -> dict[str, Any]:
    return content_of(branch(), "first", contacts=most, dofs=most) | more


def drawn(script: str, *results: dict[str, Any], address: str = "") -> Any:
    return opened({"results": list(results or [content()])}, script, address=address)


def number(text: str) -> float:
    """A number as the page says it."""
    mantissa, _, exponent = text.partition("×10")
    return float(mantissa) * 10.0 ** float(exponent.translate(RAISED) or 0)


def near(found: Any, truth: Any, digits: int = 5) -> None:
    np.testing.assert_allclose(found, truth, rtol=0.6 * 10.0 ** (1 - digits), atol=0)


# numbers, axes, ticks


def test_numbers_are_said_as_short_as_they_are() -> None:
    said = {
        "0, 5": "0", "1.5, 5": "1.5", "-0.25, 5": "-0.25", "123456, 5": "123460", "999999, 7": "999999",
        "1e6, 5": "1×10⁶", "0.001, 5": "0.001", "0.00099, 5": "9.9×10⁻⁴", "-2.5e-12, 2": "-2.5×10⁻¹²",
        "0.1234567, 3": "0.123", "NaN, 3": "–", "Infinity, 3": "–", "0.1234567": "0.12346",
    }  # fmt: skip
    assert drawn(f"return [{', '.join(f'short({given})' for given in said)}]") == list(said.values())


def test_ranges_of_axes() -> None:
    cases = """return [
      rangeOf([[1, 3], [2, NaN]]), rangeOf([[1, 3]], { zero: true }), rangeOf([[-3, -1]], { zero: true, air: 0.1 }),
      rangeOf([[0, 10, 1000]], { log: true }), rangeOf([[NaN]]), rangeOf([[-1]], { log: true }), rangeOf([[0, 0]]),
      rangeOf([[5, 5 + 1e-9]]), rangeOf([[-4]])]"""
    expected = [
        [0.9, 3.1], [0, 3.15], [-3.3, 0], [10 / 100**0.05, 1000 * 100**0.05], [0, 1], [1, 10], [-1, 1], [4, 6],
        [-4.8, -3.2],
    ]  # fmt: skip
    for found, wanted in zip(drawn(cases), expected, strict=True):
        assert found == pytest.approx(wanted, rel=1e-6)


def test_ticks_and_places() -> None:
    found = drawn("""return {
      places: [1, 0.5, 0.25, 2e-3, 1e-11, 1 / 3].map(placesOf), power: [[0, 999], [0, 1e4], [-2e-3, 1e-3], [0, 0.5],
        [-5e6, 1]].map(powerOf),
      ticks: [logTicks(1, 1000), logTicks(0.9, 11), logTicks(1e-12, 1e9), logTicks(20, 40)],
      decimal: [1, 20, 1000, 1e4, 0.01, 5e-3, 2e7].map(decimal) }""")
    assert found["places"] == [0, 1, 2, 3, 11, 6]  # a millionth of the step
    assert found["power"] == [0, 3, -3, 0, 6]
    assert found["ticks"][0] == [1, 10, 100, 1000]
    assert found["ticks"][1] == [1, 2, 5, 10]
    assert found["ticks"][2] == pytest.approx([10.0**e for e in range(-12, 10, 3)])
    assert found["ticks"][3] == [20]
    assert found["decimal"] == ["1", "20", "1000", "10⁴", "0.01", "5·10⁻³", "2·10⁷"]


def test_an_axis_of_long_numbers_has_a_power_in_its_label() -> None:
    found = drawn("""
      const on = (axis, range, vertical) => {
        const made = axisOf(axis, range, vertical), [min, max] = range;
        const u = { width: 460, height: 250, scales: { x: { min, max }, y: { min, max } } };
        const at = made.splits(u, 0, min, max), sizes = () => ["1234567", "1"].map((text) => made.size(u, [text]));
        return [made.label, made.scale, at, made.values(u, at), vertical ? sizes() : made.size];
      };
      return [on({ label: "Force", units: "N" }, [0, 20000], true), on({ label: "x", units: "" }, [0, 2], false),
        on({ label: "x", units: "m", log: true }, [1, 1e4], false),
        on({ label: "x", ticks: [[0, 1], ["a", "b"]] }, [0, 1], false)]""")
    assert found[0] == ["Force [10³ N]", "y", [0, 5000, 10000, 15000, 20000], ["0", "5", "10", "15", "20"], [63, 28]]
    assert found[1] == ["x", "x", [0, 0.5, 1, 1.5, 2], ["0.0", "0.5", "1.0", "1.5", "2.0"], 30]
    assert found[2] == ["x [m]", "x", [1, 10, 100, 1000, 10000], ["1", "10", "100", "1000", "10⁴"], 30]
    assert found[3] == ["x", "x", [0, 1], ["a", "b"], 30]


# the response


def test_curves_are_those_of_the_branch_in_the_unit_chosen() -> None:
    data = branch().dataset
    found = drawn("""
      const first = lines(app.curves.plotHost), unit = app.curves.plotHost.uplot.options.axes[0].label;
      app.set({ dofs: ["a", "z"], unit: "Hz" });
      const other = lines(app.curves.plotHost), hertz = app.curves.plotHost.uplot.options.axes[0].label,
        at = app.where();
      app.set({ curve: "dissipated_power", contacts: ["", "joint"] });
      return [first, unit, other, hertz, at, lines(app.curves.plotHost),
        app.curves.plotHost.uplot.options.axes[1].label]""")
    first, unit, other, hertz, at, power, label = found
    omega, size = data["omega"].to_numpy(), data["amplitude"]
    assert [unit, hertz] == ["Frequency [rad/s]", "Frequency [Hz]"]
    np.testing.assert_allclose(first[0]["x"], omega)
    near(first[0]["y"], size.sel(dof="b"))
    for line, dof in zip(other[:2], "az", strict=True):
        np.testing.assert_allclose(line["x"], omega / (2 * np.pi))
        near(line["y"], size.sel(dof=dof))
    point = int(np.argmax(size.max("dof").to_numpy()))
    assert at.endswith(" Hz")
    near(number(at.removesuffix(" Hz")), omega[point] / (2 * np.pi))
    assert other[0]["pen"] == "M" + "L" * (len(omega) - 1)
    near(power[0]["y"], data["dissipated_power"].sum("contact"))
    near(power[1]["y"], data["dissipated_power"].sel(contact="joint"))
    assert label.startswith("Dissipated power")
    assert len({line["stroke"] for line in other[:2]}) == 2


def test_rings_and_table_are_the_located_peaks() -> None:
    data = branch().dataset
    at = peak_points(data)
    dofs = [str(data["dof"].to_numpy()[d]) for d in data["peak_dof"].to_numpy()[at]]
    sizes = [float(data["amplitude"][p].sel(dof=d)) for p, d in zip(at, dofs, strict=True)]
    order = np.argsort(sizes)[::-1]
    script = """
      app.set({ dofs: ["a", "b", "z"] });
      const rows = table(app.curves.side), rings = lines(app.curves.plotHost).slice(3);
      click(button(app.curves.side, "z"));
      return [rows, rings, window.slipstick.view()]"""
    rows, rings, view = drawn(script)
    assert rows[0] == ["", "at [rad/s]", "amplitude [length]"]
    assert [row[0] for row in rows[1:]] == [dofs[i] for i in order]
    near([number(row[1]) for row in rows[1:]], data["omega"].to_numpy()[at[order]])
    near([number(row[2]) for row in rows[1:]], np.array(sizes)[order])
    for ring, dof in zip(rings, "abz", strict=True):
        own = at[np.array(dofs) == dof]
        np.testing.assert_allclose(ring["x"], data["omega"].to_numpy()[own])
        assert ring["pen"] == "MA" * len(own)
    highest = max((size, p) for size, p, d in zip(sizes, at, dofs, strict=True) if d == "z")[1]
    assert (view["point"], view["dof"], view["curve"]) == (highest, "z", "amplitude")


def test_stretches_that_are_unstable_are_dashed_and_parts_are_not_joined() -> None:
    count = len(branch())
    off, part = np.zeros(count, dtype=int), np.zeros(count, dtype=int)
    off[4:7], part[10:] = 1, 1
    made = content(unstable=packed(off, "u1"), part=packed(part, "u1"))
    found = drawn(
        """
      const at = (point) => { app.set({ point }); return app.curves.readout.textContent; };
      return [lines(app.curves.plotHost), at(3), at(4), app.curves.legend.textContent, table(app.curves.side)]""",
        made,
    )
    (solid, dashed, *_), stable, unstable, legend, _ = found
    assert solid["pen"][:12] == "MLLLMMMMLLML"  # the pen comes down at 7 again, and anew for the second part
    assert dashed["pen"][:12] == "MMMMLLLLMMMM"
    assert solid["dash"] is None
    assert dashed["dash"]
    assert stable.endswith("· stable")
    assert unstable.endswith("· unstable")
    assert "dashed: unstable" in legend


def test_bands_are_drawn_beside_the_amplitudes_they_are_of() -> None:
    size = branch().dataset["amplitude"].to_numpy()
    bands = {"low": packed(0.9 * size), "high": packed(1.2 * size), "said": "tip.mu ±10 %"}
    found = drawn(
        """const own = [lines(app.curves.plotHost).slice(0, 2), app.curves.legend.textContent];
        app.set({ curve: "mean" });
        return [...own, app.curves.legend.textContent,
          lines(app.curves.plotHost).filter(({ dash }) => dash).length]""",
        content(bands=bands),
    )
    (low, high), said, without, count = found
    near(low["y"], 0.9 * size[:, 1])
    near(high["y"], 1.2 * size[:, 1])
    assert low["pen"] == "M" + "L" * (len(size) - 1)
    assert "dotted: tip.mu ±10 %" in said
    assert "dotted" not in without
    assert count == 0


def test_only_the_response_is_zoomed_by_dragging() -> None:
    script = """
      const cursor = (host) => { const { x, y, drag, bind } = host.uplot.options.cursor; return [x, y, drag.x,
        drag.y, drag.setScale, bind.dblclick()]; };
      const heights = [app.curves.plotHost, app.panels.loop.plot].map((host) => [host.uplot.options.width,
        host.uplot.options.height]);
      return [cursor(app.curves.plotHost), cursor(app.panels.loop.plot), heights]"""
    response, loop, sizes = drawn(script)
    assert response == [True] * 5 + [None]
    assert loop == [True, True, False, False, False, None]  # read under the pointer, not zoomed
    assert sizes == [[800, 400], [800, 300]]  # half as high as wide


def test_keys_move_the_cursor_and_stop_at_the_ends() -> None:
    last = len(branch()) - 1
    script = """
      const host = app.curves.plotHost, at = [], go = (key, more) => { press(host, key, more);
        at.push(window.slipstick.view().point); };
      app.set({ point: 5 });
      go("ArrowRight"); go("ArrowLeft"); go("ArrowRight", { shiftKey: true }); go("PageUp"); go("PageDown");
        go("Home");
      go("ArrowLeft"); go("End"); go("ArrowRight"); go("ArrowLeft", { ctrlKey: true }); go("q");
      return [at, press(host, "Home"), press(host, "q"), host.attributes["aria-valuemax"],
        host.attributes["aria-valuenow"]]"""
    at, taken, left, most, now = drawn(script)
    assert at == [6, 5, 15, 25, 15, 0, 0, last, last, last, last]
    assert (taken, left) == (True, False)
    assert (most, now) == (str(last), "0")


def test_the_readout_says_where_the_cursor_is() -> None:
    data, count = branch().dataset, len(branch())
    script = """
      const say = (change) => { app.set(change); return app.curves.readout.textContent; };
      return [say({ dofs: ["a"], dof: "a", point: 3 }), say({ point: given }), say({ curve: "dissipated_power",
        contacts: [""], point: 3 }),
        say({ contacts: ["joint"], contact: "joint" }), say({ curve: "truncation" })]""".replace(
        "given", str(int(np.flatnonzero(data["kind"].to_numpy() == "peak")[0]))
    )
    plain, peak, total, one, of_none = drawn(script)
    kind = str(data["kind"].to_numpy()[3])
    shown = "" if kind == "regular" else f" · {kind}"
    where = f"point 3 (0 to {count - 1}) · {float(data['omega'][3]):.5g} rad/s"
    said = re.fullmatch(
        rf"{re.escape(where)} · a: amplitude (\S+) · phase of harmonic 1 (\S+) deg{re.escape(shown)}", plain
    )
    near(number(said[1]), float(data["amplitude"][3].sel(dof="a")))
    _, c, s = (float(part) for part in data["displacement"][3].sel(dof="a")[:3])
    near(number(said[2]) % 360, np.degrees(np.arctan2(-s, c)) % 360, 4)  # of cos(tau + phase)
    assert peak.endswith(" · peak")
    power = data["dissipated_power"][3]
    assert total.startswith(
        f"{where} · all contacts: dissipated power {float(power.sum()):.5g} force length/time"[: len(where) + 40]
    )
    near(number(re.search(r"joint: dissipated power (\S+)", one)[1]), float(power.sel(contact="joint")))
    assert " · truncation" in of_none.split("rad/s")[1][:13] or ": " not in of_none


def test_a_click_takes_the_nearest_point_of_the_nearest_curve() -> None:
    script = """
      app.set({ dofs: ["a", "b"], point: 0 });
      const plot = app.curves.plotHost.uplot, line = app.curves.lines[0], i = 40;
      const at = { clientX: plot.valToPos(line.x[i], "x") + 10 + 0.1, clientY: plot.valToPos(line.y[i],
        "y") + 20 + 0.1 };
      app.curves.plotHost.listeners.click({ ...at, target: plot.over });
      const view = window.slipstick.view();
      app.curves.plotHost.listeners.click({ ...at, clientX: 0, target: app.curves.plotHost });
      const [{ rule, dot }] = app.curves.cursors;
      return [line.name, view, window.slipstick.view(), parseFloat(rule.style.left) - plot.valToPos(line.x[i], "x"),
        dot.style.background, line.stroke, rule.hidden]"""
    name, view, again, off, colour, stroke, hidden = drawn(script)
    assert (view["point"], view["dof"]) == (40, name)
    assert again == view  # outside of the plot nothing is chosen
    assert off == pytest.approx(0.0, abs=1e-9)
    assert colour == stroke
    assert not hidden


def test_arrows_go_from_curve_to_curve_and_from_contact_to_contact() -> None:
    script = """
      const host = app.curves.plotHost, seen = [], go = (key) => { press(host, key);
        const v = window.slipstick.view(); seen.push([v.dof, v.contact, v.point, v.result]); };
      app.set({ dofs: ["a", "b", "z"], dof: "a", point: 7, contact: "joint" });
      go("ArrowDown"); go("ArrowUp"); go("ArrowUp");
      app.set({ dofs: ["a"], dof: "a" });
      go("ArrowDown"); go("ArrowUp"); go("ArrowUp");
      return seen"""
    found = drawn(script)
    assert [row[0] for row in found[:3]] == ["b", "a", "z"]
    assert [row[1] for row in found[3:]] == ["tip", "joint", "stop"]
    assert {row[2] for row in found} == {7}


def test_chips_show_and_hide_curves_and_leave_one() -> None:
    script = """
      const seen = [], go = (name) => { click(button(app.curves.legend, name)); const v = window.slipstick.view();
        seen.push([v.dofs, v.dof]); };
      app.set({ dofs: ["b"], dof: "b" });
      go("a"); go("b"); go("a");
      const log = (axis) => { click(button(app.curves.tools, `log ${axis}`)); return window.slipstick.view().log; };
      return [seen, log("y"), log("x"), log("y"), app.curves.plotHost.uplot.options.scales.x.distr,
        app.curves.plotHost.uplot.options.scales.y.distr,
        button(app.curves.legend, "a").attributes["aria-pressed"], button(app.curves.legend,
          "b").attributes["aria-pressed"]]"""
    seen, *logs, x, y, pressed, other = drawn(script)
    assert seen == [[["b", "a"], "a"], [["a"], "a"], [["a"], "a"]]
    assert logs == ["y", "xy", "x"]
    assert (x, y) == (3, 1)
    assert (pressed, other) == ("true", "false")


def test_on_logarithmic_axes_the_pen_is_lifted_where_nothing_is_positive() -> None:
    script = """
      const path = (line) => linePath(line)({ valToPos: (v) => v }).stroke.steps.map(([s]) => s).join("");
      const x = [-1, 1, 2, 3, 4], y = [1, 2, 0, 3, NaN];
      const bars = barPath({ x: [0, 1, 2], y: [1, -2, NaN], half: 0.25 })({ valToPos: (v) => v,
        scales: { y: { min: -3 } } }).fill.steps;
      const rings = ringPath({ x: [0, 1], y: [0, 2], log: "y" })({ valToPos: (v) => v }).fill.steps;
      return [path({ x, y }), path({ x, y, log: "y" }), path({ x, y, log: "xy" }), path({ x, y, pen: [0, 1, 0, 1,
        1] }), bars, rings]"""
    plain, log_y, both, lifted, bars, rings = drawn(script)
    assert [plain, log_y, both, lifted] == ["MLLL", "MLM", "MM", "MLML"]
    assert bars == [["R", -0.25, 0, 0.5 if 0.5 > 1 else 1, 1], ["R", 0.75, -2, 1, 2]]
    assert rings[0][:3] == ["M", 1 + 3.6, 2]
    assert len(rings) == 2


def test_lines_of_few_points_are_cubics_through_all_of_them() -> None:
    """Slopes over arclength as scipy has them; lines where the pen is lifted, at a corner, and between two points."""
    rng = np.random.default_rng(2)
    places = np.stack([np.cumsum(rng.uniform(-10.0, 50.0, 12)), 100.0 * rng.normal(size=12)], axis=1)
    corner, pen = [int(i == 4) for i in range(12)], [int(i != 9) for i in range(12)]
    steps, straight = drawn(f"""
      const places = {places.tolist()}, smooth = {corner}, pen = {pen};
      return [stepsOf(places, {{ smooth, pen }}), stepsOf(places, {{ pen }})]""")
    assert "".join(step for step, *_ in steps) == "MCCCCCCCCMCC"
    assert "".join(step for step, *_ in straight) == "MLLLLLLLLMLL"
    np.testing.assert_allclose([step[-2:] for step in steps], places, rtol=0, atol=0)
    for first, last in ((0, 4), (4, 8), (9, 11)):
        own = places[first : last + 1]
        s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(own, axis=0).T))])
        slope = PchipInterpolator(s, own).derivative()(s)
        third = np.diff(s)[:, None] / 3.0
        wanted = np.hstack([own[:-1] + third * slope[:-1], own[1:] - third * slope[1:]])
        np.testing.assert_allclose([step[1:5] for step in steps[first + 1 : last + 1]], wanted, rtol=1e-12)


@pytest.mark.parametrize("analysis, smooth", [("track", True), ("parameter", False)])
def test_tracked_peaks_are_drawn_smoothly(analysis: str, smooth: bool) -> None:
    data = branch().dataset.assign_attrs(analysis=analysis).assign(parameter=branch().dataset["omega"])
    made = content_of(ss.Branch(data, branch().outcome), "first", contacts=3, dofs=3)
    pens = drawn("return lines(app.curves.plotHost).map((line) => line.pen).filter((pen) => pen?.length > 9)", made)
    assert pens
    assert all(("C" in pen) is smooth for pen in pens)


def test_two_results_are_named_and_the_cursor_goes_to_the_same_place() -> None:
    other = content_of(blocks.branch(), "second", contacts=2, dofs=2)
    data = branch().dataset["omega"].to_numpy()
    thinned = content_of(
        ss.Branch(branch().dataset.isel(point=slice(None, None, 3)), branch().outcome), "thin", contacts=9, dofs=9
    )
    script = """
      app.set({ dofs: ["a"], dof: "a", result: 0, point: 20 });
      press(app.curves.plotHost, "ArrowDown");
      const v = window.slipstick.view();
      return [v.result, app.result.at("omega")[v.point], app.curves.readout.textContent, app.curves.legend.textContent,
        app.panels.title.textContent, $("head").textContent,
        table(app.curves.side)[0]]"""
    result, at, said, legend, title, head, columns = drawn(script, content(), thinned, other)
    assert result == 1
    assert at == data[::3][np.abs(data[::3] - data[20]).argmin()]
    assert said.endswith(" · thin")
    assert "first · a" in legend
    assert title.startswith("thin, at ")
    assert all(name in head for name in ("first", "thin", "second"))
    assert columns == ["result", "", "at [rad/s]", "amplitude [length]"]


# contacts


def test_contacts_are_ranked_by_their_power() -> None:
    data = branch().dataset
    script = """
      const rows = table($("contacts")), meters = classed($("contacts"),
        "meter-full").map((bar) => Number(bar.attributes.width)), words = said($("contacts"));
      const bars = tagged($("contacts"),
        "svg").filter((bar) => bar.attributes.role === "img")
        .map((bar) => bar.children.map((rect) => [Number(rect.attributes.x), Number(rect.attributes.width)]));
      click(button($("contacts"), "joint"));
      return [window.slipstick.view().point, rows, meters, words, bars, window.slipstick.view().contact,
        classed($("contacts"), "chosen").length, button($("contacts"), "joint").attributes["aria-pressed"]]"""
    point, (head, *rows), meters, words, bars, chosen, marked, pressed = drawn(script)
    power = data["dissipated_power"][point]
    order = [str(name) for name in power["contact"].to_numpy()[np.argsort(-power.to_numpy())]]
    assert head[:4] == ["", "contact", "power [force length/time]", "share"]
    assert [row[:2] for row in rows] == [[str(i + 1), name] for i, name in enumerate(order)]
    total = float(power.sum())
    for row, name, meter in zip(rows, order, meters, strict=True):
        own = float(power.sel(contact=name))
        near(number(row[2]), own if abs(own) > 1e-9 * total else 0.0, 4)  # rounding is shown as none
        assert row[3] == f" {round(100 * own / total)} %"
        assert meter == pytest.approx(90 * own / total, rel=1e-6)
    assert [row[4] for row in rows] == ["0.3", "0.4", "–"]
    for name, word, bar in zip(order[:2], words, bars, strict=True):
        parts = dict.fromkeys(("stick", "slip", "slip+", "slip-", "separation"), 0.0)
        for start, end, state in branch().states(point)[name]:
            parts[state] += (end - start) / (2 * np.pi)
        spoken = {"slip+": "slip +", "slip-": "slip −"}
        assert word == ", ".join(f"{spoken.get(s, s)} {round(100 * p)} %" for s, p in parts.items() if p > 0)
        np.testing.assert_allclose([width for _, width in bar], 120 * np.array(list(parts.values())), atol=1e-4)
        np.testing.assert_allclose(
            [left for left, _ in bar], 120 * np.cumsum([0, *list(parts.values())[:-1]]), atol=1e-4
        )
    assert (chosen, marked, pressed) == ("joint", 1, "true")


def test_what_is_left_out_is_told_with_its_power() -> None:
    data = branch().dataset
    script = """return [window.slipstick.view().point, $("contacts").textContent, app.curves.legend.textContent,
      (app.set({ curve: "dissipated_power" }), app.curves.legend.textContent)]"""
    point, contacts, dofs, power = drawn(script, content(1))
    assert "1 of 3: the dofs that move most; more with slipstick report --dofs 3" in dofs
    told = re.search(
        r"1 of 3: the contacts that dissipate most; .*--contacts 3; the others dissipate (\S+) together", contacts
    )
    kept = data["dissipated_power"].max("point")
    rest = data["dissipated_power"][point].sum() - data["dissipated_power"][point].sel(contact=kept.idxmax("contact"))
    near(number(told[1]), float(rest))
    assert "--contacts 3" in power


def test_of_many_contacts_the_first_dozen_until_all_are_wanted() -> None:
    made = content()
    script = """
      const own = app.result, names = Array.from({ length: 15 }, (_, i) => `c${i}`);
      own.contacts = names;
      own.values = (key, name) => (name === "" ? [120] : [names.indexOf(name) + 1]);
      own.element = () => null;
      app.view.point = 0;
      app.drawPoint();
      const few = table($("contacts")).length - 1, rows = classed($("point"), "strip-row").length;
      click(button($("contacts"), "all 15 contacts"));
      const many = table($("contacts")).length - 1, first = table($("contacts"))[1][1];
      click(button($("contacts"), "the first 12"));
      return [few, many, table($("contacts")).length - 1, first, rows, window.slipstick.view().all]"""
    assert drawn(script, made) == [12, 15, 12, "c14", 12, False]


def test_states_are_told_apart_by_their_patterns() -> None:
    """Hatched one way and the other, dotted, plain: also without colours."""
    script = """
      const turns = Object.fromEntries(tagged($("point"), "pattern").map(({ attributes: a }) => [a.id,
        a.patternTransform ?? null]));
      const key = app.panels.states.note, fills = tagged(key, "rect").map(({ attributes: a }) => a.fill ?? a.class);
      return [turns, fills, key.textContent]"""
    turns, fills, words = drawn(script)
    assert turns == {
        "pattern-slip-plus": "rotate(45)", "pattern-slip-minus": "rotate(-45)", "pattern-separation": None,
    }  # fmt: skip
    assert fills == ["state-stick", *(f"url(#pattern-{name})" for name in ("slip-plus", "slip-minus", "separation"))]
    key, _, told = words.partition("tip: ")
    assert key == "● stick+ slip +− slip −○ separation"
    spans = re.findall(r"(stick|slip [+−]|separation) (\S+) to (\S+) rad", told)
    truth = branch().states(int(np.argmax(branch().dataset["amplitude"].max("dof").to_numpy())))["tip"]
    spoken = {"slip+": "slip +", "slip-": "slip −"}
    assert [state for state, _, _ in spans] == [spoken.get(state, state) for _, _, state in truth]
    truth = [(start % (2 * np.pi), start % (2 * np.pi) + end - start) for start, end, _ in truth]
    np.testing.assert_allclose([(float(a), float(b)) for _, a, b in spans], truth, atol=0.006)  # three digits are said
    badges = drawn(
        """return tagged(letter("+", 3, 4, "slip+"), "g").concat(tagged(letter("○", 0, 0, "separation"), "g"))
        .map((g) => g.children.map(({ attributes: a }) => [a.class, a.cx ?? a.x, a.cy ?? a.y]))"""
    )
    assert badges[0] == [["badge-slip-plus", "3", "4"], ["letter letter-slip-plus", "3", "8"]]
    assert badges[1][0][0] == "badge-separation"


def test_the_strip_shows_each_state_where_and_as_long_as_it_lasts() -> None:
    script = """
      const rows = classed($("point"), "strip-row").map((row) => ({ name: row.attributes["data-contact"],
        label: row.attributes["aria-label"],
        rects: tagged(row, "rect").filter((rect) => rect.attributes["data-state"])
          .map(({ attributes: a }) => [Number(a.x), Number(a.width), a["data-state"]]),
        frame: Number(classed(row, "frame")[0].attributes.x), width: Number(classed(row,
          "frame")[0].attributes.width), letters: tagged(row, "g").length - 1, y: Number(classed(row,
        "frame")[0].attributes.y) }));
      const [, tip] = classed($("point"), "strip-row");
      const taken = press(tip, "Enter"), view = window.slipstick.view().contact;
      return [window.slipstick.view().point, rows, taken, view, press(classed($("point"), "strip-row")[0], "x"),
        tagged($("point"), "text").filter((t) => t.attributes.class === "tick").map((t) => [t.textContent,
      Number(t.attributes.x)])]"""
    point, rows, taken, view, left, ticks = drawn(script)
    assert [row["name"] for row in rows] == ["joint", "tip", "stop"]
    assert (taken, view, left) == (True, "tip", False)
    for row in rows[:2]:
        truth = []
        for start, end, state in branch().states(point)[row["name"]]:
            a, b = start % (2 * np.pi), start % (2 * np.pi) + end - start
            truth += [(a, min(b, 2 * np.pi), state)] + ([(0.0, b - 2 * np.pi, state)] if b > 2 * np.pi + 1e-9 else [])
        truth.sort()
        assert [state for _, _, state in row["rects"]] == [state for _, _, state in truth]
        scale = row["width"] / (2 * np.pi)
        np.testing.assert_allclose(
            [x for x, _, _ in row["rects"]], [row["frame"] + scale * a for a, _, _ in truth], atol=0.01
        )
        wide = [max(scale * (b - a), 0.5) for a, b, _ in truth]
        np.testing.assert_allclose([width for _, width, _ in row["rects"]], wide, atol=0.01)
        assert row["letters"] == sum(width > 18 for width in wide)
        assert row["label"].count(" from ") == len(truth)
    assert rows[2]["label"] == "stop: its law has no such states"
    assert np.all(np.diff([row["y"] for row in rows]) > 0)
    frame = rows[0]
    np.testing.assert_allclose([x for _, x in ticks], frame["frame"] + frame["width"] * np.linspace(0, 1, 5), atol=1e-6)


# the point


def covers(pieces: list[dict[str, Any]], x: np.ndarray, y: np.ndarray) -> None:
    """Pieces of a path, a state each, lie on it and leave out none of it."""
    points = np.concatenate([np.array([piece["x"], piece["y"]], dtype=float).T for piece in pieces])
    points, path = points[np.isfinite(points).all(axis=1)], np.column_stack([x, y])
    size = np.abs(path).max()
    begin, chord = path[:-1], np.diff(path, axis=0)
    length = np.maximum(np.sum(chord**2, axis=1), np.finfo(float).tiny)
    along = np.einsum("pse,se->ps", points[:, None] - begin, chord) / length
    nearest = begin + np.clip(along, 0.0, 1.0)[..., None] * chord
    assert np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1).max() < 2e-3 * size
    assert np.linalg.norm(path[:, None] - points, axis=2).min(axis=1).max() < 0.03 * size


def test_a_contact_in_a_plane_has_the_path_of_its_force_and_of_its_motion() -> None:
    """Circles, force and the vibration beside it at one scale along both axes; states."""
    made, script = (
        planar_branch(),
        """
      app.set({ point: 2, contact: "foot" });
      const scale = (host) => ["x", "y"].map((axis) => host.uplot.scales[axis]).map(({ min, max }) => max - min);
      const of = () => ["loop", "plane"].map((key) => [lines(app.panels[key].plot), scale(app.panels[key].plot)]);
      const seen = { title: $("loop-title").textContent, drawn: of(), note: app.panels.loop.note.textContent };
      seen.states = said(app.panels.states.plot).find((text) => text.startsWith("foot"));
      app.set({ contact: "heel" }); seen.heel = lines(app.panels.loop.plot).length;
      app.set({ contact: "joint" }); seen.joint = [$("loop-title").textContent, app.panels.plane.card.hidden];
      return seen;""",
    )
    found = drawn(script, content_of(made, "first", contacts=3, dofs=3))
    first, second = (made.loop(2, "foot", samples=181, port=port) for port in ("tangential", "second"))
    ((force_lines, force_scale), (motion_lines, motion_scale)), size = found["drawn"], first["limit"].max()
    assert len({line["stroke"] for line in force_lines[2:-1]}) == 2  # stick and slip, after two circles, before the dot
    radii = [np.hypot(line["x"], line["y"]) for line in force_lines[:2]]
    np.testing.assert_allclose([r.max() for r in radii], [first["limit"].min(), size], rtol=1e-12)
    covers(force_lines[2:-1], first["force"], second["force"])
    covers(motion_lines[:-1], first["motion"], second["motion"])
    for width, height in (force_scale, motion_scale):
        assert width / (800 - 60) == pytest.approx(height / (340 - 60))
    assert found["title"] == "Friction force in the plane"
    assert "dashed: limit μ N 0 to" in found["note"]
    assert "slip from" in found["states"]
    assert found["heel"] == 3
    assert found["joint"] == ["Friction loop", True]


def test_the_loop_and_its_energy_are_those_of_python() -> None:
    script = """
      const read = () => lines(app.panels.loop.plot), seen = {};
      app.set({ contact: "tip", point: 30, loop: "total" });
      seen.total = read(); seen.note = app.panels.loop.note.textContent;
      app.set({ loop: "motion" });
      seen.motion = read(); seen.label = app.panels.loop.plot.uplot.options.axes[0].label;
      app.set({ contact: "stop" });
      seen.spring = read(); seen.spring_note = app.panels.loop.note.textContent;
      return seen"""
    seen = drawn(script)
    loop = branch().loop(30, "tip")
    for over in ("total", "motion"):
        limit, under, *states = seen[over]
        x, y = (np.concatenate([np.array(line[axis], dtype=float) for line in states]) for axis in "xy")
        known = np.isfinite(x)
        assert np.ptp(x[known]) == pytest.approx(np.ptp(loop[over]), rel=2e-3)
        assert y[known].max() == pytest.approx(loop["friction"].max(), rel=2e-3)
        assert y[known].min() == pytest.approx(loop["friction"].min(), rel=2e-3)
        assert max(limit["y"]) == pytest.approx(loop["limit"].max(), rel=2e-3)
        np.testing.assert_allclose(under["y"], -np.array(limit["y"]))
        np.testing.assert_allclose(limit["x"][0], loop[over][0], atol=1e-6)
    power, omega = (
        float(branch().dataset["dissipated_power"][30].sel(contact="tip")),
        float(branch().dataset["omega"][30]),
    )
    said = re.match(
        r"tip · power (\S+) .*energy a period (\S+) .* μ 0.3",
        seen["note"].replace("· energy", " energy").replace("· μ", " μ"),
    )
    near(number(said[1]), power)
    near(number(said[2]), power * 2 * np.pi / omega)
    assert seen["label"].startswith("Vibration x")
    (spring,) = seen["spring"]
    x = np.array(spring["x"])
    cubic = 2.0 * x**3
    assert np.abs(np.array(spring["y"]) - cubic).max() < 0.05 * np.abs(cubic).max()  # five harmonics of it
    assert "force and motion as the harmonics kept" in seen["spring_note"]


def test_one_period_and_harmonics_are_those_of_python() -> None:
    script = """
      app.set({ dofs: ["a", "z"], dof: "z", contact: "tip", point: 30 });
      const seen = { motion: lines(app.panels.history.plot), names: app.panels.history.note.textContent,
        spectrum: lines(app.panels.spectrum.plot) };
      app.set({ history: "force", spectrum: "force" });
      Object.assign(seen, { force: lines(app.panels.history.plot), sizes: lines(app.panels.spectrum.plot),
        label: app.panels.history.plot.uplot.options.axes[1].label });
      app.set({ history: "normal" });
      seen.normal = lines(app.panels.history.plot);
      app.set({ contact: "stop" });
      Object.assign(seen, { kind: lines(app.panels.history.plot), left: tagged(app.panels.history.tools,
        "button").map((b) => b.textContent), other: lines(app.panels.spectrum.plot) });
      app.set({ history: "force" });
      seen.spring = lines(app.panels.history.plot);
      return seen"""
    seen = drawn(script)
    made, tau = branch(), np.linspace(0, 2 * np.pi, 721)
    X = made.dataset["displacement"][30]
    for line, dof in zip(seen["motion"], "za", strict=True):
        truth = X.sel(dof=dof).to_numpy() @ made.harmonics.H_minus(tau).T
        np.testing.assert_allclose(line["x"], tau, atol=1e-12)
        np.testing.assert_allclose(line["y"], truth, atol=2e-6 * np.abs(truth).max())
    assert seen["names"] == "za"
    loop = made.loop(30, "tip")
    friction, limit, under = seen["force"]
    np.testing.assert_allclose(friction["y"], loop["friction"], atol=1e-6 * loop["limit"].max())
    np.testing.assert_allclose(limit["y"], loop["limit"], atol=1e-6 * loop["limit"].max())
    np.testing.assert_allclose(under["y"], -loop["limit"], atol=1e-6 * loop["limit"].max())
    np.testing.assert_allclose(0.3 * np.array(seen["normal"][0]["y"]), loop["limit"], atol=1e-6 * loop["limit"].max())
    assert seen["label"].startswith("Friction force")
    for group, (line, dof) in enumerate(zip(seen["spectrum"], "za", strict=True)):
        x = X.sel(dof=dof).to_numpy()
        sizes = np.array([abs(x[0]), *np.hypot(x[1::2], x[2::2])])
        drawn_ = np.array(line["y"], dtype=float)
        np.testing.assert_allclose(
            drawn_[np.isfinite(drawn_)], sizes[np.isfinite(drawn_)], atol=3e-7 * sizes.max()
        )  # three bytes
        np.testing.assert_allclose(line["x"], np.arange(6) + (2 * group - 1) * 0.18)
    force = loop["friction"][:-1]
    sizes = np.abs(np.fft.rfft(force)[:6]) * np.array([1, 2, 2, 2, 2, 2]) / 720
    np.testing.assert_allclose(seen["sizes"][0]["y"], sizes, rtol=2e-3)
    assert seen["left"] == ["motion", "force"]  # of a spring, which has no friction
    assert len(seen["kind"]) == 2  # the spring has no normal load: motions again
    (spring,) = seen["spring"]
    a = X.sel(dof="a").to_numpy() @ made.harmonics.H_minus(tau).T
    assert np.abs(np.array(spring["y"]) - 2.0 * a**3).max() < 0.05 * np.abs(2.0 * a**3).max()
    assert len(seen["other"][0]["y"]) == 6


def test_choices_of_the_point_change_what_is_shown() -> None:
    script = """
      change($("at-contact"), "stop"); change($("at-dof"), "z");
      const pressed = (host) => tagged(host,
        "button").filter((b) => b.attributes["aria-pressed"] === "true").map((b) => b.textContent);
      const before = pressed(app.panels.spectrum.tools);
      click(button(app.panels.spectrum.tools, "force"));
      const v = window.slipstick.view();
      return [v.contact, v.dof, v.spectrum, before, pressed(app.panels.spectrum.tools), app.panels.loop.card.hidden,
        app.panels.states.card.hidden, location.hash]"""
    contact, dof, spectrum, before, after, loop, states, address = drawn(script)
    assert (contact, dof, spectrum) == ("stop", "z", "force")
    assert (before, after) == (["motion"], ["force"])
    assert (loop, states) == (False, False)
    assert "at-contact=stop" in address
    assert "spectrum=force" in address


def test_a_result_without_points_or_contacts_hides_what_it_has_not() -> None:
    none = ss.Branch(branch().dataset.isel(point=slice(0, 0)), branch().outcome)
    found = drawn(
        """return [$("point").hidden, $("contacts").hidden, $("response").textContent, app.where()]""",
        content_of(none, "none", contacts=9, dofs=9),
    )
    assert found == [True, True, "ResponseNo point was found, so there is no curve.", "no point"]


def test_the_head_says_how_it_ended_and_where_it_comes_from() -> None:
    data = branch().dataset
    made = content(warnings=["mind this"], case="format = 1", case_file="c.toml", orders=[1, 3, 5])
    early = content(outcome={"name": "STALLED", "ok": False, "text": "stopped early"}, orders=list(range(6)))
    text, facts, verdicts, pre = drawn(
        """return [$("head").textContent, classed($("head"), "facts").map((f) => f.textContent),
        classed($("head"), "verdict").map((v) => [v.attributes.class, v.textContent]),
        tagged($("head"), "pre")[0].textContent]""",
        made,
        early,
    )
    assert "Warning: mind this" in text
    assert pre == "format = 1"
    iterations = int(data["newton_iterations"].sum())
    assert facts[0].startswith(f"{len(branch())} points · {iterations} Newton iterations · ")
    assert facts[0].endswith("harmonics 1, 3, 5 · 3 contacts · c.toml")
    assert "harmonics 0..5" in facts[1]
    assert verdicts[0][0] == "verdict good"
    assert verdicts[1] == ["verdict early", "! stopped early"]


def test_an_address_opens_the_page_where_it_was_left() -> None:
    script = "app.set({ point: 12, dof: 'z', dofs: ['z'], curve: 'mean', turn: [10, 30] }); return location.hash"
    address = drawn(script)
    found = drawn("return [window.slipstick.view(), app.curves.plotHost.uplot.options.axes[1].label]", address=address)
    assert (found[0]["point"], found[0]["dof"], found[0]["dofs"], found[0]["curve"], found[0]["turn"]) == (
        12,
        "z",
        ["z"],
        "mean",
        [10, 30],
    )
    moved = drawn(
        "location.hash = '#point=3&turn=400,-200'; heard.hashchange();"
        "return [window.slipstick.view(), app.curves.plotHost.attributes['aria-valuenow']]"
    )
    assert (moved[0]["point"], moved[0]["turn"], moved[1]) == (3, [40, -90], "3")


# the shape


@cache
def shaped() -> dict[str, Any]:
    return content_of(blocks.branch(), "block", contacts=2, dofs=2)


def test_the_shape_is_magnified_to_a_share_of_its_size() -> None:
    made = blocks.branch()
    deflection = deflection_of(made)
    nodes = np.asarray(deflection.skin.nodes)
    script = """
      app.set({ point: 3 });
      const body = app.body;
      body.tau = 0.7; body.paint();
      return { largest: body.largest, extent: body.extent, u: [...body.displacement(0.7)],
        note: body.note.textContent, calls: body.canvas.context.calls.length, hidden: $("body").hidden }"""
    found = drawn(script, shaped())
    motion = deflection.at(3) @ made.harmonics.H_minus(np.linspace(0, 2 * np.pi, 25)).T
    largest = np.linalg.norm(motion, axis=1).max()
    assert found["largest"] == pytest.approx(largest, rel=5e-3)
    np.testing.assert_allclose(found["extent"]["middle"], (nodes.min(axis=0) + nodes.max(axis=0)) / 2, rtol=1e-6)
    size = np.linalg.norm(np.ptp(nodes, axis=0))
    assert found["extent"]["size"] == pytest.approx(size, rel=1e-6)
    truth = deflection.at(3) @ made.harmonics.H_minus(0.7)
    np.testing.assert_allclose(np.reshape(found["u"], (-1, 3)), truth, atol=5e-3 * np.abs(truth).max())
    magnified = float(re.search(r"magnified (\S+) times", found["note"])[1])
    assert magnified == pytest.approx(0.08 * size / largest, rel=0.06)  # two digits are said
    assert f"phase {round(360 * 0.7 / (2 * np.pi))}°" in found["note"]
    assert not found["hidden"]


@cache
def worn() -> dict[str, Any]:
    with warnings.catch_warnings(action="ignore", category=ss.SlipstickWarning):
        return content_of(blocks.worn(), "worn", contacts=2, dofs=2)


def test_worn_depth_is_a_bar_for_each_contact_and_a_colour_of_the_body() -> None:
    """At the last cycle to begin with; on the scale of all cycles; the motion is a click away."""
    script = """
      const { panels, body } = app, view = () => window.slipstick.view();
      const shown = () => ({ bars: lines(panels.worn.plot), scale: panels.worn.plot.uplot.scales.y,
        note: panels.worn.note.textContent, depths: [...body.values] });
      const last = { point: view().point, turn: view().turn, ...shown(), said: body.note.textContent };
      app.set({ point: 1 });
      const second = shown();
      click(button($("body"), "motion"));
      return { last, second, moving: [body.values, body.note.textContent, location.hash] }"""
    found, made = drawn(script, worn()), blocks.worn()
    depth, load = made.dataset.worn_depth.values, made.dataset.normal_load.values
    assert found["last"]["point"] == len(made) - 1
    assert found["last"]["turn"] == worn()["shape"]["on"]["turn"]
    for point, shown in ((len(made) - 1, found["last"]), (1, found["second"])):
        contact = re.match(r"(c\d) · worn depth (\S+?)(?: | · )", shown["note"])
        assert contact is not None
        c = ["c1", "c2"].index(contact[1])
        near(number(contact[2]), depth[point, c])
        other, own = shown["bars"]
        assert (other["x"], own["x"]) == ([1 - c], [c])
        np.testing.assert_array_equal([other["y"][0], own["y"][0]], depth[point, [1 - c, c]])
        assert shown["scale"]["min"] == 0.0
        assert depth.max() < shown["scale"]["max"] < 1.1 * depth.max()
        near(number(re.search(r"normal load (\S+)", shown["note"])[1]), load[point, c])  # type: ignore[index]
        np.testing.assert_allclose(sorted(set(shown["depths"])), sorted(set(depth[point])), atol=1e-5 * depth.max())
    assert number(re.search(r"worn depth 0(\S+?)(?:phase|$)", found["last"]["said"])[1]) == pytest.approx(  # type: ignore[index]
        depth.max(), rel=1e-3
    )
    assert found["moving"][0] is None
    assert "worn" not in found["moving"][1]
    assert "colour=motion" in found["moving"][2]


def test_there_are_no_bars_where_nothing_wears() -> None:
    script = 'return [app.panels.worn.card.hidden, button($("body"), "worn depth") ?? null]'
    assert drawn(script, shaped()) == [True, None]


def test_contacts_colour_the_body_and_are_looked_at() -> None:
    """Motion to begin with; the force of each contact round it, on the scale of the branch, from where it is seen."""
    script = """
      const body = app.body, buttons = () => $("body").querySelectorAll("button");
      const pressed = () => buttons().find((b) => b.attributes["aria-pressed"] === "true").textContent;
      const first = [pressed(), body.values, window.slipstick.view().turn];
      app.set({ point: 2 });
      click(button($("body"), "mean normal force"));
      const force = [pressed(), [...body.values], window.slipstick.view().turn, body.note.textContent, location.hash];
      app.set({ turn: [5, 6] });
      click(button($("body"), "motion"));
      click(button($("body"), "dissipated power"));
      return { first, force, last: [pressed(), [...body.values], window.slipstick.view().turn] }"""
    found, made = drawn(script, shaped()), blocks.branch()
    assert found["first"] == ["motion", None, [-35, 20]]
    force, power = made.dataset.normal_force.values[:, :, 0], made.dataset.dissipated_power.values
    pressed, values, turn, note, address = found["force"]
    assert (pressed, turn) == ("mean normal force", shaped()["shape"]["on"]["turn"])
    assert "colour=normal_force" in address
    np.testing.assert_allclose(sorted(set(values) - {0.0}), sorted(force[2]), atol=1e-5 * force.max())
    assert number(re.search(r"mean normal force 0(\S+?)(?:phase|$)", note)[1]) == pytest.approx(force.max(), rel=1e-3)  # type: ignore[index]
    pressed, values, turn = found["last"]
    assert (pressed, turn) == ("dissipated power", [5, 6])
    np.testing.assert_allclose(sorted(set(values) - {0.0}), sorted(power[2]), atol=1e-5 * power.max())


def test_the_eye_sees_the_body_turned_and_not_distorted() -> None:
    script = """
      const nodes = Float64Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]), extent = { middle: [0, 0, 0], size: 1 };
      const look = (turn, u = null) => [...seen(nodes, u, 2, extent, turn, 10, 100, 60)];
      return [look([0, 0]), look([0, 90]), look([90, 0]), look([30, 20]), look([0, 0], Float64Array.from([0, 0, 0,
        0.5, 0, 0, 0, 0, 0, 0, 0, 0]))]"""
    front, above, side, askew, moved = (np.reshape(view, (4, 3)) for view in drawn(script, shaped()))
    np.testing.assert_allclose(
        front, [[50, 30, 0], [60, 30, 0], [50, 30, -10], [50, 20, 0]], atol=1e-9
    )  # z is up, y away
    np.testing.assert_allclose(above, [[50, 30, 0], [60, 30, 0], [50, 20, 0], [50, 30, 10]], atol=1e-9)
    np.testing.assert_allclose(side, [[50, 30, 0], [50, 30, -10], [40, 30, 0], [50, 20, 0]], atol=1e-9)
    axes = (askew[1:] - askew[0]) / 10
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(moved[1], [70, 30, 0], atol=1e-9)  # twice 0.5 further


def test_only_faces_that_look_at_the_eye_are_painted_the_nearest_last() -> None:
    script = """
      const p = [0, 0, 0, 0, 10, 0, 10, 0, 0, 0, 0, 5, 0, 10, 5, 10, 0, 5], triangles = Uint32Array.from([3, 4, 5,
        0, 1, 2, 0, 2, 1]);
      const ctx = new Drawing();
      faces(ctx, p, triangles, (i) => (i < 3 ? 0 : 1));
      const colours = ctx.calls.filter(([name]) => name === "= fillStyle").map(([, value]) => value);
      return [facing(p, 0, 1, 2), facing(p, 0, 2, 1), seenOf(p, triangles).length, colours, lightOf(p, 0, 1, 2),
        lightOf([0, 0, 0, 0, 0, 9, 9, 0, 0], 0, 1, 2), rampAt(0), rampAt(1), rampAt(2), rampAt(-1), rampAt(0.5),
      rampAt(0.125),
      ...["moveTo", "lineTo", "closePath", "fill",
        "stroke"].map((call) => ctx.calls.filter(([c]) => c === call).length)]"""
    front, back, count, colours, light, dim, low, high, over, under, middle, between, *calls = drawn(script, shaped())
    assert front == -back == 100
    assert count == 2
    assert colours == ["rgb(96,92,156)", "rgb(253,231,37)"]  # the far one first
    assert light == 1.0
    assert dim == pytest.approx(0.62)
    assert low == under == [96, 92, 156]
    assert high == over == [253, 231, 37]
    assert middle == [36, 155, 150]
    assert between == [79, 102, 160.5]
    assert calls == [2, 4, 2, 2, 2]


def test_the_body_is_turned_by_keys_and_by_dragging() -> None:
    script = """
      const body = app.body, canvas = body.canvas, turns = [], note = () => turns.push(window.slipstick.view().turn);
      press(canvas, "ArrowRight"); note(); press(canvas, "ArrowUp"); note(); press(canvas, "ArrowLeft"); note();
        press(canvas, "ArrowDown"); note();
      canvas.listeners.pointermove({ clientX: 5, clientY: 5, pointerId: 1 }); note();
      canvas.listeners.pointerdown({ clientX: 10, clientY: 10, pointerId: 1 });
      canvas.listeners.pointermove({ clientX: 30, clientY: 400, pointerId: 1 }); note();
      canvas.listeners.pointermove({ clientX: 99, clientY: 99, pointerId: 2 }); note();
      const still = body.playing; press(canvas, " ");
      body.phase.value = 90; body.phase.listeners.input();
      const stopped = body.playing;
      body.size.value = 3; body.size.listeners.input();
      return [turns, still, stopped, body.tau, body.factor, press(canvas, "q"), location.hash]"""
    turns, still, stopped, tau, factor, taken, address = drawn(script, shaped())
    assert turns == [[-30, 20], [-30, 25], [-35, 25], [-35, 20], [-35, 20], [-25, 90], [-25, 90]]
    assert (still, stopped, taken) == (False, False, False)  # motion is reduced where the reader asks for it
    assert tau == pytest.approx(np.pi / 2)
    assert factor == pytest.approx(2.0)
    assert "turn=-25%2C90" in address


def test_nothing_is_painted_where_there_is_no_room_or_no_shape() -> None:
    script = """
      const body = app.body, count = () => body.canvas.context.calls.length, before = count();
      body.canvas.clientWidth = 0; body.paint();
      const hidden = count();
      body.canvas.clientWidth = 300; body.paint();
      const shown = count(), width = body.canvas.width;
      body.shape = null; body.paint();
      return [before === hidden, shown > hidden, count() === shown, width]"""
    assert drawn(script, shaped()) == [True, True, True, 300]


def test_a_page_that_becomes_wider_is_drawn_once_it_stays_so() -> None:
    script = """
      const queue = new Map(); let next = 1, drawn = 0;
      globalThis.setTimeout = (f) => { queue.set(next, f); return next++; };
      globalThis.clearTimeout = (i) => queue.delete(i);
      app.curves.draw = () => { drawn += 1; };
      heard.resize();
      const same = queue.size;
      innerWidth = 900; heard.resize(); innerWidth = 800; heard.resize(); heard.resize();
      const waiting = queue.size;
      queue.forEach((f) => f());
      return [same, waiting, drawn]"""
    assert drawn(script) == [0, 1, 1]


def test_on_paper_the_page_says_so_and_is_drawn_anew() -> None:
    script = """
      const seen = [], draw = app.curves.draw; app.curves.draw = () => { seen.push("data-paper" in ROOT.attributes);
        };
      heard.beforeprint(); heard.afterprint();
      return seen"""
    assert drawn(script) == [True, False]


def test_the_shape_is_hidden_at_results_that_have_none() -> None:
    """One result with a surface, one without: the panel comes and goes with the result looked at."""
    script = """
      const hidden = () => $("body").hidden, seen = [hidden()];
      app.set({ result: 1, point: 0 }); seen.push(hidden());
      app.set({ result: 0, point: 0 }); seen.push(hidden());
      return [seen, app.body.canvas.attributes["aria-label"]]"""
    seen, label = drawn(script, shaped(), content())
    assert seen == [False, True, False]
    assert label.startswith("Deflected shape, largest displacement ")
    assert drawn('return $("body").hidden') is True


def test_every_crossing_of_a_diagram_is_listed() -> None:
    """However many there are; the list scrolls."""
    met = [{"x": float(k), "y": 2.0 * k, "said": f"engine order 2, mode {k}"} for k in range(1, 31)]
    lines = [{"name": "mode 1", "x": [0.0, 30.0], "y": [1.0, 2.0], "colour": 0}]
    diagram = {
        "title": "Campbell diagram", "x": {"label": "Speed of rotation", "frequency": True},
        "dashed": "engine orders 2", "lines": lines, "met": met,
    }  # fmt: skip
    said, note = drawn(
        'return [tagged($("diagram"), "li").map((li) => li.textContent), $("diagram").textContent]',
        content(diagram=diagram),
    )
    assert [text.partition(":")[0] for text in said] == [one["said"] for one in met]
    assert "met (30):" in note
