"""Contacts of a problem: one or many, their directions, and their values by name."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.balance.contacts import ContactPair, cosine_faults, direction_faults, prescribed
from slipstick.errors import InputError
from slipstick.trig.harmonics import Harmonics

LAW = ss.FrictionContact(kt=[1.0, 2.0, 3.0], mu=0.3, kn=2.0, normal_load=6.0)


def pair(**more):
    return ContactPair(**({"name": "tip", "contact": LAW, "tangential": ["x", {"y": -1.0}, "z"]} | more))


def test_arrays_make_many():
    many = pair(normal={"n": 1.0}, rubbing=ss.RubbingMotion(velocity=5.0, sin={2: [1.0, 2.0, 3.0]}))
    assert len(many) == 3
    assert many.elements == ("tip.1", "tip.2", "tip.3")
    assert many.direction("tangential", 1) == {"y": -1.0}
    assert [many.direction("normal", k) for k in range(3)] == [{"n": 1.0}] * 3
    assert many.direction("other") is None
    assert many.n_ports == 6
    assert many.dofs == ("x", "y", "z", "n")
    assert pair(contact=ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0), tangential="x").elements == ("tip",)


def test_values_by_name_come_back_changed_and_nothing_else_does():
    many = pair(rubbing=ss.RubbingMotion(velocity=5.0, cos={1: 2.0}))
    for name in many.quantities:
        for k in (None, 1):
            changed = many.with_value(name, 7.0, k)
            expected = many.values(name).copy()
            expected[slice(None) if k is None else k] = 7.0
            np.testing.assert_allclose(changed.values(name), expected)
            load = {"gap", "normal_load", "kn"}  # two of them make the third
            others = set(many.quantities) - ({name} | (load if name in load else set()))
            for other in others:
                np.testing.assert_array_equal(changed.values(other), many.values(other))
    assert many.with_value("sin3", 4.0).rubbing.sin == {3: 4.0}


def test_the_counter_surface_moves_along_the_ports():
    h = Harmonics(range(5))
    rub = ss.RubbingMotion(velocity=[1.0, 2.0, 3.0], velocity_per_omega=0.5, cos={1: 0.5}, normal_cos={2: 0.25})
    found = prescribed(pair(normal="n", rubbing=rub), h, 2)
    motion = found["motion"]
    np.testing.assert_array_equal(found["velocity"], [[1.0, 2.0, 3.0], [0.0] * 3])
    np.testing.assert_array_equal(found["velocity_per_omega"], [[0.5] * 3, [0.0] * 3])
    np.testing.assert_array_equal(motion[0, :, h.index(2)], 0.5)
    np.testing.assert_array_equal(motion[1, :, h.index(4)], 0.25)
    assert np.count_nonzero(motion) == 6


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"name": 3}, "name: found 3"),
        ({"contact": 5}, "expected contact=ss.FrictionContact"),
        ({"tangential": 5}, "tangential"),
        ({"tangential": []}, "tangential"),
        ({"tangential": {"x": "a"}}, "tangential"),
        ({"ports": 3}, "expected directions by the names of ports"),
        ({"rubbing": 4}, "rubbing"),
    ],
)
def test_values_of_another_kind(more, said):
    with pytest.raises(InputError, match=said):
        pair(**more)


def test_a_direction_may_name_a_dof_that_it_has_no_part_of():
    assert not list(cosine_faults({"x": 1.0, "y": 0.0}, None))
    (fault,) = cosine_faults({"x": 0.0, "y": 0.0}, None)
    assert fault.expected == "a cosine other than zero"


def test_directions_that_do_not_fit_the_law():
    assert not list(direction_faults(pair()))
    assert "found [2, 3] contacts in its arrays" in str(*direction_faults(pair(tangential=["x", "y"])))
    (fault,) = direction_faults(pair(tangential=None))
    assert str(fault) == "tangential has no direction; give the dofs along which the port moves"
    (fault,) = direction_faults(pair(ports={"axial": "x"}))
    assert "its law has no port 'axial'; it has tangential, normal" in str(fault)
