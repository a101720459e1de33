"""Friction over the sliding velocity in a case file: what it makes, and what it refuses."""

from pathlib import Path

import pytest
from helpers.cases import oscillator

import slipstick as ss
from slipstick.case.script import python_script

CASE = oscillator(
    head='harmonics = "0..5"\n', load="harmonic = 1\n", rubbing="velocity = 10.0", response="from = 9.0\nto = 9.5\n"
).replace("mu = 0.3", "mu = MU")
LAWS = {
    "{ velocity_table = [[0, 0.4], [12, 0.3]] }": {"mu": [(0.0, 0.4), (12.0, 0.3)]},
    '{ mu_s = 0.4, mu_d = 0.3, v_s = 8.0, form = "cubic" }': {"mu_s": 0.4, "mu_d": 0.3, "v_s": 8.0, "form": "cubic"},
}


@pytest.mark.parametrize("mu", LAWS)
def test_a_case_and_its_script_make_the_law(mu):
    law = ss.models.StribeckContact(kt=100.0, normal_load=800.0, **LAWS[mu])
    case = CASE.replace("MU", mu)
    assert ss.Case.from_text(case).problem().contacts[0].contact.values == law.values
    assert "ss.models.StribeckContact(" in python_script(case, "case.toml", Path())


@pytest.mark.parametrize(
    "mu, sentence",
    [
        ("{ mu_s = 0.4, mud = 0.3, v_s = 8.0 }", "did you mean 'mu_d'"),
        ("{ velocity_table = [[1, 0.4], [12, 0.3]] }", "velocities from 0 on"),
        ("{ velocity_table = 3 }", "at least two"),
        ('{ mu_s = 0.4, mu_d = 0.3, v_s = 1.0, form = "tanh" }', "never sticks"),
        ("{ mu_s = 0.4, mu_d = 0.3, v_s = 1.0 }\nthermal = { background = 25.0, resistance = 8.0 }", "is heated"),
    ],
)
def test_what_it_cannot_be_is_said(mu, sentence):
    with pytest.raises(ss.InputError, match=sentence) as caught:
        ss.Case.from_text(CASE.replace("MU", mu))
    assert len(caught.value.faults) == 1
