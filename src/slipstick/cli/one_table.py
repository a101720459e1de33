"""What verbs share that compute what one table of a case asks for, into a folder of its own."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from slipstick.cli.options import run_options
from slipstick.cli.terminal.answers import Answer, files_in
from slipstick.cli.terminal.guard import (
    DONE,
    STOPPED,
    complain,
    prepare_kernel,
    say,
    termination_as_interrupt,
    warn_user,
)
from slipstick.errors import InputError, SlipstickWarning
from slipstick.runs.folder import REPORT, OutputFolder
from slipstick.units import after_number, unit_of_dof

if TYPE_CHECKING:
    from slipstick.analysis.road.events import EventFunction
    from slipstick.branch import Branch
    from slipstick.case.case import Case


P = ParamSpec("P")
T = TypeVar("T")


@contextmanager
def shown(time_limit: str | None, *, quiet: bool, answer: Answer) -> Iterator[tuple[EventFunction, ...]]:
    """Who listens to an analysis: the terminal, and the clock that ends it; kills are as Ctrl-C meanwhile."""
    from slipstick.cli.terminal.display import ShownAnalysis, curve_display
    from slipstick.runs.run import Clock

    options = run_options(time_limit, figures=True, report=True, quiet=quiet, answer=answer)
    with termination_as_interrupt(), curve_display(0.0, 1.0, "", quiet=quiet) as display:
        yield ShownAnalysis(display), Clock(options.until)


def quietly(compute: Callable[P, T], *arguments: P.args, **more: P.kwargs) -> T:
    """What is computed; its warnings are told from the results."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SlipstickWarning)
        return compute(*arguments, **more)


def case_with(path: Path, name: str, example: str) -> tuple[Case, Any]:
    """A case and its table of that name, without which it is refused; the kernel is ready then."""
    from slipstick.case.case import Case

    case = Case.from_file(path)
    if name not in case.further:
        raise InputError(f"{path}: [{name}] is missing; give it, such as {example}")
    prepare_kernel(complain)
    return case, case.further[name]


@contextmanager
def folder_of(case: Case, output: Path | None, verb: str, force: bool) -> Iterator[OutputFolder]:
    """The folder of the results, nobody else's meanwhile; by default ``CASE-verb``."""
    folder = OutputFolder(output or Path(f"{case.name}-{verb}"), case_path=case.path, case_text=case.text, force=force)
    try:
        yield folder
    finally:
        folder.abandon()  # what holds something stays


def written(case: Case, branch: Branch, folder: OutputFolder, answer: Answer, *, figures: Mapping[str, Any]) -> int:
    """Save what was found, say how it ended; the exit code."""
    branch.table.attrs.update(case.names)
    for sentence in branch.warnings:
        warn_user(sentence)
    answer |= {"outcome": branch.outcome.name, "message": branch.message, "points": len(branch)}
    say(branch.message)
    if len(branch):
        folder.copy_case()
        branch.save(folder.results)
        branch.report(folder.work / REPORT)
        for name, draw in figures.items():
            from slipstick.plots import save_figure

            save_figure(draw(branch), folder.work / name, formats=("png",))
        if branch.outcome.ok:
            folder.complete()
        answer |= files_in(folder.work)
        say(f"results in {folder.work}/")
    if folder.replaces:
        complain(f"the earlier results in {folder.folder} are untouched; the new ones are not complete")
    return DONE if branch.outcome.ok else STOPPED


def range_of(case: Case, table: Any) -> tuple[float, float]:
    """Frequencies between which the peak is sought."""
    return case.span if table.omega is None else table.omega


def peak_text(case: Case, branch: Branch, dof: int, amplitude: float, omega: float) -> str:
    """How high a peak of a dof, by its number, is, and where."""
    label, name = str(branch.table["amplitude"].attrs.get("units", "")), str(branch.table["dof"].to_numpy()[dof])
    unit = after_number(unit_of_dof(label, name))
    return f"amplitude {amplitude:.6g}{unit} of {name} at {case.frequency_text(omega)}"
