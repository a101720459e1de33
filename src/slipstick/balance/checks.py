"""Physics pre-flight: what cannot be computed (faults) and what looks wrong (warnings), in sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from math import isfinite, pi
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.heat import heat_faults
from slipstick.balance.reduction import reduction_warnings
from slipstick.contact.rubbing import common_period
from slipstick.errors import InputError

if TYPE_CHECKING:
    from slipstick.balance.problem import ContactPair, Problem


def problem_faults(problem: Problem) -> list[str]:
    """Why the problem cannot be computed; empty if it can."""
    faults = list(_name_faults(problem))
    for pair in problem.contacts:
        faults += _contact_faults(pair, problem.structure.dofs)
    faults += _heat_faults(problem)
    try:
        excitation, rubbing = common_period(*problem.period_ratio)
    except InputError as error:
        return [*faults, *error.problems]
    for load in problem.loads:
        faults += _load_faults(load, problem, excitation)
    for pair in problem.contacts:
        faults += _rubbing_faults(pair, problem.harmonics.orders, rubbing)
    for name in ("load", "friction"):
        value = getattr(problem, name)
        if not isfinite(value) or (name == "friction" and value < 0):
            faults.append(f"{name} factor: found {value}; expected a finite number" + " >= 0" * (name == "friction"))
    return faults


def two_numbers(value: Any, name: str) -> tuple[float, float]:
    """First and last value of a range; InputError where that is not what was given."""
    try:
        start, stop = value
        if isinstance(start, str) or isinstance(stop, str):
            raise TypeError
        return float(start), float(stop)
    except (TypeError, ValueError):
        raise InputError(f"{name}: found {value!r}; expected two numbers, the first and the last") from None


def range_faults(start: float, stop: float, *, name: str = "frequency range", positive: bool = True) -> list[str]:
    """Faults of a range that is to be followed."""
    if not (isfinite(start) and isfinite(stop)):
        return [f"{name}: found {start} to {stop}; expected finite numbers"]
    if start == stop:
        return [f"{name}: found {start:g} to {stop:g}, which is empty; expected two different values"]
    if positive and min(start, stop) <= 0:
        return [f"{name}: found {start:g} to {stop:g}; expected frequencies > 0 in rad/s"]
    return []


def requested_faults(requested: Sequence[float], start: float, stop: float) -> list[str]:
    """Faults of values at which points are wanted."""
    low, high = min(start, stop), max(start, stop)
    return [
        f"requested point {value:g}: lies outside of the range {low:g} to {high:g}; widen the range or leave it out"
        for value in requested
        if not low <= value <= high
    ]


def problem_warnings(problem: Problem, omega: Sequence[float] = ()) -> list[str]:
    """What can be computed but looks wrong; ``omega`` holds the ends of the frequency range, rad/s."""
    found = [*_harmonic_warnings(problem), *_contact_warnings(problem), *_damping_warnings(problem)]
    if not any(load.cos or load.sin for load in problem.loads) and not any(p.rubbing.moves for p in problem.contacts):
        found.append("nothing moves the structure: there is no load and no rubbing motion; give one of them")
    if len(omega):
        found += _frequency_warnings(problem, float(min(omega)), float(max(omega)))
        found += reduction_warnings(problem, omega)
    return found


def suggestion(name: Any, known: Sequence[str]) -> str:
    """A close match among the known names, or some of these."""
    close = get_close_matches(str(name), known, n=1, cutoff=0.5)
    if close:
        return f"did you mean '{close[0]}'?"
    listed = ", ".join(known[:8]) + (", ..." if len(known) > 8 else "")
    return f"known are {listed}" if known else "there are none"


def _heat_faults(problem: Problem) -> list[str]:
    try:
        return heat_faults(problem.contacts, problem.heated) if problem.heated is not None else []
    except InputError as error:
        return list(error.problems)


def _name_faults(problem: Problem) -> Iterator[str]:
    names = [pair.name for pair in problem.contacts]
    for name, times in sorted(Counter(names).items()):
        if times > 1:
            yield f"contact '{name}': the name is used {times} times; give every contact its own name"
    for name in names:
        if not name or name == "*" or not name.isprintable():
            yield f"contact name: found {name!r}; expected printable characters other than '*' alone"
    if not problem.outputs:
        yield "outputs: found none; expected at least one dof"
    for dof, times in Counter(problem.outputs or ()).items():
        if times > 1:
            yield f"outputs: '{dof}' is given {times} times; give every dof once"
    for dof in problem.outputs or ():
        if dof not in problem.structure.dofs:
            yield f"outputs: there is no dof '{dof}' in the structure; {suggestion(dof, problem.structure.dofs)}"


def _contact_faults(pair: ContactPair, dofs: Sequence[str]) -> Iterator[str]:
    for side, cosines in zip(("tangential", "normal"), pair.directions, strict=True):
        if cosines is None:
            continue
        where = f"contact '{pair.name}', {side} direction"
        for dof in cosines:
            if dof not in dofs:
                yield f"{where}: there is no dof '{dof}' in the structure; {suggestion(dof, dofs)}"
        if not all(isfinite(c) for c in cosines.values()):
            yield f"{where}: found {dict(cosines)}; expected finite direction cosines"
        elif not any(cosines.values()):
            yield f"{where}: found {dict(cosines)}, which has no direction; expected a direction cosine other than zero"
    for name in ("kt", "mu", "kn", "gap"):
        if np.ndim(getattr(pair.contact, name)):
            yield f"contact '{pair.name}', {name}: found an array; expected one number (one pair is one element)"
    motion = pair.rubbing
    if any(np.ndim(v) for v in (motion.velocity, *motion.cos.values(), *motion.sin.values())):
        yield f"contact '{pair.name}', rubbing: found an array; expected one number (one pair is one element)"


def _load_faults(load: Any, problem: Problem, order: int) -> Iterator[str]:
    structure = problem.structure
    if (load.dof is None) == (load.shape is None):
        yield f"load: found dof = {load.dof!r} and shape = {load.shape!r}; expected exactly one of them"
    elif load.dof is not None and load.dof not in structure.dofs:
        yield f"load: there is no dof '{load.dof}' in the structure; {suggestion(load.dof, structure.dofs)}"
    elif load.shape is not None and load.shape not in structure.load_shapes:
        yield f"load: there is no load shape '{load.shape}'; {suggestion(load.shape, structure.load_shapes)}"
    if not (isfinite(load.cos) and isfinite(load.sin)):
        yield f"load on '{load.target}': found cos = {load.cos}, sin = {load.sin}; expected finite forces"
    if int(load.harmonic) != load.harmonic or load.harmonic < 0:
        yield f"load on '{load.target}': found harmonic {load.harmonic}; expected a whole number >= 0"
    elif load.harmonic * order not in problem.harmonics.orders:
        yield f"load on '{load.target}': {_not_kept(load.harmonic, order, problem.harmonics.orders)}"
    elif load.harmonic == 0 and load.sin:
        yield f"load on '{load.target}': a sine of harmonic 0 is zero; give a static load as cos"


def _rubbing_faults(pair: ContactPair, orders: Sequence[int], factor: int) -> Iterator[str]:
    for order in pair.rubbing.orders:
        if order * factor not in orders:
            yield f"contact '{pair.name}', rubbing motion: {_not_kept(order, factor, orders)}"


def _not_kept(harmonic: int, factor: int, orders: Sequence[int]) -> str:
    own = f"harmonic {harmonic}" + (f" (harmonic {harmonic * factor} of the principal frequency)" if factor > 1 else "")
    return f"{own} is not among the harmonics kept, {list(orders)}; keep it too"


def _rubbed(problem: Problem) -> list[ContactPair]:
    return [pair for pair in problem.contacts if pair.velocity != 0]


def _harmonic_warnings(problem: Problem) -> Iterator[str]:
    orders = problem.harmonics.orders
    if _rubbed(problem) and len(orders) > 1 and not any(m % 2 == 0 for m in orders[1:]):
        yield (
            f"harmonics {list(orders)}: friction under one-sided rubbing produces even harmonics, and none but 0 is "
            "kept; amplitudes can be wrong by a third (36 % on a published oscillator): keep the even ones too"
        )
    frictional = any(pair.value("mu") > 0 and pair.value("kt") > 0 for pair in problem.contacts)
    if frictional and orders[-1] < 3:
        yield (
            f"harmonics {list(orders)}: friction forces are far from sinusoidal; the highest harmonic kept is "
            f"{orders[-1]}, keep at least 0..5 and compare with more"
        )


def _damping_warnings(problem: Problem) -> Iterator[str]:
    natural = np.asarray(problem.structure.natural_frequencies, dtype=float)
    if natural.size == 0 or not problem.contacts:
        return
    direction = problem.direction_matrix([problem.contacts[0].directions[0]])
    value, _ = problem.structure.project(direction, direction).at(np.array([0.5 * natural[0]]))
    if value.imag.any():
        return
    yield (
        "the structure has no damping: where a harmonic of the frequency meets a natural frequency the receptance is "
        "infinite and the curve stops; give a little damping, for instance a loss factor of 1e-6"
    )


def _contact_warnings(problem: Problem) -> Iterator[str]:
    for pair in problem.contacts:
        where, value = f"contact '{pair.name}'", pair.value
        if pair.normal is None and value("normal_load") == 0:
            yield f"{where}: the normal load is 0 and the contact has no normal direction, so it never acts"
        elif value("mu") == 0 and value("kt") > 0:
            yield f"{where}: mu = 0, so there is no friction force"
        elif value("kt") == 0:
            yield f"{where}: kt = 0, so it never sticks; give the tangential contact stiffness"
        if pair.normal is not None and value("gap") > 0:
            reach = _static_reach(problem, pair.normal)
            if reach and value("gap") > 100 * reach:
                yield (
                    f"{where}: the gap {value('gap'):g} is more than 100 times the static deflection {reach:.2g} "
                    "under the loads; it will hardly ever close: check its units"
                )


def _static_reach(problem: Problem, normal: Any) -> float:
    """Deflection along a direction by all load amplitudes acting statically."""
    dofs, shapes = problem.load_targets
    if not dofs and not shapes:
        return 0.0
    columns = problem.direction_matrix({dof: 1.0} for dof in dofs)
    static = problem.structure.project(problem.direction_matrix([normal]), columns, shapes).static
    return float((np.abs(static) @ np.abs(problem.load_coefficients()).sum(axis=1))[0])


def _frequency_warnings(problem: Problem, low: float, high: float) -> Iterator[str]:
    natural = np.asarray(problem.structure.natural_frequencies, dtype=float)
    factor = problem.load_order
    low, high = low * factor, high * factor
    if natural.size == 0 or np.any((natural >= 0.8 * low) & (natural <= 1.25 * high)):
        return
    limits = _stuck_limit(problem, natural)
    if low <= limits and high >= natural[0]:
        return
    meant = natural[(natural >= 2 * pi * low) & (natural <= 2 * pi * high)]
    if meant.size:
        yield (
            f"frequencies from {low:g} to {high:g} rad/s hold no natural frequency, but the same numbers in Hz hold "
            f"{meant[0]:.5g} rad/s = {meant[0] / (2 * pi):.5g} Hz: were they meant in Hz? Multiply them by 2 pi"
        )
    elif np.any((natural * 2 * pi >= low) & (natural * 2 * pi <= high)):
        yield (
            f"frequencies from {low:g} to {high:g} rad/s hold no natural frequency, but divided by 2 pi they do: "
            f"was 2 pi applied twice? The first natural frequency is {natural[0]:.5g} rad/s"
        )


def _stuck_limit(problem: Problem, natural: Any) -> float:
    """Highest first natural frequency the contact stiffnesses can make, a crude bound by static compliance."""
    first = float(natural[0])
    for pair in problem.contacts:
        directions: list[tuple[Mapping[str, float] | None, str]] = [(pair.tangential, "kt"), (pair.normal, "kn")]  # type: ignore[list-item]
        for cosines, stiffness in directions:
            if cosines is not None:
                matrix = problem.direction_matrix([cosines])
                compliance = float(problem.structure.project(matrix, matrix).static[0, 0])
                first *= float(np.sqrt(1.0 + max(compliance, 0.0) * pair.value(stiffness)))
    return first
