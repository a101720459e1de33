"""The ``report`` verb: one page of results files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from slipstick.app.terminal.answers import Answer
from slipstick.app.terminal.guard import say
from slipstick.app.verbs.output import REPORT
from slipstick.errors import InputError

if TYPE_CHECKING:
    from slipstick.results.branch import Branch


def report_results(paths: Sequence[Path], output: Path | None, *, title: str = "", contacts: int, dofs: int) -> Answer:
    """Write one report of results files, by default ``report.html`` beside the first one; what a program is told.

    Raises
    ------
    InputError
        If a results file cannot be read or the report cannot be written.
    """
    from slipstick.io.loading import load
    from slipstick.report.writing import write_report

    target = output if output is not None else paths[0].parent / REPORT
    if any(map(_is_study, paths)):
        if len(paths) > 1:
            raise InputError("a report holds one study, or results of runs; give a study by itself")
        return _told(report_study(paths[0], target, title=title, dofs=dofs))
    branches: dict[str, Branch] = {}
    for path, label in zip(paths, labels(paths), strict=True):
        branches[label] = load(path)
    return _told(write_report(branches, target, title=title, contacts=contacts, dofs=dofs))


def report_study(path: Path, target: Path, *, title: str = "", dofs: int = 12) -> Path:
    """Write the report of a study from its file ``study.nc`` and the curves beside it; the path."""
    from slipstick.io.loading import load_dataset
    from slipstick.report.writing import write_study_report
    from slipstick.studies.folder import CURVES_FILE

    beside = path.parent / CURVES_FILE
    curves = load_dataset(beside) if beside.exists() else None
    return write_study_report(load_dataset(path), curves, target, title=title, dofs=dofs)


def _is_study(path: Path) -> bool:
    from slipstick.io.loading import load_table

    return path.is_file() and "study_parameters" in load_table(path).attrs


def _told(written: Path) -> Answer:
    say(f"report in {written} ({written.stat().st_size / 1e6:.2g} MB)")
    return {"report": written}


def labels(paths: Sequence[Path]) -> list[str]:
    """A short name for each file, no two the same: its folder where the files have one name, else its own name.

    >>> labels([Path("v0/results.nc"), Path("v10/results.nc")]), labels([Path("v0.nc")])
    (['v0', 'v10'], ['v0'])
    """
    whole = [path.resolve() for path in paths]
    for found in (
        [p.stem for p in whole],
        [p.parent.name for p in whole],
        [f"{p.parent.name}/{p.stem}" for p in whole],
    ):
        if len(set(found)) == len(found):
            return found
    return (
        [str(path) for path in paths] if len(set(paths)) == len(paths) else [f"{i} {p}" for i, p in enumerate(paths, 1)]
    )
