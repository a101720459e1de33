"""Contact parameters, rubbing motion, common period."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from slipstick.contact.forces import element_forces
from slipstick.contact.friction import FrictionContact, contact_forces
from slipstick.contact.rubbing import RubbingMotion, common_period
from slipstick.errors import InputError
from slipstick.trig.harmonics import Harmonics


def test_every_fault_is_named():
    with pytest.raises(InputError) as caught:
        FrictionContact(kt=-1.0, mu=np.nan, kn=-2.0, gap=0.0)
    assert [p.split(":")[0] for p in caught.value.problems] == ["kt", "mu", "kn"]


def test_rubbing_faults():
    with pytest.raises(InputError) as caught:
        RubbingMotion(velocity=np.inf, cos={1: np.nan}, sin={0: 1.0})
    assert len(caught.value.problems) == 3


def test_rubbing_coefficients_follow_the_layout():
    h = Harmonics([0, 1, 2, 4])
    rub = RubbingMotion(velocity=3.0, cos={1: 2.0}, sin={2: [1.0, 5.0]})
    assert rub.orders == (1, 2)
    np.testing.assert_array_equal(rub.coefficients(h), [[0, 2, 0, 0, 1, 0, 0], [0, 2, 0, 0, 5, 0, 0]])
    np.testing.assert_array_equal(rub.coefficients(h, 2)[1], [0, 0, 0, 2, 0, 0, 5])
    with pytest.raises(InputError, match="harmonic 3 is not kept"):
        RubbingMotion(cos={3: 1.0}).coefficients(h)


@pytest.mark.parametrize("ratio", [(1, 1), (1, 2), (2, 1), (2, 3), (6, 4), (5, 7)])
def test_common_period(ratio):
    """Both motions repeat in the common period, and in no shorter one."""
    load, rub = common_period(*ratio)
    T_p, T_u = float(ratio[0]), float(ratio[1])
    assert load * T_p == pytest.approx(rub * T_u)
    assert np.gcd(load, rub) == 1
    with pytest.raises(InputError):
        common_period(0, 1)


def test_wrong_shapes_and_values_are_refused():
    h = Harmonics(range(3))
    contact = FrictionContact(kt=1.0, mu=0.3, kn=[1.0, 2.0], gap=-1.0)
    for X, omega in ((np.zeros(4), 1.0), (np.full(5, np.nan), 1.0), (np.zeros(5), 0.0), (np.zeros((3, 5)), 1.0)):
        with pytest.raises(InputError):
            contact_forces(contact, h, X, np.zeros(5), omega=omega)


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


def test_the_normal_load_is_said_in_one_way():
    assert FrictionContact(kt=1.0, mu=0.3, kn=2.0, normal_load=800.0).gap == -400.0
    assert FrictionContact(kt=1.0, mu=0.3, normal_load=800.0) == FrictionContact(kt=1.0, mu=0.3, gap=-800.0)
    many = FrictionContact(kt=1.0, mu=0.3, kn=[1.0, 2.0], normal_load=800.0)
    np.testing.assert_array_equal(many.gap, [-800.0, -400.0])
    np.testing.assert_array_equal(many.normal_load, [800.0, 800.0])
    both = FrictionContact(kt=1.0, mu=0.3, kn=0.1, gap=-8000.0, normal_load=800.0)
    assert both.gap == -8000.0
    for given, words in (
        ({}, "the normal load is missing"), ({"gap": -1.0, "normal_load": 2.0}, "give one of them"),
        ({"gap": 1.0, "normal_load": 2.0}, "give one of them"),
        ({"kn": 0.0, "normal_load": 2.0}, "kn = 0.0 is too small"),
        ({"normal_load": -1.0}, "negative"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=words):
            FrictionContact(kt=1.0, mu=0.3, **given)


def test_copies_keep_the_gap():
    contact = FrictionContact(kt=1.0, mu=0.3, kn=2.0, normal_load=800.0)
    assert replace(contact, mu=0.5).gap == -400.0
    assert float(replace(contact, gap=-100.0).normal_load) == 200.0
    assert float(replace(contact, kn=4.0).normal_load) == 1600.0
    assert pickle.loads(pickle.dumps(contact)) == contact


def test_parameters_do_not_change_with_the_users_array():
    kt = np.array([1.0, 2.0])
    contact = FrictionContact(kt=kt, mu=0.3, gap=-1.0)
    kt[0] = 7.0
    assert contact.kt[0] == 1.0
    assert "800" not in repr(contact_forces(contact, Harmonics(3), np.zeros(7), np.zeros(7), omega=1.0))
