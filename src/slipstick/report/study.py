"""Content of the page of a study: cases with outcomes, peaks and curves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.report.content import frequency_of, provenance
from slipstick.report.encoding import packed
from slipstick.report.inputs import inputs_of_case
from slipstick.results.amplification import TUNED, amplification_of, histogram_edges, is_mistuning, largest_alone
from slipstick.results.percentiles import PERCENTILES, curve_percentiles, is_sampled, peak_percentiles
from slipstick.results.view import followed_of, names_of, ranked, unit_of, unit_shown
from slipstick.typing import Array
from slipstick.units import after_number

if TYPE_CHECKING:
    import xarray

MOST_CURVES = 300
"""Curves in one page; of more, some evenly chosen."""
MOST_POINTS = 400
"""Points of each curve in a page; peaks are among them."""

_NAMED = 8
"""Up to so many parameters are named one by one."""
_NEEDED = ("peak_amplitude", "outcome", "message", "points", "seconds")


def study_content(study: xarray.Dataset, curves: xarray.Dataset | None, *, dofs: int) -> dict[str, Any]:
    """A study as JSON, with the ``dofs`` that move most. Raises InputError where it is not as studies are."""
    names = str(study.attrs["study_parameters"]).splitlines()
    if not {*_NEEDED, *names} <= set(study.variables) or "case" not in study.variables:
        raise InputError("these are not the results of a study as 'slipstick study' writes them; compute them again")
    if is_mistuning(study):
        study, curves = largest_alone(study, curves)
    dims = study["case"].dims
    peaks = study["peak_amplitude"].transpose(*dims, "dof").to_numpy().reshape(study["case"].size, -1)
    order = ranked(study, "dof", "peak_amplitude")
    kept = np.sort(order[:dofs])
    known = names_of(study, "dof")
    place, at = _followed(study, dims)
    shown = [unit_shown(study, "peak_amplitude", known[d]) for d in kept.tolist()]
    factors = np.array([factor for factor, _ in shown])
    return {
        **provenance(study.attrs),
        "inputs": inputs_of_case(str(study.attrs.get("case", ""))),
        "method": f"{study.attrs.get('study_method', '')} over {_listed(names)}",
        "grid": len(dims) > 1 or str(dims[0]) != "case",
        "parameters": [_parameter(study, name, dims) for name in names],
        "dofs": [
            {
                "name": known[d],
                "peak": packed(peaks[:, d] * factor, "f8"),
                "at": packed(at[:, d], "f8"),
                "units": unit,
                "after": after_number(unit),
            }
            for d, (factor, unit) in zip(kept.tolist(), shown, strict=True)
        ],
        "first": known[order[0]],
        "followed": place,
        "frequency": frequency_of(study) if "peak_omega" in study else {"unit": "", "factors": {}},
        "file": "" if not study.attrs.get("case") else "study.nc",
        "cases": _cases(study),
        "seconds": float(np.nansum(study["seconds"].to_numpy())),
        **_curves(curves, kept, factors),
        "band": _band(study, curves, kept, factors),
        "scatter": _scatter(study, float(factors[0])) if is_mistuning(study) else None,
    }


def _listed(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= _NAMED else f"{names[0]} to {names[-1]}"


def _scatter(study: xarray.Dataset, factor: float) -> dict[str, Any]:
    """Amplifications of a mistuning study: of every disc, their histogram, percentiles and the worst disc.

    ``factor`` leads from the unit of the results to the one that amplitudes are shown in.
    """
    values = study["amplification"].to_numpy()
    known = values[np.isfinite(values)]
    bins = None
    if known.size:
        edges = histogram_edges(known)
        bins = {"edges": edges.tolist(), "counts": np.histogram(known, edges)[0].tolist()}
    told = amplification_of(study)
    tuned = told.pop(TUNED)
    return {
        **told, "tuned": tuned * factor if np.isfinite(tuned) else None, "bins": bins, "values": packed(values, "f8"),
        "outputs": study["worst"].to_numpy().tolist(),
    }  # fmt: skip


def _band(study: xarray.Dataset, curves: xarray.Dataset | None, kept: Any, factors: Array) -> dict[str, Any] | None:
    """Percentiles of the curves and the peaks of samples; None of a grid, and without curves."""
    if curves is None or not is_sampled(study) or not bool((study["outcome"] == "COMPLETED").any()):
        return None
    found, peaks = curve_percentiles(curves, study), peak_percentiles(study)
    followed = followed_of(found)
    sizes = found["amplitude"].to_numpy()[:, :, kept] * factors
    at, high = (peaks[name].to_numpy()[:, kept] for name in (f"peak_{followed}", "peak_amplitude"))
    high = high * factors
    return {
        "percentiles": list(PERCENTILES),
        "x": packed(found[followed].to_numpy(), "f8"),
        "dofs": [
            {
                "y": [packed(sizes[k, :, d], "f8") for k in range(len(PERCENTILES))],
                "peak": packed(high[:, d], "f8"),
                "at": packed(at[:, d], "f8"),
            }
            for d in range(sizes.shape[2])
        ],
    }


def _followed(study: xarray.Dataset, dims: Any) -> tuple[dict[str, str], Any]:
    """What the curves are over, and where the peaks are (n_cases, n_dofs)."""
    name = "peak_parameter" if "peak_parameter" in study else "peak_omega"
    label = str(study.attrs.get("parameter", "")) or "Frequency"
    at = study[name].transpose(*dims, "dof").to_numpy().reshape(study["case"].size, -1)
    return {"key": name.removeprefix("peak_"), "label": label, "units": unit_of(study, name)}, at


def _parameter(study: xarray.Dataset, name: str, dims: Any) -> dict[str, Any]:
    values = study[name].broadcast_like(study["case"]).transpose(*dims).to_numpy().ravel()
    return {"name": name, "units": unit_of(study, name), "values": packed(values, "f8")}


def _cases(study: xarray.Dataset) -> list[dict[str, Any]]:
    """Each with its time, where it has one of its own: those followed in lockstep have equal shares of one time."""
    columns = {name: study[name].to_numpy().ravel() for name in ("outcome", "message", "points", "seconds")}
    if "lockstep" in study:
        columns["seconds"] = np.where(study["lockstep"].to_numpy().ravel() == 1, np.nan, columns["seconds"])
    return [
        {
            "outcome": str(outcome),
            "message": str(message),
            "points": max(0, int(points)),
            "seconds": float(seconds) if np.isfinite(seconds) else None,
        }
        for outcome, message, points, seconds in zip(*columns.values(), strict=True)
    ]


def _curves(data: xarray.Dataset | None, kept: Any, factors: Array) -> dict[str, Any]:
    """Curves of some dofs: at most ``MOST_CURVES`` cases, and about ``MOST_POINTS`` points of each."""
    if data is None or not {"case", "amplitude", "branch_part"} <= set(data.variables):
        return {"curves": [], "left_out": "curves.nc is not beside the study: its curves are not drawn"}
    case = data["case"].to_numpy()
    present = np.unique(case)
    some = present[np.unique(np.linspace(0, present.size - 1, min(MOST_CURVES, present.size)).astype(int))]
    x = data[followed_of(data)].to_numpy()
    amplitude, part = data["amplitude"].to_numpy()[:, kept] * factors, data["branch_part"].to_numpy()
    peaks, drawn = data["peak_dof"].to_numpy() if "peak_dof" in data else np.full(case.size, -1), []
    for number in some.tolist():
        points = np.flatnonzero(case == number)
        thin = np.arange(points.size) % -(-points.size // MOST_POINTS) == 0
        at = points[thin | (peaks[points] >= 0)]
        y = [packed(amplitude[at, d], "f8") for d in range(amplitude.shape[1])]
        drawn.append({"case": int(number), "x": packed(x[at], "f8"), "y": y, "part": packed(part[at], "u1")})
    less = f"{some.size} of {present.size} curves are in this page" if some.size < present.size else ""
    return {"curves": drawn, "left_out": less}
