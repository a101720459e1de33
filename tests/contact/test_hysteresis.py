"""Iwan, Dahl and Bouc-Wen: against closed forms, the friction contact, differences and the equations in time."""

import numpy as np
import pytest
from helpers.bouc_wen import coefficients
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


def loop_of_exponent_one(beta, gamma, a):
    """Largest z in a harmonic motion, and the area of the loop: each branch is an exponential."""
    s, d = beta + gamma, beta - gamma

    def way(z):  # from z to 0 and on to -z
        return (np.log1p(d * z) / d if d else z) - np.log1p(-s * z) / s

    top = brentq(lambda z: way(z) - 2.0 * a, 0.0, min(2.0 * a, (1.0 - 1e-12) / s), xtol=1e-16, rtol=1e-15)
    area = 2.0 * (-top / s - np.log1p(-s * top) / s**2 - (top / d - np.log1p(d * top) / d**2 if d else 0.5 * top**2))
    return top, area


@pytest.mark.parametrize("share", [-1.0 + 1e-3, -0.99, -0.9, 0.5, 1.0])
@pytest.mark.parametrize("a", [0.3, 1.0, 5.0])
def test_power_and_loop_of_exponent_one_up_to_the_edges(share, a):
    """Unloading is steep where loading is not: near gamma = -beta they differ by any factor."""
    law = ss.models.BoucWenContact(kt=2.0, beta=1.0, gamma=share)
    values, motion = parameters(law, 1), cosine(a, 0.0)
    top, area = loop_of_exponent_one(1.0, share, a)
    response = law.respond(motion, values)
    assert 2.0 * np.pi * response.work[0] == pytest.approx(2.0 * area, rel=1e-8)
    assert abs(response.force[0][0, 0]) < 1e-9 * top  # a symmetric loop
    z = law.forces_in_time(motion, values, np.array([0.0, np.pi, 2.0 * np.pi]))[0][0] / 2.0
    np.testing.assert_allclose(z, [top, -top, top], rtol=1e-9)


@pytest.mark.parametrize("n", [1.0, 1.3, 2.0, 5.0])
def test_loops_of_tiny_motions_are_in_the_middle_and_dissipate(n):
    """What the law takes from a spring is ``|z|^n (beta sign(w' z) + gamma)`` of the motion: the area is known."""
    a, beta = 1e-6, 3.0
    law = ss.models.BoucWenContact(kt=1.0, beta=beta, gamma=-2.9, n=n)
    response = law.respond(cosine(a, 0.0), parameters(law, 1))
    assert abs(response.force[0][0, 0]) < 1e-9 * a
    area = 4.0 * beta * a ** (n + 2.0) / (n + 2.0)
    assert 2.0 * np.pi * response.work[0] == pytest.approx(area, rel=1e-6)


@pytest.mark.parametrize("n", [1.0, 1.3, 4.0])
@pytest.mark.parametrize("share", [np.nextafter(-1.0, 0.0), -0.999, 0.0, 1.0])
@pytest.mark.parametrize("size", [1e-9, 1.0, 1e6])
def test_bouc_wen_states_are_periodic_whatever_the_sign_and_the_shift(n, share, size):
    law = ss.models.BoucWenContact(kt=1.0, beta=1.0, gamma=share, n=n)
    motion, values = moving(1, seed=4), parameters(law, 1)
    X = size * motion.Q[0]
    f = law.respond(motion._replace(Q=(X,)), values).force[0]
    scale = np.abs(f).max()
    np.testing.assert_allclose(law.respond(motion._replace(Q=(-X,)), values).force[0], -f, rtol=0, atol=1e-9 * scale)
    angle, turned, back = 1.234 * H.m, X.copy(), f.copy()
    for out, given in ((turned, X), (back, f)):
        out[:, 1::2] = given[:, 1::2] * np.cos(angle) + given[:, 2::2] * np.sin(angle)
        out[:, 2::2] = given[:, 2::2] * np.cos(angle) - given[:, 1::2] * np.sin(angle)
    shifted = law.respond(motion._replace(Q=(turned,)), values).force[0]
    np.testing.assert_allclose(shifted, back, rtol=0, atol=1e-8 * scale)


def a_bouc_wen(seed):
    """Parameters over all that is admissible, with motions from next to none to far beyond the yield."""
    rng = np.random.default_rng(seed)
    beta, n = 10.0 ** rng.uniform(-1, 1), float(rng.choice([1.0, 2.0, 1.0 + 10.0 ** rng.uniform(-2, 1)]))
    share = float(rng.choice([-1.0 + 10.0 ** rng.uniform(-6, 0), rng.uniform(-0.9, 0.99), 1.0]))
    X = beta ** (-1.0 / n) * 10.0 ** rng.uniform(-0.3, 1.3) * rng.normal(size=7) / (1 + np.arange(7))
    v = 0.0 if rng.random() < 0.7 else 0.1 * rng.normal() * np.abs(X[1:]).max()
    return X, v, [beta, beta * share, n]


def answer(X, v, p):
    law = ss.models.BoucWenContact(kt=1.0, beta=p[0], gamma=p[1], n=p[2])
    return law.respond(Motion(Harmonics(range(4)), 1.0, (X[None],), np.array([[v]])), parameters(law, 1))


@pytest.mark.parametrize("seed", [0, pytest.param(range(1, 20), marks=pytest.mark.verify)])
def test_bouc_wen_forces_are_those_of_another_integrator(seed):
    for one in np.atleast_1d(seed):
        X, v, p = a_bouc_wen(one)
        exact, work = coefficients(X, np.arange(1.0, 4.0), v, *p)
        found = answer(X, v, p)
        np.testing.assert_allclose(found.force[0][0], exact, rtol=0, atol=1e-8 * np.abs(exact).max())
        assert found.work[0] == pytest.approx(work, rel=1e-7)


@pytest.mark.parametrize("size", [30.0, 1e3, 1e6])
@pytest.mark.parametrize("n", [1.0, 2.0, 14.0, 16.0, 18.518, 20.0])
def test_bouc_wen_forces_far_beyond_the_yield(n, size):
    """With ``gamma = beta`` it unloads along a line, after which the first step of the loading is far too long."""
    for share in (1.0, -1.0 + 1e-4):
        X, m = size * np.array([0.3, 1.0, 0.3, -0.2, 0.1, 0.0, 0.05]), np.arange(1.0, 4.0)
        exact, work = coefficients(X, m, 0.0, 1.0, share, n)
        for sign in (1.0, -1.0):
            found = answer(sign * X, 0.0, [1.0, share, n])
            np.testing.assert_allclose(sign * found.force[0][0], exact, rtol=0, atol=1e-8 * np.abs(exact).max())
            assert found.work[0] == pytest.approx(work, rel=1e-7)


def test_a_sharper_yield_is_refused():
    for n in (np.nextafter(20.0, 21.0), 40.0, [2.0, 40.0], 0.5):
        with pytest.raises(ss.InputError, match=r"n: found .*; expected a number from 1 to 20"):
            ss.models.BoucWenContact(kt=1.0, beta=1.0, n=n)
    law = ss.models.BoucWenContact(kt=1.0, beta=1.0, n=20.0)
    with pytest.raises(ss.InputError, match="expected a number from 1 to 20"):
        law.changed(n=21.0)


@pytest.mark.verify
@pytest.mark.parametrize("seed", range(4))
def test_bouc_wen_derivatives_are_differences_of_another_integrator(seed):
    X, v, p = a_bouc_wen(seed + 30)
    found, L = answer(X, v, p), X.size
    exact = {c: found.by_motion[0, 0][0, :, c] for c in (0, 1, 4)}
    exact |= {L + i: found.by_parameter(name)[0][0] for i, name in enumerate(("beta", "gamma", "n"))}
    size = np.abs(found.force[0]).max()
    for c, derivative in exact.items():
        room = min(p[0] + p[1], p[0] - p[1])
        at = c - L
        if (at == 1 and room <= 0.0) or (at == 2 and p[2] == 1.0):  # differences leave what is admissible
            continue
        step = 1e-3 * (np.abs(X).max() if at < 0 else (min(p[0], p[0] + p[1]), room, p[2])[at])

        def moved(h, c=c, at=at):
            Y, q = X.copy(), list(p)
            if at < 0:
                Y[c] += h
            else:
                q[at] += h
            return coefficients(Y, np.arange(1.0, 4.0), v, *q)[0]

        near, far = (moved(h) - moved(-h) for h in (step, 2.0 * step))
        difference = (8.0 * near - far) / (12.0 * step)
        scale = 1.0 if at < 0 else size / step * 1e-3
        np.testing.assert_allclose(derivative, difference, rtol=0, atol=3e-6 * scale)


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
