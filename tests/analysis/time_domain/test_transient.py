"""Time integration against exact values, closed forms, a full model and a plain integrator."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.analysis.time_domain.initial_state import HarmonicStart
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.contact.law import Law
from slipstick.verify import closed_forms as cf
from slipstick.verify.cases import EXACT_OSCILLATOR, oscillator


@pytest.mark.parametrize(("velocity", "omega"), sorted(EXACT_OSCILLATOR))
def test_exact_oscillator(velocity, omega):
    """The reference values are given to 1e-6 and their amplitudes were read from samples (5e-7 relative too small)."""
    mean, amplitude = EXACT_OSCILLATOR[velocity, omega]
    r = ss.transient(oscillator(velocity=velocity), omega)
    assert r.converged
    assert r.mean[0] == pytest.approx(mean, abs=1e-6)
    assert r.amplitude[0] == pytest.approx(amplitude, rel=1e-6)


def test_marching_and_shooting_find_the_same():
    problem = oscillator(velocity=10.0)
    a = ss.transient(problem, 6.0, method="march", tolerance=1e-11, periods=300)
    b = ss.transient(problem, 6.0, tolerance=1e-11)
    assert a.converged
    assert b.periods < a.periods / 5
    np.testing.assert_allclose(a.coefficients, b.coefficients, atol=1e-9)
    assert [(c.before, c.after) for c in a.changes] == [(c.before, c.after) for c in b.changes]
    np.testing.assert_allclose([c.time for c in a.changes], [c.time for c in b.changes], atol=1e-9)


def test_result_does_not_depend_on_the_step():
    problem = oscillator(velocity=10.0)
    a, b = (ss.transient(problem, 4.2, steps=steps, tolerance=1e-12) for steps in (48, 400))
    np.testing.assert_allclose(a.coefficients, b.coefficients, atol=1e-10)
    np.testing.assert_allclose(a.power, b.power, rtol=1e-10)
    # the largest value is read from cubics between the steps: fourth order
    assert a.amplitude[0] == pytest.approx(b.amplitude[0], rel=1e-6)


def test_energy_balance():
    """Work of the load = damping + friction, over a period; with 400 harmonics the sum of the damping is complete."""
    problem = oscillator(velocity=10.0, harmonics=range(401))
    omega = 4.2
    r = ss.transient(problem, omega, tolerance=1e-12)
    rate = omega * problem.harmonics.derivative(r.coefficients[0])
    supplied = 100.0 * rate[problem.harmonics.index(1, "s")] / 2
    damped = 0.4 * np.sum(rate**2) / 2
    # the rubbing drive feeds energy too: its force is the mean friction force
    driven = 10.0 * r.friction_coefficients[0, 0]
    assert supplied + driven == pytest.approx(damped + r.power[0], rel=1e-9)


def test_slip_threshold():
    """CF10: above the threshold no stick, below it one interval, and the power is mu N v_tilde in full slip."""
    omega = 5.0
    threshold = cf.slip_threshold(1.0, 0.4, 40.0, 100.0, omega)
    above = ss.transient(oscillator(velocity=threshold * 1.001), omega)
    below = ss.transient(oscillator(velocity=threshold * 0.999), omega)
    np.testing.assert_allclose(above.fractions, [[0, 0, 1, 0]], atol=1e-12)
    assert [c.after for c in below.changes] == ["stick", "slip+"]
    assert above.power[0] == pytest.approx(240.0 * threshold * 1.001, rel=1e-9)
    assert above.mean[0] == pytest.approx(-6.0, abs=1e-9)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_rigid_coulomb_friction_is_approached_like_one_over_root_kt():
    """CF9 (Den Hartog): slope -1/2 of the difference over the tangential stiffness."""
    k, p, b, omega = 1.0, 1.0, 0.5, 0.9
    exact = cf.den_hartog(1.0, k, p, b, omega)
    stiffness = 10.0 ** np.array([4.0, 4.5, 5.0])
    found = []
    for kt in stiffness:
        structure = ss.MatrixStructure(M=[[1.0]], C=[[0.0]], K=[[k]], dofs=["x"])
        contact = ss.FrictionContact(kt=kt, mu=b, kn=1.0, gap=-1.0)
        pair = ss.ContactPair(name="c", contact=contact, tangential="x")
        problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", cos=p)], harmonics=range(2))
        found.append(ss.transient(problem, omega, tolerance=1e-12).amplitude[0])
    slope = np.polyfit(np.log(stiffness), np.log(np.abs(np.array(found) - exact)), 1)[0]
    assert slope == pytest.approx(-0.5, abs=0.02)


def two_masses(kt=3.0, mu=0.4, velocity=0.3, gap=0.2, **options):
    """Tangential and normal motion of a mass that opens and closes a contact, coupled by an oblique spring."""
    structure = ss.MatrixStructure(
        M=np.diag([1.0, 1.5]), C=[[0.1, 0.02], [0.02, 0.2]], K=[[4.0, 0.7], [0.7, 6.0]], dofs=["x", "y"]
    )
    contact = ss.FrictionContact(kt=kt, mu=mu, kn=5.0, gap=gap)
    rubbing = ss.RubbingMotion(velocity=velocity, cos={1: 0.1})
    pair = ss.ContactPair(name="c", contact=contact, tangential="x", normal="y", rubbing=rubbing)
    loads = [ss.Load(dof="x", sin=2.0), ss.Load(dof="y", cos=3.0), ss.Load(dof="y", harmonic=0, cos=1.0)]
    return ss.Problem(structure, contacts=[pair], loads=loads, harmonics=range(8), **options)


def plain_integration(omega, periods, steps):
    """Of ``two_masses``: leapfrog with the force carried from step to step (first order at the changes of state)."""
    M, C = np.array([1.0, 1.5]), np.array([[0.1, 0.02], [0.02, 0.2]])
    K = np.array([[4.0, 0.7], [0.7, 6.0]])
    h = 2 * np.pi / omega / steps
    left = np.linalg.inv(np.diag(M) + h / 2 * C)
    again, pushed = left @ (np.diag(M) - h / 2 * C), h * left
    q, p, fx = np.zeros(2), np.zeros(2), 0.0
    path = np.zeros((steps, 2))
    for i in range(periods * steps):
        t = (i + 0.5) * h
        q_half = q + h / 2 * p
        fy = 5.0 * max(q_half[1] - 0.2, 0.0)
        moved = h * (p[0] + 0.3 - 0.1 * omega * np.sin(omega * t))
        fx = min(max(fx + 3.0 * moved, -0.4 * fy), 0.4 * fy)
        force = np.array([2 * np.sin(omega * t) - fx, 3 * np.cos(omega * t) + 1 - fy]) - K @ q_half
        p = again @ p + pushed @ force
        q = q_half + h / 2 * p
        path[i % steps] = q
    return path


def test_opening_contact_against_a_plain_integrator():
    r = ss.transient(two_masses(), 1.3, periods=60, tolerance=1e-11)
    assert r.converged
    assert {c.after for c in r.changes} >= {"separation", "stick"}
    error = []
    for steps in (300, 1200):
        path = plain_integration(1.3, 60, steps)
        error.append(np.abs(path.mean(axis=0) - r.mean).max())
        half_range = np.ptp(path, axis=0) / 2
    assert error[1] < error[0] / 2.5
    assert error[1] < 1e-3
    np.testing.assert_allclose(half_range, np.ptp(r.displacement, axis=0) / 2, rtol=1e-3)


def stiff_tail(modes):
    """Three masses of which the contact sits on a nearly massless one; all modes or the first with static residual."""
    M, K = np.diag([1.0, 1.0, 1e-4]), np.array([[50.0, -20, 0], [-20, 60, -40], [0, -40, 40]])
    w2, phi = np.linalg.eigh(np.diag(np.diag(M) ** -0.5) @ K @ np.diag(np.diag(M) ** -0.5))
    phi = np.diag(M)[:, None] ** -0.5 * phi
    structure = ss.ModalStructure(
        omega=np.sqrt(w2[:modes]), mode_shapes=phi[:, :modes], static_compliance=np.linalg.inv(K),
        dofs=["a", "b", "c"], damping_ratio=0.02,
    )  # fmt: skip
    contact = ss.FrictionContact(kt=30.0, mu=0.3, kn=1.0, gap=-10.0)
    pair = ss.ContactPair(name="d", contact=contact, tangential="c", rubbing=ss.RubbingMotion(velocity=0.4))
    return ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="a", sin=12.0)], harmonics=range(6))


def test_static_residual_acts_at_once():
    """Two modes and the static residual of the third against all three: the residual's error is (omega / omega_3)^2."""
    omega = 5.0
    full = ss.transient(stiff_tail(3), omega, tolerance=1e-11, periods=400)
    reduced = ss.transient(stiff_tail(2), omega, tolerance=1e-11, periods=400)
    assert full.converged
    assert reduced.converged
    assert {c.after for c in reduced.changes} >= {"stick", "slip+"}
    np.testing.assert_allclose(reduced.coefficients, full.coefficients, atol=2e-4 * np.abs(full.coefficients).max())
    np.testing.assert_allclose(reduced.power, full.power, rtol=1e-3)


def test_start_from_a_harmonic_solution_needs_few_periods():
    """The contact's motion known to 15 harmonics: the march starts where it ends."""
    problem = oscillator(velocity=10.0, harmonics=range(16))
    exact = ss.transient(problem, 6.0, tolerance=1e-12)
    start = HarmonicStart(harmonics=problem.harmonics, tangential=exact.coefficients, normal=0 * exact.coefficients)
    r = ss.transient(problem, 6.0, initial=start, method="march", periods=1)
    assert r.change < 1e-3
    np.testing.assert_allclose(r.coefficients, exact.coefficients, atol=1e-3 * np.abs(exact.coefficients).max())
    cold = ss.transient(problem, 6.0, method="march", periods=1)
    assert cold.change > 20 * r.change


def test_period_ratio_and_recorded_periods():
    """Excitation on the second, rubbing on the third harmonic of the fundamental frequency."""
    problem = one_mass(damper(5.0, cos={1: 2.0}), harmonics=range(13), period_ratio=(3, 2))
    r = ss.transient(problem, 2.0, record_periods=2)
    assert r.converged
    assert r.time[-1] < 2 * 2 * np.pi / 2.0
    assert r.time[-1] > 0.99 * 2 * 2 * np.pi / 2.0
    assert np.abs(r.coefficients[0, 3:7]).min() > 1e-3


def test_bad_options_are_said_all_at_once():
    with pytest.raises(ss.InputError) as error:
        ss.transient(oscillator(), -1.0, periods=0, method="jump")
    assert len(error.value.sentences) == 3


def test_linear_structure_without_contacts():
    structure = ss.MatrixStructure(M=np.diag([1.0, 2.0]), C=0.3 * np.eye(2), K=[[5.0, -1], [-1, 3]], dofs=["a", "b"])
    problem = ss.Problem(structure, loads=[ss.Load(dof="a", cos=1.0), ss.Load(dof="b", harmonic=2, sin=2.0)])
    r = ss.transient(problem, 1.1)
    h = problem.harmonics
    for m, force in ((1, [1.0, 0.0]), (2, [0.0, -2.0j])):
        Z = np.array([[5.0, -1], [-1, 3]]) - (1.1 * m) ** 2 * np.diag([1.0, 2.0]) + 0.3j * 1.1 * m * np.eye(2)
        x = np.linalg.solve(Z, force)
        np.testing.assert_allclose(r.coefficients[:, h.index(m, "c")], x.real, atol=1e-10)
        np.testing.assert_allclose(r.coefficients[:, h.index(m, "s")], -x.imag, atol=1e-10)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("name", ["mu", "kt"])
def test_contact_without_friction(name):
    """mu = 0 or kt = 0: the normal contact alone acts."""
    problem = two_masses(**{name: 0.0})
    r = ss.transient(problem, 1.3, tolerance=1e-11)
    np.testing.assert_allclose(r.friction_force, 0.0, atol=1e-15)
    assert r.normal_force.max() > 0.1
    assert r.fractions[0, 0] > 0.1


def test_massless_structure_is_refused():
    """MatrixStructure refuses it before; a structure of another making need not."""
    system = friction_system(oscillator(), 1.0)
    massless = replace(system, equations=replace(system.equations, M=np.zeros((1, 1))))
    with pytest.raises(ss.InputError, match="mass matrix is singular"):
        PiecewiseLinear(massless)


def test_held_parameters_replace_those_of_the_problem():
    problem = oscillator(velocity=10.0)
    light = ss.transient(problem, 6.0, held={"gap": np.array([-400.0])})
    np.testing.assert_allclose(
        light.coefficients, ss.transient(oscillator(velocity=10.0, normal_load=400.0), 6.0).coefficients, atol=1e-8
    )
    with raises_fault("time integration, held", found="'k'", expected="one of mu, kt, kn, gap"):
        ss.transient(problem, 6.0, held={"k": np.ones(1)})


def test_a_result_is_shown_in_a_line():
    problem = one_mass(damper(kt=10.0, normal_load=10.0), force=1.0, harmonics=5)
    text = repr(ss.transient(problem, 3.0))
    assert text.startswith("TransientResult(omega=3, 1 outputs, 1 contacts, ")
    assert len(text) < 160


class Plastic(Law):
    """A spring and a dashpot in series, and a limit at which the rate of their force jumps to zero."""

    ports, memory = ("x",), ("f",)

    def __init__(self, **values):
        self.values = values

    def changed(self, **values):
        return Plastic(**{**self.values, **values})

    def respond(self, motion, values):
        raise NotImplementedError

    def rate(self, q, velocity, memory, values):
        limit, rate = values["limit"], values["kt"] * velocity - memory / values["time"]
        return np.clip(memory, -limit, limit), np.where((np.abs(memory) >= limit) & (memory * rate > 0.0), 0.0, rate)


def test_a_rate_that_jumps_is_marched_where_newton_on_the_period_has_no_slope():
    law, omega, periods, steps = Plastic(kt=100.0, time=0.5, limit=0.5), 10.0, 3, 1000
    problem = ss.Problem(
        ss.MatrixStructure(M=[[1.0]], C=[[2.0]], K=[[100.0]], dofs=["x"]),
        contacts=[ss.ContactPair(name="damper", contact=law, ports={"x": "x"})],
        loads=[ss.Load(dof="x", cos=10.0)],
        harmonics=[0, 1, 3],
    )
    found = ss.transient(problem, omega, periods=periods, tolerance=1e-3)
    x, v, f, h, last = 0.0, 0.0, 0.0, 2.0 * np.pi / omega / steps, []
    for k in range((periods + 1) * steps):
        v += h * (10.0 * np.cos(omega * (k + 0.5) * h) - 2.0 * v - 100.0 * x - f)
        x += h * v
        f = min(max(f + h * (100.0 * v - f / 0.5), -0.5), 0.5)
        last.append(x)
    x_last = np.array(last[-steps:])
    assert found.amplitude[0] == pytest.approx(np.abs(x_last - x_last.mean()).max(), rel=1e-3)  # steps of first order
