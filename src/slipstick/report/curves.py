"""Curves of a page along a branch, with their units; Campbell and interference diagrams."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.report.encoding import Indices, packed
from slipstick.results.stability import between_known
from slipstick.results.view import View, label_of, names_of, phases_at, unit_shown, values_at
from slipstick.state.registry import STATE_VARIABLES
from slipstick.structure.campbell import campbell
from slipstick.structure.cyclic import CyclicStructure, TravellingWave
from slipstick.structure.interference import interference
from slipstick.structure.matrices import MatrixStructure
from slipstick.typing import Array
from slipstick.units import after_number

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions
    from slipstick.results.table import ResultTable


_FRACTIONS = ("stick_fraction", "slip_fraction", "separation_fraction")
_STATES = tuple(variable.name for variable in STATE_VARIABLES)
_FIRST = ("worn_depth", "normal_load", "dissipated_power", *_STATES, "friction_coefficient", *_FRACTIONS)
_ALWAYS = ("dissipated_power", "friction_coefficient")
_OF_POINTS = ("omega", "modal_damping", "modal_amplitude", "load_factor", "multiplier_max")
_WORK = ("truncation", "newton_iterations")


def curves_of(
    branch: Solutions, kept: Mapping[str, Indices], view: View, beside: Sequence[ResultTable] = ()
) -> list[dict[str, Any]]:
    """All curves of a branch, the default first; ``kept`` are the dofs and contacts that are shown.

    A quantity without numbers, or one that is constant and of no interest, is left out.
    """
    dataset = branch.table
    if not len(branch):
        return []
    curves = [
        *_of_dofs(branch, kept["dof"], beside),
        *_of_contacts(dataset, kept["contact"], beside),
        *_of_points(dataset, view, beside),
    ]
    return sorted(curves, key=lambda curve: curve["key"] != view.first)


def abscissae_of(dataset: ResultTable, view: View, beside: Sequence[ResultTable] = ()) -> list[dict[str, Any]]:
    """Possible abscissae of the curves, the followed quantity first: the frequency, a parameter, an amplitude."""
    return [
        {"key": key, **said, "values": packed(dataset[key].to_numpy() * factor, "f8")}
        for key in view.over
        if key == view.over[0] or (key in dataset and _says_something(dataset[key].to_numpy().astype(float)))
        for said, factor in [meaning(dataset, key, beside)]
    ]


def _says_something(values: Array) -> bool:
    """Whether there are numbers that differ."""
    known = values[np.isfinite(values)]
    return known.size > 0 and bool((known != known[0]).any())


def _of_dofs(branch: Solutions, kept: Indices, beside: Sequence[ResultTable]) -> Iterator[dict[str, Any]]:
    dataset = branch.table
    if "amplitude" in dataset:
        yield _curve(dataset, "amplitude", "dof", dataset["amplitude"].to_numpy()[:, kept], beside, kept)
    if "mean" in dataset:
        yield _curve(dataset, "mean", "dof", values_at(dataset, "mean", "dof", kept), beside, kept)
    if branch.harmonics.n and len(kept):
        phases = phases_at(dataset, kept, 1)
        if np.isfinite(phases).any():
            shown = {"label": f"Phase of harmonic {branch.harmonics.orders[1]}", "units": "deg", "after": " deg"}
            yield {"key": "phase", "over": "dof", **shown, "values": packed(phases)}


def _of_contacts(dataset: ResultTable, kept: Indices, beside: Sequence[ResultTable]) -> Iterator[dict[str, Any]]:
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
        yield _curve(dataset, name, "contact", values[:, kept], beside) | total


def _of_points(dataset: ResultTable, view: View, beside: Sequence[ResultTable]) -> Iterator[dict[str, Any]]:
    for name in (*_OF_POINTS, *_WORK):
        if name == view.over[0] or name not in dataset or dataset[name].dims != ("point",):
            continue
        values = dataset[name].to_numpy().astype(float)
        values = between_known(values) if name == "multiplier_max" else values
        if np.isfinite(values).any() and (name != "omega" or _says_something(values)):
            yield _curve(dataset, name, "", values, beside)


def _curve(
    dataset: ResultTable,
    name: str,
    over: str,
    values: Array,
    beside: Sequence[ResultTable],
    dofs: Indices | None = None,
) -> dict[str, Any]:
    said, factor = meaning(dataset, name, beside)
    factors: Any = factor
    if dofs is not None:
        names = names_of(dataset, "dof")
        factors = np.array([unit_shown(dataset, name, names[d], beside)[0] for d in dofs])
    return {"key": name, "over": over, **said, "values": packed(values * factors)}


def meaning(dataset: ResultTable, name: str, beside: Sequence[ResultTable] = ()) -> tuple[dict[str, str], float]:
    """Label and unit of a variable as it is shown and the factor to that unit; ``after`` stands behind a number."""
    label = "Frequency" if name == "omega" else label_of(dataset, name)
    factor, unit = unit_shown(dataset, name, beside=beside)
    return {"label": label, "units": unit, "after": after_number(unit)}, factor


MOST_DOFS = 60
"""Most dofs of a diagram: more take too long at every speed for a page."""
_SPEEDS = 31
_MOST_MODES = 8
_MOST_ORDERS = 4
_FAMILIES = 3
_SENSES = {1: "forward whirl", -1: "backward whirl", 0: "no whirl"}


def diagram_of(branch: Solutions) -> dict[str, Any] | None:
    """The diagram of a rotor or of a sector of a disc in a wave, over speeds up to the highest frequency.

    None of anything else, of large matrices and of finite element sectors, whose nodal diameters would all be computed.
    """
    if branch.problem is None:
        return None
    structure = branch.problem.structure
    orders = [int(n) for n in branch.harmonics.orders if n > 0][:_MOST_ORDERS]
    if not len(branch) or not orders or len(structure.dofs) > MOST_DOFS:
        return None
    omega = branch.table["omega"].to_numpy()
    if isinstance(structure, TravellingWave) and isinstance(structure.sector, CyclicStructure):
        return _of_disc(structure, orders, float(omega.min()), float(omega.max()))
    if isinstance(structure, MatrixStructure) and structure.gyroscopic is not None:
        return _of_rotor(structure, orders, float(omega.max()) * max(1, structure.engine_order or 1))
    return None


def _of_rotor(rotor: MatrixStructure, orders: list[int], top: float) -> dict[str, Any]:
    found = campbell(rotor, np.linspace(0.0, top, _SPEEDS), engine_orders=orders, modes=_MOST_MODES)
    speed, frequency, whirl = (found[name].to_numpy() for name in ("speed", "frequency", "whirl"))
    reach = max(orders) * top if found.sizes["crossing"] else np.inf  # beyond, no engine order meets anything
    shown = [k for k in range(frequency.shape[1]) if frequency[:, k].min() <= reach]
    lines = [_line(f"mode {k + 1}, {_SENSES[int(whirl[-1, k])]}", speed, frequency[:, k], k) for k in shown]
    highest = float(frequency[:, shown].max(initial=0.0))
    for n in orders:
        until = np.array([0.0, min(top, highest / n)])
        lines.append(_line(f"engine order {n}", until, n * until))
    met = [found[f"crossing_{name}"].to_numpy().tolist() for name in ("speed", "frequency", "order", "mode", "whirl")]
    return {
        "title": "Campbell diagram",
        "y": "Damped frequency",
        "x": {"label": "Speed of rotation", "frequency": True},
        "dashed": f"engine orders {', '.join(map(str, orders))}",
        "lines": lines,
        "met": [
            {"x": at, "y": w, "said": f"engine order {n}, mode {mode}, {_SENSES[sense]}"}
            for at, w, n, mode, sense in zip(*met, strict=True)
        ],
    }


def _of_disc(wave: TravellingWave, orders: list[int], low: float, high: float) -> dict[str, Any] | None:
    own = abs(wave.engine_order)
    if not own or low >= high:
        return None
    asked = [n * own for n in orders]
    found = interference(wave.sector, (low / own, high / own), engine_orders=asked, modes=_FAMILIES)
    diameter, frequency = (found[name].to_numpy() for name in ("nodal_diameter", "frequency"))
    lines = [_line(f"mode {k + 1}", diameter, frequency[:, k], k) for k in range(frequency.shape[1])]
    lines = [line for line in lines if line["x"]]
    for n in orders:
        at = wave.harmonic(n).nodal_diameter
        lines.append(_line(f"harmonic {n}", np.array([at, at]), np.array([n * low, n * high])))
    met = [found[f"crossing_{name}"].to_numpy().tolist() for name in ("nodal_diameter", "frequency", "order", "mode")]
    return {
        "title": "Interference diagram",
        "y": "Undamped frequency",
        "x": {"label": "Nodal diameter", "frequency": False},
        "dashed": f"harmonics {', '.join(map(str, orders))} over the range of frequencies",
        "lines": lines,
        "met": [
            {"x": d, "y": w, "said": f"harmonic {n // own}, {d} nodal diameters, mode {mode}"}
            for d, w, n, mode in zip(*met, strict=True)
        ],
    }


def _line(name: str, x: Any, y: Any, colour: int = -1) -> dict[str, Any]:
    """A line where it has numbers; without a colour it is an engine order, dashed."""
    known = np.isfinite(y)
    return {"name": name, "x": np.asarray(x, dtype=float)[known].tolist(), "y": y[known].tolist(), "colour": colour}
