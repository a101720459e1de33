"""The verb ``modes``: a nonlinear mode over its amplitude."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from slipstick.cli.one_table import case_with, folder_of, peak_text, quietly, shown, written
from slipstick.cli.options import CasePath, Force, KeptTimeLimit, Quiet, folder_option
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import say
from slipstick.cli.verb import verb


@verb
def modes(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-modes")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figures.")] = True,
    quiet: Quiet = False,
    time_limit: KeptTimeLimit = None,
) -> int:
    """Follow free vibration in a mode (table "modes") over its amplitude: frequency, damping, peaks of all loads."""
    from slipstick.analysis.modes.nonlinear_modes import nonlinear_modes
    from slipstick.plots import backbone, damping

    read, table = case_with(case, "modes", "from = 0.01, to = 10.0")
    with folder_of(read, output, "modes", force) as folder:
        with shown(time_limit, quiet=quiet, answer=answer) as listeners:
            branch = quietly(
                nonlinear_modes,
                read.problem(), amplitude=(table.start, table.stop), mode=table.mode, dof=table.dof,
                load_factors=table.load_factors, listeners=listeners,
            )  # fmt: skip
        data, d = branch.table, branch.dof_index(table.dof)
        factor, ratio = data["load_factor"].to_numpy(), data["modal_damping"].to_numpy()
        size, omega = data["amplitude"].to_numpy()[:, d], data["omega"].to_numpy()
        asked = (data["kind"].to_numpy() == "requested").nonzero()[0]
        for k in asked:
            peak = peak_text(read, branch, d, size[k], omega[k])
            say(f"loads times {factor[k]:.6g}: {peak}, damping ratio {100.0 * ratio[k]:.3g} %")
        answer["peaks"] = [
            {"load_factor": factor[k], "omega": omega[k], "amplitude": size[k], "damping": ratio[k]} for k in asked
        ]
        drawn = {"backbone": backbone, "damping": damping} if figures else {}
        return written(read, branch, folder, answer, figures=drawn)
