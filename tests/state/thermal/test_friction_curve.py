from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from hypothesis import given, settings
from hypothesis import strategies as st

from slipstick.errors import InputError
from slipstick.state.thermal.friction_curve import INTERPOLATIONS, FrictionCurve

T = np.array([25.0, 200.0, 400.0, 600.0, 800.0])
MU = np.array([0.50, 0.45, 0.38, 0.31, 0.27])


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
def test_passes_through_the_table(interpolation: str) -> None:
    curve = FrictionCurve(temperature=T, mu=MU, kt=1e6 * MU, kn=2e6 * MU, interpolation=interpolation)
    for name, factor in (("mu", 1.0), ("kt", 1e6), ("kn", 2e6)):
        np.testing.assert_allclose(getattr(curve, name)(T), factor * MU, rtol=1e-14)


@pytest.mark.parametrize("interpolation", INTERPOLATIONS)
def test_derivative_is_that_of_the_value(interpolation: str) -> None:
    """A complex step through the same piece would be exact; away from knots the value is a cubic: 3-point error h^2."""
    curve = FrictionCurve(temperature=T, mu=MU, interpolation=interpolation)
    at = np.random.default_rng(1).uniform(26.0, 799.0, 500)
    h = 1e-3
    central = (curve.mu(at + h) - curve.mu(at - h)) / (2 * h)
    np.testing.assert_allclose(curve.dmu(at), central, atol=2e-12)  # mu eps / h = 1e-13, mu''' h^2 = 1e-15


def test_derivative_is_continuous_at_knots() -> None:
    for interpolation in INTERPOLATIONS:
        curve = FrictionCurve(temperature=T, mu=MU, interpolation=interpolation)
        np.testing.assert_allclose(curve.dmu(T[1:-1] - 1e-9), curve.dmu(T[1:-1] + 1e-9), atol=1e-11)


def test_cubic_reproduces_a_cubic_and_natural_ends_straight() -> None:
    def cubic(t: np.ndarray) -> np.ndarray:
        return 0.5 - 3e-4 * t + 2e-7 * t**2 - 1e-10 * t**3

    curve = FrictionCurve(temperature=T, mu=cubic(T), interpolation="cubic")
    at = np.linspace(25, 800, 101)
    np.testing.assert_allclose(curve.mu(at), cubic(at), rtol=1e-13)
    natural = FrictionCurve(temperature=T, mu=MU, interpolation="natural")
    assert abs(natural.dmu(25.0 + 1e-6) - natural.dmu(25.0)) < 1e-14
    assert abs(natural.dmu(800.0 - 1e-6) - natural.dmu(800.0)) < 1e-14


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(0, 1000).map(lambda k: k / 1000), min_size=2, max_size=8))
def test_pchip_stays_between_neighbouring_rows(values: list[float]) -> None:
    rows = np.arange(len(values), dtype=float)
    curve = FrictionCurve(temperature=rows, mu=values)
    for i, (a, b) in enumerate(pairwise(values)):
        inside = curve.mu(np.linspace(i, i + 1, 21))
        assert inside.min() >= min(a, b) - 1e-14
        assert inside.max() <= max(a, b) + 1e-14


def test_own_table_for_each_parameter() -> None:
    curve = FrictionCurve(mu=[[20, 0.5], [800, 0.3]], kt=[[0, 1e6], [100, 9e5], [600, 5e5]])
    assert curve.names == ("mu", "kt")
    assert curve.limits == (20.0, 600.0)
    np.testing.assert_array_equal(curve.knots, [20.0, 100.0, 600.0])
    np.testing.assert_allclose(curve.mu([[20.0, 410.0]]), [[0.5, 0.4]])
    assert set(curve.at(300.0)) == {"mu", "kt"}
    mixed = FrictionCurve(mu=[[0, 0.5], [1, 0.3], [2, 0.3]], kt=[[0, 5], [1, 3], [2, 3]], interpolation={"kt": "cubic"})
    assert mixed.mu(1.5) == 0.3
    assert mixed.kt(1.5) == pytest.approx(2.75)


@pytest.mark.parametrize("name", ["mu", "kt", "kn"])
def test_each_parameter_has_its_own_value_and_derivative(name: str) -> None:
    tables = {
        "mu": [[0.0, 0.4], [100.0, 0.3], [300.0, 0.1]], "kt": [[0.0, 9e6], [200.0, 7e6], [300.0, 2e6]],
        "kn": [[0.0, 5e7], [150.0, 6e7], [300.0, 4e7]],
    }  # fmt: skip
    curve = FrictionCurve(**tables)
    at, step = np.array([20.0, 120.0, 250.0]), 1e-3
    value, slope = getattr(curve, name), getattr(curve, f"d{name}")
    rows = np.array(tables[name])
    np.testing.assert_allclose(value(rows[:, 0]), rows[:, 1], rtol=1e-12)
    np.testing.assert_allclose(slope(at), (value(at + step) - value(at - step)) / (2 * step), rtol=1e-6)


@pytest.mark.parametrize("wrong", [24.9, 800.1])
def test_never_extrapolates(wrong: float) -> None:
    with raises_fault("mu", says="lies outside its table, 25 to 800"):
        FrictionCurve(temperature=T, mu=MU).mu([100.0, wrong])


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1j, "warm", None])
def test_a_temperature_is_a_finite_number(wrong: Any) -> None:
    for temperature in (wrong, [100.0, wrong]):
        with raises_fault("temperature", expected="finite real numbers"):
            FrictionCurve(temperature=T, mu=MU).mu(temperature)


def test_all_faults_at_once() -> None:
    with pytest.raises(InputError) as caught:
        FrictionCurve(mu=[[25, 0.5], [20, -0.1]], kt=[[1.0, 2.0]], kn=[[0, np.inf], [1, 2]], interpolation="linear")
    text = str(caught.value)
    assert len(caught.value.sentences) == 5
    for part in (
        "interpolation: found 'linear'",
        "mu: temperature 20 follows 25",
        "mu: the table holds -0.1",
        "kt: the table has the shape (1, 2)",
        "kn: found [[0, inf], [1, 2]]; expected a table of finite numbers",
    ):
        assert part in text


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({}, "no table was given"),
        ({"temperature": T, "mu": MU[:-1]}, "one value for each temperature"),
        ({"mu": [["warm", 0.5], ["hot", 0.3]]}, "expected a table of finite numbers"),
        ({"mu": [[0, 0.5], [1, 0.3]], "kt": [[2, 1.0], [3, 1.0]]}, "no temperatures in common"),
        ({"temperature": [0, 1, 2, 3], "mu": [0.5, 0.0, 0.0, 0.5], "interpolation": "cubic"}, "overshoots to -"),
    ],
)
def test_each_fault_has_its_sentence(arguments: dict, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        FrictionCurve(**arguments)


def test_missing_table_is_said() -> None:
    with raises_fault("kt", says="the friction curve has no table of it"):
        FrictionCurve(temperature=T, mu=MU).kt(100.0)
