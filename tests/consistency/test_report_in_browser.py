"""The page in headless Chromium: without a request, by mouse and keys, with the loop that Python computes.

Needs the dependency group ``browser`` and a Chromium; skipped without them.
"""

from __future__ import annotations

import csv
import functools
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers import blocks
from helpers.command import slipstick
from helpers.joint import shaken_joint
from helpers.oscillator import UNITS, damper, one_mass
from helpers.reports import branch
from helpers.rings import disc_and_wave
from helpers.study_case import CASE

import slipstick as ss
from slipstick.io.loading import load_dataset
from slipstick.report.content import content_of
from slipstick.report.writing import page, write_report, write_study_report
from slipstick.results.interface import STATES, interfaces_of

pytestmark = pytest.mark.verify

GRID = CASE.replace("[20, 30, 40]", '[20, 30, 60]\n"load" = [0.5, 1.0]').replace(
    "to = 7.0", "to = 7.0\nmax_points = 24"
)
HOSTILE = "</script><script>window.broken = 1</script><img src=x onerror='window.broken = 2'>"


def chromium() -> str | None:
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    return os.environ.get("SLIPSTICK_CHROMIUM") or next(filter(None, map(shutil.which, names)), None)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="the dependency group 'browser' is not installed")
    path = chromium()
    if path is None:
        pytest.skip("there is no Chromium")
    with playwright.sync_playwright() as driver:
        found = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield found
        found.close()


class Opened:
    """A page opened from the file system; what it asked of the network and what it complained of."""

    def __init__(self, browser: Any, path: Path, address: str = "", **options: Any) -> None:
        self.context = browser.new_context(viewport={"width": 1400, "height": 1000}, **options)
        self.context.set_default_timeout(120_000)  # a machine may be busy
        self.page = self.context.new_page()
        self.faults: list[str] = []
        self.page.on("console", lambda message: self.faults.append(message.text) if message.type == "error" else None)
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("request", self._asked)
        self.page.goto(path.as_uri() + address)
        self.page.wait_for_selector("html[data-ready]")

    def fits(self, width: int) -> None:
        """Nothing is wider than the window, once it is drawn anew."""
        self.page.wait_for_function("width => document.documentElement.scrollWidth <= width", arg=width)

    def _asked(self, request: Any) -> None:
        if not request.url.startswith(("file:", "data:")):
            self.faults.append(request.url)

    def view(self) -> dict[str, Any]:
        found: dict[str, Any] = self.page.evaluate("slipstick.view()")
        return found

    def texts(self) -> list[str]:
        """What the readout and the panels say or show."""
        script = """() => [
          ...[".readout", "#point h2", "#loop .note"].map((at) => document.querySelector(at).textContent),
          ...["loop", "history", "spectrum"].map((id) => document.querySelector(`#${id} canvas`).toDataURL()),
          document.querySelector("#states svg").outerHTML, document.querySelector("#contacts table").textContent]"""
        found: list[str] = self.page.evaluate(script)
        return found

    def key(self, *keys: str) -> None:
        self.page.focus("#curves")
        for key in keys:
            self.page.keyboard.press(key)

    def close(self) -> None:
        assert self.faults == []
        self.context.close()


def test_the_map_of_an_interface_follows_the_cursor(browser: Any, tmp_path: Path) -> None:
    made = shaken_joint()
    (joint,) = interfaces_of(made)
    found = Opened(browser, made.report(tmp_path / "joint.html", contacts=12))
    spots = """spots => spots.map((spot) => [spot.dataset.contact, Number(spot.getAttribute("r")),
      spot.getAttribute("fill"), spot.textContent])"""
    drawn = found.page.eval_on_selector_all("#interface circle.spot[data-contact]", spots)
    assert [name for name, *_ in drawn] == [f"joint {k}" for k in range(1, 13)]
    sizes = np.array([size for _, size, *_ in drawn]) ** 2
    assert sizes / sizes.max() == pytest.approx(joint.areas / joint.areas.max(), rel=0.05)
    assert len({fill for _, _, fill, _ in drawn}) > 3
    found.page.click("#interface .choice >> text=state over the period")
    for point in (0, 1):
        found.page.evaluate("point => window.slipstick.set({ point })", point)
        said = [text for *_, text in found.page.eval_on_selector_all("#interface circle.spot[data-contact]", spots)]
        states = joint.values(made.table, "state")
        assert states is not None
        for text, state in zip(said, states[point], strict=True):
            assert f", {STATES[int(state)]}" in text
    found.page.click("#interface circle[data-contact='joint 5']")
    assert found.view()["contact"] == "joint 5"
    found.close()


@pytest.fixture
def opened(browser: Any, tmp_path: Path) -> Iterator[Opened]:
    found = Opened(browser, branch(spring=True).report(tmp_path / "r.html"))
    yield found
    found.close()


def test_a_click_moves_the_cursor_and_all_panels_follow(opened: Opened) -> None:
    before, view = opened.texts(), opened.view()
    box = opened.page.locator("#curves .u-over").bounding_box()
    opened.page.mouse.click(box["x"] + 0.15 * box["width"], box["y"] + 0.9 * box["height"])
    after = opened.view()
    assert after["point"] != view["point"]
    assert [a == b for a, b in zip(before, opened.texts(), strict=True)] == [False] * len(before)
    dot = opened.page.locator(".cursor-dot").bounding_box()
    opened.page.mouse.click(dot["x"] + dot["width"] / 2, dot["y"] + dot["height"] / 2)
    assert abs(opened.view()["point"] - after["point"]) <= 1  # the dot is where its point is


def test_keys_move_along_the_curve_and_to_others(opened: Opened) -> None:
    point = opened.view()["point"]
    opened.key("ArrowRight")
    assert opened.view()["point"] == point + 1
    opened.key("Shift+ArrowLeft")
    assert opened.view()["point"] == point - 9
    opened.key("Home", "ArrowLeft")
    assert opened.view()["point"] == 0
    contact = opened.view()["contact"]
    opened.key("ArrowDown")  # one curve: another contact
    assert opened.view()["contact"] != contact
    first = opened.view()["dof"]
    opened.page.click(".chip:has-text('z')")
    assert opened.view()["dof"] == "z"
    opened.key("ArrowDown")
    assert opened.view()["dof"] == first
    opened.key("ArrowUp")
    assert opened.view()["dof"] == "z"


def test_peaks_states_and_ranking_are_buttons(opened: Opened) -> None:
    opened.key("Home")
    opened.page.click(".peaks tbody button >> nth=0")
    assert "peak" in opened.texts()[0]
    for name in ("tip", "joint"):
        opened.page.focus(f".strip-row[data-contact={name}]")
        opened.page.keyboard.press("Enter")
        assert opened.view()["contact"] == name
    opened.page.click(".ranking button:has-text('stop')")
    assert opened.view()["contact"] == "stop"
    assert "as the harmonics kept" in opened.texts()[2]


def test_the_address_restores_the_view(browser: Any, opened: Opened, tmp_path: Path) -> None:
    opened.page.select_option("#curve", "dissipated_power")
    opened.page.click("button:has-text('over x') >> nth=1")
    opened.page.click("#history button:has-text('friction force')")
    opened.page.click("button:has-text('rpm')")
    opened.page.click("button:has-text('log y')")
    opened.key("Home", "Shift+ArrowRight")
    again = Opened(browser, tmp_path / "r.html", opened.page.evaluate("location.hash"))
    assert again.view() == opened.view()
    assert again.view()["point"] == 10
    assert again.texts() == opened.texts()
    again.page.evaluate("location.hash = '#point=3'")
    again.page.wait_for_selector("#curves[aria-valuenow='3']")
    again.close()


def test_the_loop_is_that_of_python(opened: Opened) -> None:
    made = branch(spring=True)
    plain = ss.Branch.from_dataset(made.dataset.isel(contact=[0, 1]))
    for point in range(0, len(made), 11):
        for name in ("joint", "tip"):
            found = opened.page.evaluate(
                "([p, c]) => { const f = slipstick.loop(0, p, c);"
                " return Object.fromEntries(Object.entries(f).map(([k, v]) => [k, [...v]])); }",
                [point, name],
            )
            for key, own in plain.loop(point, name).items():
                seen = found["friction" if key == "force" else key]
                np.testing.assert_allclose(seen, own, rtol=0, atol=1e-9 * np.abs(own).max())


def test_a_body_shows_its_shape(browser: Any, tmp_path: Path) -> None:
    found = Opened(browser, blocks.branch().report(tmp_path / "r.html"))
    canvas = found.page.locator("canvas.body")

    def picture() -> str:
        return str(found.page.evaluate("document.querySelector('canvas.body').toDataURL()"))

    canvas.scroll_into_view_if_needed()
    found.page.wait_for_function(
        "before => document.querySelector('canvas.body').toDataURL() !== before", arg=picture()
    )  # it moves
    found.page.click("#body .tools > button")  # pause
    still = picture()
    found.page.wait_for_timeout(300)
    assert picture() == still
    box = canvas.bounding_box()
    found.page.mouse.move(box["x"] + 100, box["y"] + 100)
    found.page.mouse.down()
    found.page.mouse.move(box["x"] + 160, box["y"] + 120, steps=3)
    found.page.mouse.up()
    assert found.view()["turn"] == [-5, 30]
    canvas.focus()
    found.page.keyboard.press("ArrowLeft")
    assert found.view()["turn"] == [-10, 30]
    turned = picture()
    assert turned != still
    found.key("Home", "Shift+ArrowRight")
    assert picture() != turned
    found.close()


def test_strangers_texts_run_nothing(browser: Any, tmp_path: Path) -> None:
    made = branch()
    names = [HOSTILE, f"{HOSTILE} two"]
    data = made.dataset.assign_coords(contact=names, dof=["a", HOSTILE, "z"])
    data = data.assign_attrs(title=HOSTILE, case=HOSTILE, warnings=HOSTILE, outcome_text=HOSTILE, case_file=HOSTILE)
    data["amplitude"].attrs["units"] = HOSTILE
    path = write_report({HOSTILE: ss.Branch.from_dataset(data), "b": made}, tmp_path / "r.html")
    found = Opened(browser, path)
    assert found.page.evaluate("window.broken === undefined && document.querySelectorAll('img').length === 0")
    assert found.page.inner_text("h1") == HOSTILE
    found.close()


def test_a_long_list_of_peaks_scrolls_beside_the_curves(browser: Any, tmp_path: Path) -> None:
    """However many there are, the curves keep their height."""
    heights = {}
    for times in (1, 40):
        content = content_of(branch(), "a", contacts=2, dofs=3)
        content["notes"] *= times
        path = tmp_path / f"{times}.html"
        path.write_text(page("t", {"title": "t", "version": "1", "written": "now", "results": [content]}), "utf-8")
        found = Opened(browser, path)
        found.page.wait_for_timeout(300)
        script = """() => [document.querySelector(".with-side > .card"), document.querySelector(".peaks")]
          .map((own) => [own.offsetHeight, own.scrollHeight])"""
        heights[times] = found.page.evaluate(script)
        found.close()
    (card, _), (side, inside) = heights[40]
    assert card == heights[1][0][0]
    assert side <= card < inside


def test_inputs_are_shown_where_the_problem_is_known(opened: Opened) -> None:
    titles = opened.page.locator("#inputs h3").all_inner_texts()
    assert titles == ["Model", "Modes without contacts", "Loads", "Contacts"]
    assert "tangential a - b" in opened.page.locator("#inputs .wide").inner_text()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1400, 500])
def test_nothing_is_wider_than_the_window(browser: Any, tmp_path: Path, width: int, scheme: str) -> None:
    found = Opened(browser, branch(spring=True).report(tmp_path / "r.html"), color_scheme=scheme)
    found.page.set_viewport_size({"width": width, "height": 900})
    found.page.wait_for_timeout(300)
    found.fits(width)
    found.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1400, 420])
def test_a_study_is_chosen_from_in_map_curves_and_table(browser: Any, tmp_path: Path, width: int, scheme: str) -> None:
    (tmp_path / "case.toml").write_text(GRID)
    arguments = ["study", str(tmp_path / "case.toml"), "-o", str(tmp_path / "out"), "--no-figures", "--workers", "1"]
    assert slipstick(*arguments).exit_code == 1  # one case is stopped early
    found = Opened(browser, tmp_path / "out" / "report.html", color_scheme=scheme)
    found.page.set_viewport_size({"width": width, "height": 900})
    found.page.wait_for_timeout(300)
    found.fits(width)
    marks, rows = found.page.locator("#map rect.mark"), found.page.locator("#cases tbody tr")
    assert (marks.count(), rows.count(), found.page.locator("#curves path.line").count()) == (6, 6, 6)
    failed = found.page.locator("#map path.failed").count()
    assert failed == found.page.locator("#cases tr.bad").count() >= 1
    marks.nth(4).click()
    assert found.view()["case"] == 4
    assert found.page.locator("#curves path.chosen-line").count() == 1
    assert found.page.locator("#cases tr.chosen a").inner_text() == "4"
    found.page.select_option("#cases select", "bad")
    assert rows.count() == failed
    found.page.select_option("#cases select", "")
    found.page.locator("#cases input").press_sequentially("velocity=30")
    assert rows.count() == 2
    assert found.page.locator("#cases input").input_value() == "velocity=30"
    assert "slipstick report study.nc --case 4" in found.page.inner_text("#chosen")
    found.page.select_option("#choices select >> nth=2", "")
    assert found.page.locator("#map circle.mark").count() == 3
    found.close()


def kinds() -> dict[str, Any]:
    """Results of every kind that a report shows, by name: branches, or several laid over each other."""
    oscillator = oscillator_with(0.0)
    loud = {"omega": (2.0, 15.0)}
    return {
        "run": branch(spring=True),
        "hot": heated(),
        "contactless": ss.linear_response(oscillator, omega=np.linspace(2.0, 15.0, 60)),
        "parameter": ss.parameter_response(oscillator, "damper.normal_load", (300.0, 600.0), omega=9.0),
        "peaks": ss.track_peak(oscillator, "damper.normal_load", (300.0, 900.0), dof="x", **loud),
        "optimum": ss.optimal(oscillator, "damper.normal_load", dof="x", start=500.0, **loud).branch,
        "modes": ss.nonlinear_modes(oscillator, amplitude=(1.0, 10.0), load_factors=[1.0]),
        "cycles": squeal(),
        "comparison": {
            f"v = {v:g}": ss.forced_response(oscillator_with(v), stability=True, **loud) for v in (0.0, 10.0)
        },
    }


def oscillator_with(velocity: float) -> ss.Problem:
    return one_mass(damper(velocity), harmonics=range(6), units=UNITS)


def heated() -> ss.Branch:
    curve = ss.FrictionCurve(temperature=[0.0, 500.0, 5000.0], mu=[0.4, 0.3, 0.25])
    problem = oscillator_with(10.0)
    thermal = ss.ThermalModel(curve=curve, background=20.0, resistance=0.05)
    hot = ss.Problem(
        problem.structure, contacts=problem.contacts, loads=problem.loads, harmonics=problem.harmonics, thermal=thermal
    )  # fmt: skip
    return ss.forced_response(hot, omega=(3.0, 12.0))


def squeal() -> ss.Branch:
    structure = ss.MatrixStructure(
        M=np.eye(2), C=0.5 * np.eye(2), K=[[100.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"]
    )  # fmt: skip
    contact = ss.FrictionContact(kt=200.0, mu=0.45, kn=40.0, gap=0.0)
    pair = ss.ContactPair(
        name="pad", contact=contact, tangential="x", normal="y", rubbing=ss.RubbingMotion(velocity=1.0)
    )  # fmt: skip
    problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="y", harmonic=0, cos=50.0)], harmonics=range(6))
    return ss.limit_cycles(problem, "pad.mu", (0.3, 0.6))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("width, scheme", [(1400, "light"), (500, "dark")])
@pytest.mark.parametrize(
    "kind", ["run", "hot", "contactless", "parameter", "peaks", "optimum", "modes", "cycles", "comparison", "many"]
)
def test_every_entry_of_every_control(browser: Any, tmp_path: Path, kind: str, width: int, scheme: str) -> None:
    shown = {"results": many()} if kind == "many" else kinds_once()[kind]
    path = write_report(shown, tmp_path / "r.html")
    branches = list(shown.values()) if isinstance(shown, dict) else [shown]
    found = Opened(browser, path, color_scheme=scheme)
    found.page.set_viewport_size({"width": width, "height": 900})
    found.page.wait_for_timeout(200)
    found.fits(width)
    quantities = entries(found, "#curve")
    overs = entries(found, "#over") or [""]
    for over in overs:
        if over:
            found.page.select_option("#over", over)
        for quantity in quantities:
            found.page.select_option("#curve", quantity)
            assert_drawn(found, branches, quantity)
            again = Opened(browser, path, found.page.evaluate("location.hash"), color_scheme=scheme)
            assert again.page.evaluate("slipstick.drawn()") == found.page.evaluate("slipstick.drawn()")
            again.close()
    found.page.focus("#curve")
    for _ in quantities:  # by keyboard
        found.page.keyboard.press("ArrowUp")
    for quantity in quantities[1:]:
        found.page.keyboard.press("ArrowDown")
        assert found.view()["curve"] == quantity
        assert_drawn(found, branches, quantity)
    for at in ("#at-contact", "#at-dof"):
        for entry in entries(found, at):
            found.page.select_option(at, entry)
            assert entry in found.view().values()
            assert found.page.evaluate("slipstick.drawn().length") > 0
    buttons = ".tools button:not(.plain), .chip"
    for i in range(found.page.locator(buttons).count()):
        found.page.locator(buttons).nth(i).click()
        assert found.page.evaluate("slipstick.drawn().length") > 0
    found.close()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("width, scheme", [(1400, "light"), (500, "dark")])
@pytest.mark.parametrize("method", ["grid", "list"])
def test_every_entry_of_every_control_of_a_study(
    browser: Any, tmp_path: Path, method: str, width: int, scheme: str
) -> None:
    """Peaks and curves are those of the study, whatever is chosen, and after the page is opened anew."""
    values = {"damper.velocity": [0.0, 1.0, 10.0, 250.0], "damper.mu": [0.1, 0.3, 0.5, 0.6]}
    problem, path = oscillator_with(10.0), tmp_path / "study.html"
    study = ss.study(problem, values, omega=(4.0, 12.0), method=method, workers=1, folder=tmp_path / "study")
    curves = load_dataset(tmp_path / "study" / "curves.nc")
    write_study_report(study, curves, path)
    flat = study.stack(case_of=[d for d in study["peak_amplitude"].dims if d != "dof"])
    peaks, at = (flat[name].sel(dof="x").values for name in ("peak_amplitude", "peak_omega"))
    found = Opened(browser, path, color_scheme=scheme)
    found.page.set_viewport_size({"width": width, "height": 900})
    found.page.wait_for_timeout(200)
    found.fits(width)
    factors = {"rad/s": 1.0, "Hz": 0.5 / np.pi, "kHz": 0.5e-3 / np.pi, "rpm": 30.0 / np.pi}

    def assert_study() -> None:
        drawn, view = found.page.evaluate("slipstick.drawn()"), found.view()
        (head, *rows), cases = drawn["peaks"], [row[0] for row in drawn["peaks"][1:]]
        assert head[-2] == f"at Frequency [{view['unit']}]"
        np.testing.assert_allclose([row[-3] for row in rows], peaks[cases], rtol=1e-9)
        np.testing.assert_allclose([row[-2] for row in rows], at[cases] * factors[view["unit"]], rtol=1e-9)
        assert found.page.locator("#map .mark").count() == len(cases) > 1
        assert found.page.locator("#curves path").count() == len(drawn["curves"]) > 1
        for case, x, (y,) in drawn["curves"]:
            own = curves.isel(point=(curves["case"] == case).values)
            np.testing.assert_allclose(np.array(list(x)), own["omega"].values, rtol=1e-9)
            np.testing.assert_allclose(np.array(list(y)), own["amplitude"].values[:, 0], rtol=1e-9)
        again = Opened(browser, path, found.page.evaluate("location.hash"), color_scheme=scheme)
        assert (again.page.evaluate("slipstick.drawn()"), again.view()) == (drawn, view)
        again.close()

    for i in range(found.page.locator("#choices select").count()):
        for entry in entries(found, f"#choices label:nth-of-type({i + 1}) select"):
            found.page.locator("#choices select").nth(i).select_option(entry)
            assert_study()
    for unit in factors:
        found.page.click(f"#choices button:text-is('{unit}')")
        assert_study()
    for case in range(found.page.locator("#cases tbody tr").count()):
        found.page.click(f"#case-{case} a")
        assert found.view()["case"] == case
        assert found.page.locator("#map .around").count() == found.page.locator("#curves .chosen-line").count() == 1
    found.close()


def entries(found: Opened, at: str) -> list[str]:
    """What a list offers."""
    values: list[str] = found.page.evaluate(f"[...document.querySelectorAll('{at} option')].map((one) => one.value)")
    return values


def assert_drawn(found: Opened, branches: list[ss.Branch], quantity: str) -> None:
    """The lines of the chosen quantity are there, on a canvas that shows something, and are those of the results."""
    lines = [line for line in found.page.evaluate("slipstick.drawn()") if line[0] == quantity]
    assert lines, quantity
    view = found.view()
    for _, result, name, x, y in lines:
        data = branches[result].dataset
        over = data[view["over"]].values
        scale = 1.0 if view["over"] != "omega" else over[0] / x[0]
        np.testing.assert_allclose(np.array(x, float) * scale, over, rtol=1e-9)
        if quantity != "phase":
            own = data[quantity]
            own = own.sel(dof=name) if "dof" in own.dims else own
            own = (own.sel(contact=name) if name else own.sum("contact")) if "contact" in own.dims else own
            y_scale = own.values[0] / y[0] if quantity == "omega" else 1.0
            size = float(np.nanmax(np.abs(data["amplitude"]))) if quantity == "mean" else 0.0
            np.testing.assert_allclose(
                np.array(y, float) * y_scale, own.values, rtol=1e-9, atol=1e-9 * size, err_msg=quantity
            )  # fmt: skip
    assert found.page.locator("#curves canvas").count() == 1


@functools.cache
def kinds_once() -> dict[str, Any]:
    return kinds()


def test_any_chart_can_be_saved(browser: Any, opened: Opened) -> None:
    made = branch(spring=True)
    for at in ("#curves", "#loop", "#states", "#history", "#spectrum"):
        saved = {}
        for kind in ("PNG", "SVG", "CSV"):
            opened.page.wait_for_timeout(150)  # Chromium drops more than ten downloads in a second
            opened.page.evaluate(f"document.querySelector('{at} .save').open = true")
            with opened.page.expect_download() as download:
                opened.page.locator(f"{at} .save button:has-text('{kind}')").click()
            saved[kind] = Path(download.value.path()).read_bytes()
        assert saved["PNG"].startswith(b"\x89PNG")
        assert len(saved["PNG"]) > 2000
        assert ElementTree.fromstring(saved["SVG"]).tag.endswith("svg")
        rows = list(csv.reader(saved["CSV"].decode().splitlines()))
        assert len(rows) > 2
        if at == "#curves":
            dof, point = opened.view()["dof"], opened.view()["point"]
            own = made.dataset["amplitude"].sel(dof=dof).values
            assert rows[0] == ["curve", "Frequency [rad/s]", "Amplitude [length]"]
            np.testing.assert_allclose([float(row[2]) for row in rows[1:]], own, rtol=1e-12)
            assert point == own.argmax()


def test_values_are_read_under_the_pointer(opened: Opened) -> None:
    box = opened.page.locator("#curves .u-over").bounding_box()
    opened.page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    assert "rad/s" in opened.page.inner_text("#curves .reading")


def test_tolerances_are_drawn_and_said(browser: Any, tmp_path: Path) -> None:
    path = branch().report(tmp_path / "r.html", tolerances={"tip.mu": 0.2})
    found = Opened(browser, path)
    assert "dotted: tip.mu ±20 %" in found.page.inner_text("body")
    found.close()


def test_a_page_without_points_says_why(browser: Any, tmp_path: Path) -> None:
    outcome = ss.Outcome.NO_FIRST_POINT
    none = ss.Branch(branch().dataset.isel(point=slice(0, 0)), outcome, message=outcome.text)
    found = Opened(browser, none.report(tmp_path / "r.html"))
    assert "no first point was found" in found.page.inner_text("#head")
    found.close()


@pytest.mark.filterwarnings("ignore")
def test_five_hundred_points_and_twelve_contacts(browser: Any, tmp_path: Path) -> None:
    made = many()
    assert len(made) >= 500
    path = made.report(tmp_path / "r.html")
    assert path.stat().st_size < 3e6
    found = Opened(browser, path)
    found.close()


def many() -> ss.Branch:
    """Twelve masses in a row, each under a contact whose normal moves, eleven harmonics."""
    n, row = 12, np.eye(12, k=1) + np.eye(12, k=-1)
    spring = 60.0 * np.eye(n) - 20.0 * row
    K = np.block([[spring, 3.0 * np.eye(n)], [3.0 * np.eye(n), 1.5 * spring]])
    names = [f"{axis}{i}" for axis in "xy" for i in range(n)]
    structure = ss.MatrixStructure(M=np.eye(2 * n), C=0.5 * np.eye(2 * n), K=K, dofs=names)
    pairs = [
        ss.ContactPair(
            name=f"c{i}", contact=ss.FrictionContact(kt=40.0 + i, mu=0.3, kn=50.0, gap=-0.05 - 0.01 * i),
            tangential=f"x{i}", normal=f"y{i}", rubbing=ss.RubbingMotion(velocity=0.2, sin={1: 0.1}),
        )
        for i in range(n)
    ]  # fmt: skip
    loads = [ss.Load(dof=name, sin=5.0 + i % 3, cos=3.0 * (i >= n)) for i, name in enumerate(names)]
    outputs = [*names[:6], *names[n : n + 6]]
    problem = ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(11), outputs=outputs)
    return ss.forced_response(problem, omega=(3.0, 12.0), options={"max_points": 500, "max_step": 0.0022})


def test_blades_of_a_disc_by_mouse_and_keys(browser: Any, tmp_path: Path) -> None:
    """Every blade has the colour of its amplitude; what is chosen is told, and kept in the address."""
    made = disc_and_wave()[1]
    opened = Opened(
        browser, made.report(tmp_path / "r.html"), "#disc=tip", reduced_motion="reduce", color_scheme="dark"
    )
    blades = opened.page.locator("#disc path.blade")
    assert blades.count() == 6
    assert len({blade.get_attribute("fill") for blade in blades.all()}) == 1  # tuned
    opened.page.locator('#disc path[data-blade="4"]').click()
    assert opened.view()["blade"] == 4
    opened.page.focus("#disc svg.front")
    opened.page.keyboard.press("ArrowLeft")
    assert opened.view()["blade"] == 5
    assert opened.page.locator("#disc .note").inner_text().startswith("blade 5: ")
    assert "numbered counter-clockwise from 0 to 5" in opened.page.locator("#disc .note").inner_text()
    before = blades.first.get_attribute("d")
    opened.page.locator("#disc input").fill("90")
    assert blades.first.get_attribute("d") != before
    opened.page.set_viewport_size({"width": 500, "height": 900})
    opened.page.wait_for_timeout(500)  # it is drawn anew once the size rests
    opened.fits(500)
    opened.close()
