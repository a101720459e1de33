"""A branch that is asked for: what varies, from where to where, with which options."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from slipstick.analysis.curve.resume import Checkpoint
from slipstick.analysis.events import Listener
from slipstick.balance.inputs import Inputs
from slipstick.balance.kinds import Kind
from slipstick.balance.ports import Balance
from slipstick.balance.problem import Problem
from slipstick.balance.systems import FrequencySystem, ParameterSystem
from slipstick.solve.continuation import ContinuationOptions
from slipstick.solve.continuation.events import BranchEvent
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.analysis.stability.floquet import StabilityWatch


@dataclass(frozen=True, kw_only=True)
class ResponseOptions(ContinuationOptions):
    """Options of a response curve: those of a continuation, with points so near that figures look smooth, and these.

    Parameters
    ----------
    jacobian
        In which form Jacobians are made: "dense", all entries, factorised; "iterative", products alone, for hundreds of
        contacts on a structure known by its modes; "auto", which of the two costs less. Or a kind of one's own, see
        ``slipstick.balance.kinds``.
    adapt_harmonics
        Relative accuracy, such as 1e-3: each point is computed with as few of the problem's harmonics as that asks for;
        ``harmonics_in_use`` in the results says how many. None: all of them at every point.
    """

    first_step: float = 1 / 60
    max_step: float = 1 / 30
    output_step: float = 1 / 120
    event_tolerance: float = 1e-9
    jacobian: Kind | str = "auto"
    adapt_harmonics: float | None = None


def response_options(**given: Any) -> ResponseOptions:
    """``ResponseOptions`` with the fields given: steps of at most 1/30 of the range, points each 1/120 by default."""
    return ResponseOptions(**given)


def adapted_to(options: ContinuationOptions) -> float | None:
    """The accuracy to which harmonics are adapted; None where all are in use."""
    return options.adapt_harmonics if isinstance(options, ResponseOptions) else None


@dataclass(frozen=True, kw_only=True)
class Departure:
    """A solution inside the range that a branch is taken up from: unknowns (N,), value of the followed quantity,
    tangent (N + 1,), and events of its own."""

    x: Array
    at: float
    direction: Array
    events: tuple[BranchEvent, ...] = ()


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
    largest_of: tuple[str, ...] = ()
    """Outputs of which the largest amplitude is located, and no other peak."""
    options: ContinuationOptions = field(default_factory=ResponseOptions)
    listeners: tuple[Listener, ...] = ()
    guess: Array | None = None
    checkpoints: Sequence[Checkpoint] = ()
    """Of every point that was found already, up to an accepted one: the branch is followed on from there."""
    stability: StabilityWatch | None = None
    """Judges every point, where that is asked for."""
    departure: Departure | None = None
    """Where the branch is taken up inside its range; None: at its start."""
    warnings: Sequence[str] = ()
    """What looks wrong, said to the user and written on the results."""
