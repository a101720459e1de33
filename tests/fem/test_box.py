"""Boxes: counts, sides and conformity of every element type."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.boundary import face_counts
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.geometry import volume
from slipstick.fem.mesh import together

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


def test_boxes_at_a_place_make_one_mesh_with_the_names_of_both():
    a, b = box((1.0, 2.0, 0.5), (2, 1, 1), "hex8"), box((1.0, 1.0, 1.0), (1, 2, 1), "hex8", at=(3.0, -1.0, 0.25))
    np.testing.assert_allclose(b.nodes[b.surfaces["y0"].nodes][:, 1], -1.0)
    tet = replace(box((1.0, 1.0, 1.0), (1, 1, 1), "tet4", at=(0.0, 9.0, 0.0)), node_sets={"corner": np.array([0, 1])})
    mesh = together({"a": a, "b": b, "c": tet})
    assert volume(mesh) == pytest.approx(3.0, rel=1e-13)
    assert mesh.n_nodes == a.n_nodes + b.n_nodes + tet.n_nodes
    np.testing.assert_allclose(mesh.nodes[mesh.surface("b.x1").nodes][:, 0], 4.0)
    np.testing.assert_allclose(mesh.nodes[mesh.node_set("c.corner")], tet.nodes[[0, 1]])
    np.testing.assert_array_equal(mesh.element_sets["b"]["hex8"], [2, 3])
    np.testing.assert_array_equal(
        mesh.nodes[mesh.blocks["hex8"][mesh.element_sets["b"]["hex8"]]], b.nodes[b.blocks["hex8"]]
    )
    again = together({"all": mesh})
    assert set(again.element_sets) == {"all", "all.a", "all.b", "all.c"}


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
