"""The recovered motion of the surface against the full finite element model under the same forces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.blocks import block, branch, pressed, pressed_plate, solved_whole, with_structure

import slipstick as ss
from slipstick.fem.boundary import skin_of
from slipstick.results.deflection import contact_nodes, contact_places, deflection_of, nearest_contacts
from slipstick.structure.reduction.reduce import reduce_model


def full_motion(made: ss.Branch, point: int) -> np.ndarray:
    """Coefficients (n_nodes, 3, L) of the skin nodes by direct solutions of the whole model."""
    nodes, _ = skin_of(block().model.mesh)
    return solved_whole(made, point)[nodes]


@pytest.mark.parametrize("parameter", [False, True])
def test_the_motion_is_that_of_the_full_model(parameter: bool) -> None:
    made = branch(parameter)
    found = deflection_of(made, small=1e-9)
    np.testing.assert_allclose(found.fields.T @ found.fields, np.eye(found.fields.shape[1]), atol=1e-10)
    for point in (0, len(made) // 2, len(made) - 1):
        exact = full_motion(made, point)
        np.testing.assert_allclose(found.at(point), exact, atol=2e-5 * np.abs(exact).max())


def test_few_fields_hold_nearly_all() -> None:
    made = branch()
    whole, few = deflection_of(made, small=1e-9), deflection_of(made, small=1e-3)
    assert few.fields.shape[1] < whole.fields.shape[1] <= 60
    size = max(np.abs(whole.at(p)).max() for p in range(len(made)))
    for point in range(0, len(made), 5):
        assert np.abs(few.at(point) - whole.at(point)).max() < 5e-3 * size


def test_it_is_stored_with_the_problem(tmp_path: pytest.TempPathFactory) -> None:
    made = branch()
    stored = ss.load(made.save(tmp_path / "r.nc"))
    np.testing.assert_allclose(deflection_of(stored).at(3), deflection_of(made).at(3), rtol=1e-12, atol=1e-15)


def test_structures_without_a_surface() -> None:
    from helpers.reports import branch as masses

    with pytest.raises(ss.InputError, match="has no surface to be seen"):
        deflection_of(masses())
    with pytest.raises(ss.InputError, match="the problem of this branch is not known"):
        deflection_of(ss.Branch.from_dataset(branch().dataset))


def test_what_is_solved_for_moves_as_what_is_written() -> None:
    """100 contacts, some slipping, some lifted off: every node of the surface, and whatever is left out."""
    written, solved = pressed("written"), pressed("solved")
    assert type(solved.problem.structure).__name__ == "SolvedModes"
    assert float(written.dataset.slip_fraction.max()) > 0.1
    assert float(written.dataset.separation_fraction.max()) > 0.5
    for small, close in ((1e-9, 1e-6), (1e-4, 1e-6), (1e-3, 1e-5)):
        one, other = (deflection_of(made, small=small) for made in (written, solved))
        size = max(np.abs(one.at(point)).max() for point in range(3))
        for point in range(3):
            np.testing.assert_allclose(other.at(point), one.at(point), rtol=0, atol=close * size)
    one, other = (deflection_of(made, small=1e-9, points=[2]) for made in (written, solved))
    np.testing.assert_allclose(other.at(0), one.at(0), rtol=0, atol=1e-6 * np.abs(one.at(0)).max())


def test_some_nodes_of_the_surface_alone() -> None:
    for made in (pressed("written"), pressed("solved")):
        whole = deflection_of(made, small=1e-9)
        kept = np.array([40, 3, 7])
        few = deflection_of(made, small=1e-9, coarse=(kept, np.array([[0, 2, 1]])))
        np.testing.assert_array_equal(few.skin.nodes, whole.skin.nodes[kept])
        np.testing.assert_allclose(few.at(1), whole.at(1)[kept], rtol=0, atol=1e-6 * np.abs(whole.at(1)).max())


@pytest.mark.parametrize("parameter", ["c1.mu", pytest.param("mode1.omega", marks=pytest.mark.verify)])
def test_what_is_solved_for_where_a_parameter_is_followed(parameter: str) -> None:
    """Also a natural frequency: what the modes leave out stays, and the last point is that of its own problem."""
    body, made = block(), branch(parameter=True)
    assert made.problem is not None
    if parameter == "mode1.omega":
        first = float(made.problem.structure.natural_frequencies[0])
        span, options = (first, 1.1 * first), {"max_points": 3, "max_step": 1.0}
        made = ss.parameter_response(made.problem, parameter, span, omega=0.9 * first, options=options)
    structure = reduce_model(
        body.model.K, body.model.M, modes=60, loss_factor=0.02, residuals="solved", **body.request
    ).structure
    solved = with_structure(made, structure)
    one, other = (deflection_of(each, small=1e-9) for each in (made, solved))
    for point in (0, len(made) - 1):
        np.testing.assert_allclose(other.at(point), one.at(point), rtol=0, atol=1e-6 * np.abs(one.at(point)).max())
    last = made.dataset.isel(point=[-1])
    for each, found in ((made, one), (solved, other)):
        alone = ss.Branch(last.drop_attrs().assign_attrs(title="last"), made.outcome, each.problem_at(-1))
        truth = deflection_of(alone, small=1e-9).at(0)
        np.testing.assert_allclose(found.at(len(made) - 1), truth, rtol=0, atol=1e-6 * np.abs(truth).max())


def test_what_is_solved_for_is_stored_with_the_problem(tmp_path: pytest.TempPathFactory) -> None:
    made = pressed("solved")
    stored = ss.load(made.save(tmp_path / "r.nc"))
    assert stored.problem.structure.skin.static is None
    np.testing.assert_allclose(deflection_of(stored).at(1), deflection_of(made).at(1), rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(contact_nodes(stored.problem), contact_nodes(made.problem))
    found, truth = stored.stress(1), pressed("written").stress(1)
    for name in ("stress", "strain"):
        np.testing.assert_allclose(found[name], truth[name], rtol=0, atol=1e-6 * float(np.abs(truth[name]).max()))


def test_contacts_lie_where_they_were_put() -> None:
    """All places, the nodes next to them, and what each node of the surface shows, by brute force."""
    problem = pressed("solved").problem
    skin, at = problem.structure.skin, pressed_plate().points.positions
    places = contact_places(problem)
    np.testing.assert_allclose(places, at, atol=1e-12)
    apart = np.linalg.norm(skin.nodes[:, None] - at, axis=2)
    nodes = contact_nodes(problem)
    np.testing.assert_allclose(apart[nodes, np.arange(100)], apart.min(axis=0), atol=1e-12)
    shown = nearest_contacts(skin, places)
    np.testing.assert_allclose(apart[shown >= 0, shown[shown >= 0]], apart[shown >= 0].min(axis=1), atol=1e-12)
    assert (shown[nodes] >= 0).all()


def test_contacts_of_earlier_results_are_where_the_surface_moves_alike() -> None:
    """A skin that knows no places."""
    problem = branch().problem
    assert problem is not None
    skin = problem.structure.skin
    structure = problem.structure.changed(loss_factor=0.02)
    structure.skin = replace(skin, places=None)
    unknown = replace(problem, structure=structure, told=None)
    found = contact_nodes(unknown)
    apart = np.linalg.norm(skin.nodes[:, None] - contact_places(problem), axis=2)
    np.testing.assert_allclose(apart[found, [0, 1]], apart.min(axis=0), rtol=1e-12)  # two nodes are as near
    np.testing.assert_array_equal(contact_places(unknown), skin.nodes[found])


def test_contacts_between_places_that_lie_apart_have_none() -> None:
    made = branch()
    pairs = [
        ss.ContactPair(name="near", contact=ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0), tangential="c1y"),
        ss.ContactPair(
            name="across", contact=ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0),
            tangential={"c1y": 1.0, "c2y": -1.0},
        ),
    ]  # fmt: skip
    problem = ss.Problem(made.problem.structure, contacts=pairs, harmonics=[0, 1])
    assert np.isfinite(contact_places(problem)).all(axis=1).tolist() == [True, False]
    assert (contact_nodes(problem) >= 0).tolist() == [True, False]
