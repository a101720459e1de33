"""Contacts of a problem: a law, the directions of its ports, its rubbing motion."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import acos, degrees, hypot, inf, isfinite
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.contact.law import Law
from slipstick.contact.rubbing import SECOND, VELOCITIES, RubbingMotion
from slipstick.errors import Fault, InputError, Where
from slipstick.faults import Gathering, listed, number, number_or_numbers, one, shown, suggestion, table, text, wrong
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, Real, Reals

Direction = Mapping[str, float]
Directions = Direction | tuple[Direction | None, ...] | None
"""Of one contact, or of many; None where there is none."""
DirectionLike = Mapping[str, Real] | str | Sequence[Mapping[str, Real] | str | None] | None


PER_AREA = "_per_area"
"""End of the names of the stiffness per area, "lap.kt_per_area", of contacts that have areas."""


@dataclass(frozen=True, init=False, repr=False)
class ContactPair:
    """One contact, or many of the same kind, between directions of the structure, or between these and the ground.

    The relative motion along a port is ``sum cosine * dof``, node 1 minus node 2: the second node's dofs have the
    opposite sign. Where anything is given for n contacts (a list of directions, arrays of parameters) there are n.

    Parameters
    ----------
    name
        Its name in results, events and parameters; the k-th of many is "name.k", counted from 1.
    contact
        The law with its parameters: a ``FrictionContact``, a ``PlanarFrictionContact``, a ``SampledLaw``, or a law of
        your own.
    tangential
        Direction cosines by dof; a name alone means cosine 1; a list of such for many contacts, each with friction of
        its own. Of a ``PlanarFrictionContact`` the two perpendicular directions of its surface: ``("x", "y")``, and
        for many contacts two lists, the first directions and the second ones. Where all their dofs are displacements
        along axes by name ("x", "uy", "tip_z", "12.x", "x@next") others are refused, and unequal lengths give a
        warning. Of modes, rotations and dofs of other names the angle is not known, and nothing is checked.
    normal
        As ``tangential``, positive where the contact closes; None: a constant normal load ``-kn gap``. A stop, a
        ``FrictionContact`` without kt and mu, has this direction alone.
    ports
        Directions by the names of the law's ports, instead of tangential and normal.
    rubbing
        How side 1 slides over the opposing surface beside its vibration, along ``tangential``, and how that surface
        comes nearer (``RubbingMotion``, with the sign); none by default. Of one contact that slides in two directions,
        values of two numbers are vectors.
    area
        Area that the contact stands for (length^2), or one for each of many: of contacts between surfaces. Forces over
        it are shown as pressures; it changes nothing else.

    Raises
    ------
    InputError
        For values of another kind.

    Examples
    --------
    >>> import slipstick as ss
    >>> law = ss.FrictionContact(kt=1e5, mu=0.3, kn=2e5, gap=1e-3)
    >>> tip = ss.ContactPair(name="tip", contact=law, tangential="tip_x", normal="tip_y")
    >>> between = ss.ContactPair(name="flange", contact=law, tangential={"a": 1.0, "b": -1.0}, normal={"c": 1.0})
    >>> tip.with_value("mu", 0.5).contact.mu
    0.5
    """

    name: str
    contact: Law
    tangential: Directions
    normal: Directions
    ports: Mapping[str, Directions] | None
    rubbing: RubbingMotion
    area: float | Array | None

    def __init__(
        self,
        *,
        name: str,
        contact: Law,
        tangential: DirectionLike = None,
        normal: DirectionLike = None,
        ports: Mapping[str, DirectionLike] | None = None,
        rubbing: RubbingMotion | None = None,
        area: Real | Reals | None = None,
    ) -> None:
        checks = Gathering()
        values: dict[str, Any] = {
            "name": checks.take(text, "name", name, 'a name such as "damper"'),
            "contact": contact,
        }
        if not isinstance(contact, Law) or isinstance(contact, type):
            expected = "contact=ss.FrictionContact(...), or a law (a subclass of slipstick.contact.law.Law)"
            checks.faults.append(Fault("contact", found=shown(contact), expected=expected))
        both = isinstance(contact, Law) and "second" in contact.ports
        if both and isinstance(tangential, tuple | list) and "second" not in (ports or {}):
            tangential, second = checks.take(_two_directions, ("tangential",), tangential) or (None, None)
            ports = {**(ports or {}), **({} if second is None else {"second": second})}
        values["tangential"] = checks.take(_one_or_many, ("tangential",), tangential)
        values["normal"] = checks.take(_one_or_many, ("normal",), normal)
        values["ports"] = ports
        if ports is not None:
            checked = checks.take(table, "ports", ports, "directions by the names of ports")
            values["ports"] = checked and {
                port: checks.take(_one_or_many, ("ports", port), direction) for port, direction in checked.items()
            }
        moved = RubbingMotion() if rubbing is None else rubbing
        values["rubbing"] = checks.take(one, "rubbing", moved, RubbingMotion, "ss.RubbingMotion(...)")
        values["area"] = checks.optional(_areas, "area", area)
        checks.end(*(("contact", name) if isinstance(name, str) else ()))
        for key, value in values.items():
            object.__setattr__(self, key, value)
        if both and self._vectors:
            object.__setattr__(self, "rubbing", self.rubbing.parted())

    def __repr__(self) -> str:
        ports, tangential = {p: _said(d) for p, d in (self.ports or {}).items()}, _said(self.tangential)
        if "second" in self.contact.ports and {"second"} == set(ports) and tangential is not None:
            tangential = (tangential, ports.pop("second"))
        shown = {
            "name": self.name, "contact": self.contact, "tangential": tangential,
            "normal": _said(self.normal), "ports": ports or None,
        }  # fmt: skip
        said = [f"{name}={value!r}" for name, value in shown.items() if value is not None]
        said += [f"area={self.area!r}"] if self.area is not None else []
        said += [f"rubbing={self.rubbing!r}"] if self.rubbing.names != ("velocity",) or self.rubbing.moves else []
        return f"ContactPair({', '.join(said)})"

    @cached_property
    def directions(self) -> Mapping[str, tuple[Direction | None, ...]]:
        """Direction cosines of each port, one for each contact; raises InputError where they cannot be matched."""
        count = self._count
        return {port: value if len(value) == count else value * count for port, value in self.given.items()}

    @cached_property
    def given(self) -> dict[str, tuple[Direction | None, ...]]:
        """Direction cosines of each port: one for all contacts, or one for each."""
        directions = dict(self.ports or {})
        directions |= {side: d for side in ("tangential", "normal") if (d := getattr(self, side)) is not None}
        return {port: value if isinstance(value, tuple) else (value,) for port, value in directions.items()}

    @property
    def is_spring(self) -> bool:
        """Whether it moves along its normal alone, as a bolt or a stop does: it cannot slide."""
        return set(self.given) == {"normal"}

    @cached_property
    def _count(self) -> int:
        """Number of contacts; raises InputError where arrays and directions do not agree on one."""
        several = sorted({size for size in (*map(len, self.given.values()), *self._array_sizes()) if size != 1})
        if len(several) > 1 or 0 in several:
            arrays = f"{several} contacts in its arrays"
            raise InputError(Fault(("contact", self.name), found=arrays, expected="one number"))
        return several[0] if several else 1

    def _array_sizes(self, rubbing: bool = True) -> list[int]:
        moved = self.rubbing.components() if rubbing else ()
        arrays = [*self.contact.values.values(), *(v for _, v in moved)]
        return [int(np.size(v)) for v in (*arrays, self.area) if np.ndim(v)]  # type: ignore[arg-type]

    @property
    def _vectors(self) -> bool:
        """Whether values of two numbers in the rubbing motion are vectors, and not those of two contacts."""
        alone = all(size == 1 for size in (*map(len, self.given.values()), *self._array_sizes(rubbing=False)))
        along = [value for name, value in self.rubbing.components() if not name.startswith("normal_")]
        told = any(name.startswith(SECOND) for name in self.rubbing.names)
        return alone and not told and max(map(np.size, along)) == 2

    def __len__(self) -> int:
        return self._count

    def place(self, port: str) -> Where:
        """Where the direction of a port was given."""
        return (port,) if port in ("tangential", "normal") and port not in (self.ports or ()) else ("ports", port)

    def direction(self, port: str, k: int = 0) -> Direction | None:
        """Direction cosines of a port of the k-th contact, from 0; None where it has none."""
        directions = self.directions.get(port)
        return None if directions is None else directions[k]

    def place_of_motion(self, k: int) -> int:
        """The first contact that moves as the k-th one does: 0 where areas of their own share one set of directions."""
        together = isinstance(self.area, np.ndarray) and all(len(value) == 1 for value in self.given.values())
        return 0 if together else k

    @property
    def first_direction(self) -> Direction:
        """Direction cosines of the first port that its first contact has."""
        directions = (self.direction(port) for port in self.contact.ports)
        return next((direction for direction in directions if direction is not None), {})

    @property
    def n_ports(self) -> int:
        """Number of ports that have a direction: each brings one unknown for every coefficient."""
        moving = [k for k in range(len(self)) if self.place_of_motion(k) == k]
        return sum(directions[k] is not None for directions in self.directions.values() for k in moving)

    @property
    def dofs(self) -> tuple[str, ...]:
        """Every dof along which a port moves."""
        every = (direction for directions in self.directions.values() for direction in directions)
        return tuple(dict.fromkeys(dof for direction in every for dof in direction or ()))

    @property
    def elements(self) -> tuple[str, ...]:
        """Names of its contacts."""
        return (self.name,) if len(self) == 1 else tuple(f"{self.name}.{k + 1}" for k in range(len(self)))

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of what can be changed or followed, as in "tip.velocity"."""
        second = "second_velocity"
        moves = (second,) if "second" in self.given and second not in self.rubbing.names else ()
        return (*self.contact.values, *self.contact.derived_parameters, *self.rubbing.names, *moves)

    def values(self, name: str) -> Array:
        """A parameter of the law, a derived one, a stiffness per area, or a component of the rubbing motion, (n,)."""
        if name.endswith(PER_AREA) and self.area is not None:
            return self.values(name.removesuffix(PER_AREA)) / self.area
        if name in self.contact.values:
            value: ArrayLike = self.contact.values[name]
        elif name in self.contact.derived_parameters:
            value = getattr(self.contact, name)
        else:
            value = self.rubbing.component(name)
        return np.broadcast_to(np.asarray(value, dtype=float), (len(self),))

    def with_value(self, name: str, value: float, k: int | None = None) -> ContactPair:
        """A copy with one of ``quantities`` changed, of the k-th contact or of all."""
        if name.endswith(PER_AREA) and self.area is not None:
            area = np.broadcast_to(self.area, (len(self),))
            if k is None and np.ndim(self.area):
                own = {name.removesuffix(PER_AREA): value * area}
                return replace(self, contact=self.contact.changed(**own))
            return self.with_value(name.removesuffix(PER_AREA), value * float(area[k or 0]), k)
        new: Any = float(value)
        if k is not None and len(self) > 1:
            new = self.values(name).copy()
            new[k] = value
        if name in self.rubbing.names or self.rubbing.is_component(name):
            return replace(self, rubbing=self.rubbing.with_component(name, new))
        return replace(self, contact=self.contact.changed(**{name: new}))


def _areas(name: str, value: Any) -> float | Array:
    """One area > 0, or one for each contact."""
    expected = "an area > 0, or one for each contact"
    areas: float | Array = number_or_numbers(name, value, expected)
    if not np.all(np.asarray(areas) > 0.0):
        raise wrong(name, value, expected)
    return areas


def _two_directions(name: Where, given: Any) -> tuple[Any, Any]:
    """The two directions of one surface, or of many."""
    if len(given) != 2:
        raise wrong(name, given, 'the two directions of a surface such as ("x", "y"), or two lists of such')
    return given[0], given[1]


def prescribed(pair: ContactPair, harmonics: Harmonics, factor: int) -> dict[str, Array]:
    """Velocities (n_ports, n) and periodic part (n_ports, n, L) of the rubbing motion along each port, by name.

    The law tells which ports these are (``Law.surface_ports``).
    """
    ports, n = pair.contact.ports, len(pair)
    out = {name: np.zeros((len(ports), n)) for name in VELOCITIES}
    out["motion"] = np.zeros((len(ports), n, harmonics.size))
    for direction, moved in pair.rubbing.by_direction(harmonics, factor).items():
        port = pair.contact.surface_ports.get(direction)
        if port is not None:
            i = ports.index(port)
            for name, value in moved._asdict().items():
                out[name][i] += value
    return out


def direction_faults(pair: ContactPair, dofs: Sequence[str] | None = None) -> Iterator[Fault]:
    """What is wrong with the directions of the ports, within the contact; ``dofs`` of the structure, if known."""
    law = pair.contact
    try:
        by_port = pair.directions
    except InputError as error:
        yield from (fault.below("contact", pair.name) for fault in error.faults)
        return
    for port in set(pair.ports or ()) & {"tangential", "normal"}:
        if getattr(pair, port) is not None:
            yield Fault(("ports", port), f"is given together with {port}", remedy="keep one of them")
    for k, (first, other) in enumerate(zip(by_port.get("tangential", ()), by_port.get("second", ()), strict=False)):
        at = pair.place("second") if len(pair) == 1 else (*pair.place("second"), k)
        if first and other and same_direction(first, other):
            yield Fault(at, "is the tangential direction", remedy="give the one perpendicular to it")
        elif first and other and "second" in law.ports:
            yield from (fault.inside(*at) for fault in perpendicular_faults(first, other))
    for port in by_port:
        if port not in law.ports:
            yield Fault(pair.place(port), f"its law has no port '{port}'", remedy=f"it has {', '.join(law.ports)}")
    for port in law.ports:
        if port not in law.optional_ports and not all(d is not None for d in by_port.get(port, (None,))):
            yield Fault(pair.place(port), "has no direction", remedy="give the dofs along which the port moves")
    if law.ports and set(law.ports) <= set(law.optional_ports):  # it may go without any of them, but not without all
        at = pair.place(law.ports[-1])
        for k in range(len(pair)):
            if all(directions[k] is None for directions in by_port.values()):
                where = at if len(pair) == 1 else (*at, k)
                yield Fault(where, "has no direction", remedy="give the dofs along which the port moves")
    for port, directions in by_port.items():
        for k, cosines in enumerate(directions):
            at = pair.place(port) if len(directions) == 1 else (*pair.place(port), k)
            yield from (fault.inside(*at) for fault in cosine_faults(cosines or {}, dofs))
            if cosines is not None and not cosines:
                yield Fault(at, found="{}, which has no direction", expected="the dofs along which the port moves")


_MOST_OF_BOTH = 0.75
"""Of a slanted contact on one dof both cosines are at most 0.71."""


def same_direction(tangential: Direction, normal: Direction) -> bool:
    """Whether one motion is said to be along the contact and across it."""
    equal = any({dof: sign * c for dof, c in tangential.items()} == dict(normal) for sign in (1.0, -1.0))
    return equal and max(map(abs, normal.values()), default=0.0) > _MOST_OF_BOTH


PERPENDICULAR = 1e-3
"""Largest cosine of the angle between directions that are perpendicular but for the digits they are given with."""
_COMPONENT = re.compile(r"(?:^|[^A-Za-z])u?[xyz]$", re.IGNORECASE)
"""Names of displacements along axes in space: "x", "uy", "tip_z", "12.x", whatever follows "@"."""


def in_space(*directions: Direction) -> bool:
    """Whether all dofs are displacements along perpendicular axes, by their names: others have no known angle."""
    return all(_COMPONENT.search(dof.partition("@")[0]) for direction in directions for dof in direction)


def lengths(*directions: Direction) -> list[float]:
    """Lengths of directions."""
    return [hypot(*direction.values()) for direction in directions]


def perpendicular_faults(tangential: Direction, second: Direction) -> Iterator[Fault]:
    """Directions in space that are not perpendicular; of those over other dofs nothing is known."""
    a, b = lengths(tangential, second)
    if not in_space(tangential, second) or not 0.0 < a < inf or not 0.0 < b < inf:
        return
    product = sum(c * second.get(dof, 0.0) for dof, c in tangential.items())
    cosine = max(-1.0, min(1.0, product / (a * b)))
    if abs(cosine) <= PERPENDICULAR:
        return
    dofs = dict.fromkeys((*tangential, *second))
    right = {dof: second.get(dof, 0.0) - product / a**2 * tangential.get(dof, 0.0) for dof in dofs}
    size = hypot(*right.values())
    better = {dof: float(f"{c * a / size:.6g}") for dof, c in right.items() if abs(c) > 1e-12 * b} if size else {}
    yield Fault(
        found=f"{dict(second)}, {degrees(acos(cosine)):.4g} degrees from the tangential direction {dict(tangential)}",
        expected="the direction perpendicular to it",
        remedy=f"give {better}" if abs(cosine) < 1.0 - 1e-9 and better else "",
    )


def cosine_faults(cosines: Mapping[str, float], dofs: Sequence[str] | None) -> Iterator[Fault]:
    """What is wrong with one direction; ``dofs`` of the structure, if known."""
    for dof in cosines:
        yield from dof_faults(dof, dofs)
    if not all(isfinite(c) for c in cosines.values()):
        yield Fault(found=str(dict(cosines)), expected="finite direction cosines")
    elif cosines and not any(cosines.values()):
        yield Fault(found=f"{dict(cosines)}, which has no direction", expected="a cosine other than zero")


def dof_faults(dof: str, dofs: Sequence[str] | None) -> Iterator[Fault]:
    """Whether the structure has a dof; nothing is said where its dofs are not known."""
    if dofs is not None and dof not in dofs:
        yield Fault(statement=f"there is no dof {shown(dof)} in the structure", remedy=suggestion(dof, dofs))


def _said(direction: Directions) -> Any:
    """A direction as it is given: the name of a dof alone where its cosine is 1."""
    if isinstance(direction, tuple):
        return [_said(one) for one in direction]
    return next(iter(direction)) if direction and list(direction.values()) == [1.0] else direction


def _cosines(name: Where, direction: Any) -> dict[str, float]:
    """Direction cosines by dof; a name alone means cosine 1."""
    if isinstance(direction, str):
        return {str(direction): 1.0}
    expected = 'the name of a dof such as "x", or cosines by dof such as {"x": 1.0, "y": -1.0}'
    if not isinstance(direction, Mapping):
        raise wrong(name, direction, expected)
    return {text(name, dof, expected): number((*name, dof), cosine) for dof, cosine in direction.items()}


def _one_or_many(name: Where, directions: Any) -> Any:
    """The direction of one contact (None: it has none), or a tuple of them for many."""
    if directions is None or isinstance(directions, str | Mapping):
        return None if directions is None else _cosines(name, directions)
    expected = 'the name of a dof such as "x", cosines by dof such as {"x": 1.0, "y": -1.0}, or a list of such'
    many = listed(name, directions, expected)
    if not many:
        raise wrong(name, directions, expected)
    return tuple(None if g is None else _cosines((*name, i), g) for i, g in enumerate(many))
