"""What users give to a response curve, in the form that is computed with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from slipstick.analysis.events import Listener
from slipstick.analysis.stability.request import StabilityRequest, stability_request
from slipstick.analysis.task import ResponseOptions, response_options
from slipstick.balance.checks import peak_faults
from slipstick.balance.kinds import KINDS, Kind
from slipstick.balance.ports import Balance
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, listed, names, number, numbers, one, shown, suggestion, whole, wrong
from slipstick.solve.continuation import ContinuationOptions
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.analysis.stability.verdict import StabilityWatch

PEAK_OUTPUTS = 3
"""Up to that many outputs, the peaks of all of them are located."""
LARGEST_OUTPUTS = 100
"""Up to that many others, the largest amplitude of each is located."""


def followed_problem(given: Any) -> Problem:
    """A problem that has contacts."""
    problem = one("problem", given, Problem, "an ss.Problem")
    if not problem.contacts:
        raise InputError("there is no contact; the response is linear: use linear_response, or give a contact")
    return problem


def common_arguments(
    problem: Problem | None,
    requested: tuple[float, ...],
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[Listener] | Listener = (),
    guess: ArrayLike | None = None,
    stability: StabilityRequest = False,
) -> dict[str, Any]:
    """The fields of a ``Task`` that are asked for alike for every kind of branch, and the problem made ready.

    Without a problem (where it is itself at fault) only what does not need one is checked.

    Raises
    ------
    InputError
        With the faults of all of them.
    """
    found = Gathering()
    chosen = found.take(_options, options)
    heard = found.take(_listeners, listeners)
    sought = found.take(_peak_dofs, problem, peaks_of) if problem is not None else None
    balance = found.take(_balance, problem, chosen) if problem is not None and chosen is not None else None
    start = found.take(_guess, guess, balance) if guess is not None and balance is not None else None
    asked = found.take(stability_request, stability)
    watch = found.take(_watch, balance, asked) if asked and balance is not None else None
    found.end()
    return {
        "balance": balance,
        "stability": watch,
        "requested": requested,
        "peaks_of": sought[0] if sought else (),
        "largest_of": sought[1] if sought else (),
        "options": chosen,
        "listeners": heard,
        "guess": start,
    }


def _watch(balance: Balance, asked: StabilityRequest) -> StabilityWatch:
    from slipstick.analysis.stability.verdict import StabilityWatch

    return StabilityWatch(balance, full=asked == "full")


def _balance(problem: Problem, options: ContinuationOptions) -> Balance:
    return Balance(problem, kind=options.jacobian if isinstance(options, ResponseOptions) else "auto")


def _options(given: Any) -> ContinuationOptions:
    if given is None or isinstance(given, ContinuationOptions):
        return given or response_options()
    if not isinstance(given, Mapping):
        raise wrong("options", given, 'a dict such as {"max_step": 0.01}, or response_options(...)')
    known, found = [field.name for field in fields(ResponseOptions)], Gathering()
    for name in given:
        if name not in known:
            found.faults.append(Fault("options", f"there is no option {shown(name)}", remedy=suggestion(name, known)))
    values = {name: found.take(_option, name, value) for name, value in given.items() if name in known}
    options = found.take(response_options, **values) if not found.faults else None
    found.end()
    assert options is not None
    return options


def _option(name: str, value: Any) -> Any:
    default, where = getattr(response_options(), name), f"options, {name}"
    if name == "adapt_harmonics":
        return _accuracy(where, value)
    if name == "jacobian":
        return _jacobian(where, value)
    if isinstance(default, NewtonOptions):
        return one(where, value, NewtonOptions, "NewtonOptions(...)")
    if isinstance(default, bool):
        return one(where, value, bool, "True or False")
    return whole(where, value, 1) if isinstance(default, int) else number(where, value, "a number > 0", above=0.0)


def _accuracy(name: str, value: Any) -> float | None:
    expected = "a number between 0 and 1 such as 1e-3, or None"
    found = None if value is None else number(name, value, expected)
    if found is not None and not 0.0 < found < 1.0:
        raise wrong(name, value, expected)
    return found


def _jacobian(name: str, value: Any) -> Kind | str:
    if isinstance(value, Kind) or (isinstance(value, str) and value in ("auto", *KINDS)):
        return value
    raise wrong(name, value, '"auto", "dense", "iterative", or an object of a kind of one\'s own')


def _listeners(given: Any) -> tuple[Listener, ...]:
    if callable(given):
        return (given,)
    expected = "a function of one event, or a list of them"
    found = listed("listeners", given, expected)
    for listener in found:
        if not callable(listener):
            raise wrong("listeners", listener, expected)
    return found


def _guess(given: Any, balance: Balance) -> Array:
    guess = numbers("guess", given, f"{balance.size} finite numbers")
    if guess.shape not in ((balance.size,), (balance.n_ports, balance.L)):
        raise InputError(
            f"guess: found shape {guess.shape}; expected ({balance.n_ports}, {balance.L}): coefficients of the "
            "relative motion of the contacts, first all tangential, then all normal ones"
        )
    return guess.reshape(-1)


def _peak_dofs(problem: Problem, given: Sequence[str] | str | None) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Outputs of which all peaks are located, and those of which the largest amplitude is."""
    outputs = tuple(problem.outputs or ())
    if given is None:
        if len(outputs) <= PEAK_OUTPUTS:
            return outputs, ()
        loaded = [load.dof for load in problem.loads if load.dof in outputs]
        first = [pair.first_direction for pair in problem.contacts[:1]]
        rubbed = [dof for direction in first for dof in direction if dof in outputs]
        chosen = tuple(dict.fromkeys(str(dof) for dof in loaded or rubbed)) or outputs[:1]
        rest = tuple(dof for dof in outputs if dof not in chosen)
        return chosen, rest if len(rest) <= LARGEST_OUTPUTS else ()
    chosen = names("peaks_of", given)
    faults = [fault.inside("peaks_of") for fault in peak_faults(chosen, outputs)]
    if faults:
        raise InputError(faults)
    return chosen, ()
