"""Periodic states found by the slow modes against those of Newton's method on all modes, and against long marching."""

import numpy as np
import pytest
from helpers.benchmarks import benchmark
from scipy.linalg import expm

import slipstick as ss
from slipstick.analysis.time_domain import shooting
from slipstick.analysis.time_domain.event_integrator import ChatteringError, Stepper
from slipstick.analysis.time_domain.initial_state import start_at_rest
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear, State
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.analysis.time_domain.shooting import SlowModes

OMEGA = 9.0


def beam(modes=60, velocity=0.0, normal=True, damping=0.02, harmonics=range(6), order=1, loads=1.0, gap=-0.02):
    """Modes of a clamped bar, alternately along and across, with two contacts; no residual beside the modes."""
    rank = np.arange(1, modes + 1)
    omega = 10.0 * (2 * rank - 1)
    shapes = np.zeros((4, modes))
    for k, place in enumerate((0.6, 1.0)):
        sine = np.sin((rank - 0.5) * np.pi * place)
        shapes[2 * k], shapes[2 * k + 1] = sine * np.cos(0.3 * rank), sine * np.sin(0.3 * rank)
    dofs = ("x1", "y1", "x2", "y2")
    structure = ss.ModalStructure(omega=omega, mode_shapes=shapes, dofs=dofs, damping_ratio=damping)
    contact = ss.FrictionContact(kt=60.0, mu=0.4, kn=80.0, gap=gap)
    pairs = [
        ss.ContactPair(
            name=f"c{k}", contact=contact, tangential=f"x{k}", normal=f"y{k}" if normal else None,
            rubbing=ss.RubbingMotion(velocity=velocity),
        )
        for k in (1, 2)
    ]  # fmt: skip
    load = ss.Load(dof="x2", harmonic=order, sin=30.0 * loads)
    return ss.Problem(structure, contacts=pairs, loads=[load], harmonics=harmonics)


def stepper_of(problem, omega=OMEGA):
    return Stepper(PiecewiseLinear(friction_system(problem, omega)))


def of_all_modes(monkeypatch, problem, omega, **options):
    with monkeypatch.context() as patch:
        patch.setattr(SlowModes, "of", classmethod(lambda cls, whole: None))
        return ss.transient(problem, omega, **options)


def assert_same(a, b, rtol):
    """All outputs; ``rtol`` is that of their size."""
    assert a.converged
    assert b.converged
    size, force = b.amplitude.max(), np.abs(b.friction_coefficients).max()
    sizes = {
        "amplitude": size, "mean": size, "coefficients": size, "power": size * force * b.omega,
        "friction_coefficients": force, "normal_coefficients": np.abs(b.normal_coefficients).max(),
    }  # fmt: skip
    for name, of in sizes.items():
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=0, atol=rtol * of, err_msg=name)
    np.testing.assert_allclose(a.fractions, b.fractions, atol=100 * rtol)
    assert [(c.contact, c.before, c.after) for c in a.changes] == [(c.contact, c.before, c.after) for c in b.changes]
    np.testing.assert_allclose([c.time for c in a.changes], [c.time for c in b.changes], atol=100 * rtol)


@pytest.mark.parametrize("velocity", [0.0, 1.0])
@pytest.mark.parametrize("normal", [True, False])
def test_outputs_are_those_of_newton_on_all_modes(monkeypatch, velocity, normal):
    """Both close the period of all modes to 1e-11: the states are as near to each other as damping lets them be."""
    problem = beam(velocity=velocity, normal=normal)
    cheap = ss.transient(problem, OMEGA, tolerance=1e-11)
    assert cheap.changes
    assert_same(cheap, of_all_modes(monkeypatch, problem, OMEGA, tolerance=1e-11), 1e-8)


@pytest.mark.parametrize("velocity", [0.0, 1.0])
def test_every_period_of_all_modes_is_far_nearer_to_closing(velocity):
    """The derivative of all modes is never needed, and four periods of them are as good as Newton's method."""
    stepper = stepper_of(beam(velocity=velocity, damping=0.001, gap=-0.1))
    ends = []
    for end in shooting._by_slow_modes(SlowModes.of(stepper), *start_at_rest(stepper)):
        ends.append(end)
        if end.change < 1e-10:
            break
    assert ends[-1].change < 1e-10
    assert np.all(np.diff(np.log10([end.change for end in ends])) < -1.7)
    for end in ends[:-1]:
        away = shooting.relative_change(stepper, ends[-1].z, end.z, end.states)
        assert 0.3 * away < end.error < 3.0 * away


def test_marching_ends_in_the_same_motion():
    problem = beam(velocity=1.0, damping=0.1)
    cheap = ss.transient(problem, OMEGA, tolerance=1e-11)
    assert_same(cheap, ss.transient(problem, OMEGA, method="march", tolerance=1e-11, periods=400), 1e-8)


@pytest.mark.verify
def test_reduced_blade_point(monkeypatch):
    """128 modes and a static residual, 8 contacts that open, stick and slip: two roads to one motion."""
    problem = benchmark("curves").blade(viscous=True)
    branch = ss.forced_response(problem, omega=2 * np.pi * np.array([307.7, 307.8]))
    cheap = branch.check_in_time(0)
    with monkeypatch.context() as patch:
        patch.setattr(SlowModes, "of", classmethod(lambda cls, whole: None))
        dense = branch.check_in_time(0)
    assert cheap.converged
    assert dense.converged
    assert cheap.relative_difference == pytest.approx(dense.relative_difference, rel=1e-5)
    np.testing.assert_allclose(cheap.amplitude_in_time, dense.amplitude_in_time, rtol=1e-8)


def test_fast_modes_that_follow_are_static():
    """Under a force that stays the state of all modes is the static one, whatever is fast."""
    stepper = stepper_of(beam(loads=0.0))
    slow = SlowModes.of(stepper)
    z, states = start_at_rest(stepper)
    K, _ = stepper.model.modal_rates
    linear, n = stepper.model(states), stepper.model.system.n
    A, loaded = linear.A, linear.A[:, stepper.model.system.n_dynamic]
    still = np.linalg.solve(A[: 2 * n, : 2 * n], -loaded[: 2 * n])
    z[: 2 * n] = still
    rest = z.copy()
    few = slow._parts(z)[0]
    np.testing.assert_allclose(slow.followed(few, states), rest, atol=1e-13 * np.abs(rest).max())
    np.testing.assert_allclose(slow.stepper.model(states).fx @ few, linear.fx @ rest, atol=1e-12)
    assert K[slow.fast].min() > 64.0**2 > K[slow.slow].max()


def test_a_correction_closes_the_period_of_a_linear_structure():
    """Without contacts modes are alone: one correction of the start closes the period, wherever it began."""
    problem = ss.Problem(beam().structure, loads=beam().loads, harmonics=range(3))
    stepper = stepper_of(problem)
    slow = SlowModes.of(stepper)
    z, states = start_at_rest(stepper)
    z[: 2 * stepper.model.system.n] = np.random.default_rng(2).normal(size=2 * stepper.model.system.n)
    Phi = shooting.one_period(slow.stepper, slow.restricted(z, states), states, True)
    shooting.one_period(stepper, z, states, False)
    start = slow.corrected(z, stepper.z, states, Phi, {states: 1.0})
    shooting.one_period(stepper, start, states, False)
    np.testing.assert_allclose(stepper.z, start, atol=1e-11)


def test_without_many_fast_modes_nothing_is_left_out():
    assert SlowModes.of(stepper_of(beam())) is not None
    assert SlowModes.of(stepper_of(beam(modes=40))) is None
    assert SlowModes.of(stepper_of(beam(order=5))) is None
    coupled = np.eye(60) + 0.01 * np.eye(60, k=1) + 0.01 * np.eye(60, k=-1)
    matrices = ss.MatrixStructure(
        M=np.eye(60), C=coupled, K=np.diag(np.arange(1.0, 61.0) ** 6), dofs=[f"x{k}" for k in range(60)]
    )
    pair = ss.ContactPair(name="c", contact=ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0), tangential="x0")
    problem = ss.Problem(matrices, contacts=[pair], loads=[ss.Load(dof="x0", sin=1.0)], harmonics=range(3))
    assert SlowModes.of(stepper_of(problem, 1.0)) is None


@pytest.mark.parametrize("how", ["nonsense", "chatters", "never periodic"])
def test_where_the_slow_modes_lead_nowhere_all_modes_go_on(monkeypatch, how):
    problem = beam(velocity=1.0)
    right = ss.transient(problem, OMEGA)
    if how == "nonsense":
        monkeypatch.setattr(SlowModes, "corrected", lambda self, z, *rest: -z)
    elif how == "chatters":

        def chatters(*arguments):
            raise ChatteringError("states keep changing")

        monkeypatch.setattr(SlowModes, "followed", chatters)
    else:
        monkeypatch.setattr(shooting, "_MOST_SLOW", 1)
    assert_same(ss.transient(problem, OMEGA), right, 1e-6)


@pytest.mark.parametrize("modal", [True, False])
def test_steps_taken_at_once_are_the_matrix_exponential(modal):
    """Modes that are alone, and coupled coordinates: both ways of the compiled rates, with contacts and without."""
    problem = beam(modes=6, velocity=1.0)
    if not modal:
        C = np.diag(np.full(4, 2.0)) + 0.3
        K = np.diag([400.0, 900.0, 1600.0, 2500.0]) - 100.0
        structure = ss.MatrixStructure(M=np.eye(4) + 0.1, C=C, K=K, dofs=("x1", "y1", "x2", "y2"))
        problem = ss.Problem(structure, contacts=problem.contacts, loads=problem.loads, harmonics=range(3))
    stepper = stepper_of(problem)
    assert (stepper.model.modal_rates is not None) == modal
    z = np.random.default_rng(3).normal(size=stepper.model.system.size)
    z[stepper.model.system.n_dynamic :] = stepper.model.system.forcing(0.0)
    for states in ((State.STICK, State.SLIP_PLUS), (State.SEPARATION, State.SLIP_MINUS)):
        linear = stepper.model(states)
        exact = expm(linear.A * stepper.step)
        powers = stepper.powers(linear, z)
        np.testing.assert_allclose(powers.sum(axis=0), exact @ z, atol=1e-12 * np.abs(z).max())
        np.testing.assert_allclose(powers[1], linear.A @ z * stepper.step, atol=1e-12 * np.abs(powers[1]).max())
        far = np.linalg.matrix_power(exact, 40)
        moved = stepper.propagate(linear, np.eye(len(z)), 40.0)
        np.testing.assert_allclose(moved, far, atol=1e-10 * np.abs(far).max())
