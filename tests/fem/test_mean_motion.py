"""The mean motion of a surface or node set as a degree of freedom."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.counting import calls_of
from scipy.sparse.linalg import spsolve

import slipstick as ss
from slipstick.errors import InputError
from slipstick.fem import model as fem_model
from slipstick.fem.box import box
from slipstick.fem.equations import NodalEquation
from slipstick.fem.mesh import together
from slipstick.fem.model import elastic_model

STEEL = ss.Material(young=2e11, poisson=0.3, density=7800.0)
SIZE = np.array([0.2, 0.03, 0.02])


def bar(kind="hex20", held=("x0",)):
    return elastic_model(box(SIZE, (4, 2, 2), kind), STEEL, list(held))


def field(model, of_places):
    """The motion (n,) of the rows that a function of the positions (n_nodes, 3) gives."""
    moved = of_places(model.positions(model.dof_nodes))
    return moved[np.arange(model.n_dofs), model.dof_components]


@pytest.mark.parametrize("kind", ["hex8", "hex20", "tet10"])
def test_the_mean_of_a_plane_field_is_its_value_at_the_middle(kind):
    model = bar(kind)
    gradient = np.array([[1.0, 2.0, -0.5], [0.3, 0.1, 4.0], [-2.0, 0.7, 0.2]])
    columns = model.directions(["x1 x", "x1 y", "x1 z"])
    middle = SIZE * [1.0, 0.5, 0.5]
    assert columns.T @ field(model, lambda p: p @ gradient.T) == pytest.approx(gradient @ middle, rel=1e-12)
    assert np.asarray(columns.sum(axis=0)) == pytest.approx(np.ones(3), rel=1e-12)
    assert model.dof_positions(["x1 y"])[0] == pytest.approx(middle, rel=1e-12)


def test_the_shares_of_a_surface_are_computed_once(monkeypatch):
    calls, model = calls_of(monkeypatch, fem_model, "shape_integrals"), bar()
    assert all(model.has_direction(f"x1 {axis}") for axis in "xyz")
    first = model.directions(["x1 x", "x1 y"])
    model.dof_positions(["x1 z"])
    assert (model.directions(["x1 x", "x1 y"]) != first).nnz == 0
    assert len(calls) == 1
    assert not model.has_direction("nowhere z")
    replace(model, notes=("another",)).directions(["x1 x"])
    assert len(calls) == 2


def test_the_mean_of_a_curved_field_is_that_over_the_area():
    model = bar("hex20")
    u = field(model, lambda p: np.stack([p[:, 1] ** 2, p[:, 1] * p[:, 2], p[:, 2] ** 2], axis=1))
    w, h = SIZE[1:]
    wanted = [w**2 / 3.0, w * h / 4.0, h**2 / 3.0]
    assert model.directions(["x1 x", "x1 y", "x1 z"]).T @ u == pytest.approx(wanted, rel=1e-12)


def test_a_node_set_counts_evenly_and_the_held_nodes_in_it_stand():
    model = bar()
    inside = np.flatnonzero(model.mesh.nodes[:, 1] == 0.0)
    labels = model.mesh.labels[inside]
    model = replace(model, node_sets={**model.node_sets, "edge": labels})
    u = np.random.default_rng(3).normal(size=model.n_dofs)
    wanted = sum(u[model.index(f"n{n}z")] for n in labels if f"n{n}z" in model.dofs) / len(labels)
    assert (model.directions(["edge z"]).T @ u).item() == pytest.approx(wanted, rel=1e-13)
    assert model.mesh.nodes[inside, 0].min() == 0.0
    bare = replace(model, mesh=None)
    assert (bare.directions(["edge z"]).T @ u).item() == pytest.approx(wanted, rel=1e-13)


def test_dependent_nodes_count_by_what_moves_them():
    model = bar()
    first, *others = model.mesh.labels[model.mesh.surface("x1").nodes].tolist()
    glued = model.constrain([NodalEquation(terms=((node, 1, 1.0), (first, 1, -1.0))) for node in others])
    (column,) = glued.directions(["x1 y"]).T.toarray()
    alone = np.zeros(glued.n_dofs)
    alone[glued.index(f"n{first}y")] = 1.0
    assert column == pytest.approx(alone, abs=1e-14)


def test_a_body_keeps_it_and_a_force_on_it_is_spread():
    model = bar()
    body = ss.reduced_body(model, keep=["x1 z", "x1 x"], modes=8)
    columns = model.directions(["x1 z", "x1 x"]).toarray()
    exact = columns.T @ spsolve(model.K.tocsc(), columns)
    static = body.structure.project(np.eye(2), np.eye(2)).static
    assert static == pytest.approx(exact, rel=1e-9, abs=1e-9 * exact.max())


def test_a_bolt_pulls_both_faces_by_their_means():
    low, high = box((0.02, 0.02, 0.01), (2, 2, 1)), box((0.02, 0.02, 0.01), (3, 3, 1), at=(0.0, 0.0, 0.01))
    model = elastic_model(together({"low": low, "high": high}), STEEL, ["low.x0", "high.x1"])
    law = ss.PlanarFrictionContact(kt=1e12, kn=1e13, mu=0.3, gap=0.0)
    joint = ss.surface_pair(model, "low.z1", "high.z0", contact=law)
    bolt = ss.bolt(name="bolt", elongation={"high.z1 z": 1.0, "low.z0 z": -1.0}, stiffness=1e8)
    body = ss.reduced_body(model, pairs=joint, keep=["high.z1 z", "low.z0 z"], modes=20)
    state = ss.preload(ss.Problem(body.structure, contacts=[*joint, bolt]), ss.LoadStep(bolts={"bolt": 1e3}))
    row = state.dataset.isel(step=-1).sel(joint="bolt")
    assert row.normal_resultant.item() == pytest.approx(1e3, rel=1e-9)
    # the corner where the two faces hold each other takes the rest
    assert 0.5e3 < state.dataset.isel(step=-1).sel(joint="joint").normal_resultant.item() <= 1e3


def test_what_is_not_there_is_named():
    model = bar()
    model = replace(model, node_sets={**model.node_sets, "TIP FACE": model.mesh.labels[-3:]})
    for name, said in (
        ("TIP FAC z", "there is no free dof 'TIP FAC z' in the model; did you mean 'TIP FACE'?"),
        ("tip z", "the mean of a surface or node set"),
        ("x0 z", "dof 'x0 z' is the mean of nodes that are all held"),
        ("x1 w", "names look like"),
    ):
        with pytest.raises(InputError) as error:
            ss.reduced_body(model, keep=[name], modes=4)
        assert said in str(error.value), str(error.value)
