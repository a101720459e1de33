"""Campbell and interference diagrams in a page: frequencies without contacts, and where engine orders meet them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.structure.campbell import campbell
from slipstick.structure.cyclic import CyclicStructure, TravellingWave
from slipstick.structure.interference import interference
from slipstick.structure.matrices import MatrixStructure

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions

MOST_DOFS = 60
"""Beyond, modes at every speed take longer than the page is worth."""
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
    lines = [_line(f"family {k + 1}", diameter, frequency[:, k], k) for k in range(frequency.shape[1])]
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
            {"x": d, "y": w, "said": f"harmonic {n // own}, {d} nodal diameters, family {family}"}
            for d, w, n, family in zip(*met, strict=True)
        ],
    }


def _line(name: str, x: Any, y: Any, colour: int = -1) -> dict[str, Any]:
    """Where there is a number; without a colour it is one of excitation, dashed."""
    known = np.isfinite(y)
    return {"name": name, "x": np.asarray(x, dtype=float)[known].tolist(), "y": y[known].tolist(), "colour": colour}
