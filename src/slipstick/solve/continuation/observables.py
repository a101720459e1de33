"""What is read off the states of a branch, such as motion far from where the equations are solved."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from slipstick.solve.continuation.hermite_segment import HermiteBasis, HermiteSegment
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.solve.continuation.step import Step


class Observables(Protocol):
    """Knows how states are read, and evaluates many of them in one go."""

    @property
    def any(self) -> bool:
        """Whether anything is read off that is no unknown."""
        ...

    def narrow(self, low: float, high: float) -> Array:
        """Values (n,) of the parameter in between, ascending, near which a reading may have a narrow peak."""
        ...

    def between(self, first: Step, second: Step, states: Array) -> Between:
        """States (n, N + 1) between two solutions, evaluated."""
        ...


class Between(Protocol):
    """Evaluated states between two solutions; all sizes are relative to those of each reading nearby."""

    residuals: Array
    """(n, N)."""

    def changes(self, dx: Array) -> Array:
        """Largest change (n,) of any reading for changes (n, N) of the unknowns."""
        ...

    def bent(self, dx: Array, arc: HermiteSegment, places: HermiteBasis) -> Array:
        """Largest distance (n,) of any reading, at unknowns changed by ``dx``, from the cubic through both ends."""
        ...
