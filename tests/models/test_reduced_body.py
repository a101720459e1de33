"""A body reduced to points and dofs: its receptance against the full model, and what cannot be asked."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh

STEEL = ss.Material(young=2e11, poisson=0.3, density=7800.0, conductivity=40.0)


@pytest.fixture(scope="module")
def model():
    mesh = MeshModel(mesh=box((0.2, 0.02, 0.01), (4, 2, 1), "hex20"))
    return assemble_mesh(mesh, source="beam", material=STEEL, fixed=["x0"])


@pytest.fixture(scope="module")
def body(model):
    return ss.reduced_body(
        model, surface="y1", contacts=2, pressure={"gas": "z1"}, films={"boundary": 50.0}, modes=20, loss_factor=0.01
    )


def test_receptance_between_points_is_that_of_the_full_model(body):
    first = body.structure.omega[0]
    errors = dict(body.receptance_errors([0.5 * first, 1.3 * first]))
    assert len(errors) == 2
    assert max(errors.values()) < 1e-5
    assert body.modes_below(1.01 * first) == 1
    assert body.n_dofs == body.full().K.shape[0]


def test_points_and_load_shapes(body, model):
    assert body.points.count == 2
    assert body.structure.dofs == body.points.dofs
    assert body.points.areas.sum() == pytest.approx(0.2 * 0.01)
    np.testing.assert_allclose(body.points.normals, [[0.0, 1.0, 0.0]] * 2, atol=1e-12)
    assert set(body.structure.load_shapes) == {"gas"}
    R = body.points.influence
    np.testing.assert_allclose(R, R.T)
    assert np.linalg.eigvalsh(R).min() > 0


def test_named_dofs_are_kept_without_a_surface(model):
    name = model.dofs[-1]
    kept = ss.reduced_body(model, keep=name, modes=5)
    assert kept.structure.dofs == (name,)
    assert kept.points is None
    row = model.index(name)
    static = np.linalg.inv(model.K.toarray())[row, row]
    assert kept.structure.project(np.eye(1), np.eye(1), ()).static[0, 0] == pytest.approx(static, rel=1e-8)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({}, "surface: nothing is kept"),
        ({"surface": "y9"}, "there is no surface 'y9' in the model; there are x0"),
        ({"keep": ["n1q"]}, "keep: there is no free dof 'n1q'"),
        ({"surface": "y1", "modes": 3, "accuracy": 0.1, "up_to": 5.0}, "both modes and accuracy are given"),
        ({"surface": "y1", "accuracy": 0.1}, "accuracy is given without up_to"),
        ({"surface": "y1", "modes": 3, "up_to": 5.0}, "both modes and up_to are given"),
        ({"surface": "y1", "films": {"q": 1.0}}, "films: there is no surface 'q'"),
        ({"surface": "y1", "cold": "q"}, "cold: there is no node set 'q'"),
        ({"keep": ["n50x"], "films": {"y1": 1.0}}, "films is given without surface"),
        ({"surface": "y1", "contacts": [[0.0, 1.0]]}, "contacts"),
        ({"surface": {"direct": (0, 1, 0)}}, "expected a name, or direction"),
        ({"surface": "y1", "base": "w"}, "base"),
        ({"surface": "y1", "loss_factor": -1.0}, "loss_factor"),
    ],
)
def test_what_cannot_be_asked(model, options, said):
    with pytest.raises(InputError, match=said):
        ss.reduced_body(model, **options)


@pytest.mark.parametrize("contacts", [np.zeros((2, 2)), np.zeros((2, 3, 1)), np.zeros((0, 3)), [], [1.5]])
def test_contacts_that_are_neither_labels_nor_positions(model, contacts):
    with pytest.raises(InputError, match="contacts"):
        ss.reduced_body(model, surface="y1", contacts=contacts, modes=5)


def test_contacts_by_label_and_by_position_are_the_same(model):
    mesh = model.mesh
    surface = mesh.surface("y1").nodes[[0, 5, 9]]
    by_label = ss.reduced_body(model, surface="y1", contacts=mesh.labels[surface].tolist(), modes=5)
    by_place = ss.reduced_body(model, surface="y1", contacts=mesh.nodes[surface], modes=5)
    np.testing.assert_allclose(by_label.points.positions, mesh.nodes[surface], atol=1e-12)
    np.testing.assert_allclose(by_place.points.positions, by_label.points.positions, atol=1e-12)
