"""The verb ``wear``: wear of the contacts over cycles of vibration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slipstick.cli.options import CasePath, Force, Quiet, Report, RunOptions, TimeLimit, folder_option, run_options
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.verb import verb
from slipstick.errors import InputError


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
    return wear_case(case, output, force=force, options=options)


def wear_case(path: Path, output: Path | None, *, force: bool, options: RunOptions) -> int:
    """Compute the wear of a case into a folder; the exit code.

    Raises
    ------
    InputError
        If the case has faults or its results cannot be written, before anything is computed.
    """
    from slipstick.case.case import Case
    from slipstick.cli.verbs.check import print_warnings
    from slipstick.cli.verbs.run import computed
    from slipstick.runs.folder import OutputFolder
    from slipstick.runs.run import CaseRun

    case = Case.from_file(path, options.tell)
    if "wear" not in case.further:
        raise InputError(f"{path}: [wear] is missing; give it, such as kappa = {{ tip = 1e-9 }}, to = 1e6, omega = 9.0")
    told = print_warnings(case)
    folder = OutputFolder(output or Path(f"{case.name}-wear"), case_path=path, case_text=case.text, force=force)
    try:
        return computed(CaseRun(case, folder, told, wear=True), options)
    except BaseException:
        folder.abandon()
        raise
    finally:
        folder.release()
