"""Mean force of stuck contacts that know their motion at rest, against marching in time and differences."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.contact.law import Motion
from slipstick.contact.quasi_static import incremented
from slipstick.errors import InputError

H = ss.Harmonics([0, 1, 2])


def motions(n, seed, size=0.02):
    """Motion along one direction and the normal, small beside the load: most stick."""
    rng = np.random.default_rng(seed)
    X, Y = rng.uniform(-size, size, (2, n, H.size))
    Y[:, 0] = 0.3
    X[:, 0] = rng.uniform(-0.3, 0.3, n)
    return X, Y


def values(n, seed):
    rng = np.random.default_rng(seed)
    return {
        "kt": rng.uniform(50.0, 80.0, n), "mu": rng.uniform(0.3, 0.5, n), "kn": rng.uniform(30.0, 50.0, n),
        "gap": np.full(n, -0.1), "rest": np.zeros(n),
    }  # fmt: skip


def respond(X, Y, given, law=None):
    law = law or ss.FrictionContact(kt=1.0, mu=0.1, kn=1.0, gap=0.0, rest=0.0)
    return law.respond(Motion(H, 1.0, (X, Y), np.zeros((2, len(X)))), given)


def marched(X, Y, given, periods=3, steps=3000):
    """Mean friction after some periods, begun with the spring as the preload left it."""
    tau = np.linspace(0.0, 2.0 * np.pi, steps + 1)
    w, y = X @ H.H_minus(tau).T, Y @ H.H_minus(tau).T
    own = {name: given[name] for name in ("kt", "mu", "kn", "gap")}
    force = np.stack([own["kt"] * (w[:, 0] - given["rest"]), own["kn"] * np.maximum(y[:, 0] - own["gap"], 0.0)])
    limit = own["mu"] * force[1]
    force[0] = np.clip(force[0], -limit, limit)
    for _ in range(periods):
        total = np.zeros(len(X))
        for i in range(steps):
            before, after = (np.stack([w[:, k], y[:, k]]) for k in (i, i + 1))
            end = incremented(force, before, after, own)
            total += 0.5 * (force[0] + end.force[0]) / steps
            force = end.force
    return total


def test_a_stuck_contact_keeps_what_it_was_left_with():
    X, Y = motions(60, 1)
    given = values(60, 2)
    found = respond(X, Y, given)
    low, high = found.detail.residual_traction.T
    wanted = given["kt"] * X[:, 0]
    assert {*np.sign(wanted - low) + np.sign(wanted - high)} == {-2.0, 0.0, 2.0}
    np.testing.assert_allclose(found.force[0][:, 0], marched(X, Y, given), atol=3e-3)
    np.testing.assert_allclose(found.force[0][:, 0], np.clip(wanted, low, high), rtol=1e-12)


def test_a_contact_that_slips_forgets():
    X, Y = motions(20, 3, size=0.3)
    given = values(20, 4)
    again = respond(X, Y, {**given, "rest": given["rest"] + 0.1})
    slips = respond(X, Y, given).detail.slip_fraction > 0.0
    assert slips.sum() > 5
    np.testing.assert_array_equal(respond(X, Y, given).force[0][slips], again.force[0][slips])


def test_derivatives_are_those_of_differences():
    X, Y = motions(60, 5)
    given, step = values(60, 6), 1e-6
    found = respond(X, Y, given)
    for j, moved in ((0, X), (1, Y)):
        for k in range(H.size):
            ends = []
            for way in (step, -step):
                both = [X.copy(), Y.copy()]
                both[j] = moved.copy()
                both[j][:, k] += way
                ends.append(respond(*both, given).force[0])
            np.testing.assert_allclose(
                found.by_motion[(0, j)][:, :, k], (ends[0] - ends[1]) / (2 * step), rtol=1e-5, atol=1e-4
            )
    for name in ("kt", "mu", "kn", "gap", "rest"):
        ends = [respond(X, Y, {**given, name: given[name] + way}).force[0] for way in (step, -step)]
        slope = found.by_parameter(name)[0]
        np.testing.assert_allclose(slope, (ends[0] - ends[1]) / (2 * step), rtol=1e-5, atol=1e-4)


def planar(X, given):
    """Planar contacts with motion X, three of (n, L)."""
    law = ss.PlanarFrictionContact(kt=1.0, mu=0.1, kn=1.0, gap=0.0, rest=0.0, second_rest=0.0, tolerance=1e-10)
    return law.respond(Motion(H, 1.0, tuple(X), np.zeros((3, len(X[0])))), given)


def test_in_the_plane_along_a_line_it_is_the_same():
    X, Y = motions(30, 7)
    given, c, s = values(30, 8), 0.6, 0.8
    straight = respond(X, Y, given).force[0]
    found = planar([c * X, s * X, Y], {**given, "second_rest": given["rest"]})
    stuck = found.detail.stuck_all_period
    assert stuck.sum() > 20
    np.testing.assert_allclose(found.force[0][stuck], c * straight[stuck], atol=1e-7)
    np.testing.assert_allclose(found.force[1][stuck], s * straight[stuck], atol=1e-7)


def test_derivatives_in_the_plane_are_those_of_differences():
    n, step = 24, 1e-5
    X, Y = motions(n, 9)
    Z = motions(n, 10)[0]
    given = {**values(n, 11), "second_rest": np.full(n, 0.02)}
    X[: n // 2, 0] *= 0.2
    Z[: n // 2, 0] *= 0.2
    found = planar([X, Z, Y], given)
    stuck = found.detail.stuck_all_period
    wanted = given["kt"][:, None] * np.stack([X[:, 0] - given["rest"], Z[:, 0] - given["second_rest"]], axis=1)
    kept = np.linalg.norm(wanted - np.stack([found.force[i][:, 0] for i in (0, 1)], axis=1), axis=1) < 1e-9
    assert (stuck & kept).sum() > 2
    assert (stuck & ~kept).sum() > 2
    parts = [X, Z, Y]
    for j in range(3):
        for k in range(H.size):
            ends = []
            for way in (step, -step):
                moved = [part.copy() for part in parts]
                moved[j][:, k] += way
                ends.append(planar(moved, given).force)
            for i in (0, 1):
                slope = (ends[0][i] - ends[1][i]) / (2 * step)
                np.testing.assert_allclose(found.by_motion[(i, j)][stuck, :, k], slope[stuck], rtol=1e-4, atol=2e-3)
    for name in ("kt", "mu", "kn", "gap", "rest", "second_rest"):
        ends = [planar(parts, {**given, name: given[name] + way}).force for way in (step, -step)]
        for i in (0, 1):
            slope = (ends[0][i] - ends[1][i]) / (2 * step)
            np.testing.assert_allclose(found.by_parameter(name)[i][stuck], slope[stuck], rtol=1e-4, atol=2e-3)


def test_copies_texts_and_faults():
    law = ss.PlanarFrictionContact(kt=1.0, mu=0.1, kn=2.0, gap=-0.5, rest=0.25, second_rest=-0.5)
    assert eval(repr(law), {"PlanarFrictionContact": ss.PlanarFrictionContact}) == law
    assert dict(law.changed(mu=0.2).values)["second_rest"] == -0.5
    line = ss.FrictionContact(kt=1.0, mu=0.1, normal_load=3.0, rest=-0.25)
    assert eval(repr(line), {"FrictionContact": ss.FrictionContact}) == line
    with pytest.raises(InputError, match="second_rest is missing"):
        ss.PlanarFrictionContact(kt=1.0, mu=0.1, kn=2.0, gap=-0.5, rest=0.25)
    with pytest.raises(InputError, match="has rest"):
        ss.contact_forces(line, H, np.zeros(5), np.zeros(5), omega=1.0)
