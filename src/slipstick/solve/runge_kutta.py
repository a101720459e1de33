"""Single steps of Runge-Kutta methods for ``dz/dt = f(z)``: explicit ones, and a linearly implicit one.

A right-hand side may have no value (None), as where a solution that it depends on has vanished; nor has the step then.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np

from slipstick.typing import Array

V = TypeVar("V")
"""Further result of an evaluation, returned with the end of a step."""

RightHandSide = Callable[[Array, float], tuple[Array, V] | None]
"""Rate (n,) and a further result, from a state (n,) and its part of the step."""


class Method(NamedTuple):
    """An explicit method: coefficients ``a`` of the stages, weights ``b``, and weights of the error estimate."""

    order: int
    a: tuple[tuple[float, ...], ...]
    b: tuple[float, ...]
    error: tuple[float, ...] = ()
    """Weights of the estimate; the last is of the rate at the end of the step."""


EULER = Method(1, ((),), (1.0,))
MIDPOINT = Method(2, ((), (0.5,)), (0.0, 1.0))
RK4 = Method(4, ((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6))
DORMAND_PRINCE = Method(
    5,
    (
        (),
        (1 / 5,),
        (3 / 40, 9 / 40),
        (44 / 45, -56 / 15, 32 / 9),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    ),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40),
)
"""J. R. Dormand, P. J. Prince (1980), J. Comput. Appl. Math. 6:19: order 5 with an estimate of order 4."""


class StepEnd(NamedTuple):
    """End of a step."""

    state: Array
    rate: Array
    besides: object
    error: Array
    """Estimate of the error of the state; zero where the method has none."""


def explicit_step(f: RightHandSide[V], z: Array, rate: Array, h: float, method: Method) -> StepEnd | None:
    """One step of length ``h`` from a state with its rate; None where a stage has no value.

    >>> end = explicit_step(lambda z, part: (-z, None), np.ones(1), -np.ones(1), 0.1, RK4)
    >>> round(float(end.state[0]), 7)
    0.9048375
    """
    rates = [rate]
    for weights in method.a[1:]:
        stage = f(z + h * _sum(weights, rates), sum(weights))
        if stage is None:
            return None
        rates.append(stage[0])
    state = z + h * _sum(method.b, rates)
    end = f(state, 1.0)
    if end is None:
        return None
    error = h * _sum(method.error, [*rates, end[0]]) if method.error else np.zeros_like(z)
    return StepEnd(state, end[0], end[1], error)


def _sum(weights: tuple[float, ...], rates: list[Array]) -> Array:
    total = np.zeros_like(rates[0])
    for weight, rate in zip(weights, rates, strict=False):
        if weight:
            total += weight * rate
    return total


# Coefficients of RODAS in the transformed form of Hairer and Wanner, which needs no products with the matrix.
_GAMMA = 0.25
_A = (
    (),
    (1.544,),
    (0.9466785280815826, 0.2557011698983284),
    (3.314825187068521, 2.896124015972201, 0.9986419139977817),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0),
)
_C = (
    (),
    (-5.6688,),
    (-2.430093356833875, -0.2063599157091915),
    (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
    (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
    (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
)
_NODES = (0.0, 0.386, 0.21, 0.63, 1.0, 1.0)
ROSENBROCK_ORDER = 4


def rosenbrock_step(f: RightHandSide[V], z: Array, rate: Array, h: float, slopes: Array) -> StepEnd | None:
    """One step of RODAS, L-stable: order 4 with an estimate of order 3, for exact ``slopes`` df/dz.

    E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section VI.4.

    >>> end = rosenbrock_step(lambda z, part: (-1e6 * z, None), np.ones(1), -1e6 * np.ones(1), 1.0, -1e6 * np.eye(1))
    >>> abs(float(end.state[0])) < 1e-5
    True
    """
    matrix = np.eye(z.size) / (h * _GAMMA) - slopes
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return None
    moves = list[Array]()
    for a, c, node in zip(_A, _C, _NODES, strict=True):
        if moves:
            stage = f(z + _sum(a, moves), node)
            if stage is None:
                return None
            rate = stage[0] + _sum(c, moves) / h
        moves.append(inverse @ rate)
    state = z + _sum(_A[-1], moves) + moves[-1]
    end = f(state, 1.0)
    return None if end is None else StepEnd(state, end[0], end[1], moves[-1])
