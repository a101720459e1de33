"""The estimate of what the harmonics left out would add, against what they add when they are kept."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.base_motion import BaseReceptance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.balance.inputs import Assigned
from slipstick.branch import Branch
from slipstick.io.loading import load
from slipstick.results import truncation as truncation_module
from slipstick.results.record import Outputs, Point, Recorder
from slipstick.results.truncation import EachReaction, Reaction, moved, truncation_sentence, with_further
from slipstick.solve.newton import newton
from slipstick.structure.receptance import ModalReceptance
from slipstick.verify.oscillator_checks import oscillator

Array = np.ndarray
RANGE = (2.0, 15.0)
PLACES = [2.5, 3.0, 3.7, 4.2, 5.0, 6.0, 8.0, 10.0]


def branch(velocity: float, orders: list[int]) -> Branch:
    return ss.forced_response(oscillator(velocity=velocity, harmonics=orders), omega=RANGE, at=PLACES)


def missing(found: Branch, full: Branch) -> tuple[Array, Array]:
    """Estimate, and largest change of the motion about its mean over the amplitude, at the places."""
    tau, estimate, true = np.linspace(0.0, 2.0 * np.pi, 361), [], []
    for place in PLACES:
        i, j = found.at(place), full.at(place)
        x = [b.harmonics.H_minus(tau) @ b.dataset["displacement"].to_numpy()[k, 0] for b, k in ((found, i), (full, j))]
        mean = [float(b.dataset["mean"][k, 0]) for b, k in ((found, i), (full, j))]
        true.append(np.abs((x[0] - mean[0]) - (x[1] - mean[1])).max() / float(full.dataset["amplitude"][j, 0]))
        estimate.append(float(found.dataset["truncation"][i]))
    return np.array(estimate), np.array(true)


@pytest.mark.parametrize(
    ("velocity", "orders"),
    [(10.0, [0, 1, 2, 3]), (10.0, list(range(6))), (10.0, list(range(11))), (10.0, [0, 1, 3, 5]), (50.0, [0, 1, 2, 3]),
     (0.0, [0, 1, 2, 3]), (0.0, [0, 1, 3, 5])],
)  # fmt: skip
def test_estimate_is_near_what_more_harmonics_change(velocity: float, orders: list[int]) -> None:
    found, full = branch(velocity, orders), branch(velocity, list(range(25)))
    estimate, true = missing(found, full)
    assert 0.7 * true.max() < estimate.max() < 1.5 * true.max()
    acts = true > 1e-2 * true.max()
    assert np.all(estimate[acts] > true[acts] / 3.0)
    assert np.all(estimate[acts] < 3.0 * true[acts])


def random_case(seed: int, harmonics: Iterable[int], stiff: bool = False) -> tuple[ss.Problem, float]:
    """A chain with one or two contacts, rubbed or not, opening or not; and a frequency near a mode.

    ``stiff`` contacts have 3 to 1000 times the stiffness of the structure.
    """
    rng = np.random.default_rng(10_000 + seed if stiff else seed)
    n = int(rng.integers(2, 6))
    springs, dofs = rng.uniform(10.0, 80.0, n + 1), [f"x{i}" for i in range(n)]
    K = (
        np.diag(springs[:-1] + springs[1:] + rng.uniform(5.0, 40.0, n))
        - np.diag(springs[1:-1], 1)
        - np.diag(springs[1:-1], -1)
    )
    M, kinds, load = np.diag(rng.uniform(0.5, 2.0, n)), rng.integers(0, 4), rng.uniform(2.0, 20.0)
    structure = ss.MatrixStructure(M=M, C=10 ** rng.uniform(-3.3, -1.7) * K, K=K, dofs=dofs)
    pairs = []
    for c in range(int(rng.integers(1, 3))):
        i = int(rng.integers(0, n))
        kt, mu = K.max() * 10 ** rng.uniform(*((0.5, 3.0) if stiff else (-0.7, 0.7))), rng.uniform(0.1, 0.6)
        rubbing = ss.RubbingMotion(velocity=float(rng.uniform(0.05, 3.0) * (kinds % 2)))
        if kinds >= 2:
            kn = K.max() * 10 ** rng.uniform(*((0.5, 3.0) if stiff else (-0.5, 1.8)))
            gap = rng.uniform(-0.15, 0.03) * (0.1 if stiff and rng.random() < 0.5 else 1.0)
            contact = ss.FrictionContact(kt=kt, mu=mu, kn=kn, gap=gap)
            pairs.append(ss.ContactPair(
                name=f"c{c}", tangential=dofs[i], normal=dofs[(i + 1) % n], contact=contact, rubbing=rubbing
            ))  # fmt: skip
        else:
            contact = ss.FrictionContact(kt=kt, mu=mu, normal_load=load * rng.uniform(0.1, 2.0))
            pairs.append(ss.ContactPair(name=f"c{c}", tangential=dofs[i], contact=contact, rubbing=rubbing))
    loads = [ss.Load(dof=dofs[int(rng.integers(0, n))], sin=load)]
    near = np.sort(structure.natural_frequencies)[int(rng.integers(0, 2))] * rng.uniform(0.6, 1.4)
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=harmonics), float(near)


def solved(problem: ss.Problem, omega: float, near: Array) -> list[Array] | None:
    """Motion of the outputs and of the contacts' ports, solved for next to that with fewer harmonics."""
    balance = Balance(problem)
    start = np.zeros((len(near), balance.L))
    start[:, : near.shape[1]] = near
    system = FrequencySystem(balance, problem.inputs)
    found = newton(lambda x: system.evaluate(x, omega), start.ravel(), scale=np.linalg.norm(start) or 1.0)
    if not found.converged:
        return None
    point = Point.at(
        found.evaluation.detail, x=found.x, residual=0.0, iterations=0, kind="regular", parameter=omega, peak_of=""
    )
    values = Recorder(balance).record(point)
    return [np.asarray(values[name]) for name in ("displacement", "contact_tangential", "contact_normal")]


def estimate_and_truth(seed: int, stiff: bool = False) -> tuple[float, float] | None:
    """The estimate with H = 5, and the largest change of a motion when 30 are kept; None without a solution of both."""
    problem, omega = random_case(seed, range(6), stiff)
    full, _ = random_case(seed, range(31), stiff)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)
        found = ss.forced_response(problem, omega=(omega, 1.002 * omega), options={"max_step": 1e-3 * omega})
        if not len(found) or float(found.dataset["omega"][0]) != omega:
            return None
        more = solved(full, omega, found.guess(0))
    if more is None:
        return None
    tau, moved = np.linspace(0.0, 2.0 * np.pi, 721), []
    of = [found.dataset[name].to_numpy()[0] for name in ("displacement", "contact_tangential", "contact_normal")]
    for h, X in ((problem.harmonics, of), (full.harmonics, more)):
        moved.append(np.concatenate(X)[:, 1:] @ h.H_minus(tau)[:, 1:].T)
    true = float(np.abs(moved[0] - moved[1]).max() / np.abs(moved[1]).max())
    return (float(found.dataset["truncation"][0]), true) if true > 1e-9 else None


def assert_estimates(seeds: range, share: float, stiff: bool = False, silent: int = 0) -> int:
    """``silent`` is the most that are above 2 % and not warned of."""
    cases = [case for seed in seeds if (case := estimate_and_truth(seed, stiff)) is not None]
    estimate, true = np.array(cases).T
    within = (estimate < 3.0 * true) & (estimate > true / 3.0)
    assert np.mean(within) >= share, np.c_[estimate, true][~within]
    assert np.sum(estimate[true > 0.02] <= 0.01) <= silent
    return len(cases)


def test_estimates_of_random_systems_are_near_the_change() -> None:
    assert assert_estimates(range(3, 8), 0.9) == 5


@pytest.mark.verify
def test_a_hundred_estimates_of_random_systems_are_near_the_change() -> None:
    assert assert_estimates(range(150), 0.9) >= 100


def test_estimates_at_stiff_contacts_are_near_the_change() -> None:
    """The set moves with the further orders: without that they are 0.24, 0.09 and 3.4 of the change."""
    for seed in (28, 129, 130):
        estimate, true = estimate_and_truth(seed, stiff=True) or (np.nan, np.nan)
        assert true / 3.0 < estimate < 3.0 * true


@pytest.mark.verify
def test_two_hundred_estimates_at_stiff_contacts_are_near_the_change() -> None:
    assert assert_estimates(range(360), 0.9, stiff=True, silent=4) >= 200


@pytest.mark.parametrize("seed", [5, 6, 28, 130])
@pytest.mark.parametrize("stiff", [False, True])
def test_motion_held_with_the_set_is_the_first_newton_step_of_the_wider_set(seed: int, stiff: bool) -> None:
    problem, omega = random_case(seed, range(6), stiff)
    wide = with_further(problem.harmonics)
    balance, wider = Balance(problem), Balance(random_case(seed, wide.orders, stiff)[0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)
        found = ss.steady_response(problem, omega=omega)
    x = np.asarray(found.guess(0)).reshape(-1)
    small = FrequencySystem(balance, problem.inputs)
    x = newton(lambda y: small.evaluate(y, omega), x, scale=np.linalg.norm(x)).x
    padded = np.zeros((balance.n_ports, wide.size))
    padded[:, wide.columns(problem.harmonics.orders)] = x.reshape(balance.n_ports, -1)
    value = FrequencySystem(wider, wider.problem.inputs).evaluate(padded.ravel(), omega)
    step = -value.jacobian.solve(value.residual)
    inputs = Assigned.of([problem.inputs])
    one = truncation_module._Wider(Outputs(balance, ()), x[None], np.array([omega]), inputs, wide)
    reactions = EachReaction([Reaction(small.evaluate(x, omega).jacobian)])
    free = one.moved(one.force)
    change = one.with_reaction(np.array([0]), one.held(np.array([0]), free[:1], reactions), reactions)[0]
    assert np.abs(step).max() > 1e-9 * np.abs(x).max()
    np.testing.assert_allclose(change.ravel(), step, rtol=0, atol=1e-9 * np.abs(step).max() + 1e-13 * np.abs(x).max())


@pytest.mark.parametrize("with_set", [False, True])
def test_many_points_are_held_as_each_alone(with_set: bool) -> None:
    problem, omega = random_case(3, range(6), True)
    balance, omegas = Balance(problem), omega * np.array([0.9, 1.0, 1.1])
    x = np.random.default_rng(0).normal(size=(3, balance.size))
    system, outputs = FrequencySystem(balance, problem.inputs), Outputs(balance, ())
    wide = with_further(problem.harmonics)
    reactions = EachReaction([Reaction(system.evaluate(*at).jacobian) for at in zip(x, omegas, strict=True)])

    def held(points: slice) -> Array:
        some = Assigned.of([problem.inputs] * len(x[points]))
        wider = truncation_module._Wider(outputs, x[points], omegas[points], some, wide)
        free, at = wider.moved(wider.force), np.arange(len(x[points]))
        return wider.held(at, free, reactions.at(points) if with_set else None)

    together = held(slice(0, 3))
    for i in range(3):
        alone = held(slice(i, i + 1))[0]
        np.testing.assert_allclose(together[i], alone, rtol=0, atol=1e-12 * np.abs(alone).max())


def test_odd_harmonics_under_rubbing_are_warned_of() -> None:
    with pytest.warns(ss.SlipstickWarning, match=r"harmonics left out would add about \d+ % .* at omega = .* rad/s"):
        found = branch(10.0, [0, 1, 3, 5])
    assert float(found.dataset["truncation"].max()) > 0.3
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        branch(10.0, list(range(11)))
        branch(0.0, [0, 1, 3, 5])  # without rubbing they are all there are


def test_permanent_slip_leaves_nothing_out() -> None:
    assert float(branch(260.0, [0, 1]).dataset["truncation"].max()) < 1e-14


def test_orders_looked_at() -> None:
    assert with_further(ss.Harmonics([0])).orders == (0, 1, 2)
    assert with_further(ss.Harmonics([0, 1, 3])).orders == tuple(range(6))
    assert with_further(ss.Harmonics(range(11))).orders == tuple(range(16))


def test_parameter_and_stored_results(tmp_path: Path) -> None:
    """The warning names the parameter; what is stored is what was computed."""
    with pytest.warns(ss.SlipstickWarning, match=r"at damper\.velocity = 1"):
        found = ss.parameter_response(
            oscillator(velocity=10.0, harmonics=[0, 1, 3]), "damper.velocity", (10.0, 30.0), omega=3.7
        )
    found.save(tmp_path / "r.nc")
    np.testing.assert_array_equal(load(tmp_path / "r.nc").dataset["truncation"], found.dataset["truncation"])
    attributes = found.dataset["truncation"].attrs
    assert attributes["units"] == "1"
    assert "harmonics left out" in attributes["long_name"]


def test_sentence() -> None:
    values = np.array([1.0, 2.0, 3.0])
    assert truncation_sentence("omega", values, np.array([1e-3, 1e-2, 0.0])) is None
    assert truncation_sentence("omega", np.empty(0), np.empty(0)) is None
    assert truncation_sentence("omega", values, np.full(3, np.nan)) is None
    said = truncation_sentence("damper.mu", values, np.array([0.05, 0.2, np.nan]))
    assert said is not None
    assert "about 20 % of the amplitude at damper.mu = 2 (and more than 1 % at 2 of 3 points)" in said


def test_points_are_looked_at_in_slices(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = branch(10.0, [0, 1, 2, 3]).dataset["truncation"].to_numpy()
    monkeypatch.setattr(truncation_module, "_HELD", 5000)
    np.testing.assert_array_equal(branch(10.0, [0, 1, 2, 3]).dataset["truncation"], whole)


@pytest.mark.parametrize("base", [False, True])
@pytest.mark.parametrize("n", [20, 140])
def test_many_frequencies_are_each_of_them(n: int, base: bool) -> None:
    """Large receptances are applied to all points together; those of moving supports have factors on columns."""
    rng = np.random.default_rng(3)
    left, right = rng.standard_normal((n, 7)), rng.standard_normal((n + 1, 7))
    whole = rng.standard_normal((2, n, n + 1))
    plain = ModalReceptance(
        left=left, right=right, stiffness=np.arange(1.0, 8.0) ** 2 * (1.0 + 0.01j), damping=np.full(7, 0.1),
        static=whole[0] + (left / np.arange(1.0, 8.0) ** 2) @ right.T, residual=whole[0], second=1e-3 * whole[1],
    )  # fmt: skip
    receptance = BaseReceptance(plain, [None] * n + ["displacement"]) if base else plain
    orders, omega, forces = np.array([3.0, 5.0]), np.array([0.7, 1.9, 4.2]), rng.standard_normal((3, n + 1, 4))
    found = moved(receptance, orders, forces, omega, [{}] * 3)
    A, _ = receptance.at(orders, omega)
    for each, at, F in zip(found, A, forces, strict=True):
        assert not each[:, 0].any()
        for k, own in enumerate(at):
            answer = own @ (F[:, 2 * k] - 1j * F[:, 2 * k + 1])
            np.testing.assert_allclose(each[:, 1 + 2 * k], -answer.real, rtol=0, atol=1e-11 * np.abs(answer).max())
            np.testing.assert_allclose(each[:, 2 + 2 * k], answer.imag, rtol=0, atol=1e-11 * np.abs(answer).max())


def test_it_is_near_the_truth_next_to_resonance_with_either_jacobian() -> None:
    """The set's answer counts there, though the further orders move 3e-5 alone."""
    K, at, tau = np.array([[60.0, -20.0], [-20.0, 40.0]]), [5.35, 5.45, 5.5], np.linspace(0.0, 2.0 * np.pi, 721)

    def curve(jacobian: str, highest: int) -> Branch:
        contact = ss.FrictionContact(kt=3.0, mu=0.3, normal_load=0.5)
        problem = ss.Problem(
            ss.MatrixStructure(M=np.eye(2), C=2e-4 * K, K=K, dofs=["a", "b"]),
            contacts=ss.ContactPair(name="c", contact=contact, tangential="b"), loads=ss.Load(dof="a", sin=0.3),
            harmonics=range(highest + 1),
        )  # fmt: skip
        return ss.forced_response(problem, omega=(4.5, 6.5), at=at, options={"jacobian": jacobian})

    def motion(found: Branch) -> Array:
        X = found.dataset["displacement"].to_numpy()[[found.at(omega) for omega in at]]
        return X[..., 1:] @ found.harmonics.H_minus(tau)[:, 1:].T

    kept, full = [curve(jacobian, 5) for jacobian in ("dense", "iterative")], motion(curve("dense", 31))
    true = np.abs(motion(kept[0]) - full).max(axis=(1, 2)) / np.abs(full).max(axis=(1, 2))
    dense, iterative = (found.dataset["truncation"].to_numpy()[[found.at(omega) for omega in at]] for found in kept)
    assert np.all((dense > true / 2.0) & (dense < 2.0 * true))
    assert iterative == pytest.approx(dense, rel=0.05)
