"""The folder of a study: every case that was computed is in a journal at once, the results are made from all journals.

Several processes may compute parts of one study into one folder (``share``): each has a journal of its own.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError, Outcome
from slipstick.io.journal import Journal, Recorded, read_journal, unpacked
from slipstick.io.lock import FolderLock
from slipstick.io.problem import fingerprint
from slipstick.io.store import save_dataset
from slipstick.replacing import make_folder, telling
from slipstick.results.schema import ANALYSIS
from slipstick.studies import CURVES_FILE, JOURNALS, STUDY_FILE
from slipstick.studies.plan import StudyPlan
from slipstick.studies.solving import CaseSolved, Job
from slipstick.studies.table import curves_dataset, row_layout, study_attributes, study_dataset

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class Share:
    """The part of a study that one of several processes computes: cases ``index``, ``index + of``, ..."""

    index: int = 0
    of: int = 1

    def __contains__(self, case: int) -> bool:
        return case % self.of == self.index

    @property
    def name(self) -> str:
        """What its files are called."""
        return "study" if self.of == 1 else f"study-{self.index}-of-{self.of}"


WHOLE = Share()


class StudyFolder:
    """Where a study is kept; one process holds each share of it.

    Parameters
    ----------
    folder
        Made if it is not there.
    job, plan, about
        What is computed, and further attributes of the results.

    Raises
    ------
    InputError
        If another study is in it, another process holds this share of it, or it cannot be written.
    """

    def __init__(
        self, folder: Path, job: Job, plan: StudyPlan, *, about: Mapping[str, Any], path: str = "", share: Share = WHOLE
    ) -> None:
        self.folder, self.job, self.plan, self._about, self.share = folder, job, plan, dict(about), share
        self._mark, self._layout = study_mark(job, plan), row_layout(job, plan)
        self._journal: Journal | None = None
        self._path, self._begun = path, False
        self._made = not folder.exists()
        make_folder(folder)
        with telling(folder):
            self._lock = FolderLock(folder, f".{share.name}.lock")
        try:
            self._alone()
            self.cases: dict[int, CaseSolved] = self._read()
        except BaseException:
            self.release()
            raise

    def _alone(self) -> None:
        """Raises InputError while others compute what this process would: shares beside the whole."""
        others = "study-*-of-*" if self.share.of == 1 else WHOLE.name
        for path in self.folder.glob(f".{others}.lock"):
            FolderLock(self.folder, path.name).release()

    def _read(self) -> dict[int, CaseSolved]:
        """Every case in the journals; of one that stands there several times a complete one, else the last."""
        cases: dict[int, CaseSolved] = {}
        for path in sorted(self.folder.glob(JOURNALS)):
            recorded = read_journal(path)
            if recorded.about.get("study") != self._mark:
                raise InputError(
                    f"{self.folder}: another study is in it, or the case has changed since ({path.name}); choose "
                    "another folder with -o"
                )
            for solved in self._cases_of(recorded):
                known = cases.get(solved.row["case"])
                if known is None or solved.outcome.ok or not known.outcome.ok:
                    cases[solved.row["case"]] = solved
        return cases

    def _cases_of(self, recorded: Recorded) -> list[CaseSolved]:
        size = self.job.curve_layout.size
        values, cases = recorded.layout.unpack(recorded.rows), []
        for i, note in enumerate(recorded.notes()):
            row = {name: column[i] for name, column in values.items() if name not in self.plan.names}
            said = unpacked(note)
            try:
                curve = np.asarray(said["curve"], dtype=float).reshape(-1, size)
                case, message = int(row["case"]), str(said["message"])
                warned = tuple(map(str, said["warnings"]))
            except (KeyError, TypeError, ValueError):
                raise InputError(f"{self.folder}: a case in its journal is damaged") from None
            if not 0 <= case < len(self.plan) or row["outcome"] not in Outcome.__members__:
                raise InputError(f"{self.folder}: a case in its journal is damaged")
            row = {**row, "case": case, "outcome": str(row["outcome"])}
            cases.append(CaseSolved(row=row, curve=curve, message=message, warnings=warned))
        return cases

    def todo(self, *, missing: bool = False) -> list[int]:
        """Cases of this share to be computed; ``missing``: also those that were, but did not complete."""
        done = [case for case, solved in self.cases.items() if solved.outcome.ok or not missing]
        return [case for case in self.plan.order if case in self.share and case not in set(done)]

    def begin(self) -> None:
        """Open the journal of this share: a study that is killed before its first case can be gone on with."""
        if self._journal is None:
            self._opened()

    def add(self, solved: CaseSolved) -> None:
        """Keep a case; it survives a kill from here on."""
        journal = self._journal or self._opened()
        values = zip(self.plan.names, self.plan.values[solved.row["case"]].tolist(), strict=True)
        row = self._layout.pack({**solved.row, **dict(values)})
        note = {"message": solved.message, "warnings": list(solved.warnings), "curve": solved.curve.ravel()}
        journal.append(row, note)
        self.cases[solved.row["case"]] = solved

    def _opened(self) -> Journal:
        path = self.folder / f"{self.share.name}.journal"
        self._begun = not path.exists()
        keep = read_journal(path).ends[-1] if path.exists() else 0
        layout = replace(self._layout, attributes=self.attributes())
        self._journal = Journal(path, layout, {ANALYSIS: "study", "study": self._mark, "case_path": self._path}, keep)
        return self._journal

    def attributes(self) -> dict[str, Any]:
        """What the study says of itself now."""
        return study_attributes(self.job, self.plan, self.cases, self._about)

    def dataset(self) -> xarray.Dataset:
        """All cases so far."""
        return study_dataset(self.job, self.plan, self.cases, self.attributes())

    def write(self) -> xarray.Dataset:
        """Results of all cases so far, each file in one step; the dataset of the cases.

        The journals go once every case is complete.
        """
        self.cases = self._read()  # with what other shares have computed by now
        dataset = self.dataset()
        save_dataset(curves_dataset(self.job, _shown(self.plan, self.cases), dataset.attrs), self.folder / CURVES_FILE)
        save_dataset(dataset, self.folder / STUDY_FILE)
        if self.complete:
            self._close()
            for path in (*self.folder.glob(JOURNALS), *self.folder.glob(f".{JOURNALS}.*.tmp")):
                path.unlink(missing_ok=True)
        return dataset

    @property
    def complete(self) -> bool:
        """Whether every case is there and complete."""
        return len(self.cases) == len(self.plan) and all(solved.outcome.ok for solved in self.cases.values())

    def _close(self) -> None:
        if self._journal is not None:
            self._journal.close(remove=False)
            self._journal = None

    def abandon(self) -> None:
        """Remove what was begun here: nothing was computed, and nothing can be."""
        if self._journal is not None and self._begun and not self.cases:
            self._journal.close(remove=True)
            self._journal = None
        self.release()
        if self._made and not any(self.folder.iterdir()):
            self.folder.rmdir()

    def release(self) -> None:
        """Let others in."""
        self._close()
        self._lock.release()


def study_mark(job: Job, plan: StudyPlan) -> str:
    """What makes a study itself: problem, parameters and values, and what is followed."""
    followed = [job.span, job.parameter, job.omega, job.requested, job.peaks_of, repr(job.options)]
    text = json.dumps([fingerprint(job.problem), plan.names, plan.method, followed], default=repr)
    digest = sha256(text.encode())
    digest.update(plan.values.astype("<f8").tobytes())
    return digest.hexdigest()


def _shown(plan: StudyPlan, cases: Mapping[int, CaseSolved]) -> dict[int, CaseSolved]:
    """The cases along the parameters: all but the tuned disc."""
    return {case: solved for case, solved in cases.items() if case != plan.tuned}
