"""Derivatives of the power, and of forces whose parameters follow it, with the real element."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.heated import (
    INFLUENCE,
    LAW,
    Array,
    H,
    N,
    assert_difference,
    common,
    coupled,
    forces,
    inputs,
    model,
    moved,
    state,
)

from slipstick.contact.power import Power


@pytest.mark.parametrize("seed", range(12))
def test_power_derivatives(seed: int) -> None:
    """Each by central differences of the power at fixed parameters."""
    given = state(seed)

    def power(change: dict[str, Any]) -> Array:
        motion, values = inputs(change)
        return change["omega"] * LAW.respond(motion, values).work

    motion, values = inputs(given)
    found = Power(LAW, motion, LAW.respond(motion, values))
    np.testing.assert_allclose(found.value, power(given), rtol=1e-14)
    by = {"omega": found.omega, "velocity": found.by_velocity[0]}
    by |= {name: found.by_parameter(name) for name in ("mu", "kt", "kn", "gap")}
    for name, exact in by.items():
        assert_difference(exact, lambda h, name=name: power(moved(given, name, 1.0, h)))
    for name, exact in (("W", found.by_motion[0]), ("Y", found.by_motion[1])):
        for k in range(H.size):
            direction = np.eye(H.size)[k]
            assert_difference(exact[:, k], lambda h, n=name, d=direction: power(moved(given, n, d, h)))


@pytest.mark.parametrize("resistance", [INFLUENCE, INFLUENCE.diagonal()], ids=["coupled", "element-wise"])
@pytest.mark.parametrize("seed", [0, 1, 2, *(pytest.param(seed, marks=pytest.mark.verify) for seed in range(3, 8))])
def test_total_tangent(seed: int, resistance: Array) -> None:
    """Total derivatives by every element's X, Y and by omega, velocity, gap: temperature moves along."""
    heated, given = model(resistance), state(seed)
    at = forces(heated, given)
    assert at.equilibrium.converged
    assert at.equilibrium.problem() is None
    T = at.values
    assert T.max() > 30.0
    own_forces = at.response.detail
    for name, own_x, own_y, power in (
        ("W", own_forces.dFx_dX, np.zeros_like(own_forces.dFx_dX), at.power.by_motion[0]),
        ("Y", own_forces.dFx_dY, own_forces.dFy_dY, at.power.by_motion[1]),
    ):
        by_x, by_y = coupled(at, power)
        for e in range(N):
            by_x[e, :, e] += own_x[e]
            by_y[e, :, e] += own_y[e]
        for f in range(N):
            for k in (0, 1, 4):
                direction = np.zeros((N, H.size))
                direction[f, k] = 1.0

                def both(h: float, name: str = name, direction: Array = direction) -> Array:
                    got = forces(heated, moved(given, name, direction, h), start=T)
                    return np.stack(got.response.force)

                assert_difference(np.stack([by_x[:, :, f, k], by_y[:, :, f, k]]), both)
    own = {
        "omega": (own_forces.dFx_dv * (-given["velocity"] / given["omega"] ** 2)[:, None], at.power.omega),
        "velocity": (own_forces.dFx_dv / given["omega"], at.power.by_velocity[0]),
        "gap": (own_forces.dFx_dgap, at.power.by_parameter("gap")),
    }
    for name, (own_x, power) in own.items():
        assert_difference(
            own_x + common(at, power),
            lambda h, name=name: forces(heated, moved(given, name, 1.0, h), start=T).response.force[0],
        )


def test_frozen_parameters_would_be_wrong() -> None:
    """What heat adds to the tangent is as large as the tangent itself somewhere."""
    ratios = []
    for seed in range(12):
        at = forces(model(4 * INFLUENCE), state(seed))
        added, _ = coupled(at, at.power.by_motion[0])
        ratios.append(np.abs(added).max() / np.abs(at.response.by_motion[0, 0]).max())
    assert max(ratios) > 0.3
