"""The verb ``resume``: go on with a run, a study or a run-up that ended before it was done."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from slipstick.cli.options import PLAIN, Figures, Formats, NoFigures, Quiet, Report, RunOptions, TimeLimit, run_options
from slipstick.cli.terminal.answers import Answer, files_in, results_answer
from slipstick.cli.terminal.guard import DONE, STOPPED, say, warn_user
from slipstick.cli.verb import verb
from slipstick.cli.verbs.run import computed
from slipstick.cli.verbs.run_up import computed as run_up_computed
from slipstick.cli.verbs.study import computed as study_computed
from slipstick.errors import InputError
from slipstick.runs.folder import FolderOfRun, analysis_in

if TYPE_CHECKING:
    from slipstick.runs.resume import Ended


@verb
def resume(
    answer: Answer,
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="The folder of the run, study or run-up.", show_default=False)
    ],
    workers: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Of a study: processes; by default one a processor.")
    ] = None,
    figures: Figures = None,
    formats: Formats = None,
    no_figures: NoFigures = False,
    report: Report = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
) -> int:
    """Go on with a run that was killed, interrupted or out of time: the same points as without the interruption."""
    options = run_options(
        time_limit, (figures, formats), figures=not no_figures, report=report, quiet=quiet, answer=answer
    )
    return resume_run(folder, options, workers)


def resume_run(folder: Path, options: RunOptions = PLAIN, workers: int | None = None) -> int:
    """Go on with the run in a folder from its last point, or with the study or the run-up in it; the exit code.

    ``workers`` are processes for the cases of a study.

    Raises
    ------
    InputError
        If there is no run in it, its case has changed, or it was begun by another version.
    """
    from slipstick.io.loading import load_table
    from slipstick.runs.resume import Ended, begun_run

    with FolderOfRun(folder) as place:
        if held := analysis_in(place.work):
            return _study_or_run_up(place, options, workers, study=held == "study")
        if workers is not None:
            raise InputError(
                f"--workers: {folder} holds a run, which is one process; leave it out (a study has workers)"
            )
        run = begun_run(place, warn_user, options.tell)
        if not isinstance(run, Ended):
            assert run.begun is not None
            options.tell(f"going on after {len(run.begun.checkpoints)} points in {place.work}")
            return computed(run, options)
        _answer(run, options, place.work, results_answer(load_table(place.results)))
        if run.ok:
            say(f"nothing is left to do: the run in {place.folder} is complete")
            return DONE
        say(run.message)
        say(f"nothing is left to do: the run in {place.folder} ended by itself; change the case and run it anew")
        return STOPPED


def _study_or_run_up(place: FolderOfRun, options: RunOptions, workers: int | None, *, study: bool) -> int:
    from slipstick.runs.resume import Ended, begun_run_up, begun_study
    from slipstick.runs.study import Spread, StudyRun

    for name, value in {} if study else {"--workers": workers, "--figures": options.wanted.names}.items():
        if value:
            raise InputError(f"{name}: {place.folder} holds a run-up, which knows no such option; leave it out")
    case = (begun_study if study else begun_run_up)(place.work, warn_user, options.tell)
    if not isinstance(case, Ended):
        if study:
            return study_computed(StudyRun(case, place.work, Spread(workers=workers)), options, place)
        return run_up_computed(case, place, options)
    place.complete()
    _answer(case, options, place.work)
    say(case.message)
    say(f"nothing is left to do: the {'study' if study else 'run-up'} in {place.folder} is complete")
    return DONE


def _answer(ended: Ended, options: RunOptions, folder: Path, results: Answer | None = None) -> None:
    if options.answer is not None:
        said = {"outcome": ended.outcome, "message": ended.message}
        options.answer.update({**said, **(results or {}), **files_in(folder)})
