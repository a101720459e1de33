"""Friction contacts at the contact points of a body: one law, one rubbing direction, loads of their own or shared."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.balance.contacts import ContactPair
from slipstick.contact.friction import FrictionContact
from slipstick.contact.rubbing import RubbingMotion
from slipstick.errors import InputError
from slipstick.faults import shown
from slipstick.models.reduced_body import ReducedBody

Array = NDArray[np.float64]


def surface_contacts(
    body: ReducedBody,
    name: str = "contact",
    *,
    contact: FrictionContact,
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
        Parameters of each contact, scalars.
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
        Motion of the counter surface along ``direction``.

    Raises
    ------
    InputError
        If the body has no contact points, a point is not there or given twice, the direction is normal to the surface,
        or a gap is to be shared.
    """
    if body.points is None:
        raise InputError("points: the body has no contact points; give surface where it is reduced")
    at = body.points.chosen(points)
    along, across = body.points.tangential(direction), body.points.normal
    numbers = [k + 1 for k in at]
    each = _sharing(contact, body.points.share(1.0, numbers)) if shared else [contact] * len(at)
    return [
        ContactPair(
            name=f"{name} {k + 1}",
            contact=own,
            tangential=along[k],
            normal=across[k] if normal else None,
            rubbing=rubbing or RubbingMotion(),
        )
        for k, own in zip(at, each, strict=True)
    ]


def _sharing(contact: FrictionContact, shares: Array) -> list[FrictionContact]:
    """The contact with a share of its normal load, for each of the shares (n,)."""
    if np.any(np.asarray(contact.gap) > 0.0):
        raise InputError(f"shared: the contact has a gap of {shown(contact.gap)}, and no normal load to share")
    total = float(contact.normal_load)
    return [
        FrictionContact(kt=contact.kt, mu=contact.mu, kn=contact.kn, normal_load=total * float(share))
        for share in shares
    ]
