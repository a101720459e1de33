"""A skin belongs to its structure, and says what is wrong where it does not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import slipstick as ss
from slipstick.structure.skin import Skin


def arrays(**others: Any) -> dict[str, Any]:
    return {"nodes": np.eye(3), "triangles": [[0, 1, 2]], "modes": np.ones((9, 2)), "static": np.ones((9, 1))} | others


def test_shapes_and_places_are_checked() -> None:
    skin = Skin(**arrays(loads={"p": np.ones(9)}))
    assert skin.basis.shape == (9, 4)
    np.testing.assert_allclose(skin.basis.T @ skin.basis, np.eye(4), atol=1e-12)
    for wrong, sentence in (
        ({"nodes": np.ones((3, 2))}, r"skin, nodes: found shape \(3, 2\); expected \(3, 3\)"),
        ({"triangles": [[0, 1, 3]]}, "skin, triangles: found nodes 0 to 3 of 3"),
        ({"triangles": [[0, -1, 2]]}, "skin, triangles: found nodes -1 to 2 of 3"),
        ({"modes": np.ones((8, 2))}, r"skin, modes: found shape \(8, 2\); expected \(9, 2\)"),
        ({"static": np.full((9, 1), np.nan)}, "skin, static: some entries are not finite"),
        ({"loads": {"p": np.ones(3)}}, "skin, loads, p: found shape"),
        ({"nodes": "a"}, "skin, nodes: found 'a'; expected real numbers"),
    ):
        with pytest.raises(ss.InputError, match=sentence):
            Skin(**arrays(**wrong))


def test_a_skin_of_another_structure() -> None:
    modal: dict[str, Any] = {"omega": [1.0, 2.0], "mode_shapes": [[1.0, 1.0]], "dofs": ["x"]}
    assert ss.ModalStructure(**modal, skin=Skin(**arrays())).changed(loss_factor=0.1).skin is not None
    with pytest.raises(ss.InputError, match=r"skin: found modes and dofs \(3, 1\); expected \(2, 1\)"):
        ss.ModalStructure(**modal, skin=Skin(**arrays(modes=np.ones((9, 3)))))
    with pytest.raises(ss.InputError, match=r"skin: found 3; expected a structure\.skin\.Skin"):
        ss.ModalStructure(**modal, skin=3)
