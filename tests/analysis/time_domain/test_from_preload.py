"""Motion in time from a preload: at rest until something acts, then closed forms, and the balance from there."""

import dataclasses

import numpy as np
import pytest
from helpers.command import slipstick

import slipstick as ss
from slipstick.analysis.time_domain.equilibrium import equilibrium
from slipstick.analysis.time_domain.event_integrator import Stepper
from slipstick.analysis.time_domain.initial_state import started
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.errors import InputError
from slipstick.runs.passing_through import load_run_up

K_SPRING, KT, LIMIT, PULL = 40.0, 100.0, 3.0, 8.0


def static(dof, force):
    return ss.Load(dof=dof, harmonic=0, cos=force)


def loaded(**forces):
    return ss.LoadStep(loads=[static(dof, force) for dof, force in forces.items()])


def block(limit=LIMIT, damping=0.4, **options):
    """A block on a spring, with a foot that slips at ``limit``."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[damping]], K=[[K_SPRING]], dofs=["x"])
    law = ss.FrictionContact(kt=KT, mu=0.3, normal_load=limit / 0.3)
    return ss.Problem(structure, contacts=ss.ContactPair(name="foot", contact=law, tangential="x"), **options)


def locked(problem, pull=PULL):
    """The problem after a pull that made the foot slip, and was taken away."""
    return problem.preloaded(ss.preload(problem, [loaded(x=pull), loaded(x=0.0)]))


LOCKED_AT = (PULL - LIMIT) / K_SPRING - PULL / (K_SPRING + KT)
"""Where the block stays then: the foot holds the spring."""


def flange():
    """Plates that a bolt presses on the ground."""
    structure = ss.MatrixStructure(M=[[2.0]], K=[[0.0]], C=[[5.0]], dofs=["u"])
    plates = ss.ContactPair(name="plates", contact=ss.FrictionContact(kn=7e8, gap=0.0), normal={"u": -1.0})
    return ss.Problem(structure, contacts=[plates, ss.bolt(name="bolt", elongation={"u": 1.0}, stiffness=2e8)])


def plane(**options):
    """A body on two feet that slide in the plane, one of them with a normal direction and one slantwise."""
    structure = ss.MatrixStructure(
        M=np.eye(3), K=np.diag([10.0, 20.0, 30.0]) + 3.0, C=0.1 * np.eye(3), dofs=["x", "y", "z"]
    )
    pressed = ss.PlanarFrictionContact(kt=100.0, kn=300.0, mu=0.5, gap=0.0)
    constant = ss.PlanarFrictionContact(kt=50.0, mu=0.5, normal_load=4.0)
    feet = [
        ss.ContactPair(name="foot", contact=pressed, tangential=("x", "y"), normal={"z": -1.0}),
        ss.ContactPair(name="slant", contact=constant, tangential=({"x": 0.8, "z": 0.6}, "y")),
    ]
    return ss.Problem(structure, contacts=feet, **options)


def sledge():
    """A body that friction alone holds."""
    structure = ss.MatrixStructure(M=np.eye(3), K=np.zeros((3, 3)), C=np.eye(3), dofs=["x", "y", "z"])
    law = ss.PlanarFrictionContact(kt=100.0, kn=300.0, mu=0.5, gap=0.0)
    return ss.Problem(
        structure, contacts=ss.ContactPair(name="foot", contact=law, tangential=("x", "y"), normal={"z": -1.0})
    )


def behind_residuals():
    """A chain of five masses reduced to one mode, which answers forces at once by what is left out."""
    K = 400.0 * (2.0 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1))
    body = ss.reduce(np.eye(5), K, keep=["d0", "d3"], dofs=[f"d{i}" for i in range(5)], modes=1, loss_factor=0.01)
    law = ss.FrictionContact(kt=100.0, kn=50.0, mu=0.3, gap=-0.2)
    foot = ss.ContactPair(name="foot", contact=law, tangential="d0", normal="d3")
    return ss.Problem(body, contacts=foot)


CASES = {
    "locked": (block, [loaded(x=PULL), loaded(x=0.0)]),
    "at its limit": (block, [loaded(x=PULL)]),
    "bolt": (flange, [ss.LoadStep(bolts={"bolt": 12e3})]),
    "open": (flange, [ss.LoadStep(bolts={"bolt": 12e3}), loaded(u=30e3)]),
    "plane, at its limit": (plane, [loaded(z=-10.0), loaded(x=24.0, y=18.0)]),
    "plane, back": (plane, [loaded(z=-10.0), loaded(x=24.0, y=18.0), loaded(x=10.0, y=18.0)]),
    "plane, open": (plane, [loaded(z=-10.0), loaded(x=24.0, y=18.0), loaded(z=20.0)]),
    "held by friction": (sledge, [loaded(z=-10.0), loaded(x=2.4, y=1.8)]),
    "behind residuals": (behind_residuals, [loaded(d0=15.0, d3=4.0), loaded(d0=2.0)]),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.filterwarnings("ignore:nothing moves:slipstick.errors.SlipstickWarning")
def test_a_preloaded_structure_stays_where_it_is(name):
    made, steps = CASES[name]
    problem, omega = made(), 4e3 if made is flange else 2.0
    state = ss.preload(problem, steps)
    still, where = problem.preloaded(state), state.dataset.displacement.values[-1]
    size = np.abs(where).max()
    motion = ss.transient(still, omega, method="march", periods=3)
    assert np.ptp(motion.displacement, axis=0).max() < 2e-12 * size
    np.testing.assert_allclose(motion.mean, where, rtol=0.0, atol=2e-8 * size)  # load steps end at 1e-10 of springs
    assert not motion.changes
    passed = ss.runs.run_up(still, (omega, 1.2 * omega), rate=0.02 * omega**2)
    data = passed.dataset
    assert np.ptp(data.displacement.values, axis=0).max() < 2e-12 * size
    np.testing.assert_allclose(data["mean"].values, np.tile(where, (len(data.period), 1)), atol=2e-8 * size)
    assert data.energy_error.values.max() < 1e-12


def test_contacts_begin_with_the_forces_of_the_load_steps():
    state = ss.preload(plane(), CASES["plane, back"][1])
    problem = block()
    assert ss.preload(problem, [loaded(x=PULL), loaded(x=0.0)]).dataset.displacement.values[-1] == pytest.approx(
        LOCKED_AT
    )
    motion = ss.transient(locked(block(loads=ss.Load(dof="x", cos=0.1))), 3.0)
    assert motion.friction_coefficients[0, 0] == pytest.approx(-K_SPRING * LOCKED_AT, rel=1e-9)
    tight = plane(loads=ss.Load(dof="x", cos=0.01)).preloaded(state)
    _, states = _begun(tight, 2.0)
    regimes = tight.contacts[0].contact.regimes
    assert [regimes.names[number] for number in states] == ["stick", "stick"]
    np.testing.assert_allclose(_forces(tight, 2.0), state.dataset.friction_force.values[-1], rtol=1e-9)


def _begun(problem, omega):
    stepper = Stepper(PiecewiseLinear(friction_system(problem, omega)))
    z, states = started(stepper, equilibrium(problem, omega))
    return (stepper, z), states


def _forces(problem, omega):
    """Friction forces of planar contacts at the start, (n, 2)."""
    (stepper, z), states = _begun(problem, omega)
    forces, _ = stepper.model.law_forces(stepper.model(states), z[None])
    return forces[0].reshape(3, -1)[:2].T


def test_small_free_vibration_has_the_frequency_of_the_stuck_structure():
    """A load sets in suddenly: ``P / (K - omega^2) (cos omega t - cos Omega t)`` about the preload."""
    P, omega = 0.1, 0.7
    problem = locked(block(damping=0.0, loads=ss.Load(dof="x", cos=P)))
    data = ss.runs.run_up(problem, omega, periods=2, samples=64).dataset
    t, K = data.sample_time.values, K_SPRING + KT
    exact = LOCKED_AT + P / (K - omega**2) * (np.cos(omega * t) - np.cos(np.sqrt(K) * t))
    np.testing.assert_allclose(data.displacement.values[:, 0], exact, rtol=0.0, atol=1e-12)


def blocks(force, limits=(20.0, 0.6)):
    """Two blocks on one string; the second slips in every period under ``force``, the first one sticks."""
    structure = ss.MatrixStructure(
        M=np.eye(2), C=0.3 * np.eye(2), K=[[50.0, -10.0], [-10.0, 30.0]], dofs=["x", "y"]
    )  # fmt: skip
    feet = [
        ss.ContactPair(
            name=f"foot {dof}", contact=ss.FrictionContact(kt=KT, mu=0.5, normal_load=2.0 * limit), tangential=dof
        )
        for dof, limit in zip("xy", limits, strict=True)
    ]
    return ss.Problem(structure, contacts=feet, loads=ss.Load(dof="y", cos=force), harmonics=[0, *range(1, 30, 2)])


@pytest.mark.parametrize("method", ["march", "shooting"])
def test_motion_in_time_meets_the_balance_from_the_same_preload(method):
    problem = blocks(2.0)
    state = ss.preload(problem, [loaded(x=40.0), loaded(x=0.0)])
    held = state.dataset.friction_force.values[-1, 0, 0]
    assert held < -5.0  # of the pull that the first foot keeps
    vibrating = problem.preloaded(state)
    point = ss.steady_response(vibrating, omega=4.0).dataset.isel(point=0)
    motion = ss.transient(vibrating, 4.0, method=method)
    assert motion.converged
    assert motion.fractions[0].tolist() == [0.0, 1.0, 0.0, 0.0]
    assert motion.fractions[1, 2:].sum() > 0.2
    np.testing.assert_allclose(motion.mean, point["mean"].values, rtol=2e-4)
    np.testing.assert_allclose(motion.amplitude, point.amplitude.values, rtol=2e-3)
    np.testing.assert_allclose(
        motion.friction_coefficients[0, 0], point.friction_force.sel(coefficient="0").values[0], rtol=2e-4
    )
    # the mean in closed form: the second foot forgets its force, the first keeps its motion at rest
    rest = vibrating.contacts[0].contact.rest
    mean = np.linalg.solve([[50.0 + KT, -10.0], [-10.0, 30.0]], [KT * rest, 0.0])
    np.testing.assert_allclose(motion.mean, mean, rtol=1e-8)


@pytest.mark.parametrize(("limit", "force"), [(LIMIT, 0.1), (1.0, 9.0)])
def test_a_slow_run_up_passes_along_the_curve(limit, force):
    """Over the resonance the foot sticks with the force of the preload all the way, or slips and forgets it."""
    problem = locked(block(limit=limit, damping=6.0, loads=ss.Load(dof="x", cos=force), harmonics=[0, 1, 3, 5]))
    passed = ss.runs.run_up(problem, (8.5, 12.5), rate=0.08, samples=0).dataset
    settled = passed.isel(period=slice(8, None, 8))
    steady = ss.steady_response(problem, omega=settled.omega.values.tolist()).dataset
    np.testing.assert_allclose(settled.amplitude.values, steady.amplitude.values, rtol=0.01)
    assert passed.energy_error.values.max() < 1e-11
    slips = passed.slip_fraction.values.max()
    if limit == LIMIT:
        assert slips == 0.0
        np.testing.assert_allclose(passed["mean"].values[-1, 0], LOCKED_AT, rtol=1e-4)
    else:
        assert slips > 0.2


def test_prescribed_motion_sets_in_suddenly():
    """The spring is stretched by where the opposing surface is at the start, up to the limit."""
    for size, force in ((0.01, LIMIT - 1.0 + KT * 0.01), (1.0, LIMIT)):
        pair = block().contacts[0]
        problem = ss.Problem(
            block().structure,
            contacts=ss.ContactPair(
                name="foot", contact=pair.contact.changed(rest=-0.02), tangential="x",
                rubbing=ss.RubbingMotion(cos={1: size}),
            ),
        )  # fmt: skip
        x = -0.02 * KT / (K_SPRING + KT)
        (stepper, z), states = _begun(problem, 3.0)
        assert z[0] == pytest.approx(x, rel=1e-12)
        expected = min(LIMIT, KT * (x + 0.02 + size))
        assert stepper.model(states).fx[0] @ z == pytest.approx(expected, rel=1e-12)
        assert expected <= force
        assert ss.runs.run_up(problem, 3.0, periods=3).dataset.energy_error.values.max() < 1e-12


def test_held_parameters_are_those_of_the_equilibrium():
    problem = locked(block(loads=ss.Load(dof="x", cos=0.01)))
    held = {"kt": [0.5 * KT], "mu": [0.3], "kn": [1.0], "gap": [-LIMIT / 0.3]}
    rest = problem.contacts[0].contact.rest
    motion = ss.transient(problem, 3.0, held=held)
    assert motion.mean[0] == pytest.approx(0.5 * KT * rest / (K_SPRING + 0.5 * KT), rel=1e-9)


def test_a_foot_that_lost_its_hold_has_slipped_up_to_its_limit():
    """Load steps were computed with more friction than there is now."""
    problem = locked(block(loads=ss.Load(dof="x", cos=1e-3))).with_parameter("foot.mu", 0.1)
    motion = ss.transient(problem, 3.0)
    assert motion.friction_coefficients[0, 0] == pytest.approx(-LIMIT / 3.0, rel=1e-2)


def test_without_equilibrium_it_says_what_to_do():
    problem = sledge()
    state = ss.preload(problem, [loaded(z=-10.0), loaded(x=2.4, y=1.8)])
    loose = problem.preloaded(state).with_parameter("foot.mu", 0.1)
    with pytest.raises(InputError, match=r"no equilibrium under the static loads .* foot; compute the load steps"):
        ss.transient(loose, 2.0)


@pytest.mark.parametrize("rest", [None, 0.0])
def test_shooting_leaves_the_force_of_contacts_that_stick(rest):
    """Symmetric loads: neither mean motion nor mean force, whatever Newton's method corrects."""
    base = blocks(0.05)
    feet = [dataclasses.replace(pair, contact=pair.contact.changed(rest=rest)) for pair in base.contacts]
    problem = ss.Problem(base.structure, contacts=feet, loads=base.loads)
    motion = ss.transient(problem, 4.0)
    assert motion.converged
    assert np.abs(motion.mean).max() < 1e-9 * motion.amplitude.max()
    assert np.abs(motion.friction_coefficients[:, 0]).max() < 1e-9


def test_motion_without_preload_begins_at_rest():
    """Static loads set in suddenly there."""
    problem = block(damping=0.0, limit=30.0, loads=[static("x", 1.0), ss.Load(dof="x", cos=0.1)])
    data = ss.runs.run_up(problem, 0.7, periods=1, samples=64).dataset
    t, K = data.sample_time.values, K_SPRING + KT
    exact = (1.0 - np.cos(np.sqrt(K) * t)) / K + 0.1 / (K - 0.49) * (np.cos(0.7 * t) - np.cos(np.sqrt(K) * t))
    np.testing.assert_allclose(data.displacement.values[:, 0], exact, rtol=0.0, atol=1e-12)


CASE = f"""
format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["x"]
mass = [[1.0]]
damping = [[0.4]]
stiffness = [[{K_SPRING}]]
[[contact]]
name = "foot"
tangential = "x"
kt = {KT}
mu = 0.3
normal_load = {LIMIT / 0.3}
[[preload]]
loads = [{{ dof = "x", cos = {PULL} }}]
[[preload]]
loads = [{{ dof = "x", cos = 0.0 }}]
[[load]]
dof = "x"
cos = 0.05
[response]
from = 8.0
to = 14.0
[run_up]
from = 8.0
periods = 2
"""


def test_a_case_runs_up_from_its_load_steps(tmp_path):
    (tmp_path / "case.toml").write_text(CASE)
    folder = tmp_path / "out"
    done = slipstick("run-up", tmp_path / "case.toml", "-o", folder, "-q", "--no-figures", "--no-report")
    assert done.exit_code == 0, done.output
    data = load_run_up(folder / "run_up.nc").dataset
    assert data.displacement.values[0, 0] == pytest.approx(LOCKED_AT, rel=1e-12)
    assert not data.attrs["warnings"]
