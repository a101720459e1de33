"""The outside of a mesh, and surfaces picked out of it."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.boundary import all_faces, boundary, skin_of, surface_towards, surface_where, thinned
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.loads import area
from slipstick.fem.mesh import Mesh

SIZE = (1.0, 2.0, 0.5)


@pytest.mark.parametrize("kind", sorted(ELEMENTS))
def test_inner_faces_appear_twice_and_outer_ones_once(kind):
    mesh = box(SIZE, (2, 2, 2), kind)
    every = sum(len(faces) for faces in all_faces(mesh).values())
    outer = boundary(mesh).n_faces
    assert (every - outer) % 2 == 0
    assert area(mesh, boundary(mesh)) == pytest.approx(7.0)


def test_a_face_of_three_elements_is_a_fault():
    mesh = box(SIZE, (1, 1, 1), "hex8")
    (first,) = mesh.blocks["hex8"]
    rows = [first, *(np.concatenate([first[:4], np.arange(at, at + 4)]) for at in (8, 12))]
    with pytest.raises(InputError, match="belongs to 3 elements"):
        boundary(Mesh(nodes=np.concatenate([mesh.nodes, mesh.nodes]), blocks={"hex8": np.array(rows)}))


@pytest.mark.parametrize(("direction", "side"), [((1, 0, 0), "x1"), ((0, -3, 0), "y0"), ((0, 0, 1e-9), "z1")])
def test_a_side_is_found_by_the_direction_it_looks_in(direction, side):
    mesh = box(SIZE, (2, 3, 2), "tet10")
    found, expected = surface_towards(mesh, direction), mesh.surface(side)
    assert np.array_equal(found.nodes, expected.nodes)
    assert np.array_equal(surface_where(mesh, np.isin(np.arange(mesh.n_nodes), expected.nodes)).nodes, expected.nodes)


@pytest.mark.parametrize(
    ("direction", "options", "said"),
    [((0, 0, 0), {}, "vector"), ((1, 0), {}, "vector"), ((1, 1, 0), {"angle": 10.0}, "no boundary face looks towards")],
)
def test_directions_that_find_nothing(direction, options, said):
    with pytest.raises(InputError, match=said):
        surface_towards(box(SIZE, (1, 1, 1), "hex8"), direction, **options)


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


def area_towards(nodes: np.ndarray, triangles: np.ndarray, axis: int) -> tuple[float, float]:
    """Area that looks along an axis, and against it."""
    a, b, c = (nodes[triangles[:, k]] for k in range(3))
    across = 0.5 * np.cross(b - a, c - a)[:, axis]
    return float(across[across > 0].sum()), float(-across[across < 0].sum())


def test_both_sides_of_a_thin_plate_stay() -> None:
    mesh = box((2.0, 1.0, 0.004), (40, 20, 1), "hex8")
    nodes, triangles = skin_of(mesh, 300)
    assert 100 < len(nodes) <= 300
    assert area_towards(mesh.nodes[nodes], triangles, 2) == pytest.approx((2.0, 2.0), rel=0.15)
    assert thinned(mesh.nodes[nodes], triangles, 80)[0].size <= 80


@pytest.mark.parametrize("element", ["hex20", "tet10", "wedge15"])
def test_nodes_between_corners_are_seen_where_contacts_need_them(element: str) -> None:
    mesh = box((2.0, 1.0, 0.5), (4, 2, 1), element)
    below = mesh.surface("z0").nodes
    nodes, triangles = skin_of(mesh, fine=below, most_fine=1000)
    assert set(below) <= set(nodes)
    assert volume(mesh.nodes[nodes], triangles) == pytest.approx(1.0)
    assert area_towards(mesh.nodes[nodes], triangles, 2) == pytest.approx((2.0, 2.0))
    corners = skin_of(mesh)[0]
    assert len(nodes) == len(corners) + np.isin(below, corners, invert=True).sum()
    for one, other in zip(skin_of(mesh, fine=below, most_fine=5), skin_of(mesh), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_skin_is_finer_where_contacts_lie() -> None:
    """As fine as it has to be there, and as coarse as before elsewhere; whole where that is fine enough."""
    mesh = box((2.0, 1.0, 0.1), (40, 20, 2), "hex8")
    below = mesh.surface("z0").nodes
    nodes, triangles = skin_of(mesh, 200, below, 10_000)
    assert set(below) <= set(nodes)
    assert len(nodes) <= len(below) + 200
    assert area_towards(mesh.nodes[nodes], triangles, 2) == pytest.approx((2.0, 2.0), rel=0.15)
    some, _ = skin_of(mesh, 200, below, 400)
    assert 200 < np.isin(some, below).sum() <= 400
    coarse = skin_of(mesh, 200)
    for one, other in zip(skin_of(mesh, 200, below, 20), coarse, strict=True):
        np.testing.assert_array_equal(one, other)
