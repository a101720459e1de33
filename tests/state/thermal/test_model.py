"""Forces of heated contacts, with the real element."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.heated import (
    FALLING,
    INFLUENCE,
    KT,
    LAW,
    MU,
    NAMES,
    assert_difference,
    common,
    forces,
    inputs,
    model,
    moved,
    state,
)

from slipstick.errors import InputError
from slipstick.state.thermal.friction_curve import FrictionCurve
from slipstick.state.thermal.model import ThermalModel
from slipstick.state.thermal.search import SurfaceEquilibria


def test_temperatures_balance_the_power_of_the_forces() -> None:
    for seed in range(8):
        at = forces(model(), state(seed))
        np.testing.assert_allclose(at.values, 25.0 + INFLUENCE @ at.power.value, rtol=1e-11)
        np.testing.assert_allclose(at.response.values["mu"], FALLING.mu(at.values), rtol=1e-14)
        np.testing.assert_allclose(at.response.values["kt"], FALLING.kt(at.values), rtol=1e-14)
        np.testing.assert_allclose(at.response.values["kn"], FALLING.kn(at.values), rtol=1e-14)


def test_equal_curves_are_evaluated_together() -> None:
    curves = {"a": FALLING, "b": FrictionCurve(**FALLING.tables), "c": FALLING}
    assert len(ThermalModel(curve=curves, background=25.0, resistance=1.0).elements(NAMES).curves) == 1


def test_contact_without_curve_keeps_its_parameters_and_heats_the_others() -> None:
    curve = FrictionCurve(temperature=[20, 3000], mu=[0.5, 0.2])
    heated = ThermalModel(curve={"b": curve}, background=25.0, resistance=INFLUENCE).elements(NAMES)
    at = forces(heated, state(0))
    np.testing.assert_array_equal(at.response.values["mu"][[0, 2]], MU)
    np.testing.assert_array_equal(at.response.values["kt"], KT)
    np.testing.assert_allclose(at.response.values["mu"][1], curve.mu(at.values[1]) * MU / curve.mu(25.0))
    np.testing.assert_allclose(at.values, 25.0 + INFLUENCE @ at.power.value, rtol=1e-11)


def test_total_derivative_by_a_cold_value() -> None:
    """A factor on the friction coefficient scales the whole curve."""
    heated, given = model(), state(3)
    at = forces(heated, given)
    ratio = heated.by_given("mu", at.values)
    np.testing.assert_allclose(ratio, FALLING.mu(at.values) / MU, rtol=1e-14)
    added = common(at, at.power.by_parameter("mu") * ratio)
    assert_difference(
        at.response.by_parameter("mu")[0] * ratio[:, None] + added,
        lambda h: forces(heated, moved(given, "mu", 1.0, h), start=at.values).response.force[0],
    )


def test_beyond_the_table_the_solver_gets_a_value_and_the_user_a_sentence() -> None:
    curve = FrictionCurve(temperature=[20, 60], mu=[0.5, 0.45])
    heated = ThermalModel(curve=curve, background=25.0, resistance=50.0).elements(NAMES)
    at = forces(heated, state(1))
    assert np.all(np.isfinite(at.response.force[0]))
    hot = at.values > 60
    assert hot.any()
    np.testing.assert_allclose(at.response.values["mu"][hot], 0.45 * MU / curve.mu(25.0), rtol=1e-14)
    np.testing.assert_array_equal(at.force_by_value[0][hot], 0.0)
    assert "leaves its table, 20 to 60" in (at.equilibrium.problem(NAMES) or "")


def test_all_equilibria_contain_the_one_taken() -> None:
    for resistance in (INFLUENCE, INFLUENCE.diagonal()):
        heated, given = model(resistance), state(2)
        at = forces(heated, given)
        found = heated.all_equilibria(LAW, *inputs(given))
        if isinstance(found, SurfaceEquilibria):
            assert np.abs(found.temperature - at.values).max(axis=1).min() < 1e-8 * at.values.max()
        else:
            for i, element in enumerate(found):
                assert np.abs(element.temperature - at.values[i]).min() < 1e-8 * at.values[i]


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
        ({"resistance": {"d": 1.0}}, "there is no contact 'd'; there are a, b, c"),
        ({"resistance": np.ones((2, 2))}, r"shape \(2, 2\) for 3 contacts"),
        ({"contacts": ["a", "x"], "resistance": np.eye(2)}, "thermal, contacts: there is no contact 'x'"),
        ({"background": {"a": 25.0, "b": 10.0, "c": 25.0}}, "10 of contact b lies outside its table, 20 to 3000"),
    ],
)
def test_bad_model(arguments: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        ThermalModel(**{"curve": FALLING, "background": 25.0, "resistance": 1.0, **arguments}).elements(NAMES)
