"""The folder a run writes into: earlier results are never overwritten unasked, and kept until new ones are complete."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from slipstick.errors import InputError
from slipstick.io.lock import FolderLock
from slipstick.replacing import remove_leftovers, telling

RESULTS, REPORT = "results.nc", "report.html"
FITTED, PASSED, LOADED = "identify.nc", "run_up.nc", "preload.nc"
SUBHARMONICS = "subharmonic_{}.nc"
FORMATS = ("png", "svg", "pdf")
FIGURES = (
    *("response", "mean", "phase", "spectrum", "history"),
    *("power", "fractions", "friction", "temperature", "loop", "orbit", "states"),
)
_FURTHER_FIGURES = ("backbone", "damping", "stability", "wear", "worn_surface")
_FILES = (
    *(RESULTS, RESULTS + ".journal", REPORT),
    *(f"{figure}.{ending}" for figure in (*FIGURES, *_FURTHER_FIGURES) for ending in FORMATS),
)


class OutputFolder:
    """Where a run writes.

    Parameters
    ----------
    folder
        Where the results are wanted; made if it is not there.
    case_path, case_text
        The case, a copy of which is kept with the results.
    force
        Whether earlier results may be replaced. New results then grow in the subfolder ``unfinished`` and take the
        place of the earlier ones by :meth:`complete`.

    Raises
    ------
    InputError
        If there are results already, another run writes into the folder, or it cannot be made or written.
    """

    def __init__(self, folder: Path, *, case_path: Path, case_text: str, force: bool = False) -> None:
        self.folder, self._case_path, self._case_text = folder, case_path, case_text
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

    def _refuse(self, force: bool) -> bool:
        """Whether there are earlier results; unless they may be replaced that is a fault."""
        earlier = self._earlier()
        if earlier and not force:
            begun = RESULTS + ".journal" in earlier
            held = "a run that did not end" if begun else earlier[0]
            more = f"go on with it by 'slipstick resume {self.folder}', " if begun else ""
            raise InputError(
                f"{self.folder} already holds {held}; {more}choose another folder with -o, or --force to replace its "
                "results"
            )
        return bool(earlier)

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
        new = {path.name: path for path in self.work.iterdir()}
        for name, path in new.items():
            os.replace(path, self.folder / name)
        for name in _left_by_runs(self.folder):
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

    def _earlier(self) -> list[str]:
        if not self.folder.is_dir():
            return []
        names = [name for name in _left_by_runs(self.folder) if (self.folder / name).exists()]
        copy = self.folder / self._case_path.name
        if copy.exists() and not copy.samefile(self._case_path) and self._case_text != _text(copy):
            names.append(copy.name)
        return names

    def _free(self, name: str) -> Path:
        candidates = (self.folder / (name if i == 1 else f"{name}-{i}") for i in range(1, 1000))
        return next(path for path in candidates if not path.exists())

    def _make(self, path: Path) -> None:
        missing = [p for p in (path, *path.parents) if not p.exists()]
        path.mkdir(parents=True, exist_ok=True)
        self._created += reversed(missing)


def _left_by_runs(folder: Path) -> list[str]:
    """Names of files that a run may have left in a folder."""
    return [*_FILES, *sorted(path.name for path in folder.glob(SUBHARMONICS.format("[0-9]*")))]


def work_of(folder: Path) -> Path:
    """Where the last run into a folder wrote: beside earlier results that it has not replaced, or the folder itself."""
    begun = [path for path in folder.glob("unfinished*") if any((path / name).exists() for name in _FILES[:2])]
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
    """The folder of an earlier run, to go on with it; nothing in it is removed.

    Raises
    ------
    InputError
        If there is no such folder, or another run writes into it.
    """

    def __init__(self, folder: Path) -> None:
        require_folder(folder)
        self.folder, self._created = folder, []
        with telling(folder):
            self._lock = FolderLock(folder)
        self.work = work_of(folder)
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
    from slipstick.studies.folder import STUDY_FILE

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
    from slipstick.studies.folder import JOURNALS, STUDY_FILE

    if (folder / STUDY_FILE).exists() or any(folder.glob(JOURNALS)):
        return "study"
    return "run_up" if any(path.exists() for path in (folder / PASSED, journal_of(folder / PASSED))) else ""


def _text(path: Path) -> str | None:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return None
