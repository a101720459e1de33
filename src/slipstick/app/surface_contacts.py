"""Contacts on a surface: one ``[[contact]]`` block becomes a contact for each of its points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from slipstick.app.body import Array, ContactPoints
from slipstick.app.fe_tables import SurfaceContactTable
from slipstick.app.sentences import shown, suggestion
from slipstick.app.tables import ContactTable, ThermalTable
from slipstick.errors import InputError

INFLUENCE = "structure"
"""``[thermal] influence = "structure"``: the matrix of the finite element model."""


def expanded(table: SurfaceContactTable, points: ContactPoints | None) -> dict[int, ContactTable]:
    """Contacts "NAME 1", "NAME 2", ... by their point, counted from 0.

    Raises
    ------
    InputError
        If the structure has no contact points, a point is not there or given twice, or the rubbing direction is normal
        to the surface.
    """
    from slipstick.models.surface_model import cosines

    if points is None:
        raise InputError(
            'points: the structure has no contact surface; give [structure] kind = "blade", or kind = "fe" with surface'
        )
    chosen = _chosen(table.points, points.count)
    along = cosines(_tangents(points, table.direction))
    across = cosines(points.normals)
    load = _loads(table, points.areas[chosen])
    return {
        k: ContactTable.model_construct(
            **{
                **{name: getattr(table, name) for name in ContactTable.model_fields},
                "name": f"{table.name} {k + 1}",
                "tangential": along[k],
                "normal": across[k] if table.normal else None,
                "normal_load": load[i],
            }
        )
        for i, k in enumerate(chosen)
    }


def _chosen(wanted: Any, count: int) -> list[int]:
    if wanted == "all":
        return list(range(count))
    outside = [p for p in wanted if p > count]
    if outside:
        raise InputError(f"points: found {outside[0]}; the surface has the points 1 to {count}")
    if len(set(wanted)) != len(wanted):
        raise InputError(f"points: found {shown(wanted)}; give every point once")
    return [p - 1 for p in wanted]


def _tangents(points: ContactPoints, direction: Sequence[float]) -> Array:
    wanted = np.asarray(direction)
    flat = wanted - (points.normals @ wanted)[:, None] * points.normals
    size = np.linalg.norm(flat, axis=1, keepdims=True)
    if not size.min() > 1e-3 * np.linalg.norm(wanted):
        raise InputError(f"direction: {list(direction)} is normal to the surface; give one along it")
    return np.asarray(flat / size)


def _loads(table: SurfaceContactTable, areas: Array) -> list[float | None]:
    """Normal load of each point: the same for all, or a total by area."""
    if table.normal_load_total is None:
        return [table.normal_load] * len(areas)
    return [float(load) for load in table.normal_load_total * areas / areas.sum()]


def own_influence(
    top: ThermalTable, contacts: Mapping[int, ContactTable], points: ContactPoints | None
) -> tuple[ThermalTable, dict[int, ContactTable]]:
    """``influence = "structure"`` written out, the resistance of each contact itself added to the diagonal.

    Returns the table with the matrix and the contacts without their resistance.

    Raises
    ------
    InputError
        If the structure has no influence matrix, or no contact lies on its surface.
    """
    if points is None or points.influence is None:
        raise InputError(
            "[thermal] influence: the structure has no influence matrix; give [structure] films or cold and a "
            'conductivity (kind = "fe"), or use kind = "blade"'
        )
    names = [c.name for c in contacts.values()]
    stray = [name for name in top.contacts or () if name not in names]
    if stray:
        hint = suggestion(stray[0], names)
        raise InputError(f"[thermal] contacts: '{stray[0]}' does not lie on the surface of the structure; {hint}")
    heated = {k: c for k, c in contacts.items() if top.contacts is None or c.name in top.contacts}
    if not heated:
        raise InputError('[thermal] influence: no contact lies on the surface; give [[contact]] with points = "all"')
    at = list(heated)
    own = [c.thermal.resistance or 0.0 if c.thermal is not None else 0.0 for c in heated.values()]
    matrix = points.influence[np.ix_(at, at)] + np.diag(own)
    bare = {
        k: c
        if c.thermal is None
        else c.model_copy(update={"thermal": c.thermal.model_copy(update={"resistance": None})})
        for k, c in heated.items()
    }
    written = top.model_copy(update={"influence": matrix.tolist(), "contacts": [c.name for c in heated.values()]})
    return written, {**contacts, **bare}
