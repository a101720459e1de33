"""Friction contacts at the contact points of a body: one law, one rubbing direction, loads of their own or shared."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.balance.contacts import ContactPair
from slipstick.contact.friction import FrictionContact
from slipstick.contact.law import Law
from slipstick.contact.rubbing import RubbingMotion
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, one, shown, text, truth
from slipstick.models.reduced_body import ReducedBody
from slipstick.typing import Array


def surface_contacts(
    body: ReducedBody,
    name: str = "contact",
    *,
    contact: Law,
    direction: ArrayLike,
    points: str | Iterable[int] = "all",
    normal: bool = False,
    shared: bool = False,
    rubbing: RubbingMotion | None = None,
) -> list[ContactPair]:
    """Contacts "NAME 1", "NAME 2", ... at the contact points of a body, each with the number of its point.

    Parameters
    ----------
    body
        Made by :func:`reduced_body` with a ``surface``, or by :func:`reduced_blade`.
    contact
        The law with its parameters: numbers for all, or arrays (n,), one value for each of the chosen points in their
        order.
    direction
        Rubbing direction (3,), projected on the surface at every point.
    points
        Numbers of the points, counted from 1; "all" of them by default.
    normal
        Whether the normal load varies with the motion across the surface, with stiffness ``kn``.
    shared
        Whether the normal load of ``contact`` is that of all these contacts together, shared by area; otherwise each
        carries it.
    rubbing
        Motion of the counter surface along ``direction`` (and against the normal); numbers or arrays (n,) as above.

    Raises
    ------
    InputError
        If the body has no contact points, a point is not there or given twice, the direction is normal to the surface,
        there is not one value for each point, or a gap is to be shared.
    """
    _refuse(body, name, contact, normal, shared, rubbing)
    if body.points is None:
        raise InputError(Fault("points", "the body has no contact points", remedy="give surface where it is reduced"))
    found = Gathering()
    chosen, directions = found.take(body.points.chosen, points), found.take(body.points.tangential, direction)
    found.end()
    at, along, across = chosen or [], directions or [], body.points.normal
    if shared:
        contact = _sharing(contact, body.points.share(1.0, [k + 1 for k in at]))
    motion = rubbing or RubbingMotion()
    _require_sizes(len(at), {**contact.values, **dict(motion.components())})
    return [
        ContactPair(
            name=f"{name} {k + 1}",
            contact=contact.changed(**_part(contact.values, i)),
            tangential=along[k],
            normal=across[k] if normal else None,
            rubbing=_motion_of(motion, i),
        )
        for i, k in enumerate(at)
    ]


def _refuse(body: Any, name: Any, contact: Any, normal: Any, shared: Any, rubbing: Any) -> None:
    """Everything that is of another kind."""
    found = Gathering()
    found.take(one, "body", body, ReducedBody, "what ss.reduced_body or ss.reduced_blade returns")
    found.take(text, "name", name)
    if not isinstance(contact, Law):
        found.faults.append(Fault("contact", found=shown(contact), expected="ss.FrictionContact(...), or a law"))
    found.take(truth, "normal", normal)
    found.take(truth, "shared", shared)
    if rubbing is not None:
        found.take(one, "rubbing", rubbing, RubbingMotion, "an ss.RubbingMotion, or None")
    found.end()


def _sharing(contact: Law, shares: Array) -> Law:
    """The contact with a share of its normal load for each of the shares (n,)."""
    if not isinstance(contact, FrictionContact) or np.any(np.asarray(contact.gap) > 0.0):
        raise InputError(
            Fault("shared", found=shown(contact), expected="a FrictionContact with a normal load to share")
        )
    if np.ndim(contact.normal_load):
        raise InputError(Fault("shared", found="a normal load for each contact", expected="one, that of all of them"))
    return contact.changed(normal_load=float(contact.normal_load) * shares)


def _require_sizes(n: int, values: Mapping[str, ArrayLike]) -> None:
    """InputError for lists that do not have one value for each of n points."""
    faults = [
        Fault(name, found=f"{np.size(value)} values", expected=f"one, or {n}, one for each of the chosen points")
        for name, value in values.items()
        if np.ndim(value) and np.size(value) != n
    ]
    if faults:
        raise InputError(faults)


def _part(values: Mapping[str, ArrayLike], i: int) -> dict[str, float]:
    """The i-th of every list among values."""
    return {name: float(np.asarray(value)[i]) for name, value in values.items() if np.ndim(value)}


def _motion_of(motion: RubbingMotion, i: int) -> RubbingMotion:
    """The motion at the i-th point."""
    for name, value in _part(dict(motion.components()), i).items():
        motion = motion.with_component(name, value)
    return motion
