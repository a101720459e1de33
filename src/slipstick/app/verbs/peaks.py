"""The verbs ``track``, ``optimal``, ``modes``: a peak over a parameter, where it is lowest, a nonlinear mode."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.app.case.case import Case
from slipstick.app.terminal.answers import Answer, files_in
from slipstick.app.terminal.guard import DONE, STOPPED, complain, say
from slipstick.app.verbs.output import REPORT, OutputFolder
from slipstick.app.verbs.prepare import prepare_kernel
from slipstick.errors import InputError, SlipstickWarning
from slipstick.units import after_number

if TYPE_CHECKING:
    from slipstick.results.branch import Branch


def track_case(path: Path, output: Path | None, answer: Answer, *, force: bool = False, figures: bool = True) -> int:
    """Follow the peak of ``[track]`` into a folder, by default ``CASE-track``; the exit code.

    Raises
    ------
    InputError
        If the case has faults or no ``[track]``, or the folder holds results.
    """
    from slipstick.analysis.tracking import track_peak

    case, table = _asked(path, "track", 'parameter = "damper.normal_load", from = 10, to = 1000')
    with _folder(case, output, "track", force) as folder:
        branch = _quietly(
            track_peak,
            case.problem(), table.parameter, (table.start, table.stop), omega=_range(case, table), dof=table.dof,
            requested=table.at,
        )  # fmt: skip
        data, unit = branch.table, after_number(str(branch.table["parameter"].attrs.get("units", "")))
        kinds, value = data["kind"].to_numpy(), data["parameter"].to_numpy()
        d = branch.dof_index(str(data.attrs["peak_of"]))
        size, omega = data["amplitude"].to_numpy()[:, d], data["omega"].to_numpy()
        marked = [k for k in range(len(branch)) if kinds[k] in ("optimum", "turning point", "tie")]
        for k in marked:
            say(f"{kinds[k]}: {table.parameter} = {value[k]:.6g}{unit}, {_peak(case, branch, size[k], omega[k])}")
        answer["marked"] = [
            {"kind": str(kinds[k]), "parameter": value[k], "omega": omega[k], "amplitude": size[k]} for k in marked
        ]
        of = str(data.attrs["peak_of"])
        drawn = {"response": lambda branch: branch.plot.response(of)} if figures else {}
        return _written(case, branch, folder, answer, figures=drawn)


def optimal_case(path: Path, output: Path | None, answer: Answer, *, force: bool = False) -> int:
    """Find the optimum of ``[optimal]``, into a folder, by default ``CASE-optimal``; the exit code.

    Raises
    ------
    InputError
        If the case has faults or no ``[optimal]``, or the folder holds results.
    """
    from slipstick.analysis.optimum import optimal

    case, table = _asked(path, "optimal", 'parameter = "damper.normal_load"')
    with _folder(case, output, "optimal", force) as folder:
        found = _quietly(
            optimal,
            case.problem(), table.parameter, omega=_range(case, table), dof=table.dof, start=table.start
        )  # fmt: skip
        answer |= {"value": found.value, "omega": found.omega, "amplitude": found.amplitude, "kind": found.kind}
        if found.kind:
            unit = after_number(str(found.branch.table["parameter"].attrs.get("units", "")))
            where = _peak(case, found.branch, found.amplitude, found.omega)
            say(f"the peak of {found.dof} is {found.kind} at {table.parameter} = {found.value:.8g}{unit}: {where}")
        return _written(case, found.branch, folder, answer, figures={})


def modes_case(path: Path, output: Path | None, answer: Answer, *, force: bool = False, figures: bool = True) -> int:
    """Follow the nonlinear mode of ``[modes]`` into a folder, by default ``CASE-modes``; the exit code.

    Raises
    ------
    InputError
        If the case has faults or no ``[modes]``, or the folder holds results.
    """
    from slipstick.analysis.nonlinear_modes import nonlinear_modes
    from slipstick.plots import backbone, damping

    case, table = _asked(path, "modes", "from = 0.01, to = 10.0")
    with _folder(case, output, "modes", force) as folder:
        branch = _quietly(
            nonlinear_modes,
            case.problem(), amplitude=(table.start, table.stop), mode=table.mode, dof=table.dof,
            load_factors=table.load_factors,
        )  # fmt: skip
        data, d = branch.table, branch.dof_index(table.dof)
        factor, ratio = data["load_factor"].to_numpy(), data["modal_damping"].to_numpy()
        size, omega = data["amplitude"].to_numpy()[:, d], data["omega"].to_numpy()
        asked = (data["kind"].to_numpy() == "requested").nonzero()[0]
        for k in asked:
            peak = _peak(case, branch, size[k], omega[k])
            say(f"loads times {factor[k]:.6g}: {peak}, damping ratio {100.0 * ratio[k]:.3g} %")
        answer["peaks"] = [
            {"load_factor": factor[k], "omega": omega[k], "amplitude": size[k], "damping": ratio[k]} for k in asked
        ]
        drawn = {"backbone": backbone, "damping": damping} if figures else {}
        return _written(case, branch, folder, answer, figures=drawn)


def _quietly(compute: Callable[..., Any], *arguments: Any, **more: Any) -> Any:
    """What is computed; its warnings are told from the results."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SlipstickWarning)
        return compute(*arguments, **more)


def _asked(path: Path, name: str, example: str) -> tuple[Case, Any]:
    case = Case.from_file(path)
    if name not in case.further:
        raise InputError(f"{path}: [{name}] is missing; give it, such as {example}")
    prepare_kernel(complain)
    return case, case.further[name]


def _range(case: Case, table: Any) -> tuple[float, float]:
    return case.span if table.omega is None else table.omega


@contextmanager
def _folder(case: Case, output: Path | None, verb: str, force: bool) -> Iterator[OutputFolder]:
    """The folder of the results, nobody else's meanwhile; by default ``CASE-verb``."""
    folder = OutputFolder(output or Path(f"{case.name}-{verb}"), case_path=case.path, case_text=case.text, force=force)
    try:
        yield folder
    finally:
        folder.abandon()  # what holds something stays


def _peak(case: Case, branch: Branch, amplitude: float, omega: float) -> str:
    unit = after_number(str(branch.table["amplitude"].attrs.get("units", "")))
    return f"amplitude {amplitude:.6g}{unit} at {case.frequency_text(omega)}"


def _written(case: Case, branch: Branch, folder: OutputFolder, answer: Answer, *, figures: Mapping[str, Any]) -> int:
    """Save what was found, say how it ended; the exit code."""
    branch.table.attrs.update(case.names)
    for sentence in branch.warnings:
        complain(f"warning: {sentence}")
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
