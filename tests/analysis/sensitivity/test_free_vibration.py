"""Derivatives of limit cycles and nonlinear modes, whose frequency is found with the motion."""

from __future__ import annotations

import warnings
from functools import cache, partial

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.analysis.augmented import Augmented
from slipstick.analysis.modes.nonlinear_modes import free_problem
from slipstick.analysis.modes.system import damping_rate
from slipstick.analysis.peaks.system import StateSpace
from slipstick.analysis.self_excited.system import CycleSystem
from slipstick.balance.balance import Balance
from slipstick.balance.parameters import parameter_path
from slipstick.results.measures import amplitude
from slipstick.results.record import Outputs, unknowns
from slipstick.solve.newton import NewtonOptions, newton

pytestmark = pytest.mark.filterwarnings("ignore:contact .* its normal load is constant")

Array = np.ndarray

CYCLE, MODE = 0.55, 0.5
"""The value of the parameter and the amplitude looked at."""
QUANTITIES = ("omega", "modal_damping", "amplitude", "mean", "dissipated_power")


@cache
def squeal() -> ss.Branch:
    """A mass on a belt with mode coupling; its third dof is no port of the contact."""
    K = [[100.0, -20.0, -5.0], [-20.0, 60.0, -10.0], [-5.0, -10.0, 200.0]]
    structure = ss.MatrixStructure(M=np.eye(3), C=0.5 * np.eye(3), K=K, dofs=["x", "y", "z"])
    pad = ss.FrictionContact(kt=200.0, mu=0.4, kn=40.0, gap=0.0)
    brake = ss.ContactPair(
        name="brake", tangential="x", normal="y", contact=pad, rubbing=ss.RubbingMotion(velocity=1.0)
    )
    load = ss.Load(dof="y", harmonic=0, cos=50.0)
    problem = ss.Problem(structure, contacts=brake, loads=load, harmonics=range(8))
    return ss.limit_cycles(problem, "brake.mu", (0.45, 0.6), at=CYCLE)


def system(damping: float) -> ss.Problem:
    """Three contacts, one with a normal direction and one that rubs; ``damping`` couples the modes."""
    n = 4
    K = 50.0 * np.eye(n) - 10.0 * np.eye(n, k=1) - 10.0 * np.eye(n, k=-1)
    C = 0.01 * K + damping * np.diag([1.0, 0.2, 0.0, 0.0])
    structure = ss.MatrixStructure(M=np.eye(n), C=C, K=K, dofs=["a", "b", "c", "d"], loss_factor=0.01)
    law = ss.FrictionContact(kt=40.0, mu=0.3, kn=30.0, normal_load=5.0)
    pairs = [
        ss.ContactPair(name="one", tangential="a", contact=law, rubbing=ss.RubbingMotion(velocity=0.2)),
        ss.ContactPair(name="two", tangential={"b": 1.0, "c": -1.0}, contact=law),
        ss.ContactPair(name="three", tangential="a", normal="d", contact=law),
    ]
    loads = [ss.Load(dof="d", harmonic=0, cos=3.0), ss.Load(dof="a", sin=10.0)]
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(4), load=1.5)


@cache
def mode(damping: float) -> ss.Branch:
    options = {"output_tolerance": 1.0, "max_step": 0.2}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)
        return ss.nonlinear_modes(system(damping), amplitude=(0.02, MODE), mode=2, dof="b", options=options)


def solved(system: Augmented, y: Array, parameter: float, scale: Array) -> tuple[dict[str, float], Array]:
    """What a solution found again is, and the motion of the last output, of which harmonic 1 is a cosine."""
    options = NewtonOptions(tolerance=1e-13, max_iterations=40)
    found = newton(partial(system.evaluate, parameter=parameter), y, options=options, scale=scale)
    assert found.correction_norm < 1e-9
    here = system.state(found.x, parameter).here
    U, h = here.motion()[-1], here.balance.harmonics
    z = (U[1::2] - 1j * U[2::2]) * np.exp(-1j * np.angle(U[1] - 1j * U[2]) * np.array(h.orders[1:]))
    turned = np.append(U[0], np.column_stack([z.real, -z.imag]))
    power = sum(float(np.sum(powered.power.value)) for powered in here.powers())
    values = (here.omega, found.x[-1] / (2.0 * here.omega), float(amplitude(h, U).value), U[0], power)
    return dict(zip(QUANTITIES, values, strict=True)), turned


def cycle_again(dof: str, problem: ss.Problem, value: float) -> tuple[dict[str, float], Array]:
    branch = squeal()
    point = branch.at(CYCLE)
    x, omega = branch.guess(point), float(branch.dataset.omega[point])
    path = parameter_path(problem, "brake.mu")
    space = StateSpace(Outputs(Balance(problem), (dof,)), problem.inputs, path)
    cycles = CycleSystem(space, problem.harmonics.derivative(x).reshape(-1))
    return solved(cycles, np.append(x.reshape(-1), omega), value, np.append(np.full(x.size, np.linalg.norm(x)), omega))


def mode_again(damping: float, dof: str, problem: ss.Problem) -> tuple[dict[str, float], Array]:
    """From the linear mode on."""
    free, _ = free_problem(problem, 1, "b")
    free.outputs = Outputs(free.balance, ("b", dof))
    data = mode(damping).dataset.isel(point=-1)
    x = unknowns(mode(damping).table, free.problem, len(mode(damping)) - 1).reshape(-1)
    omega, xi = float(data.omega), float(2.0 * data.omega * data.modal_damping)
    motion = free.system(np.append(x, [1.0, 0.0])).with_mode(x, omega, xi, data.displacement.sel(dof="b").values)
    equations = free.system(motion, at_dof=True)
    y = np.append(motion / equations.sizes(MODE), [omega, xi])
    return solved(equations, y, float(np.log(MODE)), np.append(np.ones(y.size - 2), [omega, omega]))


def differences(again, problem, name, value):
    """Central differences; one-sided ones of order four where a value below is not allowed."""
    h = 1e-5 * (abs(value) or 1.0)
    forward = value == 0.0 and name in ("loss_factor", "damping")
    places, weights = ((0, 1, 2, 3, 4), (-25, 48, -36, 16, -3)) if forward else ((1, -1, 2, -2), (8, -8, -1, 1))
    found = [again(problem, value + k * h) for k in places]
    rates = {q: sum(w * f[0][q] for w, f in zip(weights, found, strict=True)) / (12 * h) for q in QUANTITIES}
    return rates, sum(w * f[1] for w, f in zip(weights, found, strict=True)) / (12 * h)


def assert_alike(slopes, moved, again, problem, values):
    """All derivatives at the one point of ``slopes`` are those of points found again."""
    for k, name in enumerate(slopes.parameter.values.tolist()):
        value = values.get(name, problem.parameter(name))
        rates, motion = differences(again, problem, name, value)
        here, turned = again(problem, value)
        unit = abs(value) or 1.0
        for quantity in set(QUANTITIES) & set(slopes):
            exact = float(slopes[quantity][k, 0])
            least = max(1e-6 * abs(exact), 1e-9 * max(abs(here[quantity]), here["amplitude"]) / unit)
            assert exact == pytest.approx(rates[quantity], rel=0, abs=least), (name, quantity)
        exact = slopes_at_cosine(moved.displacement.values[k, 0], moved.motion)
        least = max(1e-6 * np.abs(exact).max(), 1e-9 * np.abs(turned).max() / unit)
        assert exact == pytest.approx(motion, rel=0, abs=least), name


def slopes_at_cosine(rates: Array, U: Array) -> Array:
    """Turned so that harmonic 1 is a cosine, as the motion ``U`` is then."""
    orders = np.arange(1, U.size // 2 + 1)
    turn = np.exp(-1j * np.angle(U[1] - 1j * U[2]) * orders)
    z = (rates[1::2] - 1j * rates[2::2]) * turn
    return np.append(rates[0], np.column_stack([z.real, -z.imag]))


class Moved:
    """Derivatives of a motion with the motion itself."""

    def __init__(self, branch: ss.Branch, names: list[str], dof: str, point: int) -> None:
        self.displacement = branch.sensitivity(names, dof, points=point, of="displacement").displacement
        self.motion = branch.dataset.displacement.sel(dof=dof)[point].values


@pytest.mark.parametrize("dof", ["y", "z"])
def test_cycles_move_as_cycles_found_again(dof):
    branch = squeal()
    point, problem = branch.at(CYCLE), branch.problem
    names = ["brake.kt", "brake.kn", "brake.gap", "brake.velocity", "brake.mu", "damping", "load.y.amplitude", "*.mu"]

    def again(problem, value, name):
        followed = name in ("brake.mu", "*.mu")
        moved = problem if followed else problem.at_parameter(name, value)
        return cycle_again(dof, moved, value if followed else CYCLE)

    slopes = branch.sensitivity(names, dof, points=point)
    assert slopes.omega.attrs == {"long_name": "derivative of the fundamental frequency", "of": "rad/s"}
    for name in names:
        one, moved = slopes.sel(parameter=[name]), Moved(branch, [name], dof, point)
        assert_alike(one, moved, partial(again, name=name), problem, {"brake.mu": CYCLE, "*.mu": CYCLE})


def test_cycles_scale_with_velocity_and_load():
    """Of one size and half the size everything is alike: the frequency does not change with all lengths."""
    branch = squeal()
    point = branch.at(CYCLE)
    slopes = branch.sensitivity(["brake.velocity", "load.y.amplitude"], "z", points=point)
    degree = (slopes.value * slopes.isel(point=0)).sum("parameter")
    here = branch.dataset.isel(point=point)
    assert float(degree.omega) == pytest.approx(0.0, abs=1e-11)
    assert float(degree.amplitude) == pytest.approx(float(here.amplitude.sel(dof="z")), rel=1e-9)
    assert float(degree.dissipated_power) == pytest.approx(2.0 * float(here.dissipated_power.sum()), rel=1e-9)


def test_where_nothing_vibrates_there_are_no_derivatives():
    """Nor where cycles rise straight from the Hopf point: motion of any size belongs to one value."""
    branch = squeal()
    with pytest.warns(ss.SlipstickWarning) as told:
        slopes = branch.sensitivity("brake.kt")
    sentences = sorted(str(one.message).partition(": ")[2] for one in told)
    assert sentences == [
        "steady sliding does not vibrate",
        "where cycles rise straight from the Hopf point their size is open",
    ]
    known = np.isfinite(slopes.omega.values[0])
    rising = np.isin(branch.dataset.kind, ["start", "state change"]) & (branch.dataset.branch_part == 1)
    rising &= np.abs(branch.dataset.parameter - branch.dataset.parameter[0]) < 1e-12
    assert np.array_equal(known, (branch.dataset.branch_part == 1) & ~rising)
    assert np.isfinite(branch.sensitivity("brake.kt", points=branch.at(CYCLE)).amplitude.values).all()


OF_CONTACTS = ["one.mu", "one.velocity", "two.kt", "three.kn", "three.gap", "*.mu"]
OTHERS = ["friction", "load", "load.a.amplitude", "load.d.amplitude", "loss_factor", "damping"]


@pytest.mark.parametrize(
    ("damping", "dof", "names"),
    [
        (0.0, "d", OF_CONTACTS),
        (0.5, "d", OTHERS),
        *(pytest.param(*case, marks=pytest.mark.verify) for case in ((0.0, "b", OTHERS), (0.5, "b", OF_CONTACTS))),
    ],
)
def test_modes_move_as_modes_found_again(damping, dof, names):
    """By parameters of contacts, of loads and of the structure; b moves in the mode."""
    branch, problem = mode(damping), system(damping)
    point = len(branch) - 1
    slopes = branch.sensitivity(names, dof, points=point)
    assert slopes.attrs["followed"] == "modal_amplitude"
    for name in names:
        again = lambda problem, value, name=name: mode_again(damping, dof, problem.at_parameter(name, value))  # noqa: E731
        assert_alike(slopes.sel(parameter=[name]), Moved(branch, [name], dof, point), again, problem, {})


def test_a_stuck_oscillator_is_a_spring():
    """``w^2 = (k + kt) / m`` and ``xi = c / m`` in closed form, ``D = xi / (2 w)``."""
    structure = ss.MatrixStructure(M=[[2.0]], C=[[0.1]], K=[[40.0]], dofs=["x"])
    damper = ss.ContactPair(
        name="damper", tangential="x", contact=ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    )
    problem = ss.Problem(structure, contacts=damper, loads=ss.Load(dof="x", sin=1.0), harmonics=range(4))
    branch = ss.nonlinear_modes(problem, amplitude=(0.1, 0.2))
    slopes = branch.sensitivity(["damper.kt", "damper.mu", "damping"]).isel(point=-1)
    omega = np.sqrt(140.0 / 2.0)
    D = 0.05 / (2.0 * omega)
    by_kt = 1.0 / (4.0 * omega)
    assert slopes.omega.values == pytest.approx([by_kt, 0.0, 0.0], rel=1e-9, abs=1e-9)
    assert slopes.modal_damping.values == pytest.approx([-D / omega * by_kt, 0.0, D], rel=1e-7, abs=1e-11)


def test_a_mode_in_a_file_needs_its_problem(tmp_path):
    branch = mode(0.0)
    path = branch.save(tmp_path / "mode.nc")
    with raises_fault(says="give it to ss.load"):
        ss.load(path).sensitivity("two.kt")
    again = ss.load(path, system(0.0)).sensitivity("two.kt", points=-1)
    np.testing.assert_array_equal(again.omega, branch.sensitivity("two.kt", points=-1).omega)


def test_the_damping_ratio_is_half_of_xi_over_omega():
    y, dy = np.array([0.3, 2.0, 0.1]), np.array([0.0, 0.5, 0.2])
    side = [(y + e * dy)[-1] / (2.0 * (y + e * dy)[-2]) for e in (1e-6, -1e-6)]
    assert damping_rate(y, dy) == pytest.approx((side[0] - side[1]) / 2e-6, rel=1e-9)
