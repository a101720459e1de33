"""Make the figures of the tutorials: each page runs as a reader runs it, and its figures are kept."""

import shutil
import subprocess
import sys
import tempfile
from contextlib import chdir
from pathlib import Path

import matplotlib as mpl

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent.parent / "tests"))

from test_docs import DOCS, Session, blocks, not_run  # noqa: E402


def ran(page: str, folder: Path) -> None:
    """The blocks of a page, in a folder of its own."""
    session = Session(folder)
    for language, text in blocks(DOCS / page):
        if not not_run(text):
            session.run(language, text)


def response(case: str) -> str:
    """The curve of a case that the page has left, drawn by the command line: where."""
    run = "from slipstick.cli.main import main; main()"
    drawn = ["run", case, "-o", "drawn", "--figures", "response", "--no-report", "--quiet"]
    subprocess.run([sys.executable, "-c", run, *drawn], check=True)
    return "drawn/response.png"


FIGURES = {
    "tutorial.md": {"tutorial_response": lambda: response("two_masses.toml")},
    "tutorial-blade-tip.md": {"tutorial_tip_response": lambda: response("tip.toml")},
    "tutorial-test-rig.md": {"tutorial_fit": lambda: "fit/fit.png", "tutorial_predicted": lambda: "predicted.png"},
    "tutorial-rotor.md": {
        "tutorial_campbell": lambda: "rotor-campbell.png",
        "tutorial_rub": lambda: "response.png",
        "tutorial_orbits": lambda: "orbits.png",
    },
}
"""Where each figure is found once its page has run."""


def main(pages: list[str]) -> None:
    """Of all pages, or of those that are named."""
    mpl.use("Agg")
    for page in pages or FIGURES:
        with tempfile.TemporaryDirectory() as folder, chdir(folder):
            ran(page, Path(folder))
            for figure, drawn in FIGURES[page].items():
                shutil.copy(drawn(), HERE / f"{figure}.png")


if __name__ == "__main__":
    main(sys.argv[1:])
