"""The equilibrium a contact heats up to: closed forms, folds, ends of tables."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.heat import LOAD, T0, VELOCITY, Array, R, permanent_slip, steep, surface
from scipy.special import lambertw

from slipstick.errors import InputError
from slipstick.state.thermal.equilibrium import equilibrium
from slipstick.state.thermal.friction_curve import FrictionCurve
from slipstick.state.thermal.search import element_equilibria, surface_equilibria


def test_falling_friction_has_the_root_of_a_quadratic() -> None:
    """T - T0 = R mu N v with mu = mu0 / (1 + a (T - T0)): a theta^2 + theta - R mu0 N v = 0."""
    mu0, a = 0.3, np.array([0.0001, 0.002, 0.05, 1.0])
    heat = LOAD * VELOCITY
    found = equilibrium(
        permanent_slip(
            lambda T: mu0 / (1 + a * (T - T0)), lambda T: -a * mu0 / (1 + a * (T - T0)) ** 2, np.full(4, heat)
        ),
        np.full(4, T0),
        R,
    )
    theta = 2 * R * mu0 * heat / (1 + np.sqrt(1 + 4 * a * R * mu0 * heat))
    np.testing.assert_allclose(found.temperature - T0, theta, rtol=1e-12)
    assert found.converged
    assert found.stable
    assert found.problem() is None
    np.testing.assert_allclose(found.power * R, theta, rtol=1e-12)


def test_exponential_friction_is_a_lambert_w() -> None:
    """theta = R mu0 N v exp(-b theta): theta = W(b R mu0 N v) / b."""
    mu0, b, heat = 0.3, np.array([1e-4, 1e-2, 0.1, 1.0]), LOAD * VELOCITY
    found = equilibrium(
        permanent_slip(
            lambda T: mu0 * np.exp(-b * (T - T0)), lambda T: -b * mu0 * np.exp(-b * (T - T0)), np.full(4, heat)
        ),
        np.full(4, T0),
        np.full(4, R),
    )
    np.testing.assert_allclose(found.temperature - T0, lambertw(b * R * mu0 * heat).real / b, rtol=1e-12)


def test_cold_start_takes_the_lowest_and_a_warm_one_stays() -> None:
    n, limits = 300, (20.0, 800.0)
    power, background = steep(np.random.default_rng(3), n)
    roots = element_equilibria(power, background, 8.0, limits=limits)
    inside = np.array([root.temperature.size > 0 for root in roots])
    lowest = np.array([root.temperature[0] if root.temperature.size else np.nan for root in roots])
    highest = np.array([root.temperature[-1] if root.temperature.size else 800.0 for root in roots])
    cold = equilibrium(power, background, 8.0, limits=limits)
    assert cold.converged
    np.testing.assert_allclose(cold.temperature[inside], lowest[inside], rtol=1e-11)
    warm = equilibrium(power, background, 8.0, limits=limits, start=highest + 0.5)
    np.testing.assert_allclose(warm.temperature[inside], highest[inside], rtol=1e-11)
    assert warm.evaluations <= 8
    assert not warm.jumped


def test_a_vanished_equilibrium_is_flagged() -> None:
    """Raise the power past the fold: the low equilibrium is gone, the high one is taken and said to be another."""
    power, background = steep(np.random.default_rng(3), 300)
    roots = element_equilibria(power, background, 8.0, limits=(20.0, 800.0))
    i = next(k for k, root in enumerate(roots) if root.several)
    low = roots[i].temperature[0]
    for factor in np.linspace(1, 20, 200):

        def stronger(T: Array, factor: float = factor) -> tuple[Array, Array]:
            full = np.where(np.arange(300) == i, T[0], background)
            value, slope = power(full)
            return factor * value[[i]], factor * slope[[i]]

        found = equilibrium(stronger, [20.0], 8.0, limits=(20.0, 5000.0), start=[low])
        if found.jumped:
            break
        assert found.temperature[0] - low < 60.0
        low = found.temperature[0]
    assert found.jumped
    assert found.temperature[0] > low + 20.0


def test_leaving_the_table_is_said() -> None:
    curve = FrictionCurve(temperature=[25, 200, 400], mu=[0.5, 0.45, 0.4])
    found = equilibrium(
        lambda T: (100.0 * curve.mu(T), 100.0 * curve.dmu(T)), [25.0, 25.0], [1.0, 20.0], limits=curve.limits
    )
    assert list(found.outside) == [False, True]
    assert found.temperature[1] == pytest.approx(25.0 + 20.0 * 40.0)
    assert "contact element 1 leaves its table, 25 to 400" in (found.problem() or "")


@pytest.mark.parametrize("background", [0.0, 25.0, 293.15])
@pytest.mark.parametrize("rounding", [-1e-14, -1e-11, 0.0, 1e-14])
def test_a_stuck_contact_is_cold_whatever_its_power_is_rounded_to(background: float, rounding: float) -> None:
    """Tables that begin at the background temperature: the cold equilibrium lies on their edge, not beyond it."""
    limits = (background, background + 775.0)

    def power(T: Array) -> tuple[Array, Array]:
        return np.full_like(T, rounding), np.full_like(T, -1e-17)

    [every] = element_equilibria(power, [background], 8.0, limits=limits)
    np.testing.assert_allclose(every.temperature, [background], atol=1e-9)
    assert list(every.stable) == [True]
    for start in (None, [background], [background + 200.0]):
        for resistance in ([8.0, 8.0], np.array([[8.0, 1.0], [1.0, 8.0]])):
            found = equilibrium(
                power, [background] * 2, resistance, limits=limits, start=None if start is None else start * 2
            )
            assert found.converged
            assert found.problem() is None
            np.testing.assert_allclose(found.temperature, background, atol=1e-9)
    whole = surface_equilibria(power, [background] * 2, np.array([[8.0, 1.0], [1.0, 8.0]]), limits=limits)
    np.testing.assert_allclose(whole.temperature, [[background] * 2], atol=1e-9)


def test_an_equilibrium_at_the_end_of_the_table_is_inside() -> None:
    [found] = element_equilibria(lambda T: (np.full_like(T, 0.1 * 3), 0.0 * T), [0.7], 1.0, limits=(0.7, 0.7 + 0.3))
    assert found.temperature.size == 1


@pytest.mark.parametrize("up", [True, False])
def test_next_to_a_fold_the_next_equilibrium_is_found(up: bool) -> None:
    """A hair beyond the fold the residual nearly vanishes at the old place; there is no rest there."""

    def power(T: Array, factor: float) -> tuple[Array, Array]:
        grown = 1.0 / (1.0 + np.exp((100.0 - T) / 5.0))
        return factor * (2.0 + 20.0 * grown), factor * 4.0 * grown * (1.0 - grown)

    T = np.linspace(21.0, 800.0, 4_000_001)
    load = (T - 20.0) / (8.0 * power(T, 1.0)[0])
    middle = T.searchsorted(100.0)
    fold = load[:middle].max() if up else load[middle:].min()
    at = T[load[:middle].argmax()] if up else T[middle + load[middle:].argmin()]
    for beyond in (1e-4, 1e-7, 1e-10):
        factor = fold * (1.0 + beyond) if up else fold * (1.0 - beyond)
        found = equilibrium(lambda T, f=factor: power(T, f), [20.0], 8.0, limits=(20.0, 1000.0), start=[at])
        assert found.converged
        assert found.jumped
        other = T[np.flatnonzero(np.diff(np.sign(load - factor)))]
        assert found.temperature[0] == pytest.approx(other[-1] if up else other[0], abs=2e-3)


def test_a_contact_without_table_is_heated_by_a_neighbour_however_hot() -> None:
    """Its temperature is not bounded by what the cold powers bring about."""

    def power(T: Array) -> tuple[Array, Array]:
        grown = 1.0 / (1.0 + np.exp((100.0 - T[0]) / 5.0))
        return np.array([2.0 + 20.0 * grown, 0.0]), np.array([4.0 * grown * (1.0 - grown), 0.0])

    limits = (np.array([20.0, -np.inf]), np.array([300.0, np.inf]))
    found = surface_equilibria(power, [20.0, 20.0], np.array([[8.0, 2.0], [2.0, 8.0]]), limits=limits)
    np.testing.assert_allclose(found.temperature[:, 0].round(1), [36.0, 97.7, 196.0])
    np.testing.assert_allclose(found.temperature[:, 1] - 20.0, (found.temperature[:, 0] - 20.0) / 4.0, rtol=1e-9)


@pytest.mark.parametrize("seed", range(30))
def test_coupled_surface_balances_heat(seed: int) -> None:
    """Cold and warm starts: residual at rounding, a stable state, and none with every element colder."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    power, background = steep(rng, n)
    matrix = surface(rng, n, rng.uniform(0.02, 0.3))
    cold = equilibrium(power, background, matrix, limits=(20.0, 3000.0))
    assert cold.converged
    assert cold.stable
    residual = cold.temperature - background - matrix @ power(cold.temperature)[0]
    assert np.abs(residual).max() <= 1e-11 * cold.temperature.max()
    warm = equilibrium(power, background, matrix, limits=(20.0, 3000.0), start=cold.temperature + 0.3)
    np.testing.assert_allclose(warm.temperature, cold.temperature, rtol=1e-10)
    assert warm.evaluations <= 8


def test_diagonal_influence_matrix_is_the_element_wise_problem() -> None:
    power, background = steep(np.random.default_rng(5), 6)
    resistances = np.linspace(4, 9, 6)
    apart = equilibrium(power, background, resistances, limits=(20.0, 3000.0))
    nearly = equilibrium(power, background, np.diag(resistances) + 1e-14, limits=(20.0, 3000.0))
    np.testing.assert_allclose(nearly.temperature, apart.temperature, rtol=1e-11)
    diagonal = equilibrium(power, background, np.diag(resistances), limits=(20.0, 3000.0))
    np.testing.assert_array_equal(diagonal.temperature, apart.temperature)


def test_rising_friction_from_cold_is_the_least_solution() -> None:
    """Where every power rises with temperature the plain fixed-point iteration climbs to the least equilibrium."""
    rng = np.random.default_rng(8)
    n = 5
    at, width, gain = rng.uniform(80, 200, n), rng.uniform(5, 20, n), rng.uniform(5, 20, n)

    def power(T: Array) -> tuple[Array, Array]:
        grown = 1 / (1 + np.exp(-(T - at) / width))
        return 3.0 + gain * grown, gain * grown * (1 - grown) / width

    matrix, T = surface(rng, n, 0.2), np.full(n, 20.0)
    for _ in range(20000):
        T = 20.0 + matrix @ power(T)[0]
    found = equilibrium(power, np.full(n, 20.0), matrix, limits=(20.0, 2000.0))
    np.testing.assert_allclose(found.temperature, T, rtol=1e-10)


@pytest.mark.parametrize(
    ("background", "resistance", "sentence"),
    [
        ([20.0, np.nan], 8.0, "thermal, background"),
        ([20.0, 20.0], np.ones(3), r"found shape \(3,\); expected a number, \(2,\) or \(2, 2\)"),
        ([20.0, 20.0], -8.0, "negative or non-finite"),
        ([20.0, 5.0], 8.0, "5 of contact element 1 lies outside its table, 10 to 100"),
    ],
)
def test_bad_input(background: list[float], resistance: object, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        equilibrium(lambda T: (T, T), background, resistance, limits=(10.0, 100.0))
