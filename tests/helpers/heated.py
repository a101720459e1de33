"""Three contacts heated by their own friction, at random motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from slipstick.contact.friction import FrictionContact
from slipstick.contact.law import Motion
from slipstick.state.thermal.friction_curve import FrictionCurve
from slipstick.state.thermal.model import Heat, HeatedContacts, ThermalModel
from slipstick.trig.harmonics import Harmonics

Array = np.ndarray


H = Harmonics(range(4))


NAMES = ("a", "b", "c")


N = len(NAMES)


FALLING = FrictionCurve(
    temperature=[20, 200, 400, 800, 3000],
    mu=[0.50, 0.45, 0.38, 0.30, 0.2],
    kt=[120.0, 110.0, 90.0, 60.0, 50.0],
    kn=[90.0, 88.0, 80.0, 75.0, 60.0],
    interpolation="pchip",
)


MU, KT, KN = (float(FALLING.at(25.0)[name].value) for name in ("mu", "kt", "kn"))


INFLUENCE = np.array([[0.8, 0.3, 0.1], [0.3, 0.9, 0.2], [0.1, 0.2, 0.7]])


def model(resistance: Any = INFLUENCE) -> HeatedContacts:
    return ThermalModel(curve=FALLING, background=25.0, resistance=resistance).elements(NAMES)


def state(seed: int) -> dict[str, Any]:
    """A random motion with some stick, slip and separation, heating by some tens to hundreds of degrees.

    ``swept`` is the velocity for each rad/s of the frequency.
    """
    rng = np.random.default_rng(seed)
    W, Y = rng.normal(0, 1, (2, N, H.size)) * np.repeat([1.0, 1.0, 0.5, 0.25], [1, 2, 2, 2])
    return {
        "W": W, "Y": 0.5 * Y, "omega": 1.7, "velocity": rng.choice([0.0, 1.0, -3.0], N) + 0.3 * rng.normal(size=N),
        "swept": np.linspace(0.3, -0.3, N),
        "kt": np.full(N, KT), "mu": np.full(N, MU), "kn": np.full(N, KN), "gap": rng.normal(-0.5, 0.3, N),
    }  # fmt: skip


LAW = FrictionContact(kt=KT, mu=MU, kn=KN, gap=-0.5)


def inputs(given: dict[str, Any]) -> tuple[Motion, dict[str, Array]]:
    """Motion and parameters of a state."""
    swept = np.array([given["swept"], np.zeros(N)])
    drift = np.array([given["velocity"], np.zeros(N)]) / given["omega"] + swept
    values = {name: given[name] for name in ("kt", "mu", "kn", "gap")}
    return Motion(H, given["omega"], (given["W"], given["Y"]), drift, swept), values


def forces(heated: HeatedContacts, given: dict[str, Any], start: Array | None = None) -> Heat:
    return heated.settled(LAW, *inputs(given), start)


def coupled(at: Heat, dpower: Array) -> list[Array]:
    """What heat adds to ``dF_i/dq_f`` at element e, (n, L, n, L) for each port, for own coordinates q_f."""
    by_q = at.gain[:, :, None] * dpower[None]
    return [at.force_by_value[i][:, :, None, None] * by_q[:, None] for i in (0, 1)]


def common(at: Heat, dpower: Array) -> Array:
    """What heat adds to the derivative of the tangential force by one parameter common to all."""
    return at.force_by_value[0] * (at.gain @ dpower)[:, None]


def central(function: Callable[[float], Array], h: float) -> Array:
    """Fourth-order central difference."""
    return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h)


def moved(given: dict[str, Any], name: str, direction: Any, by: float) -> dict[str, Any]:
    return {**given, name: given[name] + by * direction}


def assert_difference(total: Array, function: Callable[[float], Array]) -> None:
    """Against the finer of two steps; states may change inside a step, where the difference is first order only."""
    scale = np.abs(total).max() + 1.0
    errors = [np.abs(central(function, h) - total).max() / scale for h in (1e-4, 1e-5, 1e-6)]
    assert min(errors) < 3e-6, errors
