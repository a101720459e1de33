"""The page in headless Chromium: without a request, by mouse and keys, with the loop that Python computes.

Needs the dependency group ``browser`` and a Chromium; skipped without them.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import blocks
from helpers.reports import branch
from helpers.study_case import CASE
from typer.testing import CliRunner

import slipstick as ss
from slipstick.app.cli import app
from slipstick.report.writing import write_report

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
        self.page = self.context.new_page()
        self.faults: list[str] = []
        self.page.on("console", lambda message: self.faults.append(message.text) if message.type == "error" else None)
        self.page.on("pageerror", lambda error: self.faults.append(str(error)))
        self.page.on("request", self._asked)
        begin = time.perf_counter()
        self.page.goto(path.as_uri() + address)
        self.page.wait_for_selector("html[data-ready]")
        self.seconds = time.perf_counter() - begin

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
                np.testing.assert_allclose(found[key], own, rtol=0, atol=1e-9 * np.abs(own).max())


def test_a_body_shows_its_shape(browser: Any, tmp_path: Path) -> None:
    found = Opened(browser, blocks.branch().report(tmp_path / "r.html"))
    canvas = found.page.locator("canvas.body")

    def picture() -> str:
        return str(found.page.evaluate("document.querySelector('canvas.body').toDataURL()"))

    canvas.scroll_into_view_if_needed()
    moving = picture()
    found.page.wait_for_timeout(300)
    assert picture() != moving
    found.page.click("#body button")  # pause
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
    found.key("Home")
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


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1400, 500])
def test_nothing_is_wider_than_the_window(browser: Any, tmp_path: Path, width: int, scheme: str) -> None:
    found = Opened(browser, branch(spring=True).report(tmp_path / "r.html"), color_scheme=scheme)
    found.page.set_viewport_size({"width": width, "height": 900})
    found.page.wait_for_timeout(300)
    assert found.page.evaluate("document.documentElement.scrollWidth") <= width
    found.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1400, 420])
def test_a_study_is_chosen_from_in_map_curves_and_table(browser: Any, tmp_path: Path, width: int, scheme: str) -> None:
    (tmp_path / "case.toml").write_text(GRID)
    arguments = ["study", str(tmp_path / "case.toml"), "-o", str(tmp_path / "out"), "--no-figures", "--workers", "1"]
    assert CliRunner().invoke(app, arguments).exit_code == 1  # one case is stopped early
    found = Opened(browser, tmp_path / "out" / "report.html", color_scheme=scheme)
    found.page.set_viewport_size({"width": width, "height": 900})
    found.page.wait_for_timeout(300)
    assert found.page.evaluate("document.documentElement.scrollWidth") <= width
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
    found.page.locator("#cases input").press_sequentially("velocity = 30")
    assert rows.count() == 2
    assert found.page.locator("#cases input").input_value() == "velocity = 30"
    found.page.select_option("#choices select >> nth=2", "")
    assert found.page.locator("#map circle.mark").count() == 3
    found.close()


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
    begin = time.process_time()
    path = made.report(tmp_path / "r.html")
    assert time.process_time() - begin < 2.0
    assert path.stat().st_size < 3e6
    found = Opened(browser, path)
    assert found.seconds < 2.0
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
