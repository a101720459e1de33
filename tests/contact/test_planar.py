"""Friction in two directions: closed forms, the one-directional element, marching in time, differences, laws."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tests.helpers.planar_march import marched

import slipstick as ss
from slipstick.contact.forces import element_forces
from slipstick.contact.law import Motion, Response
from slipstick.contact.planar_in_time import SLIP, PlanarInTime
from slipstick.contact.regimes import InTime
from slipstick.errors import InputError
from slipstick.typing import Array

NAMES = ("kt", "mu", "kn", "gap")


def respond(X: Any, par: Any, *, tolerance: float = 1e-8, orders: Any = None) -> Response:
    """Motion (n, 3, L) or (3, L), parameters (n, 6) or (6,): ``v1 v2 kt mu kn gap``."""
    X, par = np.asarray(X, dtype=float), np.atleast_2d(np.asarray(par, dtype=float))
    X = X if X.ndim == 3 else X[None]
    h = ss.Harmonics(range(X.shape[2] // 2 + 1) if orders is None else orders)
    drift = np.stack([*par[:, :2].T, np.zeros(len(par))])
    law = ss.PlanarFrictionContact(kt=1.0, mu=1.0, kn=1.0, gap=0.0, tolerance=tolerance)
    values = {name: par[:, 2 + i].copy() for i, name in enumerate(NAMES)}
    return law.respond(Motion(h, 1.0, tuple(np.ascontiguousarray(X[:, i]) for i in range(3)), drift), values)


def friction(X: Any, par: Any, **options: Any) -> Array:
    """Friction forces (n, 2, L)."""
    return np.stack(respond(X, par, **options).force[:2], axis=1)


def by_all(response: Response) -> Array:
    """Derivatives of the three forces (n, 3, L, 3 L + 6) as the element's columns stand."""
    return np.asarray(response.detail.derivatives)


def random_states(n: int, seed: int, orders: int = 3) -> tuple[Array, Array]:
    """A third with a constant load, a third with a varying one, a third that separates; half of them rubbing."""
    rng, L = np.random.default_rng(seed), 2 * orders + 1
    X = rng.normal(size=(n, 3, L)) / np.repeat([1, *range(1, orders + 1)], [1] + [2] * orders) ** 1.5
    X[:, :2] *= 10.0 ** rng.uniform(-0.3, 0.7, (n, 1, 1))
    X[::3, 2], X[1::3, 2] = 0.2 * X[::3, 2], 0.0
    par = np.tile([0.0, 0.0, 3.0, 0.4, 2.0, -1.5], (n, 1))
    par[::2, :2] = 0.3 * rng.normal(size=(len(par[::2]), 2))
    return X, par


def structured_states(n: int, seed: int) -> tuple[Array, Array]:
    """Straight, circular, of equal amplitudes, of rational phases, with corners, with zeros."""
    rng, L = np.random.default_rng(seed), 7
    X, par = random_states(n, seed)
    tau = 2.0 * np.pi * np.arange(64) / 64
    H = np.stack([np.ones(64)] + [f(m * tau) for m in (1, 2, 3) for f in (np.cos, np.sin)])
    for e in range(n):
        size, kind = 10.0 ** rng.uniform(-0.3, 0.7), e % 6
        if kind == 0:
            angle = rng.choice([0.0, np.pi / 2, np.pi / 4, rng.uniform(0, np.pi)])
            X[e, 1], X[e, 0] = np.sin(angle) * X[e, 0], np.cos(angle) * X[e, 0]
            par[e, :2] = np.hypot(*par[e, :2]) * np.array([np.cos(angle), np.sin(angle)])
        elif kind == 1:
            X[e, :2] = 0.0
            X[e, 0, 1], X[e, 1, 2] = size, size
        elif kind == 2:
            X[e, :2] = size * rng.choice([-1.0, 1.0], (2, L)) / 2.0
        elif kind == 3:
            X[e, :2] = 0.0
            phase = rng.integers(0, 12, (2, 3)) * np.pi / 6.0
            X[e, :2, 1::2], X[e, :2, 2::2] = size * np.cos(phase) / 2.0, size * np.sin(phase) / 2.0
        elif kind == 4:  # a square path, as far as three harmonics draw it
            corner = np.sign(np.cos(tau + rng.uniform(0, 6))), np.sign(np.sin(tau))
            X[e, :2] = size * np.stack(corner) @ H.T / 32.0
        else:
            X[e, :, rng.integers(1, L, 4)] = 0.0
    return X, par


def resting_states(states: Any, n: int, seed: int, varying: bool) -> tuple[Array, Array]:
    """States that never slip: small motion along the surface, from 1e-4 of the limit on, under a load that may vary."""
    X, par = states(n, seed)
    rng = np.random.default_rng(seed + 1)
    X[:, :2] *= (10.0 ** rng.uniform(-4, -0.7, n) / np.abs(X[:, :2]).max(axis=(1, 2)))[:, None, None]
    load = 10.0 ** rng.uniform(-3, -0.3, n) / np.maximum(np.abs(X[:, 2, 1:]).max(axis=1), 1e-9)
    X[:, 2, 1:] *= load[:, None] if varying else 0.0
    X[:, 2, 0], par[:, :2] = 0.1 * X[:, 2, 0], 0.0
    return X, par


def worst_beside_marching(X: Array, par: Array, steps: int) -> Array:
    """Error over the largest limit, (n,): 0 where the mean is one of many, nan where marching does not settle."""
    found = respond(X, par, tolerance=1e-9)
    F, gap = marched(np.arange(1, X.shape[2] // 2 + 1), X, par, steps=steps)
    limit = par[:, 3] * par[:, 4] * (np.abs(X[:, 2]).sum(1) - par[:, 5])
    error = np.abs(np.stack(found.force[:2], axis=1) - F).max(axis=(1, 2)) / limit
    return np.where(found.detail.stuck_all_period, 0.0, np.where(gap <= 1e-11 * limit, error, np.nan))


class TestClosedForms:
    """BEYOND the one direction: what is known."""

    def test_a_circle_that_slips_at_all_times(self) -> None:
        """``f_1 = b cos(tau + gamma)``, ``cos gamma = b/(kt a)``, work over 2 pi ``b sqrt(a^2 - (b/kt)^2)``."""
        X = np.zeros((3, 3))
        X[0, 1], X[1, 2] = 2.0, 2.0
        r = respond(X, [0, 0, 1.0, 1.2, 1.0, -1.0])
        np.testing.assert_allclose(r.force[0][0], [0.0, 0.72, -0.96], atol=1e-12)
        np.testing.assert_allclose(r.force[1][0], [0.0, 0.96, 0.72], atol=1e-12)
        assert abs(r.work[0] - 1.92) < 1e-12
        assert r.detail.slip_fraction[0] == 1.0

    def test_forced_circle(self) -> None:
        """On a circular orbit ``a |k - w^2 + b l/a^2 + i (c w + b sqrt(a^2 - l^2)/a^2)| = p``."""
        branch = ss.steady_response(forced_circle(), omega=[8.858092073412])
        np.testing.assert_allclose(branch.dataset["amplitude"].to_numpy(), 3.811432571339, rtol=1e-11)

    def test_permanent_slip_by_the_period_matrix(self) -> None:
        """The slip equation is linear in half angles: the state is an eigenvector of its 2 x 2 period matrix."""
        from scipy.integrate import solve_ivp

        rng = np.random.default_rng(4)
        X, b, kt, v = 0.1 * rng.normal(size=(3, 7)), 1.2, 3.0, np.array([2.0, 1.0])
        X[2] = 0.0
        m = np.arange(1, 4)

        def matrix(t: float, z: Array) -> Array:
            d = v + (m * (X[:2, 2::2] * np.cos(m * t) - X[:2, 1::2] * np.sin(m * t))).sum(1)
            return np.asarray(kt / (2 * b) * np.array([[d[0], d[1]], [d[1], -d[0]]]) @ z.reshape(2, 2)).ravel()

        period = solve_ivp(matrix, (0, 2 * np.pi), np.eye(2).ravel(), method="DOP853", rtol=1e-13, atol=1e-13)
        values, vectors = np.linalg.eig(period.y[:, -1].reshape(2, 2))
        q, p = vectors[:, np.argmax(np.abs(values))].real
        law = ss.PlanarFrictionContact(kt=kt, mu=1.0, kn=1.0, gap=-b, tolerance=1e-10)
        motion = Motion(ss.Harmonics(range(4)), 1.0, tuple(X[i][None] for i in range(3)), np.array([*v, 0.0])[:, None])
        f = law.forces_in_time(motion, {k: np.array([x]) for k, x in law.values.items()}, np.zeros(1))
        np.testing.assert_allclose(
            [f[0][0, 0], f[1][0, 0]], b * np.array([q * q - p * p, 2 * q * p]) / (q * q + p * p), atol=1e-9
        )

    def test_across_fast_rubbing_it_is_a_spring_in_series_with_a_dashpot(self) -> None:
        """Along the velocity v, the other direction has kt in series with mu N / v; the error falls as 1/v^2."""
        X, b, kt = np.zeros((3, 3)), 1.2, 1.0
        X[1, 1] = 0.3
        errors = []
        for v in (10.0, 50.0, 250.0):
            impedance = 1.0 / (1.0 / kt + 1.0 / (1j * b / v))
            F = friction(X, [v, 0, kt, 1.0, 1.0, -b])[0, 1]
            errors.append(abs(F[1] - 1j * F[2] - 0.3 * impedance) / abs(0.3 * impedance))
        assert errors[0] < 1e-3
        np.testing.assert_allclose(np.array(errors[:-1]) / errors[1:], 25.0, rtol=0.1)

    def test_a_straight_line_is_the_element_of_one_direction(self) -> None:
        rng, h = np.random.default_rng(5), ss.Harmonics(range(4))
        angle, n = 0.7, 60
        X = rng.normal(size=(n, 7)) * 10.0 ** rng.uniform(-0.7, 0.7, (n, 1))
        Y = 0.4 * rng.normal(size=(n, 7)) * (np.arange(n) % 2)[:, None]
        c, s, v = np.cos(angle), np.sin(angle), 0.5 * (np.arange(n) % 3)
        kt, mu, kn, gap = (np.full(n, x) for x in (3.0, 0.4, 2.0, -1.0))
        r = respond(np.stack([X * c, X * s, Y], 1), np.stack([v * c, v * s, kt, mu, kn, gap], 1), tolerance=1e-10)
        f = element_forces(h, X, Y, v=v, kt=kt, mu=mu, kn=kn, gap=gap)
        np.testing.assert_allclose(r.force[0] * c + r.force[1] * s, f.Fx, atol=1e-9)
        np.testing.assert_allclose(r.force[1] * c - r.force[0] * s, 0.0, atol=1e-9)
        np.testing.assert_allclose(r.force[2], f.Fy, atol=1e-13)
        np.testing.assert_allclose(r.work, f.work, atol=1e-8)
        D = r.by_motion
        along = D[0, 0] * c * c + (D[0, 1] + D[1, 0]) * c * s + D[1, 1] * s * s
        np.testing.assert_allclose(along, f.dFx_dX, atol=1e-7)
        np.testing.assert_allclose(D[0, 2] * c + D[1, 2] * s, f.dFx_dY, atol=1e-7)

    @pytest.mark.parametrize("a", [2.39, 2.4 - 1e-9])
    def test_a_circle_within_the_limit_sticks_round_its_middle(self, a: float) -> None:
        X = np.zeros((3, 7))
        X[0, 1], X[1, 2] = a, a
        r = respond(X, [0, 0, 100.0, 0.3, 1.0, -800.0])
        np.testing.assert_allclose(r.force[0][0, :3], [0.0, 100.0 * a, 0.0], atol=1e-9)
        assert r.detail.stuck_all_period[0]


class TestBesideMarching:
    """The independent integration in time agrees to 1e-8 of mu N."""

    @pytest.mark.parametrize("states", [random_states, structured_states])
    def test_states(self, states: Any) -> None:
        error = worst_beside_marching(*states(18, seed=1), steps=64)
        assert np.count_nonzero(np.isnan(error)) <= 2
        assert np.nanmax(error) < 1e-8

    @pytest.mark.verify(sample=6)
    @pytest.mark.parametrize("seed", range(100, 120))
    @pytest.mark.parametrize("states", [random_states, structured_states])
    def test_many_states(self, states: Any, seed: int) -> None:
        """Marching with large steps misses short slips: where it is apart from the element its steps are cut.

        500 states take half a minute.
        """
        X, par = states(500, seed=seed)
        error = worst_beside_marching(X, par, 100)
        for steps in (400, 1600, 6400):
            apart = np.flatnonzero(error > 3e-9)
            assert apart.size < 0.05 * len(X)
            if apart.size:
                error[apart] = worst_beside_marching(X[apart], par[apart], steps)
        assert np.count_nonzero(np.isnan(error)) < 0.03 * len(X)
        assert np.nanmax(error) < 1e-8, np.sort(error)[-20:]

    def test_tolerance_is_kept(self) -> None:
        X, par = random_states(60, seed=8)
        exact = friction(X, par, tolerance=1e-12)
        for tolerance in (1e-6, 1e-8, 1e-10):
            error = np.abs(friction(X, par, tolerance=tolerance) - exact).max(axis=(1, 2))
            assert (error <= tolerance * np.abs(exact).max(axis=(1, 2)) + 1e-13).all()


class TestDerivatives:
    @pytest.mark.parametrize("orders", [1, 3, 10])
    def test_they_are_those_of_differences(self, orders: int) -> None:
        assert_derivatives(*random_states(12, seed=orders, orders=orders))

    @pytest.mark.parametrize("count", [36, pytest.param(600, marks=pytest.mark.verify)])
    @pytest.mark.parametrize("states", [random_states, structured_states])
    def test_of_many_states(self, states: Any, count: int) -> None:
        assert_derivatives(*states(count, seed=20))

    @pytest.mark.parametrize(
        ("states", "count"),
        [
            (random_states, 60), (structured_states, 60),
            pytest.param(random_states, 10_000, marks=pytest.mark.verify),
            pytest.param(structured_states, 2_000, marks=pytest.mark.verify),
        ],
    )  # fmt: skip
    def test_of_contacts_that_separate(self, states: Any, count: int) -> None:
        X, par = states(count, seed=31)
        apart = respond(X, par).detail.separation_fraction > 1e-3
        assert apart.sum() > 0.1 * count
        assert_derivatives(X[apart], par[apart])


class TestMeanOfAContactThatNeverSlips:
    """It is that of the largest least distance from the limit (BEYOND the one direction: one of many)."""

    @pytest.mark.parametrize("count", [100, pytest.param(3000, marks=pytest.mark.verify)])
    @pytest.mark.parametrize("varying", [False, True])
    @pytest.mark.parametrize("states", [random_states, structured_states])
    def test_it_moves_with_time_and_plane(self, states: Any, varying: bool, count: int) -> None:
        X, par = resting_states(states, count, 5, varying)
        first = respond(X, par)
        c, s = np.cos(1.1), np.sin(1.1)
        turn = np.array([[c, -s], [s, c]])
        Z = X @ shift(0.83).T
        Z[:, :2] = np.einsum("ij,ejl->eil", turn, Z[:, :2])
        mean, moved = (np.stack(r.force[:2], axis=1)[:, :, 0] for r in (first, respond(Z, par)))
        error = np.abs(mean @ turn.T - moved).max(axis=1) / (par[:, 2] * np.abs(X[:, :2]).max(axis=(1, 2)))
        assert first.detail.stuck_all_period.mean() > 0.95
        assert error[first.detail.stuck_all_period].max() < 1e-8

    @pytest.mark.parametrize("varying", [False, True])
    def test_no_other_mean_is_farther_from_the_limit(self, varying: bool) -> None:
        """By sequential quadratic programming over sampled times, as well as those tell it."""
        from scipy.optimize import minimize

        X, par = resting_states(random_states, 8, 9, varying)
        tau = 2.0 * np.pi * np.arange(720) / 720
        H = np.stack([np.ones(720)] + [f(m * tau) for m in (1, 2, 3) for f in (np.cos, np.sin)])
        F = friction(X, par)
        for x, p, f in zip(X, par, F, strict=True):
            size = 3.0 * np.abs(x[:2]).max()
            q, b = f[:, 1:] @ H[1:] / size, p[3] * p[4] * (x[2] @ H - p[5]) / size

            def beyond(c: Array, q: Array = q, b: Array = b) -> Array:
                return np.hypot(c[0] + q[0], c[1] + q[1]) - b

            start = np.array([0.0, 0.0, beyond(np.zeros(2)).max()])
            limits = {"type": "ineq", "fun": lambda z, beyond=beyond: z[2] - beyond(z[:2])}
            found = minimize(lambda z: z[2], start, constraints=limits, method="SLSQP", options={"ftol": 1e-14})
            mean = f[:, 0] / size
            np.testing.assert_allclose(mean, found.x[:2], atol=2e-2)
            assert beyond(mean).max() <= found.x[2] + 1e-4

    def test_of_hardly_any_motion_it_is_the_force_of_the_least_load(self) -> None:
        """``c = -f(t_0)`` where the load is least, up to the square of the motion; its derivatives too."""
        X, par = (a[np.arange(30) % 3 != 1] for a in resting_states(random_states, 30, 7, varying=True))
        tau = 2.0 * np.pi * np.arange(100_000) / 100_000
        H = np.stack([np.ones(tau.size)] + [f(m * tau) for m in (1, 2, 3) for f in (np.cos, np.sin)])
        least = H[:, (X[:, 2] @ H).argmin(axis=1)].T
        least[:, 0] = 0.0
        motion = X[:, :2] / np.abs(X[:, :2]).max(axis=(1, 2), keepdims=True)
        for size in (1e-9, 0.0):
            r = respond(np.concatenate([size * motion, X[:, 2:]], axis=1), par)
            mean = np.stack(r.force[:2], axis=1)[:, :, 0]
            expected = -3.0 * size * np.einsum("erl,el->er", motion, least)
            np.testing.assert_allclose(mean, expected, atol=3.0 * size * 1e-3)
            for i in (0, 1):
                np.testing.assert_allclose(r.by_motion[i, i][:, 0], -3.0 * least, atol=2e-3)

    @pytest.mark.parametrize("varying", [False, True])
    def test_its_derivatives(self, varying: bool) -> None:
        X, par = resting_states(random_states, 300, 5, varying)
        rng, size = np.random.default_rng(0), np.abs(X[:, :2]).max(axis=(1, 2))
        d = rng.normal(size=(300, 27)) * np.repeat([1.0, 0.1], [14, 13])
        d[:, 21:23] = 0.0
        if not varying:
            d[:, 15:21] = 0.0
        along = np.einsum("eric,ec->eri", by_all(respond(X, par)), d)[:, :2, 0]
        errors = []
        for part in (1e-3, 1e-4, 1e-5):
            e = part * size

            def mean(k: int, e: Array = e) -> Array:
                moved = X + k * e[:, None, None] * d[:, :21].reshape(X.shape)
                return np.asarray(friction(moved, par + k * e[:, None] * d[:, 21:])[:, :, 0])

            central = (8.0 * (mean(1) - mean(-1)) - mean(2) + mean(-2)) / (12.0 * e[:, None])
            errors.append(np.abs(central - along).max(axis=1) / np.abs(along).max(axis=1))
        assert np.min(errors, axis=0).max() < 1e-6  # now and then a step changes the times that decide
        assert np.quantile(np.min(errors, axis=0), 0.95) < 1e-8


def beside_differences(X: Array, par: Array, e: float = 1e-5) -> tuple[Array, Array]:
    """Errors of the derivatives along one direction each, over their largest, (n,): by differences of fourth order,
    central ones and those of the better side: at a corner the derivative is that of one side."""
    rng, L = np.random.default_rng(0), X.shape[2]
    d = rng.normal(size=(len(X), 3 * L + 6))
    d[:, 3 * L : 3 * L + 2] *= (par[:, :2] != 0).any(axis=1)[:, None]
    along = np.einsum("eric,ec->eri", by_all(respond(X, par, tolerance=1e-12)), d)

    def forces(step: float) -> Array:
        moved = X + step * d[:, : 3 * L].reshape(X.shape)
        return np.stack(respond(moved, par + step * d[:, 3 * L :], tolerance=1e-12).force, axis=1)

    f = {k: forces(k * e) for k in range(-4, 5)}
    central = (8.0 * (f[1] - f[-1]) - f[2] + f[-2]) / (12.0 * e)
    size = np.maximum(np.abs(along).max(axis=(1, 2)), 1e-9)

    def error(difference: Array) -> Array:
        return np.asarray(np.abs(difference - along).max(axis=(1, 2)) / size)

    forward, backward = (
        i * (48.0 * f[i] - 36.0 * f[2 * i] + 16.0 * f[3 * i] - 3.0 * f[4 * i] - 25.0 * f[0]) / (12.0 * e)
        for i in (1, -1)
    )
    return error(central), np.minimum(error(forward), error(backward))


def assert_derivatives(X: Array, par: Array) -> None:
    """Of states that slip: of the others see the mean. Central differences of second order, 1e-5 apart, are 3e-7 off
    where the third derivative is large; those of fourth order 3e-11."""
    slips = ~respond(X, par).detail.stuck_all_period
    error, one_side = beside_differences(X[slips], par[slips])
    assert np.quantile(error, 0.97) < 1e-8, np.sort(error)[-5:]
    # where all ports reverse at one instant the sides differ too, and from the derivative
    apart = np.minimum(error, one_side) > 1e-7
    if apart.any():  # some corners begin with the root of the way from them: differences come nearer with that
        apart &= beside_differences(X[slips], par[slips], 1e-6)[1] > 0.5 * one_side
    assert np.count_nonzero(apart) <= 0.002 * slips.size, np.sort(np.minimum(error, one_side))[-5:]


class TestSymmetries:
    def test_shifted_in_time(self) -> None:
        X, par = random_states(30, seed=11)
        R = shift(0.83)
        np.testing.assert_allclose(
            friction(X @ R.T, par, tolerance=1e-11), friction(X, par, tolerance=1e-11) @ R.T, atol=1e-10
        )

    def test_turned_in_the_plane(self) -> None:
        X, par = random_states(30, seed=12)
        c, s = np.cos(1.1), np.sin(1.1)
        turn = np.array([[c, -s], [s, c]])
        Z, turned = X.copy(), par.copy()
        Z[:, :2], turned[:, :2] = np.einsum("ij,ejl->eil", turn, X[:, :2]), par[:, :2] @ turn.T
        expected = np.einsum("ij,ejl->eil", turn, friction(X, par, tolerance=1e-11))
        np.testing.assert_allclose(friction(Z, turned, tolerance=1e-11), expected, atol=1e-10)

    @pytest.mark.parametrize(
        ("states", "count"),
        [
            (structured_states, 60),
            pytest.param(random_states, 10_000, marks=pytest.mark.verify),
            pytest.param(structured_states, 2_000, marks=pytest.mark.verify),
        ],
    )  # fmt: skip
    def test_shifted_and_turned_states(self, states: Any, count: int) -> None:
        X, par = states(count, seed=32)
        forces, R = friction(X, par, tolerance=1e-11), shift(0.83)
        c, s = np.cos(1.1), np.sin(1.1)
        turn = np.array([[c, -s], [s, c]])
        Z, turned = X @ R.T, par.copy()
        Z[:, :2], turned[:, :2] = np.einsum("ij,ejl->eil", turn, Z[:, :2]), par[:, :2] @ turn.T
        moved = np.einsum("ij,ejl->eil", turn, forces @ R.T)
        limit = par[:, 3] * par[:, 4] * (np.abs(X[:, 2]).sum(1) - par[:, 5])
        error = np.abs(friction(Z, turned, tolerance=1e-11) - moved) / limit[:, None, None]
        assert error.max() < 1e-10

    def test_more_elements_at_once_and_no_harmonics(self) -> None:
        X, par = random_states(9, seed=13)
        alone = np.concatenate([friction(x, p) for x, p in zip(X, par, strict=True)])
        np.testing.assert_array_equal(friction(X, par), alone)
        still = respond(np.zeros((3, 1)), [1.0, 1.0, 3.0, 0.4, 2.0, -1.5])
        np.testing.assert_allclose([still.force[0][0, 0], still.force[1][0, 0]], 1.2 / np.sqrt(2.0), atol=1e-12)


def shift(phase: float) -> Array:
    """``X`` of a motion that is ahead by a phase."""
    R = np.eye(7)
    for m in (1, 2, 3):
        c, s = np.cos(m * phase), np.sin(m * phase)
        R[2 * m - 1 : 2 * m + 1, 2 * m - 1 : 2 * m + 1] = [[c, s], [-s, c]]
    return R


number = st.floats(-3, 3).map(lambda x: round(x, 2))


@settings(max_examples=30, deadline=None)
@example(  # panels that change from one period to the next
    X=[0.0, 1.84, 1.05, 0.0, 0.0, 0.0, 1.58, -1.44, 1.6, 1.84, 2.0, 0.0, 0.0, 0.69, 1.0],
    v=(1.11, -3.0), gap=-1.0, kt=2.0, mu=0.01,
)  # fmt: skip
@given(
    X=st.lists(number, min_size=15, max_size=15), v=st.tuples(number, number),
    gap=st.integers(-2000, 1000).map(lambda x: x / 1000), kt=st.floats(0.1, 30.0), mu=st.floats(0.01, 1.5),
)  # fmt: skip
def test_the_force_stays_within_the_circle_and_dissipates(X: Any, v: Any, gap: float, kt: float, mu: float) -> None:
    Q = np.reshape(X, (3, 5))
    law = ss.PlanarFrictionContact(kt=kt, mu=mu, kn=1.0, gap=gap)
    values = {name: np.array([value]) for name, value in law.values.items()}
    motion = Motion(ss.Harmonics(range(3)), 1.0, tuple(q[None] for q in Q), np.array([*v, 0.0])[:, None])
    tau = np.linspace(0.0, 2.0 * np.pi, 200)
    f1, f2, normal = law.forces_in_time(motion, values, tau)
    size = mu * (abs(gap) + np.abs(Q[2]).sum())
    assert (np.hypot(f1, f2) <= mu * normal + 1e-7 * size).all()
    assert law.respond(motion, values).work[0] >= -1e-7 * size * (np.abs(Q).sum() + 1.0)
    ((states),) = law.states(motion, values)
    assert abs(sum(end - start for start, end, _ in states) - 2.0 * np.pi) < 1e-9
    assert all(abs(a[1] - b[0]) < 1e-9 for a, b in itertools.pairwise(states))


def forced_circle(**changes: Any) -> ss.Problem:
    """An oscillator in the plane, driven round a circle."""
    contact = ss.PlanarFrictionContact(**{"kt": 100.0, "mu": 0.3, "normal_load": 800.0, **changes})
    return ss.Problem(
        ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=40.0 * np.eye(2), dofs=["x", "y"]),
        contacts=[ss.ContactPair(name="foot", contact=contact, tangential=("x", "y"))],
        loads=[ss.Load(dof="x", cos=200.0), ss.Load(dof="y", sin=200.0)],
        harmonics=range(4),
    )


class TestForcedCircle:
    def test_peak_and_its_derivatives(self) -> None:
        branch = ss.forced_response(forced_circle(), omega=(8.0, 10.0), peaks_of=["x"])
        peaks = branch.dataset.isel(point=branch.dataset["kind"].to_numpy() == "peak")
        assert abs(float(peaks["amplitude"][0, 0]) - 3.811432571339) < 1e-9
        assert abs(float(peaks["omega"][0]) - 8.858092073412) < 1e-7

    def test_the_curve_goes_through_where_it_slips_everywhere_at_once(self) -> None:
        """``a |k - w^2 + b l/a^2 + i (c w + b sqrt(a^2 - l^2)/a^2)| = p``; the corners are at ``a = l = b/kt``."""
        branch = ss.forced_response(forced_circle(), omega=(2.0, 16.0))
        assert branch.outcome.ok
        d = branch.dataset
        assert int(d.attrs["parts"]) == 1
        b, limit = 240.0, 2.4
        squares = np.roots([1.0, 0.16 - 280.0, 140.0**2 - (200 / 2.4) ** 2]).real
        corners = np.sqrt(np.sort(squares)).tolist()
        begins, ends = d["omega"].to_numpy()[d["kind"].to_numpy() == "state change"]
        assert abs(begins - corners[0]) < 1e-7
        assert abs(ends - corners[1]) < 1e-7
        w, a, stuck = (d[name].to_numpy() for name in ("omega", "amplitude", "stick_fraction"))
        a, stuck = a[:, 0], stuck[:, 0] > 0.5
        np.testing.assert_array_equal(
            stuck[np.abs(w[:, None] - corners).min(axis=1) > 1e-4],
            [not corners[0] < one < corners[1] for one in w[np.abs(w[:, None] - corners).min(axis=1) > 1e-4]],
        )
        stiffness = np.where(stuck, 100.0, b * limit / a**2)
        loss = np.where(stuck, 0.0, b * np.sqrt(np.maximum(a**2 - limit**2, 0.0)) / a**2)
        p = a * np.abs(40.0 - w**2 + stiffness + 1j * (0.4 * w + loss))
        exact = d["kind"].to_numpy() != "interpolated"
        np.testing.assert_allclose(p[exact], 200.0, rtol=2e-6)

    def test_the_circle_is_the_same_in_time(self) -> None:
        """It slips at all times; its angle turns once a period."""
        branch = ss.steady_response(forced_circle(), omega=9.0, stability=True)
        check = branch.check_in_time(0)
        assert check.converged
        assert check.relative_difference < 1e-6
        assert branch.dataset["stable"].to_numpy().all()


@pytest.mark.verify
def test_there_is_a_periodic_state_of_a_wide_range() -> None:
    """From very soft to very hard springs, from hardly any friction to much, at rest and rubbing fast."""
    rng = np.random.default_rng(6)
    X, par = random_states(3000, seed=6)
    par[:, 2], par[:, 3] = 10.0 ** rng.uniform(-2, 4, 3000), 10.0 ** rng.uniform(-3, 0.5, 3000)
    par[:, :2] *= 10.0 ** rng.uniform(-2, 2, (3000, 1))
    r = respond(X, par)
    assert np.isfinite(r.detail.derivatives).all()
    limit = par[:, 3] * par[:, 4] * (np.abs(X[:, 2]).sum(1) - par[:, 5])
    assert (np.abs(np.stack(r.force[:2], 1)).max(axis=(1, 2)) <= 2.0 * limit).all()


class TestParameters:
    def test_forces_along_one_direction_are_not_asked_of_it(self) -> None:
        contact = ss.PlanarFrictionContact(kt=1.0, mu=0.1, normal_load=1.0)
        with pytest.raises(InputError, match="two directions"):
            ss.contact_forces(contact, 1, np.zeros(3), np.zeros(3), omega=1.0)

    @pytest.mark.parametrize("tolerance", [0.0, 1e-13, 0.1])
    def test_tolerance_has_bounds(self, tolerance: float) -> None:
        with pytest.raises(InputError, match="tolerance"):
            ss.PlanarFrictionContact(kt=1.0, mu=0.1, normal_load=1.0, tolerance=tolerance)

    def test_a_copy_keeps_the_tolerance(self) -> None:
        contact = ss.PlanarFrictionContact(kt=1.0, mu=0.1, normal_load=1.0, tolerance=1e-5)
        assert contact.changed(mu=0.2).tolerance == 1e-5
        assert "tolerance=1e-05" in repr(contact)


def test_slip_whose_load_has_gone_has_finite_rates() -> None:
    """At the end of contact rounding may leave no penetration at all."""
    values = {name: np.full((1, 1), value) for name, value in {"kt": 2.0, "mu": 0.3, "kn": 5.0, "gap": 1.0}.items()}
    q, velocity, memory = np.array([0.1, 0.2, 1.0]), np.array([1.0, -0.5, -0.3]), np.array([0.4, 0.0])
    at = InTime(*(a[:, None, None] for a in (q, velocity, memory)), values, np.zeros((3, 1, 1)), 1.0)
    forces, rates = PlanarInTime().rate(SLIP, at)
    assert forces[2] == 0.0
    slopes = PlanarInTime().slopes(SLIP, at)
    assert all(np.isfinite(part).all() for part in (rates, slopes.values, PlanarInTime().relaxation(SLIP, at)))
