"""Matrices of a structure: what is wrong with each, also where another one is wrong too."""

import numpy as np

from slipstick.structure.system_checks import system_matrices

EYE = np.eye(2)
SKEW = np.array([[2.0, 1.0], [0.0, 2.0]])


def faults(**given):
    return system_matrices(given, 2, dense=True)


def test_right_ones_come_back():
    right, wrong = faults(M=EYE, K=2 * EYE, C=0 * EYE)
    assert not wrong
    assert sorted(right) == ["C", "K", "M"]
    assert hasattr(system_matrices({"M": EYE}, 2, dense=False)[0]["M"], "tocsc")


def test_no_fault_hides_another():
    right, wrong = faults(M=SKEW, K=-EYE, C=np.eye(3))
    assert [(fault.where, fault.statement[:13]) for fault in wrong] == [
        (("M",), "not symmetric"), (("C",), ""), (("K",), "the stiffness"),
    ]  # fmt: skip
    assert not set(right) & {"M", "K", "C"}


def test_damping_may_feed_energy_in():
    assert faults(M=EYE, K=EYE, C=-EYE)[1] == []
    assert [fault.where for fault in faults(M=-EYE, K=EYE, C=-EYE)[1]] == [("M",)]
