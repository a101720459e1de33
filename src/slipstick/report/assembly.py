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
SCRIPTS = tuple(
    f"{name}.js"
    for name in [
        "decode",
        "law",
        "model",
        "view",
        "charts",
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
def style() -> str:
    """All styles, the library's first."""
    return "\n".join(part(name) for name in STYLES)


@cache
def scripts() -> tuple[str, str]:
    """The library with its licence, and our own script."""
    licence = part("uplot/LICENSE").replace("*/", "* /")
    own = "\n".join(part(name) for name in SCRIPTS)
    return f"/*\n{licence}\n*/\n{part('uplot/uPlot.iife.min.js')}", f'"use strict";\n(() => {{\n{own}\n}})();'


def page(title: str, content: Any) -> str:
    """The whole page.

    Its policy forbids every request, and every script and style but the very ones it was written with.
    """
    library, own = scripts()
    plain, numbers = gathered(content)
    slots = {
        "title": escape(title),
        "policy": _policy([style()], [library, own]),
        "style": style(),
        "library": library,
        "script": own,
        "content": safe_json(plain),
        "numbers": numbers,
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda slot: slots[slot[1]], part("page.html"))


def _policy(styles: list[str], scripts: list[str]) -> str:
    return (
        f"default-src 'none'; script-src {_hashes(scripts)}; style-src {_hashes(styles)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _hashes(texts: list[str]) -> str:
    return " ".join(f"'sha256-{b64encode(sha256(text.encode('utf-8')).digest()).decode('ascii')}'" for text in texts)
