"""Pages whose blocks are run: what they print is what they say."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).parent.parent / "docs"


@pytest.mark.parametrize("page", ["own-law-and-structure.md"])
def test_the_blocks_print_what_is_shown(page: str) -> None:
    names: dict[str, Any] = {}
    out = io.StringIO()
    blocks = re.findall(r"```(\w+)\n(.*?)```", (DOCS / page).read_text(encoding="utf-8"), flags=re.DOTALL)
    for language, text in blocks:
        if language == "python":
            with contextlib.redirect_stdout(out):
                exec(compile(text, page, "exec"), names)
        else:
            assert language == "text"
            assert out.getvalue() == text
            out = io.StringIO()
    assert out.getvalue() == ""
