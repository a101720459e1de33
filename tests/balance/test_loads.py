"""Loads: two ways to say one force, and sentences for what is none."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipstick.balance.loads import Load
from slipstick.errors import InputError

SIZES = st.floats(min_value=-1e6, max_value=1e6).map(lambda value: value if abs(value) > 1e-50 else 0.0)


@given(SIZES, SIZES, st.integers(0, 20))
def test_both_ways_are_the_same_force_at_every_time(cos, sin, m):
    one = Load(dof="x", harmonic=m, cos=cos, sin=sin)
    two = Load(dof="x", harmonic=m, amplitude=one.amplitude, phase=one.phase)
    t = np.linspace(0, 2 * np.pi, 7)
    at = lambda load: load.cos * np.cos(m * t) + load.sin * np.sin(m * t)  # noqa: E731
    np.testing.assert_allclose(at(two), at(one), atol=1e-14 * (1 + one.amplitude))
    np.testing.assert_allclose(at(one), one.amplitude * np.cos(m * t + one.phase), atol=1e-13 * (1 + one.amplitude))


def test_what_adds_up_is_on_the_same_place():
    assert Load(dof="x", cos=1.0).place == Load(dof="x", harmonic=3, sin=2.0).place
    assert Load(dof="x", cos=1.0).place != Load(shape="x", cos=1.0).place
    a, b = ({"x": 1.0, "y": 2.0}, {"y": 2.0, "x": 1.0})
    moved = [Load(base=base, motion="displacement", cos=1.0) for base in (a, b)]
    assert moved[0].place == moved[1].place
    assert Load(base=a, motion="acceleration", cos=1.0).place != moved[0].place
    assert [Load(dof="x").target, Load(shape="s").target, moved[0].target] == ["x", "s", "base"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"dof": "x", "amplitude": 1.0, "cos": 1.0}, "keep one form of the force"),
        ({"dof": "x", "phase": 1.0}, "phase is given without amplitude"),
        ({"dof": "x", "cos": np.nan}, "cos"),
        ({"dof": "x", "harmonic": 1.5}, "harmonic"),
        ({"dof": 3}, "dof: found 3"),
        ({"base": {"x": 0.0}, "motion": "displacement"}, "base: found"),
        ({"base": "x"}, "base is given without motion"),
        ({"base": "x", "motion": "speed"}, 'expected "displacement" or "acceleration"'),
        ({"dof": "x", "motion": "displacement"}, "motion is given without base"),
    ],
)
def test_what_is_no_load(options, said):
    with pytest.raises(InputError, match=said):
        Load(**options)


def test_all_faults_at_once():
    with pytest.raises(InputError) as caught:
        Load(dof=1, harmonic=-0.5, cos="a", phase=1.0)
    assert len(caught.value.sentences) == 4


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"motion": "unbalance", "cos": 1.0}, "an unbalance is on no dof"),
        ({"base": "x", "motion": "unbalance", "cos": 1.0}, 'motion: found "unbalance"'),
        ({"dof": "x", "motion": "displacement", "cos": 1.0}, "motion is given without base"),
    ],
)
def test_faults_of_an_unbalance(arguments, words):
    with pytest.raises(InputError, match=words):
        Load(**arguments)
