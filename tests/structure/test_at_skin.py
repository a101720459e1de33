"""Receptance to the skin of a structure."""

from __future__ import annotations

import numpy as np

import slipstick as ss
from slipstick.structure.at_skin import AtSkin
from slipstick.structure.modal import LoadShape
from slipstick.structure.skin import Skin


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
    seen = AtSkin(structure, skin, np.eye(3)).project(np.zeros((2, 0)), columns, ["push"])
    np.testing.assert_allclose(seen.static[:2], own.static, rtol=1e-6)
    value, slope = seen.at([1, 3], 4.0)
    for found, expected in zip((value, slope), own.at([1, 3], 4.0), strict=True):
        np.testing.assert_allclose(found[:, :2], expected, rtol=1e-6)
        assert not found[:, 2].any()
