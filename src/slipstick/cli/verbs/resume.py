"""The verb ``resume``: go on with a run or a study that ended before it was done."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipstick.cli.options import Figures, Formats, NoFigures, Quiet, Report, TimeLimit
from slipstick.cli.output import FolderOfRun
from slipstick.cli.run_options import PLAIN, UNFINISHED, RunOptions, run_options
from slipstick.cli.terminal.answers import Answer, files_in, results_answer
from slipstick.cli.terminal.guard import DONE, STOPPED, complain, say
from slipstick.cli.verb import verb
from slipstick.cli.verbs.check import print_warnings
from slipstick.cli.verbs.run import Begun, Run
from slipstick.cli.verbs.study import Spread, Study, holds_study
from slipstick.errors import InputError, Outcome, SlipstickWarning

if TYPE_CHECKING:
    from slipstick.case.case import Case
    from slipstick.io.journal import Recorded
    from slipstick.results.schema import Layout


@verb
def resume(
    answer: Answer,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of the run or study.", show_default=False)],
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
    """Go on with the run in a folder from its last point, or with the study in it; the exit code.

    ``workers`` are processes for the cases of a study.

    Raises
    ------
    InputError
        If there is no run in it, its case has changed, or it was begun by another version.
    """
    if folder.is_dir() and holds_study(folder):
        return _resume_study(folder, options, workers)
    place = FolderOfRun(folder)
    if workers is not None:
        place.release()
        raise InputError(f"--workers: {folder} holds a run, which is one process; leave it out (a study has workers)")
    try:
        ended = _ended(place, options)
        return ended if ended is not None else _go_on(place, options)
    finally:
        place.release()


def _resume_study(folder: Path, options: RunOptions, workers: int | None) -> int:
    """Compute the cases that are not in the folder of a study, and bring its shares together."""
    from slipstick.io.loading import load_dataset
    from slipstick.studies.folder import JOURNALS, STUDY_FILE, WHOLE

    journals = sorted(folder.glob(JOURNALS))
    if not journals:
        ended = load_dataset(folder / STUDY_FILE).attrs
        if str(ended.get("outcome")) == Outcome.INTERRUPTED.name:
            raise InputError(
                f"{folder}: the study in it did not end, and {WHOLE.name}.journal, to go on from, is missing; "
                "compute it anew into another folder with -o"
            )
        if options.answer is not None:
            said = {"outcome": str(ended["outcome"]), "message": str(ended["outcome_text"])}
            options.answer.update({**said, **files_in(folder)})
        say(str(ended["outcome_text"]))
        say(f"nothing is left to do: the study in {folder} is complete")
        return DONE
    recorded = _recorded(journals[0])
    attributes, about = recorded.layout.attributes, recorded.about
    text = str(attributes.get("case", ""))
    if not text:
        raise InputError(f"{folder}: the study was begun in Python; go on with it by ss.study with the same arguments")
    _same_versions(attributes, journals[0])
    path = Path(str(about.get("case_path") or "case.toml"))
    _same_text(text, [path])
    from slipstick.case.case import Case

    return Study(Case.from_text(text, path, options.tell), folder, Spread(workers=workers), options).whole()


def _ended(place: FolderOfRun, options: RunOptions) -> int | None:
    """The exit code of a run that has nothing left to do; None of one to go on with."""
    from slipstick.io.journal import journal_of
    from slipstick.io.loading import load_table

    journal = journal_of(place.results)
    if not place.results.exists():
        if journal.exists():
            return None
        raise InputError(
            f"{place.folder}: there is no run or study in it; expected a folder that 'slipstick run' or "
            "'slipstick study' wrote: begin with one of them"
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SlipstickWarning)  # of the journal, which is read for itself below
        attributes = load_table(place.results).attrs
    outcome = Outcome.__members__.get(str(attributes.get("outcome")), Outcome.INTERRUPTED)
    if outcome in UNFINISHED:
        if journal.exists():
            return None
        raise InputError(
            f"{place.folder}: the run in it did not end, and {journal.name}, from which it would go on, is missing; "
            "run the case anew into another folder"
        )
    journal.unlink(missing_ok=True)
    if outcome.ok:
        place.complete()
    if options.answer is not None:
        said = {"outcome": outcome.name, "message": str(attributes.get("outcome_text") or outcome.text)}
        options.answer.update({**said, **results_answer(load_table(place.results)), **files_in(place.work)})
    if outcome.ok:
        say(f"nothing is left to do: the run in {place.folder} is complete")
        return DONE
    say(str(attributes.get("outcome_text") or outcome.text))
    say(f"nothing is left to do: the run in {place.folder} ended by itself; change the case and run it anew")
    return STOPPED


def _go_on(place: FolderOfRun, options: RunOptions) -> int:
    from slipstick.analysis.curve.resume import Checkpoint, resumable
    from slipstick.case.case import Case
    from slipstick.io.journal import journal_of, unpacked

    journal = journal_of(place.results)
    recorded = _recorded(journal)
    attributes, about = recorded.layout.attributes, recorded.about
    _same_versions(attributes, journal)
    text, path = str(attributes.get("case", "")), Path(str(about.get("case_path") or "case.toml"))
    _same_text(text, [path, place.work / path.name])
    case = Case.from_text(text, path, options.tell)
    told = print_warnings(case)
    size = case.balance.size
    try:
        checkpoints = [Checkpoint.from_plain(unpacked(note), size) for note in recorded.notes]
    except InputError as error:
        raise InputError(f"{journal}: {error}") from None
    _same_problem(case, recorded.layout, str(about.get("problem")), journal)
    kept = checkpoints[: resumable(checkpoints)]
    options.tell(f"going on after {len(kept)} points in {place.work}")
    place.keep_case(path.name, text)
    return Run(case, place, options, told, Begun(recorded, kept)).whole()


def _recorded(journal: Path) -> Recorded:
    """What the journal holds, with what to do where nothing of it can be read."""
    from slipstick.io.journal import read_journal

    try:
        recorded = read_journal(journal)
    except InputError as error:
        kept = "results beside it keep their points: leave them, and compute the case anew into another folder with -o"
        raise InputError(f"{error}; {kept}") from None
    if recorded.damage:
        complain(f"warning: {recorded.damage}")
    return recorded


def _same_versions(attributes: Mapping[str, Any], journal: Path) -> None:
    """Raises InputError for a run of another slipstick; a change in what it stands on is told."""
    from slipstick.results.schema import versions

    for name, present in versions().items():
        found, package = str(attributes.get(name, "")), name.removesuffix("_version")
        if found == present:
            continue
        if package == "slipstick":
            raise InputError(
                f"{journal}: the run was begun by slipstick {found}, this is {present}, and its points may differ; go "
                "on with that version, or run the case anew into another folder"
            )
        complain(f"warning: the run was begun with {package} {found}, this is {present}: last digits may differ")


def _same_text(text: str, copies: Sequence[Path]) -> None:
    """Raises InputError where the case was changed since the run began; one that is gone is read from the results."""
    from slipstick.case.source import read_text

    for copy in copies:
        if copy.is_file() and read_text(copy) != text:
            raise InputError(
                f"{copy}: the case has changed since the run began; put it back as it was (the results hold it), or "
                "run the case anew into another folder"
            )


def _same_problem(case: Case, layout: Layout, fingerprint: str, journal: Path) -> None:
    """Raises InputError where files that the case names have changed."""
    from slipstick.io import problem as problems
    from slipstick.results.schema import layout_of

    own = layout_of(case.problem(), parameter=case.parameter or "", stability=bool(case.response.judged))
    same = (own.labels, own.variables) == (layout.labels, layout.variables)
    if not same or problems.fingerprint(case.problem()) != fingerprint:
        raise InputError(
            f"{journal}: the run is of other numbers: a file that the case names, or what it is reduced to, has "
            "changed since it began; put it back, or run the case anew into another folder"
        )
