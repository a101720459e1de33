"""The verbs ``track``, ``optimal``, ``modes``: a peak over a parameter, where it is lowest, a nonlinear mode."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.app.terminal.answers import Answer
from slipstick.app.terminal.guard import say
from slipstick.app.verbs.one_table import case_with, folder_of, quietly, written
from slipstick.case.case import Case
from slipstick.errors import InputError
from slipstick.units import after_number

if TYPE_CHECKING:
    from slipstick.analysis.peaks.optimum import Optimum
    from slipstick.branch import Branch


def track_case(path: Path, output: Path | None, answer: Answer, *, force: bool = False, figures: bool = True) -> int:
    """Follow the peak of ``[track]`` into a folder, by default ``CASE-track``; the exit code.

    Raises
    ------
    InputError
        If the case has faults or no ``[track]``, or the folder holds results.
    """
    from slipstick.analysis.peaks.tracking import track_peak

    case, table = case_with(path, "track", 'parameter = "damper.normal_load", from = 10, to = 1000')
    with folder_of(case, output, "track", force) as folder:
        branch = quietly(
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
        return written(case, branch, folder, answer, figures=drawn)


def optimal_case(path: Path, output: Path | None, answer: Answer, *, force: bool = False, figures: bool = True) -> int:
    """Find the optimum of ``[optimal]``, into a folder, by default ``CASE-optimal``; the exit code.

    Raises
    ------
    InputError
        If the case has faults or no ``[optimal]``, or the folder holds results.
    """
    from slipstick.analysis.peaks.optimum import optimal

    case, table = case_with(path, "optimal", 'parameter = "damper.normal_load"')
    with folder_of(case, output, "optimal", force) as folder:
        found = quietly(
            optimal,
            case.problem(), table.parameter, omega=_range(case, table), dof=table.dof, start=table.start
        )  # fmt: skip
        answer |= {"value": found.value, "omega": found.omega, "amplitude": found.amplitude, "kind": found.kind}
        if found.kind:
            unit = after_number(str(found.branch.table["parameter"].attrs.get("units", "")))
            where = _peak(case, found.branch, found.amplitude, found.omega)
            say(f"the peak of {found.dof} is {found.kind} at {table.parameter} = {found.value:.8g}{unit}: {where}")
        branch = _among_peaks(case, table, found)
        drawn = {"response": lambda branch: branch.plot.response(found.dof)} if figures and len(branch) > 1 else {}
        return written(case, branch, folder, answer, figures=drawn)


_BESIDE = 4.0
"""The peak is shown from this part of the optimal value to as many times it."""


def _among_peaks(case: Case, table: Any, found: Optimum) -> Branch:
    """The peak over values round the optimal one, which is marked; the optimum alone where it is not met again."""
    from slipstick.analysis.peaks.tracking import track_peak

    if not found.kind or found.value == 0.0:
        return found.branch
    span = (found.value / _BESIDE, found.value * _BESIDE)
    try:
        peaks = quietly(
            track_peak, case.problem(), table.parameter, span, omega=_range(case, table), dof=found.dof
        )  # fmt: skip
    except InputError:  # a parameter that cannot have such values
        return found.branch
    data = peaks.table
    met = data["parameter"].to_numpy()[data["kind"].to_numpy() == "optimum"]
    near = abs(met - found.value) <= _SAME * abs(found.value)
    return peaks if peaks.outcome.ok and near.any() else found.branch


_SAME = 1e-6


def modes_case(path: Path, output: Path | None, answer: Answer, *, force: bool = False, figures: bool = True) -> int:
    """Follow the nonlinear mode of ``[modes]`` into a folder, by default ``CASE-modes``; the exit code.

    Raises
    ------
    InputError
        If the case has faults or no ``[modes]``, or the folder holds results.
    """
    from slipstick.analysis.modes.nonlinear_modes import nonlinear_modes
    from slipstick.plots import backbone, damping

    case, table = case_with(path, "modes", "from = 0.01, to = 10.0")
    with folder_of(case, output, "modes", force) as folder:
        branch = quietly(
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
        return written(case, branch, folder, answer, figures=drawn)


def _range(case: Case, table: Any) -> tuple[float, float]:
    return case.span if table.omega is None else table.omega


def _peak(case: Case, branch: Branch, amplitude: float, omega: float) -> str:
    unit = after_number(str(branch.table["amplitude"].attrs.get("units", "")))
    return f"amplitude {amplitude:.6g}{unit} at {case.frequency_text(omega)}"
