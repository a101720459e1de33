"""The verb ``cycles``: self-excited vibration over a parameter."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slipstick.cli.options import CasePath, Force, Quiet, TimeLimit, folder_option, run_options
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.verb import verb
from slipstick.cli.verbs.run import run_case


@verb
def cycles(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-cycles")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figures.")] = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
) -> int:
    """Follow self-excited vibration, such as squeal, over the parameter of the table "cycles"."""
    options = run_options(time_limit, figures=figures, report=True, quiet=quiet, answer=answer)
    example = 'parameter = "pad.mu", from = 0.3, to = 0.8'
    return run_case(case, output, table="cycles", example=example, force=force, options=options)
