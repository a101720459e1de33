"""The verb ``report``: one page of results files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from slipstick.cli.options import results_files
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import complain, say, say_page, warn_user
from slipstick.cli.verb import verb
from slipstick.errors import InputError
from slipstick.faults import path as path_of
from slipstick.faults import real_path
from slipstick.runs.folder import REPORT, results_of

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions

_PAGES = (".html", ".htm")


@verb
def report(
    answer: Answer,
    results: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULTS.nc...",
            help="Results files or folders, overlaid; a study; a run-up, with its steady curve or alone; a fit.",
            autocompletion=results_files,
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The page; by default report.html beside the first file.")
    ] = None,
    title: Annotated[str, typer.Option(help="Title of the page; by default that of the first results.")] = "",
    contacts: Annotated[int, typer.Option(help="How many contacts: those that dissipate most.")] = 12,
    dofs: Annotated[int, typer.Option(help="How many dofs: those that move most.")] = 12,
    case: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="Case N of a study, computed again: its loops and states.")
    ] = None,
) -> None:
    """Write one self-contained page of results, for any browser: curves, loops, states, provenance."""
    answer |= report_results(results, output, title=title, contacts=contacts, dofs=dofs, case=case)


def report_results(
    paths: Sequence[Path],
    output: Path | None,
    *,
    title: str = "",
    contacts: int,
    dofs: int,
    case: int | None = None,
) -> Answer:
    """Write one report of results files, by default ``report.html`` beside the first one; what a program is told.

    A folder stands for the results in it. Of a study, ``case`` is computed again, and its own report written.

    Raises
    ------
    InputError
        If a results file cannot be read or the report cannot be written; for a case that the study does not have.
    """
    from slipstick.io.loading import load, load_dataset, load_table
    from slipstick.report.writing import write_fit_report, write_report, write_run_up_report
    from slipstick.results.run_up import RunUp
    from slipstick.results.view import analysis_of

    paths = [results_of(path_of("results", path, "a results file or its folder")) for path in paths]
    twice = sorted({str(path) for path in paths if paths.count(path) > 1})
    for name in twice:
        warn_user(f"{name}: is given twice, and drawn twice")
    if output is not None and output.suffix.lower() not in _PAGES and not output.exists():
        raise InputError(f"-o {output}: found '{output.suffix}'; a report is a page for a browser, such as report.html")
    kinds = [analysis_of(load_table(path)) if path.is_file() else "" for path in paths]
    if case is not None:
        if kinds != ["study"]:
            raise InputError("--case is a case of a study: give its study.nc, or its folder, alone")
        target = output if output is not None else paths[0].parent / f"case-{case}.html"
        made = {f"case {case}": _case_of(paths[0], case)}
        return _announced(write_report(made, target, title=title, contacts=contacts, dofs=dofs))
    target = output if output is not None else paths[0].parent / REPORT
    if {"study", "curves"} & set(kinds):
        if len(paths) > 1:
            raise InputError("a report holds one study, or results of runs; give a study by itself")
        return _announced(report_study(paths[0], target, title=title, dofs=dofs))
    if "run_up" in kinds:
        run_up, *curves = sorted(paths, key=lambda path: kinds[paths.index(path)] != "run_up")
        if kinds.count("run_up") > 1 or len(curves) > 1:
            raise InputError("a report holds one run-up, with the results of its steady curve or without")
        run, steady = RunUp(load_dataset(run_up)), load(curves[0]) if curves else None
        target = output if output is not None else run_up.parent / REPORT
        return _announced(write_run_up_report(run, target, steady=steady, title=title, dofs=dofs))
    if "identify" in kinds:
        if len(paths) > 1:
            raise InputError("a report holds one fit, or results of runs; give the fit by itself")
        return _announced(write_fit_report(load_dataset(paths[0]), target, title=title))
    branches: dict[str, Solutions] = {}
    for path, label in zip(paths, labels(paths), strict=True):
        branches[label] = load(path)
    return _announced(write_report(branches, target, title=title, contacts=contacts, dofs=dofs))


def report_study(path: Path, target: Path, *, title: str = "", dofs: int = 12) -> Path:
    """Write the report of a study from its file ``study.nc`` and the curves beside it; the path."""
    from slipstick.io.loading import load_dataset
    from slipstick.report.writing import write_study_report
    from slipstick.studies import CURVES_FILE, STUDY_FILE

    if path.name == CURVES_FILE and (path.parent / STUDY_FILE).is_file():
        raise InputError(f"{path}: holds the curves of a study; give its {STUDY_FILE}, or its folder")
    beside = path.parent / CURVES_FILE
    curves = load_dataset(beside) if beside.exists() else None
    return write_study_report(load_dataset(path), curves, target, title=title, dofs=dofs)


def _case_of(path: Path, number: int) -> Solutions:
    """One case of a study, computed again with all that a report shows."""
    from slipstick.case.case import Case
    from slipstick.cli.terminal.guard import prepare_kernel, quietly
    from slipstick.io.loading import load_dataset

    told = load_dataset(path).attrs
    text, name = str(told.get("case", "")), str(told.get("case_file", "") or "case.toml")
    if not text:
        raise InputError(f"{path}: the study was made in Python; compute the case there, and report its branch")
    beside = [folder / name for folder in (path.parent, real_path(path).parent.parent) if (folder / name).is_file()]
    case = Case.from_text(text, next(iter(beside), path.parent / name))
    assert case.plan is not None
    if not 0 <= number < len(case.plan):
        raise InputError(f"--case: found {number}; expected a case of the study, from 0 to {len(case.plan) - 1}")
    prepare_kernel(complain)
    job = case.study_job()
    branch = quietly(job.request(case.plan.problem(job.problem, number)).solutions)
    values = zip(case.plan.names, case.plan.values[number].tolist(), strict=True)
    branch.table.attrs.update(case.names | {"study_case": ", ".join(f"{key} = {value:g}" for key, value in values)})
    return branch


def _announced(written: Path) -> Answer:
    say(f"report in {written} ({written.stat().st_size / 1e6:.2g} MB)")
    say_page(written)
    return {"report": written}


def labels(paths: Sequence[Path]) -> list[str]:
    """A short name for each file, no two the same: its folder where the files have one name, else its own name.

    >>> labels([Path("v0/results.nc"), Path("v10/results.nc")]), labels([Path("v0.nc")])
    (['v0', 'v10'], ['v0'])
    """
    whole = [real_path(path) for path in paths]
    for names in (
        [p.stem for p in whole],
        [p.parent.name for p in whole],
        [f"{p.parent.name}/{p.stem}" for p in whole],
    ):
        if len(set(names)) == len(names):
            return names
    return (
        [str(path) for path in paths] if len(set(paths)) == len(paths) else [f"{i} {p}" for i, p in enumerate(paths, 1)]
    )
