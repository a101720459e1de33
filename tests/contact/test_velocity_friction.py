"""Friction that depends on the sliding velocity: against the constant law, closed forms, time and differences."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.contact.law import Motion
from slipstick.contact.velocity_friction import StribeckContact
from slipstick.trig.harmonics import Harmonics

H = Harmonics(range(6))
OMEGA = 1.7
LAWS = [
    {"mu": [(0.0, 0.5), (0.7, 0.3), (2.0, 0.35), (4.0, 0.2)]},
    {"mu_s": 0.5, "mu_d": 0.3, "v_s": 0.8, "viscous": 0.01},
    {"mu_s": 0.5, "mu_d": 0.3, "v_s": 0.8, "form": "gaussian"},
    {"mu_s": 0.5, "mu_d": 0.0, "v_s": 0.8, "form": "hyperbolic"},
]


def moving(n, *, drift, seed=0):
    rng = np.random.default_rng(seed)
    Q = rng.normal(size=(2, n, H.size)) / (1 + np.arange(H.size))
    return Motion(H, OMEGA, (Q[0], Q[1]), np.array([drift * rng.normal(size=n), np.zeros(n)]))


def parameters(law, n):
    return {name: np.full(n, float(value)) for name, value in law.values.items()}


@pytest.mark.parametrize("gap", [-3.0, 0.0])
@pytest.mark.parametrize("drift", [0.0, 1.0])
def test_a_constant_coefficient_is_coulomb_friction(drift, gap):
    n = 300
    coulomb = ss.FrictionContact(kt=3.0, mu=0.4, kn=2.0, gap=gap)
    law = StribeckContact(kt=3.0, mu=[(0.0, 0.4), (1.0, 0.4)], kn=2.0, gap=gap)
    motion = moving(n, drift=drift)
    a, b = coulomb.respond(motion, parameters(coulomb, n)), law.respond(motion, parameters(law, n))
    for exact, found in zip(a.force, b.force, strict=True):
        np.testing.assert_allclose(found, exact, rtol=0, atol=1e-10)
    for key, exact in a.by_motion.items():
        np.testing.assert_allclose(b.by_motion[key], exact, rtol=0, atol=1e-9)
    np.testing.assert_allclose(b.by_drift[0, 0], a.by_drift[0, 0], rtol=0, atol=1e-9)
    for name in ("kt", "kn", "gap"):
        for port, exact in a.by_parameter(name).items():
            np.testing.assert_allclose(b.by_parameter(name).get(port, 0.0), exact, rtol=0, atol=1e-9)
    np.testing.assert_allclose(b.work, a.work, rtol=0, atol=1e-10)
    tau = np.linspace(0.0, 6.2, 23)
    for exact, found in zip(
        coulomb.forces_in_time(motion, parameters(coulomb, n), tau),
        law.forces_in_time(motion, parameters(law, n), tau),
        strict=True,
    ):
        np.testing.assert_allclose(found, exact, rtol=0, atol=1e-9)


@pytest.mark.parametrize("numbers", LAWS)
@pytest.mark.parametrize("drift", [0.0, 1.0])
def test_derivatives_are_those_of_differences(numbers, drift):
    n, d = 12, 1e-6
    law = StribeckContact(kt=3.0, **numbers, kn=2.0, gap=-1.0)
    motion, values = moving(n, drift=drift, seed=1), parameters(law, n)
    response = law.respond(motion, values)

    def differences(at):
        near, far = (([x - y for x, y in zip(at(s).force, at(-s).force, strict=True)]) for s in (d, 2 * d))
        return [(8.0 * a - b) / (12.0 * d) for a, b in zip(near, far, strict=True)]

    def close(exact, difference):
        np.testing.assert_allclose(exact, difference, rtol=1e-7, atol=1e-7 * (1.0 + np.abs(difference).max()))

    for j in (0, 1):
        for c in (0, 3, 8):

            def moved(s, j=j, c=c):
                Q = [q.copy() for q in motion.Q]
                Q[j][:, c] += s
                return law.respond(motion._replace(Q=tuple(Q)), values)

            for i, difference in enumerate(differences(moved)):
                if (i, j) in response.by_motion:
                    close(response.by_motion[i, j][:, :, c], difference)
    close(response.by_omega[0], differences(lambda s: law.respond(motion._replace(omega=OMEGA + s), values))[0])
    if drift:
        way = np.array([[1.0], [0.0]])
        slid = differences(lambda s: law.respond(motion._replace(drift=motion.drift + s * way), values))
        close(response.by_drift[0, 0], slid[0])
    for name in set(law.values) - {"speed1"}:
        changed = differences(lambda s, name=name: law.respond(motion, {**values, name: values[name] + s}))
        for i, slope in response.by_parameter(name).items():
            close(slope, changed[i])


@pytest.mark.parametrize("numbers", LAWS)
def test_a_contact_that_slips_for_ever_follows_its_curve(numbers):
    law = StribeckContact(kt=50.0, **numbers, normal_load=10.0)
    Q = np.zeros((2, 1, H.size))
    Q[0, 0, 1:5] = 0.3, -0.2, 0.1, 0.05
    motion = Motion(H, OMEGA, (Q[0], Q[1]), np.array([[2.0], [0.0]]))
    response = law.respond(motion, parameters(law, 1))
    tau = 2.0 * np.pi * np.arange(4096) / 4096
    speed = OMEGA * (2.0 + H.H_minus(tau) @ H.derivative(Q[0, 0]))
    assert speed.min() > 0
    assert response.detail.intervals() == [[(0.0, 2.0 * np.pi, "slip+")]]
    exact = (2.0 / tau.size) * (10.0 * law.mu(speed)[0]) @ H.H_plus(tau)
    tolerance = 1e-5 if "mu" in numbers else 1e-10  # the sampled corners of a table
    np.testing.assert_allclose(response.force[0][0], exact, rtol=0, atol=tolerance)


def test_states_and_forces_are_those_of_the_law_marched_in_time():
    law = StribeckContact(kt=3.0, mu_s=0.5, mu_d=0.2, v_s=0.8, kn=2.0, gap=-1.0)
    n, steps = 20, 40_000
    motion, values = moving(n, drift=0.0, seed=3), parameters(law, n)
    tau = 2.0 * np.pi * np.arange(steps + 1) / steps
    X, Y = (q @ H.H_minus(tau).T for q in motion.Q)
    rate = OMEGA * H.derivative(motion.Q[0]) @ H.H_minus(tau).T
    limit = law.mu(np.abs(rate).ravel())[0].reshape(rate.shape) * 2.0 * np.maximum(Y + 1.0, 0.0)
    f = limit[:, 0].copy()
    for _ in range(2):
        path = [f]
        for i in range(steps):
            f = np.clip(f + 3.0 * (X[:, i + 1] - X[:, i]), -limit[:, i + 1], limit[:, i + 1])
            path.append(f)
    found, _ = law.forces_in_time(motion, values, tau[::100])
    slipping = ~law.undecided(law.respond(motion, values))
    assert slipping.sum() > 10
    np.testing.assert_allclose(found[slipping], np.array(path)[::100].T[slipping], rtol=0, atol=2e-3)


def test_its_parameters_are_checked_and_kept():
    law = StribeckContact(kt=3.0, mu=[(0.0, 0.5), (1.0, 0.3)], normal_load=4.0)
    assert law.changed(mu2=0.4).values["mu2"] == 0.4
    assert float(law.changed(normal_load=8.0).normal_load) == 8.0
    assert StribeckContact(**law.arguments) == law
    with pytest.raises(ss.InputError, match="never sticks"):
        StribeckContact(kt=3.0, mu_s=0.5, mu_d=0.3, v_s=1.0, form="tanh", normal_load=1.0)
    with pytest.raises(ss.InputError, match="increase"):
        StribeckContact(kt=3.0, mu=[(0.0, 0.5), (0.0, 0.3)], normal_load=4.0)
    with pytest.raises(ss.InputError, match="together with"):
        StribeckContact(kt=3.0, mu=[(0.0, 0.5), (1.0, 0.3)], mu_s=0.3, normal_load=4.0)
    with pytest.raises(ss.InputError, match="mu_d"):
        StribeckContact(kt=3.0, mu_s=0.3, v_s=1.0, normal_load=4.0)
