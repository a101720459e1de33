"""Friction contacts at the contact points of a body: one law, one rubbing direction, separate or shared loads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from slipstick.balance.contacts import ContactPair
from slipstick.contact.friction import FrictionContact
from slipstick.contact.law import Law
from slipstick.contact.rubbing import SECOND, RubbingMotion
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, one, shown, text, truth
from slipstick.fem.axis import DIRECTIONS, Axis
from slipstick.models.reduced import ReducedModel
from slipstick.typing import Array, Reals


def surface_contacts(
    body: ReducedModel,
    name: str = "contact",
    *,
    contact: Law,
    direction: Reals | str,
    points: str | Iterable[int] = "all",
    normal: bool | str = False,
    shared: bool = False,
    rubbing: RubbingMotion | Callable[[Array, Array], RubbingMotion] | None = None,
    axis: Axis | Mapping[str, Reals] | None = None,
    between: bool = False,
) -> list[ContactPair]:
    """Contacts "NAME 1", "NAME 2", ... at the contact points of a body, each with the number of its point.

    In names of parameters NAME alone stands for all of them: "NAME.mu".

    Parameters
    ----------
    body
        Made by :func:`reduced_body` with a ``surface``, by :func:`reduced_blade`, or by :func:`reduced_sector`.
    contact
        The law with its parameters: numbers for all, or arrays (n,), one value for each of the chosen points in their
        order. With a ``PlanarFrictionContact`` the points slide in the plane of the surface: along ``direction``, and
        along normal x direction, perpendicular to it; :func:`ss.models.straight_contacts` makes those one-directional
        whose motion is nearly straight.
    direction
        Rubbing direction (3,), projected on the surface at every point; with an ``axis`` also "circumferential"
        (towards growing angles), "axial" or "radial".
    points
        Numbers of the points, counted from 1; "all" of them by default.
    normal
        Whether the normal load varies with the motion across the surface, with stiffness ``kn``; with an ``axis`` also
        "radial", "axial" or "circumferential" instead of the normal of the surface, turned to look out of the body.
    shared
        Whether the normal load of ``contact`` is that of all these contacts together, shared by area; otherwise each
        carries it.
    rubbing
        How the points slide over the opposing surface beside their vibration, along ``direction`` (that surface itself
        moves the opposite way), and how it comes nearer, against the normal; numbers or arrays (n,) as above. Points
        that slide in two directions take vectors of two, the same for all.
        With an ``axis`` also a function of the radius and angle of the points, (n,) each, that gives it, such as
        ``lambda radius, angles: ss.casing_motion(profile, radius=radius, angles=angles, lobes=2)``.
    axis
        Of the rotor: ``{"point": (0, 0, 0), "direction": (0, 0, 1)}``, with "zero" for the direction in which the angle
        is 0 (x; y where the axis is along x). Of a sector it is that of its disc by default.
    between
        Of a sector: contacts of its face towards the next sector with the low face of that one, which lies opposite.

    Raises
    ------
    InputError
        If the body has no contact points, a point is not there or stands twice, the direction is normal to the surface,
        there is not one value for each point, a gap is to be shared, a point lies on the axis, or there is no axis
        where one is needed.

    Examples
    --------
    >>> import slipstick as ss
    >>> from slipstick.fem.box import box
    >>> from slipstick.fem.model import elastic_model
    >>> steel = ss.Material(young=2.1e11, poisson=0.3, density=7850.0)
    >>> beam = elastic_model(box((0.1, 0.02, 0.01), (4, 1, 1), "hex20"), steel, ["x0"])
    >>> body = ss.reduced_body(beam, surface="z1", contacts=2, modes=6)
    >>> law = ss.FrictionContact(kt=1e6, mu=0.3, normal_load=50.0)
    >>> pads = ss.surface_contacts(body, "pad", contact=law, direction=(1, 0, 0))
    >>> [pair.name for pair in pads]
    ['pad 1', 'pad 2']
    """
    about = _checked(body, name, contact, normal, shared, rubbing, axis, between)
    side = _side(body, between)
    places, cosines = body.sides[side], cast("Callable[[Any], Any]", partial(body.cosines, side))
    gathering = Gathering()
    chosen = gathering.take(places.chosen, points)
    turned = gathering.take(places.outward, about, normal) if isinstance(normal, str) else None
    tangents = gathering.take(places.tangents, direction, axis=about, across=turned)
    gathering.end()
    at, along = chosen or [], cosines(tangents)
    outward = places.normals if turned is None else turned
    across, second = cosines(outward), None
    if tangents is not None and "second" in contact.ports:
        second = cosines(np.cross(outward, tangents))
    if shared:
        contact = _sharing(contact, places.share(1.0, [k + 1 for k in at]))
    motion = _motion(rubbing, about, places.positions[at])
    if second is not None:
        motion = _parted(motion, len(at))
    _require_sizes(len(at), {**contact.values, **dict(motion.components())})
    return [
        ContactPair(
            name=f"{name} {k + 1}",
            contact=contact.changed(**_part(contact.values, i)),
            tangential=along[k] if second is None else (along[k], second[k]),
            normal=across[k] if normal else None,
            rubbing=_motion_of(motion, i),
        )
        for i, k in enumerate(at)
    ]


def _side(body: ReducedModel, between: bool) -> str:
    """The letter of the chosen points."""
    if between and "h" not in body.sides:
        remedy = "give between where the sector is reduced"
        raise InputError(Fault("between", "the body has no contact points towards its neighbours", remedy=remedy))
    if not between and "c" not in body.sides:
        raise InputError(Fault("points", "the body has no contact points", remedy="give surface where it is reduced"))
    return "h" if between else "c"


def _checked(
    body: object,
    name: object,
    contact: object,
    normal: object,
    shared: object,
    rubbing: object,
    axis: Any,
    between: object,
) -> Axis | None:
    """The axis, or None; InputError with every argument of a wrong kind."""
    gathering = Gathering()
    what = "what ss.reduced_body, ss.reduced_blade or ss.reduced_sector returns"
    gathering.take(one, "body", body, ReducedModel, what)
    gathering.take(truth, "between", between)
    if axis is None and isinstance(body, ReducedModel):
        axis = body.axis
    gathering.take(text, "name", name)
    if not isinstance(contact, Law):
        gathering.faults.append(Fault("contact", found=shown(contact), expected="ss.FrictionContact(...), or a law"))
    if not isinstance(normal, str):
        gathering.take(truth, "normal", normal)
    elif normal not in DIRECTIONS:
        expected = f"true, false, or with an axis one of {', '.join(DIRECTIONS)}"
        gathering.faults.append(Fault("normal", found=shown(normal), expected=expected))
    gathering.take(truth, "shared", shared)
    about = None if axis is None else gathering.take(Axis.of, axis)
    if rubbing is not None and not callable(rubbing):
        gathering.take(
            one, "rubbing", rubbing, RubbingMotion, "an ss.RubbingMotion, a function that gives one, or None"
        )
    elif callable(rubbing) and axis is None:
        gathering.faults.append(Fault("rubbing", "a function of radius and angle needs an axis", remedy="give axis"))
    gathering.end()
    return about


def _motion(rubbing: Any, axis: Axis | None, positions: Array) -> RubbingMotion:
    """The rubbing motion at the chosen points."""
    if not callable(rubbing) or axis is None:
        return rubbing or RubbingMotion()
    try:
        made = rubbing(axis.radius(positions), axis.angle(positions))
    except InputError:
        raise
    except Exception as error:
        failed = f"cannot be called with radius and angles: {error}"
        raise InputError(Fault("rubbing", failed, remedy="give a function of two arrays (n,)")) from error
    return one("rubbing", made, RubbingMotion, "a function that gives an ss.RubbingMotion")


def _sharing(contact: Law, shares: Array) -> Law:
    """The contact with a share of its normal load for each of the shares (n,)."""
    if not isinstance(contact, FrictionContact) or np.any(np.asarray(contact.gap) > 0.0):
        raise InputError(
            Fault("shared", found=shown(contact), expected="a FrictionContact with a normal load to share")
        )
    if np.ndim(contact.normal_load):
        raise InputError(Fault("shared", found="a normal load for each contact", expected="one, that of all of them"))
    return contact.changed(normal_load=float(contact.normal_load) * shares)


def _parted(motion: RubbingMotion, n: int) -> RubbingMotion:
    """Vectors of two numbers along the two directions of a surface; arrays of n points stay as they are."""
    along = [value for name, value in motion.components() if not name.startswith("normal_")]
    if any(name.startswith(SECOND) for name in motion.names) or max(map(np.size, along)) != 2:
        return motion
    if n == 2:
        remedy = "give second_velocity, second_cos or second_sin too: then each is of one direction"
        raise InputError(Fault("rubbing", "two values may be a vector, or those of two points", remedy=remedy))
    return motion.parted()


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
