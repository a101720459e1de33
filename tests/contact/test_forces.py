"""The batch of elements below the checks: threads, memory of its own, motion that is no number."""

import numpy as np
import pytest

from slipstick.contact.forces import element_forces
from slipstick.contact.friction import FrictionContact, contact_forces
from slipstick.contact.rubbing import RubbingMotion
from slipstick.trig.harmonics import Harmonics


def test_shapes_of_single_and_many():
    h = Harmonics(range(3))
    X = np.array([0.0, 1.0, 0.0, 0.0, 0.0])
    one = contact_forces(FrictionContact(kt=1.0, mu=0.3, kn=1.0, gap=-1.0), h, X, 0 * X, omega=2.0)
    many = contact_forces(FrictionContact(kt=1.0, mu=0.3, kn=[1.0, 2.0], gap=-1.0), h, X, 0 * X, omega=2.0)
    assert one.Fx.shape == (5,)
    assert one.dFx_dX.shape == (5, 5)
    assert one.power.shape == ()
    assert one.residual_traction.shape == (2,)
    assert many.dFx_domega.shape == (2, 5)
    np.testing.assert_array_equal(many.Fx[0], one.Fx)
    assert isinstance(one.states[0], tuple)
    assert len(many.states) == 2


def test_many_elements_on_threads_equal_one_by_one():
    h = Harmonics(range(6))
    rng = np.random.default_rng(0)
    X, Y = rng.normal(size=(2, 300, h.size))
    contact = FrictionContact(kt=rng.uniform(0.1, 10, 300), mu=0.4, kn=1.0, gap=rng.normal(size=300))
    f = contact_forces(contact, h, X, Y, omega=1.0, rubbing=RubbingMotion(velocity=0.3))
    for e in (0, 157, 299):
        single = FrictionContact(kt=contact.kt[e], mu=0.4, kn=1.0, gap=contact.gap[e])
        g = contact_forces(single, h, X[e], Y[e], omega=1.0, rubbing=RubbingMotion(velocity=0.3))
        np.testing.assert_array_equal(f.Fx[e], g.Fx)
        np.testing.assert_array_equal(f.dFx_dY[e], g.dFx_dY)
        assert f.states[e] == g.states


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_motion_that_is_not_a_number_ends(bad):
    """The batch below the checks must not hang on it."""
    h = Harmonics(range(11))
    one = np.ones(1)
    X = np.full((1, h.size), bad)
    f = element_forces(h, X, np.zeros((1, h.size)), v=one, kt=one, mu=one, kn=one, gap=-one)
    assert np.isnan(f.Fx).any()


def test_results_in_use_are_never_written_over():
    """The arrays of a batch are its own."""
    h = Harmonics(range(4))
    rng = np.random.default_rng(1)
    contact = FrictionContact(kt=1.0, mu=0.4, kn=1.0, gap=-1.0)
    X = rng.normal(size=(5, 100, h.size))
    held = [contact_forces(contact, h, x, 0 * x, omega=1.0) for x in X]
    parts = [contact_forces(contact, h, x, 0 * x, omega=1.0).dFx_dX[3, 1:2] for x in X]
    for x, f, part in zip(X, held, parts, strict=True):
        one = contact_forces(contact, h, x[3], 0 * x[3], omega=1.0)
        np.testing.assert_array_equal(f.Fx[3], one.Fx)
        np.testing.assert_array_equal(f.stick_fraction[3], one.stick_fraction)
        np.testing.assert_array_equal(part[0], one.dFx_dX[1])


def random_batch(n=6, seed=3):
    h, rng = Harmonics(range(5)), np.random.default_rng(seed)
    X, Y = rng.normal(size=(2, n, h.size))
    par = {"v": rng.normal(size=n), "kt": rng.uniform(0.5, 3, n), "mu": rng.uniform(0.1, 0.6, n)}
    return h, X, Y, par | {"kn": rng.uniform(0.5, 3, n), "gap": rng.normal(-0.5, 0.3, n)}


def test_sums_of_states_are_the_whole_period():
    h, X, Y, par = random_batch(40)
    f = element_forces(h, X, Y, **par)
    np.testing.assert_allclose(f.stick_fraction + f.slip_fraction + f.separation_fraction, 1.0, atol=1e-14)
    for e, states in enumerate(f.states):
        length = {"stick": 0.0, "slip": 0.0, "separation": 0.0}
        for (start, end, name), (following, *_) in zip(states, [*states[1:], states[0]], strict=True):
            length[name.rstrip("+-")] += end - start
            assert np.isclose((following - end) % (2 * np.pi), 0.0, atol=1e-12) or np.isclose(
                (following - end) % (2 * np.pi), 2 * np.pi, atol=1e-12
            )
        shares = [f.stick_fraction[e], f.slip_fraction[e], f.separation_fraction[e]]
        np.testing.assert_allclose([value / (2 * np.pi) for value in length.values()], shares, atol=1e-12)


def test_the_mean_of_the_tangential_motion_changes_nothing():
    """Only the gap's share of the mean of Y matters, and the mean of X does not."""
    h, X, Y, par = random_batch()
    f = element_forces(h, X, Y, **par)
    moved = X.copy()
    moved[:, 0] += 1e3
    np.testing.assert_array_equal(element_forces(h, moved, Y, **par).Fx, f.Fx)
    np.testing.assert_allclose(f.dFx_dX[:, :, 0], 0.0, atol=1e-14)
    closer, shift = Y.copy(), 0.25
    closer[:, 0] += shift
    g = element_forces(h, X, closer, **(par | {"gap": par["gap"] + shift}))
    np.testing.assert_allclose(g.Fy, f.Fy, atol=1e-13)


def test_friction_does_no_negative_work():
    h, X, Y, par = random_batch(200)
    assert element_forces(h, X, Y, **par).work.min() > -1e-13


def test_frequency_must_be_known_for_what_is_by_time():
    h, X, Y, par = random_batch()
    f = element_forces(h, X, Y, **par)
    with pytest.raises(AttributeError, match="omega was not given"):
        _ = f.power


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("what", ["X", "Y", "v", "kt", "mu", "kn", "gap"])
def test_what_is_no_number_ends_with_nan_and_spoils_no_neighbour(what, bad):
    """Wherever it stands; the search for critical times halved without end where the gap was nan."""
    h, rng = Harmonics(range(6)), np.random.default_rng(3)
    own = {name: rng.uniform(0.5, 1.0, 3) for name in ("v", "kt", "mu", "kn", "gap")} | {
        name: rng.normal(size=(3, h.size)) for name in ("X", "Y")
    }
    right = element_forces(h, own["X"], own["Y"], **{k: own[k] for k in ("v", "kt", "mu", "kn", "gap")})
    for i in range(h.size if what in "XY" else 1):
        spoilt = {name: value.copy() for name, value in own.items()}
        spoilt[what][1 if what not in "XY" else (1, i)] = bad
        f = element_forces(h, spoilt.pop("X"), spoilt.pop("Y"), **spoilt)
        for name in ("Fx", "Fy", "dFx_dX", "work", "stick_fraction"):
            assert np.isnan(getattr(f, name)[1]).all(), name
            np.testing.assert_array_equal(getattr(f, name)[[0, 2]], getattr(right, name)[[0, 2]])
        assert f.states[1] == []
        assert f.states[0] == right.states[0]


@pytest.mark.parametrize("what", ["X", "Y", "v", "kt", "kn", "gap"])
@pytest.mark.parametrize("value", [1e100, -1e200, 1e308])
def test_absurd_numbers_end(what, value):
    h, rng = Harmonics(range(6)), np.random.default_rng(4)
    X, Y = rng.normal(size=(2, 2, h.size))
    given = {"v": 1.0, "kt": 20.0, "mu": 0.3, "kn": 15.0, "gap": -0.2} | ({what: value} if what not in "XY" else {})
    {"X": X, "Y": Y}.get(what, np.zeros((2, 2)))[0, 1] = value
    with np.errstate(all="ignore"):
        f = element_forces(h, X, Y, **{name: np.full(2, number) for name, number in given.items()})
        assert len(f.states) == 2
