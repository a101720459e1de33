"""What Newton and the continuation solve."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from slipstick.solve.linear.jacobian import Jacobian
from slipstick.solve.linear.undefined import UndefinedJacobian
from slipstick.typing import Array


class Evaluation(NamedTuple):
    """Residual (N,), Jacobian and derivative of the residual by the parameter (N,) of a system at one state.

    ``detail`` is handed through untouched: whatever the system wants to find again at a converged point. ``terms``
    gives the sizes (N,) of the largest terms each residual is the sum of, which says what its rounding is; without it
    they are taken from the Jacobian. ``context`` is what the next points of a branch are to be told where this one is
    accepted (None: nothing). ``again`` says with which context a solution found has to be sought once more, of a system
    that makes itself finer where it must; None where it is good as it is.
    """

    residual: Array
    jacobian: Jacobian
    parameter_derivative: Array | None = None
    detail: Any = None
    terms: Callable[[], Array] | None = None
    context: Any = None
    again: Callable[[], Any] | None = None

    @classmethod
    def undefined(cls, size: int) -> Evaluation:
        """What a system of N = ``size`` answers to an iterate with no residual: the iteration takes a shorter step."""
        unknown = np.full(size, np.nan)
        return cls(unknown, UndefinedJacobian(size), unknown)


class System(Protocol):
    """``residual(x, parameter) = 0``, N equations for N unknowns.

    The same arguments give the same answer. A system whose answer depends on the branch it is followed along returns a
    ``context`` with each evaluation and takes that of the point accepted last as a third argument.
    """

    def evaluate(self, x: Array, parameter: float) -> Evaluation:
        """Residual, Jacobian and parameter derivative at ``x`` (N,)."""
        ...
