"""The skin of a mesh: closed, outward, and coarser where it would be too fine."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.fem.box import box
from slipstick.fem.skin import skin_of


def volume(nodes: np.ndarray, triangles: np.ndarray) -> float:
    """By the divergence theorem: positive where triangles look outwards."""
    a, b, c = (nodes[triangles[:, i]] for i in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def edges_meet(triangles: np.ndarray) -> bool:
    """Whether every edge is run through once in each direction: a closed surface."""
    edges = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    return {tuple(e) for e in edges} == {tuple(e[::-1]) for e in edges} and len({tuple(e) for e in edges}) == len(edges)


@pytest.mark.parametrize("element", ["hex8", "hex20", "tet4", "tet10"])
def test_the_skin_of_a_block(element: str) -> None:
    mesh = box((2.0, 1.0, 0.5), (4, 2, 2), element)
    nodes, triangles = skin_of(mesh)
    assert volume(mesh.nodes[nodes], triangles) == pytest.approx(1.0)
    assert edges_meet(triangles)
    assert len(nodes) == 5 * 3 * 3 - 3  # corners alone, those inside left out
    assert set(np.unique(triangles)) == set(range(len(nodes)))


def test_a_fine_skin_is_made_coarser() -> None:
    mesh = box((2.0, 1.0, 0.5), (20, 10, 5), "hex8")
    whole, coarse = skin_of(mesh), skin_of(mesh, 150)
    assert len(whole[0]) > 500
    assert 60 < len(coarse[0]) <= 150
    assert set(coarse[0]) <= set(whole[0])
    assert set(np.unique(coarse[1])) == set(range(len(coarse[0])))
    assert volume(mesh.nodes[coarse[0]], coarse[1]) == pytest.approx(1.0, rel=0.3)
    assert len(skin_of(mesh, 1)[1]) == 0
