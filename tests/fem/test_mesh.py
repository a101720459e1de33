"""Meshes are checked when they are made; names and labels lead to nodes."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.mesh import Mesh, Surface, node_indices, user_names

MESH = box((1.0, 1.0, 1.0), (2, 1, 1), "hex8")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"nodes": np.zeros((3, 2))}, r"mesh nodes have shape \(3, 2\)"),
        ({"nodes": np.where(MESH.nodes == 0.5, np.nan, MESH.nodes)}, "coordinates that are not finite"),
        ({"blocks": {}}, "the mesh has no elements"),
        ({"blocks": {"hex9": MESH.blocks["hex8"]}}, "this type is not known"),
        ({"blocks": {"hex20": MESH.blocks["hex8"]}}, r"expected \(n, 20\)"),
        ({"blocks": {"hex8": MESH.blocks["hex8"] * 1.0}}, "expected integers"),
        ({"blocks": {"hex8": MESH.blocks["hex8"] - 1}}, r"outside 0\.\.11"),
        ({"surfaces": {"s": Surface(faces={"quad4": np.array([[0, 1, 2, 99]])})}}, "surface 's', quad4: number 1"),
        ({"node_sets": {"tip": np.array([12])}}, "node set 'tip' holds an index outside"),
        ({"node_labels": np.ones(12, dtype=int)}, "expected 12 different numbers"),
    ],
)
def test_what_is_wrong_is_said_when_it_is_made(change, said):
    with pytest.raises(InputError, match=said):
        replace(MESH, **change)


def test_labels_lead_to_nodes_in_any_order():
    labels = np.array([50, 7, 100, 3])
    np.testing.assert_array_equal(node_indices(labels, np.array([[3, 50], [7, 7]]), "x"), [[3, 0], [1, 1]])
    with pytest.raises(InputError, match="node 4, which is not in the mesh"):
        node_indices(labels, np.array([3, 4]), "an element")


def test_labels_of_no_nodes_are_refused():
    with pytest.raises(InputError, match="an element uses node 3, and the mesh has no nodes"):
        node_indices(np.empty(0, dtype=int), np.array([[3, 4]]), "an element")


def test_names_lead_to_nodes():
    named = replace(MESH, node_sets={"tip": np.array([2]), "_made": np.array([3])})
    assert named.node_set("tip").tolist() == [2]
    np.testing.assert_array_equal(named.node_set("x0"), named.surface("x0").nodes)
    with pytest.raises(InputError, match="node set 'root' is not in the mesh; it has: tip, x0"):
        named.node_set("root")
    assert user_names(["_a", "_b"]) == ["_a", "_b"]


def test_labels_are_counted_from_one_where_none_are_given():
    assert MESH.labels.tolist() == list(range(1, 13))
    assert MESH.element_label("hex8", 1) == 2
    labelled = replace(MESH, node_labels=np.arange(12) + 100, element_labels={"hex8": np.array([9, 4])})
    assert labelled.labels[0] == 100
    assert labelled.element_label("hex8", 1) == 4
    loose = Mesh(nodes=np.vstack([MESH.nodes, [[9.0, 9.0, 9.0]]]), blocks=MESH.blocks)
    assert loose.used_nodes.tolist() == list(range(12))
