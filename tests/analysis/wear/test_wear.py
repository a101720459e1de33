"""Wear over cycles against closed forms, exact derivatives against differences, and where it ends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.oscillator import damper, one_mass
from helpers.rings import pairs, wave_problem
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import slipstick as ss
from slipstick.analysis.wear.wear import wear_request
from slipstick.typing import Array

KT, MU, KN, K_W = 50.0, 0.3, 20.0, 1e-5
STUCK = KT / MU
"""Normal load above which a contact sticks that moves by 1."""


def prescribed(load: float, velocity: float = 0.0) -> ss.Problem:
    """A contact on next to rigid ground whose opposing surface moves by cos(tau) and a velocity per rad."""
    return ss.Problem(
        ss.MatrixStructure(M=[[1.0]], K=[[1e14]], dofs=["x"]),
        contacts=ss.ContactPair(
            name="tip", tangential="x", contact=ss.FrictionContact(kt=KT, mu=MU, kn=KN, normal_load=load),
            rubbing=ss.RubbingMotion(velocity=velocity, cos={1: 1.0}),
        ),
        harmonics=range(4), told=None,
    )  # fmt: skip


def oscillator(load: float = 800.0, **options: Any) -> ss.Problem:
    return one_mass(damper(kn=1.0, normal_load=load), harmonics=range(11), told=None, **options)


def loads(branch: ss.Branch) -> Array:
    found: Array = branch.dataset["normal_load"].to_numpy()
    return found


def last(branch: ss.Branch, name: str) -> float:
    return float(branch.dataset[name].to_numpy().reshape(len(branch), -1)[-1, 0])


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_a_contact_that_moves_to_and_fro_wears_as_the_closed_form(method: str) -> None:
    """``N = N_s / (1 + (N_s / N_0 - 1) exp(c n))``, ``c = 4 k_w kn a``: E = 4 mu N (a - mu N / kt)."""
    first, length = 0.7 * STUCK, 1000.0 if method == "implicit" else 5000.0
    branch = ss.wear(
        prescribed(first), {"tip": K_W / MU}, (0, length), omega=1.0, at=100.0, method=method, tolerance=1e-10,
        max_change=1.0,
    )  # fmt: skip
    n = branch.dataset["cycles"].to_numpy()
    exact = STUCK / (1.0 + (STUCK / first - 1.0) * np.exp(4.0 * K_W * KN * n))
    assert branch.outcome.ok
    assert loads(branch)[branch.at(100.0), 0] == pytest.approx(113.8226795034, rel=1e-8)
    np.testing.assert_allclose(loads(branch)[:, 0], exact, rtol=1e-8)


def test_a_contact_that_slides_for_ever_loses_its_load_exponentially() -> None:
    branch = ss.wear(
        prescribed(0.7 * STUCK, 3.0), {"tip": K_W / MU}, (0, 500), omega=1.0, tolerance=1e-10, max_change=1.0
    )
    n = branch.dataset["cycles"].to_numpy()
    np.testing.assert_allclose(loads(branch)[:, 0], 0.7 * STUCK * np.exp(-2 * np.pi * 3 * KN * K_W * n), rtol=1e-8)
    assert loads(branch)[-1, 0] == pytest.approx(17.7141768977, rel=1e-8)


def test_without_load_it_ends() -> None:
    branch = ss.wear(prescribed(0.7 * STUCK, 3.0), K_W / MU, (0, 1e5), omega=1.0)
    assert branch.outcome is ss.Outcome.NOTHING_TOUCHES
    assert str(branch.dataset["kind"][-1].item()) == "separation"
    # N falls to 1e-4 of what it was; the load is right to 1e-7 of the first one, or 1e-3 of the last
    assert last(branch, "cycles") == pytest.approx(np.log(1e4) / (2.0 * np.pi * 3.0 * KN * K_W), rel=1e-3)


def test_a_contact_that_sticks_never_wears() -> None:
    branch = ss.wear(prescribed(1.2 * STUCK), {"tip": K_W / MU}, (0, 1e6), omega=1.0)
    assert branch.outcome.ok
    assert last(branch, "worn_depth") < 1e-20


def test_the_oscillator_at_one_frequency() -> None:
    """A reference computed with independent code: 400 cycles at the peak of the unworn oscillator."""
    branch = ss.wear(oscillator(), {"damper": 8e-4}, (0, 400), omega=10.7901272065)
    assert last(branch, "normal_load") == pytest.approx(542.141571, abs=1e-6)
    assert last(branch, "worn_depth") == pytest.approx(800.0 - 542.141571, abs=1e-6)
    worn = ss.steady_response(branch.problem_at(-1), omega=10.7901272065).dataset
    assert float(worn["amplitude"][0, 0]) == pytest.approx(last(branch, "amplitude"), rel=1e-9)


def test_the_oscillator_at_its_peak() -> None:
    branch = ss.wear(oscillator(), {"damper": 8e-4}, (0, 400), omega="peak", range=(6.0, 15.0))
    assert last(branch, "normal_load") == pytest.approx(531.148636, abs=1e-6)
    assert last(branch, "amplitude") == pytest.approx(2.83635, abs=5e-6)
    assert last(branch, "omega") == pytest.approx(9.87576, abs=5e-6)
    peaks = ss.forced_response(branch.problem_at(-1), omega=(8.0, 12.0)).peaks("x")
    assert peaks == [
        (pytest.approx(last(branch, "omega"), rel=1e-6), pytest.approx(last(branch, "amplitude"), rel=1e-9))
    ]


@pytest.mark.parametrize(("method", "order", "steps"), [("euler", 1, 20), ("midpoint", 2, 10), ("rk4", 4, 5)])
def test_equal_steps_show_their_order(method: str, order: int, steps: int) -> None:
    errors = [
        abs(last(ss.wear(oscillator(), 8e-4, (0, 400), omega=10.7901272065, method=method, steps=count), "normal_load")
            - 542.14157153)
        for count in (steps, 2 * steps)
    ]  # fmt: skip
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)


def test_worn_out_at_a_depth() -> None:
    branch = ss.wear(oscillator(), {"damper": 8e-4}, (0, 400), omega=10.7901, depth={"damper": 200.0})
    assert branch.outcome is ss.Outcome.WORN_OUT
    assert str(branch.dataset["kind"][-1].item()) == "worn out"
    assert last(branch, "worn_depth") == pytest.approx(200.0, rel=1e-10)
    again = ss.wear(oscillator(), {"damper": 8e-4}, (0, last(branch, "cycles")), omega=10.7901)
    assert last(again, "worn_depth") == pytest.approx(200.0, rel=1e-7)


def bistable() -> ss.Problem:
    stop = ss.ContactPair(name="stop", normal="x", contact=ss.FrictionContact(kn=400.0, gap=15.0))
    damper = ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, normal_load=240.0)
    return ss.Problem(
        ss.MatrixStructure(M=[[1.0]], C=[[0.1]], K=[[40.0]], dofs=["x"]),
        contacts=[ss.ContactPair(name="damper", tangential="x", contact=damper), stop],
        loads=ss.Load(dof="x", sin=100.0), harmonics=range(6), told=None,
    )  # fmt: skip


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_it_ends_at_a_fold_and_does_not_leap_to_another_motion() -> None:
    branch = ss.wear(bistable(), {"damper": 1e-3}, (0, 400), omega=6.6)
    assert branch.outcome is ss.Outcome.MOTION_LOST
    load, guess = last(branch, "normal_load"), branch.guess(len(branch) - 1)
    way = ss.parameter_response(
        branch.problem_at(-1), "damper.normal_load", (load + 0.1, load - 1.0), omega=6.6, guess=guess
    )
    d = way.dataset
    fold = float(d["parameter"].to_numpy()[d["kind"].to_numpy() == "turning point"][0])
    assert load == pytest.approx(fold, abs=1e-4 * 240.0)
    assert load > fold
    assert np.diff(branch.dataset["amplitude"].to_numpy()[-6:, 0]).max() < 0.01


HOT = ss.ThermalModel(
    curve=ss.FrictionCurve(temperature=[20, 200, 400], mu=[0.3, 0.25, 0.2]), background=20.0, resistance=0.2
)


@pytest.mark.parametrize("at_peak", [False, True])
@pytest.mark.parametrize("thermal", [None, HOT], ids=["cold", "hot"])
def test_derivatives_are_those_of_solutions_nearby(at_peak: bool, thermal: ss.ThermalModel | None) -> None:
    where: dict[str, Any] = {"omega": "peak", "range": (6.0, 15.0)} if at_peak else {"omega": 10.0}
    steady = wear_request(oscillator(thermal=thermal), 8e-4, (0, 400), **where).run().steady
    here = steady.first()
    assert here is not None
    near, step = steady.onward(here), 1e-2
    up, down = (steady.solve(here.z + side, here.y, near) for side in (step, -step))
    assert up is not None
    assert down is not None
    assert steady.slopes(here)[0] == pytest.approx((up.rate - down.rate) / (2.0 * step), rel=1e-6)
    moved = (up.y - down.y) / (2.0 * step) * here.rate
    assert steady.drift(here) == pytest.approx(moved, rel=1e-5, abs=1e-9 * float(np.abs(moved).max()))


def test_heated_contacts_wear_at_their_temperature() -> None:
    hot = oscillator(thermal=HOT)
    branches = [
        ss.wear(hot, 8e-4, (0, 100), omega=10.0, method=method, max_change=0.3) for method in ("explicit", "implicit")
    ]
    assert last(branches[0], "normal_load") == pytest.approx(last(branches[1], "normal_load"), rel=1e-7)
    d, again = branches[0].dataset, ss.steady_response(branches[0].problem_at(-1), omega=10.0).dataset
    assert float(again["temperature"][0, 0]) == pytest.approx(float(d["temperature"][-1, 0]), rel=1e-9)
    assert abs(float(d["temperature"][0, 0]) - float(d["temperature"][-1, 0])) > 1.0


def test_a_circle_of_planar_friction() -> None:
    """``a |k - w^2 + b l / a^2 + i (c w + b s / a^2)| = p``, ``s^2 = a^2 - l^2``, ``E = 2 pi b s``."""
    foot = ss.PlanarFrictionContact(kt=100.0, mu=0.3, kn=1.0, normal_load=800.0)
    problem = ss.Problem(
        ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=40.0 * np.eye(2), dofs=["x", "y"]),
        contacts=ss.ContactPair(name="foot", tangential=("x", "y"), contact=foot),
        loads=[ss.Load(dof="x", cos=200.0), ss.Load(dof="y", sin=200.0)], harmonics=range(4), told=None,
    )  # fmt: skip

    def rate(n: float, load: Array) -> list[float]:
        b, w = 0.3 * float(load[0]), 9.0
        l = b / 100.0  # noqa: E741
        side = lambda a: np.sqrt(a * a - l * l)  # noqa: E731
        balance = lambda a: a * abs(40 - w * w + b * l / a**2 + 1j * (0.4 * w + b * side(a) / a**2)) - 200.0  # noqa: E731
        return [-8e-5 * 2.0 * np.pi * b * float(side(brentq(balance, l * (1 + 1e-12), 50.0, xtol=1e-14)))]

    exact = solve_ivp(rate, (0.0, 400.0), [800.0], method="DOP853", rtol=1e-12, atol=1e-9).y[0, -1]
    branch = ss.wear(problem, {"foot": 8e-5}, (0, 400), omega=9.0)
    assert last(branch, "normal_load") == pytest.approx(float(exact), rel=1e-7)  # of the contact: 1e-8


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_every_sector_of_a_wave_wears_alike() -> None:
    wave = wave_problem(6, 2, pairs(), 1 - 6j, 0.3)
    whole = wave.structure.sector.mistuned().problem(wave)  # type: ignore[attr-defined]
    kappa, ends = {"shroud": 1e-4, "casing": 3e-4}, (0.0, 50.0)
    one, all_six = (ss.wear(p, kappa, ends, omega=7.9, tolerance=1e-8).dataset["worn_depth"] for p in (wave, whole))
    assert float(one[-1].max()) > 1e-4
    by_name = {name: one[-1].sel(contact=name).item() for name in ("shroud", "casing")}
    for name in all_six["contact"].to_numpy():
        worn = by_name[str(name).partition(".")[0].partition("@")[0]]
        assert float(all_six[-1].sel(contact=name)) == pytest.approx(worn, rel=1e-6)


def test_load_goes_over_to_the_contacts_that_stick() -> None:
    """Three feet of one body share a load; the outer ones wear until those that wear do so alike."""
    feet = ss.ContactPair(
        name="foot", contact=ss.FrictionContact(kt=1e3, mu=0.3, kn=1e4, gap=np.array([0.0, 0.0, 0.0])),
        tangential=["x"] * 3, normal=[{"y": 1.0, "turn": arm} for arm in (-1.0, 0.0, 1.0)],
        rubbing=ss.RubbingMotion(velocity=1.0),
    )  # fmt: skip
    problem = ss.Problem(
        ss.MatrixStructure(
            M=np.eye(3), C=10.0 * np.eye(3), K=np.diag([1e5, 10.0, 10.0]), dofs=["x", "y", "turn"]
        ),
        contacts=feet,
        loads=[
            ss.Load(dof="y", harmonic=0, cos=90.0), ss.Load(dof="turn", harmonic=0, cos=20.0), ss.Load(dof="x", sin=1.0)
        ],
        harmonics=range(3), told=None,
    )  # fmt: skip
    branch = ss.wear(problem, {"foot": [1e-7, 2e-7, 1e-7]}, (0.0, 2e5), omega=50.0)
    d = branch.dataset
    assert branch.outcome.ok
    depth, load = d["worn_depth"].to_numpy(), d["normal_load"].to_numpy()
    # stiff: the decay of differences of load is 1e4 times faster than the wear of the body; few steps all the same
    assert len(branch) < 80
    # in the end all sink as a rigid body, and wear at rates kappa N that lie on a line over the arm
    rates = np.array([1e-7, 2e-7, 1e-7]) * load[-1]
    assert rates[1] == pytest.approx(0.5 * (rates[0] + rates[2]), rel=2e-2)
    assert np.all(np.diff(depth, axis=0) >= 0.0)


@pytest.mark.parametrize(
    ("arguments", "where"),
    [
        ({"kappa": {"dumper": 1.0}}, "kappa"), ({"kappa": {"damper": -1.0}}, "kappa"), ({"kappa": 0.0}, "kappa"),
        ({"kappa": {"damper": [1.0, 2.0]}}, "kappa"), ({"cycles": (100, 0)}, "cycles"),
        ({"at": 900}, "at"), ({"range": (2.0, 3.0)}, "range"), ({"dof": "x"}, "dof"),
        ({"omega": "peak"}, "range"), ({"method": "rk5"}, "method"), ({"method": "rk4"}, "steps"),
        ({"steps": 3}, "steps"), ({"depth": -1.0}, "depth"), ({"tolerance": 2.0}, "tolerance"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_named(arguments: dict[str, Any], where: str) -> None:
    good: dict[str, Any] = {"problem": oscillator(), "kappa": 8e-4, "cycles": (0, 400), "omega": 10.0}
    with pytest.raises(ss.InputError) as caught:
        ss.wear(**(good | arguments))
    assert [fault.where[0] for fault in caught.value.faults] == [where]


def test_a_contact_without_kn_is_told() -> None:
    problem = oscillator()
    damper = ss.ContactPair(
        name="damper", tangential="x", contact=ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    )
    problem = ss.Problem(problem.structure, contacts=damper, loads=problem.loads, harmonics=range(4))
    with pytest.warns(ss.SlipstickWarning, match="kn is not given and taken as 1"):
        ss.wear(problem, {"damper": 8e-4}, (0, 1), omega=10.0)
