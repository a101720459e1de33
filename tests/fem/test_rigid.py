"""Rigid bodies and means: rigid motions go through unchanged, forces and moments keep their sum."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.equations import Reference, mean_equations, rigid_equations

PLACES = {2: np.array([1.0, 0.5, 0.0]), 3: np.array([-1.0, 2.0, 0.3]), 4: np.array([0.2, 0.1, 1.0])}
SHIFT, TURN = np.array([0.3, -0.2, 0.7]), np.array([0.05, -0.4, 0.2])


def motion(position: np.ndarray) -> np.ndarray:
    return SHIFT + np.cross(TURN, position)


def residual(equation, values) -> float:
    return sum(factor * values[node, component] for node, component, factor in equation.terms)


def rigid_values(reference: Reference) -> dict[tuple[int, int], float]:
    values = {(node, axis): float(motion(x)[axis]) for node, x in PLACES.items() for axis in range(3)}
    values |= {(reference.node, axis): float(motion(reference.position)[axis]) for axis in range(3)}
    return values | {pair: float(turn) for pair, turn in zip(reference.rotations, TURN, strict=True)}


REFERENCE = Reference.of(1, np.array([0.4, -0.6, 0.2]))


def test_a_rigid_motion_satisfies_the_equations_of_a_rigid_body():
    equations = list(rigid_equations(REFERENCE, PLACES, "r", (0, 1, 2)))
    assert len(equations) == 9
    assert max(abs(residual(equation, rigid_values(REFERENCE))) for equation in equations) < 1e-15


def test_rotations_may_be_those_of_another_node():
    turned = Reference(node=1, position=REFERENCE.position, rotations=((9, 0), (9, 1), (9, 2)))
    values = rigid_values(turned)
    assert values[9, 1] == TURN[1]
    assert max(abs(residual(e, values)) for e in rigid_equations(turned, PLACES, "r", (0, 1, 2))) < 1e-15


@pytest.mark.parametrize("weights", [(1.0, 1.0, 1.0), (2.0, 0.5, 0.1)])
def test_the_mean_of_a_rigid_motion_is_that_motion(weights):
    nodes = {n: (x, w, (0, 1, 2)) for (n, x), w in zip(PLACES.items(), weights, strict=True)}
    equations = list(mean_equations(REFERENCE, nodes, "m"))
    assert [e.pairs[0] for e in equations] == [(1, axis) for axis in range(6)]
    assert max(abs(residual(equation, rigid_values(REFERENCE))) for equation in equations) < 1e-12


def test_forces_on_a_mean_node_are_shared_out_with_the_same_resultant():
    nodes = {n: (x, 1.0, (0, 1, 2)) for n, x in PLACES.items()}
    for component, equation in enumerate(mean_equations(REFERENCE, nodes, "m")):
        forces = {n: np.zeros(3) for n in PLACES}
        for node, axis, factor in equation.terms[1:]:
            forces[node][axis] = -factor
        total = sum(forces.values())
        moment = sum(np.cross(PLACES[n] - REFERENCE.position, f) for n, f in forces.items())
        np.testing.assert_allclose(np.concatenate([total, moment]), np.eye(6)[component], atol=1e-14)


def test_nodes_on_a_line_tell_no_rotation_about_it():
    line = {n: (np.array([float(n), 0.0, 0.0]), 1.0, (0, 1, 2)) for n in (2, 3, 4)}
    with pytest.raises(InputError, match="m: the nodes do not determine"):
        list(mean_equations(Reference.of(1, np.zeros(3)), line, "m"))
    assert len(list(mean_equations(Reference.of(1, np.zeros(3)), line, "m", (0, 1, 2)))) == 3
