"""The imported model: what is held later, positions by label."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.imported import STEEL

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import ImportedModel
from slipstick.importers.mesh_model import MeshModel, assemble_mesh


@pytest.fixture(scope="module")
def cantilever() -> ImportedModel:
    mesh = box((4.0, 1.0, 1.0), (4, 1, 1), "hex8")
    return assemble_mesh(MeshModel(mesh=mesh), source="box", material=STEEL, fixed=["x0"], quadratic=True)


def test_fixing_later_equals_fixing_at_once(cantilever):
    mesh = box((4.0, 1.0, 1.0), (4, 1, 1), "hex8")
    free = assemble_mesh(MeshModel(mesh=mesh), source="box", material=STEEL, quadratic=True)
    later = free.fix("x0")
    assert later.dofs == cantilever.dofs
    assert abs(later.K - cantilever.K).max() == 0.0
    with raises_fault("fixed", says="there is no node set 'root' in the model; there are x0, x1"):
        free.fix("root")
    partly = free.fix("x0", "x")
    assert partly.n_dofs == free.n_dofs - len(free.nodes_of("x0"))


def test_positions_by_label(cantilever):
    nodes = cantilever.nodes_of("x1")
    np.testing.assert_array_equal(cantilever.positions(nodes)[:, 0], 4.0)
    with pytest.raises(InputError, match="position of node 99999 is not known"):
        cantilever.positions(np.array([99999]))


def test_nodes_and_dofs_are_held_by_name():
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")
    free = assemble_mesh(MeshModel(mesh=mesh), source="m", material=STEEL, fixed=["n1", "n3y", "x1"])
    gone = {*(f"n{n}{a}" for n in (1, *mesh.labels[mesh.node_set("x1")]) for a in "xyz"), "n3y"}
    assert set(free.dofs) == {f"n{n}{a}" for n in range(1, 9) for a in "xyz"} - gone
    assert free.fix(["n3x"]).n_dofs == free.n_dofs - 1
    for wrong in ("n1", "n99", "n3y"):
        with raises_fault("fixed", says=f"no free dof '{wrong}'"):
            free.fix([wrong])


def test_places_are_those_of_the_labels():
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")
    mesh = Mesh(nodes=mesh.nodes, blocks=mesh.blocks, node_labels=np.array([9, 3, 12, 4, 5, 6, 7, 8]))
    model = assemble_mesh(MeshModel(mesh=mesh), source="m", material=STEEL, fixed=["n9", "n3x"])
    assert model.in_mesh("shapes") is model.mesh
    assert sorted(model.free.tolist()) == list(range(4, 24))
    assert dict(zip(model.dofs, model.free.tolist(), strict=True))["n12z"] == 8
    np.testing.assert_array_equal(model.motion @ np.arange(20.0), [*np.zeros(4), *(np.argsort(model.free))])
    with pytest.raises(InputError, match="shapes need the mesh"):
        replace(model, mesh=None).in_mesh("shapes")
    with pytest.raises(InputError, match="node 99 of the matrices is not in the mesh"):
        replace(model, dof_nodes=np.where(model.dof_nodes == 12, 99, model.dof_nodes)).in_mesh("shapes")
    turned = replace(
        model, dof_components=np.where(model.dof_nodes == 12, model.dof_components + 3, model.dof_components)
    )
    with pytest.raises(InputError, match="the model has rotations"):
        turned.in_mesh("shapes")
