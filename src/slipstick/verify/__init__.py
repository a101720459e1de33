"""Verification: closed forms, published claims and independent methods in one table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from slipstick.verify.table import Row

__all__ = ["run"]


def run(names: str | Sequence[str] | None = None) -> Iterator[Row]:
    """Rows of the table (name, what, expected, found, tolerance, verdict), computed one after another."""
    from slipstick.verify import table

    return table.computed_rows(names)
