"""The ``resume`` command: go on with a run or a study that ended before it was done."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.app.terminal.answers import files_in, results_answer
from slipstick.app.terminal.guard import DONE, STOPPED, complain, say
from slipstick.app.verbs.check import print_warnings
from slipstick.app.verbs.manner import PLAIN, UNFINISHED, Manner
from slipstick.app.verbs.output import RESULTS, FolderOfRun, work_of
from slipstick.app.verbs.run import Begun, Run
from slipstick.app.verbs.study import Spread, Study, holds_study
from slipstick.case.case import Case
from slipstick.case.source import read_text
from slipstick.errors import InputError, Outcome, SlipstickWarning
from slipstick.faults import path as path_of

if TYPE_CHECKING:
    import xarray

    from slipstick.branch import Branch
    from slipstick.io.journal import Recorded
    from slipstick.results.schema import Layout


def resume(folder: str | Path) -> Branch | xarray.Dataset:
    """Go on with a run of ``slipstick run``, or a study, that was killed or interrupted: the command of that name.

    Parameters
    ----------
    folder
        Where it was written. A study that was begun in Python goes on by ``ss.study`` with the same arguments.

    Returns
    -------
    Branch or xarray.Dataset
        The branch of a run, with everything found: look at its ``outcome``. The dataset of a study.

    Raises
    ------
    InputError
        If there is nothing to go on with, its case has changed, or it was begun by another version.
    """
    from slipstick.io.loading import load, load_dataset
    from slipstick.studies.folder import STUDY_FILE

    place = path_of("resume, folder", folder, "the folder of a run or a study")
    with redirect_stdout(StringIO()):
        resume_run(place, Manner(figures=False, report=False, quiet=True))
    if holds_study(place):
        return load_dataset(place / STUDY_FILE)
    return load(work_of(place) / RESULTS)


def resume_run(folder: Path, manner: Manner = PLAIN, workers: int | None = None) -> int:
    """Go on with the run in a folder from its last point, or with the study in it; the exit code.

    ``workers`` are processes for the cases of a study.

    Raises
    ------
    InputError
        If there is no run in it, its case has changed, or it was begun by another version.
    """
    if folder.is_dir() and holds_study(folder):
        return _resume_study(folder, manner, workers)
    place = FolderOfRun(folder)
    if workers is not None:
        place.release()
        raise InputError(f"--workers: {folder} holds a run, which is one process; leave it out (a study has workers)")
    try:
        ended = _ended(place, manner)
        return ended if ended is not None else _go_on(place, manner)
    finally:
        place.release()


def _resume_study(folder: Path, manner: Manner, workers: int | None) -> int:
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
        if manner.answer is not None:
            said = {"outcome": str(ended["outcome"]), "message": str(ended["outcome_text"])}
            manner.answer.update({**said, **files_in(folder)})
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
    return Study(Case.from_text(text, path, manner.tell), folder, Spread(workers=workers), manner).whole()


def _ended(place: FolderOfRun, manner: Manner) -> int | None:
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
    if manner.answer is not None:
        said = {"outcome": outcome.name, "message": str(attributes.get("outcome_text") or outcome.text)}
        manner.answer.update({**said, **results_answer(load_table(place.results)), **files_in(place.work)})
    if outcome.ok:
        say(f"nothing is left to do: the run in {place.folder} is complete")
        return DONE
    say(str(attributes.get("outcome_text") or outcome.text))
    say(f"nothing is left to do: the run in {place.folder} ended by itself; change the case and run it anew")
    return STOPPED


def _go_on(place: FolderOfRun, manner: Manner) -> int:
    from slipstick.analysis.curve.resume import Checkpoint, resumable
    from slipstick.io.journal import journal_of
    from slipstick.io.notes import unpacked

    journal = journal_of(place.results)
    recorded = _recorded(journal)
    attributes, about = recorded.layout.attributes, recorded.about
    _same_versions(attributes, journal)
    text, path = str(attributes.get("case", "")), Path(str(about.get("case_path") or "case.toml"))
    _same_text(text, [path, place.work / path.name])
    case = Case.from_text(text, path, manner.tell)
    told = print_warnings(case)
    size = case.balance.size
    try:
        checkpoints = [Checkpoint.from_plain(unpacked(note), size) for note in recorded.notes]
    except InputError as error:
        raise InputError(f"{journal}: {error}") from None
    _same_problem(case, recorded.layout, str(about.get("problem")), journal)
    kept = checkpoints[: resumable(checkpoints)]
    manner.tell(f"going on after {len(kept)} points in {place.work}")
    place.keep_case(path.name, text)
    return Run(case, place, manner, told, Begun(recorded, kept)).whole()


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
