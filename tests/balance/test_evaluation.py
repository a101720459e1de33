"""Many states at once: what each of them gives alone."""

import numpy as np
import pytest
from helpers.problems import random_problem

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem, Together, detail, evaluated_together, respond
from slipstick.balance.inputs import Assigned
from slipstick.balance.parameters import parameter_path
from slipstick.solve.norm import norm
from slipstick.trig.harmonics import Harmonics


def states(seed, count=5):
    """A balance, unknowns (count, N) and frequencies of states that are no solutions."""
    rng, problem = np.random.default_rng(seed), random_problem(seed)
    balance = Balance(problem)
    return problem, balance, rng.normal(size=(count, balance.size)), rng.uniform(0.5, 3.0, count)


@pytest.mark.parametrize("seed", range(6))
def test_forces_and_residuals_are_those_of_each_alone(seed):
    problem, balance, x, omega = states(seed)
    inputs = [problem.inputs.scaled(1.0 + 0.1 * i) for i in range(len(x))]
    found = Together(balance, x, omega, Assigned.of(inputs))
    together, residuals, whole = found.responses, found.relative_residuals(), found.residuals()
    for i in range(len(x)):
        alone = FrequencySystem(balance, inputs[i]).evaluate(x[i], float(omega[i]))
        terms = alone.terms()
        assert whole[i] == pytest.approx(alone.residual, rel=1e-10, abs=1e-12 * np.abs(terms).max())
        assert residuals[i] == pytest.approx(norm(alone.residual / np.where(terms > 0, terms, 1.0)), rel=1e-10)
        for batch, all_states, other in zip(balance.batches, together, alone.detail.responses, strict=True):
            own = slice(i * batch.count, (i + 1) * batch.count)
            assert all_states.work[own] == pytest.approx(other.work, rel=1e-12)
            for name, value in other.values.items():
                assert np.array_equal(all_states.values[name][own], value)
            for a, b in zip(all_states.force, other.force, strict=True):
                assert a[own] == pytest.approx(b, rel=1e-12, abs=1e-12 * np.abs(b).max())
            assert all_states.detail.stick_fraction[own] == pytest.approx(other.detail.stick_fraction, abs=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_forces_on_the_ports_are_those_of_the_laws(seed: int) -> None:
    """Element by element, and their slopes by central differences at fixed motion."""
    problem, balance, (x, *_), (omega, *_) = states(seed)
    found, step = detail(balance, x, omega, problem.inputs), 1e-6

    def expected(at: float) -> np.ndarray:
        out = np.zeros((balance.n_ports, balance.L))
        for k, inputs in enumerate(problem.inputs.batches):
            batch = balance.batches[k]
            motion = balance.layout.motion(k, x, at, inputs)
            for i, force in enumerate(batch.law.respond(motion, inputs.values).force):
                for row, one in zip(batch.rows[i], force, strict=True):
                    if row >= 0:
                        out[row] = one
        return out

    forces, slopes = found.on_ports
    assert forces == pytest.approx(expected(omega), rel=1e-13, abs=1e-13 * np.abs(forces).max())
    difference = (expected(omega + step) - expected(omega - step)) / (2.0 * step)
    assert slopes == pytest.approx(difference, rel=1e-5, abs=1e-7 * np.abs(forces).max())


class Doubled(ss.FrictionContact):
    """Friction of twice the force: a law of a user's own, made from one with a compiled call."""

    kind = "doubled"

    def respond(self, motion, values):
        one = super().respond(motion, values)
        twice = {pair: 2.0 * tangent for pair, tangent in one.by_motion.items()}
        return one._replace(force=tuple(2.0 * part for part in one.force), by_motion=twice)


def test_a_law_made_from_friction_is_asked_for_its_own_forces() -> None:
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.1]], K=[[30.0]], dofs=["x"])
    laws = [law(kt=4.0, mu=0.3, kn=2.0, gap=-1.0) for law in (ss.FrictionContact, Doubled)]
    x, forces = np.array([0.0, 1.0, 0.2]), []
    for law in laws:
        pair = ss.ContactPair(name="c", contact=law, tangential="x")
        problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", cos=1.0)], harmonics=[0, 1])
        forces.append(detail(Balance(problem), x, 2.0, problem.inputs).on_ports[0])
    assert forces[1] == pytest.approx(2.0 * forces[0], rel=1e-14)
    assert np.abs(forces[0]).max() > 0.1


class Halved(ss.FrictionContact):
    """Friction of half the force that says nothing on its kind."""

    def respond(self, motion, values):
        one = super().respond(motion, values)
        half = {pair: 0.5 * tangent for pair, tangent in one.by_motion.items()}
        return one._replace(force=tuple(0.5 * part for part in one.force), by_motion=half, work=0.5 * one.work)


@pytest.mark.parametrize("first", [0, 1])
def test_a_law_made_from_friction_stands_beside_it(first) -> None:
    """Half the force is that of half the stiffness and half the coefficient; what is not told of it is not known."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.1 * np.eye(2), K=[[40.0, -10.0], [-10.0, 30.0]], dofs=["x", "y"])
    whole = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=1.0)
    same, own = ss.FrictionContact(kt=50.0, mu=0.15, normal_load=1.0), Halved(kt=100.0, mu=0.3, normal_load=1.0)
    amplitudes = []
    for other in (same, own):
        laws = (whole, other) if first else (other, whole)
        pairs = [ss.ContactPair(name=dof, contact=law, tangential=dof) for dof, law in zip("xy", laws, strict=True)]
        problem = ss.Problem(structure, contacts=pairs, loads=ss.Load(dof="x", cos=2.0), harmonics=3)
        amplitudes.append(ss.steady_response(problem, omega=3.0).dataset.amplitude.values)
    np.testing.assert_allclose(*amplitudes, rtol=1e-8)
    with pytest.raises(ss.InputError, match="does not tell its rate in time"):
        ss.steady_response(problem, omega=3.0, stability=True)


@pytest.mark.parametrize("seed", range(3))
def test_forces_change_with_the_motion_as_those_of_each_alone(seed):
    problem, balance, x, omega = states(seed)
    dx = np.random.default_rng(seed).normal(size=x.shape)
    changes = Together(balance, x, omega, Assigned.of([problem.inputs] * len(x))).force_changes(dx)
    system = FrequencySystem(balance, problem.inputs)
    for own, state, w, change in zip(dx, x, omega, changes, strict=True):
        forces, _ = system.rates(system.evaluate(state, float(w)).detail, float(w), own, 0.0)
        alone = balance.layout.real(balance.layout.excitation(forces)).reshape(change.shape)
        assert change == pytest.approx(alone, rel=1e-10, abs=1e-12 * np.abs(alone).max())


def test_a_parameter_of_the_structure_that_varies():
    structure = ss.ModalStructure(
        omega=[2.0, 5.0], mode_shapes=np.array([[0.6, 0.8], [0.8, -0.6]]), dofs=["x", "y"], loss_factor=0.02,
    )  # fmt: skip
    pair = ss.ContactPair(name="c", contact=ss.FrictionContact(kt=4.0, mu=0.3, kn=2.0, gap=-1.0), tangential="x")
    problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="y", sin=1.0)], harmonics=range(4))
    balance, path = Balance(problem), parameter_path(problem, "loss_factor")
    x = np.random.default_rng(0).normal(size=(3, balance.size))
    inputs = [path.at(value)[0] for value in (0.01, 0.02, 0.3)]
    residuals = Together(balance, x, np.full(3, 2.5), Assigned.of(inputs)).relative_residuals()
    for i, one in enumerate(inputs):
        alone = FrequencySystem(balance, one).evaluate(x[i], 2.5)
        assert residuals[i] == pytest.approx(norm(alone.residual / alone.terms()), rel=1e-10)


def test_further_harmonics_leave_the_forces_of_the_others_as_they_are():
    problem, balance, x, omega = states(3)
    own = balance.harmonics
    wide = Harmonics(range(own.highest + 4))
    for k in range(len(balance.batches)):
        plain = respond(balance, k, x, omega, Assigned.of([problem.inputs] * len(x)).contacts(k))[1]
        more = respond(balance, k, x, omega, Assigned.of([problem.inputs] * len(x)).contacts(k), wide)[1]
        at = [wide.index(0), *(wide.index(m, part) for m in own.orders[1:] for part in ("c", "s"))]
        for a, b in zip(plain.force, more.force, strict=True):
            assert b[:, at] == pytest.approx(a, abs=1e-11 * np.abs(a).max())


def test_heat_and_springs_on_both_sides_are_evaluated_one_by_one():
    balance = states(0)[1]
    assert evaluated_together(balance)
    balance.springs = np.ones(balance.n_ports)
    assert not evaluated_together(balance)


def test_inputs_of_many_motions_are_those_of_each():
    problem = random_problem(1)
    distinct = [problem.inputs, problem.inputs.scaled(2.0)]
    many = Assigned.of([distinct[1], distinct[0], distinct[1]])
    assert (len(many.distinct), many.which.tolist(), len(many.at([2]))) == (2, [0, 1, 0], 1)
    assert np.array_equal(many.loads, [distinct[1].P, distinct[0].P, distinct[1].P])
    for k, first in enumerate(problem.inputs.batches):
        together, twice = many.contacts(k), many.at(np.array([1, 2])).contacts(k)
        for name, value in first.values.items():
            assert np.array_equal(together.values[name], np.concatenate([2.0 * value, value, 2.0 * value]))
            assert np.array_equal(twice.values[name], np.concatenate([value, 2.0 * value]))
        motion = [scale * first.motion for scale in (2.0, 1.0, 2.0)]
        assert np.array_equal(together.motion, np.concatenate(motion, axis=1))
        alike = Assigned.of([distinct[1]] * 3).contacts(k)
        assert np.array_equal(alike.motion, np.concatenate([2.0 * first.motion] * 3, axis=1))
        assert np.array_equal(alike.velocity, np.concatenate([2.0 * first.velocity] * 3, axis=1))
        for name, value in first.values.items():
            assert np.array_equal(alike.values[name], np.concatenate([2.0 * value] * 3))
