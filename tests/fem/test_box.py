"""Boxes: counts, sides and conformity of every element type."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.boundary import face_counts
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.geometry import volume

CELLS = {"hex": 1, "wedge": 2, "tet": 6, "pyramid": 6}


@pytest.mark.parametrize("kind", sorted(ELEMENTS))
@pytest.mark.parametrize("divisions", [(1, 1, 1), (3, 1, 2)])
def test_every_type_fills_the_box_and_conforms(kind, divisions):
    mesh = box((1.0, 2.0, 0.5), divisions, kind)
    assert mesh.n_elements == np.prod(divisions) * CELLS[kind.rstrip("ir0123456789")]
    assert volume(mesh) == pytest.approx(1.0, rel=1e-13)
    assert {int(n) for _, counts in face_counts(mesh).values() for n in np.unique(counts)} <= {1, 2}
    assert len(np.unique(mesh.nodes.round(9), axis=0)) == mesh.n_nodes
    for name, surface in mesh.surfaces.items():
        axis, end = "xyz".index(name[0]), int(name[1])
        np.testing.assert_array_equal(mesh.nodes[surface.nodes, axis], end * (1.0, 2.0, 0.5)[axis])


@pytest.mark.parametrize(
    ("size", "divisions", "kind", "said"),
    [
        ((1, 1, 1), (1, 1, 1), "hex27", "element type 'hex27' is not known"),
        ((1, 0, 1), (1, 1, 1), "hex8", "must be positive"),
        ((1, 1, 1), (1, 0, 1), "hex8", "must be positive"),
    ],
)
def test_boxes_that_are_none(size, divisions, kind, said):
    with pytest.raises(InputError, match=said):
        box(size, divisions, kind)
