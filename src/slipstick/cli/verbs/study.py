"""The verb ``study``: many cases of one case file, on this machine, on a cluster, or a share of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from slipstick.cli.options import (
    PLAIN,
    CasePath,
    Force,
    Quiet,
    Report,
    RunOptions,
    TimeLimit,
    folder_option,
    run_options,
)
from slipstick.cli.terminal.answers import Answer, files_in
from slipstick.cli.terminal.guard import (
    DONE,
    STOPPED,
    complain,
    prepare_kernel,
    report_or_warn,
    say,
    say_results,
    say_untouched,
    stopped_code,
    termination_as_interrupt,
    warn_user,
)
from slipstick.cli.verb import verb
from slipstick.errors import InputError, reason_of, without_points
from slipstick.runs.failures import fault_sentence
from slipstick.runs.folder import REPORT, OutputFolder, refuse_held
from slipstick.studies import CURVES_FILE, STUDY_FILE
from slipstick.units import after_number

if TYPE_CHECKING:
    import xarray

    from slipstick.case.case import Case
    from slipstick.runs.study import Spread, StudyRun
    from slipstick.studies.folder import Share
    from slipstick.studies.solving import CaseSolved

_LISTED_FAILURES = 5
_LISTED_DOFS = 3


@verb
def study(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-study")] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Processes on this machine; by default one a processor.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Dask cluster instead, such as tcp://host:8786.")
    ] = None,
    index: Annotated[int | None, typer.Option(min=0, help="Compute share I of N alone, as one of N jobs.")] = None,
    of: Annotated[int | None, typer.Option(min=1, metavar="N", help="How many shares there are.")] = None,
    missing: Annotated[bool, typer.Option("--missing", help="Also cases once more that did not complete.")] = False,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figures.")] = True,
    report: Report = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
) -> int:
    """Compute a case for all values that its table "study" names: study.nc, curves.nc, figures, report.html."""
    from slipstick.runs.study import Spread

    spread = Spread(workers=workers, scheduler=scheduler, share=share_of(index, of))
    options = run_options(time_limit, figures=figures, report=report, quiet=quiet, answer=answer)
    return run_study(case, output, spread=spread, missing=missing, force=force, options=options)


def share_of(index: int | None, of: int | None) -> Share | None:
    """The share that ``--index I --of N`` name; raises InputError where they do not go together."""
    if (index is None) != (of is None):
        raise InputError("--index and --of go together: --index 0 --of 4 is the first of four shares")
    if index is None or of is None:
        return None
    from slipstick.studies.folder import Share

    if index >= of:
        raise InputError(f"--index: found {index} of {of} shares; expected a number from 0 to {of - 1}")
    return Share(index, of)


def run_study(
    path: Path, output: Path | None, *, spread: Spread | None = None, missing: bool = False, force: bool = False,
    options: RunOptions = PLAIN,
) -> int:  # fmt: skip
    """Compute every case of a study into a folder; the exit code.

    Raises
    ------
    InputError
        If the case has faults or no ``[study]``, or the folder holds another study.
    """
    from slipstick.case.case import Case
    from slipstick.runs.study import HERE, StudyRun

    case, spread = Case.from_file(path, options.tell), spread or HERE
    folder = output if output is not None else Path(f"{case.name}-study")
    if spread.scheduler is not None and spread.workers is not None:
        raise InputError(
            "--workers and --scheduler are both given; the workers of a cluster are its own: keep one of them"
        )
    if force and (missing or spread.share is not None):
        other = "--missing" if missing else "--index"
        raise InputError(f"--force: begins a study anew, {other} goes on with the one that is there: keep one of them")
    if spread.share is not None and spread.share.of > 1:  # others write their shares meanwhile
        refuse_held(folder, "study", goes_on=True)
        return computed(StudyRun(case, folder, spread, missing=missing), options)
    goes_on = missing or spread.share is not None
    with OutputFolder(folder, writes="study", force=force, goes_on=goes_on) as place:
        return computed(StudyRun(case, place.work, spread, missing=missing), options, place)


def computed(run: StudyRun, options: RunOptions, place: OutputFolder | None = None) -> int:
    """Compute the remaining cases of a study and print their progress; the exit code.

    ``place`` is the folder of all its shares, held by the caller.
    """
    from slipstick.case.study import cases_text
    from slipstick.cli.terminal.display import study_display

    with run:
        for sentence in run.plan.warnings:
            warn_user(sentence)
        options.tell(f"{run.case.title}: {cases_text(run.plan)}; {len(run.todo)} to compute")
        if run.case.response.follow is not None:
            options.tell("follow in [response] is for 'slipstick run'; a study computes the curves alone")
        run.begin()
        if run.todo:
            prepare_kernel(options.tell)
        with termination_as_interrupt(), study_display(len(run.todo), quiet=options.quiet) as display:
            run.compute(
                lambda solved: display.case(failed=not solved.outcome.ok),
                lambda text: display.note(f"  {text}"),
                until=options.until,
            )
        if place is None:
            return _share_summary(run)
        data = run.write()
        failure, reported = _shown(run, data, options)
    done = run.folder.complete and not failure
    if done:
        place.complete()
    _summary(run, data, place, options, reported=reported)
    if failure:
        complain(f"error: {failure}")
    say_untouched(place)
    if options.answer is not None:
        options.answer.update(_answer(run, data, place.work))
    return DONE if done else stopped_code(run.stopped, len(run.folder.cases))


def _share_summary(run: StudyRun) -> int:
    share, path = run.folder.share, run.folder.folder
    cases = [solved for case, solved in run.folder.cases.items() if case in share]
    left = sum(case in share for case in range(len(run.plan))) - len(cases)
    say(f"share {share.index} of {share.of}: {len(cases)} cases computed, {left} left")
    say(f"when every share is done: slipstick resume {path}")
    _list_failures(cases)
    if run.failure:
        complain(f"error: {run.failure}")
    return STOPPED if run.failure or run.stopped or left or not all(s.outcome.ok for s in cases) else DONE


def _shown(run: StudyRun, data: xarray.Dataset, options: RunOptions) -> tuple[str, bool]:
    """Draw the figures and write the report; what failed, and whether the report is written."""
    from slipstick.cli.verbs.report import report_study

    path, failure = run.folder.folder, run.failure
    if options.figures and not failure:
        try:
            _draw(data, path)
        except InputError as error:
            failure = f"figures: {fault_sentence(error)}"
    reported = options.report and bool(run.folder.cases)
    return failure, reported and report_or_warn(lambda: report_study(path / STUDY_FILE, path / REPORT))


def _summary(run: StudyRun, data: xarray.Dataset, place: OutputFolder, options: RunOptions, *, reported: bool) -> None:
    from slipstick.results.amplification import is_mistuning

    for line in _scatter(run.case, data) if is_mistuning(data) else (*_largest(data), *_spread(data), *_indices(data)):
        options.tell(line)
    warned = [s for s in str(data.attrs["warnings"]).splitlines() if s not in run.plan.warnings]
    for sentence in warned[:1]:
        more = f" (and {len(warned) - 1} like it in other cases)" if len(warned) > 1 else ""
        warn_user(f"{sentence}{more}")
    _list_failures(list(run.folder.cases.values()))
    said = str(data.attrs["outcome_text"]) if run.stopped is None else run.stopped.text
    say(said if run.folder.cases else without_points(said))
    say_results(place.work, f"{STUDY_FILE}, {CURVES_FILE}", reported=reported)
    if len(run.folder.cases) < len(run.plan):
        say(f"go on with: slipstick resume {place.folder}")


def _draw(data: xarray.Dataset, folder: Path) -> None:
    """Map of the peaks of a study over its first parameters, and its curves by the first; of discs their scatter."""

    from slipstick import plots
    from slipstick.io.loading import load_dataset
    from slipstick.plots.style import titled
    from slipstick.results.amplification import is_mistuning, largest_alone
    from slipstick.results.percentiles import is_sampled
    from slipstick.results.view import names_of, ranked

    if not bool(data["peak_amplitude"].notnull().any()):
        return
    all_curves, scatter = load_dataset(folder / CURVES_FILE), {}
    if is_mistuning(data):
        if bool(data["amplification"].notnull().any()):
            scatter = {
                "amplification": plots.amplification_histogram(data),
                "percentiles": plots.percentile_convergence(data),
                "worst": plots.worst_disc(data),
            }
        data, all_curves = largest_alone(data, all_curves)
    dof = names_of(data, "dof")[ranked(data, "dof", "peak_amplitude")[0]]
    drawn = {} if scatter else {"map": plots.study_map(data, dof)}  # two of many blades say nothing
    drawn |= {"curves": plots.study_curves(all_curves, data, dof), **scatter}
    if is_sampled(data) and bool((data["outcome"] == "COMPLETED").any()):
        drawn["band"] = plots.percentile_band(all_curves, data, dof)
    for name, ax in drawn.items():
        titled(ax.get_figure(root=True), str(data.attrs["title"]))
        plots.save_figure(ax, folder / name)


def _list_failures(solved: list[CaseSolved]) -> None:
    failed = sorted((s for s in solved if not s.outcome.ok), key=lambda s: s.row["case"])
    if not failed:
        return
    counts = Counter(s.outcome.text.partition(";")[0] for s in failed)
    complain(f"{len(failed)} cases did not complete: {', '.join(f'{n} {text}' for text, n in counts.items())}")
    for one in failed[:_LISTED_FAILURES]:
        complain(f"  case {one.row['case']}: {one.message}")
    complain("once the cause is gone, compute them again with --missing")


def _largest(data: xarray.Dataset) -> Iterator[str]:
    """The smallest and the largest peak of a few dofs, and their parameters."""
    import numpy as np

    from slipstick.results.view import value_text

    for d, dof in enumerate(data["dof"].to_numpy()[:_LISTED_DOFS]):
        peaks = data["peak_amplitude"].isel(dof=d)
        if not bool(np.isfinite(peaks).any()):
            continue
        for word, at in (("smallest", peaks.argmin(...)), ("largest", peaks.argmax(...))):
            there = peaks[at]
            names = str(data.attrs["study_parameters"]).splitlines()
            where = ", ".join(f"{name} = {float(there[name]):.6g}" for name in names)
            yield f"{word} peak of {dof}: {value_text(data, 'peak_amplitude', float(there), str(dof))} with {where}"


def _spread(data: xarray.Dataset) -> Iterator[str]:
    """Percentiles of the peaks of samples."""
    from slipstick.results.percentiles import is_sampled, peak_percentiles
    from slipstick.results.view import unit_shown

    if not is_sampled(data) or not bool((data["outcome"] == "COMPLETED").any()):
        return
    peaks = peak_percentiles(data)
    low, _, high = peaks["percentile"].to_numpy()
    for dof in peaks["dof"].to_numpy()[:_LISTED_DOFS]:
        here = peaks["peak_amplitude"].sel(dof=dof).to_numpy()
        factor, unit = unit_shown(data, "peak_amplitude", str(dof))
        least, middle, most = (f"{size * factor:.6g}" for size in here)
        unit = after_number(unit)
        yield f"peak of {dof}: median {middle}{unit}, {low:g} % to {high:g} % {least} to {most}{unit}"


def _scatter(case: Case, data: xarray.Dataset) -> Iterator[str]:
    """Amplification of discs whose blades differ: percentiles, and the worst disc."""
    from slipstick.results.amplification import amplification_of
    from slipstick.results.view import value_text

    found = amplification_of(data)
    if "worst" not in found:
        return
    worst = found["worst"]
    tuned, largest = (
        value_text(data, "peak_amplitude", size, worst["output"])
        for size in (found["tuned_amplitude"], worst["amplitude"])
    )
    yield f"largest amplitude of the tuned disc: {tuned}"
    for key, name in (("percentiles", "amplification"), ("fitted", "amplification by the Weibull fit")):
        if key in found:
            yield f"{name}: {', '.join(f'{percent} % {value:.4f}' for percent, value in found[key].items())}"
    at = f"{worst['amplification']:.4f}, {largest} of {worst['output']} (blades 0 to {len(worst['deviations']) - 1})"
    where = f"at {case.frequency_text(worst['omega'])}" if case.parameter is None else ""
    yield f"worst disc: case {worst['case']}, amplification {at} {where}".rstrip()


def _indices(data: xarray.Dataset) -> Iterator[str]:
    """Sobol indices of the peaks, for samples that allow them."""
    from slipstick.studies.sobol import sobol_indices

    if data.attrs.get("study_method") != "saltelli":
        return
    try:
        found = sobol_indices(data)
    except InputError as error:
        yield reason_of(error)
        return
    for dof in found["dof"].to_numpy()[:_LISTED_DOFS]:
        yield f"Sobol indices of the peak of {dof}, first-order and total (half width of 95 %):"
        for name in found["parameter"].to_numpy():
            here = {k: float(v) for k, v in found.sel(dof=dof, parameter=name).data_vars.items() if k != "variance"}
            first, total = (f"{here[k]:.3f} ({here[f'{k}_interval']:.3f})" for k in ("first", "total"))
            yield f"  {name}: {first}, {total}"


def _answer(run: StudyRun, data: xarray.Dataset, folder: Path) -> Answer:
    from slipstick.results.amplification import amplification_of, is_mistuning

    outcome = run.stopped.name if run.stopped is not None else str(data.attrs["outcome"])
    solved = run.folder.cases.values()
    counts = {"cases": len(run.plan), "computed": len(solved), "failed": sum(not s.outcome.ok for s in solved)}
    scatter = {"amplification": amplification_of(data)} if is_mistuning(data) else {}
    return {"outcome": outcome, **counts, **scatter, **files_in(folder)}
