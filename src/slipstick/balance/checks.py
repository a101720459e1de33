"""What of a problem cannot be computed, in sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from math import isfinite
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.base_motion import base_faults
from slipstick.balance.contacts import direction_faults
from slipstick.balance.warm import heat_faults
from slipstick.contact.rubbing import common_period
from slipstick.errors import InputError
from slipstick.faults import listed, number, suggestion, wrong

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.loads import Load
    from slipstick.balance.problem import Problem


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
    if problem.friction < 0:
        faults.append(f"friction factor: found {problem.friction:g}; expected a finite number >= 0")
    return faults


def two_numbers(value: Any, name: str) -> tuple[float, float]:
    """First and last value of a range; InputError where that is not what was given."""
    expected = "two numbers, the first and the last"
    ends = listed(name, value, expected)
    if len(ends) > 2:
        raise InputError(
            f"{name}: found {len(ends)} values; expected two numbers, the first and the last: the points between are "
            "chosen on the way; give requested= for points at exact values"
        )
    if len(ends) != 2:
        raise wrong(name, value, expected)
    return number(name, ends[0], expected), number(name, ends[1], expected)


def requested_values(given: Any) -> tuple[float, ...]:
    """Values at which points are wanted; one alone is taken too."""
    expected = "a finite number, or a list of them"
    if isinstance(given, Real):
        return (number("requested", given, expected),)
    values = listed("requested", given, expected)
    return tuple(number(f"requested, number {i + 1}", value) for i, value in enumerate(values))


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


def _heat_faults(problem: Problem) -> list[str]:
    try:
        heated = problem.heated
    except InputError as error:
        return list(error.problems)
    return [] if heated is None else heat_faults(problem.contacts, problem.batches[heated.batch], heated)


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
    yield from direction_faults(pair)
    try:
        given = pair.directions
    except InputError:
        return
    for port, directions in given.items():
        where = f"contact '{pair.name}', {port} direction"
        for cosines in directions:
            if cosines is None:
                continue
            for dof in cosines:
                if dof not in dofs:
                    yield f"{where}: there is no dof '{dof}' in the structure; {suggestion(dof, dofs)}"
            if not all(isfinite(c) for c in cosines.values()):
                yield f"{where}: found {dict(cosines)}; expected finite direction cosines"
            elif not any(cosines.values()):
                yield f"{where}: found {dict(cosines)}, which has no direction; expected a cosine other than zero"


def _load_faults(load: Load, problem: Problem, order: int) -> Iterator[str]:
    structure = problem.structure
    if sum(given is not None for given in (load.dof, load.shape, load.base)) != 1:
        also = "" if load.base is None else f" and base = {load.base!r}"
        yield f"load: found dof = {load.dof!r} and shape = {load.shape!r}{also}; expected exactly one of them"
    elif load.base is not None:
        yield from base_faults(load, structure)
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
    across = [name for name, value in pair.rubbing.components() if name.startswith("normal_") and np.any(value)]
    if across and "normal" not in pair.contact.ports:
        yield (
            f"contact '{pair.name}', rubbing motion: {across[0]} moves the surface along a port called 'normal', which "
            f"its law does not have; it has {', '.join(pair.contact.ports)}"
        )


def _not_kept(harmonic: int, factor: int, orders: Sequence[int]) -> str:
    own = f"harmonic {harmonic}" + (f" (harmonic {harmonic * factor} of the principal frequency)" if factor > 1 else "")
    return f"{own} is not among the harmonics kept, {list(orders)}; keep it too"
