"""A branch that is asked for: what varies, from where to where, with which options."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from slipstick.analysis.course import Checkpoint
from slipstick.analysis.events import Listener
from slipstick.balance.inputs import Inputs
from slipstick.balance.ports import Balance
from slipstick.balance.problem import Problem
from slipstick.balance.systems import FrequencySystem, ParameterSystem
from slipstick.solve.continuation import ContinuationOptions
from slipstick.typing import Array


def response_options(**given: Any) -> ContinuationOptions:
    """Options of a response curve: steps of at most 1/120 of the range, so that figures look smooth.

    Any field of ``ContinuationOptions`` can be given.
    """
    return ContinuationOptions(**({"first_step": 1 / 300, "max_step": 1 / 120, "event_tolerance": 1e-9} | given))


@dataclass(frozen=True, kw_only=True)
class Task:
    """A branch to be followed: what varies, from where to where."""

    problem: Problem
    balance: Balance
    system: FrequencySystem | ParameterSystem
    inputs: Inputs
    omega: float
    """Frequency of the first point."""
    start: float
    stop: float
    parameter: str = ""
    requested: tuple[float, ...] = ()
    peaks_of: tuple[str, ...] = ()
    options: ContinuationOptions = field(default_factory=response_options)
    listeners: tuple[Listener, ...] = ()
    guess: Array | None = None
    checkpoints: Sequence[Checkpoint] = ()
    """Of every point that was found already, up to an accepted one: the branch is followed on from there."""
    warnings: Sequence[str] = ()
    """What looks wrong, said to the user and written on the results."""
