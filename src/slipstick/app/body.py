"""What a ``[structure]`` table makes: the structure, and for finite element models what lies behind it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from slipstick.structure.protocol import Structure
    from slipstick.structure.reduction import Reduction

Array = NDArray[np.float64]
Tell = Callable[[str], None]


Comparison = tuple["Reduction", Any, Any]
"""A reduction and the full stiffness and mass."""


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

    ``comparison`` gives the reduction with the full K, M; ``error`` compares it with a direct solution.
    """

    n_dofs: int
    solver: str
    modes: int
    reused: bool
    seconds: float
    note: str
    comparison: Callable[[], Comparison]

    def error(self, compared: Comparison, omega: float) -> float:
        """Relative error of the receptance between the kept dofs at a frequency, rad/s; one direct solution."""
        from slipstick.structure.reduction import estimate_error

        reduction, K, M = compared
        return estimate_error(reduction, K, M, [omega])[omega]

    def modes_below(self, omega: float) -> int | None:
        """How many modes of the full model lie below a frequency, rad/s; one factorisation."""
        from slipstick.structure.reduction_compute import modes_below

        _, K, M = self.comparison()
        return modes_below(K, M, omega)


@dataclass(frozen=True, kw_only=True)
class Body:
    """The structure of a case, its contact points and its full model where it has them.

    ``force``: a reduction that is too coarse is taken all the same. ``notes`` and ``warnings`` are those of the
    imported model: what was left out; what is approximated or looks wrong.
    """

    structure: Structure
    points: ContactPoints | None = None
    full: FullModel | None = None
    force: bool = False
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
