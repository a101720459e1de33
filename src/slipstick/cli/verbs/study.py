"""The verb ``study``: many cases of one case file, on this machine, on a cluster, or a share of them."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipstick.cli.options import CasePath, Quiet, Report, TimeLimit, folder_option
from slipstick.cli.output import REPORT
from slipstick.cli.run_options import PLAIN, RunOptions, run_options
from slipstick.cli.terminal.answers import Answer, files_in
from slipstick.cli.terminal.guard import (
    DONE,
    STOPPED,
    complain,
    internal_sentence,
    os_sentence,
    say,
    termination_as_interrupt,
)
from slipstick.cli.terminal.prepare import prepare_kernel
from slipstick.cli.verb import verb
from slipstick.errors import InputError, Outcome
from slipstick.units import after_number

if TYPE_CHECKING:
    import xarray

    from slipstick.case.case import Case
    from slipstick.studies.folder import Share, StudyFolder
    from slipstick.studies.solving import CaseSolved

_LISTED = 5


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
    figures: Annotated[bool, typer.Option(help="Draw the figures.")] = True,
    report: Report = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
) -> int:
    """Compute a case for all values that its table "study" names: study.nc, curves.nc, figures, report.html."""
    spread = Spread(workers=workers, scheduler=scheduler, share=share_of(index, of))
    options = run_options(time_limit, figures=figures, report=report, quiet=quiet, answer=answer)
    return run_study(case, output, spread=spread, missing=missing, options=options)


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Who computes: processes on this machine, a Dask cluster at an address, or one of several jobs its share."""

    workers: int | None = None
    scheduler: str | None = None
    share: Share | None = None


HERE = Spread()


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
    path: Path, output: Path | None, *, spread: Spread = HERE, missing: bool = False, options: RunOptions = PLAIN
) -> int:
    """Compute every case of a study into a folder; the exit code.

    Raises
    ------
    InputError
        If the case has faults or no ``[study]``, or the folder holds another study.
    """
    from slipstick.case.case import Case

    case = Case.from_file(path, options.tell)
    folder = output if output is not None else Path(f"{case.name}-study")
    if spread.scheduler is not None and spread.workers is not None:
        raise InputError(
            "--workers and --scheduler are both given; the workers of a cluster are its own: keep one of them"
        )
    if spread.share is None and not missing:
        _refuse_earlier(folder)
    return Study(case, folder, spread, options).whole(missing=missing)


def _refuse_earlier(folder: Path) -> None:
    from slipstick.studies.folder import CURVES_FILE, STUDY_FILE, WHOLE

    held = [name for name in (STUDY_FILE, CURVES_FILE, f"{WHOLE.name}.journal") if (folder / name).exists()]
    if held:
        raise InputError(
            f"{folder} already holds a study ({held[0]}); go on with it by 'slipstick resume {folder}', compute what "
            "did not complete once more with --missing, or choose another folder with -o"
        )


@dataclass
class Study:
    """One study of a case from its start to its summary."""

    case: Case
    folder: Path
    spread: Spread
    options: RunOptions

    def whole(self, *, missing: bool = False) -> int:
        """What there is to compute, and the summary; the exit code."""
        from slipstick.studies.folder import WHOLE, StudyFolder

        plan = self.case.plan
        if plan is None:
            raise InputError(
                f'{self.case.path}: [study] is missing; give the parameters, such as "damper.velocity" = [0, 1, 10]'
            )
        for sentence in plan.warnings:
            complain(f"warning: {sentence}")
        path = str(self.case.path.resolve())
        place = StudyFolder(
            self.folder, self.case.study_job(), plan, about=self.case.names, path=path, share=self.spread.share or WHOLE
        )
        try:
            return self._computed(place, place.todo(missing=missing))
        except (InputError, OSError):
            place.abandon()
            raise
        finally:
            place.release()

    def _computed(self, place: StudyFolder, todo: list[int]) -> int:
        from slipstick.case.study import cases_text

        assert self.case.plan is not None
        self.options.tell(f"{self.case.title}: {cases_text(self.case.plan)}; {len(todo)} to compute")
        if self.case.response.follow is not None:
            self.options.tell("follow in [response] is for 'slipstick run'; a study computes the curves alone")
        stop, failure = None, ""
        if todo:
            place.begin()
            prepare_kernel(self.options.tell)
        try:
            stop = self._solve(place, todo)
        except OSError as error:
            failure = os_sentence(error)
        if place.share.of > 1:
            return self._share_summary(place, stop, failure)
        return self._summary(place, place.write(), stop, failure)

    def _solve(self, place: StudyFolder, todo: list[int]) -> Outcome | None:
        """Compute; how it ended early, if it did."""
        from slipstick.cli.terminal.cases_progress import cases_progress
        from slipstick.studies.workers import connected, solutions

        until = None if self.options.time_limit is None else time.monotonic() + self.options.time_limit
        workers = 1 if place.share.of > 1 else self.spread.workers
        try:
            with termination_as_interrupt(), ExitStack() as stack:
                shown = stack.enter_context(cases_progress(len(todo), quiet=self.options.quiet))
                client = None
                if self.spread.scheduler is not None:
                    client = stack.enter_context(connected(self.spread.scheduler))
                    if not client.nthreads():
                        shown.note(f"  waiting for workers at {self.spread.scheduler}")
                found: Any = solutions(
                    place.job,
                    place.plan,
                    todo,
                    workers=workers,
                    client=client,
                    tell=lambda text: shown.note(f"  {text}"),
                )
                stack.callback(found.close)
                for solved in found:
                    place.add(solved)
                    shown.case(failed=not solved.outcome.ok)
                    if until is not None and time.monotonic() > until and len(place.cases) < len(place.plan):
                        return Outcome.TIME_LIMIT
        except KeyboardInterrupt:
            return Outcome.INTERRUPTED
        return None

    def _share_summary(self, place: StudyFolder, stop: Outcome | None, failure: str) -> int:
        own = {case: solved for case, solved in place.cases.items() if case in place.share}
        left = sum(case in place.share for case in range(len(place.plan))) - len(own)
        say(f"share {place.share.index} of {place.share.of}: {len(own)} cases computed, {left} left")
        say(f"when every share is done: slipstick resume {self.folder}")
        _tell_failed(list(own.values()))
        if failure:
            complain(f"error: {failure}")
        return STOPPED if failure or stop or left or not all(s.outcome.ok for s in own.values()) else DONE

    def _summary(self, place: StudyFolder, data: xarray.Dataset, stop: Outcome | None, failure: str) -> int:
        from slipstick.studies.folder import CURVES_FILE, STUDY_FILE

        if self.options.figures and not failure:
            failure = self._draw(data)
        if self.options.report and place.cases:
            self._report()
        for line in _largest(data):
            self.options.tell(line)
        warned = [s for s in str(data.attrs["warnings"]).splitlines() if s not in place.plan.warnings]
        for sentence in warned[:1]:
            more = f" (and {len(warned) - 1} like it in other cases)" if len(warned) > 1 else ""
            complain(f"warning: {sentence}{more}")
        _tell_failed(list(place.cases.values()))
        say(stop.text if stop is not None else str(data.attrs["outcome_text"]))
        say(f"results in {self.folder}/: {STUDY_FILE}, {CURVES_FILE}")
        if failure:
            complain(f"error: {failure}")
        left = len(place.plan) - len(place.cases)
        if left:
            say(f"go on with: slipstick resume {self.folder}")
        complete = place.complete and not failure
        if self.options.answer is not None:
            self.options.answer.update(_answer(place, data, stop, self.folder))
        return DONE if complete else STOPPED

    def _draw(self, data: xarray.Dataset) -> str:
        """Draw the figures; what went wrong, if something did."""
        from slipstick.cli.figures import draw_study

        try:
            draw_study(data, self.folder)
        except OSError as error:
            return f"figures: {os_sentence(error)}"
        return ""

    def _report(self) -> None:
        """A study whose report cannot be written has its results all the same."""
        from slipstick.cli.verbs.report import report_study
        from slipstick.studies.folder import STUDY_FILE

        try:
            report_study(self.folder / STUDY_FILE, self.folder / REPORT)
        except InputError as error:
            complain(f"warning: {error}")
        except Exception as error:
            complain(f"warning: report: {internal_sentence(error)}")


def _tell_failed(solved: list[CaseSolved]) -> None:
    failed = sorted((s for s in solved if not s.outcome.ok), key=lambda s: s.row["case"])
    if not failed:
        return
    counts = Counter(s.outcome.text.partition(";")[0] for s in failed)
    complain(f"{len(failed)} cases did not complete: {', '.join(f'{n} {text}' for text, n in counts.items())}")
    for one in failed[:_LISTED]:
        complain(f"  case {one.row['case']}: {one.message}")
    complain("compute them once more with --missing, where their cause is gone")


def _largest(data: xarray.Dataset) -> Iterator[str]:
    """Where the largest and the smallest peak of each of a few dofs is."""
    import numpy as np

    for d, dof in enumerate(data["dof"].to_numpy()[:3]):
        peaks = data["peak_amplitude"].isel(dof=d)
        if not bool(np.isfinite(peaks).any()):
            continue
        unit = after_number(data["peak_amplitude"].attrs["units"])
        for word, at in (("smallest", peaks.argmin(...)), ("largest", peaks.argmax(...))):
            there = peaks[at]
            names = str(data.attrs["study_parameters"]).splitlines()
            where = ", ".join(f"{name} = {float(there[name]):.6g}" for name in names)
            yield f"{word} peak of {dof}: {float(there):.6g}{unit} with {where}"


def _answer(place: StudyFolder, data: xarray.Dataset, stop: Outcome | None, folder: Path) -> dict[str, Any]:
    outcome = stop.name if stop is not None else str(data.attrs["outcome"])
    failed = sum(not solved.outcome.ok for solved in place.cases.values())
    counts = {"cases": len(place.plan), "computed": len(place.cases), "failed": failed}
    return {"outcome": outcome, **counts, **files_in(folder)}


def holds_study(folder: Path) -> bool:
    """Whether a folder is that of a study."""
    from slipstick.studies.folder import JOURNALS, STUDY_FILE

    return (folder / STUDY_FILE).exists() or any(folder.glob(JOURNALS))
