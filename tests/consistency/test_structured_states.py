"""The whole element on structured states: what the law promises, the march, and central differences."""

import numpy as np
import pytest
from marching import force_scale, march
from structured import SETS, harmonics_with_round_phases, load_scale, rotation, shifted, structured_states
from test_element_derivatives import compare

from slipstick import FrictionContact, RubbingMotion, contact_forces
from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics

EXACT = 1e-10
IDS = [f"{len(orders)} to {orders[-1]}" for orders in SETS]
every_set = pytest.mark.parametrize("orders", SETS, ids=IDS)


def distance(a, b, state):
    """Largest difference of two force arrays over the friction limit."""
    return (np.abs(a - b).max(axis=1) / load_scale(state)).max()


def assert_shifts(orders, seed, count):
    rng = np.random.default_rng(seed)
    state = structured_states(rng, count, orders)
    s = 2 * np.pi * rng.integers(0, 48, count) / rng.choice([1, 2, 3, 4, 5, 7, 8, 12, 24, 48], count)
    moved, R = shifted(orders, state, np.where(rng.random(count) < 0.7, s, rng.uniform(0, 6.28, count)))
    f, g = (element_forces(Harmonics(orders), **each) for each in (state, moved))
    assert distance(g.Fx, np.einsum("eij,ej->ei", R, f.Fx), state) < EXACT
    assert distance(g.Fy, np.einsum("eij,ej->ei", R, f.Fy), state) < EXACT
    rate = 1 + np.abs(state["v"]) + np.abs(state["X"]).sum(axis=1) * orders[-1]
    assert (np.abs(g.work - f.work) / load_scale(state) / rate).max() < EXACT


@every_set
def test_shift_in_time(orders):
    assert_shifts(orders, orders[-1], 60)


@pytest.mark.verify(sample=6)
@every_set
def test_shift_in_time_of_1e5_states(orders):
    """20 sets of 5000: 1e5 in all."""
    assert_shifts(orders, 1000 + orders[-1], 5000)


@every_set
def test_mirror_units_and_mean(orders):
    """Motion reversed, other units, a constant added to X however large: the forces follow, or stay the same."""
    h = Harmonics(orders)
    state = structured_states(np.random.default_rng(1), 60, orders)
    f = element_forces(h, **state)
    mirror = element_forces(h, **{**state, "X": -state["X"], "v": -state["v"]})
    assert distance(mirror.Fx, -f.Fx, state) < EXACT
    units = {k: state[k] * 1e-3 for k in ("X", "Y", "v", "gap")} | {k: state[k] * 7e6 for k in ("kt", "kn")}
    assert distance(element_forces(h, **{**state, **units}).Fx / 7e3, f.Fx, state) < EXACT
    far = state["X"].copy()
    far[:, 0] += np.random.default_rng(2).choice([1.0, -3.7, 1e6, 1e12], len(far))
    away = element_forces(h, **{**state, "X": far})
    for name in ("Fx", "Fy", "work", "residual_traction", "dFx_dX", "dFx_dY", "dFx_dkt"):
        np.testing.assert_array_equal(getattr(away, name), getattr(f, name), err_msg=name)


@pytest.mark.parametrize("orders", [[0, 1], [0, 2], [0, 6], [0, 1, 3], [0, 2, 4, 6]], ids=str)
def test_harmonics_of_zero_amplitude_change_nothing(orders):
    more = list(range(9))
    state = structured_states(np.random.default_rng(3), 60, orders)
    places = [0, *(2 * m - 1 + part for m in orders[1:] for part in (0, 1))]
    wide = {k: np.zeros((60, 17)) for k in ("X", "Y")}
    for k, value in wide.items():
        value[:, places] = state[k]
    f, g = element_forces(Harmonics(orders), **state), element_forces(Harmonics(more), **{**state, **wide})
    assert distance(g.Fx[:, places], f.Fx, state) < EXACT
    assert distance(g.Fy[:, places], f.Fy, state) < EXACT


def test_split_between_vibration_and_rubbing_motion():
    h, X = Harmonics([0, 1, 2]), np.array([0.0, 0.0, 1.0, 0.5, 0.0])
    contact = FrictionContact(kt=10.0, mu=0.5, gap=-1.0)
    whole = contact_forces(contact, h, X, np.zeros(5), omega=2.0, rubbing=RubbingMotion(velocity=1.0))
    for part in (1.0, 0.5, 0.25):
        rubbing = RubbingMotion(velocity=1.0, sin={1: part}, cos={2: 0.5 * part})
        split = contact_forces(contact, h, (1 - part) * X, np.zeros(5), omega=2.0, rubbing=rubbing)
        np.testing.assert_allclose(split.Fx, whole.Fx, atol=EXACT)


@pytest.mark.parametrize("orders", [s for s in SETS if s[-1] < 13], ids=str)
def test_against_the_march(orders):
    """The march errs by the square of its step; structured states often put an event on a sample."""
    state = structured_states(np.random.default_rng(4), 40, orders)
    f = element_forces(Harmonics(orders), **state)
    error = {}
    for samples in (2**12, 2**16):
        Fx, Fy, _, _ = march(orders, **state, samples=samples)
        scale = np.maximum(force_scale(orders, **state), load_scale(state))
        error[samples] = np.maximum(np.abs(f.Fx - Fx).max(axis=1), np.abs(f.Fy - Fy).max(axis=1)) / scale
    assert error[2**16].max() < 1e-5
    assert np.all(error[2**16] < np.maximum(0.1 * error[2**12], 1e-9))


def test_pure_harmonics_stick_and_slip_in_turn():
    """Constant load, x = 2 cos m tau, kt A > mu N: twice m sticks of equal length, at any order in any set."""
    theta = np.arccos(1 - 2 * 0.3 / 2.0)  # CF1
    for orders in ([0, 6], [0, 15], [0, 40], [0, 2, 4, 6], [0, 5, 40], list(range(16)), list(range(0, 25, 4))):
        h = Harmonics(orders)
        for k, m in enumerate(orders[1:]):
            for part in (1, 2):
                X = np.zeros((1, h.size))
                X[0, 2 * k + part] = 2.0
                one = np.ones(1)
                f = element_forces(h, X=X, Y=0 * X, v=0 * one, kt=one, mu=0.3 * one, kn=one, gap=-one)
                lengths = {
                    name: [b - a for a, b, n in f.states[0] if n == name] for name in ("stick", "slip+", "slip-")
                }
                assert [len(v) for v in lengths.values()] == [2 * m, m, m]
                np.testing.assert_allclose(lengths["stick"], theta / m, atol=1e-13)
                assert f.work[0] == pytest.approx(m * 4 * 0.3 * (2.0 - 0.3) / (2 * np.pi), rel=1e-12)


@pytest.mark.parametrize("orders", [[0, 6], [0, 1, 2], [0, 2, 4, 6], list(range(8))], ids=str)
def test_derivatives(orders):
    """Against central differences where the sequence of states stays as it is."""
    h = Harmonics(orders)
    rng = np.random.default_rng(5)
    state = structured_states(rng, 60, orders)
    # double roots, a load that touches zero and a trial function that vanishes all period are not smooth
    state["X"] = np.array([harmonics_with_round_phases(rng, orders) for _ in range(60)])
    state["Y"][:], state["gap"] = 0.0, -rng.choice([0.1, 1.0, 2.0], 60)
    f = element_forces(h, **state)
    moving = f.stick_fraction < 1
    f, state = element_forces(h, **{k: v[moving] for k, v in state.items()}), {k: v[moving] for k, v in state.items()}
    for k in range(1, h.size):
        assert compare(h, state, f, "X", k, [("Fx", f.dFx_dX[:, :, k])]) < 5e-5  # a triple root is known to 1e-5
    for name in ("kt", "mu"):
        assert compare(h, state, f, name, None, [("Fx", getattr(f, f"dFx_d{name}"))]) < 1e-6


def test_rotation_is_that_of_the_motion():
    orders, tau = [0, 1, 5], np.linspace(0, 6, 9)
    h, p = Harmonics(orders), np.array([0.3, 1.0, -2.0, 0.5, 0.25])
    np.testing.assert_allclose(h.H_minus(tau) @ rotation(orders, 0.7) @ p, h.H_minus(tau + 0.7) @ p, atol=1e-14)
