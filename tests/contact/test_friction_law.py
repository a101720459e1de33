"""The friction element as a law on ports: derivatives by every name, linear states against the element itself."""

import numpy as np
import pytest

from slipstick.contact.friction import FrictionContact
from slipstick.contact.friction_law import is_friction
from slipstick.contact.law import Law, Motion
from slipstick.contact.sampled import SampledLaw
from slipstick.trig.harmonics import Harmonics

H = Harmonics(range(4))
LAW = FrictionContact(kt=2.0, mu=0.4, kn=3.0, gap=-0.5)


def random_state(n=5, seed=1):
    rng = np.random.default_rng(seed)
    Q = tuple(rng.normal(size=(n, H.size)) for _ in range(2))
    values = {"kt": rng.uniform(1, 3, n), "mu": rng.uniform(0.2, 0.5, n), "kn": rng.uniform(1, 3, n)}
    return Motion(H, 1.3, Q, np.array([rng.normal(size=n), np.zeros(n)])), values | {"gap": rng.normal(-0.5, 0.2, n)}


def difference(function, step=1e-6):
    return (function(step) - function(-step)) / (2 * step)


def test_it_is_a_law():
    assert isinstance(LAW, Law)
    assert LAW.changed(normal_load=6.0).gap == -2.0
    assert LAW.changed(mu=0.1).values == {"kt": 2.0, "mu": 0.1, "kn": 3.0, "gap": -0.5}


@pytest.mark.parametrize("name", ["kt", "mu", "kn", "gap"])
def test_derivatives_by_parameters(name):
    motion, values = random_state()
    exact = LAW.respond(motion, values).by_parameter(name)
    for port in (0, 1):
        found = difference(lambda h, port=port: LAW.respond(motion, values | {name: values[name] + h}).force[port])
        np.testing.assert_allclose(exact.get(port, 0.0 * found), found, atol=2e-7)


def test_derivatives_by_motion_and_drift():
    motion, values = random_state()
    response = LAW.respond(motion, values)
    rng = np.random.default_rng(5)
    for j in (0, 1):
        way = rng.normal(size=motion.Q[j].shape)

        def moved(h, j=j, way=way):
            Q = tuple(q + h * way if i == j else q for i, q in enumerate(motion.Q))
            return LAW.respond(motion._replace(Q=Q), values).force

        for i in (0, 1):
            found = difference(lambda h, i=i, moved=moved: moved(h)[i])
            exact = response.by_motion.get((i, j))
            np.testing.assert_allclose(0.0 if exact is None else np.einsum("nkl,nl->nk", exact, way), found, atol=1e-6)
    found = difference(
        lambda h: LAW.respond(motion._replace(drift=motion.drift + np.array([[h], [0.0]])), values).force[0]
    )
    np.testing.assert_allclose(response.by_drift[0, 0], found, atol=1e-6)


def test_linear_states_are_the_element_where_it_does_nothing_else():
    """Stuck: small motion at large load. Sliding: fast rubbing. Free: a wide gap."""
    motion, values = random_state()
    n = len(values["kt"])
    small = motion._replace(Q=tuple(1e-3 * q for q in motion.Q), drift=np.zeros((2, n)))
    fast = small._replace(drift=np.array([np.where(np.arange(n) % 2, 50.0, -50.0), np.zeros(n)]))
    for state, at, gap in (("stuck", small, -5.0), ("sliding", fast, -5.0), ("free", small, 5.0)):
        own = values | {"gap": np.full(n, gap)}
        linear = LAW.linear(state, own, at.drift)
        response = LAW.respond(at, own)
        for i in (0, 1):
            expected = np.zeros((n, H.size))
            for (row, j), stiffness in linear.stiffness.items():
                if row == i:
                    expected += stiffness[:, None] * (
                        at.Q[j] - (at.Q[j][:, :1] * (np.arange(H.size) == 0)) * (i == j == 0)
                    )
            if i in linear.constant:
                expected[:, 0] += linear.constant[i]
            np.testing.assert_allclose(response.force[i][:, 1:], expected[:, 1:], atol=1e-12)
            if (i, state) != (0, "stuck"):  # there the mean may be anything within the friction limit
                np.testing.assert_allclose(response.force[i][:, 0], expected[:, 0], atol=1e-12)


def test_what_stands_still_has_no_sliding_state():
    _, values = random_state()
    assert LAW.linear("sliding", values, np.zeros((2, 5))) is None


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"gap": 0.1}, "never acts"), ({"kn": 0.0}, "kn = 0"), ({"mu": 0.0}, "mu = 0"), ({"kt": 0.0}, "kt = 0"),
        ({"mu": 3.0}, "more than dry surfaces reach"),
    ],
)  # fmt: skip
def test_parameters_that_look_wrong(change, said):
    values = {"kt": 1.0, "mu": 0.3, "kn": 1.0, "gap": -1.0}
    assert list(LAW.warnings(values, {"tangential"}, 0.0)) == []
    (sentence,) = LAW.warnings(values | change, {"tangential"}, 0.0)
    assert said in sentence
    if "gap" in change:
        assert list(LAW.warnings(values | change, {"tangential"}, 0.2)) == []  # the opposing surface comes nearer


def test_motion_up_to_slip_is_where_the_element_begins_to_slip():
    values = {"kt": np.array([2.0]), "mu": np.array([0.4]), "kn": np.array([3.0]), "gap": np.array([-0.5])}
    size = LAW.size(values)
    assert size == pytest.approx(0.4 * 3.0 * 0.5 / 2.0)
    for factor, slips in ((0.999, False), (1.001, True)):
        X = np.zeros((1, H.size))
        X[0, 1] = factor * size[0]
        motion = Motion(H, 1.0, (X, 0 * X), np.zeros((2, 1)))
        assert (LAW.respond(motion, values).detail.slip_fraction[0] > 0) == slips


def test_springs_are_what_the_forces_answer_with():
    motion, values = random_state()
    springs = LAW.springs(LAW.respond(motion, values))
    assert np.all(springs[0] <= values["kt"] + values["mu"] * values["kn"])
    assert np.all((springs[1] >= 0) & (springs[1] <= values["kn"]))
    assert LAW.derived("normal_load", values)[0] == "gap"
    assert LAW.derived("load", values) is None
    assert np.isnan(LAW.derived("normal_load", {"kn": np.zeros(1)})[1]).all()


@pytest.mark.parametrize("velocity, scale", [(0.0, 0.2), (0.0, 3.0), (1.0, 3.0), (30.0, 1.0)])
def test_forces_in_time_are_those_of_the_coefficients(velocity, scale):
    """Their harmonic coefficients, by the trapezoidal rule, are those of the element; of motion without number nan."""
    h, rng = Harmonics(range(6)), np.random.default_rng(5)
    X, Y = scale * rng.standard_normal((2, 3, h.size)) / (1 + np.arange(h.size)) ** 2
    X[2, 3] = np.nan
    values = {name: np.full(3, value) for name, value in {"kt": 10.0, "mu": 0.4, "kn": 8.0, "gap": -0.4}.items()}
    motion = Motion(h, 1.0, (X, Y), np.array([3 * [velocity], [0.0, 0.0, 0.0]]))
    response, tau = LAW.respond(motion, values), np.arange(40000) * 2 * np.pi / 40000
    for force, wanted in zip(LAW.forces_in_time(motion, values, tau), response.force, strict=True):
        found = 2 * force @ h.H_plus(tau) / tau.size
        np.testing.assert_allclose(found[:2], wanted[:2], atol=1e-5 * np.abs(force[:2]).max())
    assert np.isnan(LAW.forces_in_time(motion, values, tau)[0][2]).all()
    assert LAW.states(motion, values)[2] == []
    for own, share in zip(LAW.states(motion, values)[:2], response.detail.stick_fraction, strict=False):
        stuck = sum(end - start for start, end, state in own if state == "stick")
        assert stuck / (2 * np.pi) == pytest.approx(share, abs=1e-12)


def test_friction_is_told_by_the_law_and_not_by_its_ports():
    named_alike = SampledLaw(force=lambda q, velocity: q, ports=FrictionContact.ports)
    assert is_friction(LAW)
    assert not is_friction(named_alike)
