"""The verb ``run-up``: passing through, or long motion at one speed, in time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipstick.cli.options import CasePath, Force, Quiet, Report, RunOptions, TimeLimit, folder_option, run_options
from slipstick.cli.terminal.answers import Answer, files_in
from slipstick.cli.terminal.guard import (
    DONE,
    complain,
    prepare_kernel,
    quietly,
    report_or_warn,
    say,
    say_results,
    say_untouched,
    stopped_code,
    termination_as_interrupt,
    warn_user,
)
from slipstick.cli.verb import verb
from slipstick.cli.verbs.run import case_with
from slipstick.errors import InputError, Outcome, reason_of
from slipstick.runs.folder import PASSED, REPORT, OutputFolder

if TYPE_CHECKING:
    from slipstick.analysis.time_domain.long_run import PeriodDone
    from slipstick.case.case import Case

_EVERY = 50
"""Periods after which the terminal shows how far it is."""


@verb
def run_up(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-run-up")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
    report: Report = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
) -> int:
    """Integrate a case in time while its speed changes, as its table "run_up" says; called again it goes on."""
    options = run_options(time_limit, figures=figures, report=report, quiet=quiet, answer=answer)
    read = case_with(case, "run_up", "from = 4.0, to = 15.0, rate = 0.05", options.tell)
    prepare_kernel(complain)
    folder = output or Path(f"{read.name}-run-up")
    with OutputFolder(folder, writes="run_up", force=force, goes_on=True) as place:
        return computed(read, place, options)


def computed(read: Case, place: OutputFolder, options: RunOptions) -> int:
    """Integrate what the table "run_up" of a case asks for, from the start or on; the exit code."""
    from slipstick.plots import save_figure
    from slipstick.plots.passing import run_up as draw
    from slipstick.report.writing import write_run_up_report
    from slipstick.runs.passing_through import run_up_of_case
    from slipstick.runs.run import Clock

    table, answer = read.further["run_up"], options.answer if options.answer is not None else {}

    def show(done: PeriodDone) -> None:
        if not options.quiet and done.checkpoint.period % _EVERY == 0:
            complain(f"  period {done.checkpoint.period}, {read.frequency_text(float(done.values['omega']))}")

    folder = place.work
    with termination_as_interrupt():
        run = quietly(run_up_of_case, read, table, folder, show, (Clock(options.until),))
    data = run.dataset
    for sentence in str(data.attrs["warnings"]).splitlines():
        warn_user(sentence)
    of = str(table.dof or data["dof"].to_numpy()[0])
    done = str(data.attrs["outcome"]) == "COMPLETED"
    reported = False
    answer |= {"outcome": str(data.attrs["outcome"]), "periods": data.sizes["period"]}
    if data.sizes["period"]:
        answer |= _summary(run, of, read)
        if options.figures:
            save_figure(draw(run, of), folder / "run_up", formats=("png",))
        if options.report:
            reported = report_or_warn(lambda: write_run_up_report(run, folder / REPORT))
    if done:
        place.complete()
    say(str(data.attrs["outcome_text"]))
    say_results(place.work, PASSED, reported=reported)
    if not done:
        say(f"go on with: slipstick resume {place.folder}")
    say_untouched(place)
    answer |= files_in(place.work)
    return DONE if done else stopped_code(Outcome[data.attrs["outcome"]], data.sizes["period"])


def _summary(run: Any, of: str, read: Any) -> dict[str, Any]:
    """The largest half range on the way, or what motion it is at one speed."""
    from slipstick.results.view import value_text

    if run.dataset.attrs["rate"]:
        peak = run.peak(of)
        size = value_text(run.dataset, "amplitude", peak.amplitude, of)
        say(f"largest half range of {of}: {size} at {read.frequency_text(peak.omega)}")
        return {"peak": {"dof": of, "omega": peak.omega, "amplitude": peak.amplitude}}
    try:
        motion = run.motion(of)
    except InputError as error:
        say(reason_of(error))
        return {}
    second = f", second frequency {read.frequency_text(motion.second_omega)}" if motion.second_omega > 0.0 else ""
    say(f"the motion of {of} is {motion.kind}{second}")
    return {"motion": motion.kind}
