"""Forces of heated contacts and their consistent tangent, with the real element."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from slipstick.contact.forces import element_forces
from slipstick.errors import InputError
from slipstick.thermal.friction_curve import FrictionCurve
from slipstick.thermal.model import HeatedContacts, HeatedForces, ThermalModel
from slipstick.thermal.search import SurfaceEquilibria
from slipstick.thermal.tangent import power_derivatives
from slipstick.trig.harmonics import Harmonics

Array = np.ndarray
H = Harmonics(range(4))
NAMES = ("a", "b", "c")
N = len(NAMES)

FALLING = FrictionCurve(
    temperature=[20, 200, 400, 800, 3000],
    mu=[0.50, 0.45, 0.38, 0.30, 0.2],
    kt=[120.0, 110.0, 90.0, 60.0, 50.0],
    kn=[90.0, 88.0, 80.0, 75.0, 60.0],
    interpolation="pchip",
)
MU, KT, KN = (float(FALLING.at(25.0)[name].value) for name in ("mu", "kt", "kn"))
INFLUENCE = np.array([[0.8, 0.3, 0.1], [0.3, 0.9, 0.2], [0.1, 0.2, 0.7]])


def model(resistance: Any = INFLUENCE) -> HeatedContacts:
    return ThermalModel(curve=FALLING, background=25.0, resistance=resistance).elements(NAMES)


def state(seed: int) -> dict[str, Any]:
    """A random motion with some stick, slip and separation, heating by some tens to hundreds of degrees."""
    rng = np.random.default_rng(seed)
    W, Y = rng.normal(0, 1, (2, N, H.size)) * np.repeat([1.0, 1.0, 0.5, 0.25], [1, 2, 2, 2])
    return {
        "W": W, "Y": 0.5 * Y, "omega": 1.7, "velocity": rng.choice([0.0, 1.0, -3.0], N) + 0.3 * rng.normal(size=N),
        "kt": np.full(N, KT), "mu": np.full(N, MU), "kn": np.full(N, KN), "gap": rng.normal(-0.5, 0.3, N),
    }  # fmt: skip


def forces(heated: HeatedContacts, given: dict[str, Any], start: Array | None = None) -> HeatedForces:
    given = dict(given)
    velocity = given.pop("velocity")
    return heated.forces(H, v=velocity / given["omega"], start=start, **given)


def central(function: Callable[[float], Array], h: float) -> Array:
    """Fourth-order central difference."""
    return (8 * (function(h) - function(-h)) - (function(2 * h) - function(-2 * h))) / (12 * h)


def moved(given: dict[str, Any], name: str, direction: Any, by: float) -> dict[str, Any]:
    return {**given, name: given[name] + by * direction}


def assert_difference(total: Array, function: Callable[[float], Array]) -> None:
    """Against the finer of two steps; states may change inside a step, where the difference is first order only."""
    scale = np.abs(total).max() + 1.0
    errors = [np.abs(central(function, h) - total).max() / scale for h in (1e-4, 1e-5, 1e-6)]
    assert min(errors) < 3e-6, errors


@pytest.mark.parametrize("seed", range(12))
def test_power_derivatives(seed: int) -> None:
    """Each by central differences of the power at fixed parameters."""
    given = state(seed)

    def power(change: dict[str, Any]) -> Array:
        v = change["velocity"] / change["omega"]
        element = {name: change[name] for name in ("kt", "mu", "kn", "gap")}
        return change["omega"] * element_forces(H, change["W"], change["Y"], v=v, **element).work

    v = given["velocity"] / given["omega"]
    at = element_forces(H, given["W"], given["Y"], v=v, **{name: given[name] for name in ("kt", "mu", "kn", "gap")})
    found = power_derivatives(H, given["W"], at, v=v, omega=given["omega"])
    np.testing.assert_allclose(found.power, power(given), rtol=1e-14)
    for name in ("omega", "velocity", "mu", "kt", "kn", "gap"):
        assert_difference(getattr(found, name), lambda h, name=name: power(moved(given, name, 1.0, h)))
    for name, exact in (("W", found.X), ("Y", found.Y)):
        for k in range(H.size):
            direction = np.eye(H.size)[k]
            assert_difference(exact[:, k], lambda h, n=name, d=direction: power(moved(given, n, d, h)))


@pytest.mark.parametrize("resistance", [INFLUENCE, INFLUENCE.diagonal()], ids=["coupled", "element-wise"])
@pytest.mark.parametrize("seed", range(8))
def test_total_tangent(seed: int, resistance: Array) -> None:
    """Total derivatives by every element's X, Y and by omega, velocity, gap: temperature moves along."""
    heated, given = model(resistance), state(seed)
    at = forces(heated, given)
    assert at.equilibrium.converged
    assert at.equilibrium.problem() is None
    T = at.temperature
    assert T.max() > 30.0
    for name, own_x, own_y, power in (
        ("W", at.forces.dFx_dX, np.zeros_like(at.forces.dFx_dX), at.power.X),
        ("Y", at.forces.dFx_dY, at.forces.dFy_dY, at.power.Y),
    ):
        by_x, by_y = at.tangent.forces(power)
        for e in range(N):
            by_x[e, :, e] += own_x[e]
            by_y[e, :, e] += own_y[e]
        for f in range(N):
            for k in (0, 1, 4):
                direction = np.zeros((N, H.size))
                direction[f, k] = 1.0

                def both(h: float, name: str = name, direction: Array = direction) -> Array:
                    got = forces(heated, moved(given, name, direction, h), start=T)
                    return np.stack([got.forces.Fx, got.forces.Fy])

                assert_difference(np.stack([by_x[:, :, f, k], by_y[:, :, f, k]]), both)
    own = {"omega": at.forces.dFx_dv * (-given["velocity"] / given["omega"] ** 2)[:, None]}
    own["velocity"], own["gap"] = at.forces.dFx_dv / given["omega"], at.forces.dFx_dgap
    for name, own_x in own.items():
        added = at.tangent.forces_common(getattr(at.power, name))[0]
        assert_difference(
            own_x + added, lambda h, name=name: forces(heated, moved(given, name, 1.0, h), start=T).forces.Fx
        )


def test_frozen_parameters_would_be_wrong() -> None:
    """What heat adds to the tangent is as large as the tangent itself somewhere."""
    ratios = []
    for seed in range(12):
        at = forces(model(4 * INFLUENCE), state(seed))
        added, _ = at.tangent.forces(at.power.X)
        ratios.append(np.abs(added).max() / np.abs(at.forces.dFx_dX).max())
    assert max(ratios) > 0.3


def test_temperatures_balance_the_power_of_the_forces() -> None:
    for seed in range(8):
        at = forces(model(), state(seed))
        np.testing.assert_allclose(at.temperature, 25.0 + INFLUENCE @ at.power.power, rtol=1e-11)
        np.testing.assert_allclose(at.mu, FALLING.mu(at.temperature), rtol=1e-14)
        np.testing.assert_allclose(at.kt, FALLING.kt(at.temperature), rtol=1e-14)
        np.testing.assert_allclose(at.kn, FALLING.kn(at.temperature), rtol=1e-14)


def test_equal_curves_are_evaluated_together() -> None:
    curves = {"a": FALLING, "b": FrictionCurve(**FALLING.tables), "c": FALLING}
    assert len(ThermalModel(curve=curves, background=25.0, resistance=1.0).elements(NAMES).curves) == 1


def test_contact_without_curve_keeps_its_parameters_and_heats_the_others() -> None:
    curve = FrictionCurve(temperature=[20, 3000], mu=[0.5, 0.2])
    heated = ThermalModel(curve={"b": curve}, background=25.0, resistance=INFLUENCE).elements(NAMES)
    at = forces(heated, state(0))
    np.testing.assert_array_equal(at.mu[[0, 2]], MU)
    np.testing.assert_array_equal(at.kt, KT)
    np.testing.assert_allclose(at.mu[1], curve.mu(at.temperature[1]) * MU / curve.mu(25.0))
    np.testing.assert_allclose(at.temperature, 25.0 + INFLUENCE @ at.power.power, rtol=1e-11)


def test_total_derivative_by_a_cold_value() -> None:
    """A factor on the friction coefficient scales the whole curve."""
    heated, given = model(), state(3)
    at = forces(heated, given)
    ratio = heated.per_cold("mu", at.temperature)
    np.testing.assert_allclose(ratio, FALLING.mu(at.temperature) / MU, rtol=1e-14)
    added = at.tangent.forces_common(at.power.mu * ratio)[0]
    assert_difference(
        at.forces.dFx_dmu * ratio[:, None] + added,
        lambda h: forces(heated, moved(given, "mu", 1.0, h), start=at.temperature).forces.Fx,
    )


def test_beyond_the_table_the_solver_gets_a_value_and_the_user_a_sentence() -> None:
    curve = FrictionCurve(temperature=[20, 60], mu=[0.5, 0.45])
    heated = ThermalModel(curve=curve, background=25.0, resistance=50.0).elements(NAMES)
    at = forces(heated, state(1))
    assert np.all(np.isfinite(at.forces.Fx))
    hot = at.temperature > 60
    assert hot.any()
    np.testing.assert_allclose(at.mu[hot], 0.45 * MU / curve.mu(25.0), rtol=1e-14)
    np.testing.assert_array_equal(at.tangent.dFx_dT[hot], 0.0)
    assert "leaves its table, 20 to 60" in (at.equilibrium.problem(NAMES) or "")


def test_all_equilibria_contain_the_one_taken() -> None:
    for resistance in (INFLUENCE, INFLUENCE.diagonal()):
        heated, given = model(resistance), state(2)
        at = forces(heated, given)
        v = given.pop("velocity") / given["omega"]
        found = heated.all_equilibria(H, v=v, **given)
        if isinstance(found, SurfaceEquilibria):
            assert np.abs(found.temperature - at.temperature).max(axis=1).min() < 1e-8 * at.temperature.max()
        else:
            for i, element in enumerate(found):
                assert np.abs(element.temperature - at.temperature[i]).min() < 1e-8 * at.temperature[i]


def test_influence_matrix_in_the_order_of_its_own_contacts() -> None:
    mixed = ThermalModel(
        curve=FALLING, background=25.0, resistance=INFLUENCE[np.ix_([2, 0], [2, 0])], contacts=["c", "a"]
    ).elements(NAMES)
    expected = INFLUENCE.copy()
    expected[1, :] = expected[:, 1] = 0.0
    np.testing.assert_array_equal(mixed.resistance, expected)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"background": {"a": 25.0, "b": 25.0}}, "nothing is given for contact c"),
        ({"resistance": {"d": 1.0}}, "there is no contact 'd'; the contacts are a, b, c"),
        ({"resistance": np.ones((2, 2))}, r"shape \(2, 2\) for 3 contacts"),
        ({"contacts": ["a", "x"], "resistance": np.eye(2)}, "thermal contacts: there is no contact 'x'"),
        ({"background": {"a": 25.0, "b": 10.0, "c": 25.0}}, "10 of contact b lies outside its table, 20 to 3000"),
    ],
)
def test_bad_model(arguments: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        ThermalModel(**{"curve": FALLING, "background": 25.0, "resistance": 1.0, **arguments}).elements(NAMES)
