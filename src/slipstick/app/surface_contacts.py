"""Contacts on a surface: one ``[[contact]]`` block becomes a contact for each of its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from slipstick.app.fe_tables import SurfaceContactTable
from slipstick.app.heating import cold_value
from slipstick.app.sentences import suggestion
from slipstick.app.tables import ContactTable, ThermalTable
from slipstick.errors import InputError

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.contact.friction import FrictionContact
    from slipstick.contact.rubbing import RubbingMotion
    from slipstick.models.reduced_body import ReducedBody

INFLUENCE = "structure"
"""``[thermal] influence = "structure"``: the matrix of the finite element model."""


@dataclass(frozen=True, kw_only=True)
class Placed:
    """One contact of a case: the number of its block, its table by its own name, and the point it lies on, from 0.

    ``pair`` is there already for a contact on a surface; a single one is made from its table.
    """

    block: int
    table: ContactTable
    point: int | None = None
    pair: ContactPair | None = None


def contacts_on_surface(
    block: int, table: SurfaceContactTable, body: ReducedBody | None, background: float | None
) -> list[Placed]:
    """Contacts "NAME 1", "NAME 2", ... of one block, cold.

    Raises
    ------
    InputError
        If the structure has no contact points, a point is not there or given twice, or the rubbing direction is normal
        to the surface.
    """
    from slipstick.models.surface_contacts import surface_contacts

    if body is None or body.points is None:
        raise InputError(
            'points: the structure has no contact surface; give [structure] kind = "blade", or kind = "fe" with surface'
        )
    pairs = surface_contacts(
        body,
        table.name,
        contact=cold_contact(table, background, table.normal_load_total),
        direction=table.direction,
        points=table.points,
        normal=table.normal is not None,
        shared=table.normal_load_total is not None,
        rubbing=rubbing_motion(table),
    )
    shared = {name: getattr(table, name) for name in ContactTable.model_fields}
    return [
        Placed(
            block=block,
            table=ContactTable.model_construct(**{**shared, "name": pair.name}),
            point=point,
            pair=pair,
        )
        for point, pair in zip(body.points.chosen(table.points), pairs, strict=True)
    ]


def cold_contact(table: ContactTable, background: float | None, total: float | None = None) -> FrictionContact:
    """The parameters of a contact, cold; ``total``: the normal load of all contacts of a block, instead of its own."""
    from slipstick.contact.friction import FrictionContact

    return FrictionContact(
        kt=cold_value(table.kt, background),
        mu=cold_value(table.mu, background),
        kn=1.0 if table.kn is None else cold_value(table.kn, background),
        gap=table.gap,
        normal_load=table.normal_load if total is None else total,
    )


def rubbing_motion(table: ContactTable) -> RubbingMotion:
    """The motion of the counter surface of a contact."""
    from slipstick.contact.rubbing import RubbingMotion

    rub = table.rubbing
    return RubbingMotion() if rub is None else RubbingMotion(**{key: getattr(rub, key) for key in rub.model_fields_set})


def own_influence(
    top: ThermalTable, contacts: Sequence[Placed], body: ReducedBody | None
) -> tuple[ThermalTable, list[Placed]]:
    """``influence = "structure"`` written out, the resistance of each contact itself added to the diagonal.

    Returns the table with the matrix, and all contacts, those on the surface without their resistance.

    Raises
    ------
    InputError
        If the structure has no influence matrix, or no contact lies on its surface.
    """
    points = body.points if body is not None else None
    if points is None or points.influence is None:
        raise InputError(
            "[thermal] influence: the structure has no influence matrix; give [structure] films or cold and a "
            'conductivity (kind = "fe"), or use kind = "blade"'
        )
    names = [c.table.name for c in contacts if c.point is not None]
    stray = [name for name in top.contacts or () if name not in names]
    if stray:
        hint = suggestion(stray[0], names)
        raise InputError(f"[thermal] contacts: '{stray[0]}' does not lie on the surface of the structure; {hint}")
    heated = [name for name in names if top.contacts is None or name in top.contacts]
    if not heated:
        raise InputError('[thermal] influence: no contact lies on the surface; give [[contact]] with points = "all"')
    on = {c.table.name: c for c in contacts if c.table.name in heated}
    numbers = [on[name].point + 1 for name in heated]  # type: ignore[operator]
    matrix = points.resistance(numbers, own=[_own_resistance(on[name].table) for name in heated])
    written = top.model_copy(update={"influence": matrix.tolist(), "contacts": heated})
    return written, [replace(c, table=_bare(c.table)) if c.table.name in heated else c for c in contacts]


def _own_resistance(table: ContactTable) -> float:
    return table.thermal.resistance or 0.0 if table.thermal is not None else 0.0


def _bare(table: ContactTable) -> ContactTable:
    """The contact without its own resistance, which the matrix holds."""
    if table.thermal is None:
        return table
    return table.model_copy(update={"thermal": table.thermal.model_copy(update={"resistance": None})})
