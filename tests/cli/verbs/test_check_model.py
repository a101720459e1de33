"""At which frequencies ``check`` compares a reduced model with the full one."""

from __future__ import annotations

import pytest

from slipstick.cli.verbs.check import _vector, compared_at


@pytest.mark.parametrize(
    ("omega", "order", "count", "expected"),
    [
        ((10.0, 20.0), 5, 6, [10.0, 15.0, 20.0, 140.0 / 3, 220.0 / 3, 100.0]),
        ((20.0, 10.0), 5, 6, [10.0, 15.0, 20.0, 140.0 / 3, 220.0 / 3, 100.0]),
        ((10.0, 20.0), 1, 6, [10.0, 15.0, 20.0]),
        ((10.0, 20.0), 0, 3, [10.0, 20.0]),
        ((10.0, 20.0), 2, 4, [10.0, 15.0, 20.0, 40.0]),
    ],
)
def test_over_the_range_and_up_to_its_highest_harmonic(
    omega: tuple[float, float], order: int, count: int, expected: list[float]
) -> None:
    found = compared_at(omega, order, count)
    assert sorted(found) == pytest.approx(expected)
    assert len(found) == len(set(found))


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ((1e-10, 1.0, -2e-10), "(0, 1, 0)"),
        ((1e-7, 1e3, 0.5), "(0, 1000, 0.5)"),
        ((1e-5, 1e3, 0.5), "(1e-05, 1000, 0.5)"),
        ((0.0, 0.0, 0.0), "(0, 0, 0)"),
    ],
)
def test_rounding_of_normals_is_not_shown(values: tuple[float, ...], said: str) -> None:
    assert _vector(values) == said
