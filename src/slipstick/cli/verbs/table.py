"""The verb ``table``: results as CSV, Excel, MATLAB or universal files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slipstick.cli.options import ForceFile, refuse_file, results_files
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import say
from slipstick.cli.verb import verb


@verb
def table(
    answer: Answer,
    results: Annotated[
        Path,
        typer.Argument(
            metavar="RESULTS",
            help="A results file or its folder: of a run, a study, a run-up, a fit.",
            autocompletion=results_files,
        ),
    ],
    output: Annotated[
        Path, typer.Argument(metavar="FILE", help="The file to write: out.csv, out.xlsx, out.mat or out.uff.")
    ],
    name: Annotated[
        str | None,
        typer.Option("--table", metavar="NAME", help='Which table, such as "peaks"; a wrong name lists them.'),
    ] = None,
    force: ForceFile = False,
) -> None:
    """Write results for other programs: .csv, .xlsx (Excel), .mat (MATLAB, Octave), .uff (response functions)."""
    from slipstick.runs.tables import save_table

    refuse_file(output, force=force)
    written = save_table(results, output, name)
    answer["table"] = written
    say(f"table in {written} ({written.stat().st_size / 1e6:.2g} MB)")
