"""One contact element at random motion, in the interpreted kernel."""

from __future__ import annotations

from typing import Any

import numpy as np

from helpers.interpreted import interpreted
from slipstick.trig.harmonics import Harmonics

H = Harmonics(range(5))
SEEDS = range(12)
batch, basis, critical, element, tuples = (
    interpreted(name)
    for name in (
        "contact.kernel.batch", "trig.basis", "contact.kernel.critical_times", "contact.kernel.element",
        "contact.kernel.tuples",
    )
)  # fmt: skip
GRID = basis.grid(H)


def given(seed: int, **change: float) -> Any:
    """Motion that sticks, slips and separates, some with and some without rubbing velocity."""
    rng = np.random.default_rng(seed)
    X, Y = rng.normal(size=(2, H.size)) / np.repeat([1.0, 1, 2, 3, 4], [1, 2, 2, 2, 2])
    par = {
        "v": rng.choice([0.0, 0.3, -2.0]),
        "kt": rng.uniform(0.3, 2),
        "mu": 0.4,
        "kn": 1.5,
        "gap": -rng.uniform(0, 2),
    }
    return tuples.ElementInputs(X, 0.5 * Y, np.array(list((par | change).values())))


def evaluated(inputs: Any) -> tuple[Any, Any, int]:
    """Outputs, workspace and number of intervals."""
    k = batch.workspace(GRID)
    out = tuples.ElementOutputs(np.empty((7, H.size)), np.empty((3, H.size, H.size)), np.empty(6))
    return out, k, element.evaluate(inputs, GRID, k, out)


def motion(inputs: Any, t: Any) -> tuple[Any, Any]:
    """Tangential motion with the rubbing, without its mean, and penetration, at times of any shape."""
    X, Y = inputs.X.copy(), inputs.Y.copy()
    X[0], Y[0] = 0.0, Y[0] - inputs.parameters[tuples.P_GAP]
    return inputs.parameters[tuples.P_V] * t + H.H_minus(t) @ X, H.H_minus(t) @ Y


def marched(inputs: Any, steps: int = 40_000, periods: int = 3) -> tuple[Any, Any]:
    """Times of one period and the friction force there, by small steps of the law itself, after some periods."""
    _, kt, mu, kn, _ = inputs.parameters
    t = np.linspace(0.0, 2 * np.pi, steps + 1)
    w, y = motion(inputs, t)
    limit = (mu * kn * np.maximum(y, 0.0)).tolist()
    pull = (kt * np.diff(w)).tolist()
    f, found = 0.0, [0.0] * (steps + 1)
    for _ in range(periods):
        found[0] = f
        for i in range(steps):
            f = min(max(f + pull[i], -limit[i + 1]), limit[i + 1])
            found[i + 1] = f
    return t, np.array(found)
