"""The page put together: our own few files, the plotting library, and the content, in one file without links."""

from __future__ import annotations

import re
from base64 import b64encode
from functools import cache
from hashlib import sha256
from html import escape
from importlib.resources import files
from typing import Any

from slipstick.report.encoding import gathered, safe_json

STYLES = ("uplot/uPlot.min.css", "look.css", "panels.css", "print.css")
STUDY_STYLES = ("look.css", "study.css", "print.css")
STUDY_SCRIPTS = ("decode.js", "charts.js", "save.js", "head.js", "study.js")
SCRIPTS = tuple(
    f"{name}.js"
    for name in [
        "decode",
        "law",
        "model",
        "view",
        "charts",
        "save",
        "curves",
        "strip",
        "shape",
        "panels",
        "tables",
        "head",
        "main",
    ]
)
"""Our own, in the order they are put together: one script, so that nothing but ``slipstick`` is left in the page."""


def part(name: str) -> str:
    """A file of the page."""
    return (files("slipstick.report") / "page" / name).read_text(encoding="utf-8")


@cache
def style(names: tuple[str, ...] = STYLES) -> str:
    """All styles, the library's first."""
    return "\n".join(part(name) for name in names)


@cache
def scripts() -> tuple[str, str]:
    """The library with its licence, and our own script."""
    licence = part("uplot/LICENSE").replace("*/", "* /")
    return f"/*\n{licence}\n*/\n{part('uplot/uPlot.iife.min.js')}", _script(SCRIPTS)


@cache
def _script(names: tuple[str, ...]) -> str:
    source = "\n".join(part(name) for name in names)
    return f'"use strict";\n(() => {{\n{source}\n}})();'


def page(title: str, content: Any) -> str:
    """The whole page.

    Its policy forbids every request, and every script and style but the very ones it was written with.
    """
    library, script = scripts()
    return _filled("page.html", title, content, style(), {"library": library, "script": script})


def study_page(title: str, content: Any) -> str:
    """The whole page of a study, under the same policy."""
    return _filled("study.html", title, content, style(STUDY_STYLES), {"script": _script(STUDY_SCRIPTS)})


def _filled(template: str, title: str, content: Any, look: str, parts: dict[str, str]) -> str:
    plain, numbers = gathered(content)
    slots = {
        "title": escape(title),
        "policy": _policy([look], list(parts.values())),
        "style": look,
        "content": safe_json(plain),
        "numbers": numbers,
        **parts,
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda slot: slots[slot[1]], part(template))


def _policy(styles: list[str], scripts: list[str]) -> str:
    return (
        f"default-src 'none'; script-src {_hashes(scripts)}; style-src {_hashes(styles)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _hashes(texts: list[str]) -> str:
    return " ".join(f"'sha256-{b64encode(sha256(text.encode('utf-8')).digest()).decode('ascii')}'" for text in texts)
