"""Derivatives through the starts of sticks, against central differences of the forces."""

import numpy as np
import pytest
from helpers.elements import SEEDS, H, evaluated, given, tuples


def difference(function, step=1e-6):
    return (function(step) - function(-step)) / (2 * step)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("column", "row"),
    [(tuples.P_V, tuples.V_DV), (tuples.P_MU, tuples.V_DMU), (tuples.P_KT, tuples.V_DKT), (tuples.P_KN, tuples.V_DKN)],
)
def test_by_parameters(seed, column, row):
    inputs = given(seed)
    if column == tuples.P_V and inputs.parameters[column] == 0.0:
        pytest.skip("at rest the mean force may jump with the sign of the velocity")

    def force(h):
        parameters = inputs.parameters.copy()
        parameters[column] += h
        return evaluated(inputs._replace(parameters=parameters))[0].vectors[tuples.V_FX].copy()

    np.testing.assert_allclose(evaluated(inputs)[0].vectors[row], difference(force), atol=2e-6)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("name", "place"), [("X", 0), ("Y", 1)])
def test_by_motion(seed, name, place):
    inputs, way = given(seed), np.random.default_rng(seed + 100).normal(size=H.size)

    def force(h):
        moved = inputs._replace(**{name: getattr(inputs, name) + h * way})
        return evaluated(moved)[0].vectors[tuples.V_FX].copy()

    np.testing.assert_allclose(evaluated(inputs)[0].matrices[place] @ way, difference(force), atol=2e-6)


def test_stuck_all_period():
    """The force follows the motion by kt; its mean is led by both clamps, which move with load and motion."""
    inputs, way = given(0, v=0.0, kt=0.01, gap=-5.0), np.random.default_rng(7).normal(size=H.size)
    out, k, total = evaluated(inputs)
    assert (total, k.intervals.code[0, 0]) == (1, tuples.STICK)
    np.testing.assert_allclose(out.vectors[tuples.V_FX, 1:], 0.01 * inputs.X[1:], atol=1e-12)
    for place, name in enumerate("XY"):

        def force(h, name=name):
            moved = inputs._replace(**{name: getattr(inputs, name) + h * way})
            return evaluated(moved)[0].vectors[tuples.V_FX].copy()

        np.testing.assert_allclose(out.matrices[place] @ way, difference(force), atol=1e-8)
