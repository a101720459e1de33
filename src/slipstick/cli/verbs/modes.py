"""The verb ``modes``: a nonlinear mode over its amplitude."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slipstick.cli.options import CasePath, Force, Quiet, TimeLimit, folder_option, run_options
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.verb import verb
from slipstick.cli.verbs.run import run_case


@verb
def modes(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-modes")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figures.")] = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
) -> int:
    """Follow free vibration in a mode (table "modes") over its amplitude: frequency, damping, peaks of all loads."""
    options = run_options(time_limit, figures=figures, report=True, quiet=quiet, answer=answer)
    example = "from = 0.01, to = 10.0"
    return run_case(case, output, table="modes", example=example, force=force, options=options)
