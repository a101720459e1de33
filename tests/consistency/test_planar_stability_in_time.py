"""Friction in two directions in time: points of curves, multipliers and cycles against shooting, differences, formulas.

The integrator in time and the multipliers by pieces share the law's regimes; what both are held against here is the
period map itself, differenced, an equation written in the test (``test_planar_in_time.Marched``), and closed forms.
"""

from __future__ import annotations

import numpy as np
import pytest
from helpers.floquet import distance
from test_planar_in_time import KN, KT, MU, Marched

import slipstick as ss
from slipstick.analysis.time_domain.event_integrator import StateChange, Stepper
from slipstick.analysis.time_domain.initial_state import HarmonicStart, start_from_motion
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.analysis.time_domain.shooting import one_period, periods
from slipstick.typing import Array

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def multipliers(branch: ss.Branch, point: int = 0) -> Array:
    found = branch.dataset["multiplier"].to_numpy()[point] @ [1.0, 1.0j]
    return found[np.isfinite(found)]


def random_system(seed: int, orders: int = 15) -> tuple[ss.Problem, float]:
    """One or two contacts that slide in a plane, perhaps one along a line, on three to six dofs; a frequency."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 7))
    root = rng.normal(size=(n, n))
    K = 12.0 * root @ root.T + 20.0 * np.eye(n)
    C = rng.choice([0.02, 0.05]) * K / np.sqrt(40.0) + rng.choice([0.1, 0.3]) * np.eye(n)
    dofs, pairs = [f"q{i}" for i in range(n)], []
    for c in range(int(rng.integers(1, 3))):
        a, b, d = rng.permutation(n)[:3]
        normal = None if rng.random() < 0.3 else f"q{d}"
        gaps = [-1.0, -0.3, -2.0] if normal is None else [-1.0, -0.3, 0.1, -2.0]
        gap = float(rng.choice(gaps) * rng.uniform(0.5, 1.5))
        law = ss.PlanarFrictionContact(
            kt=rng.uniform(10, 100), mu=rng.uniform(0.1, 0.9), kn=rng.uniform(5, 60), gap=gap
        )
        v = rng.normal(size=2) * float(rng.choice([0, 0, 1, 10]))
        pairs.append(
            ss.ContactPair(
                name=f"planar {c}", contact=law, tangential=(f"q{a}", f"q{b}"), normal=normal,
                rubbing=ss.RubbingMotion(velocity=tuple(v)),
            )
        )  # fmt: skip
    if rng.random() < 0.4:
        a, b = rng.permutation(n)[:2]
        line = ss.FrictionContact(
            kt=rng.uniform(10, 100), mu=rng.uniform(0.1, 0.9), kn=rng.uniform(5, 60), gap=float(rng.uniform(-2, 0.1))
        )
        rubbing = ss.RubbingMotion(velocity=float(rng.choice([0, 3.0])))
        pairs.append(ss.ContactPair(name="line", contact=line, tangential=f"q{a}", normal=f"q{b}", rubbing=rubbing))
    loads = [ss.Load(dof=f"q{i}", cos=rng.normal() * 30, sin=rng.normal() * 30) for i in range(3)]
    structure = ss.MatrixStructure(M=np.eye(n), C=C, K=K, dofs=dofs)
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(orders + 1)), float(rng.uniform(3, 12))


class Shot:
    """The periodic motion in time beside a point, and its period map."""

    def __init__(self, problem: ss.Problem, omega: float, branch: ss.Branch) -> None:
        d, names = branch.point(0), problem.elements
        line = [i for i, name in enumerate(names) if name == "line"]
        planar = [i for i, name in enumerate(names) if name != "line"]
        ports = np.concatenate([d[f"contact_{port}"].to_numpy()[planar] for port in ("tangential", "second", "normal")])
        self.stepper = Stepper(PiecewiseLinear(friction_system(problem, omega)))
        start = HarmonicStart(
            harmonics=problem.harmonics, tangential=d["contact_tangential"].to_numpy()[line],
            normal=np.nan_to_num(d["contact_normal"].to_numpy()[line]), ports=np.nan_to_num(ports),
        )  # fmt: skip
        z, states = start_from_motion(self.stepper, start)
        for end in periods(self.stepper, z, states, shooting=True):
            if end.change < 1e-11 or end.period > 60:
                break
        self.change, self.z, self.states = end.change, end.z, end.states
        changes = [item for item in self.stepper.period(self.z, self.states) if isinstance(item, StateChange)]
        self.kept = self.stepper.model.system.unknowns(self.states, {change.contact for change in changes})

    @property
    def map(self) -> Array:
        """By exponentials, collocation and saltation."""
        Phi = one_period(self.stepper, self.z, self.states, True)
        assert Phi is not None
        return Phi[np.ix_(self.kept, self.kept)]

    def differences(self, step: float) -> Array:
        """By central differences."""
        out, n = np.zeros((len(self.kept), len(self.kept))), self.stepper.model.system.n
        size = np.abs(self.z[: 2 * n]).max()
        for j, e in enumerate(self.kept):
            ends = []
            for way in (step * size, -step * size):
                z = self.z.copy()
                z[e] += way
                one_period(self.stepper, z, self.states, False)
                ends.append(self.stepper.z)
            out[:, j] = self.stepper.difference(ends[1], ends[0], self.states)[self.kept] / (2.0 * step * size)
        return out


def compared(seed: int, *, differences: bool) -> tuple[float, float, float]:
    """Check in time, multipliers against shooting, and shooting against differences, of a random system."""
    problem, omega = random_system(seed)
    branch = ss.steady_response(problem, omega=omega, stability=True)
    check, shot = branch.check_in_time(0), Shot(problem, omega, branch)
    assert check.converged
    assert shot.change < 1e-10
    Phi = shot.map
    off = np.abs(Phi - shot.differences(1e-6)).max() / np.abs(Phi).max() if differences else 0.0
    exact = np.linalg.eigvals(Phi)
    assert int(branch.dataset["unstable_multipliers"][0]) == np.sum(np.abs(exact) > 1.0 + 1e-6)
    return check.relative_difference, distance(multipliers(branch), exact), float(off)


def test_points_and_multipliers_of_a_random_system() -> None:
    """Two contacts; separation, stick and slip."""
    check, found, _ = compared(7, differences=False)
    assert check < 1e-5  # 15 harmonics are kept
    assert found < 5e-6


@pytest.mark.verify
def test_points_and_multipliers_of_many_random_systems() -> None:
    worst = np.array([compared(seed, differences=seed % 4 == 0) for seed in range(16)])
    assert np.quantile(worst[:, :2], 0.9, axis=0).max() < 2e-5
    assert worst[:, :2].max() < 2e-4
    assert worst[:, 2].max() < 1e-4


def oscillator(seed: int) -> tuple[ss.Problem, float, Marched]:
    """One contact on x, y, z, and the same in equations written elsewhere."""
    rng = np.random.default_rng(seed)
    K, c, omega, gap = rng.uniform(30, 60, 3), 0.8, 8.0, -16.0
    load, v = np.array([[150.0, -90.0, 400.0], [40.0, 120.0, 0.0]]), np.array([0.0, 3.0]) * (seed % 2)
    contact = ss.PlanarFrictionContact(kt=KT, mu=MU, kn=KN, gap=gap)
    problem = ss.Problem(
        ss.MatrixStructure(M=np.eye(3), C=c * np.eye(3), K=np.diag(K), dofs=["x", "y", "z"]),
        contacts=ss.ContactPair(
            name="foot", contact=contact, tangential=("x", "y"), normal="z",
            rubbing=ss.RubbingMotion(velocity=tuple(v)),
        ),
        loads=[ss.Load(dof=dof, cos=load[0, i], sin=load[1, i]) for i, dof in enumerate("xyz")], harmonics=range(16),
    )  # fmt: skip
    return problem, omega, Marched(K, c, load, np.zeros(3), omega, gap, v)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.verify)])
def test_the_period_map_is_that_of_equations_written_elsewhere(seed: int) -> None:
    """Differenced there, along a motion that slips and sticks."""
    problem, omega, marched = oscillator(seed)
    shot = Shot(problem, omega, ss.steady_response(problem, omega=omega))
    (regime,), e = shot.states, shot.stepper.model.system.memory.start
    name = {0: "open", 2: "stick", 3: "slip"}[int(regime)]
    q, dq, memory = shot.z[:3], omega * shot.z[3:6], shot.z[e : e + 2]

    def end(moved: Array) -> Array:
        kept = memory + (KT * moved[:2] if name == "stick" else 0.0)
        return marched.period(np.concatenate([moved, kept]), name)[0]

    size, columns = 1e-5 * np.abs(q).max(), []
    for j in range(6):
        step = np.zeros(6)
        step[j] = size * (1.0 if j < 3 else omega)
        start = np.concatenate([q, dq])
        columns.append((end(start + step) - end(start - step)) / (2.0 * step[j]))
    scale = np.array([1.0] * 3 + [omega] * 3)
    Phi = shot.map[:6, :6] * scale[:, None] / scale
    np.testing.assert_allclose(Phi, np.array(columns).T, atol=2e-5 * np.abs(Phi).max())


def driven(law: type, v: float, load: float) -> ss.Problem:
    """Two dofs on a contact along x, or in x and z where nothing moves along z; the normal load varies."""
    planar = law is ss.PlanarFrictionContact
    contact = law(kt=30.0, mu=0.4, kn=20.0, gap=-1.5)
    return ss.Problem(
        ss.MatrixStructure(
            M=np.eye(3), C=0.4 * np.eye(3), K=[[30.0, -6.0, 0.0], [-6.0, 42.0, 0.0], [0.0, 0.0, 50.0]], dofs=list("xyz")
        ),
        contacts=ss.ContactPair(
            name="foot", contact=contact, tangential=("x", "z") if planar else "x", normal="y",
            rubbing=ss.RubbingMotion(velocity=(v, 0.0) if planar else v),
        ),
        loads=[ss.Load(dof="x", sin=load), ss.Load(dof="y", cos=20.0)], harmonics=range(11),
    )  # fmt: skip


@pytest.mark.parametrize("v", [0.0, 2.0])
def test_along_a_line_the_multipliers_are_those_of_the_element_of_one_direction(v: float) -> None:
    one, two = (
        ss.steady_response(driven(law, v, 40.0), omega=6.0, stability=True)
        for law in (ss.FrictionContact, ss.PlanarFrictionContact)
    )
    across = np.exp(np.roots([1.0, 0.4, 50.0]) * 2.0 * np.pi / 6.0)  # z alone, nothing of x and y in it
    exact = [m for m in multipliers(one) if np.abs(m - across).min() > 1e-9]
    assert len(exact) >= 3
    assert distance(multipliers(two), np.array(exact)) < 3e-6


def test_all_stuck_it_is_a_linear_system() -> None:
    contact = ss.PlanarFrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    problem = ss.Problem(
        ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=np.diag([40.0, 60.0]), dofs=["x", "y"]),
        contacts=ss.ContactPair(name="foot", contact=contact, tangential=("x", "y")),
        loads=[ss.Load(dof="x", cos=50.0), ss.Load(dof="y", sin=50.0)], harmonics=[0, 1, 3],
    )  # fmt: skip
    branch = ss.steady_response(problem, omega=5.0, stability=True)
    roots = np.concatenate([np.roots([1.0, 0.4, k]) for k in (140.0, 160.0)])
    assert len(multipliers(branch)) == 4
    assert distance(multipliers(branch), np.exp(roots * 2.0 * np.pi / 5.0)) < 1e-12
    assert branch.check_in_time(0).relative_difference < 1e-9


def test_fast_rubbing_is_a_spring_and_a_dashpot_in_series_across() -> None:
    """At rest, sliding along x: the angle is one more state across, ``f' = kt (w' - v f / (mu N))``."""
    v, load, kt, mu = 25.0, 800.0, 100.0, 0.3
    problem = ss.Problem(
        ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=np.diag([40.0, 60.0]), dofs=["x", "y"]),
        contacts=ss.ContactPair(
            name="foot", contact=ss.PlanarFrictionContact(kt=kt, mu=mu, normal_load=load), tangential=("x", "y"),
            rubbing=ss.RubbingMotion(velocity=(v, 0.0)),
        ),
        loads=ss.Load(dof="x", cos=1e-3), harmonics=[0, 1],
    )  # fmt: skip
    branch = ss.steady_response(problem, omega=5.0, stability=True)
    A = np.array([[0.0, 1.0, 0.0], [-60.0, -0.4, -1.0], [0.0, kt, -kt * v / (mu * load)]])
    exponents = np.concatenate([np.roots([1.0, 0.4, 40.0]), np.linalg.eigvals(A)])
    assert len(multipliers(branch)) == 5
    assert distance(multipliers(branch), np.exp(exponents * 2.0 * np.pi / 5.0), 0.0) < 1e-6


def brake(contact: ss.PlanarFrictionContact | ss.FrictionContact, angle: float) -> ss.Problem:
    """Mode coupling of x and y, a pad that rubs along x, or askew in x and z."""
    planar = isinstance(contact, ss.PlanarFrictionContact)
    velocity = (np.cos(angle), np.sin(angle)) if planar else 1.0
    K = [[100.0, -20.0, 0.0], [-20.0, 60.0, 0.0], [0.0, 0.0, 75.0]]
    return ss.Problem(
        ss.MatrixStructure(M=np.eye(3), C=0.5 * np.eye(3), K=K, dofs=list("xyz")),
        contacts=ss.ContactPair(
            name="brake", tangential=("x", "z") if planar else "x", normal="y", contact=contact,
            rubbing=ss.RubbingMotion(velocity=velocity),
        ),
        loads=ss.Load(dof="y", harmonic=0, cos=50.0), harmonics=range(11),
    )  # fmt: skip


def test_limit_cycles_are_those_of_one_direction_where_nothing_moves_across() -> None:
    one, two = (
        ss.limit_cycles(brake(law(kt=200.0, mu=0.4, kn=40.0, gap=0.0), 0.0), "brake.mu", (0.4, 0.56), at=0.55)
        for law in (ss.FrictionContact, ss.PlanarFrictionContact)
    )
    (hopf,) = [point for point in two.bifurcations() if point.kind == "Hopf"]
    assert hopf.value == pytest.approx(0.53125, abs=1e-9)
    assert float(two.dataset.omega[two.at(0.55)]) == pytest.approx(float(one.dataset.omega[one.at(0.55)]), abs=1e-8)
    in_plane = [m for m in multipliers(one, int(one.at(0.55))) if abs(m.imag) < 1e-6]
    assert distance(multipliers(two, int(two.at(0.55))), np.array(in_plane)) < 1e-6


@pytest.mark.verify
def test_limit_cycles_that_move_across_close_in_time() -> None:
    contact = ss.PlanarFrictionContact(kt=200.0, mu=0.4, kn=40.0, gap=0.0)
    branch = ss.limit_cycles(brake(contact, 0.4), "brake.mu", (0.4, 0.7), at=[0.62, 0.65, 0.7])
    requested = np.flatnonzero(
        (branch.dataset["kind"].to_numpy() == "requested") & (branch.dataset["branch_part"].to_numpy() == 1)
    )
    assert requested.size
    for point in requested.tolist():
        assert branch.check_in_time(point).relative_difference < 1e-3
