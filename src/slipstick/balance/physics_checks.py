"""Physics pre-flight: what can be computed but is suspicious, one sentence each, the same on every road."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from math import acos, degrees, gcd, pi
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.compliance import lossless
from slipstick.balance.contacts import PERPENDICULAR, Direction, in_space, lengths, same_direction
from slipstick.balance.loads import phase_warnings
from slipstick.balance.reduction import excited_orders, reduction_warnings
from slipstick.balance.support import pressing_warnings
from slipstick.faults import few_alike
from slipstick.quantities import WithUnit
from slipstick.structure.residuals import load_compliance, own_compliance
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem
    from slipstick.contact.law import Law


FEW_CONTACTS = 16
"""Contacts up to which the static compliance, which a curve needs anyway, is computed for these checks."""
INSIDE = 0.6180339887
"""Place in the range of a parameter at which it is checked: inside, because an end such as mu = 0 is often intended."""

_STIFFNESS_RATIO = 1e6
"""Contact stiffness over that of the structure above which it is suspicious: a slip of units, and lost digits."""
_UNDAMPED = 1e-14
"""Imaginary part of a receptance over its magnitude that is rounding: no damping at all."""
_WIDE_GAP = 100.0
"""Gap over the static deflection above which the contact is unlikely to close."""
_HEAVY_DAMPING = 0.5
"""Damping ratio above which there is hardly a resonance."""
_UNEQUAL = 1e-3
"""Relative difference of lengths of directions up to which it comes from the digits they are given with."""


def problem_warnings(
    problem: Problem,
    omega: Sequence[float] = (),
    static: Any = None,
    *,
    steady: bool = False,
    free: bool = False,
) -> list[str]:
    """What can be computed but is suspicious: said by every analysis before it computes, and by ``check``.

    Parameters
    ----------
    omega
        The ends of the frequency range, rad/s; without, only what is known without a range. Of those written with their
        unit (``WithUnit``) it is not asked whether that was meant.
    static
        Static compliance from contact ports, loaded dofs and load shapes to the contact ports, (n_ports, n_columns),
        where it is known (``Balance.receptance.static``).
    steady
        Steady sliding is looked at for its own sake: nothing need vary in time.
    free
        It vibrates freely: nothing need move it.
    """
    sentences = [
        *(
            []
            if free or (steady and _may_feed(problem))
            else _motion_warnings(problem, bool(len(omega)) and not steady)
        ),
        *_fed_warnings(problem),
        *_sum_warnings(problem),
    ]
    sentences += [*_harmonic_warnings(problem), *_contact_warnings(problem), *pressing_warnings(problem)]
    # without hold there is no static stiffness, and contacts make the first frequencies
    held = problem.structure.held
    if static is None and held and (len(omega) or len(problem.elements) <= FEW_CONTACTS):
        static = _static(problem)
    if static is not None and held:
        sentences += _proportion_warnings(problem, static)
    if len(omega) and (static is not None or not held):
        low, high = float(min(omega)), float(max(omega))
        natural = np.asarray(problem.structure.natural_frequencies, dtype=float)
        sentences += [*_damping_warnings(problem, natural, low), *_ratio_warnings(problem, natural, low, high)]
        sentences += [*reduction_warnings(problem, omega)]
        if static is not None and held and not all(isinstance(end, WithUnit) for end in omega):
            sentences += _unit_warnings(problem, natural, low, high, static)
    return few_alike(sentences)


def parameter_warnings(
    problem: Problem, parameter: str, span: Sequence[float], omega: float, static: Any = None, *,
    steady: bool = False,
) -> list[str]:  # fmt: skip
    """The same of a problem whose parameter is followed over a range at one frequency."""
    start, stop = (float(value) for value in span)
    inside = problem.at_parameter(parameter, start + INSIDE * (stop - start))
    load, sentences = problem.parameter_target(parameter).load, list[str]()
    if load is not None and parameter.endswith("phase"):
        sentences += phase_warnings(load.target, max(span, key=abs))
    return [*sentences, *problem_warnings(inside, (omega, omega), static, steady=steady)]


def _static(problem: Problem) -> Any:
    if not problem.contacts:
        return np.zeros((0, 0))
    ports = problem.direction_matrix(problem.port_directions)
    return problem.load_columns.receptance(problem.supported_structure, ports, ports).static


def _may_feed(problem: Problem) -> bool:
    """Whether it may vibrate by itself without rubbing: by its damping, or by a law that is not friction."""
    return bool(problem.structure.energy_fed) or not all(pair.contact.coulomb for pair in problem.contacts)


def _motion_warnings(problem: Problem, still: bool) -> Iterator[str]:
    """``still``: also where nothing varies in time."""
    if not problem.load_coefficients().any() and not any(pair.rubbing.moves for pair in problem.contacts):
        yield "nothing moves the structure: there is no load and no rubbing motion; give one of them"
    elif still and not excited_orders(problem):
        yield (
            "nothing varies in time: no load has a harmonic above 0, and no rubbing motion is periodic, so nothing "
            "vibrates; was a load forgotten?"
        )


def _fed_warnings(problem: Problem) -> Iterator[str]:
    """Structures that grow by themselves, by their damping."""
    if where := problem.structure.energy_fed:
        yield (
            f"the structure's damping feeds energy in ({where}): without friction vibration grows, and a periodic "
            "motion need not be stable; judge it with stability, or correct the signs of the damping and write its "
            "numbers with more digits"
        )
    if where := problem.structure.self_excited:
        yield (
            f"the structure's circulatory or negative stiffness makes it grow by itself ({where}): without contacts "
            "vibration grows, and a periodic motion need not be stable; judge it with stability"
        )


def _ratio_warnings(problem: Problem, natural: Array, low: float, high: float) -> Iterator[str]:
    """Modes met over the range, else the first one, that are damped as no structure is."""
    ratios = problem.structure.damping_ratios
    if ratios is None or natural.size == 0:
        return
    factor = problem.load_order
    met = np.flatnonzero((natural >= 0.5 * low * factor) & (natural <= 2.0 * high * factor))
    met = met if met.size else np.array([0])
    worst = int(met[np.argmax(np.asarray(ratios)[met])])
    if ratios[worst] > _HEAVY_DAMPING:
        yield (
            f"mode {worst + 1} at {natural[worst]:.5g} rad/s has a damping ratio of {ratios[worst]:.3g} (1 is critical "
            "damping, machines have 0.0001 to 0.05): check the damping, its units, and whether it was meant in percent"
        )


def _sum_warnings(problem: Problem) -> Iterator[str]:
    """Loads that were perhaps given twice, and what looks wrong in contact states."""
    counted = Counter((load.target, load) for load in problem.loads if load.cos or load.sin)
    for (target, load), times in counted.items():
        if times > 1:
            yield f"load on '{target}', harmonic {load.harmonic}: given {times} times alike; their forces add up"
    for state in problem.contact_states:
        yield from state.warnings()


def _harmonic_warnings(problem: Problem) -> Iterator[str]:
    orders = problem.harmonics.orders
    driven = excited_orders(problem)
    base = gcd(*driven) or 1
    multiples = [m // base for m in orders[1:] if m % base == 0]
    pairs = list(zip(problem.batches, problem.inputs.batches, strict=True))
    kinked = [(batch.law.kinked(contact_inputs.values), contact_inputs) for batch, contact_inputs in pairs]
    acting = any(mask.any() for mask, _ in kinked)
    one_sided = any((mask & contact_inputs.slides).any() for mask, contact_inputs in kinked)
    if one_sided and driven and not any(m % 2 == 0 for m in multiples):
        even = f"even multiples of {base}" if base > 1 else "even harmonics"
        yield (
            f"harmonics {list(orders)}: friction under one-sided rubbing produces {even}, and none but 0 is "
            "kept; amplitudes can be wrong by a third (36 % for the oscillator of Petrov 2012): keep the even ones too"
        )
    if acting and driven and max(multiples, default=0) < 3:
        yield (
            f"harmonics {list(orders)}: friction forces are far from sinusoidal; the highest harmonic kept is "
            f"{orders[-1]}, keep at least 0..{5 * base} and compare with more"
        )


def _contact_warnings(problem: Problem) -> Iterator[str]:
    yield from _plane_warnings(problem)
    for batch, contact_inputs in zip(problem.batches, problem.inputs.batches, strict=True):
        for e, (p, k) in enumerate(batch.members):
            pair = problem.contacts[p]
            ports = {port for port in batch.law.ports if pair.direction(port, k) is not None}
            approach = sum(
                _approach(contact_inputs.motion[batch.law.ports.index(port), e]) for port in _normal(batch.law)
            )
            values = {name: float(pair.values(name)[k]) for name in contact_inputs.values}
            along, across = (pair.direction(port, k) if port in ports else None for port in ("tangential", "normal"))
            if along and across and values.get("mu", 0.0) > 0.0 and same_direction(along, across):
                yield (
                    f"contact '{pair.elements[k]}': normal is the tangential direction, so that one motion presses and "
                    "slides: give the direction across the contact, or leave normal out for a constant normal load"
                )
            other = pair.direction("second", k) if "second" in ports else None
            for name, direction in (("tangential", along), ("second", other)):
                if direction and across and (cosine := _slanted(direction, across)):
                    yield (
                        f"contact '{pair.elements[k]}': normal is {degrees(acos(cosine)):.4g} degrees from the {name} "
                        "direction, so that sliding along it presses: give perpendicular directions"
                    )
            if along and other and in_space(along, other):
                a, b = lengths(along, other)
                if abs(a - b) > _UNEQUAL * a:
                    yield (
                        f"contact '{pair.elements[k]}': its second direction is {b / a:.4g} times as long as the "
                        "first, so that the same motion counts for more along one of them: give both one length"
                    )
            for name, parameter in batch.law.factors.items():
                values[parameter] *= getattr(problem, name) or 1.0  # a factor of 0 is meant
            for sentence in batch.law.warnings(values, ports, approach):
                yield f"contact '{pair.elements[k]}': {sentence}"


def _plane_warnings(problem: Problem) -> Iterator[str]:
    """Two perpendicular directions of one place, which a law of one direction takes for two contacts."""
    for pair in problem.contacts:
        alike = not isinstance(pair.area, np.ndarray) and all(np.ndim(v) == 0 for v in pair.contact.values.values())
        if len(pair) != 2 or "second" in pair.contact.ports or not alike or len(pair.given.get("normal", (None,))) > 1:
            continue
        along = [direction for k in range(2) if (direction := pair.direction("tangential", k))]
        places = {dof.partition("@")[0][:-1] for direction in along for dof in direction}
        if len(along) == 2 and len(places) == 1 and in_space(*along):
            cosine = sum(c * along[1].get(dof, 0.0) for dof, c in along[0].items())
            if abs(cosine) <= PERPENDICULAR:
                yield (
                    f"contact '{pair.name}': two directions are two contacts, each with friction of its own; give "
                    "ss.PlanarFrictionContact for one that slides in the plane, or each of the two a pair of its own"
                )


def _slanted(along: Direction, across: Direction) -> float:
    """Cosine of the angle between unit vectors in space that are neither perpendicular nor one line, else 0.

    A shorter one may be what is left of a direction where a body cannot move along all axes: its angle is not known.
    """
    if not in_space(along, across) or any(abs(length - 1.0) > _UNEQUAL for length in lengths(along, across)):
        return 0.0
    cosine = sum(c * across.get(dof, 0.0) for dof, c in along.items())
    return cosine if PERPENDICULAR < abs(cosine) < 1.0 - PERPENDICULAR else 0.0


def _normal(law: Law) -> list[str]:
    """The port along which the opposing surface approaches, if there is one."""
    return [port for direction, port in law.surface_ports.items() if direction == "normal"]


def _approach(motion: Array) -> float:
    """How far at most a motion (L,) comes nearer."""
    return float(motion[0] + np.abs(motion[1:]).sum())


def _proportion_warnings(problem: Problem, static: Any) -> Iterator[str]:
    """Contact stiffnesses out of all proportion to the structure's own, and gaps that no load can close.

    A very soft normal spring under preload is the common way to a constant normal load, and no slip of the pen.
    """
    compliance, loaded, springs = own_compliance(static), load_compliance(static), list(_springs(problem))
    loads = np.abs(problem.load_coefficients()).sum(axis=1)
    apart = {where for _, where, name, values in springs if name == "kn" and values["gap"] > 0}
    acting = len(apart) < len(problem.elements)
    for port, where, name, values in springs:
        stiffness = values[name]
        ratio = stiffness * compliance[port]
        soft = 0 < ratio < 1 / _STIFFNESS_RATIO and not (name == "kn" and values["gap"] < 0)
        if soft or ratio > _STIFFNESS_RATIO:
            much = f"{ratio:.2g} times" if ratio > 1 else f"only {ratio:.2g} of"
            yield (
                f"{where}: {name} = {stiffness:g} is {much} the static stiffness {1 / compliance[port]:.3g} of the "
                "structure in its direction: check the units of both"
            )
        gap = values.get("gap", 0.0)
        if name == "kn" and gap > 0:
            reach = float(np.abs(loaded[port]) @ loads)
            reach += values["approach"]
            if not reach and not acting:
                yield (
                    f"{where}: the gap {gap:g} is open and no load moves the structure across it, so that it never "
                    "closes: give a load in its normal direction, or gap < 0 (interference)"
                )
            if reach and gap > _WIDE_GAP * reach:
                yield (
                    f"{where}: the gap {gap:g} is more than {_WIDE_GAP:g} times the static deflection "
                    f"{reach:.2g} under the loads; it will hardly ever close: check its units"
                )


def _springs(problem: Problem) -> Iterator[tuple[int, str, str, dict[str, float]]]:
    """For each port with a stiffness parameter: its number, contact, that parameter, and all numbers of the contact.

    "approach" is how far the opposing surface itself may come.
    """
    for batch, contact_inputs in zip(problem.batches, problem.inputs.batches, strict=True):
        for i, name in batch.law.stiffness_names.items():
            port = batch.ports[i]
            rows, members = np.arange(len(problem.port_directions))[port.rows], np.arange(batch.count)[port.members]
            for row, e in zip(rows, members, strict=True):
                values = {key: float(value[e]) for key, value in contact_inputs.values.items()}
                values["approach"] = float(np.abs(contact_inputs.motion[i, e]).sum())
                yield int(row), f"contact '{problem.elements[batch.numbers[e]]}'", name, values


def _damping_warnings(problem: Problem, natural: Array, omega: float) -> Iterator[str]:
    if problem.contacts:
        rows = problem.direction_matrix([problem.contacts[0].first_direction])
    else:
        dofs = [load.dof for load in problem.loads if load.dof is not None]
        rows = problem.direction_matrix({dof: 1.0} for dof in (*dofs, *problem.structure.dofs)[:1])
    at = 0.5 * natural[0] if natural.size else omega
    value, _ = problem.supported_structure.project(rows, rows).at(np.ones(1), at)
    if np.all(lossless(value, _UNDAMPED)):
        yield (
            "the structure has no damping: where a harmonic of the frequency meets a natural frequency the receptance "
            "is infinite and the motion may have no bound; give a little damping, for instance a loss factor of 1e-6"
        )


def _unit_warnings(problem: Problem, natural: Array, low: float, high: float, static: Any) -> Iterator[str]:
    factor = problem.load_order
    low, high = low * factor, high * factor
    if not problem.units.in_seconds or natural.size == 0 or np.any((natural >= 0.8 * low) & (natural <= 1.25 * high)):
        return
    if low <= _stuck_limit(problem, float(natural[0]), static) and high >= natural[0]:
        return
    meant = natural[(natural >= 2 * pi * low) & (natural <= 2 * pi * high)]
    if meant.size:
        yield (
            f"frequencies from {low:g} to {high:g} rad/s contain no natural frequency, but the same numbers in Hz "
            f"contain {meant[0]:.5g} rad/s = {meant[0] / (2 * pi):.5g} Hz: were they meant in Hz? Multiply them by 2 pi"
        )
    elif np.any((natural * 2 * pi >= low) & (natural * 2 * pi <= high)):
        yield (
            f"frequencies from {low:g} to {high:g} rad/s contain no natural frequency, but divided by 2 pi they do: "
            f"was 2 pi applied twice? The first natural frequency is {natural[0]:.5g} rad/s"
        )


def _stuck_limit(problem: Problem, first: float, static: Any) -> float:
    """Highest first natural frequency the contact stiffnesses can make, a crude bound by static compliance."""
    compliance = own_compliance(static)
    stiffness = np.zeros(len(compliance))
    for port, _, name, values in _springs(problem):
        stiffness[port] = values[name]
    return first * float(np.prod(np.sqrt(1.0 + np.maximum(compliance, 0.0) * stiffness)))
