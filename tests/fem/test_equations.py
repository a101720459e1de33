"""Equations between dofs of nodes, in an imported model: matrices, names, what is kept of dependent dofs."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.imported import spd
from scipy.sparse import csr_array

from slipstick.errors import InputError
from slipstick.fem.equations import NodalEquation, directions_in, names_dofs, rows_named
from slipstick.fem.model import ImportedModel
from slipstick.io.model_file import load_model, save_model
from slipstick.models.reduced_body import reduced_body

TIE = NodalEquation(terms=((10, 0, 1.0), (11, 1, -0.5), (11, 2, -0.25)), where="a tie")


def model(seed: int = 0) -> ImportedModel:
    """Nodes 10 and 11 with three directions each."""
    labels = np.repeat([10, 11], 3)
    return ImportedModel(
        K=csr_array(spd(6, seed)), M=csr_array(spd(6, seed + 1)), dof_nodes=labels, dof_components=np.tile([0, 1, 2], 2)
    )


def test_matrices_of_the_independent_dofs():
    whole, tied = model(), model().constrain([TIE])
    T = np.array([[0, 0, 0, 0.5, 0.25], *np.eye(5).tolist()])
    assert tied.dofs == ("n10y", "n10z", "n11x", "n11y", "n11z")
    assert tied.dependent_dofs == ("n10x",)
    np.testing.assert_allclose(tied.K.toarray(), T.T @ whole.K.toarray() @ T)
    np.testing.assert_allclose(tied.M.toarray(), T.T @ whole.M.toarray() @ T)


def test_a_dependent_dof_has_a_direction_and_no_row():
    tied = model().constrain([TIE])
    columns = tied.directions(["n10x", "n11z"]).toarray()
    np.testing.assert_array_equal(columns.T, [[0, 0, 0, 0.5, 0.25], [0, 0, 0, 0, 1]])
    with pytest.raises(InputError, match="dof 'n10x' depends on others by an equation"):
        tied.index("n10x")


def test_one_after_the_other_is_both_at_once():
    more = NodalEquation(terms=((11, 1, 1.0), (10, 2, -2.0)), where="another")
    at_once, in_turn = model().constrain([TIE, more]), model().constrain([TIE]).constrain([more])
    assert at_once.dofs == in_turn.dofs
    assert set(at_once.dependent_dofs) == set(in_turn.dependent_dofs) == {"n10x", "n11y"}
    np.testing.assert_allclose(at_once.K.toarray(), in_turn.K.toarray())
    np.testing.assert_allclose(at_once.directions(["n10x"]).toarray(), in_turn.directions(["n10x"]).toarray())


def test_fixing_nodes_holds_dependent_dofs_too():
    """Held node 10: its x is 0, so 0.5 y + 0.25 z of node 11 is 0."""
    held = model().constrain([TIE]).fix(np.array([10]))
    assert held.dofs == ("n11x", "n11z")
    np.testing.assert_allclose(held.directions(["n11y"]).toarray().T, [[0.0, -0.5]])
    with pytest.raises(InputError, match="dof 'n10x' is constrained"):
        held.index("n10x")


def test_a_reduction_keeps_dependent_dofs():
    """Receptance at the dependent dof of a reduction with all modes, against the matrices."""
    tied = model().constrain([TIE])
    body = reduced_body(tied, keep=["n10x", "n11z"], modes=5)
    B = tied.directions(["n10x", "n11z"]).toarray()
    omega = 0.3
    exact = B.T @ np.linalg.solve(tied.K.toarray() - omega**2 * tied.M.toarray(), B)
    ours = body.structure.project(np.eye(2), np.eye(2)).at([1], omega)[0][0]
    np.testing.assert_allclose(ours.real, exact, rtol=1e-9)


def test_a_model_file_keeps_dependent_dofs(tmp_path):
    tied = model().constrain([TIE])
    again = load_model(save_model(tied, tmp_path / "m.h5"))
    assert again.dependent_dofs == tied.dependent_dofs
    np.testing.assert_array_equal(again.directions(["n10x"]).toarray(), tied.directions(["n10x"]).toarray())


def test_moving_as_a_whole():
    alike = NodalEquation(terms=((10, 0, 1.0), (11, 0, -1.0)))
    np.testing.assert_array_equal(model().constrain([alike]).translation("x"), [0, 0, 1, 0, 0])
    with raises_fault("base", says="the model cannot move along x as a whole: n10x depends"):
        model().constrain([TIE]).translation("x")


def test_rows_that_only_equations_name_come_into_being():
    """A rotation of a reference node: no stiffness of its own, and what hangs on it."""
    arm = NodalEquation(terms=((10, 0, 1.0), (7, 5, -3.0)))
    tied = model().constrain([arm])
    assert "n7rz" in tied.dofs
    assert tied.K.toarray()[tied.index("n7rz"), tied.index("n7rz")] == pytest.approx(9.0 * model().K.toarray()[0, 0])


NODES, COMPONENTS = np.array([3, 3, 12, 12]), np.array([0, 4, 0, 6])


def test_names():
    assert directions_in("xyz") == {"x", "y", "z"}
    assert directions_in("x, ry") == {"x", "ry"}
    assert [names_dofs(name) for name in ("n12", "n12s", "n12xx", "N12", "12")] == [True, True, False, False, False]
    assert rows_named("n12", NODES, COMPONENTS).tolist() == [False, False, True, True]
    assert rows_named("n3ry", NODES, COMPONENTS).tolist() == [False, True, False, False]
    assert not rows_named("n3z", NODES, COMPONENTS).any()
