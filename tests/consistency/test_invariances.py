"""What the contact law promises: shifts in time, mirror images, units, the friction cone, dissipation."""

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from marching import basis, march
from structured import rotation

from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics

common = settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])


@st.composite
def elements(draw):
    """One element; coefficients on a scale of 1, with zeros and equal values not rare."""
    orders = draw(st.sampled_from([[0], [0, 1], [0, 1, 2], [0, 2, 3], [0, 1, 2, 3, 4, 5]]))
    L = 2 * len(orders) - 1
    value = st.one_of(st.sampled_from([0.0, 1.0, -1.0, 0.5]), st.floats(-2, 2).map(lambda a: round(a, 6)))
    X, Y = (np.array(draw(st.lists(value, min_size=L, max_size=L))) for _ in range(2))
    v = draw(st.one_of(st.just(0.0), st.floats(-5, 5).map(lambda a: round(a, 6))))
    positive = st.floats(0.01, 10).map(lambda a: round(a, 6))
    gap = draw(st.floats(-3, 1).map(lambda a: round(a, 6)))
    parameters = {"v": v, "kt": draw(positive), "mu": draw(st.floats(0.05, 1)), "kn": draw(positive), "gap": gap}
    return orders, {"X": X[None], "Y": Y[None], **{name: np.array([a]) for name, a in parameters.items()}}


def scale(state):
    return 1e-9 + float(state["kn"][0] * (np.abs(state["Y"]).sum() + abs(state["gap"][0])))


@common
@given(elements(), st.floats(0, 6.28))
def test_shift_in_time(element, s):
    orders, state = element
    R, h = rotation(orders, s), Harmonics(orders)
    f = element_forces(h, **state)
    g = element_forces(h, **{**state, "X": state["X"] @ R.T, "Y": state["Y"] @ R.T})
    atol = 1e-7 * scale(state)
    np.testing.assert_allclose(g.Fx, f.Fx @ R.T, atol=atol)
    np.testing.assert_allclose(g.Fy, f.Fy @ R.T, atol=atol)
    np.testing.assert_allclose(g.work, f.work, atol=10 * atol * (1 + abs(state["v"][0])))


@common
@given(elements())
def test_mirror_image(element):
    """Everything tangential reversed: the friction force reversed, its tangent the same."""
    orders, state = element
    h = Harmonics(orders)
    f = element_forces(h, **state)
    g = element_forces(h, **{**state, "X": -state["X"], "v": -state["v"]})
    atol = 1e-7 * scale(state)
    np.testing.assert_allclose(g.Fx, -f.Fx, atol=atol)
    np.testing.assert_allclose(g.Fy, f.Fy, atol=atol)
    np.testing.assert_allclose(g.work, f.work, atol=10 * atol * (1 + abs(state["v"][0])))
    np.testing.assert_allclose(g.residual_traction, -f.residual_traction[:, ::-1], atol=atol)


@common
@given(elements(), st.sampled_from([1e-6, 1e-3, 7.0, 1e5]), st.sampled_from([1e-4, 3.0, 1e6]))
def test_units(element, length, force):
    """Lengths and forces in other units: forces scale with the force unit alone."""
    orders, state = element
    h = Harmonics(orders)
    other = {name: value * length for name, value in state.items() if name in ("X", "Y", "v", "gap")}
    other |= {name: state[name] * force / length for name in ("kt", "kn")} | {"mu": state["mu"]}
    f, g = element_forces(h, **state), element_forces(h, **other)
    atol = 1e-7 * scale(state)
    np.testing.assert_allclose(g.Fx / force, f.Fx, atol=atol)
    np.testing.assert_allclose(g.Fy / force, f.Fy, atol=atol)
    np.testing.assert_allclose(g.work / force / length, f.work, atol=10 * atol * (1 + abs(state["v"][0])))


@common
@given(elements())
def test_dissipation_is_never_negative_and_bounded(element):
    """Energy goes in, and no more than the friction limit times the way."""
    orders, state = element
    f = element_forces(Harmonics(orders), **state)
    tolerance = 1e-9 * scale(state) * (1 + np.abs(state["X"]).sum() + abs(state["v"][0]))
    assert f.work[0] >= -tolerance
    H, h = basis(orders, 512), Harmonics(orders)
    between = 0.5 * (np.pi / 512) ** 2 * np.abs(h.derivative(h.derivative(state["Y"]))).sum()  # samples miss the peak
    limit = state["mu"] * state["kn"] * np.maximum(state["Y"] @ H.T - state["gap"] + between, 0).max()
    speed = np.abs(h.derivative(state["X"])).sum() + abs(state["v"][0])
    assert f.work[0] <= limit[0] * speed + tolerance


@common
@given(elements())
def test_intervals_obey_the_law_at_every_instant(element):
    """The force rebuilt from the state sequence stays in the friction cone, is continuous, and is that of the march."""
    orders, state = element
    f = element_forces(Harmonics(orders), **state)
    samples = 4096
    _, _, _, path = march(orders, **state, samples=samples)
    tau = 2 * np.pi * np.arange(samples) / samples
    rebuilt = rebuild(orders, state, f, tau)
    H = basis(orders, samples)
    limit = (state["mu"] * state["kn"] * np.maximum(state["Y"] @ H.T - state["gap"], 0))[0]
    size = scale(state) + float(state["kt"][0] * np.abs(state["X"]).sum())
    assert np.all(np.abs(rebuilt) <= limit + 1e-6 * size)
    np.testing.assert_allclose(rebuilt, path[0], atol=2e-4 * size)


def rebuild(orders, state, f, tau):
    """f_x over time from the state sequence alone, by the law of each state."""
    h = Harmonics(orders)
    X, Y, v, kt, mu, kn, gap = (state[name][0] for name in ("X", "Y", "v", "kt", "mu", "kn", "gap"))

    def limit(t):
        return mu * kn * np.maximum(h.H_minus(t) @ Y - gap, 0)

    def spring(t):
        return kt * (h.H_minus(t) @ X + v * t)

    out = np.zeros_like(tau)
    before = f.states[0][-1][2]
    for a, b, name in f.states[0]:
        at = tau + 2 * np.pi * np.ceil((a - tau) / (2 * np.pi))
        inside = at <= b + 1e-12  # ends belong to both sides: the force is continuous, the seam is rounded
        if name.startswith("slip"):
            out[inside] = (1 if name == "slip+" else -1) * limit(at[inside])
        elif name == "stick":
            start = {"separation": 0.0, "slip+": limit(a), "slip-": -limit(a)}.get(before)
            if len(f.states[0]) == 1:
                mean = f.Fx[0, 0] - kt * X[0]
                out[inside] = mean + kt * (h.H_minus(at[inside]) @ X)
            else:
                out[inside] = start + spring(at[inside]) - spring(a)
        before = name
    return out
