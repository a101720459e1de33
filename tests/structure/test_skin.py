"""A skin belongs to its structure, and says what is wrong where it does not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy import sparse

import slipstick as ss
from slipstick.structure.modal import LoadShape
from slipstick.structure.skin import Skin


def arrays(**others: Any) -> dict[str, Any]:
    return {"nodes": np.eye(3), "triangles": [[0, 1, 2]], "modes": np.ones((9, 2)), "static": np.ones((9, 1))} | others


def test_shapes_and_places_are_checked() -> None:
    skin = Skin(**arrays(loads={"p": np.ones(9)}))
    basis = skin.basis()
    assert basis.shape == (9, 4)
    np.testing.assert_allclose(basis.T @ basis, np.eye(4), atol=1e-12)
    for wrong, sentence in (
        ({"nodes": np.ones((3, 2))}, r"skin, nodes: found shape \(3, 2\); expected \(3, 3\)"),
        ({"triangles": [[0, 1, 3]]}, "skin, triangles: found nodes 0 to 3 of 3"),
        ({"triangles": [[0, -1, 2]]}, "skin, triangles: found nodes -1 to 2 of 3"),
        ({"modes": np.ones((8, 2))}, r"skin, modes: found shape \(8, 2\); expected \(9, 2\)"),
        ({"static": np.full((9, 1), np.nan)}, "skin, static: some entries are not finite"),
        ({"loads": {"p": np.ones(3)}}, "skin, loads, p: found shape"),
        ({"nodes": "a"}, "skin, nodes: found 'a'; expected real numbers"),
        ({"static": None}, "skin, static is missing; give static, or rows of a full model"),
        ({"static": None, "rows": np.ones((5, 9))}, "skin, rows: found ndarray"),
        ({"static": None, "rows": sparse.eye_array(8)}, r"skin, rows: found shape \(8, 8\)"),
        ({"places": np.ones((1, 2))}, r"skin, places: found float64 of shape \(1, 2\)"),
        ({"places": [["a", "b", "c"]]}, "skin, places: found <U1"),
    ):
        with pytest.raises(ss.InputError, match=sentence):
            Skin(**arrays(**wrong))


def test_a_skin_of_another_structure() -> None:
    modal: dict[str, Any] = {"omega": [1.0, 2.0], "mode_shapes": [[1.0, 1.0]], "dofs": ["x"]}
    assert ss.ModalStructure(**modal, skin=Skin(**arrays())).changed(loss_factor=0.1).skin is not None
    with raises_fault("skin", found="modes and dofs (3, 1)", expected="(2, 1)"):
        ss.ModalStructure(**modal, skin=Skin(**arrays(modes=np.ones((9, 3)))))
    with raises_fault("skin", found="3", expected="a structure.skin.Skin, or None"):
        ss.ModalStructure(**modal, skin=3)
    with raises_fault("skin", "places", found="shape (2, 3)", expected="(1, 3)"):
        ss.ModalStructure(**modal, skin=Skin(**arrays(places=np.ones((2, 3)))))
    with raises_fault("skin", "rows", found="5 dofs", expected="static responses"):
        ss.ModalStructure(**modal, skin=Skin(**arrays(static=None, rows=sparse.eye_array(5, 9))))


def test_what_an_equal_skin_is_made_from() -> None:
    """Without what is not there."""
    assert set(Skin(**arrays()).arguments) == {"nodes", "triangles", "modes", "static", "loads"}
    solved = Skin(**arrays(static=None, rows=sparse.eye_array(5, 9, format="csr"), places=[[np.nan, 0, 1]]))
    again = Skin(**solved.arguments)
    assert again.static is None
    np.testing.assert_array_equal(again.places, [[np.nan, 0, 1]])
    part = solved.part(np.array([2, 0]), np.zeros((0, 3), dtype=int))
    np.testing.assert_array_equal(part.nodes, np.eye(3)[[2, 0]])
    assert part.rows.toarray().tolist() == solved.rows.toarray()[:, [6, 7, 8, 0, 1, 2]].tolist()


def test_a_node_that_is_a_dof_moves_as_the_dof() -> None:
    """One node whose x is the dof "a" itself and whose y is that of "b"; z stands still."""
    modes, static = np.array([[1.0, 0.5], [0.3, -0.8]]), np.array([[0.05, 0.01], [0.01, 0.06]])
    push = LoadShape(participation=[2.0, 1.0], static_response=[0.09, 0.02])
    rows = np.eye(3, 2)
    skin = Skin(
        nodes=np.zeros((1, 3)), triangles=np.zeros((0, 3)), modes=rows @ modes, static=rows @ static,
        loads={"push": rows @ [0.09, 0.02]},
    )  # fmt: skip
    structure = ss.ModalStructure(
        omega=[5.0, 9.0], mode_shapes=modes, dofs=["a", "b"], static_compliance=static, loss_factor=0.02,
        load_shapes={"push": push}, skin=skin,
    )  # fmt: skip
    columns = np.array([[1.0], [-1.0]])
    own = structure.project(np.eye(2), columns, ["push"])
    seen = skin.along(np.eye(3), structure).project(np.zeros((2, 0)), columns, ["push"])
    np.testing.assert_allclose(seen.static[:2], own.static, rtol=1e-6)
    value, slope = seen.at([1, 3], 4.0)
    for found, expected in zip((value, slope), own.at([1, 3], 4.0), strict=True):
        np.testing.assert_allclose(found[:, :2], expected, rtol=1e-6)
        assert not found[:, 2].any()
