"""What is read from a cache is what was computed: to the last bit, and with the same warnings."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slipstick as ss
from slipstick.errors import SlipstickWarning
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.models.blade_mesh import BladeShape
from slipstick.models.parametric_sector import SectorShape

BLADE = BladeShape(element_size=0.012)
FEW = "slipstick.structure.reduction.compute.MOST_BY_DEFAULT"


def blade(**options: Any) -> Any:
    return ss.reduced_blade(BLADE, contacts=2, stress="root", **options)


def body(**options: Any) -> Any:
    mesh = MeshModel(mesh=box((0.2, 0.02, 0.01), (4, 2, 1), "hex20"))
    model = assemble_mesh(
        mesh, source="beam", material=ss.Material(young=2e11, poisson=0.3, density=7800.0), fixed=["x0"]
    )
    return ss.reduced_body(model, surface="y1", contacts=2, pressure={"gas": "z1"}, stress="all", **options)


def solved(**options: Any) -> Any:
    return body(residuals="solved", **options)


def disc(**options: Any) -> Any:
    shape = SectorShape(
        sectors=6, element_size=0.03, bore=0.04, rim=0.08, tip=0.14, thickness=0.2, stagger=3.0, twist=5.0
    )  # fmt: skip
    sector = ss.reduced_sector(ss.models.bladed_sector(shape), surface="tip", contacts=1, **options)
    sector.mistuned()
    return sector


@pytest.mark.parametrize("make", [blade, body, solved, disc])
def test_warnings_are_told_again(make: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FEW, 3)
    said = []
    for _ in range(2):
        with pytest.warns(SlipstickWarning, match="the receptance of the reduced structure") as told:
            made = make(cache=tmp_path)
        said.append([str(warning.message) for warning in told])
    assert made.solver == "" if make is disc else made.reused
    assert said[0] == said[1]


@pytest.mark.parametrize("make", [blade, body, solved])
def test_what_is_seen_comes_back_to_the_last_bit(make: Callable[..., Any], tmp_path: Path) -> None:
    made, again = (make(cache=tmp_path, modes=6).structure for _ in range(2))
    for first, second in ((made.skin, again.skin), (made.strains, again.strains)):
        for name in ("modes", "static", "second"):
            if getattr(first, name, None) is not None:
                np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
        for name in ("loads", "second_loads"):
            for load, column in getattr(first, name, {}).items():
                np.testing.assert_array_equal(column, getattr(second, name)[load])
    np.testing.assert_array_equal(made.omega, again.omega)
    np.testing.assert_array_equal(made.mode_shapes, again.mode_shapes)
