"""The ``verify`` verb: one table of claims, results, tolerances and verdicts."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from slipstick.app.guard import DONE, STOPPED, say
from slipstick.app.prepare import prepare_kernel

if TYPE_CHECKING:
    from slipstick.verify.table import Row


def show_verification(only: str | None) -> int:
    """Run the checks, show them as they finish; 1 if any fails.

    Raises
    ------
    InputError
        If no check bears the name asked for.
    """
    from slipstick.verify import run

    prepare_kernel(say)
    rows = []
    for row in run(only):
        rows.append(row)
        if sys.stderr.isatty():
            print(f"\r{len(rows)} checks", end="", file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        print("\r", end="", file=sys.stderr)
    _print(rows)
    failed = [row for row in rows if not row.ok]
    say(f"{len(rows) - len(failed)} of {len(rows)} checks passed")
    for row in failed:
        say(f"FAILED: {row.name}, {row.what}")
    return STOPPED if failed else DONE


def _print(rows: list[Row]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(show_edge=False, pad_edge=False)
    for title in ("", "check"):
        table.add_column(title)
    for title in ("expected", "found", "tolerance"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("")
    for row in rows:
        verdict = Text("ok", "green") if row.ok else Text(row.verdict, "bold red")
        table.add_row(*(Text(text) for text in row[:5]), verdict)
    console = Console()
    Console(width=console.width if console.is_terminal else 140).print(table)
