"""A mass on a belt with Stribeck friction: onset in closed form, stick-slip against an integration with events."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import slipstick as ss

KT = 30.0


def oscillator(harmonics):
    """x'' + 0.1 x' + x + f = 0, mu = 0.5 + 0.5 exp(-v / 0.5), N = 1; the belt moves at -velocity."""
    law = ss.StribeckContact(kt=KT, mu_s=1.0, mu_d=0.5, v_s=0.5, normal_load=1.0)
    rubbing = ss.RubbingMotion(velocity=-1.3)
    return ss.Problem(
        ss.MatrixStructure(M=[[1.0]], C=[[0.1]], K=[[1.0]], dofs=["x"]),
        contacts=ss.ContactPair(name="belt", contact=law, tangential="x", rubbing=rubbing),
        harmonics=range(harmonics + 1),
    )


def test_vibration_begins_where_damping_and_falling_friction_cancel(tmp_path):
    branch = ss.limit_cycles(oscillator(3), "belt.velocity", (-1.17, -1.14))
    hopf = next(point for point in branch.bifurcations() if point.kind == "Hopf")
    onset = 0.5 * np.log(0.5 / (0.1 * 0.5))  # 0.1 + mu'(V) = 0
    assert hopf.value == pytest.approx(-onset, rel=1e-12)
    assert hopf.omega == pytest.approx(1.0, rel=1e-12)
    cycles = branch.dataset.isel(point=np.flatnonzero(branch.dataset.branch_part == 1))
    # faster belts, where steady sliding is stable: the bifurcation is subcritical, its cycles are unstable
    assert np.all(cycles.parameter[1:] < -onset)
    assert np.all(cycles.unstable_multipliers[1:] == 1)
    branch.save(tmp_path / "belt.nc")
    assert ss.load(tmp_path / "belt.nc").problem.contacts[0].contact == branch.problem.contacts[0].contact


def stick_slip_amplitude(V, periods=60):
    """Of the motion that a start outside leads to, integrated piece by piece up to located changes of state."""

    def mu(v):
        return 0.5 + 0.5 * np.exp(-abs(v) / 0.5)

    def slope(v):
        return -np.exp(-abs(v) / 0.5) * np.sign(v)

    end, t, y, side, e, kept = 2.0 * np.pi * periods, 0.0, np.array([1.5, 0.0]), -1, 0.0, []
    while t < end:

        def force(t, y, side=side, e=e):
            return side * mu(y[1] - V) if side else KT * (y[0] - V * t) + e

        def rate(t, y, force=force):
            return [y[1], -0.1 * y[1] - y[0] - force(t, y)]

        def sticks(t, y, side=side, rate=rate):
            return side * KT * (y[1] - V) - slope(y[1] - V) * rate(t, y)[1]

        def upper(t, y, force=force):
            return mu(y[1] - V) - force(t, y)

        def lower(t, y, force=force):
            return mu(y[1] - V) + force(t, y)

        events = [sticks] if side else [upper, lower]
        for event in events:
            event.direction, event.terminal = -1, True
        s = solve_ivp(rate, (t, end), y, events=events, rtol=1e-9, atol=1e-11, max_step=0.05)
        kept += s.y[0, s.t > end - 20.0].tolist()
        t, y = s.t[-1], s.y[:, -1]
        if s.status == 1 and side:
            side, e = 0, side * mu(y[1] - V) - KT * (y[0] - V * t)
        elif s.status == 1:
            side = 1 if s.t_events[0].size else -1
    return np.ptp(kept) / 2.0


@pytest.mark.verify
def test_the_stick_slip_cycle_is_that_of_an_integration_with_events():
    branch = ss.limit_cycles(oscillator(11), "belt.velocity", (-2.5, -0.9), requested=-1.0)
    at = branch.dataset.isel(point=branch.at(-1.0))
    assert int(at.unstable_multipliers) == 0
    # corners of the force: 11 harmonics leave 2e-3
    assert float(at.amplitude[0]) == pytest.approx(stick_slip_amplitude(1.0), rel=3e-3)
