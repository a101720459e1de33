"""The words that a user reads are the field's: on pages, in messages, in help, in names of results, in docstrings."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src/slipstick"
PAGES = [*sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs").glob("*.ipynb")), ROOT / "README.md"]

TERMS = {
    r"slips? for good|permanent slip": "full slip",
    r"touch-?downs?": "contact closure",
    r"turns (a|per) minute": "rpm",
    r"parts? of the period": "fraction of the period",
    r"over (the )?frequency(?! range)": "versus frequency",
    r"counter.?surface": "opposing surface",
    r"zero harmonics?": "mean",
    r"principal (frequenc|harmonic)\w*": "fundamental frequency",
    r"(?<![./])verbs?(?![./])": "command",
    r"(is|are|be) (said|told)": "is reported, given, computed, ...",
    r"look(s|ed)? wrong": "suspicious",
    r"what floats": "rigid-body modes",
    r"finds itself": "no initial guess needed",
    r"nature": "stable or not",
    r"published numbers": "reference values",
}
"""What stood here before: the term of the field."""

EXPLAINED = {
    "conventions.md": ("*principal* frequency", "*zero harmonic*"),
    "THEORY.md": (
        "; principal frequency: the fundamental",
        'the paper\'s "zero harmonic"',
        'the paper\'s "permanent slip"',
    ),
}
"""Words of the paper, explained where they first stand."""


def texts_of(file: Path) -> Iterator[str]:
    """Texts of a module that are no docstrings; a placeholder is ``{}``."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    beside: set[ast.AST] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            beside.add(node.value)
        elif isinstance(node, ast.JoinedStr):
            beside |= set(node.values)
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in beside:
            yield node.value


def public() -> Iterator[object]:
    """What the page of the Python interface documents."""
    page = (ROOT / "docs/python.md").read_text(encoding="utf-8")
    for module, name in re.findall(r"^   (slipstick[\w.]*)\.(\w+)$", page, flags=re.MULTILINE):
        yield getattr(import_module(module), name)
    yield import_module("slipstick.cli.main")


def docstrings(thing: object) -> Iterator[str]:
    yield inspect.getdoc(thing) or ""
    if not inspect.isclass(thing) and not inspect.ismodule(thing):
        return
    ours = "slipstick"
    for name, member in vars(thing).items():
        own = getattr(member, "__func__", member)
        if not name.startswith("_") and str(getattr(getattr(own, "fget", own), "__module__", "")).startswith(ours):
            yield inspect.getdoc(own) or ""


def replaced(text: str) -> list[str]:
    prose = " ".join(text.split())
    return [
        f"{found[0]!r} in '{prose[max(0, found.start() - 50) : found.end() + 30]}': {term}"
        for words, term in TERMS.items()
        for found in re.finditer(rf"(?<!\w)({words})(?!\w)", prose, flags=re.IGNORECASE)
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_pages_use_the_terms_of_the_field(page: Path) -> None:
    text = " ".join(page.read_text(encoding="utf-8").split())
    for words in EXPLAINED.get(page.name, ()):
        assert text.count(words) == 1, words
        text = text.replace(words, "")
    assert replaced(text) == []


def test_messages_and_names_of_results_use_them() -> None:
    files = list(SOURCE.rglob("*.py"))
    assert [(file.name, words) for file in files for text in texts_of(file) for words in replaced(text)] == []


def test_the_page_of_a_report_uses_them() -> None:
    page = SOURCE / "report/page"
    files = [file for file in page.iterdir() if file.suffix in {".js", ".html"}]
    assert len(files) > 10
    assert [words for file in files for words in replaced(file.read_text(encoding="utf-8"))] == []


def test_docstrings_of_public_names_and_help_use_them() -> None:
    read = [text for thing in public() for text in docstrings(thing)]
    assert len(read) > 200
    assert sorted({words for text in read for words in replaced(text)}) == []


def test_an_old_word_would_be_seen() -> None:
    assert replaced("the Principal  frequency; a nonzero harmonic, its signature") == [
        "'Principal frequency' in 'the Principal frequency; a nonzero harmonic, its sign': fundamental frequency"
    ]
    assert [text for text in texts_of(Path(__file__)) if text.startswith("the Principal")]
