"""The verb ``cycles``: self-excited vibration over a parameter."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.app.terminal.answers import Answer
from slipstick.app.terminal.guard import say
from slipstick.app.verbs.one_table import case_with, folder_of, quietly, written
from slipstick.case.case import Case
from slipstick.units import after_number

if TYPE_CHECKING:
    from slipstick.branch import Branch


def cycles_case(path: Path, output: Path | None, answer: Answer, *, force: bool = False, figures: bool = True) -> int:
    """Follow the limit cycles of ``[cycles]`` into a folder, by default ``CASE-cycles``; the exit code.

    Raises
    ------
    InputError
        If the case has faults or no ``[cycles]``, something in it varies in time by itself, or the folder holds
        results.
    """
    from slipstick.analysis.self_excited.limit_cycles import limit_cycles

    case, table = case_with(path, "cycles", 'parameter = "pad.mu", from = 0.3, to = 0.8')
    with folder_of(case, output, "cycles", force) as folder:
        branch = quietly(limit_cycles, case.problem(), table.parameter, (table.start, table.stop), requested=table.at)
        unit = after_number(str(branch.table["parameter"].attrs.get("units", "")))
        answer["marked"] = []
        for found in branch.bifurcations():
            say(f"{found.kind}: {table.parameter} = {found.value:.6g}{unit}, {case.frequency_text(found.omega)}")
            marked = {"kind": found.kind, "parameter": found.value, "omega": found.omega}
            answer["marked"].append({**marked, "before": found.before, "after": found.after})
        answer["cycles"] = _asked_for(case, branch, table, unit)
        of = table.dof
        drawn = {"response": lambda b: b.plot.response(of), "stability": lambda b: b.plot.stability()}
        return written(case, branch, folder, answer, figures=drawn if figures and len(branch) else {})


def _asked_for(case: Case, branch: Branch, table: Any, unit: str) -> list[Answer]:
    """The limit cycles at the values asked for, said; where there are several at one, each."""
    data, d = branch.table, branch.dof_index(table.dof)
    part, kinds, stable = (data[name].to_numpy() for name in ("branch_part", "kind", "stable"))
    value, omega = data["parameter"].to_numpy(), data["omega"].to_numpy()
    size, length = data["amplitude"].to_numpy()[:, d], after_number(str(data["amplitude"].attrs.get("units", "")))
    answers: list[Answer] = []
    for k in ((kinds == "requested") & (part == 1)).nonzero()[0]:
        sure = {0: False, 1: True}.get(int(stable[k]))
        verdict = {False: ", unstable", True: ", stable", None: ""}[sure]
        where = f"{table.parameter} = {value[k]:.6g}{unit}: {case.frequency_text(omega[k])}"
        say(f"limit cycle at {where}, amplitude {size[k]:.6g}{length}{verdict}")
        found = {"parameter": value[k], "omega": omega[k], "amplitude": size[k], "stable": sure}
        answers.append(found)
    return answers
