"""Corner cases that break friction elements, each against the march or what is known exactly."""

import numpy as np
import pytest
from marching import force_scale, march

from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics


def evaluate(orders, X, Y, *, v=0.0, kt=1.0, mu=0.3, kn=1.0, gap=0.0):
    """One element as a batch of one, and its inputs."""
    state = {"X": np.atleast_2d(np.asarray(X, float)), "Y": np.atleast_2d(np.asarray(Y, float))}
    state |= {k: np.array([float(a)]) for k, a in {"v": v, "kt": kt, "mu": mu, "kn": kn, "gap": gap}.items()}
    return element_forces(Harmonics(orders), **state), state


def assert_marched(orders, f, state, samples=2**19, tolerance=1e-7):
    Fx, Fy, _, _ = march(orders, **state, samples=samples)
    scale = force_scale(orders, **state)[0]
    assert np.abs(f.Fx - Fx).max() < tolerance * scale
    assert np.abs(f.Fy - Fy).max() < tolerance * max(scale, np.abs(Fy).max())
    for name, value in vars(f).items():
        if isinstance(value, np.ndarray):
            assert np.all(np.isfinite(value)), name


def lengths(f, name):
    return [b - a for a, b, found in f.states[0] if found == name]


def names(f):
    return [name for _, _, name in f.states[0]]


@pytest.mark.parametrize("excess", [1e-6, 1e-4, 1e-3])
def test_stick_at_contact_onset_shorter_than_a_thousandth(excess):
    """Just below the threshold kt |w'| = mu kn y' the stick lasts a moment, since y' falls after the onset."""
    # y = cos tau - 0.5 opens at tau = pi/3 and closes at -pi/3 with y' = sin(pi/3); w = a sin(tau) has w' = a / 2 there
    kt, mu, kn = 1.0, 0.3, 1.0
    a = mu * kn * np.sin(np.pi / 3) / (kt * 0.5) * (1 - excess)
    f, state = evaluate([0, 1], [0, 0, a], [0, 1, 0], kt=kt, mu=mu, kn=kn, gap=0.5)
    first = f.states[0][names(f).index("stick")]
    assert 0 < first[1] - first[0] < 1e-2
    if excess <= 1e-4:
        assert first[1] - first[0] < 1e-3
    assert_marched([0, 1], f, state)
    above, _ = evaluate([0, 1], [0, 0, a * (1 + 2 * excess) / (1 - excess)], [0, 1, 0], kt=kt, mu=mu, kn=kn, gap=0.5)
    onset = names(above)[(names(above).index("separation") + 1) % len(names(above))]
    assert onset == "slip+"


@pytest.mark.parametrize("above", [0.0, 1e-16, -1e-16, 1e-14, -1e-14])
def test_touching_without_contact_and_contact_without_gap(above):
    """y = g with y' = 0: neither a contact of no length nor a separation of no length changes a force."""
    touching, state = evaluate([0, 1], [0, 0.3, 1], [0, 1, 0], v=0.2, gap=1.0 + above)
    np.testing.assert_allclose(touching.Fx, 0, atol=1e-7)
    np.testing.assert_allclose(touching.Fy, 0, atol=1e-7)
    grazing, state = evaluate([0, 1], [0, 0.3, 1], [0, 1, 0], v=0.2, gap=-1.0 + above)
    np.testing.assert_allclose(grazing.Fy[0], [1, 1, 0], atol=1e-7)
    assert_marched([0, 1], grazing, state)
    assert grazing.separation_fraction[0] < 1e-6


@pytest.mark.parametrize("depth", [1e-14, 1e-13, 1e-10])
def test_separation_shorter_than_a_millionth(depth):
    """y - g falls below zero by ``depth`` for about 2 sqrt(2 depth): the friction force is still set to zero there."""
    f, state = evaluate([0, 1], [0, 0.3, 1], [0, 1, 0], v=0.2, gap=-1.0 + depth)
    (open_for,) = lengths(f, "separation")
    # the constant 1 leaves 1e-16 of rounding in the depth
    assert open_for == pytest.approx(2 * np.arccos(1 - depth), rel=4e-16 / depth + 1e-6)
    if depth < 1e-12:
        assert open_for < 1e-6
    assert_marched([0, 1], f, state)


@pytest.mark.parametrize("distance", [1e-12, 1e-13, 1e-15, 0.0, -1e-15, -1e-13, -1e-12])
@pytest.mark.parametrize("sign", [1, -1])
def test_velocity_at_the_edge_of_permanent_slip(distance, sign):
    """v / A within 1e-12 of 1: sticks for about sqrt(distance) or not at all; the force is the limit all the same."""
    f, _ = evaluate([0, 1], [0, 0, 1.0], [0, 0, 0], v=sign * (1 + distance), kt=50.0, mu=0.3, kn=1.0, gap=-100.0)
    np.testing.assert_allclose(f.Fx[0], [sign * 30.0, 0, 0], atol=1e-9)
    assert sum(lengths(f, "stick")) < 1e-4
    assert f.work[0] == pytest.approx(30.0, abs=1e-9)
    assert set(names(f)) <= {"stick", "slip+" if sign > 0 else "slip-"}


def test_contact_interval_across_the_start_of_the_period():
    f, state = evaluate([0, 1], [0, 0.3, 1], [0, 1, 0], v=0.2, gap=0.5)
    assert_marched([0, 1], f, state)
    total = sum(b - a for a, b, _ in f.states[0])
    assert total == pytest.approx(2 * np.pi, abs=1e-12)
    assert sum(lengths(f, "separation")) == pytest.approx(4 * np.pi / 3, abs=1e-12)


def test_several_contact_intervals():
    X, Y = np.zeros(9), np.zeros(9)
    X[2], X[3], Y[7], Y[2] = 1.0, 0.4, 1.0, 0.2
    f, state = evaluate([0, 1, 2, 3, 4], X, Y, v=-0.1, kt=2.0, gap=0.1)
    assert names(f).count("separation") == 4
    assert_marched([0, 1, 2, 3, 4], f, state)


@pytest.mark.parametrize("v", [0.0, 0.5, -0.5])
@pytest.mark.parametrize("gap", [-2.0, 2.0])
def test_harmonic_zero_only(v, gap):
    f, _ = evaluate([0], [0.7], [0.1], v=v, gap=gap)
    closed = max(0.1 - gap, 0.0)
    assert f.Fy[0, 0] == pytest.approx(closed, abs=1e-15)
    assert f.Fx[0, 0] == pytest.approx(np.sign(v) * 0.3 * closed, abs=1e-15)
    assert f.dFx_dX[0, 0, 0] == pytest.approx(0.0, abs=1e-15)
    if v == 0 and closed:
        np.testing.assert_allclose(f.residual_traction[0], [-0.3 * closed, 0.3 * closed])


def test_no_vibration_with_rubbing():
    """X = 0 with v: steady slip under a constant load; under a varying one, sticks while the load grows."""
    f, _ = evaluate([0, 1], [0, 0, 0], [0, 0, 0], v=1e-9, gap=-2.0)
    np.testing.assert_allclose(f.Fx, [[0.6, 0, 0]], atol=1e-12)
    g, state = evaluate([0, 1], [0, 0, 0], [0, 1, 0], v=0.1, kt=1.0, gap=-2.0)
    assert "stick" in names(g)
    assert_marched([0, 1], g, state)


def test_no_motion_at_all_leaves_the_residual_traction_open():
    """X = -U, v = 0: any force up to the limit is possible; the convention is the middle."""
    f, _ = evaluate([0, 1], [0, 0, 0], [0, 1, 0], gap=-2.0)
    np.testing.assert_allclose(f.Fx, 0, atol=1e-15)
    np.testing.assert_allclose(f.residual_traction, [[-0.3, 0.3]], atol=1e-12)
    assert names(f) == ["stick"]
    assert f.work[0] == pytest.approx(0.0, abs=1e-15)


def test_rubbing_motion_that_cancels_the_vibration():
    from slipstick import FrictionContact, RubbingMotion, contact_forces

    h = Harmonics([0, 1, 2])
    X = np.array([0.0, 0.5, -0.25, 2.0, 0.0])
    rubbing = RubbingMotion(cos={1: -0.5, 2: -2.0}, sin={1: 0.25})
    f = contact_forces(FrictionContact(kt=10.0, mu=0.3, gap=-1.0), h, X, np.zeros(5), omega=1.0, rubbing=rubbing)
    np.testing.assert_allclose(f.Fx, 0, atol=1e-14)
    assert [name for _, _, name in f.states] == ["stick"]


@pytest.mark.parametrize("name", ["mu", "kt", "kn"])
@pytest.mark.parametrize("v", [0.0, 0.3, -3.0])
def test_parameter_zero(name, v):
    """Without friction, or without normal stiffness, no tangential force. With kt = 0 a force that never changes:
    the least limit under rubbing (as for kt -> 0), nothing where contact is lost or v = 0."""
    rng = np.random.default_rng(1)
    for gap in (-9.0, 0.3):
        X, Y = rng.normal(size=(2, 5))
        f, _ = evaluate([0, 1, 2], X, Y, v=v, gap=gap, **{name: 0.0})
        y_min = (Harmonics([0, 1, 2]).H_minus(np.linspace(0, 2 * np.pi, 100001)) @ Y - gap).min()
        expected = np.sign(v) * 0.3 * max(y_min, 0.0) if name == "kt" else 0.0
        np.testing.assert_allclose(f.Fx[0], [expected, 0, 0, 0, 0], atol=1e-8)
        if name == "kn":
            np.testing.assert_allclose(f.Fy, 0, atol=0)
        for value in (f.dFx_dX, f.dFx_dY, f.dFy_dY, f.dFx_dmu, f.dFx_dkt, f.dFx_dkn, f.dFx_dv, f.work):
            assert np.all(np.isfinite(value))


@pytest.mark.parametrize("v", [1e-6, -1e-6, 1e-3])
def test_tiny_velocity_where_a_march_from_rest_takes_hundreds_of_periods(v):
    """From rest the force reaches its limit after (hi - lo) / |2 pi kt v| periods; the period map knows it at once."""
    X, Y = [0, 0, 1.0], [0, 0.1, 0]
    f, state = evaluate([0, 1], X, Y, v=v, kt=1.0, mu=0.3, kn=1.0, gap=-20.0)
    periods = 2 * (0.3 * 19.9 - 1.0) / (2 * np.pi * abs(v))
    assert periods > 100
    assert_marched([0, 1], f, state)


def test_slip_that_begins_at_the_very_start_of_a_long_segment():
    """A weak contact under fast rubbing: the sticks last 0.01 rad in segments of up to 6 rad.

    A root step that trusts its curvature too far stands still in the middle of such a segment.
    """
    X = [1.79183382, 0.08834783, 1.54839294, -0.5142978, -0.09371471, -0.49538037]
    X += [-0.5309015, 0.11302829, -0.44089554, -0.07405667, -0.0305419]
    parameters = {
        "v": -5.15550611,
        "kt": 2.01234889,
        "mu": 0.98027141,
        "kn": 0.17357271,
        "gap": 0.61649646 - 0.61853346,
    }
    f, state = evaluate(list(range(6)), X, np.zeros(11), **parameters)
    assert names(f).count("stick") == 2
    assert max(lengths(f, "stick")) < 0.02
    assert_marched(list(range(6)), f, state, tolerance=1e-6)


@pytest.mark.parametrize("orders", [[0, 1, 3, 7], [0, 5, 40], [0, 2]], ids=str)
def test_gaps_in_the_harmonics(orders):
    rng = np.random.default_rng(5)
    L = 2 * len(orders) - 1
    for v in (0.0, 0.4, -30.0):
        X, Y = rng.normal(size=(2, L))
        f, state = evaluate(orders, X, Y, v=v, kt=2.0, gap=-0.3)
        assert_marched(orders, f, state)


def test_state_sequence_covers_the_period_without_overlap():
    from marching import random_states

    orders = list(range(7))
    state = random_states(np.random.default_rng(11), 300, orders)
    f = element_forces(Harmonics(orders), **state)
    for k, states in enumerate(f.states):
        starts, ends, kinds = np.array([s[0] for s in states]), np.array([s[1] for s in states]), [s[2] for s in states]
        np.testing.assert_allclose(ends[:-1], starts[1:], atol=1e-13)
        assert np.all(ends > starts)
        assert ends[-1] - starts[0] == pytest.approx(2 * np.pi, abs=1e-12)
        if len(kinds) > 1:
            assert all(a != b for a, b in zip(kinds, kinds[1:] + kinds[:1], strict=True))
        stick = sum(b - a for a, b, name in states if name == "stick") / (2 * np.pi)
        assert f.stick_fraction[k] == pytest.approx(stick, abs=1e-12)
    total = f.stick_fraction + f.slip_fraction + f.separation_fraction
    np.testing.assert_allclose(total, 1.0, atol=1e-12)
