"""The verb ``wear``: wear of the contacts over cycles of vibration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slipstick.cli.options import CasePath, Force, Quiet, Report, TimeLimit, folder_option, run_options
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.verb import verb
from slipstick.cli.verbs.run import run_case


@verb
def wear(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-wear")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
    report: Report = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
) -> int:
    """Wear the contacts of a case over the cycles of its table "wear"; results.nc is written point by point."""
    options = run_options(time_limit, figures=figures, report=report, quiet=quiet, answer=answer)
    example = "kappa = { tip = 1e-9 }, to = 1e6, omega = 9.0"
    return run_case(case, output, table="wear", example=example, force=force, options=options)
