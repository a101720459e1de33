"""Contacts between two surfaces as points of a flat map: places and areas, pressure, state, slip, dissipated energy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from slipstick.results.deflection import bolt_places, contact_places
from slipstick.typing import Array, IntArray

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions
    from slipstick.results.table import ResultTable

QUANTITIES = {
    "pressure": ("mean pressure", "force/length^2"),
    "state": ("state over the period", "1"),
    "slip_fraction": ("slip, share of the period", "1"),
    "dissipated_energy": ("energy dissipated a period, per area", "force/length"),
}
"""What is shown of the contacts of an interface: in words, and units."""

STATES = ("no state", "sticks", "slips", "opens", "open")
"""States over a period by number: it sticks all the time, slips, opens for a part of the time, or is open."""

_PART = 1e-6
"""Share of the period that counts."""


@dataclass(frozen=True, kw_only=True)
class Interface:
    """The contacts of one pair of surfaces, seen along the axis of the model nearest to their common normal.

    Attributes
    ----------
    name
        Of the pair; empty where its contacts have none in common.
    contacts
        Numbers of its contacts in results, (n,).
    flat
        Their two coordinates, (2, n), length.
    axes
        Names of these.
    areas
        Areas, (n,).
    bolts
        Numbers of the bolts that stand on the map, (n_bolts,), and their two coordinates, (2, n_bolts).
    """

    name: str
    contacts: IntArray
    flat: Array
    axes: tuple[str, str]
    areas: Array
    bolts: tuple[IntArray, Array]

    def values(self, data: ResultTable, quantity: str) -> Array | None:
        """One of ``QUANTITIES`` at every point, (n_points, n); None where the results have none."""
        if quantity == "state":
            slips, opens = self._of(data, "slip_fraction"), self._of(data, "separation_fraction")
            if slips is None or opens is None:
                return None
            known = np.isfinite(slips) & np.isfinite(opens)
            state = np.select([opens >= 1.0 - _PART, opens > _PART, slips > _PART], [4.0, 3.0, 2.0], 1.0)
            return np.where(known, state, 0.0)
        if quantity == "dissipated_energy":
            power = self._of(data, "dissipated_power")
            return None if power is None else power * (2.0 * np.pi / data["omega"].to_numpy()[:, None]) / self.areas
        if quantity == "pressure":
            force = self._of(data, "normal_force")
            force = self._of(data, "normal_load") if force is None else force
            return None if force is None else force / self.areas
        return self._of(data, quantity)

    def _of(self, data: ResultTable, name: str) -> Array | None:
        if name not in data:
            return None
        values = np.asarray(data[name].to_numpy(), dtype=float)[:, self.contacts]
        return values[..., 0] if values.ndim == 3 else values


def interfaces_of(branch: Solutions) -> list[Interface]:
    """The pairs of surfaces of a branch whose contacts have areas and places, in the order of the contacts."""
    problem = branch.problem
    if problem is None or getattr(problem.structure, "skin", None) is None:
        return []
    of: dict[str, list[int]] = {}
    areas, at = list[float](), 0
    for pair in problem.contacts:
        numbers = range(at, at + len(pair))
        at += len(pair)
        areas += np.broadcast_to(np.nan if pair.area is None else pair.area, len(pair)).tolist()
        if pair.area is not None:
            stem, _, last = pair.name.rpartition(" ")
            of.setdefault(stem if last.isdigit() else pair.name, []).extend(numbers)
    if not of:
        return []
    places, bolts = contact_places(problem), bolt_places(problem)
    held = np.flatnonzero(np.isfinite(bolts).all(axis=1))
    found = []
    for name, among in of.items():
        kept = np.array([k for k in among if np.isfinite(places[k]).all()], dtype=int)
        if kept.size:
            along = _normal(places[kept])
            plane = [axis for axis in range(3) if axis != along]
            flat, standing = places[kept][:, plane].T, bolts[held][:, plane].T
            inside = (standing >= flat.min(axis=1)[:, None]) & (standing <= flat.max(axis=1)[:, None])
            on = inside.all(axis=0)
            found.append(
                Interface(
                    name=name, contacts=kept, flat=flat, axes=("xyz"[plane[0]], "xyz"[plane[1]]),
                    areas=np.array(areas)[kept], bolts=(held[on], standing[:, on]),
                )
            )  # fmt: skip
    return found


def _normal(places: Array) -> int:
    """The axis nearest to the normal of the plane through places (n, 3)."""
    _, _, axes = np.linalg.svd(places - places.mean(axis=0), full_matrices=True)
    return int(np.argmax(np.abs(axes[2])))
