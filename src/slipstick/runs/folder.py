"""The folder of a verb: earlier results are never overwritten unasked, and kept until new ones are complete."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from slipstick.errors import InputError
from slipstick.io.lock import FolderLock
from slipstick.replacing import remove_leftovers, telling
from slipstick.studies import CURVES_FILE, JOURNALS, STUDY_FILE

RESULTS, REPORT = "results.nc", "report.html"
FITTED, PASSED, LOADED = "identify.nc", "run_up.nc", "preload.nc"
SUBHARMONICS = "subharmonic_{}.nc"
FORMATS = ("png", "svg", "pdf")
FIGURES = (
    *("response", "mean", "phase", "spectrum", "history"),
    *("power", "fractions", "friction", "temperature", "loop", "orbit", "states"),
)
_FURTHER_FIGURES = ("backbone", "damping", "stability", "wear", "worn_surface")
OR_REPLACE = "choose another folder with -o, or --force to replace its results"


@dataclass(frozen=True, kw_only=True)
class Written:
    """What a verb leaves in its folder, as patterns of names."""

    what: str
    results: tuple[str, ...]
    """Files that only it writes."""
    journals: tuple[str, ...] = ()
    """Files of one that did not end."""
    beside: tuple[str, ...] = ()
    """Figures and texts; others may have files of these names."""
    retry: str = ""
    """What else may be done with one that did not end."""


def _figures(names: Sequence[str], formats: Sequence[str] = ("png",)) -> tuple[str, ...]:
    return tuple(f"{name}.{ending}" for name in names for ending in formats)


WRITTEN = {
    "run": Written(
        what="a run", results=(RESULTS, SUBHARMONICS.format("[0-9]*")), journals=(f"{RESULTS}.journal",),
        beside=_figures((*FIGURES, *_FURTHER_FIGURES), FORMATS),
    ),
    "study": Written(
        what="a study", results=(STUDY_FILE, CURVES_FILE), journals=(JOURNALS,),
        beside=_figures(("map", "curves", "amplification", "percentiles", "worst", "band"), ("png", "svg")),
        retry="compute what did not complete once more with --missing, ",
    ),
    "run_up": Written(
        what="a run-up", results=(PASSED,), journals=(f"{PASSED}.journal",), beside=_figures(("run_up",)),
    ),
    "identify": Written(
        what="a fit", results=(FITTED,), beside=("summary.txt", "values.json", *_figures(("fit",))),
    ),
    "preload": Written(what="load steps", results=(LOADED,), beside=("preload.xdmf", *_figures(("preload",)))),
}  # fmt: skip
"""By the verb; those of tables write what ``run`` does."""


class OutputFolder:
    """Where a verb writes; used as a context it is left as it was where nothing was found.

    Parameters
    ----------
    folder
        Where the results are wanted; made if it is not there.
    case_path, case_text
        The case, where a copy of it is to be kept with the results.
    force
        Whether earlier results may be replaced. New results then grow in the subfolder ``unfinished`` and take the
        place of the earlier ones by :meth:`complete`.
    writes
        Which of ``WRITTEN`` it leaves.
    goes_on
        Whether it goes on with results of its own kind that are there.

    Raises
    ------
    InputError
        If there are results already, another run writes into the folder, or it cannot be made or written.
    """

    def __init__(
        self,
        folder: Path,
        *,
        case_path: Path | None = None,
        case_text: str = "",
        force: bool = False,
        writes: str = "run",
        goes_on: bool = False,
    ) -> None:
        self.folder, self._case_path, self._case_text = folder, case_path, case_text
        self._writes, self._goes_on = writes, goes_on
        self._created: list[Path] = []
        self._copied: Path | None = None
        self._lock: FolderLock | None = None
        self._refuse(force)
        try:
            with telling(folder):
                self._make(folder)
                self._lock = FolderLock(folder)
                earlier = self._refuse(force)  # once more: a run that held the lock until now may have left some
                self.work = self._free("unfinished") if earlier else folder
                self._make(self.work)
                with tempfile.TemporaryFile(dir=self.work):
                    pass
                remove_leftovers(self.results)
        except BaseException:
            self.abandon()
            raise

    def __enter__(self) -> Self:
        """Hold the folder."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Let others in; on an error what is empty goes."""
        if error is not None:
            self.abandon()
        self.release()

    def _refuse(self, force: bool) -> bool:
        """Whether there are earlier results; unless they may be replaced that is a fault."""
        if force:
            return bool(_held(self.folder, self._writes) or self._other_case())
        refuse_held(self.folder, self._writes, goes_on=self._goes_on)
        if copy := self._other_case():
            raise InputError(f"{self.folder} already holds {copy}; {OR_REPLACE}")
        return False

    @property
    def results(self) -> Path:
        """The results file while it is being written."""
        return self.work / RESULTS

    @property
    def replaces(self) -> bool:
        """Whether earlier results stay until this run is complete."""
        return self.work != self.folder

    def copy_case(self) -> None:
        """Keep the case with its results."""
        assert self._case_path is not None
        copy = self.work / self._case_path.name
        if not (copy.exists() and copy.samefile(self._case_path)):
            copy.write_text(self._case_text, encoding="utf-8")
            self._copied = copy

    def discard(self) -> None:
        """Remove what this run has written, as nothing was found, and then what is empty."""
        from slipstick.io.journal import journal_of

        for path in (self.results, journal_of(self.results), self._copied):
            if path is not None:
                path.unlink(missing_ok=True)
        self.abandon()

    def complete(self) -> None:
        """Put the new results in the place of earlier ones."""
        if not self.replaces:
            return
        new, old = {path.name: path for path in self.work.iterdir()}, _held(self.folder, self._writes)
        for name, path in new.items():
            os.replace(path, self.folder / name)
        for name in old:
            if name not in new:
                (self.folder / name).unlink(missing_ok=True)
        self.work.rmdir()
        self.work = self.folder

    def release(self) -> None:
        """Let the next run in."""
        if self._lock is not None:
            self._lock.release()

    def abandon(self) -> None:
        """Remove what is empty of the folders made here: nothing was found."""
        self.release()
        for path in reversed(self._created):
            if path.is_dir() and not any(path.iterdir()):
                path.rmdir()

    def _other_case(self) -> str:
        """The name of the case, where the folder holds another one of that name."""
        if self._case_path is None:
            return ""
        copy = self.folder / self._case_path.name
        same = not copy.exists() or copy.samefile(self._case_path) or self._case_text == _text(copy)
        return "" if same else copy.name

    def _free(self, name: str) -> Path:
        candidates = (self.folder / (name if i == 1 else f"{name}-{i}") for i in range(1, 1000))
        return next(path for path in candidates if not path.exists())

    def _make(self, path: Path) -> None:
        missing = [p for p in (path, *path.parents) if not p.exists()]
        path.mkdir(parents=True, exist_ok=True)
        self._created += reversed(missing)


def refuse_held(folder: Path, writes: str, *, goes_on: bool = False) -> None:
    """Raises InputError where a folder holds results, of any verb, or what one that leaves ``writes`` would replace.

    With ``goes_on`` it may hold results of that kind.
    """
    own, held = WRITTEN[writes], _held(folder, writes)
    if goes_on and _named(folder, (*own.results, *own.journals)):
        kept = _named(folder, (*own.results, *own.journals, *own.beside, REPORT))
        held = [name for name in held if name not in kept]
    if not held:
        return
    begun = next((one for one in WRITTEN.values() if any(Path(held[0]).match(name) for name in one.journals)), None)
    if begun is None:
        raise InputError(f"{folder} already holds {held[0]}; {OR_REPLACE}")
    raise InputError(
        f"{folder} already holds {begun.what} that did not end; go on with it by 'slipstick resume {folder}', "
        f"{begun.retry}{OR_REPLACE}"
    )


def _held(folder: Path, writes: str) -> list[str]:
    """Names of what stands in the place of new results: journals, results, and what was written beside them."""
    if not folder.is_dir():
        return []
    begun = _named(folder, [name for one in WRITTEN.values() for name in one.journals])
    done = _named(folder, [name for one in WRITTEN.values() for name in one.results])
    theirs = [one for key, one in WRITTEN.items() if key == writes or _named(folder, (*one.results, *one.journals))]
    return [*begun, *done, *_named(folder, [REPORT, *(name for one in theirs for name in one.beside)])]


def _named(folder: Path, patterns: Sequence[str]) -> list[str]:
    """Names in a folder that fit patterns, in the order of these."""
    return list(dict.fromkeys(path.name for pattern in patterns for path in sorted(folder.glob(pattern))))


def work_of(folder: Path) -> Path:
    """Where the last run into a folder wrote: beside earlier results that it has not replaced, or the folder itself."""
    names = [name for one in WRITTEN.values() for name in (*one.results, *one.journals)]
    begun = [path for path in folder.glob("unfinished*") if _named(path, names)]
    return max(begun, key=lambda path: path.stat().st_mtime, default=folder)


def require_folder(folder: Path) -> None:
    """Raises InputError where there is no such folder."""
    if folder.is_dir():
        return
    expected = "expected a folder that 'slipstick run' or 'slipstick study' wrote"
    if not folder.exists():
        raise InputError(f"{folder}: there is no such folder; {expected}")
    raise InputError(f"{folder}: found a file; {expected}")


class FolderOfRun(OutputFolder):
    """The folder of an earlier run, study or run-up, to go on with it; nothing in it is removed.

    Raises
    ------
    InputError
        If there is no such folder, or another run writes into it.
    """

    def __init__(self, folder: Path) -> None:
        require_folder(folder)
        self.folder, self._created = folder, []
        self._case_path, self._case_text, self._copied = None, "", None
        with telling(folder):
            self._lock = FolderLock(folder)
        self.work = work_of(folder)
        self._writes, self._goes_on = analysis_in(self.work) or "run", True
        remove_leftovers(self.results)

    def keep_case(self, name: str, text: str) -> None:
        """Keep the case with its results, as :meth:`copy_case` does, where that was not reached."""
        copy = self.work / Path(name).name
        if not copy.exists():
            copy.write_text(text, encoding="utf-8")


def results_of(path: Path) -> Path:
    """The results in a folder, of a run, a study, a run-up or a fit; a file is itself.

    Raises InputError where a folder holds none.
    """
    if not path.is_dir():
        return path
    names = (RESULTS, STUDY_FILE, PASSED, FITTED)
    held = [path / name for name in names if (path / name).is_file()]
    if not held:
        raise InputError(
            f"{path}: found a folder without {', '.join(names[:-1])} or {names[-1]}; give a results file, or its folder"
        )
    return held[0]


def analysis_in(folder: Path) -> str:
    """What a folder holds, begun or complete, by its files: "study" or "run_up"; empty for a run, or nothing."""
    from slipstick.io.journal import journal_of

    if (folder / STUDY_FILE).exists() or any(folder.glob(JOURNALS)):
        return "study"
    return "run_up" if any(path.exists() for path in (folder / PASSED, journal_of(folder / PASSED))) else ""


def _text(path: Path) -> str | None:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return None
