"""The outside of a mesh, and surfaces picked out of it."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.boundary import all_faces, boundary, surface_from_nodes, surface_towards, surface_where
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


def test_corner_nodes_suffice_for_a_face():
    mesh = box(SIZE, (2, 3, 2), "tet10")
    corners = np.unique(mesh.blocks["tet10"][:, :4])
    side = mesh.surface("x1")
    found = surface_from_nodes(mesh, np.intersect1d(side.nodes, corners))
    assert found.n_faces == side.n_faces
    with pytest.raises(InputError, match="no face of the boundary"):
        surface_from_nodes(mesh, corners[:2])


@pytest.mark.parametrize(
    ("direction", "options", "said"),
    [((0, 0, 0), {}, "vector"), ((1, 0), {}, "vector"), ((1, 1, 0), {"angle": 10.0}, "no boundary face looks towards")],
)
def test_directions_that_find_nothing(direction, options, said):
    with pytest.raises(InputError, match=said):
        surface_towards(box(SIZE, (1, 1, 1), "hex8"), direction, **options)
