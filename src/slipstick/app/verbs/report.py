"""The ``report`` verb: one page of results files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from slipstick.app.terminal.answers import Answer
from slipstick.app.terminal.guard import say
from slipstick.app.verbs.output import REPORT

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

    branches: dict[str, Branch] = {}
    for path, label in zip(paths, labels(paths), strict=True):
        branches[label] = load(path)
    target = output if output is not None else paths[0].parent / REPORT
    written = write_report(branches, target, title=title, contacts=contacts, dofs=dofs)
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
