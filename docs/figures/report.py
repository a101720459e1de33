"""Make report.png and report_shape.png: reports of two blades, in headless Chromium (dependency group ``browser``)."""

import shutil
import tempfile
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

import slipstick as ss

HERE = Path(__file__).parent
EXAMPLES = HERE.parent.parent / "examples"


def opened(tab: Page, case: Path, folder: Path) -> None:
    """The report of a case, in a tab."""
    page = ss.Case.from_file(case).run().report(folder / f"{case.stem}.html")
    tab.goto(page.as_uri())
    tab.wait_for_selector("html[data-ready]")


def main() -> None:
    """Compute, report, photograph."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": 1280, "height": 1180}, reduced_motion="reduce")
        opened(tab, EXAMPLES / "blade_reduced" / "blade_reduced_hot_rub.toml", Path(folder))
        tab.screenshot(path=HERE / "report.png")
        tab.set_viewport_size({"width": 900, "height": 900})
        opened(tab, EXAMPLES / "blade" / "blade.toml", Path(folder))
        tab.locator("#body").screenshot(path=HERE / "report_shape.png")
        browser.close()


if __name__ == "__main__":
    main()
