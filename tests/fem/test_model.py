"""Constrained models: what is taken out, what comes back, and sentences for what cannot be."""

import numpy as np
import pytest

from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.assembly import assemble
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import elastic_model

SOLID = Material(young=2.0, poisson=0.3, density=3.0)
MESH = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")


@pytest.mark.parametrize("fixed", ["x0", ["x0", "x1"], np.array([5, 3, 30])], ids=["side", "sides", "nodes"])
def test_matrices_are_those_of_the_whole_without_the_fixed_rows(fixed):
    model, whole = elastic_model(MESH, SOLID, fixed), assemble(MESH, SOLID)
    for part, full in ((model.K, whole.stiffness), (model.M, whole.mass)):
        np.testing.assert_array_equal(part.toarray(), full.toarray()[np.ix_(model.free, model.free)])
    assert len(model.dofs) == len(model.free) == model.K.shape[0]
    held = fixed if isinstance(fixed, np.ndarray) else np.concatenate([MESH.node_set(n) for n in np.atleast_1d(fixed)])
    assert not np.isin(model.free // 3, held).any()


def test_forces_go_to_what_is_free():
    model = elastic_model(MESH, SOLID, "x0")
    full = np.random.default_rng(0).normal(size=(3 * MESH.n_nodes, 2))
    np.testing.assert_array_equal(model.restrict(full), full[model.free])
    tip = MESH.node_set("x1")
    np.testing.assert_array_equal(model.free[model.indices(tip)], 3 * tip[:, None] + np.arange(3))
    with pytest.raises(InputError, match="is fixed; it can carry no contact"):
        model.indices(MESH.node_set("x0"))


def test_nodes_without_elements_do_not_move():
    loose = Mesh(nodes=np.vstack([MESH.nodes, [[9.0, 9.0, 9.0]]]), blocks=MESH.blocks)
    nodes = MESH.node_set("x0")
    assert elastic_model(loose, SOLID, nodes).dofs == elastic_model(MESH, SOLID, nodes).dofs


@pytest.mark.parametrize(
    ("fixed", "material", "said"),
    [
        ([], SOLID, "no node is fixed"),
        (np.arange(MESH.n_nodes), SOLID, "every node is fixed"),
        ("root", SOLID, "node set 'root' is not in the mesh"),
        ("x0", Material(young=1.0, poisson=0.3), "give every material a density > 0"),
    ],
)
def test_models_that_cannot_be(fixed, material, said):
    with pytest.raises(InputError, match=said):
        elastic_model(MESH, material, fixed)


def test_linear_tetrahedra_are_warned_of():
    with pytest.warns(SlipstickWarning, match="far too stiff in bending"):
        elastic_model(box((2.0, 1.0, 1.0), (2, 1, 1), "tet4"), SOLID, "x0")
