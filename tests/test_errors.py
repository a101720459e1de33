"""Exceptions and outcomes: one sentence for each fault, and a text for each member."""

import pickle

import pytest

from slipstick.errors import InputError, Outcome, SlipstickError


def test_problems_are_sentences():
    one = InputError("a: found 1; expected 2")
    assert one.problems == ("a: found 1; expected 2",)
    many = InputError(["a is wrong", "b is wrong"])
    assert str(many) == "a is wrong\nb is wrong"
    assert isinstance(many, SlipstickError)
    assert isinstance(many, ValueError)
    assert pickle.loads(pickle.dumps(many)).problems == many.problems


def test_endless_names_are_shortened_and_paths_are_not():
    assert len(str(InputError("dof " + "x" * 10_000))) < 100
    path = "/".join(["folder" * 10] * 20)
    assert str(InputError(path)) == path


@pytest.mark.parametrize("outcome", list(Outcome))
def test_every_outcome_says_its_cause(outcome):
    assert len(outcome.text) > 20
    assert outcome.ok == (outcome is Outcome.COMPLETED)
