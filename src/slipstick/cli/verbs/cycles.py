"""The verb ``cycles``: self-excited vibration over a parameter."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipstick.cli.one_table import case_with, folder_of, quietly, shown, written
from slipstick.cli.options import CasePath, Force, KeptTimeLimit, Quiet, folder_option
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import say
from slipstick.cli.verb import verb
from slipstick.units import after_number, unit_of_dof

if TYPE_CHECKING:
    from slipstick.branch import Branch
    from slipstick.case.case import Case


@verb
def cycles(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-cycles")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figures.")] = True,
    quiet: Quiet = False,
    time_limit: KeptTimeLimit = None,
) -> int:
    """Follow self-excited vibration, such as squeal, over the parameter of the table "cycles"."""
    from slipstick.analysis.self_excited.limit_cycles import limit_cycles

    read, table = case_with(case, "cycles", 'parameter = "pad.mu", from = 0.3, to = 0.8')
    with folder_of(read, output, "cycles", force) as folder:
        with shown(time_limit, quiet=quiet, answer=answer) as listeners:
            branch = quietly(
                limit_cycles,
                read.problem(), table.parameter, (table.start, table.stop), requested=table.at, listeners=listeners,
            )  # fmt: skip
        unit = after_number(str(branch.table["parameter"].attrs.get("units", "")))
        answer["marked"] = []
        for bifurcation in branch.bifurcations():
            at = f"{table.parameter} = {bifurcation.value:.6g}{unit}"
            say(f"{bifurcation.kind}: {at}, {read.frequency_text(bifurcation.omega)}")
            marked = {"kind": bifurcation.kind, "parameter": bifurcation.value, "omega": bifurcation.omega}
            answer["marked"].append({**marked, "before": bifurcation.before, "after": bifurcation.after})
        answer["cycles"] = _asked_for(read, branch, table, unit)
        of = table.dof
        drawn = {"response": lambda b: b.plot.response(of), "stability": lambda b: b.plot.stability()}
        return written(read, branch, folder, answer, figures=drawn if figures and len(branch) else {})


def _asked_for(case: Case, branch: Branch, table: Any, unit: str) -> list[Answer]:
    """The limit cycles at the values asked for, said; where there are several at one, each."""
    data, d = branch.table, branch.dof_index(table.dof)
    part, kinds, stable = (data[name].to_numpy() for name in ("branch_part", "kind", "stable"))
    value, omega = data["parameter"].to_numpy(), data["omega"].to_numpy()
    size = data["amplitude"].to_numpy()[:, d]
    length = after_number(unit_of_dof(str(data["amplitude"].attrs.get("units", "")), data["dof"].to_numpy()[d]))
    answers: list[Answer] = []
    for k in ((kinds == "requested") & (part == 1)).nonzero()[0]:
        sure = {0: False, 1: True}.get(int(stable[k]))
        verdict = {False: ", unstable", True: ", stable", None: ""}[sure]
        where = f"{table.parameter} = {value[k]:.6g}{unit}: {case.frequency_text(omega[k])}"
        say(f"limit cycle at {where}, amplitude {size[k]:.6g}{length}{verdict}")
        cycle = {"parameter": value[k], "omega": omega[k], "amplitude": size[k], "stable": sure}
        answers.append(cycle)
    return answers
