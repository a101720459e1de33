"""Curves along a branch, as the page draws them: which there are, of what, with which units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.report.encoding import Indices, packed
from slipstick.results.stability import between_known
from slipstick.results.view import View, after, label_of, phases_at, unit_of, values_at
from slipstick.state.registry import STATE_VARIABLES
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions
    from slipstick.results.table import ResultTable

_FRACTIONS = ("stick_fraction", "slip_fraction", "separation_fraction")
_STATES = tuple(variable.name for variable in STATE_VARIABLES)
_FIRST = ("worn_depth", "normal_load", "dissipated_power", *_STATES, "friction_coefficient", *_FRACTIONS)
_ALWAYS = ("dissipated_power", "friction_coefficient")
_OF_POINTS = ("omega", "modal_damping", "modal_amplitude", "load_factor", "multiplier_max")
_WORK = ("truncation", "newton_iterations")


def curves_of(branch: Solutions, kept: Mapping[str, Indices], view: View) -> list[dict[str, Any]]:
    """All curves of a branch, the first the one to begin with; ``kept`` are the dofs and contacts that are shown.

    A quantity without a number, or that says nothing, is left out.
    """
    dataset = branch.table
    if not len(branch):
        return []
    curves = [*_of_dofs(branch, kept["dof"]), *_of_contacts(dataset, kept["contact"]), *_of_points(dataset, view)]
    return sorted(curves, key=lambda curve: curve["key"] != view.first)


def abscissae_of(dataset: ResultTable, view: View) -> list[dict[str, Any]]:
    """What curves can be drawn over, first what the branch follows: the frequency, a parameter, an amplitude."""
    return [
        {"key": key, **meaning(dataset, key), "values": packed(dataset[key].to_numpy(), "f8")}
        for key in view.over
        if key == view.over[0] or (key in dataset and _says_something(dataset[key].to_numpy().astype(float)))
    ]


def _says_something(values: Array) -> bool:
    """Whether there are numbers, and not all the same."""
    known = values[np.isfinite(values)]
    return known.size > 0 and bool((known != known[0]).any())


def _of_dofs(branch: Solutions, kept: Indices) -> Iterator[dict[str, Any]]:
    dataset = branch.table
    if "amplitude" in dataset:
        yield _curve(dataset, "amplitude", "dof", dataset["amplitude"].to_numpy()[:, kept])
    if "mean" in dataset:
        yield _curve(dataset, "mean", "dof", values_at(dataset, "mean", "dof", kept))
    if branch.harmonics.n and len(kept):
        phases = phases_at(dataset, kept, 1)
        if np.isfinite(phases).any():
            shown = {"label": f"Phase of harmonic {branch.harmonics.orders[1]}", "units": "deg", "after": " deg"}
            yield {"key": "phase", "over": "dof", **shown, "values": packed(phases)}


def _of_contacts(dataset: ResultTable, kept: Indices) -> Iterator[dict[str, Any]]:
    """Variables over point and contact that say something: those that vary along the branch, power and friction."""
    if not len(kept):
        return
    names = [name for name, v in dataset.data_vars.items() if v.dims == ("point", "contact")]
    for name in sorted(names, key=lambda n: (_FIRST.index(n) if n in _FIRST else len(_FIRST), n)):
        values = dataset[name].to_numpy().astype(float)
        known = values[:, np.isfinite(values).any(axis=0)]
        if not known.size or not (name in _ALWAYS or (known != known[:1]).any()):
            continue
        total = {"total": packed(np.nansum(values, axis=1))} if name == "dissipated_power" else {}
        yield _curve(dataset, name, "contact", values[:, kept]) | total


def _of_points(dataset: ResultTable, view: View) -> Iterator[dict[str, Any]]:
    for name in (*_OF_POINTS, *_WORK):
        if name == view.over[0] or name not in dataset or dataset[name].dims != ("point",):
            continue
        values = dataset[name].to_numpy().astype(float)
        values = between_known(values) if name == "multiplier_max" else values
        if np.isfinite(values).any() and (name != "omega" or _says_something(values)):
            yield _curve(dataset, name, "", values)


def _curve(dataset: ResultTable, name: str, over: str, values: Array) -> dict[str, Any]:
    return {"key": name, "over": over, **meaning(dataset, name), "values": packed(values)}


def meaning(dataset: ResultTable, name: str) -> dict[str, str]:
    """Label and units of a variable; ``after`` is what stands after a number."""
    label = "Frequency" if name == "omega" else label_of(dataset, name)
    return {"label": label, "units": unit_of(dataset, name), "after": after(dataset, name)}
