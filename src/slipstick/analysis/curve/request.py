"""What is asked of a curve besides what all analyses are: outputs whose peaks are located, a guess, stability."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import inf
from typing import TYPE_CHECKING, Any, Literal

from slipstick.analysis.road.events import EventFunction
from slipstick.analysis.road.request import Checks
from slipstick.balance.balance import Balance
from slipstick.balance.checks import peak_faults
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError
from slipstick.faults import names, numbers, shown
from slipstick.results.schema import LARGEST
from slipstick.solve.continuation import ContinuationOptions
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.analysis.stability.floquet import StabilityWatch

StabilityRequest = bool | Literal["full"]
"""What users ask for."""

PEAK_OUTPUTS = 3
"""Up to that many outputs, the peaks of all of them are located."""
LARGEST_OUTPUTS = 100
"""Up to that many others, the largest amplitude of each is located."""


def curve_arguments(
    checks: Checks,
    requested: tuple[float, ...],
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
    guess: Any = None,
    stability: StabilityRequest = False,
) -> dict[str, Any]:
    """The fields of a ``CurveRequest`` that are asked for alike for every kind of branch, and the problem made ready.

    Raises
    ------
    InputError
        With these faults and those that were found before.
    """
    common, problem = checks.shared(requested, options, listeners), checks.problem
    balance = common["balance"]
    sought = checks.take(_peak_dofs, problem, peaks_of) if problem is not None else None
    start = checks.take(_guess, guess, balance) if guess is not None and balance is not None else None
    judged = checks.take(stability_request, stability)
    watch = checks.take(_watch, balance, judged) if judged and balance is not None else None
    checks.end()
    peaks, largest = sought or ((), ())
    return {**common, "stability": watch, "peaks_of": peaks, "largest_of": largest, "guess": start}


def _watch(balance: Balance, judged: StabilityRequest) -> StabilityWatch:
    from slipstick.analysis.stability.floquet import StabilityWatch

    if balance.problem.structure.covers[1] < inf:
        remedy = (
            'fit modes to it (ss.models.modal_analysis), or say beyond="line": then it is counted from the receptance'
        )
        found = "the structure is a table of receptances: it has no states, and ends where disturbances are asked for"
        raise InputError(Fault("stability", found, remedy=remedy))
    return StabilityWatch(balance, full=judged == "full")


def _guess(value: Any, balance: Balance) -> Array:
    guess = numbers("guess", value, f"{balance.size} finite numbers")
    if guess.shape not in ((balance.size,), (balance.n_ports, balance.L)):
        raise InputError(
            f"guess: found shape {guess.shape}; expected ({balance.n_ports}, {balance.L}): coefficients of the "
            "relative motion of the contacts, first all tangential, then all normal ones"
        )
    return guess.reshape(-1)


def _peak_dofs(problem: Problem, peaks_of: Sequence[str] | str | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Outputs of which all peaks are located, and those of which the largest amplitude is."""
    outputs = tuple(problem.outputs or ())
    if peaks_of is None:
        if len(outputs) <= PEAK_OUTPUTS:
            return outputs, ()
        loaded = [load.dof for load in problem.loads if load.dof in outputs]
        first = [pair.first_direction for pair in problem.contacts[:1]]
        rubbed = [dof for direction in first for dof in direction if dof in outputs]
        chosen = tuple(dict.fromkeys(str(dof) for dof in loaded or rubbed)) or outputs[:1]
        rest = tuple(dof for dof in outputs if dof not in chosen)
        return chosen, rest if len(rest) <= LARGEST_OUTPUTS else ()
    chosen = names("peaks_of", peaks_of)
    if chosen == (LARGEST,) and LARGEST not in outputs:
        return chosen, ()
    faults = [fault.inside("peaks_of") for fault in peak_faults(chosen, outputs)]
    if faults:
        raise InputError(faults)
    return chosen, ()


def stability_request(stability: object) -> StabilityRequest:
    """Whether stability is asked for; InputError for anything but True, False, "full"."""
    if isinstance(stability, bool) or (isinstance(stability, str) and stability == "full"):
        return stability  # type: ignore[return-value]
    raise InputError(
        Fault("stability", found=shown(stability), expected='True, False, or "full" (all modes in motion)')
    )
