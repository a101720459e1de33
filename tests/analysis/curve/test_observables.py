"""Outputs between solutions: both ways of evaluating states agree, and resonances are where the structure has them."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.curve.observables import OutputObservables
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.results.record import Outputs
from slipstick.solve.continuation import ContinuationOptions, continuation

K = np.array([[2.0, -0.5], [-0.5, 3.0]])


def solutions():
    """Two neighbouring solutions of two dofs, of which a contact is on the first, and states in between."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.05 * np.eye(2), K=K, dofs=["x", "y"])
    pair = ss.ContactPair(name="c", contact=ss.FrictionContact(kt=1.0, mu=0.3, kn=1.0, gap=-0.5), tangential="x")
    problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=1.0)], harmonics=range(4))
    balance = Balance(problem)
    system = FrequencySystem(balance, problem.inputs)
    run = continuation(system, np.zeros(balance.size), 0.8, 1.2, options=ContinuationOptions(max_step=0.1))
    first, second = next(run), next(run)
    states = np.array([first.state + u * (second.state - first.state) for u in (0.25, 0.5, 0.75)])
    return problem, balance, system, first, second, states


def alone(monkeypatch, observables, *given):
    """The same, one state after the other."""
    monkeypatch.setattr("slipstick.analysis.curve.observables.forces_together", lambda balance: False)
    return observables.between(*given)


def test_states_together_and_one_by_one_say_the_same(monkeypatch):
    _, balance, system, first, second, states = solutions()
    observables = OutputObservables(Outputs(balance, ["x", "y"]), system)
    assert observables.any
    one = observables.between(first, second, states)
    other = alone(monkeypatch, observables, first, second, states)
    dx = 1e-3 * np.random.default_rng(0).normal(size=(3, balance.size))
    assert one.residuals == pytest.approx(other.residuals, rel=1e-10, abs=1e-14)
    assert one.changes(dx) == pytest.approx(other.changes(dx), rel=1e-9)


def test_changes_are_those_of_the_motion_by_the_forces():
    """Over the larger of both solutions' vibrations, to first order in the change."""
    _, balance, system, first, second, states = solutions()
    outputs = Outputs(balance, ["y"])
    observables = OutputObservables(outputs, system)
    dx = 1e-6 * np.random.default_rng(1).normal(size=(1, balance.size))

    def motion(state):
        detail = system.evaluate(state[:-1], float(state[-1])).detail
        force = balance.layout.real(balance.layout.excitation(detail.forces)).reshape(1, balance.n_ports, -1)
        return outputs.far_motion(state[None, :-1], force, detail.inputs.P[None], state[-1:], [{}])[0, 0]

    size = max(np.linalg.norm(motion(end.state)[1:]) for end in (first, second))
    moved = states[0] + np.append(dx[0], 0.0)
    found = observables.between(first, second, states[:1]).changes(dx)
    assert found == pytest.approx([np.linalg.norm(motion(moved) - motion(states[0])) / size], rel=1e-3)


def test_narrow_peaks_may_be_where_an_order_meets_a_natural_frequency():
    _, balance, system, *_ = solutions()
    natural = np.sqrt(np.linalg.eigvalsh(K))
    observables = OutputObservables(Outputs(balance, ["x", "y"]), system)
    every = sorted(w / m for w in natural for m in (1, 2, 3))
    assert observables.narrow(0.0, 10.0) == pytest.approx(every, rel=1e-12)
    assert observables.narrow(1.0, 1.6) == pytest.approx([w for w in every if 1.0 < w < 1.6], rel=1e-12)
    assert not OutputObservables(Outputs(balance, ["x"]), system).any
