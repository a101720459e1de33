"""Effect of the modes left out of a structure on a problem, over its range and at its harmonics.

A harmonic that is excited (by a load, by the rubbing motion) counts in full. Friction makes the others: its force is
continuous with kinks, so its harmonics fall with the square of their order. The part left out of the receptance at
order m moves the structure by ``(e / m)^2 |dA(m w)| / |A(e w)|`` relative to the motion at e, the next lower excited
order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import Fault
from slipstick.structure.truncation import REFUSED, WARNED_REDUCTION, Truncation, WorstError
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem


_FREQUENCIES = 9
"""Frequencies of the range at which the error is computed: it changes slowly below the modes left out."""


def worst_error(problem: Problem, omega: Sequence[float]) -> WorstError | None:
    """The largest weighted error of the receptance over a range (rad/s); None where nothing is left out, or not known.

    The structure tells what is left out at each harmonic (``Structure.truncations``): of a wave what the modes of its
    phase leave out, of a whole disc what those of all phases do.
    """
    orders = [m for m in problem.harmonics.orders if m > 0]
    grid, (bases, weights) = np.linspace(min(omega), max(omega), _FREQUENCIES), harmonic_weights(problem)
    worst: WorstError | None = None
    needed = 0.0
    for m, base, weight in zip(orders, bases, weights, strict=True):
        pairs = zip(problem.structure.truncations(m) or (), problem.structure.truncations(int(base)) or (), strict=True)
        for left_out, of_base in pairs:
            relative = left_out.error(m * grid)
            counted = weight * left_out.error(m * grid, base * grid, of_base)
            known = (relative > 0.0) & np.isfinite(relative)
            part = np.divide(counted, relative, out=np.ones_like(relative), where=known)
            # a fifth power: see WorstError.needed
            needed = max(needed, float(np.max(m * grid * np.minimum(part, 1.0) ** 0.2)))
            at = int(np.argmax(counted))
            if worst is None or counted[at] > worst.value:
                worst = WorstError(
                    value=float(counted[at]), relative=float(relative[at]), omega=float(grid[at]), reach=needed,
                    order=m, last_mode=left_out.last, kind=left_out.kind,
                )  # fmt: skip
    return None if worst is None else replace(worst, reach=needed)


def harmonic_weights(problem: Problem) -> tuple[Array, Array]:
    """For each harmonic above 0 the excited one that it is relative to, and its weight."""
    orders = [m for m in problem.harmonics.orders if m > 0]
    excited = excited_orders(problem) or orders[:1]
    below = [max((e for e in excited if e <= m), default=m) for m in orders]
    fallen = [(e / m) ** 2 if problem.contacts or e == m else 0.0 for e, m in zip(below, orders, strict=True)]
    return np.array(below, dtype=float), np.array(fallen)


def excited_orders(problem: Problem) -> list[int]:
    """Harmonics of the fundamental frequency at which loads and rubbing motions act, without 0."""
    orders = {load.harmonic * problem.load_order for load in problem.loads if load.cos or load.sin}
    orders |= {m * problem.rubbing_order for pair in problem.contacts for m in pair.rubbing.orders}
    return sorted(orders - {0})


def reduction_attributes(problem: Problem) -> dict[str, str]:
    """What results say of the reduced structure: how many modes it has (of a phase from sector to sector), whether its
    residuals are solved for, and up to which frequency its receptance is right to one percent."""
    parts = _truncations(problem)
    if not parts:
        return {}
    told = {"reduction_modes": str(min(part.count for part in parts))}
    if kind := problem.structure.residuals:
        told["reduction_residuals"] = kind
    limit = valid_to(problem)
    if any(part.kind == "unknown" for part in parts) or not np.isfinite(limit):
        return told
    return told | {"reduction_valid_to": f"{limit:.6g} {problem.units.angular}"}


def valid_to(problem: Problem) -> float:
    """Frequency (rad/s) up to which the receptance of all harmonics is right to one percent; infinite where it is."""
    return min((part.valid_to for part in _truncations(problem)), default=float("inf"))


def _truncations(problem: Problem) -> list[Truncation]:
    """What is left out at the harmonics kept, each once."""
    orders = [m for m in problem.harmonics.orders if m > 0]
    parts = [part for m in orders for part in problem.structure.truncations(m) or ()]
    return [*{id(part): part for part in parts}.values()]


def reduction_faults(
    problem: Problem, omega: Sequence[float], count: Callable[[float], int | None] | None = None
) -> list[Fault]:
    """Why the reduced structure is of no use over the range; ``count`` tells how many modes lie below a frequency."""
    worst = worst_error(problem, omega)
    if worst is None or not worst.refused:
        return []
    modes = count(worst.needed) if count is not None else None
    return [Fault(statement=worst.sentence(modes, problem.units.angular))]


def reduction_warnings(problem: Problem, omega: Sequence[float]) -> list[str]:
    """What is suspicious about the reduced structure over the range: beyond its modes, or an error that shows."""
    worst = worst_error(problem, omega)
    if worst is None:
        return []
    highest, rate = max(omega) * max(excited_orders(problem), default=1), problem.units.angular
    if worst.kind == "unknown" and highest > worst.last_mode:
        return [
            f"the range goes up to {highest:.5g} {rate}, but the modes of the structure end at "
            f"{worst.last_mode:.5g} {rate}; the error of the modes left out is unknown: "
            "give static_compliance, or more modes"
        ]
    limit = WARNED_REDUCTION if worst.kind == "estimate" else REFUSED
    return [worst.sentence(None, rate)] if worst.value > limit else []
