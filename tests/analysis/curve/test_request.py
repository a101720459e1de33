"""What users give to a curve: every form that is taken, and a sentence for what is none."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.analysis.curve.follow import curve_arguments, frequency_request, parameter_request
from slipstick.analysis.road.request import Checks, followed_problem, response_options
from slipstick.balance.balance import Balance
from slipstick.errors import InputError
from slipstick.solve.continuation import ContinuationOptions
from slipstick.verify.cases import oscillator

PROBLEM = oscillator(velocity=1.0)
BALANCE = Balance(PROBLEM)
GIVEN = {"requested": (), "peaks_of": None, "options": None, "listeners": (), "guess": None}


def taken(**given):
    return curve_arguments(Checks(PROBLEM), **(GIVEN | given))


def test_every_form_is_taken():
    assert taken()["peaks_of"] == ("x",)
    assert taken(peaks_of="x")["peaks_of"] == taken(peaks_of=["x"])["peaks_of"] == ("x",)
    assert taken(peaks_of=["x", "x"])["peaks_of"] == ("x",)
    assert taken(peaks_of=[])["peaks_of"] == ()
    assert taken(listeners=print)["listeners"] == taken(listeners=[print])["listeners"] == (print,)
    assert taken(options={"max_step": 0.01})["options"] == taken(options=response_options(max_step=0.01))["options"]
    guess = np.arange(BALANCE.size, dtype=float)
    for form in (guess, guess.tolist(), guess.reshape(BALANCE.n_ports, -1)):
        np.testing.assert_array_equal(taken(guess=form)["guess"], guess)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"peaks_of": ["z"]}, "peaks_of: 'z' is not among the outputs"),
        ({"options": 3}, "response_options"),
        ({"options": {"maxstep": 0.1}}, "there is no option 'maxstep'"),
        ({"options": {"max_step": -1.0}}, "options, max_step"),
        ({"listeners": [3]}, "listeners"),
        ({"guess": [1.0]}, "guess: found shape"),
        ({"guess": "a"}, "guess"),
    ],
)
def test_what_is_none(given, said):
    with pytest.raises(InputError, match=said):
        taken(**given)


def test_without_contacts_there_is_nothing_to_follow():
    with pytest.raises(InputError, match="the response is linear"):
        followed_problem(replace(oscillator(velocity=1.0), contacts=()))
    with raises_fault("problem", found="'case.toml'", expected="an ss.Problem"):
        followed_problem("case.toml")


def test_every_argument_that_is_wrong_is_told_at_once() -> None:
    problem = oscillator(velocity=1.0)
    wrong = {
        "at": ["a"], "options": {"max_pts": 3, "max_points": 0}, "peaks_of": ["q"], "listeners": 3,
    }  # fmt: skip
    common = (
        "at, number 1: found 'a'", "no option 'max_pts'", "options, max_points: found 0", "listeners: found 3",
        "'q' is not among the outputs",
    )  # fmt: skip
    with pytest.raises(InputError) as told:
        ss.forced_response(problem, omega=(5,), **wrong)
    assert_told(told.value, "frequency range: found (5,)", *common)
    with pytest.raises(InputError) as told:
        ss.parameter_response(problem, "damper.mux", (1.0, 1.0), omega=-4.0, **wrong)
    assert_told(told.value, "omega: found -4", "which is empty", "'damper.mux'", *common)
    with pytest.raises(InputError) as told:
        ss.forced_response(3, omega=(2.0, 1.0), options={"max_points": 0}, guess=[1.0])
    assert_told(told.value, "problem: found 3", "options, max_points: found 0")
    with pytest.raises(InputError) as told:
        ss.parameter_response(problem, "damper.mu", (-2.0, -1.0), omega=4.0)
    assert_told(told.value, "mu: found -2.0")


def assert_told(error, *words):
    """Each once, and nothing else."""
    assert len(error.sentences) == len(words), error.sentences
    for said in words:
        assert sum(said in sentence for sentence in error.sentences) == 1, said


def test_defaults_make_smooth_figures_and_any_can_be_changed():
    own = response_options()
    assert own.max_step == 1 / 30
    assert own.output_step == 1 / 120
    assert own.first_step <= own.max_step
    for name in ("max_step", "first_step", "event_tolerance", "output_step", "output_tolerance"):
        assert getattr(response_options(**{name: 1e-4}), name) == 1e-4
    assert isinstance(own, ContinuationOptions)


def test_a_request_holds_the_range_and_what_varies() -> None:
    over_frequency = frequency_request(oscillator(velocity=1.0), (2.0, 5.0), (3.0,))
    assert (over_frequency.start, over_frequency.stop, over_frequency.requested) == (2.0, 5.0, (3.0,))
    over_velocity = parameter_request(oscillator(velocity=1.0), "damper.velocity", (1.0, 2.0), 4.0)
    assert (over_velocity.parameter, over_velocity.omega, over_velocity.stability) == ("damper.velocity", 4.0, None)


def test_all_faults_come_at_once() -> None:
    with pytest.raises(ss.InputError) as caught:
        parameter_request(oscillator(velocity=1.0), "damper.none", (1.0, 1.0), -4.0)
    assert len(caught.value.faults) >= 2
