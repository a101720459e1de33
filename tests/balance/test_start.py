"""First points without help, and every rung of the ladder on its own."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.joint import clamped_by_points
from helpers.oscillator import damper, one_mass
from helpers.problems import first_point

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.balance.start import FirstPoint, StrategyTried


def oscillator(velocity: float = 0.0, a: float = 0.0, p: float = 100.0) -> ss.Problem:
    return one_mass(damper(velocity, cos={1: a}), force=p, harmonics=range(11))


@pytest.mark.parametrize("omega", [2.0, 6.3])
@pytest.mark.parametrize("velocity, a, p", [
    *((v, 0.0, 100.0) for v in (0, 0.01, 1, 10, 50, 100, 250, -1)),
    *((0.0, a, 0.0) for a in (1, 2, 5, 10, 20, 50)),
    *((v, 2.0, 100.0) for v in (0, 1, 10, 20, 50, 100)),
])  # fmt: skip
def test_every_curve_starts(velocity: float, a: float, p: float, omega: float) -> None:
    tried: list[StrategyTried] = []
    problem = oscillator(velocity, a, p)
    x = first_point(problem, omega, report=tried.append)
    assert x is not None
    assert tried[-1].found
    assert not any(event.found for event in tried[:-1])
    residual = FrequencySystem(Balance(problem), problem.inputs).evaluate(x, omega).residual
    # corrections are below 1e-10; near resonance the residual is larger by the norm of the Jacobian, some 40
    assert np.linalg.norm(residual) < 1e-8 * np.linalg.norm(x)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("velocity, a", [(0.0, 0.0), (1.0, 0.0), (10.0, 2.0), (-20.0, 0.0)])
def test_every_strategy_finds_the_same_point(velocity: float, a: float) -> None:
    problem = oscillator(velocity, a)
    search = FirstPoint(Balance(problem), problem.inputs, 3.0, guess=np.zeros(21))
    names, found = [], []
    for name, attempt in search.strategies():
        x = attempt()
        if x is not None:
            names.append(name)
            found.append(x)
    for words in ("guess", "linear", "fewer harmonics", "load ramp", "friction ramp", "normal load ramp", "homotopy"):
        assert any(words in name for name in names), f"{words} found nothing"
    assert any("velocity ramp" in name for name in names) == (velocity != 0)
    for x in found:
        assert x == pytest.approx(found[0], abs=1e-8 * np.linalg.norm(found[0]))


def test_a_problem_without_solution_in_reach_is_reported() -> None:
    """A guess that is no number makes that rung fail with its reason; the next one finds the point."""
    tried: list[StrategyTried] = []
    problem = oscillator(10.0)
    x = FirstPoint(Balance(problem), problem.inputs, 3.0, guess=np.full(21, np.nan), report=tried.append).find()
    assert x is not None
    assert not tried[0].found
    assert tried[0].reason


@pytest.mark.parametrize("slow", [1e-3, 1e-6])
def test_friction_that_reverses_fast_is_found_from_a_smoother_one(slow: float) -> None:
    """The last decades change next to nothing, and few evaluations are needed: most are those of the smoother one."""
    spin, tried = ss.RubbingMotion(velocity=3.3), list[StrategyTried]()

    def rotor(slow: float) -> ss.Problem:
        law = ss.models.StatorContact(kn=400.0, gap=0.1, mu=0.2, slip_velocity=slow)
        return ss.Problem(
            ss.models.jeffcott_rotor(mass=2.0, stiffness=50.0, damping=1.0),
            contacts=ss.ContactPair(name="stator", contact=law, ports={"x": "x", "y": "y"}, rubbing=spin),
            loads=[ss.Load(dof="x", cos=60.0), ss.Load(dof="y", sin=-58.0)], harmonics=range(6),
        )  # fmt: skip

    problem, omega, told = rotor(slow), 9.4, []
    balance = Balance(problem)
    balance.pulse.felt = lambda: told.append(None)
    x = FirstPoint(balance, problem.inputs, omega, report=tried.append).find()
    assert x is not None
    assert tried[-1].name == "smoother friction first"
    assert len(told) < 400
    residual = FrequencySystem(Balance(problem), problem.inputs).evaluate(x, omega).residual
    assert np.linalg.norm(residual) < 1e-8 * np.linalg.norm(x)
    names = [name for name, _ in FirstPoint(Balance(rotor(10.0)), rotor(10.0).inputs, omega).strategies()]
    assert "smoother friction first" not in names


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")  # half of the surfaces do not meet
def test_a_clamped_joint_begins_from_its_equilibrium_at_rest() -> None:
    """Contacts that are open at rest pull in a linear guess that has them closed."""
    problem = clamped_by_points()
    balance = Balance(problem)
    search = FirstPoint(balance, problem.inputs, 1.2e4)
    x = dict(search.strategies())["at rest first"]()
    assert x is not None
    value = FrequencySystem(balance, problem.inputs).evaluate(x, 1.2e4)
    assert np.linalg.norm(value.residual) < 1e-8 * np.linalg.norm(x)
    rest = Balance(problem).narrowed(ss.Harmonics([0]))
    still = FirstPoint(rest, rest.problem.inputs, 1.2e4).find()
    assert still is not None
    forces = FrequencySystem(rest, rest.problem.inputs).evaluate(still, 1.2e4).detail.responses[0].detail
    assert np.any(forces.separation_fraction == 1.0)


def test_without_static_loads_nothing_rests() -> None:
    search = FirstPoint(Balance(one_mass(damper())), one_mass(damper()).inputs, 3.0)
    assert "at rest first" not in [name for name, _ in search.strategies()]
