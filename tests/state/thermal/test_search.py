"""All equilibria in a range: none missed against brute force."""

from __future__ import annotations

import numpy as np
from helpers.heat import Array, brute_roots, steep

from slipstick.state.thermal.search import element_equilibria, surface_equilibria


def test_every_equilibrium_is_found() -> None:
    """All roots of a fine scan are found in 120 random cases, of which many have three."""
    n, limits = 120, (20.0, 800.0)
    power, background = steep(np.random.default_rng(3), n)
    found = element_equilibria(power, background, 8.0, limits=limits)
    brute = brute_roots(power, background, 8.0, limits)
    step = (limits[1] - limits[0]) / 40000
    for got, expected in zip(found, brute, strict=True):
        assert got.temperature.size == expected.size
        assert np.all(np.abs(got.temperature - expected) <= step * (1 + 1e-9))
    several = [got for got in found if got.several]
    assert len(several) > 10
    assert all(list(got.stable) == [True, False, True] for got in several)
    for i, got in enumerate(found):
        for T in got.temperature:
            at = np.where(np.arange(n) == i, T, background)
            assert abs(T - 20.0 - 8.0 * power(at)[0][i]) < 1e-10


def test_all_equilibria_of_a_weakly_coupled_surface() -> None:
    """Two elements with three equilibria each give nine while the coupling is weak, four of them stable."""

    def power(T: Array) -> tuple[Array, Array]:
        grown = 1 / (1 + np.exp((100.0 - T) / 5.0))
        return 2.0 + 20.0 * grown, 4.0 * grown * (1.0 - grown)

    found = surface_equilibria(power, [20.0, 20.0], 8.0 * np.array([[1, 1e-3], [1e-3, 1]]), limits=(20.0, 300.0))
    assert found.temperature.shape == (9, 2)
    assert found.stable.sum() == 4
    assert found.several
