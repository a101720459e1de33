"""A balance with some of the harmonics: loads and rubbing motions on others are left out, zero or not."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.oscillator import damper

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.trig.harmonics import Harmonics

LAW = {"kt": 30.0, "mu": 0.3, "normal_load": 130.0}


def stated(*further: ss.Load, **rubbing: object) -> ss.Problem:
    """A lightly damped mass on a belt, whose first point is sought with fewer harmonics."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.02]], K=[[40.0]], dofs=["x"])
    loads = [ss.Load(dof="x", sin=4.0), *further]
    contacts = [damper(4.0, **LAW, **rubbing)]
    return ss.Problem(structure, contacts=contacts, loads=loads, harmonics=range(15))


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("further, rubbing", [
    ([ss.Load(dof="x", harmonic=12, sin=0.0)], {}),
    ([ss.Load(base={"x": 1.0}, motion="displacement", harmonic=12, cos=0.0)], {}),
    ([], {"cos": {12: 0.0}}),
])  # fmt: skip
def test_what_is_zero_on_a_higher_harmonic_changes_nothing(further: list[ss.Load], rubbing: dict) -> None:
    problems = stated(), stated(*further, **rubbing)
    curves = [ss.forced_response(problem, omega=(6.5, 8.0), at=6.6) for problem in problems]
    amplitudes = [float(curve.dataset.amplitude[curve.at(6.6), 0]) for curve in curves]
    assert amplitudes[1] == pytest.approx(amplitudes[0], rel=1e-6)


@pytest.mark.parametrize("name", ["load.x.12.amplitude", "rubbing.cos12"])
@pytest.mark.parametrize("at_first", [0.0, 1.0])
@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_a_higher_harmonic_is_followed_from_zero(name: str, at_first: float) -> None:
    """What the problem itself has there makes no difference."""
    load = ss.Load(dof="x", harmonic=12, cos=at_first if name.startswith("load") else 0.0)
    problem = stated(load, cos={12: 0.0 if name.startswith("load") else at_first})
    branch = ss.parameter_response(problem, name, (0.0, 1.0), omega=7.0)
    assert branch.outcome is ss.Outcome.COMPLETED
    direct = ss.steady_response(problem.with_parameter(name, 1.0), omega=7.0)
    assert float(branch.dataset.amplitude[-1, 0]) == pytest.approx(float(direct.dataset.amplitude[0, 0]), rel=1e-6)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_loads_and_motions_on_harmonics_left_out_are_dropped() -> None:
    problem = stated(ss.Load(dof="x", harmonic=0, cos=2.0), cos={2: 0.5, 3: 0.25})
    balance = Balance(problem)
    narrow = balance.narrowed(Harmonics([0, 2]))
    assert [load.harmonic for load in narrow.problem.loads] == [0]
    assert narrow.problem.contacts[0].rubbing.orders == (2,)
    assert pytest.approx(problem.inputs.P[:, [0, 3, 4]]) == narrow.problem.inputs.P
    assert narrow.n_loads == balance.n_loads == len(narrow.problem.load_columns.places)


def test_steady_sliding_takes_loads_and_motions_of_amplitude_zero() -> None:
    """The Hopf point of two masses that friction couples, in closed form: mu 0.53125 at 10 rad/s."""
    K = [[100.0, -20.0], [-20.0, 60.0]]
    structure = ss.MatrixStructure(M=np.eye(2), C=0.5 * np.eye(2), K=K, dofs=["x", "y"])
    pad = ss.FrictionContact(kt=200.0, mu=0.4, kn=40.0, gap=0.0)
    rubbing = ss.RubbingMotion(velocity=1.0, cos={1: 0.0})
    brake = ss.ContactPair(name="brake", tangential="x", normal="y", contact=pad, rubbing=rubbing)
    loads = [ss.Load(dof="y", harmonic=0, cos=50.0), ss.Load(dof="x", sin=0.0)]
    problem = ss.Problem(structure, contacts=brake, loads=loads, harmonics=range(3))
    for name, at in (("brake.mu", 0.53125), ("friction", 0.53125 / 0.4)):
        hopf = ss.limit_cycles(problem, name, (0.95 * at, 1.001 * at)).bifurcations()[-1]
        assert (hopf.kind, hopf.value, hopf.omega) == ("Hopf", pytest.approx(at, rel=1e-6), pytest.approx(10.0))
