"""Every block of README, docs and notebooks runs, page by page in a folder of its own, and prints what is shown.

``python`` blocks of a page share their names; one that begins with a comment naming a file (`# case.toml`) is written
to that file instead, and so are ``toml`` blocks, which have to be right as cases or as parts of one. ``sh`` blocks run
line by line. A ``none`` block is the beginning of a file of columns. A ``text`` block is what the block before it
printed: "..." stands for anything, numbers may differ by two units of their last digit. What Python prints must be
shown.
"""

from __future__ import annotations

import contextlib
import io
import json
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
FENCE = re.compile(r"^( *)```([\w{}.-]+)[^\n]*\n(.*?)^\1```", flags=re.DOTALL | re.MULTILINE)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")

NOT_RUN = {
    "pip install": "installs from the package index",
    "python -m venv": "makes an environment",
    "#!/bin/bash": "a job for a cluster",
    "#!/usr/bin/env python": "workers of a cluster",
    "apiVersion": "workers of a cluster",
    ". rubs": "enters an environment",
    'SetFactory("OpenCASCADE")': "a geometry for Gmsh",
    "gmsh lap.geo": "needs Gmsh",
    "case.toml ──>": "a drawing",
    "analysis/curve/response.py  ": "a drawing",
    "{eval-rst}": "what the site makes from docstrings",
}
"""Blocks and lines that are not run, by how they begin, and why."""


def given_mesh(session: Session) -> None:
    """The mesh of the tutorial."""
    tutorial = next(text for language, text in blocks(DOCS / "tutorial-blade-tip.md") if language == "python")
    session.run("python", tutorial)
    session.run("sh", "python mesh.py")


def given_results(session: Session) -> None:
    """What the first run of the README leaves."""
    session.run("sh", "slipstick init oscillator\nslipstick run oscillator.toml -o . --no-figures --no-report")


def given_case(session: Session) -> None:
    """A case by the name of the page."""
    session.run("sh", "slipstick init oscillator")
    (session.folder / "oscillator.toml").rename(session.folder / "CASE.toml")


def given_reports(session: Session) -> None:
    """Results under the names of the page."""
    given_results(session)
    for name in ("results/results.nc", "v0/results.nc", "v10/results.nc", "v0.nc"):
        (session.folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(session.folder / "results.nc", session.folder / name)


GIVEN = {
    "importing.md": given_mesh,
    "importing-keywords.md": given_mesh,
    "lobed-casing.md": given_mesh,
    "stress-and-rotation.md": given_mesh,
    "results.md": given_results,
    "figures.md": given_results,
    "report.md": given_reports,
    "case-file.md": given_case,
}
"""Files that a page speaks of."""

SECTIONS = {
    "structure",
    "load",
    "contact",
    "joint",
    "bolt",
    "preload",
    "thermal",
    "response",
    "output",
    "study",
    "run_up",
}

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.glob("*.md"))]
SLOW = {
    "answers.md",
    "identification.md",
    "tutorial-blade-tip.md",
    "tutorial-rotor.md",
    "tutorial-test-rig.md",
    "tutorial.md",
    "sensitivity.md",
    "studies.md",
    "importing.md",
    "importing-keywords.md",
    "lobed-casing.md",
    "stress-and-rotation.md",
    "notebook-damper.ipynb",
}
"""Pages of more than a few seconds, run by `make verify`."""


def not_run(text: str) -> bool:
    return any(text.lstrip().startswith(start) for start in NOT_RUN)


def same(printed: str, shown: str) -> bool:
    """Whether a page shows what was printed."""
    numbers = NUMBER.findall(shown)
    words = [re.escape(word) for word in NUMBER.sub("\0", shown).split()]
    pattern = r"\s+".join(words).replace(re.escape("..."), ".*?").replace(re.escape("\0"), f"({NUMBER.pattern})")
    found = re.fullmatch(pattern, printed.strip(), flags=re.DOTALL)
    if not found:
        return False
    return all(abs(float(a) - float(b)) <= 2.0 * last_digit(b) for a, b in zip(found.groups(), numbers, strict=True))


def last_digit(text: str) -> float:
    """One unit of the last digit of a number as written."""
    mantissa, _, exponent = text.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


class Session:
    """One page: its files lie in ``folder``, its Python names live on from block to block."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.names, self.printed, self.unseen = folder, {}, "", False

    def run(self, language: str, text: str) -> None:
        assert language != "text" or self.printed, f"nothing was printed that could be\n{text}"
        getattr(self, language)(text)

    def python(self, text: str) -> None:
        self.all_shown()
        if self._is_file(text):
            return
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(text, "page", "exec"), self.names)
        self.printed = out.getvalue()

    def toml(self, text: str) -> None:
        """A case, sections of one, or keys of a contact: every key and value is one that a case may have."""
        from slipstick.case.sections import REQUESTS, read_sections, take_requests

        given = tomllib.loads(text)
        case = tomllib.loads((ROOT / "examples/oscillator/oscillator.toml").read_text(encoding="utf-8"))
        if "format" in given or set(given) <= SECTIONS | set(REQUESTS):
            case = given if "format" in given else case | given
        else:
            case["contact"][0] |= given
        assert [*take_requests(case)[1], *read_sections(case)[1]] == [], text
        self._is_file(text)

    def sh(self, text: str) -> None:
        self.all_shown()
        self.unseen, self.printed = True, ""
        for line in text.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            if words and not not_run(line):
                self.printed += self._command(words)

    def text(self, shown: str) -> None:
        assert same(self.printed, shown), f"shown:\n{shown}\nprinted:\n{self.printed}"
        self.printed, self.unseen = "", False

    def none(self, shown: str) -> None:
        """The first lines of a file of columns: of the one that was written, else they can be read as such a file."""
        from slipstick.results.measured_columns import read_columns

        written = [file.read_text(encoding="utf-8") for file in self.folder.glob("*.csv")]
        same_head = [text for text in written if text.splitlines()[0] == shown.splitlines()[0]]
        assert not same_head or any(text.startswith(shown) for text in same_head), shown
        (self.folder / "shown.csv").write_text(shown, encoding="utf-8")
        assert read_columns(self.folder / "shown.csv").values
        (self.folder / "shown.csv").unlink()

    def all_shown(self) -> None:
        """What Python prints is on the page; what commands print need not be."""
        assert self.unseen or not self.printed, f"not shown:\n{self.printed}"
        self.unseen = False

    def _is_file(self, text: str) -> bool:
        named = re.match(r"# ([\w-]+\.(?:py|toml))\b", text)
        if named:
            (self.folder / named[1]).write_text(text, encoding="utf-8")
        return bool(named)

    def _command(self, words: list[str]) -> str:
        if words[0] == "slipstick":
            from typer.testing import CliRunner

            from slipstick.cli.main import app

            done = CliRunner().invoke(app, words[1:], catch_exceptions=False)
            assert done.exit_code == 0, f"{' '.join(words)}\n{done.output}"
            return done.stdout
        assert words[0] == "python", words
        script = subprocess.run([sys.executable, *words[1:]], capture_output=True, text=True, timeout=600)
        assert script.returncode == 0, f"{' '.join(words)}\n{script.stderr}"
        return script.stdout


def blocks(path: Path) -> list[tuple[str, str]]:
    if path.suffix == ".ipynb":
        return notebook_blocks(path)
    found = FENCE.findall(path.read_text(encoding="utf-8"))
    return [(language, re.sub(f"^{indent}", "", text, flags=re.MULTILINE)) for indent, language, text in found]


def notebook_blocks(path: Path) -> list[tuple[str, str]]:
    """Code cells, each followed by what it printed."""
    found = []
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            streams = [out for out in cell["outputs"] if out["output_type"] == "stream" and out["name"] == "stdout"]
            found.append(("python", "".join(cell["source"])))
            found += [("text", "".join(line for out in streams for line in out["text"]))] if streams else []
    return found


NOTEBOOKS = sorted(DOCS.glob("*.ipynb"))


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(p, id=p.name, marks=[pytest.mark.verify] if p.name in SLOW else [])
        for p in (*PAGES, *NOTEBOOKS)
        if blocks(p)
    ],
)
@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
def test_the_blocks_run_and_print_what_is_shown(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import matplotlib

    matplotlib.use("Agg")
    monkeypatch.chdir(tmp_path)
    session = Session(tmp_path)
    if page.name in GIVEN:
        GIVEN[page.name](session)
    for language, text in blocks(page):
        if not_run(text) or not_run(language):
            continue
        session.run(language, text)
    session.all_shown()


def test_what_is_not_run_is_there() -> None:
    pages = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    for start in NOT_RUN:
        assert re.search(rf"^ *(```)?{re.escape(start)}", pages, flags=re.MULTILINE), start
