"""Loads and contacts of a case as public objects: whole, or as far as their tables are right."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from slipstick.case.fe_tables import SurfaceContactTable
from slipstick.case.heating import background_of, cold_value
from slipstick.case.rotor import WORDS, axis_arguments, rotor_motion
from slipstick.case.tables import LoadTable
from slipstick.case.validation import ReadTable
from slipstick.errors import Fault, InputError, Where
from slipstick.faults import Gathering

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.loads import Load
    from slipstick.contact.friction import FrictionContact
    from slipstick.contact.rubbing import RubbingMotion
    from slipstick.models.reduced_body import ReducedBody

_NEUTRAL = {"kt": 1.0, "mu": 0.0, "kn": 1.0, "normal_load": 1.0}
"""In place of what is at fault, where a contact is only looked at and not computed with."""


@dataclass(frozen=True, kw_only=True)
class Placed:
    """One contact of a case.

    Parameters
    ----------
    row
        The block it comes from.
    pair
        The contact; where its block has faults only its name, its directions and its rubbing motion count.
    point
        The point of a surface it lies on, from 0.
    """

    row: ReadTable
    pair: ContactPair
    point: int | None = None

    @property
    def name(self) -> str:
        """Its own name."""
        return self.pair.name


def load_of(row: ReadTable) -> tuple[Load | None, list[Fault]]:
    """The load of a ``[[load]]`` table: amplitude cos(m tau + phase) becomes its cosine and sine parts.

    A table with faults makes a load by what is right in it; None where it cannot be told what that acts on.
    """
    from slipstick.balance.loads import Load

    table: LoadTable = row.table
    where = {key: value for key in ("dof", "shape", "base", "motion") if (value := row.get(key)) is not None}
    cos, sin = table.cos, table.sin
    if table.amplitude is not None:
        phase = table.phase or 0.0
        cos, sin = table.amplitude * math.cos(phase), -table.amplitude * math.sin(phase)
    try:
        return Load(**where, harmonic=table.harmonic, cos=cos, sin=sin), []
    except InputError as error:
        on = next((name for name in where.values() if isinstance(name, str)), "")
        return None, [fault.below("load", on).inside(*row.where) for fault in error.faults] if row.complete else []


def placed_contacts(
    rows: Sequence[ReadTable], thermal: ReadTable | None, body: ReducedBody | None, known: bool
) -> tuple[list[Placed], list[Fault]]:
    """Single contacts and those on a surface, the latter where it is ``known`` whether there is one."""
    found, placed = Gathering(), list[Placed]()
    for row in rows:
        if not row.right("name"):
            continue
        if not isinstance(row.table, SurfaceContactTable):
            placed += [Placed(row=row, pair=_single(row, thermal, found))]
        elif known:
            new = found.inside(row.where, _on_surface, row, thermal, body, found) or []
            taken = {c.point for c in placed}
            twice = [c.point for c in new if c.point is not None and c.point in taken]
            statements = (f"point {point + 1} has a contact already" for point in twice)
            found.faults += [Fault((*row.where, "points"), statement) for statement in statements]
            placed += new
    return placed, found.faults


def _single(row: ReadTable, thermal: ReadTable | None, found: Gathering) -> ContactPair:
    from slipstick.balance.contacts import ContactPair

    directions = {side: row.get(side) for side in ("tangential", "normal")}
    law, rubbing = _law(row, thermal, found), _rubbing(row, found)
    return ContactPair(name=row.table.name, contact=law, rubbing=rubbing, **directions)


def _on_surface(row: ReadTable, thermal: ReadTable | None, body: ReducedBody | None, found: Gathering) -> list[Placed]:
    """Contacts "NAME 1", "NAME 2", ... of one block; with what is at fault left out, to see whether the rest is right.

    Raises
    ------
    InputError
        If the structure has no contact points, a point is not there or given twice, or the rubbing direction is normal
        to the surface.
    """
    from slipstick.models.surface_contacts import surface_contacts

    if body is None or body.points is None:
        remedy = 'give [structure] kind = "blade", or kind = "fe" with surface'
        raise InputError(Fault("points", "the structure has no contact surface", remedy=remedy))
    table, axis = row.table, axis_arguments(row.get("axis"))
    points = table.points if row.right("points") else "all"
    direction = table.direction if row.right("direction") and row.right("axis") else _any_direction(body)
    pairs = surface_contacts(
        body,
        table.name,
        contact=_law(row, thermal, found),
        direction=direction,
        points=points,
        normal=table.normal if axis is not None and table.normal in WORDS else table.normal is not None,
        shared=row.complete and table.normal_load_total is not None,
        rubbing=_rubbing(row, found) if axis is None or row.get("rotor") is None else rotor_motion(table.rotor),
        axis=axis,
    )
    if not row.right("points"):
        return []
    return [
        Placed(row=row, pair=pair, point=point) for point, pair in zip(body.points.chosen(points), pairs, strict=True)
    ]


def _any_direction(body: ReducedBody) -> Any:
    """One that is normal to the surface nowhere."""
    import numpy as np

    assert body.points is not None
    return np.linalg.svd(body.points.normals)[2][-1] + 0.1 * np.ones(3)


def _law(row: ReadTable, thermal: ReadTable | None, found: Gathering) -> FrictionContact:
    """The parameters of a contact, cold; neutral ones where these are at fault, and all faults that are its own."""
    from slipstick.contact.friction import FrictionContact

    background, given = background_of(row.table, None if thermal is None else thermal.table), dict[str, Any]()
    for key in ("kt", "mu", "kn"):
        value = row.get(key)
        cold = None if value is None else found.inside((*row.where, key), cold_value, value, background)
        if cold is not None:
            given[key] = cold
    total = row.get("normal_load_total") if isinstance(row.table, SurfaceContactTable) else None
    loads = {"gap": row.get("gap"), "normal_load": row.get("normal_load") if total is None else total}
    given |= {key: value for key, value in loads.items() if value is not None}
    if row.complete and "gap" in given:
        given = {**_NEUTRAL, **given, "normal_load": None}
    else:
        given = {**_NEUTRAL, **given, "gap": None}
    try:
        return FrictionContact(**given)
    except InputError as error:
        told = [fault for fault in error.faults if row.complete or fault.where]
        found.faults += [fault.inside(*row.where) for fault in told]
        return FrictionContact(**_NEUTRAL)


def _rubbing(row: ReadTable, found: Gathering) -> RubbingMotion:
    """The rubbing motion of a contact."""
    from slipstick.contact.rubbing import RubbingMotion

    rub = row.table.rubbing
    given = {} if rub is None else {key: getattr(rub, key) for key in rub.model_fields_set}
    return found.inside(row.where, lambda: RubbingMotion(**given)) or RubbingMotion()


def in_block(fault: Fault, placed: Sequence[Placed]) -> Fault:
    """A fault of a contact on a surface at the block that the contact comes from."""
    if fault.where[:1] != ("contact",):
        return fault
    rows: dict[Any, Where] = {c.name: c.row.where for c in placed}
    return replace(fault, where=(*rows.get(fault.where[1], fault.where[:2]), *fault.where[2:]))
