"""Forces of heated contacts and their consistent tangent, with the real element."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from slipstick.contact.friction import FrictionContact
from slipstick.contact.law import Motion
from slipstick.errors import InputError
from slipstick.thermal.friction_curve import FrictionCurve
from slipstick.thermal.model import Heat, HeatedContacts, ThermalModel
from slipstick.thermal.search import SurfaceEquilibria
from slipstick.thermal.tangent import Power
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


LAW = FrictionContact(kt=KT, mu=MU, kn=KN, gap=-0.5)


def inputs(given: dict[str, Any]) -> tuple[Motion, dict[str, Array]]:
    """Motion and parameters of a state."""
    drift = np.array([given["velocity"], np.zeros(N)]) / given["omega"]
    values = {name: given[name] for name in ("kt", "mu", "kn", "gap")}
    return Motion(H, given["omega"], (given["W"], given["Y"]), drift), values


def forces(heated: HeatedContacts, given: dict[str, Any], start: Array | None = None) -> Heat:
    return heated.respond(LAW, *inputs(given), start)


def coupled(at: Heat, dpower: Array) -> list[Array]:
    """What heat adds to ``dF_i/dq_f`` at element e, (n, L, n, L) for each port, for own coordinates q_f."""
    by_q = at.tangent.gain[:, :, None] * dpower[None]
    return [at.tangent.by_temperature[i][:, :, None, None] * by_q[:, None] for i in (0, 1)]


def common(at: Heat, dpower: Array) -> Array:
    """What heat adds to the derivative of the tangential force by one parameter common to all."""
    return at.tangent.by_temperature[0] * at.tangent.temperature(dpower)[:, None]


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
        motion, values = inputs(change)
        return change["omega"] * LAW.respond(motion, values).work

    motion, values = inputs(given)
    found = Power(LAW, motion, LAW.respond(motion, values))
    np.testing.assert_allclose(found.value, power(given), rtol=1e-14)
    by = {"omega": found.omega, "velocity": found.by_velocity[0]}
    by |= {name: found.by_parameter(name) for name in ("mu", "kt", "kn", "gap")}
    for name, exact in by.items():
        assert_difference(exact, lambda h, name=name: power(moved(given, name, 1.0, h)))
    for name, exact in (("W", found.by_motion[0]), ("Y", found.by_motion[1])):
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
    own_forces = at.response.detail
    for name, own_x, own_y, power in (
        ("W", own_forces.dFx_dX, np.zeros_like(own_forces.dFx_dX), at.power.by_motion[0]),
        ("Y", own_forces.dFx_dY, own_forces.dFy_dY, at.power.by_motion[1]),
    ):
        by_x, by_y = coupled(at, power)
        for e in range(N):
            by_x[e, :, e] += own_x[e]
            by_y[e, :, e] += own_y[e]
        for f in range(N):
            for k in (0, 1, 4):
                direction = np.zeros((N, H.size))
                direction[f, k] = 1.0

                def both(h: float, name: str = name, direction: Array = direction) -> Array:
                    got = forces(heated, moved(given, name, direction, h), start=T)
                    return np.stack(got.response.force)

                assert_difference(np.stack([by_x[:, :, f, k], by_y[:, :, f, k]]), both)
    own = {
        "omega": (own_forces.dFx_dv * (-given["velocity"] / given["omega"] ** 2)[:, None], at.power.omega),
        "velocity": (own_forces.dFx_dv / given["omega"], at.power.by_velocity[0]),
        "gap": (own_forces.dFx_dgap, at.power.by_parameter("gap")),
    }
    for name, (own_x, power) in own.items():
        assert_difference(
            own_x + common(at, power),
            lambda h, name=name: forces(heated, moved(given, name, 1.0, h), start=T).response.force[0],
        )


def test_frozen_parameters_would_be_wrong() -> None:
    """What heat adds to the tangent is as large as the tangent itself somewhere."""
    ratios = []
    for seed in range(12):
        at = forces(model(4 * INFLUENCE), state(seed))
        added, _ = coupled(at, at.power.by_motion[0])
        ratios.append(np.abs(added).max() / np.abs(at.response.by_motion[0, 0]).max())
    assert max(ratios) > 0.3


def test_temperatures_balance_the_power_of_the_forces() -> None:
    for seed in range(8):
        at = forces(model(), state(seed))
        np.testing.assert_allclose(at.temperature, 25.0 + INFLUENCE @ at.power.value, rtol=1e-11)
        np.testing.assert_allclose(at.response.values["mu"], FALLING.mu(at.temperature), rtol=1e-14)
        np.testing.assert_allclose(at.response.values["kt"], FALLING.kt(at.temperature), rtol=1e-14)
        np.testing.assert_allclose(at.response.values["kn"], FALLING.kn(at.temperature), rtol=1e-14)


def test_equal_curves_are_evaluated_together() -> None:
    curves = {"a": FALLING, "b": FrictionCurve(**FALLING.tables), "c": FALLING}
    assert len(ThermalModel(curve=curves, background=25.0, resistance=1.0).elements(NAMES).curves) == 1


def test_contact_without_curve_keeps_its_parameters_and_heats_the_others() -> None:
    curve = FrictionCurve(temperature=[20, 3000], mu=[0.5, 0.2])
    heated = ThermalModel(curve={"b": curve}, background=25.0, resistance=INFLUENCE).elements(NAMES)
    at = forces(heated, state(0))
    np.testing.assert_array_equal(at.response.values["mu"][[0, 2]], MU)
    np.testing.assert_array_equal(at.response.values["kt"], KT)
    np.testing.assert_allclose(at.response.values["mu"][1], curve.mu(at.temperature[1]) * MU / curve.mu(25.0))
    np.testing.assert_allclose(at.temperature, 25.0 + INFLUENCE @ at.power.value, rtol=1e-11)


def test_total_derivative_by_a_cold_value() -> None:
    """A factor on the friction coefficient scales the whole curve."""
    heated, given = model(), state(3)
    at = forces(heated, given)
    ratio = heated.per_cold("mu", at.temperature)
    np.testing.assert_allclose(ratio, FALLING.mu(at.temperature) / MU, rtol=1e-14)
    added = common(at, at.power.by_parameter("mu") * ratio)
    assert_difference(
        at.response.by_parameter("mu")[0] * ratio[:, None] + added,
        lambda h: forces(heated, moved(given, "mu", 1.0, h), start=at.temperature).response.force[0],
    )


def test_beyond_the_table_the_solver_gets_a_value_and_the_user_a_sentence() -> None:
    curve = FrictionCurve(temperature=[20, 60], mu=[0.5, 0.45])
    heated = ThermalModel(curve=curve, background=25.0, resistance=50.0).elements(NAMES)
    at = forces(heated, state(1))
    assert np.all(np.isfinite(at.response.force[0]))
    hot = at.temperature > 60
    assert hot.any()
    np.testing.assert_allclose(at.response.values["mu"][hot], 0.45 * MU / curve.mu(25.0), rtol=1e-14)
    np.testing.assert_array_equal(at.tangent.by_temperature[0][hot], 0.0)
    assert "leaves its table, 20 to 60" in (at.equilibrium.problem(NAMES) or "")


def test_all_equilibria_contain_the_one_taken() -> None:
    for resistance in (INFLUENCE, INFLUENCE.diagonal()):
        heated, given = model(resistance), state(2)
        at = forces(heated, given)
        found = heated.all_equilibria(LAW, *inputs(given))
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
        ({"resistance": {"d": 1.0}}, "there is no contact 'd'; known are a, b, c"),
        ({"resistance": np.ones((2, 2))}, r"shape \(2, 2\) for 3 contacts"),
        ({"contacts": ["a", "x"], "resistance": np.eye(2)}, "thermal contacts: there is no contact 'x'"),
        ({"background": {"a": 25.0, "b": 10.0, "c": 25.0}}, "10 of contact b lies outside its table, 20 to 3000"),
    ],
)
def test_bad_model(arguments: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        ThermalModel(**{"curve": FALLING, "background": 25.0, "resistance": 1.0, **arguments}).elements(NAMES)
