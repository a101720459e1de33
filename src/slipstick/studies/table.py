"""From the cases of a study to its dataset, and to that of its curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.parameters import parameter_units
from slipstick.errors import Outcome
from slipstick.results.amplification import TUNED, with_amplification
from slipstick.results.schema import ANALYSIS, Declared, Layout, attributes_of, make_table, unit_in
from slipstick.studies.plan import StudyPlan
from slipstick.studies.solving import CaseSolved, Job

if TYPE_CHECKING:
    import xarray

Cases = Mapping[int, CaseSolved]
"""Cases by number, as far as they are computed."""
OUTCOMES = tuple(outcome.name for outcome in Outcome)

_ROWS = {
    "case": Declared((), "1", "number of the case in the study", whole=True),
    "peak_amplitude": Declared(
        ("dof",), "length", "largest amplitude over the curve (0-to-peak), nan where it was not sought"
    ),
    "peak_omega": Declared(("dof",), "rad/time", "fundamental frequency of the largest amplitude"),
    "peak_parameter": Declared(("dof",), "1", "value of the followed parameter at the largest amplitude"),
    "peak_located": Declared(
        ("dof",),
        "1",
        "1 where that is a peak, 0 where it is at an end of the curve, -1 where it was not sought",
        whole=True,
    ),
    "peak_stable": Declared(("dof",), "1", "whether the motion is stable there: 1, 0, or -1", whole=True),
    "unstable_points": Declared((), "1", "points of the curve whose motion is unstable", whole=True),
    "truncation": Declared((), "1", "largest estimate of what the harmonics left out would add along the curve"),
    "outcome": Declared((), "1", "how the case ended; empty where it was not computed yet", texts=OUTCOMES),
    "points": Declared((), "1", "points of the curve", whole=True),
    "evaluations": Declared((), "1", "evaluations of the balance", whole=True),
    "seconds": Declared((), "s", "time of the case"),
    "lockstep": Declared((), "1", "1 where the curve was followed in lockstep with others, 0 where alone", whole=True),
}


def row_layout(job: Job, plan: StudyPlan) -> Layout:
    """What is kept of every case."""
    units = job.problem.units
    followed, other = ("peak_parameter", "peak_omega") if job.parameter else ("peak_omega", "peak_parameter")
    without = {other} if job.stability else {other, "peak_stable", "unstable_points"}
    rows = {name: declared for name, declared in _ROWS.items() if name not in without}
    if job.parameter:
        rows[followed] = rows[followed]._replace(units=parameter_units(job.problem, job.parameter))
    for name in plan.names:
        rows[name] = Declared((), parameter_units(job.problem, name), name)
    dofs = tuple(job.problem.outputs or ())
    labelled = {name: d._replace(units="s" if d.units == "s" else unit_in(units, d, dofs)) for name, d in rows.items()}
    return Layout(labels={"dof": dofs}, variables=labelled)


def study_dataset(job: Job, plan: StudyPlan, cases: Cases, attributes: Mapping[str, Any]) -> xarray.Dataset:
    """The cases along their parameters: a grid has its parameters as dimensions, else they lie along ``case``."""
    import xarray

    layout = row_layout(job, plan)
    rows = np.full((len(plan), layout.size), np.nan)
    for case, solved in cases.items():
        rows[case] = layout.pack({**solved.row, **_values(plan, case)})
    flat, dims, shape = layout.unpack(rows[: plan.size]), plan.dims, plan.shape
    flat["case"] = np.arange(plan.size)
    flat["message"] = np.array([cases[i].message if i in cases else "" for i in range(plan.size)], dtype=np.str_)
    variables: dict[str, Any] = {}
    for name, values in flat.items():
        declared = layout.variables.get(name, Declared((), "1", "how the case ended, in words"))
        about = {"units": declared.units, "long_name": declared.long_name}
        variables[name] = ((*dims, *declared.dims), values.reshape(*shape, *values.shape[1:]), about)
    coords: dict[str, Any] = {"dof": ("dof", np.array(layout.labels["dof"], dtype=np.str_), {"long_name": "dof"})}
    for name, axis in zip(plan.names, plan.axes or plan.values[: plan.size].T, strict=True):
        about = variables.pop(name)[2]
        coords[name] = (name if plan.axes else "case", axis, about)
    if not plan.axes:
        coords["case"] = variables.pop("case")
    found = xarray.Dataset(variables, coords=coords, attrs=dict(attributes))
    return found if plan.tuned is None else with_amplification(found)


def _values(plan: StudyPlan, case: int) -> dict[str, float]:
    return dict(zip(plan.names, plan.values[case].tolist(), strict=True))


def curves_dataset(job: Job, cases: Cases, attributes: Mapping[str, Any]) -> xarray.Dataset:
    """All curves one after another along ``point``; ``case`` says whose a point is."""
    layout = job.curve_layout
    curves = [cases[case].curve for case in sorted(cases) if len(cases[case].curve)]
    rows = np.concatenate(curves) if curves else np.zeros((0, layout.size))
    return make_table(layout, layout.unpack(rows), {**attributes, ANALYSIS: "curves"}).to_dataset()


def curves_with_parameters(curves: xarray.Dataset, study: xarray.Dataset) -> xarray.Dataset:
    """The curves of a study with the parameters of its case at every point, as variables of their own."""
    number = study["case"]
    at = np.argsort(number.to_numpy().ravel())[curves["case"].to_numpy().astype(int)]
    told: dict[str, Any] = {}
    for name in str(study.attrs["study_parameters"]).splitlines():
        values = study[name].broadcast_like(number).transpose(*number.dims).to_numpy().ravel()
        told[name] = "point", values[at], dict(study[name].attrs)
    return curves.assign(told)


def study_attributes(job: Job, plan: StudyPlan, cases: Cases, more: Mapping[str, Any]) -> dict[str, Any]:
    """What a study says about itself; its outcome is COMPLETED where every case is."""
    failed = sum(not solved.outcome.ok for solved in cases.values())
    done = len(cases) == len(plan) and not failed
    text = f"{len(cases)} of {len(plan)} cases are computed" + (
        f", {failed} of them did not complete" if failed else ""
    )
    said = list(dict.fromkeys([*plan.warnings, *(w for case in sorted(cases) for w in cases[case].warnings)]))
    tuned = {}
    if plan.tuned is not None:
        text += ", the tuned disc among them" if plan.tuned in cases else ", the tuned disc not yet"
        tuned = {TUNED: _largest(cases.get(plan.tuned)), "study_spread": plan.spread}
        said[:0] = _doubts(plan, cases)
    outcome = Outcome.COMPLETED if done else Outcome.INTERRUPTED if len(cases) < len(plan) else Outcome.FAILED
    made = attributes_of(job.problem, outcome, text, said[:MOST_WARNINGS], analysis="study", parameter=job.parameter)
    drawn = "\n".join(f"{name}: {d}" for name, d in zip(plan.names, plan.distributions, strict=False))
    sampled = {"study_seed": plan.seed, "study_distributions": drawn} if plan.distributions else {}
    about = {"study_method": plan.method, "study_parameters": "\n".join(plan.names), **sampled, **tuned}
    return {**made, **about, **more}


def _largest(solved: CaseSolved | None) -> float:
    """The largest amplitude of a complete case; else nan."""
    sizes = np.asarray(
        [] if solved is None or not solved.outcome.ok else solved.row.get("peak_amplitude", []), dtype=float
    )
    return float(np.nanmax(sizes)) if np.isfinite(sizes).any() else float("nan")


def _doubts(plan: StudyPlan, cases: Cases) -> Iterator[str]:
    """Warnings of a tuned disc that failed, and of discs that move most at an end of the range."""
    tuned = None if plan.tuned is None else cases.get(plan.tuned)
    if tuned is not None and not tuned.outcome.ok:
        yield f"study: no amplification is known, as the tuned disc did not complete: {tuned.message}"
    ends = {n for n, solved in cases.items() if 0 in np.asarray(solved.row.get("peak_located", -1))}
    if plan.tuned in ends:
        yield "study: the largest amplitude of the tuned disc is at an end of the range; widen the range"
    if few := len(ends - {plan.tuned}):
        yield f"study: the largest amplitude of {few} of {plan.size} discs is at an end of the range; widen the range"


MOST_WARNINGS = 20
"""So many different warnings of the cases are kept with a study."""
