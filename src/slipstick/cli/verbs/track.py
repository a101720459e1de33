"""The verb ``track``: a peak over a parameter."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slipstick.cli.one_table import case_with, folder_of, peak_text, quietly, range_of, shown, written
from slipstick.cli.options import CasePath, Force, KeptTimeLimit, Quiet, folder_option
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import say
from slipstick.cli.verb import verb
from slipstick.units import after_number


@verb
def track(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-track")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
    quiet: Quiet = False,
    time_limit: KeptTimeLimit = None,
) -> int:
    """Follow the peak of a case over the parameter of its table "track", without the curves between."""
    from slipstick.analysis.peaks.tracking import track_peak

    read, table = case_with(case, "track", 'parameter = "damper.normal_load", from = 10, to = 1000')
    with folder_of(read, output, "track", force) as folder:
        with shown(time_limit, quiet=quiet, answer=answer) as listeners:
            branch = quietly(
                track_peak,
                read.problem(), table.parameter, (table.start, table.stop), omega=range_of(read, table), dof=table.dof,
                requested=table.at, listeners=listeners,
            )  # fmt: skip
        data, unit = branch.table, after_number(str(branch.table["parameter"].attrs.get("units", "")))
        kinds, value = data["kind"].to_numpy(), data["parameter"].to_numpy()
        d = branch.dof_index(str(data.attrs["peak_of"]))
        size, omega = data["amplitude"].to_numpy()[:, d], data["omega"].to_numpy()
        marked = [k for k in range(len(branch)) if kinds[k] in ("optimum", "turning point", "tie")]
        for k in marked:
            say(
                f"{kinds[k]}: {table.parameter} = {value[k]:.6g}{unit}, {peak_text(read, branch, d, size[k], omega[k])}"
            )
        answer["marked"] = [
            {"kind": str(kinds[k]), "parameter": value[k], "omega": omega[k], "amplitude": size[k]} for k in marked
        ]
        of = str(data.attrs["peak_of"])
        drawn = {"response": lambda branch: branch.plot.response(of)} if figures else {}
        return written(read, branch, folder, answer, figures=drawn)
