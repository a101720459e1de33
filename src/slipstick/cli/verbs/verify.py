"""The verb ``verify``: one table of claims, results, tolerances and verdicts."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from slipstick.cli.options import results_files
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import DONE, STOPPED, say
from slipstick.cli.terminal.prepare import prepare_kernel
from slipstick.cli.verb import verb
from slipstick.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from slipstick.verify.table import Row


@verb
def verify(
    answer: Answer,
    results: Annotated[
        Path | None,
        typer.Argument(
            metavar="[RESULTS]", help="A results file, or its folder, to check in time.", autocompletion=results_files
        ),
    ] = None,
    point: Annotated[
        list[int] | None, typer.Option("--point", help="Number of a point, repeatable; else the highest peaks.")
    ] = None,
    at: Annotated[
        list[str] | None, typer.Option("--at", help='Take the point nearest to this value, such as "50 Hz".')
    ] = None,
    tolerance: Annotated[float, typer.Option(help="Largest relative difference that agrees.", min=0.0)] = 0.01,
    only: Annotated[
        str | None, typer.Option("--only", help="Without RESULTS: only the rows whose name contains this.")
    ] = None,
    markdown: Annotated[
        Path | None, typer.Option(help="Without RESULTS: also write the table to this file, as markdown.")
    ] = None,
) -> int:
    """Check this installation against closed forms and reference values, or points of RESULTS by time integration."""
    if results is None:
        if point or at:
            raise InputError("--point, --at: found no RESULTS; give the results file they belong to")
        return show_verification(only, answer, markdown)
    if only is not None:
        raise InputError("--only: chooses rows of the installation's table; give --point or --at with RESULTS")
    if markdown is not None:
        raise InputError("--markdown: writes the installation's table; leave it out with RESULTS")
    from slipstick.cli.in_time import verify_results

    return verify_results(results, point or (), at or (), tolerance, answer)


def show_verification(only: str | None, answer: Answer, markdown: Path | None = None) -> int:
    """Run the checks and print their table; 1 if any fails. ``markdown``: the file that gets the table, too.

    Raises
    ------
    InputError
        If no check has the name asked for, or the file cannot be written.
    """
    from slipstick.verify import run

    if markdown is not None and not markdown.absolute().parent.is_dir():
        raise InputError(
            f"--markdown {markdown}: cannot be written: there is no folder {markdown.parent}; make it first"
        )
    if markdown is not None and markdown.is_dir():
        raise InputError(f"--markdown {markdown}: cannot be written: found a folder; expected a file such as table.md")
    prepare_kernel(say)
    rows: list[Row] = []
    live = sys.stderr.isatty()
    for row in run(only):
        rows.append(row)
        if live:
            print(f"\r{len(rows)} checks, last {row.name:<12}", end="", file=sys.stderr, flush=True)
    if live:
        print("\r" + " " * 40 + "\r", end="", file=sys.stderr)
    if not rows:
        raise InputError(f"no check is called '{only}'; run 'slipstick verify' without --only to see their names")
    print_rows(rows)
    if markdown is not None:
        _write(rows, markdown)
    failed = [row for row in rows if not row.ok]
    answer["checks"] = [{**row._asdict(), "ok": row.ok} for row in rows]
    say(f"{len(rows) - len(failed)} of {len(rows)} checks pass")
    for row in failed:
        say(f"failed: {row.name} {row.what}: expected {row.expected}, found {row.found} ({row.verdict})")
    return STOPPED if failed else DONE


def _write(rows: Sequence[Row], path: Path) -> None:
    from slipstick import __version__
    from slipstick.verify.table import table_page

    try:
        path.write_text(table_page(rows, __version__), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}; choose another file") from None


def print_rows(rows: Sequence[Row]) -> None:
    """The table, as wide as the terminal or 140 characters."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(show_edge=False, pad_edge=False)
    for title, right in (("", False), ("what", False), ("expected", True), ("found", True), ("allowed", True)):
        table.add_column(title, justify="right" if right else "left", no_wrap=right)
    table.add_column("verdict")
    for row in rows:
        cells = (row.name, row.what, row.expected, row.found, row.tolerance)
        table.add_row(*map(Text, cells), Text(row.verdict, "green" if row.ok else "bold red"))
    console = Console()
    Console(width=console.width if console.is_terminal else 140).print(table)
