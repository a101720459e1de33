"""A stop without friction: no tangential direction is needed, and everything round it works."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy.integrate import solve_ivp

import slipstick as ss
from slipstick.case.script import python_script

KN, GAP, LOAD = 20.0, 0.05, 1.0


def oscillator(
    pair: ss.ContactPair, *, dofs: tuple[str, ...] = ("x",), load: float = LOAD, harmonics=range(16)
) -> ss.Problem:
    """``x'' + 0.2 x' + x + kn max(x - gap, 0) = load sin``; a second dof stands beside and feels nothing."""
    own = np.eye(len(dofs))
    structure = ss.MatrixStructure(M=own, C=0.2 * own, K=own, dofs=list(dofs))
    return ss.Problem(
        structure, contacts=[pair], loads=[ss.Load(dof="x", sin=load)], harmonics=harmonics, outputs=["x"]
    )


def stop(**more) -> ss.ContactPair:
    return ss.ContactPair(name="stop", contact=ss.FrictionContact(kn=KN, gap=GAP), normal={"x": 1.0}, **more)


def in_time(omega: float, gap=lambda t: GAP) -> np.ndarray:
    """Start of a periodic motion and its multipliers, by shooting with the equations written here."""
    T = 2.0 * np.pi / omega

    def rates(t, z):
        (x, v), Phi = z[:2], z[2:].reshape(2, 2)
        touching = x > gap(t)
        J = np.array([[0.0, 1.0], [-1.0 - KN * touching, -0.2]])
        return [v, LOAD * np.sin(omega * t) - 0.2 * v - x - KN * touching * (x - gap(t)), *(J @ Phi).ravel()]

    y = np.zeros(2)
    for i in range(12):
        end = solve_ivp(rates, (0.0, T), [*y, 1.0, 0.0, 0.0, 1.0], rtol=1e-10, atol=1e-12, max_step=T / 400).y[:, -1]
        Phi = end[2:].reshape(2, 2)
        y = end[:2] if i < 4 else y + np.linalg.solve(np.eye(2) - Phi, end[:2] - y)
    return Phi, y


def test_it_is_the_one_with_a_direction_that_nothing_moves() -> None:
    """To rounding: with friction of zero along a dof beside it."""
    beside = ss.ContactPair(
        name="stop", contact=ss.FrictionContact(kt=0.0, mu=0.0, kn=KN, gap=GAP), tangential="beside", normal="x"
    )
    a = ss.forced_response(oscillator(stop()), omega=(0.5, 3.0), at=[0.9, 1.7])
    with pytest.warns(ss.SlipstickWarning, match="kt = 0"):
        b = ss.forced_response(oscillator(beside, dofs=("x", "beside")), omega=(0.5, 3.0), at=[0.9, 1.7])
    for omega in (0.9, 1.7):
        X, Y = (c.dataset.displacement.values[c.at(omega), 0] for c in (a, b))
        np.testing.assert_allclose(X, Y, rtol=0.0, atol=1e-12 * np.abs(X).max())
    assert a.peaks("x") == [pytest.approx(peak, rel=1e-9) for peak in b.peaks("x")]


def test_a_stop_always_closed_is_a_spring() -> None:
    """Closed form: the receptance with the spring, and the deflection by its preload."""
    closed = ss.ContactPair(name="stop", contact=ss.FrictionContact(kn=KN, normal_load=100.0), normal="x")
    found = ss.forced_response(oscillator(closed, harmonics=range(4)), omega=(2.0, 2.1), stability=True)
    H = 1.0 / (1.0 + KN - 4.0 + 0.4j)
    assert found.dataset.amplitude.values[0, 0] == pytest.approx(abs(H), rel=1e-10)
    assert found.dataset["mean"].values[0, 0] == pytest.approx(-100.0 / (1.0 + KN), rel=1e-10)
    largest = np.nanmax(np.abs(found.dataset.multiplier.values[0] @ [1.0, 1.0j]))
    assert largest == pytest.approx(np.exp(-0.1 * np.pi), rel=1e-8)


@pytest.mark.parametrize("method", ["states", "loop", "time", "stability"])
def test_what_is_asked_of_it(method: str) -> None:
    branch = ss.forced_response(
        oscillator(stop(), harmonics=range(31)), omega=(1.7, 1.75), stability=method == "stability"
    )
    if method == "states":
        kinds = {state for _, _, state in branch.states(0)["stop"]}
        assert "separation" in kinds
        assert len(kinds) > 1
    elif method == "loop":
        loop = branch.loop(0, "stop", port="normal")
        np.testing.assert_allclose(loop["force"], KN * np.maximum(loop["motion"] - GAP, 0.0), atol=1e-12)
    elif method == "time":
        check = branch.check_in_time(0)
        assert check.converged
        assert check.relative_difference < 1e-4
        assert float(branch.dataset.dissipated_power[0, 0]) == 0.0
    else:
        Phi, _ = in_time(1.7)
        own = np.linalg.eigvals(Phi)
        found = branch.dataset.multiplier.values[0] @ [1.0, 1.0j]
        np.testing.assert_allclose(np.sort_complex(found[:2]), np.sort_complex(own), atol=2e-5)


def test_a_surface_that_comes_nearer() -> None:
    """A moving stop against time integration."""
    moving = stop(rubbing=ss.RubbingMotion(normal_cos={2: 0.02}))
    branch = ss.forced_response(oscillator(moving, harmonics=range(31)), omega=(1.7, 1.75))
    _, y = in_time(1.7, lambda t: GAP - 0.02 * np.cos(2 * 1.7 * t))
    X, h = branch.dataset.displacement.values[0, 0], branch.harmonics
    size = np.abs(X).max()
    assert X @ h.H_minus(0.0) == pytest.approx(y[0], abs=1e-4 * size)
    assert branch.check_in_time(0).relative_difference < 1e-4


def test_two_stops_and_a_friction_contact_in_one_problem() -> None:
    both = ss.ContactPair(
        name="stops", contact=ss.FrictionContact(kn=KN, gap=[GAP, 0.1]), normal=[{"x": 1.0}, {"x": -1.0}]
    )
    damper = ss.ContactPair(name="damper", contact=ss.FrictionContact(kt=5.0, mu=0.3, normal_load=0.5), tangential="x")
    given = oscillator(both)
    mixed = ss.Problem(given.structure, contacts=[both, damper], loads=given.loads, harmonics=range(21))
    branch = ss.forced_response(mixed, omega=(1.7, 1.75), stability=True)
    assert branch.check_in_time(0).relative_difference < 1e-3
    assert branch.dataset.stable.values[0] == 1
    assert branch.dataset.dissipated_power.values[0, :2].tolist() == [0.0, 0.0]


def test_what_a_stop_may_not_be_given() -> None:
    with raises_fault("contact", "s", statement="kt and mu are missing"):
        oscillator(ss.ContactPair(name="s", contact=ss.FrictionContact(kn=KN, gap=GAP), tangential="x"))
    with raises_fault("contact", "s", "tangential", statement="has no direction"):
        oscillator(ss.ContactPair(name="s", contact=ss.FrictionContact(kt=1.0, mu=0.1, kn=KN, gap=GAP), normal="x"))
    with raises_fault("contact", "s", "normal", statement="has no direction"):
        oscillator(ss.ContactPair(name="s", contact=ss.FrictionContact(kn=KN, gap=GAP)))
    with raises_fault("contact", "stop", "rubbing", says="velocity slides along 'tangential'"):
        oscillator(stop(rubbing=ss.RubbingMotion(velocity=1.0)))
    with raises_fault("contact", "s", "mu", statement="is missing"):
        oscillator(
            ss.ContactPair(name="s", contact=ss.FrictionContact(kt=1.0, kn=KN, gap=GAP), tangential="x", normal="x")
        )


CASE = """
format = 1
harmonics = "0..15"
[structure]
kind = "matrices"
dofs = ["x"]
mass = [[1.0]]
damping = [[0.2]]
stiffness = [[1.0]]
[[load]]
dof = "x"
sin = 1.0
[[contact]]
name = "stop"
normal = "x"
kn = 20.0
gap = 0.05
[response]
from = 1.7
to = 1.75
"""


def test_in_a_case_file(tmp_path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    problem = ss.load_case(path)
    found = ss.forced_response(problem, omega=(1.7, 1.75)).dataset.amplitude.values[0, 0]
    wanted = ss.forced_response(oscillator(stop()), omega=(1.7, 1.75)).dataset.amplitude.values[0, 0]
    assert found == pytest.approx(wanted, rel=1e-12)
    script = python_script(CASE, "case.toml", tmp_path)
    assert "ss.FrictionContact(kn=20.0, gap=0.05)" in script
