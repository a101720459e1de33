"""Expansion, temperatures and displacements of archives: kept as a load step, told where they are not."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.ansys import STACK, archive_text

import slipstick as ss
from slipstick.fem.expansion import temperature_field
from slipstick.fem.load_steps import StepLoad
from slipstick.importers.ansys.archive import read_materials
from slipstick.importers.findings import Findings
from slipstick.importers.import_model import read_model

pytest.importorskip("mapdl_archive")
BRICK = archive_text([list(range(1, 9))], 185, STACK[:8])


def read(tmp_path, more: str, quiet: bool = True):
    path = tmp_path / "m.cdb"
    path.write_text(BRICK + more)
    return read_model(path, quiet=quiet)


HEAT = "MP,ALPX,1,1.2E-05\nMP,REFT,1,15.\nTREF,20.\nBF,      3,TEMP, 80.\nBF,4,TEMP,90.\n"


def test_temperatures_are_kept_as_the_first_step(tmp_path):
    model = read(tmp_path, HEAT)
    (solid,) = model.materials.values()
    assert (solid.expansion, solid.reference) == (1.2e-5, 15.0)
    assert model.load_steps["STEP-1"].loads == (
        StepLoad(kind="temperature", where="", value=20.0),
        StepLoad(kind="temperature", where="3", value=80.0),
        StepLoad(kind="temperature", where="4", value=90.0),
    )
    field = temperature_field(model.mesh, "STEP-1", steps=model.load_steps)
    np.testing.assert_array_equal(field, [20.0, 20.0, 80.0, 90.0, 20.0, 20.0, 20.0, 20.0])
    assert any('temperature={"hot": "STEP-1"}' in note for note in model.notes)


def test_a_uniform_temperature_and_the_reference_of_all(tmp_path):
    model = read(tmp_path, "MP,ALPX,1,1.2E-05\nTREF,20.\nBFUNIF,TEMP,120.\n")
    (solid,) = model.materials.values()
    assert solid.reference == 20.0
    np.testing.assert_array_equal(temperature_field(model.mesh, "STEP-1", steps=model.load_steps), 120.0)


def test_a_displacement_is_kept_and_its_dof_is_held(tmp_path):
    model = read(tmp_path, "D,1,UZ,0.\nD,      5,UX  , 0.1, 0.0\nD,3,ALL,0.\n")
    assert "n5x" not in model.dofs
    assert model.load_steps["STEP-1"].loads == (StepLoad(kind="displacement", where="5", value=0.1, axis=1),)
    body = ss.reduced_body(model, keep=["n6x"], modes=1, displacement={"pull": "STEP-1"})
    assert body.structure.shapes["displacement pull"].static_response[0] > 0.0


TEMPERATURES = "MPTEMP,R5.0, 1, 1,  20.,\nMPTEMP,R5.0, 1, 2,  600.,\n"


def test_tables_over_temperature(tmp_path):
    text = (
        f"{TEMPERATURES}MPDATA,R5.0, 1,EX  ,       1, 1, 2.0E+11,\nMPDATA,R5.0, 1,EX  ,       1, 2, 1.5E+11,\n"
        f"{TEMPERATURES}MPDATA,R5.0, 2,ALPX,       1, 1, 1.0E-05, 2.0E-05\nMP,PRXY,1,0.3\nMP,DENS,1,7800\n"
    )
    found = read_materials(Findings(source="a.cdb"), text)
    assert found.faults == {1: []}
    assert found.materials[1] == ss.Material(
        young=[(20.0, 2e11), (600.0, 1.5e11)], poisson=0.3, density=7800.0, expansion=[(20.0, 1e-5), (600.0, 2e-5)],
        reference=0.0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("MP,ALPX,1,1E-5\nMP,ALPY,1,2E-5\n", "ALPX of material 1 is not the same along every axis and is not read"),
        ("MP,CTEX,1,1E-5\n", "CTEX of material 1 is not read: give the secant coefficient ALPX"),
        ("BF,ALL,TEMP,80.\n", "BF gives temperatures by a table or a name: not kept"),
        ("BF,3,TEMP,%HOT%\n", "BF gives temperatures by a table or a name: not kept"),
        ("BFE,1,TEMP,1,80.\n", "BFBLOCK or BFE gives body loads that are not kept, as temperatures"),
        ("MPDATA,R5.0,1,ALPX,1,1,1E-5,2E-5\n", "ALPX of material 1 has no temperatures: it is not read"),
    ],
)
def test_what_is_not_kept_is_told(tmp_path, more, said):
    model = read(tmp_path, more)
    assert any(said in warning for warning in model.warnings)
    assert next(iter(model.materials.values())).expansion is None
    assert not model.load_steps
