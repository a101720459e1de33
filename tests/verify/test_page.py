"""The table as a page, and that the page of the documentation is the present table."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from slipstick.verify import run
from slipstick.verify.table import SECTIONS, Row, all_checks, table_page

PAGE = Path(__file__).parent.parent.parent / "docs" / "validation.md"


def rows_of(text: str) -> list[list[str]]:
    lines = re.findall(r"^\| (\w.*) \|$", text, flags=re.MULTILINE)
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)] for line in lines]


def test_every_row_has_a_section() -> None:
    known = {name for names, _ in SECTIONS.values() for name in names}
    assert {check.name.rstrip("0123456789") for check in all_checks()} == known


def test_the_page_has_the_rows_of_the_table() -> None:
    shown = rows_of(PAGE.read_text(encoding="utf-8"))
    order = [names for names, _ in SECTIONS.values()]
    checks = sorted(
        all_checks(), key=lambda c: next(i for i, n in enumerate(order) if c.name.rstrip("0123456789") in n)
    )
    assert [row[:2] for row in shown] == [[check.name, check.what] for check in checks]
    assert [row[4] for row in shown] == [f"{check.tolerance:.1e}" if check.tolerance else "" for check in checks]
    assert {row[5] for row in shown} == {"ok"}


@pytest.mark.verify
def test_the_page_has_the_numbers_of_the_table() -> None:
    now, shown = rows_of(table_page(run(), "")), rows_of(PAGE.read_text(encoding="utf-8"))
    for new, old in zip(now, shown, strict=True):
        assert new[2] == old[2]
        values = [cell[3].removeprefix("below ") for cell in (new, old)]
        assert float(values[0]) == pytest.approx(float(values[1]), rel=1e-3), new


def test_noise_is_not_shown() -> None:
    rows = [
        Row("C1", "a | b", "0", "1.2e-15", "", "ok"),
        Row("C2", "zero", "0", "-3e-8", "1.0e-06", "ok"),
        Row("C3", "broken", "", "", "", "error: no"),
        Row("C4", "number", "2.5", "2.50001234", "1.0e-03", "failed"),
    ]
    text = table_page(rows, "1.0")
    assert text.startswith("# Verification table\n\n2 of 4 checks pass, slipstick 1.0.")
    assert "## Reference values for the published cases" in text
    assert "## Closed forms" not in text
    assert r"| C1 | a \| b | 0 | below 1e-09 |  | ok |" in text
    assert "| C2 | zero | 0 | below 1e-06 |" in text
    assert "| C3 | broken |  |  |  | error: no |" in text
    assert "| C4 | number | 2.5 | 2.50001 |" in text
