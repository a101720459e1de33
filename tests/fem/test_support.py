"""Rigid body motions of parts, with and without coordinates, and names of rows."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import block_diag, csr_array

from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.model import ImportedModel
from slipstick.importers.matrix_model import empty_rows, floating_parts, name_rows
from slipstick.importers.mesh_model import MeshModel, assemble_mesh

STEEL = Material(young=2e11, poisson=0.3, density=7800.0)


def free_box():
    return assemble_mesh(MeshModel(mesh=box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")), source="box", material=STEEL)


@pytest.mark.parametrize(
    ("components", "nodes", "motions"),
    [("xyz", "corner", 3), ("xyz", "edge", 1), ("xyz", "x0", 0), ("x", "x0", 3), ("z", "corner", 5)],
)
def test_motions_left_by_supports(components, nodes, motions):
    model = free_box()
    at = model.coordinates
    where = {
        "corner": model.node_ids[(at == 0).all(axis=1)],
        "edge": model.node_ids[(at[:, :2] == 0).all(axis=1)],
        "x0": model.node_ids[at[:, 0] == 0],
    }
    held = model.fix(where[nodes], components)
    assert [count for _, count in floating_parts(held)] == ([motions] if motions else [])
    assert [count for _, count in floating_parts(model)] == [6]


def test_parts_are_found_by_themselves():
    one = free_box()
    both = replace(
        one,
        K=csr_array(block_diag([one.K, one.K])),
        M=csr_array(block_diag([one.M, one.M])),
        dof_nodes=np.concatenate([one.dof_nodes, one.dof_nodes + 1000]),
        dof_components=np.tile(one.dof_components, 2),
        node_ids=np.concatenate([one.node_ids, one.node_ids + 1000]),
        coordinates=np.vstack([one.coordinates, one.coordinates + 9.0]),
    )
    parts = list(floating_parts(both))
    assert [(nodes.min() > 1000, count) for nodes, count in parts] == [(False, 6), (True, 6)]


def test_without_coordinates_translations_alone_are_tried():
    K = csr_array(np.array([[1.0, -1.0], [-1.0, 1.0]]))
    spring = ImportedModel(K=K, M=csr_array(np.eye(2)), dof_nodes=np.array([1, 2]), dof_components=np.array([0, 0]))
    assert [count for _, count in floating_parts(spring)] == [1]
    assert list(floating_parts(replace(spring, K=K + csr_array(np.eye(2))))) == []


def test_rows_without_entries_and_names():
    assert empty_rows(csr_array(np.array([[0.0, 0.0], [0.0, 1.0]]))).tolist() == [True, False]
    assert name_rows(np.arange(20), np.zeros(20, dtype=int)).endswith("n7x and 12 more")
