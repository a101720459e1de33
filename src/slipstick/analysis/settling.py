"""Where heated contacts settle when they are let go, the structure answering at once: ``dT/dt = T_0 + R Edot - T``.

Vibration settles within periods, a body within seconds: on its way the motion is the steady one at each temperature.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.residual import Balance, FrequencySystem, Inputs
from slipstick.solve.newton import NewtonOptions, NewtonResult, newton
from slipstick.thermal.model import HeatedForces

Array = NDArray[np.float64]

_LONGEST = 1 / 48
_SMALL = 1e-9
"""Of the tables' range."""
_NEWTON = NewtonOptions(max_iterations=40)


def settled_body(
    balance: Balance, inputs: Inputs, omega: float, x: Array, T: Array
) -> tuple[Array, HeatedForces] | None:
    """Motion (N,) and heat where the body comes to rest from temperatures T (n_contacts,) at the motion x (N,).

    Each step is the rate of the temperatures times their own time constant as the last two rates show it, and no longer
    than a part of the tables. Beyond the tables the parameters are held. None where the motion is lost on the way.
    """
    assert balance.heated is not None
    rate_at = _rates(balance, inputs, omega)
    low, high = balance.heated.limits
    follows = np.isfinite(high - low)  # a temperature without tables does nothing to the motion
    span = np.where(follows, high - low, np.inf)
    at = rate_at(x, T)
    duration = 0.05
    for _ in range(2000):
        if at is None:
            return None
        x, rate = at[0], np.where(follows, at[1], 0.0)
        step = duration * rate
        step /= max(1.0, float(np.max(np.abs(step) / (_LONGEST * span))))
        if np.all(np.abs(rate) <= _SMALL * span):
            break
        after = rate_at(x, T + step)
        while after is None and np.any(np.abs(step) > _SMALL * span):
            step *= 0.25
            after = rate_at(x, T + step)
        if after is None:
            return None
        T, change = T + step, np.where(follows, after[1], 0.0) - rate
        slope = -float(step @ change) / float(step @ step)
        duration = 1.0 / slope if slope > 0 else np.inf
        duration = min(duration, 1e6)
        at = after
    return _exact(balance, inputs, omega, x, T)


def _rates(balance: Balance, inputs: Inputs, omega: float) -> Callable[[Array, Array], tuple[Array, Array] | None]:
    """Motion near one (N,) and rate of the temperatures (n_contacts,), both at given temperatures."""
    heated = balance.heated
    assert heated is not None
    cold = copy(balance)
    cold.heated = None
    given = {name: getattr(inputs, name) for name in ("mu", "kt", "kn")}
    scales = heated.scales(given)

    def at(x: Array, T: Array) -> tuple[Array, Array] | None:
        parameters, _ = heated.parameters(T, given, scales)
        result = _solve(cold, replace(inputs, **parameters), omega, x)
        if not result.converged:
            return None
        power = omega * np.maximum(result.evaluation.detail.forces.work, 0.0)
        rise = heated.resistance * power if heated.resistance.ndim == 1 else heated.resistance @ power
        return result.x, heated.background + rise - T

    return at


def _exact(balance: Balance, inputs: Inputs, omega: float, x: Array, T: Array) -> tuple[Array, HeatedForces] | None:
    """The solution next to a motion and temperatures."""
    near = copy(balance)
    near.temperature = T
    result = _solve(near, inputs, omega, x)
    return (result.x, result.evaluation.detail.heat) if result.converged else None


def _solve(balance: Balance, inputs: Inputs, omega: float, x: Array) -> NewtonResult:
    system = FrequencySystem(balance, inputs)
    scale = float(np.linalg.norm(x)) or 1.0
    return newton(lambda z: system.evaluate(z, omega), x, options=_NEWTON, scale=scale)
