"""Where heated contacts settle when they are let go, the structure answering at once: ``dT/dt = T_0 + R Edot - T``.

Vibration settles within periods, a body within seconds: on its way the motion is the steady one at each temperature.
"""

from __future__ import annotations

from copy import copy

import numpy as np

from slipstick.balance.inputs import Inputs
from slipstick.balance.ports import Balance
from slipstick.balance.systems import FrequencySystem
from slipstick.solve.newton import NewtonOptions, NewtonResult, newton
from slipstick.thermal.model import Heat
from slipstick.typing import Array

_SMALL = 1e-8
"""Of the tables' range: a rate at which the body is at rest, and the error of its temperatures on the way."""
_LONGEST_TIME = 1e5
"""In time constants of a body without friction."""
_NEWTON = NewtonOptions(max_iterations=40)


class _MotionLostError(Exception):
    """No steady motion was found at some temperatures."""


def settled_body(
    balance: Balance, inputs: Inputs, omega: float, x: Array, T: Array, *, reach: float = np.inf
) -> tuple[Array, Heat] | None:
    """Motion (N,) and heat where the body comes to rest from temperatures T (n_contacts,) at the motion x (N,).

    Beyond the tables the parameters are held. None where the motion is lost on the way, or no rest is found, or the
    motion at T is further from x than ``reach`` times its size.
    """
    from scipy.integrate import solve_ivp

    rates = _Rates(balance, inputs, omega, x)

    def moving(t: float, T: Array) -> float:
        return float(np.max(np.abs(rates(t, T)) / rates.span)) - _SMALL

    moving.terminal, moving.direction = True, -1  # type: ignore[attr-defined]
    low = float(rates.span.min())
    try:
        rates(0.0, T)
        if np.linalg.norm(rates.x - x) > reach * np.linalg.norm(x):
            return None
        way = solve_ivp(
            rates, (0.0, _LONGEST_TIME), T, method="LSODA", events=moving, rtol=_SMALL, atol=_SMALL * low, max_step=1e3
        )
    except _MotionLostError:
        return None
    return _exact(balance, inputs, omega, rates.x, way.y[:, -1]) if way.status == 1 else None


class _Rates:
    """Rate of the temperatures, zero for those that do nothing to the motion; keeps the last motion to start from."""

    def __init__(self, balance: Balance, inputs: Inputs, omega: float, x: Array) -> None:
        heated = balance.heated
        assert heated is not None
        self.heated, self.inputs, self.omega, self.x = heated, inputs, omega, x
        self._given = inputs.batches[heated.batch].values
        self._scales = heated.scales(self._given)
        self._cold = copy(balance)
        self._cold.heated = None
        span = heated.limits[1] - heated.limits[0]
        self._follows = np.isfinite(span)
        self.span = np.where(self._follows, span, 1.0)

    def __call__(self, t: float, T: Array) -> Array:
        parameters, _ = self.heated.parameters(T, self._given, self._scales)
        result = _solve(self._cold, self.inputs.with_batch(self.heated.batch, **parameters), self.omega, self.x)
        if not result.converged:
            raise _MotionLostError
        self.x = result.x
        power = self.omega * np.maximum(result.evaluation.detail.responses[self.heated.batch].work, 0.0)
        R = self.heated.resistance
        rise = R * power if R.ndim == 1 else R @ power
        return np.where(self._follows, self.heated.background + rise - T, 0.0)


def _exact(balance: Balance, inputs: Inputs, omega: float, x: Array, T: Array) -> tuple[Array, Heat] | None:
    """The solution next to a motion and temperatures."""
    result = _solve(balance, inputs, omega, x, T)
    return (result.x, result.evaluation.detail.heat) if result.converged else None


def _solve(balance: Balance, inputs: Inputs, omega: float, x: Array, T: Array | None = None) -> NewtonResult:
    system = FrequencySystem(balance, inputs)
    scale = float(np.linalg.norm(x)) or 1.0
    return newton(lambda z: system.evaluate(z, omega, T), x, options=_NEWTON, scale=scale)
