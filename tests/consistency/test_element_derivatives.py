"""Every derivative of the element against central differences on random states.

The forces are smooth while the sequence of states is the same, so a state is judged where the sequence is the same at
all displaced states and no interval is shorter than ``SHORTEST`` (next to the birth of an interval the second
derivative grows without bound and a difference says nothing). With v = 0 a contact stuck all period has no derivative
by v: the force jumps there between the limits of the residual traction.
"""

import numpy as np
import pytest
from marching import force_scale, random_states

from slipstick import FrictionContact, RubbingMotion, contact_forces
from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics

STEP = 1e-6
SHORTEST = 0.02
TOLERANCE = 3e-6


def sequence(states):
    names = [name for _, _, name in states]
    start = min(range(len(names)), key=lambda k: names[k:] + names[:k])
    return tuple(names[start:] + names[:start])


def smooth(f):
    """Whether each element has no short interval."""
    return np.array([min(b - a for a, b, _ in s) > SHORTEST for s in f.states])


def displaced(state, name, index=None):
    """The states at -step and +step of one input, and the step of each element."""
    out = []
    base = np.abs(state[name]) if index is None else np.abs(state[name][:, index])
    step = STEP * np.maximum(base, 0.1)
    for sign in (-1, 1):
        moved = {key: value.copy() for key, value in state.items()}
        if index is None:
            moved[name] += sign * step
        else:
            moved[name][:, index] += sign * step
        out.append(moved)
    return out[0], out[1], step


def compare(harmonics, state, f, name, index, pairs):
    """Largest relative difference between derivatives and central differences over the judged states."""
    low, high, step = displaced(state, name, index)
    a, b = element_forces(harmonics, **low), element_forces(harmonics, **high)
    here = [sequence(s) for s in f.states]
    judged = np.array([sequence(x) == sequence(y) == z for x, y, z in zip(a.states, b.states, here, strict=True)])
    judged &= smooth(f)
    scale = force_scale(harmonics.orders, **state)
    size = np.maximum(np.abs(state[name] if index is None else state[name][:, index]), 0.1)
    worst = 0.0
    for force, derivative in pairs:
        difference = (getattr(b, force) - getattr(a, force)) / (2 * step[:, None])
        error = np.abs(derivative - difference).max(axis=1)
        # relative to the forces over the size of the input, or to the derivative itself where that is larger
        reference = np.maximum(scale / size, np.abs(derivative).max(axis=1))
        worst = max(worst, (error / reference)[judged].max())
    assert judged.mean() > 0.5
    return worst


@pytest.mark.parametrize("orders", [[0, 1], [0, 1, 2, 3], [0, 1, 3, 7], list(range(11))], ids=str)
def test_all_derivatives(orders):
    h, rng = Harmonics(orders), np.random.default_rng(len(orders))
    state = random_states(rng, 100, orders)
    f = element_forces(h, **state)
    found = {}
    for k in range(h.size):
        found[f"X{k}"] = compare(h, state, f, "X", k, [("Fx", f.dFx_dX[:, :, k])])
        found[f"Y{k}"] = compare(h, state, f, "Y", k, [("Fx", f.dFx_dY[:, :, k]), ("Fy", f.dFy_dY[:, :, k])])
    found["mu"] = compare(h, state, f, "mu", None, [("Fx", f.dFx_dmu)])
    found["kt"] = compare(h, state, f, "kt", None, [("Fx", f.dFx_dkt)])
    found["kn"] = compare(h, state, f, "kn", None, [("Fx", f.dFx_dkn), ("Fy", f.dFy_dkn)])
    found["gap"] = compare(h, state, f, "gap", None, [("Fx", f.dFx_dgap), ("Fy", f.dFy_dgap)])
    moving = {key: value[state["v"] != 0] for key, value in state.items()}
    g = element_forces(h, **moving)
    found["v"] = compare(h, moving, g, "v", None, [("Fx", g.dFx_dv)])
    assert max(found.values()) < TOLERANCE, found


def test_derivative_by_v_at_rest_where_the_contact_slips():
    """v = 0 with slip in both directions or separation: the force is smooth in v there."""
    orders = [0, 1, 2]
    h = Harmonics(orders)
    state = random_states(np.random.default_rng(4), 200, orders, still=1.0)
    f = element_forces(h, **state)
    loose = f.stick_fraction < 1 - 1e-12
    state = {key: value[loose] for key, value in state.items()}
    g = element_forces(h, **state)
    assert loose.sum() > 50
    assert compare(h, state, g, "v", None, [("Fx", g.dFx_dv)]) < TOLERANCE


def test_public_derivatives_by_frequency_velocity_and_rubbing_motion():
    """By omega at constant velocity, by the velocity in length/time and by U: through the public function."""
    h, rng = Harmonics(range(4)), np.random.default_rng(2)
    X, Y = rng.normal(size=(2, h.size))
    contact = FrictionContact(kt=5.0, mu=0.4, kn=2.0, gap=-1.0)

    def force(omega=2.0, velocity=0.9, cos=0.3):
        rubbing = RubbingMotion(velocity=velocity, cos={1: cos}, sin={2: -0.2})
        return contact_forces(contact, h, X, Y, omega=omega, rubbing=rubbing)

    f, d = force(), 1e-6
    by_omega = (force(omega=2 + d).Fx - force(omega=2 - d).Fx) / (2 * d)
    by_velocity = (force(velocity=0.9 + d).Fx - force(velocity=0.9 - d).Fx) / (2 * d)
    by_U = (force(cos=0.3 + d).Fx - force(cos=0.3 - d).Fx) / (2 * d)
    assert len(f.states) > 2
    np.testing.assert_allclose(f.dFx_domega, by_omega, atol=1e-8)
    np.testing.assert_allclose(f.dFx_dvelocity, by_velocity, atol=1e-8)
    np.testing.assert_allclose(f.dFx_dU[:, h.index(1, "c")], by_U, atol=1e-8)


def test_tangent_of_a_stuck_contact_is_the_midpoint_convention():
    """Stuck all period with v = 0: the derivative of the midpoint between the two limits, against differences."""
    orders = [0, 1, 2, 3]
    h = Harmonics(orders)
    state = random_states(np.random.default_rng(9), 300, orders, still=1.0)
    state["kt"] = state["kt"] * 0.02
    f = element_forces(h, **state)
    stuck = f.stick_fraction > 1 - 1e-12
    state = {key: value[stuck] for key, value in state.items()}
    g = element_forces(h, **state)
    assert stuck.sum() > 40
    for k in range(h.size):
        assert compare(h, state, g, "X", k, [("Fx", g.dFx_dX[:, :, k])]) < TOLERANCE
        assert compare(h, state, g, "Y", k, [("Fx", g.dFx_dY[:, :, k])]) < TOLERANCE


def test_the_frequency_derivative_of_a_velocity_that_grows_with_it():
    """Half of the velocity is constant: at the same speed the same force, and half of the derivative."""
    h, rng = Harmonics(range(4)), np.random.default_rng(2)
    X, Y = rng.normal(size=(2, h.size))
    contact = FrictionContact(kt=5.0, mu=0.4, kn=2.0, gap=-1.0)

    def force(omega, velocity, swept):
        return contact_forces(
            contact, h, X, Y, omega=omega, rubbing=RubbingMotion(velocity=velocity, velocity_per_omega=swept)
        )

    constant, both, swept = (force(2.0, *v) for v in ((0.9, 0.0), (0.45, 0.225), (0.0, 0.45)))
    np.testing.assert_allclose(both.Fx, constant.Fx, atol=1e-14)
    np.testing.assert_allclose(both.dFx_domega, 0.5 * constant.dFx_domega, atol=1e-14)
    np.testing.assert_array_equal(swept.dFx_domega, 0.0)
    d = 1e-6
    difference = (force(2.0 + d, 0.45, 0.225).Fx - force(2.0 - d, 0.45, 0.225).Fx) / (2 * d)
    np.testing.assert_allclose(both.dFx_domega, difference, atol=1e-8)


def test_derivatives_where_tangential_and_normal_motion_are_one():
    """Both trial functions turn at one time, as symmetry makes it: stick begins there after slip, not after stick."""
    rng = np.random.default_rng(195)
    h = Harmonics(range(5))
    X = np.array([-3.019, -4.234, 1.802, 0.251, -1.466, 0.083, 0.282, -0.077, -0.063])
    given = {"v": 0.0, "kt": 2000.0, "mu": 0.5, "kn": 2000.0, "gap": -0.1}
    given = {name: np.array([value]) for name, value in given.items()}
    checked = 0
    for off in np.linspace(-1e-15, 1e-15, 9):
        Y = X * (1.0 + off)
        f = element_forces(h, X[None], Y[None], **given)
        for _ in range(3):
            dX, dY = rng.normal(size=(2, 9))
            up, down = (element_forces(h, (X + e * dX)[None], (Y + e * dY)[None], **given) for e in (1e-6, -1e-6))
            expected = f.dFx_dX[0] @ dX + f.dFx_dY[0] @ dY
            np.testing.assert_allclose((up.Fx - down.Fx)[0] / 2e-6, expected, atol=1e-5 * np.abs(expected).max())
            checked += 1
    assert checked == 27
