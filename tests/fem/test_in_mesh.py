"""Rows of a model in its mesh."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.imported import STEEL

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.in_mesh import mesh_of, motion_in_mesh, rows_in_mesh
from slipstick.fem.mesh import Mesh
from slipstick.importers.mesh_model import MeshModel, assemble_mesh


def test_places_are_those_of_the_labels():
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")
    mesh = Mesh(nodes=mesh.nodes, blocks=mesh.blocks, node_labels=np.array([9, 3, 12, 4, 5, 6, 7, 8]))
    model = assemble_mesh(MeshModel(mesh=mesh), source="m", material=STEEL, fixed=["n9", "n3x"])
    found = rows_in_mesh(model, mesh_of(model, "shapes"), np.array([12, 9]), np.array([2, 0]), "shapes")
    assert found.tolist() == [8, 0]
    free = rows_in_mesh(model, mesh, model.dof_nodes, model.dof_components, "shapes")
    assert sorted(free.tolist()) == list(range(4, 24))
    assert motion_in_mesh(model, mesh, free, "shapes") is None
    with pytest.raises(InputError, match="shapes need the mesh"):
        mesh_of(replace(model, mesh=None), "shapes")
    with pytest.raises(InputError, match="node 99 of the matrices is not in the mesh"):
        rows_in_mesh(model, mesh, np.array([99]), np.array([0]), "shapes")
    with pytest.raises(InputError, match="shapes need solid elements; the model has rotations"):
        rows_in_mesh(model, mesh, np.array([12]), np.array([3]), "shapes")
