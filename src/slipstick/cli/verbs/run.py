"""The verb ``run``: compute a case with everything kept as it is found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from slipstick.cli.names import command_name
from slipstick.cli.options import (
    PLAIN,
    CasePath,
    Figures,
    Force,
    Formats,
    NoFigures,
    Quiet,
    Report,
    RunOptions,
    TimeLimit,
    Wanted,
    folder_option,
    run_options,
)
from slipstick.cli.terminal.answers import Answer, case_answer, files_in, results_answer
from slipstick.cli.terminal.guard import (
    BAD_INPUT,
    DONE,
    complain,
    prepare_kernel,
    report_or_warn,
    say,
    say_results,
    say_untouched,
    stopped_code,
    termination_as_interrupt,
    warn_user,
    warnings_said,
)
from slipstick.cli.verb import verb
from slipstick.cli.verbs.check import print_warnings
from slipstick.errors import InputError, reason_of
from slipstick.runs.failures import fault_sentence
from slipstick.runs.folder import REPORT, OutputFolder

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from slipstick.case.case import Case
    from slipstick.results.solutions import Solutions
    from slipstick.results.table import ResultTable
    from slipstick.runs.run import CaseRun


@verb
def run(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-results")] = None,
    force: Force = False,
    figures: Figures = None,
    formats: Formats = None,
    no_figures: NoFigures = False,
    report: Report = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
) -> int:
    """Compute a case: results.nc, written point by point, and report.html."""
    options = run_options(
        time_limit, (figures, formats), figures=not no_figures, report=report, quiet=quiet, answer=answer
    )
    return run_case(case, output, force=force, options=options)


def run_case(
    path: Path, output: Path | None, *, table: str = "", example: str = "", force: bool = False,
    options: RunOptions = PLAIN,
) -> int:  # fmt: skip
    """Compute what ``[response]``, or another ``table``, of a case asks for into a folder; the exit code.

    ``example`` is what could stand in a table that is missing.

    Raises
    ------
    InputError
        If the case has faults or its results cannot be written, before anything is computed.
    """
    from slipstick.case.case import Case
    from slipstick.cli.terminal.first_run import start_interpreted
    from slipstick.runs.run import CaseRun

    case = case_with(path, table, example, options.tell) if table else Case.from_file(path, options.tell)
    if not table:
        start_interpreted(case, options.tell)
    case_warnings = print_warnings(case)
    folder = output if output is not None else Path(f"{case.name}-results")
    with OutputFolder(folder, case_path=path, case_text=case.text, force=force) as place:
        return computed(CaseRun(case, place, case_warnings, table=table), options)


def case_with(path: Path, table: str, example: str, tell: Callable[[str], None]) -> Case:
    """A case with a table of that name; InputError, with what could stand there, for one without."""
    from slipstick.case.case import Case

    case = Case.from_file(path, tell)
    if table not in case.further:
        raise InputError(f"{path}: [{table}] is missing; give it, such as {example}")
    return case


def computed(run: CaseRun, options: RunOptions) -> int:
    """Compute a run with its figures and report, and print its progress; the exit code."""
    from slipstick.cli.terminal.display import ShownCurve, curve_display

    case = run.case
    options.tell(f"{case.title}: {run.description}")
    if case.preloaded is not None:
        for line in (*case.preloaded.table().splitlines(), *case.preloaded.notes):
            options.tell(line)
    if case.plan is not None:
        options.tell("[study] is for 'slipstick study'; this computes the case itself")
    for name in () if run.table else case.further:
        options.tell(f"[{name}] is for 'slipstick {command_name(name)}'; this computes [response]")
    run.until = options.until
    prepare_kernel(options.tell)
    factor, unit = run.shown_in
    start, stop = (value / factor for value in run.span)
    with termination_as_interrupt(), curve_display(start, stop, unit, quiet=options.quiet) as display:
        run.compute(ShownCurve(run, display))
    if run.nothing:
        run.folder.discard()
    if options.figures and (run.table or options.wanted.names) and run.points > 1 and not run.failures:
        _draw(run, options.wanted)
    reported = options.report and bool(run.points) and _reported(run)
    with termination_as_interrupt(), warnings_said():
        run.finish()
    _summarise_doubled(run)
    _summary(run, options, reported=reported)
    if options.answer is not None:
        options.answer.update(_answer(run))
    if run.complete:
        return DONE
    return BAD_INPUT if run.failures and not run.points else stopped_code(run.outcome, run.points)


def _doubled(run: CaseRun) -> list[Answer]:
    """Branches of twice the period."""
    return [
        {"file": file.name, "outcome": branch.outcome.name, "message": branch.message, "points": len(branch)}
        for file, branch in run.doubled.items()
    ]


def _summarise_doubled(run: CaseRun) -> None:
    if not (run.doubles and run.points):
        return
    from slipstick.results.stability import PERIOD_DOUBLING

    for file, branch in run.doubled.items():
        say(f"twice the period, {file.name}: {len(branch)} points, {branch.message or branch.outcome.text}")
    if run.complete and PERIOD_DOUBLING not in run.found["kind"].to_numpy():
        say("the period doubles nowhere, so no motion of twice the period was followed")


def _answer(run: CaseRun) -> Answer:
    """The answer of a run as data."""
    ended = {"outcome": run.outcome.name, "message": run.text, "seconds": run.seconds, "errors": run.failures}
    said = {"warnings": list(dict.fromkeys([*run.case_warnings, *run.run_warnings]))}
    results = results_answer(run.found) if run.points else {"points": 0, "peaks": []}
    if run.table:
        table = run.case.further[run.table]
        results |= table.summary(run.case, run.branch)[1] if run.points else table.nothing
    doubled = {"subharmonics": _doubled(run)} if run.doubles else {}
    files = {} if run.nothing else files_in(run.folder.work)
    return {**case_answer(run.case), **ended, **said, **results, **doubled, **files}


def _draw(run: CaseRun, wanted: Wanted) -> None:
    """Draw the wanted figures; warn of those for which these results hold nothing."""
    from slipstick.plots import save_figure

    try:
        drawings = _drawings(run)
    except Exception as error:
        run.failures.append(f"figures: {fault_sentence(error)}")
        return
    for name in drawings if run.table else wanted.names:
        if name not in drawings:
            if not wanted.all_there:
                warn_user(f"figures: there is nothing in these results to draw of '{name}'")
            continue
        try:
            try:
                drawn = drawings[name]()
            except InputError as error:
                warn_user(f"figures: '{name}' is not drawn: {reason_of(error)}")
                continue
            save_figure(drawn, run.folder.work / name, formats=wanted.formats)
        except KeyboardInterrupt:
            run.failures.append("figures: interrupted; all points are kept")
            return
        except Exception as error:
            run.failures.append(f"figures: {fault_sentence(error)}")


def _drawings(run: CaseRun) -> dict[str, Callable[[], Axes]]:
    """Figures that these results allow, by name; loops and states at the point of the largest amplitude."""
    import numpy as np

    from slipstick import plots
    from slipstick.results.contacts import has_orbit, has_states
    from slipstick.results.view import first_dof, orders_of, phases_at, place_of

    branch = run.branch
    if run.table:
        drawn: dict[str, Callable[[], Axes]] = run.case.further[run.table].figures(branch)
        return drawn
    data = run.found.to_dataset()
    dof = first_dof(data)
    top = int(data["amplitude"].sel(dof=dof).to_numpy().argmax())
    drawings: dict[str, Callable[[], Axes]] = {
        "response": lambda: plots.response(data, dof, references=_references(run.case)),
        "mean": lambda: plots.mean(data, dof),
        "spectrum": lambda: plots.spectrum(branch, top, dof),
        "history": lambda: plots.history(branch, top, dof),
    }
    orders = orders_of(data)
    if 1 in orders and np.isfinite(phases_at(data, [place_of(data, "dof", dof)], orders.index(1))).any():
        drawings["phase"] = lambda: plots.phase(data, dof)
    if not data.sizes["contact"]:
        return drawings
    busiest = str(data["contact"].to_numpy()[int(data["dissipated_power"].max("point").to_numpy().argmax())])
    drawings |= {
        "power": lambda: plots.power(data),
        "loop": lambda: plots.loops(branch, top, busiest)[0],
    }
    if has_orbit(branch, top, busiest):
        drawings["orbit"] = lambda: plots.orbit(branch, top, busiest)
    if "stick_fraction" in data and np.isfinite(data["stick_fraction"].sel(contact=busiest)).any():
        drawings["fractions"] = lambda: plots.fractions(data, busiest)
    if has_states(branch, top):
        drawings["states"] = lambda: plots.states(branch, top)
    if "friction_coefficient" in data and np.ptp(data["friction_coefficient"].to_numpy()) > 0:
        drawings["friction"] = lambda: plots.friction(data, busiest)
    if "temperature" in data and data["temperature"].notnull().any():
        drawings["temperature"] = lambda: plots.temperature(data, busiest)
    return drawings


def _references(case: Case) -> dict[str, Solutions]:
    """Linear responses without contact and fully stuck, over the range of frequencies."""
    if case.parameter is not None:
        return {}
    from slipstick.analysis.curve.linear import linear_references

    return dict(linear_references(case.balance, case.omega))


def _reported(run: CaseRun) -> bool:
    """Write the report; whether it is written."""
    from slipstick.report.writing import write_report

    return report_or_warn(lambda: write_report(run.branch, run.folder.work / REPORT))


def _summary(run: CaseRun, options: RunOptions, *, reported: bool) -> None:
    from slipstick.progress import duration

    folder = run.folder
    if run.points:
        data = run.found
        lines = run.case.further[run.table].summary(run.case, run.branch)[0] if run.table else peak_lines(data)
        for line in lines:
            options.tell(line)
        if "coordinates_of_motion" in data.attrs:
            options.tell(f"all motion is {data.attrs['coordinates_of_motion']}")
        for sentence in run.run_warnings:
            warn_user(sentence)
        iterations = int(data["newton_iterations"].to_numpy().sum())
        options.tell(f"{run.points} points, {iterations} Newton iterations, {duration(run.seconds)}")
    if not run.failures:
        say(run.text)
    if run.points:
        say_results(folder.work, reported=reported)
    elif not run.nothing:
        say(f"no results in {folder.work}: no point was found")
    if run.unfinished and not run.nothing:
        say(f"go on with: slipstick resume {folder.folder}")
    say_untouched(folder)
    for failure in run.failures:
        complain(f"error: {failure}")


def peak_lines(data: ResultTable, most: int = 12) -> list[str]:
    """One line for each located peak, the largest first; those of rotations, in rad, after those of lengths."""
    from slipstick.results.view import at_text, listed_peaks, value_text

    return [
        f"peak of {peak.dof}: amplitude {value_text(data, 'amplitude', peak.amplitude, peak.dof)} at "
        f"{at_text(data, peak.at)}"
        for peak in listed_peaks(data)[:most]
    ]
