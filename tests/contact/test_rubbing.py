"""Rubbing motion: layout of its coefficients, components by name, common period."""

import numpy as np
import pytest
from helpers.faults import raises_fault

from slipstick.contact.rubbing import RubbingMotion, common_period
from slipstick.errors import InputError
from slipstick.trig.harmonics import Harmonics


def test_rubbing_faults():
    with pytest.raises(InputError) as caught:
        RubbingMotion(velocity=np.inf, cos={1: np.nan}, sin={0: 1.0})
    assert len(caught.value.sentences) == 3
    with raises_fault("rubbing", "cos", expected="amplitudes by harmonic such as {1: 2.0}"):
        RubbingMotion(cos=2.0)


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


RUB = RubbingMotion(velocity=3.0, cos={1: 2.0, 3: 0.5}, sin={2: 1.0}, normal_cos={0: 0.1}, normal_sin={2: 0.4})


def test_components_are_known_by_name():
    assert RUB.names == ("velocity", "cos1", "cos3", "sin2", "normal_cos0", "normal_sin2")
    assert dict(RUB.components()) == {
        "velocity": 3.0, "cos1": 2.0, "cos3": 0.5, "sin2": 1.0, "normal_cos0": 0.1, "normal_sin2": 0.4,
    }  # fmt: skip
    for name in (*RUB.names, "cos7"):
        assert RubbingMotion.is_component(name)
        assert RUB.with_component(name, 9.0).component(name) == 9.0
        assert RUB.with_component(name, RUB.component(name)).coefficients(Harmonics(8)).tolist() == (
            RUB.coefficients(Harmonics(8)).tolist()
        )
    for name in ("cos", "cos01", "cos-1", "sin1.0", "tangential_cos1", ""):
        assert not RubbingMotion.is_component(name)
        with raises_fault("rubbing", expected="velocity, cos1, normal_sin2, ..."):
            RUB.component(name)


def test_coefficients_give_the_motion_at_any_time():
    h, t = Harmonics(range(7)), np.linspace(0.0, 2 * np.pi, 50)
    for factor in (1, 2):
        s = factor * t
        along = 2.0 * np.cos(s) + 0.5 * np.cos(3 * s) + np.sin(2 * s)
        np.testing.assert_allclose(h.H_minus(t) @ RUB.coefficients(h, factor), along, atol=1e-14)
        np.testing.assert_allclose(
            h.H_minus(t) @ RUB.normal_coefficients(h, factor), 0.1 + 0.4 * np.sin(2 * s), atol=1e-14
        )


def test_what_is_zero_does_not_move():
    still = RubbingMotion(velocity=0.0, cos={0: 3.0, 5: 0.0}, sin={2: [0.0, 0.0]})
    assert not still.moves
    assert still.orders == (0,)
    assert RubbingMotion(velocity=[0.0, 1.0]).moves
    assert RubbingMotion(normal_cos={2: 1e-9}).moves


def test_a_velocity_that_grows_with_the_frequency():
    rub = RubbingMotion(velocity=1.0, velocity_per_omega=[0.2, 0.4])
    np.testing.assert_allclose(rub.speed(10.0), [3.0, 5.0])
    assert rub.moves
    assert rub.names == ("velocity", "velocity_per_omega")
    assert RubbingMotion.is_component("velocity_per_omega")
    assert rub.with_component("velocity_per_omega", 0.0).names == ("velocity",)
    assert not RubbingMotion(velocity_per_omega=0.0).moves
    with raises_fault("rubbing", "velocity_per_omega", found="'fast'"):
        RubbingMotion(velocity_per_omega="fast")
