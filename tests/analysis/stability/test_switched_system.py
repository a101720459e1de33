"""Linearised contacts against the law itself, written out."""

import itertools

import numpy as np
import pytest

from slipstick.analysis.stability.dynamics import Dynamics
from slipstick.analysis.stability.linear_systems import Combinations, FrictionPorts

KT, MU, KN = np.array([100.0, 50.0]), np.array([0.3, 0.6]), np.array([40.0, 80.0])
PORTS = FrictionPorts(tangential=np.array([0, 1]), normal=np.array([2, -1]), kt=KT, mu=MU, kn=KN, n_ports=3)


def forces(states, s, memory):
    """Forces at the three ports for motions there."""
    out = np.zeros(3)
    for i, state in enumerate(states):
        y = s[2] if i == 0 else 0.0
        friction = {0: 0.0, 1: KT[i] * s[i] + memory[i], 2: MU[i] * KN[i] * y, 3: -MU[i] * KN[i] * y}
        out[i] = friction[state]
        if i == 0 and state:
            out[2] = KN[0] * y
    return out


@pytest.mark.parametrize("states", list(itertools.product(range(4), range(4))))
def test_motion_and_forces_agree_in_every_combination(states) -> None:
    rng = np.random.default_rng(1)
    R = 0.002 * np.ones((3, 3)) + 0.003 * np.eye(3)
    structure = Dynamics(
        K=np.diag([30.0, 90.0]),
        C=np.eye(2),
        rows=rng.normal(size=(3, 2)),
        columns=rng.normal(size=(2, 3)),
        R=R,
        loads=np.zeros((2, 0)),
        load_compliance=np.zeros((3, 0)),
    )
    combinations = Combinations(structure, PORTS)
    found = combinations(states)
    q, p, memory = rng.normal(size=(3, 2))
    s = found.motion @ np.concatenate([q, p, memory])
    f = forces(states, s, memory)
    assert np.allclose(s, structure.rows @ q - R @ f, atol=1e-13)
    answer = found.forces @ np.concatenate([q, p / combinations.scale, memory]) * combinations.scale
    assert np.allclose(answer, structure.K @ q + structure.C @ p + structure.columns @ f, atol=1e-12)
    assert found.sound
    assert combinations(states) is found


def test_a_motion_that_does_not_follow_from_the_forces_is_seen() -> None:
    """With ``mu kn R > 1`` in slip a push along the normal comes back stronger, with the other sign."""
    R = np.zeros((3, 3))
    R[2, 0], R[2, 2] = 0.2, 0.01
    structure = Dynamics(
        K=np.eye(1),
        C=np.eye(1),
        rows=np.ones((3, 1)),
        columns=np.ones((1, 3)),
        R=R,
        loads=np.zeros((1, 0)),
        load_compliance=np.zeros((3, 0)),
    )
    combinations = Combinations(structure, PORTS)
    assert [combinations((state, 0)).sound for state in (0, 1, 2, 3)] == [True, True, True, False]
