"""Vibration that damping feeds and friction limits, held against integration in time: limit cycles, forced motion."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import slipstick as ss

FED, STIFFNESS, KT, LIMIT = 0.12, 40.0, 10.0, 3.0
"""``x'' - FED x' + STIFFNESS x + f = p``; f sticks with KT and slips at LIMIT."""

RATIO = -FED / (2.0 * np.sqrt(STIFFNESS))
WORDS = "damping feeds energy in"


def matrices() -> ss.MatrixStructure:
    return ss.MatrixStructure(M=[[1.0]], C=[[-FED]], K=[[STIFFNESS]], dofs=["x"])


def modes() -> ss.ModalStructure:
    return ss.ModalStructure(omega=[np.sqrt(STIFFNESS)], mode_shapes=[[1.0]], dofs=["x"], damping_ratio=RATIO)


def oscillator(structure: ss.Structure) -> ss.Problem:
    contact = ss.FrictionContact(kt=KT, mu=0.3, normal_load=LIMIT / 0.3)
    pair = ss.ContactPair(name="damper", tangential="x", contact=contact)
    problem = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=2.0), harmonics=range(20))
    with pytest.warns(ss.SlipstickWarning, match=WORDS):
        ss.linear_response(problem, omega=2.0)
    return problem


@pytest.fixture(scope="module")
def problem() -> ss.Problem:
    return oscillator(matrices())


def swings(start: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Sizes and times of the extremes of free vibration from ``start`` on, its spring stretched to the limit; exact
    pieces between changes of state, by a code that knows neither harmonics nor the element."""
    x, force, time = start, LIMIT if start > 0 else -LIMIT, 0.0
    sizes, times = [], []
    for _ in range(count):
        state, kt = np.array([x, 0.0]), KT
        while True:  # a stick, then a slip, until the motion turns
            sign = -np.sign(x)

            def rate(_t, s, kt=kt, f0=force, x0=state[0]):
                return [s[1], FED * s[1] - STIFFNESS * s[0] - f0 - kt * (s[0] - x0)]

            def slips(_t, s, kt=kt, f0=force, x0=state[0], sign=sign):
                return sign * (f0 + kt * (s[0] - x0)) - LIMIT if kt else -1.0

            def turns(t, s, sign=sign):
                return sign * s[1] if t > 1e-6 else 1.0

            slips.terminal = turns.terminal = True
            turns.direction = -1.0
            found = solve_ivp(rate, (0.0, 5.0), state, events=[slips, turns], method="DOP853", rtol=1e-9, atol=1e-11)
            time += found.t[-1]
            force += kt * (found.y[0, -1] - state[0])
            state = found.y[:, -1]
            if found.t_events[1].size:
                break
            kt = 0.0
        x = state[0]
        sizes.append(abs(x))
        times.append(time)
    return np.array(sizes), np.array(times)


def test_where_a_mode_has_no_damping_is_the_limit_cycle_that_time_finds(problem: ss.Problem) -> None:
    """Small motion grows, larger motion decays towards it; beyond a second cycle the friction is too weak."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)
        mode = ss.nonlinear_modes(problem, amplitude=(0.2, 8.0)).dataset
    damping, size, omega = (np.asarray(mode[name]).reshape(len(mode.point), -1)[:, 0] for name in
                            ("modal_damping", "amplitude", "omega"))  # fmt: skip
    assert damping[0] == pytest.approx(RATIO * np.sqrt(STIFFNESS / (STIFFNESS + KT)), rel=1e-6)  # stuck
    stable, beyond = np.flatnonzero(np.diff(np.sign(damping)))
    cycle = np.interp(0.0, damping[stable : stable + 2], size[stable : stable + 2])
    limit = np.interp(0.0, -damping[beyond : beyond + 2], size[beyond : beyond + 2])

    for start in (0.31, 0.34):
        found, times = swings(start, 30)
        assert found[-1] == pytest.approx(cycle, rel=3e-4)
        assert np.pi / (times[-1] - times[-2]) == pytest.approx(omega[stable], rel=1e-4)
    assert swings(0.98 * limit, 6)[0][-1] < 0.98 * limit
    assert swings(1.02 * limit, 6)[0][-1] > 1.02 * limit


@pytest.mark.parametrize("structure", [matrices, modes])
def test_forced_motion_is_bounded_and_its_verdict_that_of_time(structure) -> None:
    """Stuck motion of small load grows as the damping says; where friction acts on enough motion it is steady."""
    given = oscillator(structure())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)
        branch = ss.forced_response(given, omega=(4.9, 8.6), at=[5.0, 7.0, 8.5], stability=True)
    stuck, held, fast = (branch.dataset.isel(point=branch.at(w)) for w in (5.0, 7.0, 8.5))
    for point, omega in ((stuck, 5.0), (fast, 8.5)):
        size = 2.0 / abs(STIFFNESS + KT - omega**2 - 1j * FED * omega)
        assert float(point["amplitude"][0]) == pytest.approx(size, rel=1e-9)
        multiplier = abs(complex(*np.asarray(point["multiplier"])[0]))
        assert multiplier == pytest.approx(np.exp(FED * np.pi / omega), rel=1e-9)
        assert int(point["stable"]) == 0
    assert int(held["stable"]) == 1
    marched = ss.transient(given, 7.0, method="march", periods=200)
    assert marched.converged
    check = branch.check_in_time(branch.at(7.0))
    assert check.relative_difference < 1e-4
    assert float(marched.amplitude[0]) == pytest.approx(float(held["amplitude"][0]), rel=1e-4)


def test_a_fast_mode_that_grows_is_not_left_at_rest() -> None:
    """Modes far above the harmonics are at rest in multipliers, but those that feed themselves stay in motion."""
    omega = np.r_[np.arange(1.0, 13.0), 300.0]
    ratio = np.r_[np.full(12, 0.01), -1e-4]
    shapes = np.r_[np.ones(12), 10.0][None, :]
    structure = ss.ModalStructure(omega=omega, mode_shapes=shapes, dofs=["x"], damping_ratio=ratio)
    contact = ss.FrictionContact(kt=1e-3, mu=0.3, normal_load=1e3)
    pair = ss.ContactPair(name="damper", tangential="x", contact=contact)
    problem = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=1e-3), harmonics=range(6))
    with pytest.warns(ss.SlipstickWarning, match="mode 13 at 300 rad/s, damping ratio -0.0001"):
        branch = ss.forced_response(problem, omega=(6.5, 6.6), at=6.5, stability=True)
    assert int(branch.dataset["stable"][branch.at(6.5)]) == 0
    size = np.nanmax(np.abs(np.asarray(branch.dataset["multiplier"])[branch.at(6.5)] @ [1.0, 1j]))
    assert size == pytest.approx(np.exp(1e-4 * 300.0 * 2.0 * np.pi / 6.5), rel=1e-6)
