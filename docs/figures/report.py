"""Make docs/figures/report.png: the report of the heated blade, in headless Chromium (dependency group ``browser``)."""

import shutil
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

import slipstick as ss

HERE = Path(__file__).parent
CASE = HERE.parent.parent / "examples" / "blade_reduced" / "hot_rub.toml"


def main() -> None:
    """Compute, report, photograph."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        page = ss.Case.from_file(CASE).run().report(Path(folder) / "report.html")
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        tab = browser.new_page(viewport={"width": 1280, "height": 1180})
        tab.goto(page.as_uri())
        tab.wait_for_selector("html[data-ready]")
        tab.screenshot(path=HERE / "report.png")
        browser.close()


if __name__ == "__main__":
    main()
