"""The verb ``run-up``: passing through, or long motion at one speed, in time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipstick.cli.one_table import case_with, quietly
from slipstick.cli.options import CasePath, Quiet, folder_option
from slipstick.cli.terminal.answers import Answer, files_in
from slipstick.cli.terminal.guard import DONE, STOPPED, complain, say, termination_as_interrupt
from slipstick.cli.verb import verb
from slipstick.errors import InputError
from slipstick.units import after_number

if TYPE_CHECKING:
    from slipstick.analysis.time_domain.long_run import PeriodDone

_EVERY = 50
"""Periods after which the terminal shows how far it is."""


@verb
def run_up(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-run-up")] = None,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
    quiet: Quiet = False,
) -> int:
    """Integrate a case in time while its speed changes, as its table "run_up" says; called again it goes on."""
    from slipstick.plots import save_figure
    from slipstick.plots.passing import run_up as draw
    from slipstick.runs.passing_through import FILE
    from slipstick.runs.passing_through import run_up as integrate

    read, table = case_with(case, "run_up", "from = 4.0, to = 15.0, rate = 0.05")
    folder = output or Path(f"{read.name}-run-up")

    def show(done: PeriodDone) -> None:
        if not quiet and done.checkpoint.period % _EVERY == 0:
            complain(f"  period {done.checkpoint.period}, {read.frequency_text(float(done.values['omega']))}")

    with termination_as_interrupt():
        run = quietly(
            integrate, read.problem(), table.omega, rate=table.rate, periods=table.periods, samples=table.samples,
            folder=folder, listener=show,
        )  # fmt: skip
    data = run.dataset
    unit = after_number(str(data["amplitude"].attrs.get("units", "")))
    of = str(table.dof or data["dof"].to_numpy()[0])
    done = str(data.attrs["outcome"]) == "COMPLETED"
    answer |= {"outcome": str(data.attrs["outcome"]), "periods": data.sizes["period"]}
    if data.sizes["period"]:
        answer |= _told(run, of, unit, read)
        if figures:
            save_figure(draw(run, of), folder / "run_up", formats=("png",))
    say(str(data.attrs["outcome_text"]))
    say(f"results in {folder}/: {FILE}")
    if not done:
        say(f"go on with: slipstick run-up {case} -o {folder}")
    answer |= files_in(folder)
    return DONE if done else STOPPED


def _told(run: Any, of: str, unit: str, read: Any) -> dict[str, Any]:
    """The largest amplitude on the way, or what motion it is at one speed."""
    if run.dataset.attrs["rate"]:
        peak = run.peak(of)
        say(f"largest amplitude of {of}: {peak.amplitude:.6g}{unit} at {read.frequency_text(peak.omega)}")
        return {"peak": {"dof": of, "omega": peak.omega, "amplitude": peak.amplitude}}
    try:
        motion = run.motion(of)
    except InputError as error:
        say(str(error))
        return {}
    second = f", second frequency {read.frequency_text(motion.second_omega)}" if motion.second_omega > 0.0 else ""
    say(f"the motion of {of} is {motion.kind}{second}")
    return {"motion": motion.kind}
