"""The paper: the sections that the journal asks for, its length, references that fit the citations; built by pandoc."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

PAPER = Path(__file__).parent.parent / "paper"
TEXT = (PAPER / "paper.md").read_text(encoding="utf-8")
BIB = (PAPER / "paper.bib").read_text(encoding="utf-8")
SECTIONS = ["Summary", "Statement of need", "State of the field", "Software design", "Verification",
            "Research impact statement", "AI usage disclosure", "Acknowledgements", "References"]  # fmt: skip


def test_it_has_the_sections_and_the_length() -> None:
    assert re.findall(r"^# (.+)$", TEXT, flags=re.MULTILINE) == SECTIONS
    body = TEXT.split("---", 2)[2]
    assert 750 <= len(body.split()) <= 1750
    assert all((PAPER / name).exists() for name in re.findall(r"\]\((\w+\.png)\)", body))


def test_references_are_cited_and_citations_referenced() -> None:
    known = re.findall(r"^@\w+\{(\w+),", BIB, flags=re.MULTILINE)
    assert set(re.findall(r"@(\w+)", TEXT.split("---", 2)[2])) == set(known)
    assert all(re.fullmatch(r"10\.\d{4,}/\S+", doi) for doi in re.findall(r"doi\s*=\s*\{(.+)\}", BIB))


@pytest.mark.skipif(shutil.which("pandoc") is None, reason="pandoc is not installed")
def test_pandoc_builds_it_with_its_figure_and_citations(tmp_path: Path) -> None:
    made = tmp_path / "paper.html"
    options = "--fail-if-warnings --standalone --citeproc --mathml --lua-filter figures.lua paper.md -o"
    assert options in (PAPER.parent / "Makefile").read_text(encoding="utf-8")
    subprocess.run(["pandoc", *options.split(), str(made)], cwd=PAPER, check=True, timeout=600)
    page = made.read_text(encoding="utf-8")
    assert '<img src="figure.png"' in page
    assert "Figure 1 shows" in page
    assert "???" not in page
    assert page.count('class="csl-entry"') == BIB.count("\n@") + 1
