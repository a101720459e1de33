"""Curves along a branch, as the page draws them: which there are, of what, with which units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.report.encoding import Indices, packed
from slipstick.results.stability import between_known
from slipstick.typing import Array
from slipstick.units import after_number

if TYPE_CHECKING:
    from slipstick.results.table import ResultTable

_ROUNDING = 1e-11
"""Smaller than this beside the largest motion, a mean is what rounding left of zero."""
_FIRST = (
    "dissipated_power", "temperature", "friction_coefficient", "stick_fraction", "slip_fraction", "separation_fraction"
)  # fmt: skip
_ALWAYS = ("dissipated_power", "friction_coefficient")


def curves_of(dataset: ResultTable, kept: Mapping[str, Indices]) -> list[dict[str, Any]]:
    """All curves of a dataset; ``kept`` are the indices of the dofs and contacts that the report shows."""
    return [*_of_dofs(dataset, kept["dof"]), *_of_contacts(dataset, kept["contact"]), *_of_points(dataset)]


def _of_dofs(dataset: ResultTable, kept: Indices) -> Iterator[dict[str, Any]]:
    for name in ("amplitude", "mean"):
        if name in dataset:
            values = dataset[name].to_numpy()
            if name == "mean":
                values = without_rounding(values, dataset["amplitude"].to_numpy())
            yield _curve(dataset, name, "dof", values[:, kept])


def without_rounding(mean: Array, amplitude: Array) -> Array:
    """The mean (n, dofs), zero where it is nothing beside the largest motion of any dof."""
    size = max(float(np.nanmax(np.abs(values), initial=0.0)) for values in (mean, amplitude))
    return np.where(np.abs(mean) <= _ROUNDING * size, 0.0, mean)


def _of_contacts(dataset: ResultTable, kept: Indices) -> Iterator[dict[str, Any]]:
    """Variables over point and contact that say something: those that vary along the branch, power and friction."""
    if not len(kept):
        return
    found = [name for name, v in dataset.data_vars.items() if v.dims == ("point", "contact")]
    for name in sorted(found, key=lambda n: (_FIRST.index(n) if n in _FIRST else len(_FIRST), n)):
        values = dataset[name].to_numpy().astype(float)
        known = values[:, np.isfinite(values).any(axis=0)]
        if not known.size or not (name in _ALWAYS or (known != known[:1]).any()):
            continue
        total = {"total": packed(np.nansum(values, axis=1))} if name == "dissipated_power" else {}
        yield _curve(dataset, name, "contact", values[:, kept]) | total


def _of_points(dataset: ResultTable) -> Iterator[dict[str, Any]]:
    for name in ("multiplier_max", "truncation", "newton_iterations"):
        if name in dataset and dataset[name].dims == ("point",):
            values = dataset[name].to_numpy().astype(float)
            yield _curve(dataset, name, "", between_known(values) if name == "multiplier_max" else values)


def _curve(dataset: ResultTable, name: str, over: str, values: Array) -> dict[str, Any]:
    return {"key": name, "over": over, **meaning(dataset, name), "values": packed(values)}


def meaning(dataset: ResultTable, name: str) -> dict[str, str]:
    """Label and units of a variable, from its own attributes; ``after`` is what stands after a number."""
    attributes = dataset[name].attrs
    label = str(attributes.get("long_name", name.replace("_", " ")))
    if name != "parameter":  # that is the user's own name
        label = label[:1].upper() + label[1:]
    units = str(attributes.get("units", ""))
    return {"label": label, "units": "" if units == "1" else units, "after": after_number(units)}
