"""Centrifugal states on disk: the same numbers, found by content, made again where the file is damaged."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.imported import STEEL

from slipstick.fem import rotation_store
from slipstick.fem.axis import Axis
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.rotation import centrifugal
from slipstick.importers.mesh_model import MeshModel, assemble_mesh


def test_states_are_kept_and_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = box((0.3, 0.03, 0.01), (2, 1, 1), "hex8")
    model = assemble_mesh(MeshModel(mesh=mesh), source="blade", material=STEEL, fixed=["x0"])
    made: list[float] = []

    def counted(*given):
        made.append(given[1])
        return centrifugal(*given)

    monkeypatch.setattr(rotation_store, "centrifugal", counted)
    first, second = (rotation_store.kept_centrifugal(model, 300.0, Axis(), tmp_path) for _ in range(2))
    assert made == [300.0]
    assert abs(first.stiffness - second.stiffness).max() == 0.0
    np.testing.assert_array_equal(first.displacement, second.displacement)
    assert (first.strain, first.mass) == (second.strain, second.mass)
    light = replace(model, materials={"all": Material(young=2e11, poisson=0.3, density=7000.0)})
    for other in ((model, 301.0, Axis()), (model, 300.0, Axis(point=(1, 0, 0))), (light, 300.0, Axis())):
        rotation_store.kept_centrifugal(*other, tmp_path)
    assert len(made) == 4
    assert len(list(tmp_path.iterdir())) == 4
    for path in tmp_path.iterdir():
        path.write_bytes(path.read_bytes()[:200])
    rotation_store.kept_centrifugal(model, 300.0, Axis(), tmp_path)
    assert len(made) == 5
    rotation_store.kept_centrifugal(model, 300.0, Axis(), None)
    assert len(made) == 6
