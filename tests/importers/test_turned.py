"""Matrices in directions of their own, turned to the global ones."""

import numpy as np
import pytest

from slipstick.importers.deck import Deck
from slipstick.importers.matrix_model import to_global

rng = np.random.default_rng(2)
AXES = np.linalg.qr(rng.normal(size=(3, 3)))[0]
A = rng.normal(size=(7, 7))
K = A @ A.T


def raw(components: list[int], K: np.ndarray, held: list[tuple[int, int]] | None = None) -> Deck:
    nodes = np.array([5] * (len(components) - 1) + [9])
    return Deck(matrices={"K": K}, rows=np.stack([nodes, components], axis=1), held=set(held or ()))


@pytest.mark.parametrize("half", [np.tril, np.triu, lambda a: a])
def test_whole_triples_are_turned_from_any_half(half):
    """The stiffness of u = T u_own is T K T'."""
    found = to_global(raw([0, 1, 2, 3, 4, 5, 0], half(K)), {5: AXES, 77: AXES}, "m")
    turn = np.eye(7)
    turn[:3, :3] = turn[3:6, 3:6] = AXES
    np.testing.assert_allclose(found.matrices["K"].toarray(), turn @ K @ turn.T, atol=1e-14)
    assert found.warnings == ()


def test_nodes_free_in_part_keep_their_directions_and_say_so():
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    found = to_global(raw([0, 2, 0], K[:3, :3]), {5: quarter}, "m")
    np.testing.assert_array_equal(found.matrices["K"].toarray(), K[:3, :3])
    assert found.warnings == (
        "m: nodes with own directions of which only some are free keep them: n5x is along (0, 1, 0), n5z is along "
        "(0, 0, 1)",
    )
    held = to_global(raw([0, 1, 2, 0], K[:4, :4], held=[(5, 1)]), {5: quarter}, "m")
    np.testing.assert_array_equal(held.matrices["K"].toarray(), K[:4, :4])
    assert "n5x is along (0, 1, 0)" in held.warnings[0]


def test_nothing_to_turn():
    model = raw([0, 1, 2, 0], K[:4, :4])
    assert to_global(model, {}, "m") is model
