"""Contacts whose parameters come from curves: their values without heat, and those that cannot be heated."""

import pytest

import slipstick as ss
from slipstick.balance.warm import cold_pairs, heat_faults

CURVE = {"temperature": [20.0, 100.0], "mu": [0.5, 0.3], "kn": [2.0, 1.0]}


def problem(normal="y", **curve):
    K = [[40.0, 0.0], [0.0, 60.0]]
    structure = ss.MatrixStructure(M=[[1.0, 0.0], [0.0, 1.0]], C=[[0.1, 0.0], [0.0, 0.1]], K=K, dofs=["x", "y"])
    contact = ss.FrictionContact(kt=1.0, mu=0.1, kn=1.0, gap=-1.0)
    pairs = [
        ss.ContactPair(name="hot", contact=contact, tangential="x", normal=normal),
        ss.ContactPair(name="other", contact=contact, tangential="y"),
    ]
    thermal = ss.ThermalModel(
        curve={"hot": ss.FrictionCurve(**(CURVE | curve))}, background=60.0, resistance={"hot": 1.0}
    )
    return ss.Problem(structure, contacts=pairs, loads=[ss.Load(dof="x", sin=1.0)], harmonics=range(6), thermal=thermal)


def test_cold_values_are_those_of_the_curves_at_the_background():
    p = problem()
    hot, other = cold_pairs(p.contacts, p.batches[p.heated.batch], p.heated)
    assert float(hot.contact.mu) == pytest.approx(0.4)
    assert float(hot.contact.kn) == pytest.approx(1.5)
    assert float(hot.contact.kt) == 1.0
    assert other == p.contacts[1]


def test_a_constant_load_does_not_follow_a_stiffness():
    p = problem()
    assert heat_faults(p.contacts, p.batches[p.heated.batch], p.heated) == []
    with pytest.raises(ss.InputError, match="contact 'hot': kn depends on temperature but the contact has no normal"):
        ss.forced_response(problem(normal=None), omega=(2.0, 3.0))
