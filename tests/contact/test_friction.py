"""Parameters of friction contacts: one way to say the load, faults named, copies."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import slipstick as ss
from slipstick.contact.friction import FrictionContact, contact_forces
from slipstick.errors import InputError
from slipstick.trig.harmonics import Harmonics


def test_every_fault_is_named():
    with pytest.raises(InputError) as caught:
        FrictionContact(kt=-1.0, mu=np.nan, kn=-2.0, gap=0.0)
    assert [p.split(":")[0] for p in caught.value.sentences] == ["kt", "mu", "kn"]


def test_wrong_shapes_and_values_are_refused():
    h = Harmonics(range(3))
    contact = FrictionContact(kt=1.0, mu=0.3, kn=[1.0, 2.0], gap=-1.0)
    for X, omega in ((np.zeros(4), 1.0), (np.full(5, np.nan), 1.0), (np.zeros(5), 0.0), (np.zeros((3, 5)), 1.0)):
        with pytest.raises(InputError):
            contact_forces(contact, h, X, np.zeros(5), omega=omega)


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


def test_nothing_is_computed_without_a_coefficient():
    """A contact with kt that leaves mu to the model of its surfaces."""
    bare = ss.FrictionContact(kt=100.0, kn=1.0, gap=-800.0)
    assert repr(bare) == "FrictionContact(kt=100.0, kn=1.0, gap=-800.0)"
    assert bare.changed(kt=50.0).lacks_mu
    assert bare.changed(mu=0.3) == ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0)
    assert not bare.changed(mu=0.3).lacks_mu
    with pytest.raises(ss.InputError, match=r"^mu is missing; give the friction coefficient"):
        ss.contact_forces(bare, 1, [0.0, 0.0, 1.0], [0.0, 0.0, 0.0], omega=1.0)
    structure = ss.MatrixStructure(M=[[1.0]], K=[[1.0]], C=[[0.1]], dofs=["x"])
    with pytest.raises(ss.InputError, match="contact 'c', mu is missing"):
        ss.Problem(structure, contacts=ss.ContactPair(name="c", contact=bare, tangential="x"), harmonics=1)
