"""The verbs that compute what one table of a case asks for, point by point: all alike."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from slipstick.case import RENAMED
from slipstick.cli.names import command_name
from slipstick.cli.options import CasePath, Force, Quiet, Report, TimeLimit, folder_option, run_options
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import warn_user
from slipstick.cli.verb import verb
from slipstick.cli.verbs.run import run_case


def _verb(table: str, about: str, example: str, name: str = "") -> Callable[..., None]:
    """The verb of a table, with its help and what could stand in the table where it is missing; or by an old name."""
    called = command_name(name or table)

    def computed(
        answer: Answer,
        case: CasePath,
        output: Annotated[Path | None, folder_option(f"CASE-{called}")] = None,
        force: Force = False,
        figures: Annotated[bool, typer.Option(help="Draw the figures.")] = True,
        report: Report = True,
        quiet: Quiet = False,
        time_limit: TimeLimit = None,
    ) -> int:
        if name:
            warn_user(f"'slipstick {called}' is now called 'slipstick {command_name(table)}'")
        options = run_options(time_limit, figures=figures, report=report, quiet=quiet, answer=answer)
        folder = output or Path(f"{case.stem}-{called}")
        return run_case(case, folder, table=table, example=example, force=force, options=options)

    computed.__doc__ = about
    return verb(computed)


_TABLES = {
    "track": (
        'Follow the peak of a case over the parameter of its table "track", without the curves between.',
        'parameter = "damper.normal_load", from = 10, to = 1000',
    ),
    "optimal": (
        'Find the value of a parameter, that of its table "optimal", at which the peak is lowest.',
        'parameter = "damper.normal_load"',
    ),
    "modes": (
        'Follow free vibration in a mode (table "modes") over its amplitude: frequency, damping, peaks of all loads.',
        "from = 0.01, to = 10.0",
    ),
    "limit_cycles": (
        'Follow self-excited vibration, such as squeal, over the parameter of the table "limit_cycles".',
        'parameter = "pad.mu", from = 0.3, to = 0.8',
    ),
    "wear": (
        'Wear the contacts of a case over the cycles of its table "wear"; results.nc is written point by point.',
        "kappa = { tip = 1e-9 }, to = 1e6, omega = 9.0",
    ),
}
"""What each verb does, and what could stand in its table."""

REQUESTS = {table: _verb(table, *said) for table, said in _TABLES.items()}
OLD_NAMES = {name: _verb(table, *_TABLES[table], name) for name, table in RENAMED.items() if table in _TABLES}
"""Verbs by their old names, which no help lists; they write where they wrote."""
