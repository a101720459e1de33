"""Going on with a run or a study that ended before it was done."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.branch import Branch
from slipstick.case import RENAMED
from slipstick.case.case import Case
from slipstick.case.source import read_text
from slipstick.case.structure import Tell, silent
from slipstick.errors import InputError, Outcome, SlipstickWarning, reason_of
from slipstick.faults import path as path_of
from slipstick.faults import warn
from slipstick.io.journal import Recorded, journal_of, read_journal
from slipstick.io.loading import load, load_dataset, load_table
from slipstick.io.problem import fingerprint
from slipstick.results import schema
from slipstick.results.schema import Layout
from slipstick.results.view import analysis_of_journal
from slipstick.runs.checkpoints import checkpoints_in
from slipstick.runs.folder import PASSED, FolderOfRun, analysis_in
from slipstick.runs.passing_through import load_run_up, run_up_of_case
from slipstick.runs.run import UNFINISHED, Begun, CaseRun
from slipstick.runs.study import StudyRun
from slipstick.studies import JOURNALS, STUDY_FILE
from slipstick.studies.folder import WHOLE

if TYPE_CHECKING:
    import xarray

    from slipstick.results.run_up import RunUp

RUN_UP = "run_up"
"""The table of a case that asks for a run-up."""


def resume(folder: str | Path) -> Branch | xarray.Dataset | RunUp:
    """Go on with a run, a study or a run-up that was killed or interrupted: the command of that name.

    A run is that of ``slipstick run``, ``track``, ``optimal``, ``modes``, ``limit-cycles`` or ``wear``.

    Nothing is printed; figures and the report are the command's.

    Parameters
    ----------
    folder
        Where it was written. What was begun in Python goes on by ``ss.study`` or ``ss.runs.run_up`` with the same
        arguments.

    Returns
    -------
    Branch, xarray.Dataset or RunUp
        The branch of a run, with everything found: look at its ``outcome``. The dataset of a study. The run-up.

    Raises
    ------
    InputError
        If there is nothing to go on with, its case has changed, or it was begun by another version.

    Warns
    -----
    SlipstickWarning
        What is suspicious in the case or the points, what was lost of them, and what ended the run once more.

    Examples
    --------
    With the folder of an interrupted run:

    >>> import slipstick as ss
    >>> branch = ss.resume("blade-results")  # doctest: +SKIP
    >>> branch.outcome, len(branch)  # doctest: +SKIP
    """
    path = path_of("resume, folder", folder, "the folder of a run or a study")
    with FolderOfRun(path) as place:
        held = analysis_in(place.work)
        if held == "study":
            case, complete = begun_study(place.work, _warn), True
            if isinstance(case, Case):
                with StudyRun(case, place.work) as study:
                    warn(study.plan.warnings)
                    study.compute()
                    study.write()
                    warn([study.failure] if study.failure else [])
                complete = study.folder.complete and not study.failure
            if complete:
                place.complete()
            return load_dataset(place.work / STUDY_FILE)
        if held == "run_up":
            case = begun_run_up(place.work, _warn)
            if isinstance(case, Case):
                warn(case.warnings())
                passed = run_up_of_case(case, case.further[RUN_UP], place.work)
            else:
                passed = load_run_up(place.work / PASSED)
            if passed.dataset.attrs["outcome"] == Outcome.COMPLETED.name:
                place.complete()
            return passed
        run = begun_run(place, _warn)
        if isinstance(run, CaseRun):
            run.compute()
            run.finish()
            warn([*run.run_warnings, *run.failures])
        return load(place.results)


def _warn(sentence: str) -> None:
    warn([sentence])


@dataclass(frozen=True)
class Ended:
    """What is in a folder ended by itself, or is complete: nothing is left to do."""

    outcome: str
    message: str

    @property
    def ok(self) -> bool:
        """Whether everything asked for is there."""
        return self.outcome == Outcome.COMPLETED.name


def begun_study(folder: Path, on_warning: Tell, tell: Tell = silent) -> Case | Ended:
    """The case of the study in a folder, whose other cases are to be computed.

    Raises
    ------
    InputError
        If it was begun in Python, its case has changed, or it was begun by another version.
    """
    journals = sorted(folder.glob(JOURNALS))
    if not journals:
        ended = load_dataset(folder / STUDY_FILE).attrs
        if str(ended.get("outcome")) == Outcome.INTERRUPTED.name:
            raise InputError(
                f"{folder}: the study in it did not end, and {WHOLE.name}.journal, to go on from, is missing; "
                "compute it anew into another folder with -o"
            )
        return Ended(str(ended["outcome"]), str(ended["outcome_text"]))
    return _case_in(folder, journals[0], "the study", "ss.study with the same arguments", on_warning, tell)


def begun_run_up(folder: Path, on_warning: Tell, tell: Tell = silent) -> Case | Ended:
    """The case of the run-up in a folder, whose other periods are to be integrated.

    Raises
    ------
    InputError
        If it was begun in Python, its case has changed, or it was begun by another version.
    """
    file = folder / PASSED
    journal = journal_of(file)
    if not journal.exists():
        ended = load_dataset(file).attrs
        if str(ended["outcome"]) == Outcome.COMPLETED.name:
            return Ended(str(ended["outcome"]), str(ended["outcome_text"]))
        raise InputError(
            f"{folder}: the run-up in it did not end, and {journal.name}, from which it would go on, is missing; "
            "compute it anew into another folder with -o"
        )
    again = "ss.runs.run_up with the same arguments and folder"
    case = _case_in(folder, journal, "the run-up", again, on_warning, tell)
    if RUN_UP not in case.further:
        raise InputError(f"{journal}: the case in it has no table [{RUN_UP}]; compute it anew into another folder")
    return case


def _case_in(folder: Path, journal: Path, what: str, again: str, on_warning: Tell, tell: Tell) -> Case:
    """The case that was begun, as its journal holds it; InputError where it was begun otherwise, or has changed."""
    recorded = _recorded(journal, on_warning)
    text, path = _text_and_path(recorded)
    if not text:
        raise InputError(f"{folder}: {what} was begun in Python; go on with it by {again}")
    _same_versions(recorded.layout.attributes, journal, on_warning)
    _same_text(text, [path])
    return Case.from_text(text, path, tell)


def begun_run(place: FolderOfRun, on_warning: Tell, tell: Tell = silent) -> CaseRun | Ended:
    """The run in a folder, to be gone on with from its last point.

    Raises
    ------
    InputError
        If there is no run in it, its case has changed, or it was begun by another version.
    """
    journal = journal_of(place.results)
    if not place.results.exists():
        if not journal.exists():
            raise InputError(
                f"{place.folder}: there is no run or study in it; expected a folder that 'slipstick run' or "
                "'slipstick study' wrote: begin with one of them"
            )
    elif (ended := _ended(place, journal)) is not None:
        return ended
    recorded = _recorded(journal, on_warning)
    _same_versions(recorded.layout.attributes, journal, on_warning)
    text, path = _text_and_path(recorded)
    _same_text(text, [path, place.work / path.name])
    case = Case.from_text(text, path, tell)
    case_warnings = case.warnings()
    for sentence in case_warnings:
        on_warning(sentence)
    analysis = analysis_of_journal(recorded.about)
    table = RENAMED.get(analysis, analysis)  # journals name limit cycles as their table was called at first
    run = CaseRun(case, place, case_warnings, table=table if table in case.further else "")
    request = run.request
    try:
        run.begun = Begun(recorded, checkpoints_in(recorded, request))
    except InputError as error:
        raise InputError(f"{journal}: {reason_of(error)}") from None
    _same_problem(run, recorded.layout, str(recorded.about.get("problem")), journal)
    place.keep_case(path.name, text)
    return run


def _ended(place: FolderOfRun, journal: Path) -> Ended | None:
    """How a run with results ended; None where it can be gone on with."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SlipstickWarning)  # of the journal, which is read for itself
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
    return Ended(outcome.name, str(attributes.get("outcome_text") or outcome.text))


def _text_and_path(recorded: Recorded) -> tuple[str, Path]:
    """The case that was begun, and where it was."""
    text = str(recorded.layout.attributes.get("case", ""))
    return text, Path(str(recorded.about.get("case_path") or "case.toml"))


def _recorded(journal: Path, on_warning: Tell) -> Recorded:
    """What the journal holds, with what to do where nothing of it can be read."""
    try:
        recorded = read_journal(journal)
    except InputError as error:
        kept = "results beside it keep their points: leave them, and compute the case anew into another folder with -o"
        raise InputError(f"{reason_of(error)}; {kept}") from None
    if recorded.damage:
        on_warning(recorded.damage)
    return recorded


def _same_versions(attributes: Mapping[str, Any], journal: Path, on_warning: Tell) -> None:
    """Raises InputError for a run of another slipstick; a change of the libraries below it is a warning."""
    for name, present in schema.versions().items():
        before, package = str(attributes.get(name, "")), name.removesuffix("_version")
        if before == present:
            continue
        if package == "slipstick":
            raise InputError(
                f"{journal}: the run was begun by slipstick {before}, this is {present}, and its points may differ; go "
                "on with that version, or run the case anew into another folder"
            )
        on_warning(f"the run was begun with {package} {before}, this is {present}: last digits may differ")


def _same_text(text: str, copies: Sequence[Path]) -> None:
    """Raises InputError where the case was changed since the run began; one that is gone is read from the results."""
    for copy in copies:
        if copy.is_file() and read_text(copy) != text:
            raise InputError(
                f"{copy}: the case has changed since the run began; put it back as it was (the results hold it), or "
                "run the case anew into another folder"
            )


def _same_problem(run: CaseRun, layout: Layout, begun_with: str, journal: Path) -> None:
    """Raises InputError where files that the case names have changed."""
    present = run.layout
    same = (present.labels, present.variables) == (layout.labels, layout.variables)
    if not same or fingerprint(run.request.problem) != begun_with:
        raise InputError(
            f"{journal}: a file that the case names, or what it is reduced to, has changed since the run began; put "
            "it back, or run the case anew into another folder"
        )
