"""What of a problem cannot be computed: every fault by its own sentence, all at once."""

from dataclasses import replace

import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.balance.checks import problem_faults, range_faults, requested_faults, requested_values, two_numbers
from slipstick.errors import InputError
from slipstick.verify.cases import oscillator


def with_changes(**changes):
    return replace(oscillator(velocity=1.0), **changes)


def contact(name="damper", **more):
    law = ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0)
    return ss.ContactPair(**({"name": name, "contact": law, "tangential": "x"} | more))


def spring(**more):
    law = ss.SampledLaw(force=lambda x, velocity, k: k * x, parameters={"k": 1.0}, ports=("q",))
    return ss.ContactPair(name="spring", contact=law, ports={"q": "x"}, **more)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"contacts": [contact(), contact()]}, "the name 'damper' is used 2 times"),
        ({"contacts": [contact("*")]}, "expected printable characters other than '*'"),
        ({"contacts": [contact(tangential="y")]}, "there is no dof 'y' in the structure"),
        ({"contacts": [contact(tangential={"x": 0.0})]}, "which has no direction"),
        ({"contacts": [contact(rubbing=ss.RubbingMotion(cos={99: 1.0}))]}, "harmonic 99 is not among the harmonics"),
        ({"contacts": [spring(rubbing=ss.RubbingMotion(normal_cos={1: 1.0}))]}, "a port called 'normal'"),
        ({"contacts": [contact(ports={"tangential": "x"})]}, "ports, tangential is given together with tangential"),
        ({"contacts": [contact(normal="x")]}, "'damper', kn is missing"),
        ({"contacts": [contact(rubbing=ss.RubbingMotion(normal_sin={1: 1.0}))]}, "'damper', kn is missing"),
        ({"loads": [ss.Load(dof="y", sin=1.0)]}, "load number 1, dof: there is no dof 'y'"),
        ({"loads": [ss.Load(shape="wind", sin=1.0)]}, "there is no load shape 'wind'"),
        ({"loads": [ss.Load(dof="x", harmonic=99, sin=1.0)]}, "harmonic 99 is not among the harmonics kept"),
        ({"loads": [ss.Load(dof="x", harmonic=0, sin=1.0)]}, "a sine of harmonic 0 is zero"),
        ({"outputs": ["y"]}, "outputs: there is no dof 'y'"),
        ({"outputs": ["x", "x"]}, "'x' is given 2 times"),
        ({"friction": -1.0}, "friction: found -1"),
    ],
)
def test_faults(changes, said):
    with pytest.raises(InputError, match=said.replace("(", r"\(").replace("*", r"\*")):
        with_changes(**changes)


def test_a_sound_problem_has_none():
    assert not list(problem_faults(oscillator(velocity=1.0)))


def test_all_at_once():
    with pytest.raises(InputError) as caught:
        with_changes(outputs=["y"], loads=[ss.Load(dof="z", sin=1.0)], contacts=[contact(tangential="w")])
    assert len(caught.value.sentences) == 3


@pytest.mark.parametrize(
    ("start", "stop", "said"),
    [(1.0, 1.0, "which is empty"), (0.0, 5.0, "frequencies > 0"), (1.0, float("inf"), "expected finite numbers")],
)
def test_ranges(start, stop, said):
    assert said in str(*range_faults(start, stop))
    assert range_faults(2.0, 1.0) == []
    assert range_faults(-1.0, 1.0, positive=False) == []


def test_numbers_asked_for():
    assert two_numbers([1, 2.5], "omega") == (1.0, 2.5)
    assert requested_values(3) == (3.0,)
    assert requested_values([3, 4.5]) == (3.0, 4.5)
    (fault,) = requested_faults([5.0, 1.0, 2.0], 3.0, 1.0)
    assert fault.where == ("at",)
    assert fault.statement == "5 lies outside of the range 1 to 3"
    for bad in ((1.0,), (1.0, 2.0, 3.0), "ab", None):
        with raises_fault("omega"):
            two_numbers(bad, "omega")
    with raises_fault("at", 0, found="'a'"):
        requested_values(["a"])


@pytest.mark.parametrize("side", ["tangential", "normal"])
def test_an_empty_direction_is_none(side: str) -> None:
    structure = ss.MatrixStructure(M=[[1.0]], K=[[9.0]], dofs=["x"])
    contact = ss.FrictionContact(kt=1.0, mu=0.3, kn=1.0, gap=-1.0)
    pair = ss.ContactPair(name="pad", contact=contact, **{"tangential": "x"} | {side: {}})
    with pytest.raises(ss.InputError, match=f"contact 'pad', {side}: found {{}}, which has no direction"):
        ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=1.0), harmonics=[0, 1])
