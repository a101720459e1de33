"""One case of a study: a problem with its parameters set, its curve, and its row of the results."""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.curve.follow import frequency_request, parameter_request
from slipstick.errors import InputError, Outcome
from slipstick.results.schema import LARGEST, Declared, Layout, layout_of
from slipstick.results.view import names_of
from slipstick.studies.plan import StudyPlan
from slipstick.typing import Array, Names
from slipstick.units import compared

if TYPE_CHECKING:
    from slipstick.analysis.curve.follow import CurveRequest, StabilityRequest
    from slipstick.balance.problem import Problem
    from slipstick.results.solutions import Solutions
    from slipstick.solve.continuation import ContinuationOptions

_STABILITY = ("stable", "multiplier_max")
CURVE = ("omega", "amplitude", "mean", "dissipated_power", "truncation", "branch_part", "peak_dof", *_STABILITY)
"""Variables stored for every point of every curve."""

_CASE = Declared((), "1", "number of the case in the study", whole=True)


@dataclass(frozen=True, kw_only=True)
class Job:
    """The computation of every case: the problem, and the range that is followed.

    Attributes
    ----------
    parameter
        The followed parameter, at ``omega``; empty where it is the frequency.
    span
        First and last frequency, or value of the parameter.
    """

    problem: Problem
    span: tuple[float, float]
    parameter: str = ""
    omega: float = 0.0
    requested: tuple[float, ...] = ()
    peaks_of: Names = None
    options: ContinuationOptions | Mapping[str, Any] | None = None
    stability: StabilityRequest = False

    def request(self, problem: Problem) -> CurveRequest:
        """The branch of one case."""
        arguments = (self.requested, self.peaks_of, self.options, (), None, self.stability)
        if self.parameter:
            return parameter_request(problem, self.parameter, self.span, self.omega, *arguments)
        return frequency_request(problem, self.span, *arguments)

    @cached_property
    def curve_layout(self) -> Layout:
        """Variables stored for every point of the curves."""
        full = layout_of(self.problem, parameter=self.parameter, stability=bool(self.stability))
        names = [name for name in (*(("parameter",) if self.parameter else ()), *CURVE) if name in full.variables]
        variables = {"case": _CASE, **{name: full.variables[name] for name in names}}
        used = {dim for declared in variables.values() for dim in declared.dims}
        return Layout(labels={dim: labels for dim, labels in full.labels.items() if dim in used}, variables=variables)


@dataclass(frozen=True, kw_only=True)
class CaseSolved:
    """A case: its row of the results by name, its curve (n_points, size), message and warnings."""

    row: Mapping[str, Any]
    curve: Array
    message: str
    warnings: tuple[str, ...] = ()

    @property
    def outcome(self) -> Outcome:
        """How it ended."""
        return Outcome[self.row["outcome"]]

    @classmethod
    def failed(cls, case: int, message: str, seconds: float = 0.0) -> CaseSolved:
        """A case that ended by a fault: a row all the same."""
        row = {"case": case, "outcome": Outcome.FAILED.name, "points": 0, "seconds": seconds, "lockstep": 0}
        return cls(row=row, curve=np.zeros((0, 0)), message=message)


def solve(job: Job, plan: StudyPlan, case: int) -> CaseSolved:
    """Solve one case; faults become a failed case, only Ctrl-C is raised."""
    begin = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return _solve(job, plan, case, begin)
        except InputError as error:
            message = "; ".join(error.sentences)
        except Exception as error:
            first = next((line for line in str(error).splitlines() if line.strip()), "")[:200]
            message = f"a fault of slipstick itself ({type(error).__name__}: {first}); please report it with this case"
    return CaseSolved.failed(case, message, time.perf_counter() - begin)


def _solve(job: Job, plan: StudyPlan, case: int, begin: float) -> CaseSolved:
    branch = job.request(plan.problem(job.problem, case)).solutions()
    if branch.outcome is Outcome.INTERRUPTED:
        raise KeyboardInterrupt
    return solved_case(job, case, branch, time.perf_counter() - begin)


def solved_case(job: Job, case: int, branch: Solutions, seconds: float, *, lockstep: bool = False) -> CaseSolved:
    """The row and curve of a case from its branch; ``seconds`` is its share of the time."""
    data, layout = branch.table, job.curve_layout
    values = {"case": np.full(len(branch), case), **{n: data[n].to_numpy() for n in layout.variables if n != "case"}}
    row: dict[str, Any] = {"case": case, "outcome": branch.outcome.name, "points": len(branch)}
    row |= {"seconds": seconds, "evaluations": int(data.attrs["evaluations"]), "lockstep": int(lockstep)}
    if len(branch):
        row |= _peaks(values, "parameter" if job.parameter else "omega", branch)
    return CaseSolved(row=row, curve=layout.pack_all(values), message=branch.message, warnings=branch.warnings)


def _peaks(values: Mapping[str, Any], followed: str, branch: Solutions) -> dict[str, Any]:
    """The largest amplitude of every dof, where it is, and whether it is a peak; nan where it was not sought."""
    amplitude, dofs = values["amplitude"], np.arange(values["amplitude"].shape[1])
    top, alone = amplitude.argmax(axis=0), branch.sought("largest_of")
    sought = alone | branch.sought("peaks_of")
    own = values["peak_dof"][top]
    peak = np.where(alone, (top > 0) & (top < len(amplitude) - 1), own == dofs)
    if branch.table.attrs.get("peaks_of") == LARGEST and not sought.any():
        among = compared(names_of(branch.table, "dof"))
        sought = dofs == among[int(amplitude[:, among].max(axis=0).argmax())]
        peak = own >= 0  # whichever of equal blades it was located of
    told = {}
    if "stable" in values:
        told = {"peak_stable": values["stable"][top], "unstable_points": int(np.sum(values["stable"] == 0))}
    return told | {
        "peak_amplitude": np.where(sought, amplitude[top, dofs], np.nan),
        f"peak_{followed}": np.where(sought, values[followed][top], np.nan),
        "peak_located": np.where(sought, peak, -1).astype(int),
        "truncation": float(np.max(values["truncation"])),
    }
