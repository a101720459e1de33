"""``[[contact]] law = "iwan" | "dahl" | "bouc_wen"``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.case.case import Case
from slipstick.case.script import python_script
from slipstick.contact.law import Law

CASE = """format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["x"]
mass = [[1.0]]
damping = [[0.4]]
stiffness = [[40.0]]
[[load]]
dof = "x"
sin = 5.0
[[contact]]
name = "joint"
tangential = { x = 0.5 }
LAW
[response]
from = 6.0
to = 6.2
"""
IWAN = 'law = "iwan"\nkt = 30.0\nlimit = 2.0\nchi = -0.4\nbeta = 0.3\nsliders = 7\nrubbing = { velocity = 0.3 }'
DAHL = 'law = "dahl"\nkt = 30.0\nlimit = 2.0'
BOUC_WEN = 'law = "bouc_wen"\nkt = 30.0\nbeta = 4.0\ngamma = -1.5\nn = 1.7\nalpha = 0.1'
LAWS = {
    IWAN: ss.models.IwanContact(kt=30.0, limit=2.0, chi=-0.4, beta=0.3, sliders=7),
    DAHL: ss.models.DahlContact(kt=30.0, limit=2.0),
    BOUC_WEN: ss.models.BoucWenContact(kt=30.0, beta=4.0, gamma=-1.5, n=1.7, alpha=0.1),
}


@pytest.mark.parametrize("law", LAWS, ids=["iwan", "dahl", "bouc_wen"])
def test_a_case_and_its_script_make_the_law(law: str) -> None:
    case = CASE.replace("LAW", law)
    (pair,) = Case.from_text(case).problem().contacts
    own: Law = LAWS[law]
    assert pair.contact == own
    assert pair.direction("tangential") == {"x": 0.5}
    assert pair.rubbing == ss.RubbingMotion(velocity=0.3 if law == IWAN else 0.0)
    text = python_script(case, "case.toml", Path())
    given: dict[str, object] = {"__name__": "script"}
    exec(compile(text, "script.py", "exec"), given)
    ours, theirs = Case.from_text(case).run().dataset, given["compute"]().dataset  # type: ignore[operator]
    assert len(ours.point) > 2
    np.testing.assert_array_equal(theirs["displacement"], ours["displacement"])


CHOICE = 'expected "stator", "iwan", "dahl" or "bouc_wen"; left out for friction contacts'
AT = "[[contact]] 'joint'"


@pytest.mark.parametrize(
    ("law", "old", "new", "said"),
    [
        (IWAN, '"iwan"', '"iwann"', f"{AT} law: found \"iwann\"; {CHOICE}; did you mean 'iwan'?"),
        (BOUC_WEN, 'law = "bouc_wen"\nkt = 30.0\nbeta', 'law = "bouc_wenn"\nmu = 0.3\nnormal_load = 1.0\nbetta',
         f"{AT} law: found \"bouc_wenn\"; {CHOICE}; did you mean 'bouc_wen'?"),
        (BOUC_WEN, "law =", "lwa =", f"unknown key 'lwa' in {AT}; did you mean 'law'?"),
        (IWAN, '"iwan"', '"masing"', f'{AT} law: found "masing"; {CHOICE}'),
        (IWAN, "chi =", "chy =", "unknown key 'chy' in [[contact]] 'joint'; did you mean 'chi'?"),
        (IWAN, "limit = 2.0\n", "", f"{AT} limit is missing; give a number > 0, the force while all slide"),
        (IWAN, "sliders = 7", "sliders = 0",
         f"{AT} sliders: found 0; expected a whole number >= 1, bins of equal width"),
        (DAHL, "kt = 30.0", "kt = 0.0",
         f"{AT} kt: found 0.0; expected a number > 0, the stiffness before it yields (force/length)"),
        (BOUC_WEN, "gamma = -1.5", "gamma = 5.0", f"{AT} gamma: found 5.0; expected above -beta, at most beta"),
        (BOUC_WEN, "n = 1.7", "n = 0.5", f"{AT} n: found 0.5; expected a number from 1 to 20, sharpness of the yield"),
        (BOUC_WEN, "n = 1.7", "n = 40.0",
         f"{AT} n: found 40.0; expected a number from 1 to 20, sharpness of the yield"),
        (BOUC_WEN, "alpha = 0.1", "alpha = 0.1\nrubbing = { velocity = 1.0 }",
         f"{AT} alpha: the opposing surface slides, and the stiffness after yield has no bound; give alpha = 0, or no "
         "rubbing velocity"),
        (IWAN, "velocity = 0.3", 'normal_cos = { "1" = 0.3 }',
         f"{AT} rubbing: normal_cos1 moves the surface along a port called 'normal', which its law does not have; it "
         "has tangential"),
        (IWAN, "velocity = 0.3", "velocity = [0.3, 1.0]",
         f"{AT} rubbing.velocity is a vector, but the contact slides in one direction; give one number"),
        (DAHL, "limit = 2.0", "limit = 2.0\nthermal = { background = 25.0, resistance = 8.0 }",
         f"unknown key 'thermal' in {AT}; keys not used yet: rubbing"),
    ],
)  # fmt: skip
def test_what_it_cannot_be_is_said(law: str, old: str, new: str, said: str) -> None:
    text = CASE.replace("LAW", law)
    assert old in text
    with pytest.raises(ss.InputError) as raised:
        Case.from_text(text.replace(old, new)).problem()
    assert str(raised.value).splitlines() == [said]
