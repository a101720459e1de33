"""Bodies with contacts on a surface, our own and imported ones."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.faults import raises_fault

from slipstick.errors import InputError
from slipstick.fem.assembly import assemble, conduction
from slipstick.fem.boundary import surface_towards
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.model import ImportedModel, elastic_model
from slipstick.fem.retained import retain
from slipstick.solve.linear.factorisation import factorise

METAL = Material(young=1.0, poisson=0.3, density=1.0, conductivity=2.0)


def test_what_is_kept_of_a_block():
    mesh = box((1.0, 1.0, 0.5), (4, 4, 2), "hex20")
    body = retain(
        elastic_model(mesh, METAL, "z0"), surface="z1", contacts=4, pressure={"push": "x0"}, films={"x1": 3.0}
    )
    assert body.points.names == ("c1", "c2", "c3", "c4")
    assert body.points.dofs[:4] == ("c1x", "c1y", "c1z", "c2x")
    assert body.directions.shape == (len(body.model.free), 12)
    rigid = np.tile([1.0, 2.0, 3.0], mesh.n_nodes)[body.model.free]
    np.testing.assert_allclose(body.directions.T @ rigid, np.tile([1.0, 2.0, 3.0], 4), rtol=1e-12)
    assert body.loads["push"].reshape(-1, 3).sum(axis=0)[0] == pytest.approx(0.5, rel=0.2)  # the fixed edge takes some
    assert body.points.influence.shape == (4, 4)
    assert retain(elastic_model(mesh, METAL, "z0"), surface="z1", contacts=2).points.influence is None
    with pytest.raises(InputError, match="no material has a conductivity"):
        retain(elastic_model(mesh, replace(METAL, conductivity=0.0), "z0"), surface="z1", films={"x1": 3.0})
    with pytest.raises(InputError, match="surface 'top' is not in the mesh"):
        retain(elastic_model(mesh, METAL, "z0"), surface="top")


def imported_block(mesh):
    """A block as if it came from another code: shuffled rows, labels of its own."""
    mesh = replace(mesh, node_labels=np.arange(mesh.n_nodes)[::-1] * 7 + 3)
    model = elastic_model(mesh, METAL, "z0")
    order = np.random.default_rng(1).permutation(len(model.free))
    return model, ImportedModel(
        K=model.K[order][:, order],
        M=model.M[order][:, order],
        dof_nodes=mesh.labels[model.free[order] // 3],
        dof_components=model.free[order] % 3,
        mesh=mesh,
        materials={"all": METAL},
        source="block.full",
    )


def test_contacts_on_an_imported_model():
    mesh = box((1.0, 1.0, 0.5), (3, 3, 2), "hex20")
    model, imported = imported_block(mesh)
    options = {"surface": "z1", "contacts": 2, "films": {"boundary": 1.0}, "pressure": {"push": "z1"}}
    ours, theirs = retain(model, **options), retain(imported, **options)
    compliance = [
        np.asarray(body.directions.T @ factorise(body.model.K).solve(body.directions.toarray()))
        for body in (ours, theirs)
    ]
    np.testing.assert_allclose(compliance[1], compliance[0], rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(theirs.points.influence, ours.points.influence, rtol=1e-12)
    assert theirs.loads["push"].sum() == pytest.approx(ours.loads["push"].sum())
    with pytest.raises(InputError, match="need the mesh"):
        replace(imported, mesh=None).in_mesh("contacts on a surface")
    with pytest.raises(InputError, match="is not in the mesh"):
        replace(imported, mesh=replace(imported.mesh, node_labels=imported.mesh.labels + 1)).in_mesh("contacts")
    bare = replace(imported, materials={})
    with pytest.raises(InputError, match="no material has a conductivity"):
        retain(bare, **options)


def test_conduction_alone_and_faces_towards():
    mesh = box((1.0, 1.0, 0.5), (3, 3, 2), "wedge15")
    np.testing.assert_allclose(
        conduction(mesh, {"all": METAL}).toarray(), assemble(mesh, METAL).conduction.toarray(), atol=1e-13
    )
    tip = surface_towards(mesh, [0.1, 0.0, 1.0], depth=0.2)
    assert set(tip.nodes) == set(mesh.surface("z1").nodes)
    with pytest.raises(InputError, match="no boundary face looks"):
        surface_towards(mesh, [1.0, 1.0, 1.0])
    with raises_fault("direction", found="[0.0, 0.0, 0.0]"):
        surface_towards(mesh, [0.0, 0.0, 0.0])
