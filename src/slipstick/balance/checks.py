"""What of a problem cannot be computed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from math import isfinite
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.base_motion import DISPLACEMENT, base_faults
from slipstick.balance.contacts import direction_faults, dof_faults
from slipstick.balance.loads import UNBALANCE, place_faults
from slipstick.balance.states import state_faults
from slipstick.contact.rubbing import SECOND, common_period
from slipstick.errors import Fault, InputError
from slipstick.faults import in_radians, listed, number, shown, suggestion, wrong

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.loads import Load
    from slipstick.balance.problem import Problem
    from slipstick.structure.protocol import Structure
    from slipstick.typing import Numbers
    from slipstick.units import Units


@dataclass(frozen=True, kw_only=True)
class Known:
    """What parts of a problem can be held against; None where it is itself at fault, and nothing is held against it."""

    structure: Structure | None = None
    dofs: Sequence[str] | None = None
    orders: Sequence[int] | None = None
    """Harmonics kept."""
    period_ratio: tuple[int, int] | None = None

    def order_faults(self, order: int, side: int) -> Iterator[Fault]:
        """Whether an order of the excitation (side 0) or of the rubbing motion (side 1) is among those kept."""
        if self.orders is None or self.period_ratio is None:
            return
        factor = common_period(*self.period_ratio)[side]
        if order * factor not in self.orders:
            harmonic = f"harmonic {order}" + (
                f" (harmonic {order * factor} of the fundamental frequency)" if factor > 1 else ""
            )
            yield Fault(
                statement=f"{harmonic} is not among the harmonics kept, {list(self.orders)}", remedy="keep it too"
            )


def problem_faults(problem: Problem, wrong: Collection[str] = ()) -> Iterator[Fault]:
    """Why the problem cannot be computed; nothing if it can. Fields that are ``wrong`` are known to be so already."""
    known = Known(
        structure=None if "structure" in wrong else problem.structure,
        dofs=None if "structure" in wrong else problem.structure.dofs,
        orders=None if "harmonics" in wrong else problem.harmonics.orders,
        period_ratio=None if "period_ratio" in wrong else problem.period_ratio,
    )
    yield from contact_name_faults([pair.name for pair in problem.contacts])
    if problem.outputs is not None and "outputs" not in wrong:
        yield from (fault.inside("outputs") for fault in output_faults(problem.outputs, known.dofs))
    for pair in problem.contacts:
        yield from (f.inside("contact", pair.name) for f in direction_faults(pair, known.dofs))
        yield from (f.inside("contact", pair.name) for f in rubbing_faults(pair, known))
        yield from (f.inside("contact", pair.name) for f in _parameter_faults(pair))
        yield from (f.inside("contact", pair.name) for f in pair.contact.missing(_moving_ports(pair)))
    for i, load in enumerate(problem.loads):
        faults = chain(target_faults(load, known), force_faults(load.harmonic, load.sin, load.motion, known))
        yield from (fault.inside("load", i) for fault in faults)
    if not {"thermal", "states"} & set(wrong):
        yield from _state_faults(problem)
    if "structure" not in wrong and problem.structure.n_rigid:
        yield from _balance_faults(problem, problem.structure)
    if "friction" not in wrong and problem.friction < 0:
        yield Fault("friction", found=f"{problem.friction:g}", expected="a finite number >= 0")


def _balance_faults(problem: Problem, structure: Structure) -> Iterator[Fault]:
    """Contacts and static loads that push a structure away that is not held; others are refused elsewhere."""
    place = {dof: i for i, dof in enumerate(structure.dofs)}

    def pushes(cosines: Mapping[str, float]) -> bool:
        column = np.zeros((len(place), 1))
        for dof, cosine in cosines.items():
            column[place.get(dof, 0)] += cosine
        return bool(np.any(structure.unbalanced(column)))

    for pair in problem.contacts:
        for directions in pair.given.values():
            if any(cosines and pushes(cosines) for cosines in directions):
                yield Fault(
                    ("contact", pair.name), "its mean force pushes the structure away, and nothing holds it",
                    remedy="hold the structure, or give the contact between two of its dofs on one line",
                )  # fmt: skip
                break
    still: dict[str, float] = {}
    for load in problem.loads:
        if load.harmonic == 0 and load.dof is not None:
            still[load.dof] = still.get(load.dof, 0.0) + load.cos
    if any(still.values()) and pushes(still):
        yield Fault(
            "loads", "those of harmonic 0 are not in balance, and the structure is not held",
            remedy="hold the structure, or add what balances them",
        )  # fmt: skip


def contact_name_faults(names: Sequence[str]) -> Iterator[Fault]:
    """Names of contacts that do not tell them apart."""
    for name, times in sorted(Counter(names).items()):
        where = ("contact", name)
        if times > 1:
            yield Fault(
                where, f"the name {shown(name)} is used {times} times", remedy="give every contact its own name"
            )
        if not name or name == "*" or not name.isprintable():
            yield Fault((*where, "name"), found=shown(name), expected="printable characters other than '*' alone")


def output_faults(outputs: Sequence[str], dofs: Sequence[str] | None) -> Iterator[Fault]:
    """Dofs of the results that are not there, or given twice; ``dofs`` of the structure, if known."""
    if not outputs:
        yield Fault(found="none", expected="at least one dof")
    for dof, times in Counter(outputs).items():
        if times > 1:
            yield Fault(statement=f"{shown(dof)} is given {times} times", remedy="give every dof once")
        yield from dof_faults(dof, dofs)


def peak_faults(
    names: Sequence[str], outputs: Sequence[str] | None, dofs: Sequence[str] | None = None
) -> Iterator[Fault]:
    """Dofs of which peaks are wanted: among the outputs, or where these are not given among all."""
    for name in names:
        if outputs is None:
            yield from dof_faults(name, dofs)
        elif name not in outputs:
            yield Fault(statement=f"{shown(name)} is not among the outputs", remedy=suggestion(name, outputs))


def target_faults(load: Load, known: Known) -> Iterator[Fault]:
    """What a load acts on: a dof, a load shape or a support, and one of them alone."""
    faults = list(place_faults({name for name in ("dof", "shape", "base") if getattr(load, name) is not None}))
    if faults:
        yield from faults
    elif load.dof is not None:
        yield from (fault.inside("dof") for fault in dof_faults(load.dof, known.dofs))
    elif load.base is not None:
        yield from base_faults(load.base, known.structure, known.dofs)
    elif load.shape is not None:
        yield from shape_faults(load.shape, known)
        if load.harmonic and load.shape.startswith(f"{DISPLACEMENT} "):
            expected = "0: a support of that name moves slowly, in load steps"
            remedy = "for a support that vibrates give base and motion"
            yield Fault("harmonic", found=f"{load.harmonic}", expected=expected, remedy=remedy)


def shape_faults(shape: str, known: Known) -> Iterator[Fault]:
    """Whether the structure has a load shape."""
    if known.structure is not None and shape not in known.structure.load_shapes:
        hint = suggestion(shape, known.structure.load_shapes)
        yield Fault("shape", f"there is no load shape {shown(shape)}", remedy=hint)


def force_faults(harmonic: int, sin: float | None, motion: str | None, known: Known) -> Iterator[Fault]:
    """Whether the force of a load has a place among the harmonics, and does anything there."""
    yield from (fault.inside("harmonic") for fault in known.order_faults(harmonic, 0))
    if harmonic == 0 and sin:
        yield Fault("sin", "a sine of harmonic 0 is zero", remedy="give a static load as cos")
    if harmonic == 0 and motion == UNBALANCE:
        yield Fault("harmonic", "an unbalance at harmonic 0 is no force", remedy="give the harmonic of its turning, 1")
    if harmonic == 0 and motion == DISPLACEMENT:
        still = "a constant displacement of the support moves nothing relative to it"
        yield Fault("harmonic", still, expected="harmonic >= 1")


def rubbing_faults(pair: ContactPair, known: Known) -> Iterator[Fault]:
    """Whether the rubbing motion has a place among the harmonics, and ports to act on."""
    yield from (fault.inside("rubbing") for fault in motion_faults(pair.rubbing.parts, known))
    across = _across(pair)
    if across and "normal" not in pair.contact.surface_ports:
        yield Fault(
            "rubbing",
            f"{across[0]} moves the surface along a port called 'normal', which its law does not have",
            remedy=f"it has {', '.join(pair.contact.ports)}",
        )
    moves = [name for name, value in pair.rubbing.components() if name not in across and np.any(value)]
    second, port = [name for name in moves if name.startswith(SECOND)], pair.contact.surface_ports.get("second")
    if second and (port is None or port not in pair.given):
        yield Fault(
            "rubbing",
            f"{second[0]} slides along a second direction, which the contact does not have",
            remedy="give a PlanarFrictionContact and two tangential directions, or leave it out",
        )
    along, slides = pair.contact.surface_ports.get("tangential"), [name for name in moves if name not in second]
    optional = set(pair.contact.optional_ports) - set(pair.contact.prescribed_ports)
    if slides and along in optional and along not in pair.given:
        yield Fault(
            "rubbing",
            f"{slides[0]} slides along '{along}', along which the contact has no direction and no friction",
            remedy="leave it out, or give the contact friction",
        )


def _parameter_faults(pair: ContactPair) -> Iterator[Fault]:
    """Parameters of a law that go by the name of something else."""
    for name in pair.contact.values:
        if name in ("load", "motion") or pair.rubbing.is_component(name):
            what = "a load" if name == "load" else "the rubbing motion"
            yield Fault(
                "contact", f"its law has a parameter called {shown(name)}, which means {what}", remedy="rename it"
            )


def _moving_ports(pair: ContactPair) -> set[str]:
    """Ports along which the structure or the opposing surface may move."""
    normal = pair.contact.surface_ports.get("normal")
    return set(pair.given) | ({normal} if normal and _across(pair) else set())


def _across(pair: ContactPair) -> list[str]:
    """Components of the rubbing motion that go along the normal."""
    return [name for name, value in pair.rubbing.components() if name.startswith("normal_") and np.any(value)]


def motion_faults(parts: Mapping[str, Mapping[int, Numbers]], known: Known) -> Iterator[Fault]:
    """Orders of a rubbing motion, by part, that are not kept."""
    for part, amplitudes in parts.items():
        for order, value in amplitudes.items():
            if np.any(np.asarray(value) != 0):
                yield from (fault.inside(part) for fault in known.order_faults(order, 1))


def two_numbers(value: Any, name: str, expected: str = "two numbers, the first and the last") -> tuple[float, float]:
    """First and last value of a range; InputError where that is not what was given."""
    ends = listed(name, value, expected)
    if len(ends) > 2:
        raise InputError(
            Fault(
                name,
                found=f"{len(ends)} values",
                expected=f"{expected}: the points between are chosen on the way",
                remedy="give at= for points at exact values",
            )
        )
    if len(ends) != 2:
        raise wrong(name, value, expected)
    return number(name, ends[0], expected), number(name, ends[1], expected)


def two_frequencies(value: Any, units: Units | None = None) -> tuple[float, float]:
    """First and last frequency of a range, rad/s, from numbers or texts such as "15 Hz", in the units of a problem."""
    name, expected = "frequency range", 'two frequencies such as (2.0, 15.0) or ("1 Hz", "40 Hz")'
    ends = listed(name, value, expected)
    if len(ends) == 2:
        value = [in_radians(name, end, units) for end in ends]
    return two_numbers(value, name, expected)


def requested_frequencies(at: Any, units: Units | None = None) -> tuple[float, ...]:
    """Frequencies at which points are wanted, rad/s, from numbers or texts; one alone is taken too."""
    if isinstance(at, str):
        return (in_radians("at", at, units),)
    if isinstance(at, Real):
        return requested_values(at)
    values = listed("at", at, "a frequency, or a list of them")
    return requested_values([in_radians(("at", i), value, units) for i, value in enumerate(values)])


def requested_values(at: Any) -> tuple[float, ...]:
    """Values at which points are wanted; one alone is taken too."""
    expected = "a finite number, or a list of them"
    if isinstance(at, Real):
        return (number("at", at, expected),)
    values = listed("at", at, expected)
    return tuple(number(("at", i), value) for i, value in enumerate(values))


def range_faults(start: float, stop: float, *, name: str = "frequency range", positive: bool = True) -> list[Fault]:
    """Faults of a range that is to be followed."""
    if not (isfinite(start) and isfinite(stop)):
        return [Fault(name, found=f"{start} to {stop}", expected="finite numbers")]
    if start == stop:
        return [Fault(name, found=f"{start:g} to {stop:g}, which is empty", expected="two different values")]
    if positive and min(start, stop) <= 0:
        return [Fault(name, found=f"{start:g} to {stop:g}", expected="frequencies > 0 in rad/s")]
    return []


def reach_faults(problem: Problem, ends: Sequence[float]) -> list[Fault]:
    """Faults of frequencies whose harmonics a structure does not answer: one known by a table, see its ``covers``."""
    low, high = problem.structure.covers
    orders = [m for m in problem.harmonics.orders if m]
    if not orders:
        return []
    first, last = min(ends) * orders[0], max(ends) * orders[-1]
    if first >= low and last <= high:
        return []
    asked = f"harmonics {orders[0]} to {orders[-1]} ask for the receptance from {first:.6g} to {last:.6g} rad/s"
    expected = f"frequencies of the structure's table, {low:.6g} to {high:.6g} rad/s"
    remedy = 'fewer harmonics, a smaller range, a longer table, or beyond="line"'
    return [Fault("frequency range", asked, expected=expected, remedy=remedy)]


def requested_faults(requested: Sequence[float], start: float, stop: float) -> list[Fault]:
    """Faults of values at which points are wanted."""
    low, high = min(start, stop), max(start, stop)
    return [
        Fault(
            "at",
            f"{value:g} lies outside of the range {low:g} to {high:g}",
            remedy="widen the range or leave it out",
        )
        for value in requested
        if not low <= value <= high
    ]


def _state_faults(problem: Problem) -> Iterator[Fault]:
    try:
        states = problem.contact_states
    except InputError as error:
        yield from error.faults
        return
    yield from state_faults(problem.contacts, problem.batches, states)
