"""Middle nodes: the same body with the same names, quadratic; nothing twice."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.fem.boundary import boundary
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS, LINEAR_TO_QUADRATIC
from slipstick.fem.geometry import volume
from slipstick.fem.loads import area
from slipstick.fem.mesh import Mesh
from slipstick.fem.refine import linear_warnings, quadratic


@pytest.mark.parametrize("kind", sorted(LINEAR_TO_QUADRATIC))
def test_the_body_stays_and_every_middle_lies_on_its_edge(kind):
    mesh = box((1.0, 2.0, 0.5), (2, 2, 1), kind)
    fine = quadratic(mesh)
    to = LINEAR_TO_QUADRATIC[kind]
    assert set(fine.blocks) == {to}
    assert volume(fine) == pytest.approx(1.0, rel=1e-13)
    assert len(np.unique(fine.nodes.round(9), axis=0)) == fine.n_nodes
    n = ELEMENTS[kind].n_nodes
    for i, (a, b) in enumerate(ELEMENTS[kind].edges):
        block = fine.blocks[to]
        ends = fine.nodes[block[:, [a, b]]].mean(axis=1)
        np.testing.assert_allclose(fine.nodes[block[:, n + i]], ends, atol=1e-15)
    for name, surface in mesh.surfaces.items():
        assert area(fine, fine.surface(name)) == pytest.approx(area(mesh, surface))
        np.testing.assert_array_equal(fine.surface(name).nodes, box((1.0, 2.0, 0.5), (2, 2, 1), to).surface(name).nodes)
    assert boundary(fine).n_faces == boundary(mesh).n_faces
    assert quadratic(fine) is fine


def test_names_and_labels_follow():
    mesh = box((1.0, 1.0, 1.0), (2, 1, 1), "hex8")
    named = replace(
        mesh,
        node_sets={"root": mesh.node_set("x0")},
        element_sets={"first": {"hex8": np.array([0])}},
        node_labels=np.arange(mesh.n_nodes) * 10,
        element_labels={"hex8": np.array([4, 7])},
    )
    fine = quadratic(named)
    np.testing.assert_array_equal(np.sort(fine.node_sets["root"]), fine.surface("x0").nodes)
    assert fine.element_sets == {"first": {"hex20": np.array([0])}}
    np.testing.assert_array_equal(fine.node_labels[: mesh.n_nodes], named.node_labels)
    assert fine.node_labels[mesh.n_nodes] == named.node_labels.max() + 1
    assert fine.element_label("hex20", 1) == 7


def test_linear_elements_are_counted():
    mesh = box((1.0, 1.0, 1.0), (2, 1, 1), "tet4")
    (said,) = linear_warnings(mesh, "a.msh")
    assert said.startswith("a.msh: 12 tet4 elements are linear")
    assert list(linear_warnings(mesh, "a.msh", ("hex8",))) == []
    assert list(linear_warnings(quadratic(mesh), "a.msh")) == []
    assert isinstance(mesh, Mesh)
