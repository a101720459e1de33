"""What the modes left out of a structure do to a problem: over its range, at the harmonics that matter.

A harmonic that is excited (by a load, by the rubbing motion) counts in full. Friction makes the others: its force is
continuous with kinks, so its harmonics fall with the square of their order. What is left out of the receptance at order
m moves the structure by ``(e / m)^2 |dA(m w)| / |A(e w)|`` relative to the motion at e, the next excited order below.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import Fault
from slipstick.structure.truncation import REFUSED, WARNED_REDUCTION, WorstError
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem


_FREQUENCIES = 9


def worst_error(problem: Problem, omega: Sequence[float]) -> WorstError | None:
    """The largest weighted error of the receptance over a range (rad/s); None for a structure without such an estimate.

    A structure tells it by a method ``reduction_error(frequencies, relative_to)`` and attributes ``error_kind`` and
    ``last_mode``, as :class:`slipstick.structure.modal.ModalStructure` does.
    """
    structure = problem.structure
    estimate = getattr(structure, "reduction_error", None)
    orders = np.array([m for m in problem.harmonics.orders if m > 0], dtype=float)
    if estimate is None or not len(orders):
        return None
    grid = np.linspace(min(omega), max(omega), _FREQUENCIES)
    places, (base, weights) = np.multiply.outer(grid, orders), harmonic_weights(problem)
    relative = np.asarray(estimate(places))
    counted = weights * np.asarray(estimate(places, np.multiply.outer(grid, base)))
    at, order = np.unravel_index(int(np.argmax(counted)), counted.shape)
    part = np.divide(counted, relative, out=np.ones_like(relative), where=(relative > 0.0) & np.isfinite(relative))
    return WorstError(
        value=float(counted[at, order]),
        relative=float(relative[at, order]),
        omega=float(grid[at]),
        reach=float(np.max(places * np.minimum(part, 1.0) ** 0.2)),  # a fifth power: see WorstError.needed
        order=int(orders[order]),
        last_mode=float(structure.last_mode),  # type: ignore[attr-defined]
        kind=str(structure.error_kind),  # type: ignore[attr-defined]
    )


def harmonic_weights(problem: Problem) -> tuple[Array, Array]:
    """For each harmonic kept but 0 the excited one it is measured by, and how much it counts."""
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
    """What results say of the reduced structure: how many modes it has, whether its residuals are solved for, and up to
    which frequency its receptance is right to one percent."""
    limit = getattr(problem.structure, "valid_to", None)
    if limit is None:
        return {}
    told = {"reduction_modes": str(len(problem.structure.omega))}  # type: ignore[attr-defined]
    if kind := getattr(problem.structure, "residuals", None):
        told["reduction_residuals"] = str(kind)
    if problem.structure.error_kind == "unknown" or not np.isfinite(limit):  # type: ignore[attr-defined]
        return told
    return told | {"reduction_valid_to": f"{float(limit):.6g} {problem.units.angular}"}


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
            f"the range goes up to {highest:.5g} {rate}, beyond the modes of the structure, which end at "
            f"{worst.last_mode:.5g} {rate}, and the error of what was left out is unknown: "
            "give static_compliance, or more modes"
        ]
    limit = WARNED_REDUCTION if worst.kind == "estimate" else REFUSED
    return [worst.sentence(None, rate)] if worst.value > limit else []
