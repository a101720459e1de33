"""Where contact states settle when they are let go, the structure answering at once: ``dz/dt = r(z, P)``.

Vibration settles within periods, a body within seconds: on its way the motion is the steady one at
each value.
"""

from __future__ import annotations

import numpy as np

from slipstick.balance.inputs import Inputs
from slipstick.balance.ports import Balance
from slipstick.balance.residual import Detail
from slipstick.balance.systems import FrequencySystem
from slipstick.solve.newton import NewtonOptions, NewtonResult, newton
from slipstick.typing import Array

_SMALL = 1e-8
"""Of the states' range: a rate at which they are at rest, and the error of the values on the way."""
_LONGEST_TIME = 1e5
"""In time constants of a state without friction."""
_NEWTON = NewtonOptions(max_iterations=40)


class MotionLostError(Exception):
    """No steady motion was found at some values of the states."""


def relaxed(
    balance: Balance, inputs: Inputs, omega: float, x: Array, z: Array, *, reach: float = np.inf
) -> tuple[Array, Detail] | None:
    """Motion (N,) and evaluation where fast contact states come to rest from values z (n_states,) at the motion x (N,).

    Beyond their limits the parameters are held. None where the motion is lost on the way, or no rest is found, or the
    motion at z is further from x than ``reach`` times its size.
    """
    from scipy.integrate import solve_ivp

    rates = SlowRates(balance, inputs, omega, x)
    fast = np.concatenate([np.full(len(state.names), not state.slow) for state in balance.states])
    span = np.concatenate([state.span for state in balance.states])
    moves = fast & np.isfinite(span)
    span = np.where(np.isfinite(span), span, 1.0)

    def rate(t: float, z: Array) -> Array:
        return np.where(moves, rates(z), 0.0)

    def moving(t: float, z: Array) -> float:
        return float(np.max(np.abs(rate(t, z)) / span)) - _SMALL

    moving.terminal, moving.direction = True, -1  # type: ignore[attr-defined]
    low = float(span.min())
    try:
        rates(z)
        if np.linalg.norm(rates.x - x) > reach * np.linalg.norm(x):
            return None
        way = solve_ivp(
            rate, (0.0, _LONGEST_TIME), z, method="LSODA", events=moving, rtol=_SMALL, atol=_SMALL * low, max_step=1e3
        )
    except MotionLostError:
        return None
    if way.status != 1:
        return None
    result = _solve(balance, inputs, omega, rates.x, way.y[:, -1])
    return (result.x, result.evaluation.detail) if result.converged else None


class SlowRates:
    """Rates (n_states,) of contact states held at values (n_states,), at the steady motion there.

    ``x`` is the last motion, from which the next is sought, ``detail`` its evaluation.

    Raises
    ------
    MotionLostError
        Where there is no steady motion near it.
    """

    def __init__(self, balance: Balance, inputs: Inputs, omega: float, x: Array) -> None:
        self._balance, self._inputs, self._omega, self.x = balance.holding(), inputs, omega, x
        self.detail: Detail | None = None

    def __call__(self, z: Array) -> Array:
        """At values (n_states,)."""
        result = _solve(self._balance, self._inputs, self._omega, self.x, z)
        if not result.converged:
            raise MotionLostError
        self.x, detail = result.x, result.evaluation.detail
        self.detail = detail
        return np.concatenate([state.rate.value for state in detail.states])


def _solve(balance: Balance, inputs: Inputs, omega: float, x: Array, z: Array) -> NewtonResult:
    system = FrequencySystem(balance, inputs)
    scale = float(np.linalg.norm(x)) or 1.0
    return newton(lambda y: system.evaluate(y, omega, z), x, options=_NEWTON, scale=scale)
