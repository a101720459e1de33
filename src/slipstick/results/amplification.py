"""How much more the largest blade of a mistuned disc moves than those of the tuned one: of every disc of a study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import shown
from slipstick.results.percentiles import FEWEST, WeibullMaxima, checked_percentiles
from slipstick.results.schema import LARGEST
from slipstick.results.table import is_dataset
from slipstick.results.view import names_of
from slipstick.typing import Array
from slipstick.units import compared

if TYPE_CHECKING:
    import xarray

TUNED = "tuned_amplitude"
"""Attribute of a mistuning study: the largest amplitude of the tuned disc."""
PERCENTILES = (50.0, 95.0, 99.0)
_BINS = 60


def is_mistuning(study: xarray.Dataset) -> bool:
    """Whether the cases of a study are discs whose blades differ at random."""
    return TUNED in study.attrs and "amplification" in study


def with_amplification(study: xarray.Dataset) -> xarray.Dataset:
    """A study of discs with the largest amplitude of each, whose it is, and the ratio to that of the tuned disc."""
    sizes = study["peak_amplitude"].to_numpy()
    known = np.isfinite(sizes).any(axis=1) & (study["outcome"].to_numpy() == "COMPLETED")
    at = np.where(known, np.nanargmax(np.where(np.isfinite(sizes), sizes, -1.0), axis=1), 0)
    largest = np.where(known, sizes[np.arange(len(sizes)), at], np.nan)
    dofs = study["dof"].to_numpy()
    return study.assign(
        largest_amplitude=("case", largest, dict(study["peak_amplitude"].attrs)),
        amplification=(
            "case",
            largest / float(study.attrs[TUNED]),
            {"units": "1", "long_name": "largest amplitude over that of the tuned disc"},
        ),
        worst=(
            "case",
            np.array([str(dofs[i]) if k else "" for i, k in zip(at, known, strict=True)], dtype=np.str_),
            {"units": "1", "long_name": "output of the largest amplitude"},
        ),
    )


def amplification_percentiles(study: xarray.Dataset, percentiles: Sequence[float] = PERCENTILES) -> xarray.Dataset:
    """Percentiles of the amplification of a mistuning study, failed discs left out.

    Parameters
    ----------
    study
        The dataset of a study with ``method = "mistuning"``.
    percentiles
        In percent, between 0 and 100.

    Returns
    -------
    xarray.Dataset
        ``amplification`` over ``percentile``, and from 8 samples on ``fitted``, that of the Weibull distribution of
        maxima, whose parameters are attributes. Without any sample it is empty.

    Raises
    ------
    InputError
        For another dataset, and percentiles out of range.
    """
    import xarray

    if not is_dataset(study, "amplification"):
        raise InputError(f"percentiles: found {shown(study)}; expected the dataset of a mistuning study")
    asked, values = checked_percentiles(percentiles), study["amplification"].to_numpy()
    values = values[np.isfinite(values)]
    found = xarray.Dataset(coords={"percentile": asked}, attrs={"samples": int(values.size)})
    if values.size:
        found["amplification"] = "percentile", np.percentile(values, asked)
    if values.size >= FEWEST and np.ptp(values) > 0.0:
        fit = WeibullMaxima.fitted(values)
        found["fitted"] = "percentile", [fit.percentile(p) for p in asked]
        found.attrs |= {"weibull_shape": fit.shape, "weibull_place": fit.place, "weibull_scale": fit.scale}
    return found


def amplification_of(study: xarray.Dataset) -> dict[str, Any]:
    """The scatter of a mistuning study: tuned amplitude, number of discs, percentiles, the worst disc.

    ``percentiles`` and ``fitted`` by percent, ``worst`` with ``case``, ``amplification``, ``amplitude``, ``output``,
    ``omega`` (or the followed parameter) and ``deviations``; what is not known is left out.
    """
    found = amplification_percentiles(study)
    told: dict[str, Any] = {TUNED: float(study.attrs[TUNED]), "discs": found.attrs["samples"]}
    for key, name in (("percentiles", "amplification"), ("fitted", "fitted")):
        if name in found:
            own = zip(found["percentile"].to_numpy(), found[name].to_numpy(), strict=True)
            told[key] = {f"{percent:g}": float(value) for percent, value in own}
    if told["discs"]:
        one = worst_of(study)
        place = "peak_parameter" if "peak_parameter" in study else "peak_omega"
        told["worst"] = {
            "case": int(one["case"]),
            "amplification": float(one["amplification"]),
            "amplitude": float(one["largest_amplitude"]),
            "output": str(one["worst"].item()),
            place.removeprefix("peak_"): float(one[place].max()),
            "deviations": deviations_of(one),
        }
    return told


def worst_of(study: xarray.Dataset) -> xarray.Dataset:
    """The case with the largest amplification of a mistuning study that has one."""
    return study.isel(case=int(np.nanargmax(study["amplification"].to_numpy())))


def deviations_of(disc: xarray.Dataset) -> list[float]:
    """Deviations of the stiffness of the blades of one case of a mistuning study, in their order."""
    return [float(disc[name]) for name in str(disc.attrs["study_parameters"]).splitlines()]


def histogram_edges(values: Array) -> Array:
    """Edges of the bins of amplifications, by the rule of Freedman and Diaconis, at most 60 bins."""
    edges = np.histogram_bin_edges(values, bins="fd" if np.ptp(values) > 0.0 else 1)
    return edges if edges.size <= _BINS + 1 else np.linspace(edges[0], edges[-1], _BINS + 1)


def largest_alone(study: xarray.Dataset, curves: xarray.Dataset | None) -> tuple[xarray.Dataset, Any]:
    """A mistuning study and its curves with one dof, "largest": the largest amplitude of all outputs."""
    place = "peak_parameter" if "peak_parameter" in study else "peak_omega"
    at = study[place].max("dof", keep_attrs=True).expand_dims(dof=[LARGEST], axis=-1)
    of_dofs = [name for name in study.data_vars if "dof" in study[name].dims]
    peak = study["largest_amplitude"].expand_dims(dof=[LARGEST], axis=-1)
    one = study.drop_vars([*of_dofs, "dof"]).assign({"peak_amplitude": peak, place: at})
    if not is_dataset(curves, "amplitude") or curves is None:
        return one, curves
    among = compared(names_of(curves, "dof"))
    top = curves["amplitude"].isel(dof=among).max("dof", keep_attrs=True).expand_dims(dof=[LARGEST], axis=-1)
    others = [name for name in curves.data_vars if "dof" in curves[name].dims]
    return one, curves.drop_vars([*others, "dof"]).assign(amplitude=top)
