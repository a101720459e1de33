"""Exceptions and outcomes: one sentence for each fault, and a text for each member."""

import pickle

import pytest

from slipstick.errors import IS_MISSING, Fault, InputError, Outcome, SlipstickError


def test_a_fault_is_data():
    fault = Fault("kt", found="-1", expected="a number >= 0", remedy="check the sign")
    assert str(fault.inside("contact", "tip")) == "contact 'tip', kt: found -1; expected a number >= 0; check the sign"
    assert fault.inside("contact", "tip").below("contact", "tip") == fault
    assert fault.below("contact", "tip") == fault
    assert fault.said(lambda where: "/".join(map(str, where))).startswith("kt: found -1")
    assert str(Fault(("contacts", 1), IS_MISSING)) == "contacts, number 2 is missing"
    assert str(Fault(("load", 0, "dof"), "nothing is there")) == "load number 1, dof: nothing is there"
    assert str(Fault(statement="nothing is there")) == "nothing is there"


def test_all_faults_are_told_each_once():
    one = InputError("a: found 1; expected 2")
    assert one.faults == (Fault(statement="a: found 1; expected 2"),)
    assert one.sentences == ("a: found 1; expected 2",)
    assert len(InputError([Fault("a", IS_MISSING), Fault("a", IS_MISSING), Fault("b", IS_MISSING)]).faults) == 2
    many = InputError(["a is wrong", "b is wrong"])
    assert str(many) == "a is wrong\nb is wrong"
    assert isinstance(many, SlipstickError)
    assert isinstance(many, ValueError)
    assert pickle.loads(pickle.dumps(many)).faults == many.faults


def test_endless_names_are_shortened_and_paths_are_not():
    assert len(str(InputError("dof " + "x" * 10_000))) < 100
    path = "/".join(["folder" * 10] * 20)
    assert str(InputError(path)) == path


@pytest.mark.parametrize("outcome", list(Outcome))
def test_every_outcome_says_its_cause(outcome):
    assert len(outcome.text) > 20
    assert outcome.ok == (outcome is Outcome.COMPLETED)
