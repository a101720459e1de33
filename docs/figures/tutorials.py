"""Make the figures of the tutorials: each page runs as a reader runs it, and what it leaves is drawn."""

import shutil
import sys
import tempfile
from collections.abc import Callable
from contextlib import chdir
from pathlib import Path

import matplotlib as mpl

import slipstick as ss

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent.parent / "tests"))

from test_docs import DOCS, Session, blocks, not_run  # noqa: E402


def ran(page: str, folder: Path) -> None:
    """The blocks of a page, in a folder of its own."""
    session = Session(folder)
    for language, text in blocks(DOCS / page):
        if not not_run(text):
            session.run(language, text)


def kept(name: str) -> Callable[[str], None]:
    """A figure that the page has made."""
    return lambda figure: shutil.copy(name, HERE / f"{figure}.png") and None


def response(folder: str, dof: str) -> Callable[[str], None]:
    """The curve of results in a folder."""

    def draw(figure: str) -> None:
        axes = ss.load(f"{folder}/results.nc").plot.response(dof, frequency="Hz")
        ss.plots.save_figure(axes, HERE / figure, formats=("png",))

    return draw


FIGURES = {
    "tutorial.md": {"tutorial_response": response("two", "pad")},
    "tutorial-blade-tip.md": {"tutorial_tip_response": response("tip", "c1z")},
    "tutorial-test-rig.md": {"tutorial_fit": kept("fit/fit.png"), "tutorial_predicted": kept("predicted.png")},
    "tutorial-rotor.md": {
        "tutorial_campbell": kept("rotor-campbell.png"),
        "tutorial_rub": kept("response.png"),
        "tutorial_orbits": kept("orbits.png"),
    },
}


def main(pages: list[str]) -> None:
    """Of all pages, or of those that are named."""
    mpl.use("Agg")
    for page in pages or FIGURES:
        with tempfile.TemporaryDirectory() as folder, chdir(folder):
            ran(page, Path(folder))
            for figure, draw in FIGURES[page].items():
                draw(figure)


if __name__ == "__main__":
    main(sys.argv[1:])
