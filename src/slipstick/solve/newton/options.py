"""How the Newton iteration runs."""

from __future__ import annotations

from dataclasses import dataclass

from slipstick.errors import InputError


@dataclass(frozen=True, kw_only=True)
class NewtonOptions:
    """How the Newton iteration runs.

    Parameters
    ----------
    tolerance
        Largest scaled norm of the Newton correction at a converged point.
    max_iterations
        Largest number of corrections.
    min_damping
        Smallest fraction of a correction tried.
    non_monotone
        How many whole corrections may be taken although no fraction of them helps.
    patience
        How many corrections in a row may fail to be half the smallest before them; None: any number.
    stagnation
        Corrections below this which no longer shrink are rounding: accepted, and marked ``stagnated``.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    tolerance: float = 1e-10
    max_iterations: int = 30
    min_damping: float = 1e-5
    non_monotone: int = 4
    patience: int | None = None
    stagnation: float = 1e-8

    def __post_init__(self) -> None:
        faults = []
        if not 0 < self.tolerance < 1:
            faults.append(f"Newton tolerance: found {self.tolerance}; expected a number between 0 and 1")
        if self.max_iterations < 1:
            faults.append(f"Newton max_iterations: found {self.max_iterations}; expected at least 1")
        if not 0 < self.min_damping <= 1:
            faults.append(f"Newton min_damping: found {self.min_damping}; expected a number in (0, 1]")
        if self.non_monotone < 0:
            faults.append(f"Newton non_monotone: found {self.non_monotone}; expected 0 or more")
        if self.patience is not None and self.patience < 1:
            faults.append(f"Newton patience: found {self.patience}; expected at least 1, or None")
        if not 0 <= self.stagnation < 1:
            faults.append(f"Newton stagnation: found {self.stagnation}; expected a number in [0, 1)")
        if faults:
            raise InputError(faults)
