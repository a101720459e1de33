"""What a ``[structure]`` table makes: the structure, and for finite element models what lies behind it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from slipstick.structure.protocol import Structure
    from slipstick.structure.reduction import Reduction

Array = NDArray[np.float64]
Tell = Callable[[str], None]


def silent(_text: str) -> None:
    """A listener that says nothing."""


@dataclass(frozen=True, kw_only=True)
class ContactPoints:
    """Contact points on a surface: dofs "c1x" ... "cNz".

    ``positions``, ``normals`` (outward, unit) are (n, 3), ``areas`` (n,); ``influence`` (n, n) is temperature per
    power, None without conduction.
    """

    positions: Array
    normals: Array
    areas: Array
    influence: Array | None

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.positions)


@dataclass(frozen=True, kw_only=True)
class FullModel:
    """A full finite element model and its reduction.

    ``errors`` compares the reduction with direct solutions of the full model at some frequencies (rad/s).
    """

    n_dofs: int
    solver: str
    modes: int
    reused: bool
    seconds: float
    note: str
    compare: Callable[[], tuple[Reduction, Any, Any]]

    def errors(self, frequencies: Sequence[float]) -> dict[float, float]:
        """Relative error of the receptance between the kept dofs by frequency."""
        from slipstick.structure.reduction import estimate_error

        reduction, K, M = self.compare()
        return estimate_error(reduction, K, M, list(frequencies))


@dataclass(frozen=True, kw_only=True)
class Body:
    """The structure of a case, its contact points and its full model where it has them."""

    structure: Structure
    points: ContactPoints | None = None
    full: FullModel | None = None
