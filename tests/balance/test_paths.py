"""Paths of parameters: each derivative is that of its points."""

import numpy as np
import pytest
from helpers.problems import random_problem

from slipstick.balance.inputs import Line, LoadPhase, StructureValue

BASE = random_problem(0).inputs


def flat(inputs):
    parts = [
        inputs.P,
        *(v for b in inputs.batches for v in (*b.values.values(), b.velocity, b.velocity_per_omega, b.motion)),
    ]
    return np.concatenate([np.ravel(part) for part in parts] + [np.array(list(inputs.structure.values()))])


@pytest.mark.parametrize(
    "path",
    [Line(BASE, random_problem(1).inputs), LoadPhase(BASE, 3.0, 0, 1), StructureValue(BASE, "loss_factor")],
    ids=["line", "phase", "structure"],
)
@pytest.mark.parametrize("value", [-1.3, 0.0, 2.0])
def test_derivative(path, value):
    h = 1e-5
    slope = path.at(value)[1]
    difference = (flat(path.at(value + h)[0]) - flat(path.at(value - h)[0])) / (2 * h)
    np.testing.assert_allclose(flat(slope), difference, atol=1e-6)


def test_a_phase_turns_a_load_of_the_same_size():
    for phase in (0.0, 1.0, -2.5):
        P = LoadPhase(BASE, 3.0, 1, 3).at(phase)[0].P
        assert np.hypot(*P[1, 3:5]) == pytest.approx(3.0)
        t = np.linspace(0, 2 * np.pi, 9)
        np.testing.assert_allclose(P[1, 3] * np.cos(t) + P[1, 4] * np.sin(t), 3.0 * np.cos(t + phase), atol=1e-14)
        other = np.ones(P.shape, dtype=bool)
        other[1, 3:5] = False
        np.testing.assert_array_equal(P[other], BASE.P[other])
