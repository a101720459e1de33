"""Contacts whose tangential spring could build up far more than the friction limit: kt |x| / (mu N) of 1e4 to 1e16."""

import numpy as np
import pytest
from marching import random_states
from structured import load_scale, shifted, structured_states

from slipstick.contact import forces
from slipstick.contact.forces import element_forces
from slipstick.contact.kernel.steep_sticks import STEEP
from slipstick.errors import SlipstickError
from slipstick.trig import basis
from slipstick.trig.harmonics import Harmonics
from slipstick.verify import closed_forms as cf

H = Harmonics(range(4))
LIMIT = 30.0


def sine(ratio, v):
    """x = sin tau under a constant load; ``ratio`` is kt A / (mu N)."""
    X, one = np.zeros((1, H.size)), np.ones(1)
    X[0, 2] = 1.0
    return {"X": X, "Y": 0 * X, "v": v * one, "kt": ratio * LIMIT * one, "mu": 0.3 * one, "kn": one, "gap": -100 * one}


@pytest.mark.parametrize("ratio", 10.0 ** np.arange(1, 17, 3))
def test_masing_loop_at_every_ratio(ratio):
    """CF1, and the dissipation of a rigid slider; the closed form of the tangent force is a small difference itself."""
    f = element_forces(H, **sine(ratio, 0.0))
    exact = cf.masing(1.0, ratio * LIMIT, LIMIT)
    assert 2 * np.pi * f.work[0] == pytest.approx(exact.energy, rel=1e-12)
    assert f.Fx[0, 0] == pytest.approx(0.0, abs=1e-13 * LIMIT)
    theta = np.arccos(1 - 2 / ratio) if ratio < 1e6 else 2 * ratio**-0.5 * (1 + 1 / (6 * ratio))
    assert f.stick_fraction[0] == pytest.approx(theta / np.pi, rel=1e-6)
    h = 1e-4
    low, high = (element_forces(H, **{**sine(ratio, 0.0), "X": (1 + s * h) * sine(ratio, 0.0)["X"]}) for s in (-1, 1))
    np.testing.assert_allclose(f.dFx_dX[0, :, 2], (high.Fx - low.Fx)[0] / (2 * h), atol=1e-5 * LIMIT)


@pytest.mark.parametrize("v", [0.3, -0.7])
def test_rigid_coulomb_is_the_limit_to_rounding(v):
    """CF2: the distance falls with 1/kt down to the last digit, through the ratio where the integration changes."""
    ratios = 10.0 ** np.arange(2, 17)
    exact = cf.rigid_coulomb(1.0, v, LIMIT)[0]
    error = np.array([abs(element_forces(H, **sine(r, v)).Fx[0, 0] - exact) for r in ratios]) / LIMIT
    np.testing.assert_allclose(error, error[3] * ratios[3] / ratios, rtol=0.2, atol=1e-14)


@pytest.mark.parametrize("orders", [[0, 1, 2], [0, 1, 3, 7], list(range(11))], ids=str)
@pytest.mark.parametrize("ratio", [1e5, 1e10, 1e16])
def test_within_the_friction_limit_and_shift_invariant(orders, ratio):
    h, rng = Harmonics(orders), np.random.default_rng(1)
    for make in (random_states, lambda rng, n, orders: structured_states(rng, n, orders)):
        state = make(rng, 100, orders)
        state["kt"] = state["kt"] * ratio
        state["X"][:, 0] = 1e12
        f = element_forces(h, **state)
        scale = load_scale(state)
        assert np.all(np.abs(f.Fx[:, 0]) <= state["mu"] * f.Fy[:, 0] + 1e-14 * scale)
        assert np.all(np.hypot(f.Fx[:, 1], f.Fx[:, 2]) <= 2 * state["mu"] * f.Fy[:, 0] + 1e-14 * scale)
        speed = np.abs(h.derivative(state["X"])).sum(axis=1) + np.abs(state["v"])
        assert np.all(f.work >= -1e-13 * scale * speed)
        assert np.all(np.isfinite(f.dFx_dX))
        if make is random_states:
            moved, R = shifted(orders, state, rng.uniform(0, 6.28, 100))
            g = element_forces(h, **moved)
            assert (np.abs(g.Fx - np.einsum("eij,ej->ei", R, f.Fx)).max(axis=1) / scale).max() < 1e-10


@pytest.mark.parametrize("orders", [[0, 1], [0, 1, 2, 3], [0, 1, 3, 7]], ids=str)
def test_both_integrations_agree_where_they_meet(orders):
    """Just below and just above the ratio: the forces and all derivatives differ by the change of kt alone."""
    h = Harmonics(orders)
    state = random_states(np.random.default_rng(2), 50, orders)
    state["Y"][:, 1:], state["gap"] = 0.0, state["Y"][:, 0] - 1.0
    m = np.asarray(orders[1:])
    rate = (m * np.hypot(state["X"][:, 1::2], state["X"][:, 2::2])).sum(axis=1) + np.abs(state["v"])
    kt = STEEP * state["mu"] * state["kn"] / rate
    f, g = (element_forces(h, **{**state, "kt": kt * (1 + s * 1e-9)}) for s in (-1, 1))
    for name in ("Fx", "dFx_dX", "dFx_dY", "dFx_dv", "dFx_dmu", "dFx_dkt", "dFx_dkn", "work", "stick_fraction"):
        a, b = (getattr(x, name).reshape(50, -1) for x in (f, g))
        assert (np.abs(a - b).max(axis=1) <= 1e-7 * np.abs(a).max(axis=1) + 1e-9 * load_scale(state)).all(), name


def test_too_many_critical_times_are_an_error(monkeypatch):
    """They cannot be; should they, nothing is cut short."""
    kernel, short = forces._kernel(), basis.grid(Harmonics([0, 6]))._replace(top=2)
    monkeypatch.setattr(forces, "_kernel", lambda: kernel._replace(grid=lambda h: short))
    X, one = np.array([[0.0, 1.0, 0.0]]), np.ones(1)
    with pytest.raises(SlipstickError, match=r"contact element 0: found more roots than the harmonics \[0, 6\]"):
        element_forces(Harmonics([0, 6]), X=X, Y=0 * X, v=0 * one, kt=one, mu=one, kn=one, gap=-0.1 * one)
