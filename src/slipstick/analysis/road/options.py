"""Options of an analysis, as users give them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from slipstick.balance.jacobian_backends import BACKENDS, JacobianBackend
from slipstick.errors import Fault
from slipstick.faults import Gathering, number, one, shown, suggestion, whole, wrong
from slipstick.solve.continuation import ContinuationOptions
from slipstick.solve.newton import NewtonOptions


@dataclass(frozen=True, kw_only=True)
class ResponseOptions(ContinuationOptions):
    """Options of a response curve: those of a continuation, with points so near that figures look smooth, and these.

    Parameters
    ----------
    jacobian
        In which form Jacobians are made: "dense", all entries, factorised; "iterative", products alone, for hundreds of
        contacts on a structure known by its modes; "auto", which of the two costs less. Or a kind of one's own, see
        ``slipstick.balance.jacobian_backends``.
    adapt_harmonics
        Relative accuracy, such as 1e-3: each point is computed with as few of the problem's harmonics as that asks for;
        ``harmonics_in_use`` in the results says how many. None: all of them at every point.
    """

    first_step: float = 1 / 60
    max_step: float = 1 / 30
    output_step: float = 1 / 120
    event_tolerance: float = 1e-9
    jacobian: JacobianBackend | str = "auto"
    adapt_harmonics: float | None = None


def response_options(**options: Any) -> ResponseOptions:
    """``ResponseOptions`` with the fields given: steps of at most 1/30 of the range, points each 1/120 by default."""
    return ResponseOptions(**options)


def adapted_to(options: ContinuationOptions) -> float | None:
    """The accuracy to which harmonics are adapted; None where all are in use."""
    return options.adapt_harmonics if isinstance(options, ResponseOptions) else None


def options_of(chosen: Any) -> ContinuationOptions:
    """Options from a dict of them, the options themselves, or None; InputError for anything else."""
    if chosen is None or isinstance(chosen, ContinuationOptions):
        return chosen or response_options()
    if not isinstance(chosen, Mapping):
        raise wrong("options", chosen, 'a dict such as {"max_step": 0.01}, or response_options(...)')
    known, checks = [field.name for field in fields(ResponseOptions)], Gathering()
    for name in chosen:
        if name not in known:
            checks.faults.append(Fault("options", f"there is no option {shown(name)}", remedy=suggestion(name, known)))
    values = {name: checks.take(_option, name, value) for name, value in chosen.items() if name in known}
    options = checks.take(response_options, **values) if not checks.faults else None
    checks.end()
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
    accuracy = None if value is None else number(name, value, expected)
    if accuracy is not None and not 0.0 < accuracy < 1.0:
        raise wrong(name, value, expected)
    return accuracy


def _jacobian(name: str, value: Any) -> JacobianBackend | str:
    if isinstance(value, JacobianBackend) or (isinstance(value, str) and value in ("auto", *BACKENDS)):
        return value
    raise wrong(name, value, '"auto", "dense", "iterative", or an object of a kind of one\'s own')
