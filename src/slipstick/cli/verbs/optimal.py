"""The verb ``optimal``: where the peak over a parameter is lowest."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slipstick.cli.options import CasePath, Force, Quiet, TimeLimit, folder_option, run_options
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.verb import verb
from slipstick.cli.verbs.run import run_case


@verb
def optimal(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-optimal")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
) -> int:
    """Find the value of a parameter, that of its table "optimal", at which the peak is lowest."""
    options = run_options(time_limit, figures=figures, report=True, quiet=quiet, answer=answer)
    example = 'parameter = "damper.normal_load"'
    return run_case(case, output, table="optimal", example=example, force=force, options=options)
