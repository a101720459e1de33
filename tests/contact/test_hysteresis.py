"""Iwan, Dahl and Bouc-Wen: against closed forms, the friction contact, differences and the equations in time."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import slipstick as ss
from slipstick.contact.law import Motion
from slipstick.trig.harmonics import Harmonics

H = Harmonics(range(6))
LAWS = [
    ss.models.IwanContact(kt=3.0, limit=1.1, chi=-0.4, beta=0.3, sliders=20),
    ss.models.DahlContact(kt=3.0, limit=0.6),
    ss.models.BoucWenContact(kt=3.0, beta=4.0, gamma=2.0, n=1.0, alpha=0.1),
    ss.models.BoucWenContact(kt=3.0, beta=4.0, gamma=-1.5, n=1.7),
]


def moving(n, *, drift=0.0, seed=0):
    rng = np.random.default_rng(seed)
    X = rng.normal(size=(n, H.size)) / (1 + np.arange(H.size))
    return Motion(H, 1.7, (X,), drift * rng.normal(size=(1, n)))


def parameters(law, n):
    return {name: np.full(n, float(value)) for name, value in law.values.items()}


def cosine(a, tau):
    X = np.zeros((1, H.size))
    X[0, :2] = 0.2, a
    return Motion(H, 1.7, (X,), np.zeros((1, 1)))


def test_evenly_spread_sliders_make_masings_loop():
    """W. D. Iwan, J. Appl. Mech. 33 (1966) 893: f = kt x - (kt x)^2 / (4 limit) up to x = 2 limit / kt, doubled."""
    kt, limit, a = 2.0, 1.5, 0.9
    law, n = ss.models.IwanContact(kt=kt, limit=limit, sliders=500), 500
    tau = np.linspace(0.0, 2.0 * np.pi, 65)
    values, motion = parameters(law, 1), cosine(a, 0.0)

    def first(x):
        return kt * x - (kt * x) ** 2 / (4.0 * limit)

    x = a * np.cos(tau)
    down = first(a) - 2.0 * first((a - x) / 2.0)
    up = -first(a) + 2.0 * first((a + x) / 2.0)
    force = law.forces_in_time(motion, values, tau)[0][0]
    np.testing.assert_allclose(force, np.where(tau <= np.pi, down, up), rtol=0, atol=limit / n**2)  # bins: second order
    area = kt**2 * a**3 / (3.0 * limit)  # 8 times the integral of first, less 4 a first(a)
    assert 2.0 * np.pi * law.respond(motion, values).work[0] == pytest.approx(area, rel=2.0 / n**2)


def test_one_slider_is_a_friction_contact():
    friction, law = (
        ss.FrictionContact(kt=3.0, mu=0.5, normal_load=1.6),
        ss.models.IwanContact(kt=3.0, limit=0.8, sliders=1),
    )
    motion = moving(30, drift=0.5)
    both = motion._replace(Q=(*motion.Q, 0.0 * motion.Q[0]), drift=np.concatenate([motion.drift, 0.0 * motion.drift]))
    a, b = friction.respond(both, parameters(friction, 30)), law.respond(motion, parameters(law, 30))
    np.testing.assert_array_equal(b.force[0], a.force[0])
    np.testing.assert_array_equal(b.by_motion[0, 0], a.by_motion[0, 0])
    np.testing.assert_allclose(b.by_parameter("limit")[0], a.by_parameter("mu")[0] / 1.6, atol=1e-13)


def test_dahls_loop_has_exponential_branches():
    kt, limit, a = 100.0, 0.5, 0.02
    law = ss.models.DahlContact(kt=kt, limit=limit)
    values, motion, tau = parameters(law, 1), cosine(a, 0.0), np.linspace(0.0, 2.0 * np.pi, 33)
    x, top = a * np.cos(tau), limit * np.tanh(kt * a / limit)
    down = -limit + (limit + top) * np.exp(-kt * (a - x) / limit)
    up = limit - (limit + top) * np.exp(-kt * (a + x) / limit)
    force = law.forces_in_time(motion, values, tau)[0][0]
    np.testing.assert_allclose(force, np.where(tau <= np.pi, down, up), rtol=0, atol=1e-8 * limit)
    area = 4.0 * limit * (a - limit / kt * np.tanh(kt * a / limit))
    assert 2.0 * np.pi * law.respond(motion, values).work[0] == pytest.approx(area, rel=1e-8)


def test_the_bouc_wen_loop_of_exponent_one_is_known():
    """From z = 0 on with w: dz/dw = 1 - (beta + gamma) z; back from z > 0: dz/dw = 1 + (beta - gamma) z."""
    beta, gamma, a = 4.0, 2.0, 0.3
    law = ss.models.BoucWenContact(kt=1.0, beta=beta, gamma=gamma)
    s, d = beta + gamma, beta - gamma

    # the way back from the largest z to 0, then on to its opposite, is 2 a
    def back(z):
        return np.log1p(d * z) / d

    def on(z):
        return -np.log1p(-s * z) / s

    top = brentq(lambda z: back(z) + on(z) - 2.0 * a, 0.0, (1.0 - 1e-12) / s, xtol=1e-15)
    values, motion = parameters(law, 1), cosine(a, 0.0)
    tau = np.linspace(0.0, np.pi, 17)
    way = a - a * np.cos(tau)
    z = np.where(
        way < back(top), ((1.0 + d * top) * np.exp(-d * way) - 1.0) / d, -(1.0 - np.exp(-s * (way - back(top)))) / s
    )
    np.testing.assert_allclose(law.forces_in_time(motion, values, tau)[0][0], z, rtol=0, atol=1e-8 / s)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: repr(law)[:24])
@pytest.mark.parametrize("drift", [0.0, 0.5])
def test_derivatives_are_those_of_differences(law, drift):
    """In short steps: where a slider begins to slip the force has a corner that differences must not reach over."""
    n, d = 6, 1e-6
    # |z|^(n - 1) of the tangent has a kink at z = 0, which the integration of the derivatives feels unless n = 1
    tolerance = 5e-6 if np.any(law.values.get("n", 1.0) != 1.0) else 1e-7
    motion, values = moving(n, drift=drift, seed=2), parameters(law, n)
    if "alpha" in values:
        motion = motion._replace(drift=motion.drift * (values["alpha"] == 0.0))
    response = law.respond(motion, values)

    def close(exact, at):
        near, far = (at(s).force[0] - at(-s).force[0] for s in (d, 2.0 * d))
        difference = (8.0 * near - far) / (12.0 * d)
        np.testing.assert_allclose(exact, difference, rtol=0, atol=tolerance * (1.0 + np.abs(difference).max()))

    for c in (0, 1, 4, 9):

        def moved(s, c=c):
            X = motion.Q[0].copy()
            X[:, c] += s
            return law.respond(motion._replace(Q=(X,)), values)

        close(response.by_motion[0, 0][:, :, c], moved)
    if np.any(motion.drift):
        close(response.by_drift[0, 0], lambda s: law.respond(motion._replace(drift=motion.drift + s), values))
    for name in law.values:
        exact = response.by_parameter(name)[0]
        if name == "alpha" and np.any(motion.drift):  # any alpha > 0 is refused
            assert np.isnan(exact).all()
        else:
            close(exact, lambda s, name=name: law.respond(motion, {**values, name: values[name] + s}))


@pytest.mark.parametrize("law", LAWS[1:], ids=lambda law: repr(law)[:24])
def test_forces_are_those_of_the_law_in_time(law):
    motion, values = moving(1, seed=5), parameters(law, 1)
    X, omega = motion.Q[0][0], motion.omega
    columns = {name: value[:, None] for name, value in values.items()}

    def told(t, z):
        H_, dH = H.H_minus(np.array([omega * t])), H.H_minus(np.array([omega * t]))
        q, v = H_ @ X, omega * dH @ H.derivative(X)
        return law.rate(q.reshape(1, 1, 1), v.reshape(1, 1, 1), np.reshape(z, (1, 1, 1)), columns)

    period = 2.0 * np.pi / omega
    z = solve_ivp(lambda t, z: told(t, z)[1].ravel(), (0.0, 4 * period), [0.0], rtol=1e-9, atol=1e-11, max_step=0.02)
    times = np.linspace(4.0, 5.0, 12) * period
    last = solve_ivp(
        lambda t, z: told(t, z)[1].ravel(), (4 * period, 5 * period), z.y[:, -1], t_eval=times, rtol=1e-9, atol=1e-11,
        max_step=0.02,
    )  # fmt: skip
    exact = [told(t, y)[0].item() for t, y in zip(times, last.y.T, strict=True)]
    found = law.forces_in_time(motion, values, (omega * times) % (2.0 * np.pi))[0][0]
    np.testing.assert_allclose(found, exact, rtol=0, atol=2e-7)
    tau = 2.0 * np.pi * np.arange(2048) / 2048
    sampled = law.forces_in_time(motion, values, tau)[0] @ H.H_plus(tau) * (2.0 / tau.size)
    np.testing.assert_allclose(law.respond(motion, values).force[0], sampled, rtol=0, atol=2e-5)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: repr(law)[:24])
def test_it_makes_an_equal_one_from_its_arguments_and_refuses_what_it_is_not(law):
    assert type(law)(**law.arguments) == law
    assert law.changed(kt=5.0).values["kt"] == 5.0
    with pytest.raises(ss.InputError, match="kt"):
        law.changed(kt=-1.0)
    with pytest.raises(ss.InputError, match="no parameter"):
        law.changed(mu=0.3)
