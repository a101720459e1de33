"""The verb ``track``: a peak over a parameter."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slipstick.cli.options import CasePath, Force, Quiet, TimeLimit, folder_option, run_options
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.verb import verb
from slipstick.cli.verbs.run import run_case


@verb
def track(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-track")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
) -> int:
    """Follow the peak of a case over the parameter of its table "track", without the curves between."""
    options = run_options(time_limit, figures=figures, report=True, quiet=quiet, answer=answer)
    example = 'parameter = "damper.normal_load", from = 10, to = 1000'
    return run_case(case, output, table="track", example=example, force=force, options=options)
