"""The balance with k further unknowns and equations: peaks, limit cycles, free vibration in a mode.

``R(X, v, s) = 0`` and ``g(X, v, s) = 0`` for motion ``X`` (N,) and further unknowns ``v`` (k,), such as the frequency.
An analysis writes ``state``; the system of equations and how its solutions move with parameters [THEORY.md (15.7)]
follow from that.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from slipstick.analysis.sensitivity.linearization import Linearization, Move
from slipstick.balance.evaluation import terms
from slipstick.solve.linear.block_bordered import BlockBordered
from slipstick.solve.linear.iterative import IterativeJacobian
from slipstick.solve.linear.jacobian import Eliminated, Jacobian, Scaled
from slipstick.solve.newton import Evaluation
from slipstick.typing import Array


def extended(jacobian: Jacobian, sizes: Array, columns: Array, rows: Array) -> Jacobian:
    """``S^-1 J S`` with further ``columns`` (N, k) and then further ``rows`` (k, N + k), ``S`` being ``sizes`` (N,)."""
    if isinstance(jacobian, IterativeJacobian):
        return BlockBordered(jacobian, sizes, columns, rows)
    return Eliminated(Scaled(jacobian, sizes), columns, rows)


class Bordered(NamedTuple):
    """The balance linearised at a state, with further equations.

    Attributes
    ----------
    here
        The balance alone.
    jacobian
        Of all equations by all unknowns, (N + k, N + k).
    values, sizes
        The further equations (k,), and the sizes of the terms that they are sums of.
    along
        Derivatives (k,) of the further equations along a direction, at fixed unknowns.
    by_parameter
        Derivative (N + k,) of all equations by what the branch follows; None where it follows nothing.
    detail, context
        As of ``Evaluation``.
    units
        What unknowns and equations of the balance are divided by, (N,) or 1.
    """

    here: Linearization
    jacobian: Jacobian
    values: Array
    sizes: Array
    along: Callable[[Move], Array]
    by_parameter: Array | None = None
    detail: Any = None
    context: Array | None = None
    units: Array | float = 1.0

    def slopes(self, directions: Sequence[Move]) -> Array:
        """Derivatives (N + k, n) of the unknowns of the solution along directions."""
        still = np.zeros_like(self.here.x)
        moved = [np.append(self.here.change(still, way)[0] / self.units, self.along(way)) for way in directions]
        return -np.column_stack([self.jacobian.solve(column) for column in moved])


class Augmented(ABC):
    """A system of equations of the balance with further unknowns."""

    @abstractmethod
    def state(self, y: Array, parameter: float, context: Array | None = None) -> Bordered | None:
        """The equations linearised at unknowns ``y`` (N + k,); None where they cannot be evaluated."""

    def evaluate(self, y: Array, parameter: float, context: Array | None = None) -> Evaluation:
        """Residual, Jacobian and derivative by the parameter; undefined where they cannot be evaluated."""
        at = self.state(y, parameter, context)
        if at is None:
            return Evaluation.undefined(y.size)
        here = at.here
        return Evaluation(
            np.append(here.at.residual / at.units, at.values), at.jacobian, at.by_parameter, at.detail,
            lambda: np.append(terms(here.balance, here.x, here.at) / at.units, at.sizes), at.context,
        )  # fmt: skip

    def moved(self, at: Bordered, dy: Array, direction: Move) -> tuple[Array, Move]:
        """Change of the motion (N,) and of other arguments, for a change (N + k,) of the unknowns along a direction.

        The last unknown is the frequency.
        """
        return at.units * dy[: at.here.x.size], direction._replace(omega=float(dy[-1]))
