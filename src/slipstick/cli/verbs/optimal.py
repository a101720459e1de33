"""The verb ``optimal``: where the peak over a parameter is lowest."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipstick.cli.one_table import case_with, folder_of, peak_text, quietly, range_of, shown, written
from slipstick.cli.options import CasePath, Force, KeptTimeLimit, Quiet, folder_option
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import say
from slipstick.cli.verb import verb
from slipstick.errors import InputError
from slipstick.units import after_number

if TYPE_CHECKING:
    from slipstick.analysis.peaks.optimum import Optimum
    from slipstick.analysis.road.events import EventFunction
    from slipstick.branch import Branch
    from slipstick.case.case import Case


@verb
def optimal(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-optimal")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
    quiet: Quiet = False,
    time_limit: KeptTimeLimit = None,
) -> int:
    """Find the value of a parameter, that of its table "optimal", at which the peak is lowest."""
    from slipstick.analysis.peaks.optimum import optimal

    read, table = case_with(case, "optimal", 'parameter = "damper.normal_load"')
    with folder_of(read, output, "optimal", force) as folder:
        with shown(time_limit, quiet=quiet, answer=answer) as listeners:
            optimum = quietly(
                optimal,
                read.problem(), table.parameter, omega=range_of(read, table), dof=table.dof, start=table.start,
                listeners=listeners,
            )  # fmt: skip
            branch = _among_peaks(read, table, optimum, listeners)
        answer |= {"value": optimum.value, "omega": optimum.omega, "amplitude": optimum.amplitude, "kind": optimum.kind}
        if optimum.kind:
            unit = after_number(str(optimum.branch.table["parameter"].attrs.get("units", "")))
            d = optimum.branch.dof_index(optimum.dof)
            where = peak_text(read, optimum.branch, d, optimum.amplitude, optimum.omega)
            at = f"{table.parameter} = {optimum.value:.8g}{unit}"
            say(f"the peak of {optimum.dof} is {optimum.kind} at {at}: {where}")
        drawn = {"response": lambda branch: branch.plot.response(optimum.dof)} if figures and len(branch) > 1 else {}
        return written(read, branch, folder, answer, figures=drawn)


_BESIDE = 4.0
"""The peak is shown from this part of the optimal value to as many times it."""


def _among_peaks(case: Case, table: Any, optimum: Optimum, listeners: Sequence[EventFunction]) -> Branch:
    """The peak over values round the optimal one, which is marked; the optimum alone where it is not met again."""
    from slipstick.analysis.peaks.tracking import track_peak

    if not optimum.kind or optimum.value == 0.0:
        return optimum.branch
    span = (optimum.value / _BESIDE, optimum.value * _BESIDE)
    try:
        peaks = quietly(
            track_peak, case.problem(), table.parameter, span, omega=range_of(case, table), dof=optimum.dof,
            listeners=listeners,
        )  # fmt: skip
    except InputError:  # a parameter that cannot have such values
        return optimum.branch
    data = peaks.table
    met = data["parameter"].to_numpy()[data["kind"].to_numpy() == "optimum"]
    near = abs(met - optimum.value) <= _SAME * abs(optimum.value)
    return peaks if peaks.outcome.ok and near.any() else optimum.branch


_SAME = 1e-6
