"""Small tables for notebooks: text alone, escaped, readable on light and dark pages."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

MOST_SHOWN = 8
"""Names and rows that are shown."""

_LEFT = ' style="text-align:left"'


def html_table(title: str, rows: Iterable[tuple[str, Any]]) -> str:
    """Names and what is said of them, under a title.

    >>> html_table("Two", [("a < b", 1)]).count("&lt;")
    1
    """
    body = "".join(f"<tr><th{_LEFT}>{_text(name)}</th><td{_LEFT}>{_text(value)}</td></tr>" for name, value in rows)
    return f"<table><caption{_LEFT}>{_text(title)}</caption>{body}</table>"


def some(names: Iterable[Any], most: int = MOST_SHOWN) -> str:
    """The first of some names, and how many there are.

    >>> some("abc", 2)
    'a, b, ... (3)'
    """
    listed = [str(name) for name in names]
    return ", ".join(listed[:most]) + (f", ... ({len(listed)})" if len(listed) > most else "")


def dofs_words(count: int) -> str:
    """A number of dofs.

    >>> dofs_words(1), dofs_words(24)
    ('1 dof', '24 dofs')
    """
    return f"{count} dof{'' if count == 1 else 's'}"


def _text(value: object) -> str:
    """A text line by line, without anything that a page would obey."""
    from html import escape  # with its table of entities, which nothing needs until a notebook shows an object

    return "<br>".join(escape(line) for line in str(value).splitlines())
