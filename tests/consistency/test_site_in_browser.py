"""Every page of the site in headless Chromium: no fault, no request, no missing picture, nothing wider than the window.

Needs what `make docs` builds, the dependency group ``browser`` and a Chromium; skipped without them.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.verify
SITE = Path(__file__).parents[2] / "build/site"
LOOK = """() => ({
  wide: document.documentElement.scrollWidth,
  broken: [...document.images].filter((image) => image.naturalWidth === 0).map((image) => image.src),
  raw: [...document.querySelectorAll(".math")].filter((own) => !own.querySelector("mjx-container, math")).length,
})"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="the dependency group 'browser' is not installed")
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    path = os.environ.get("SLIPSTICK_CHROMIUM") or next(filter(None, map(shutil.which, names)), None)
    if path is None:
        pytest.skip("there is no Chromium")
    if not (SITE / "index.html").exists():
        pytest.skip("there is no site: make docs")
    with playwright.sync_playwright() as driver:
        found = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield found
        found.close()


def faults_of(browser: Any, page: Path, width: int, scheme: str) -> list[str]:
    """What is wrong with a page at a width."""
    context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
    tab, found = context.new_page(), []
    tab.on("console", lambda message: found.append(message.text) if message.type == "error" else None)
    tab.on("pageerror", lambda error: found.append(str(error)))
    tab.on("request", lambda request: None if request.url.startswith(("file:", "data:")) else found.append(request.url))
    tab.goto(page.as_uri(), wait_until="load")
    tab.evaluate("window.MathJax?.startup?.promise")
    tab.evaluate("[...document.images].forEach((image) => { image.loading = 'eager'; })")
    tab.wait_for_function("[...document.images].every((image) => image.complete)")
    seen = tab.evaluate(LOOK)
    found += [f"broken: {source}" for source in seen["broken"]]
    found += [f"{seen['wide']} wide at {width}"] * (seen["wide"] > width)
    found += [f"{seen['raw']} equations are not set"] * bool(seen["raw"])
    context.close()
    return found


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1400, 500])
def test_every_page_of_the_site(browser: Any, width: int, scheme: str) -> None:
    pages = sorted(SITE.glob("*.html"))
    assert len(pages) > 30
    found = {page.name: faults for page in pages if (faults := faults_of(browser, page, width, scheme))}
    assert found == {}
