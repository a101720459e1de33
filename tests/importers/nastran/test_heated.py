"""Expansion, temperatures and displacements of bulk data: kept as load steps by the numbers of their sets."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.bulk import MATERIAL, lines_of, write

import slipstick as ss
from slipstick.fem.box import box
from slipstick.fem.expansion import temperature_field
from slipstick.fem.load_steps import StepLoad
from slipstick.importers.import_model import read_model

E, ALPHA, L, AREA, KN = 2.1e5, 1.2e-5, 4.0, 1.0, 3e5
MESH = box((L, 1.0, 1.0), (4, 1, 1), "hex20")
ROOT = (MESH.surface("x0").nodes + 1).tolist()
TIP = [n + 1 for n in MESH.surface("x1").nodes]
HELD = "".join(f"SPC1,1,123,{n}\n" for n in ROOT)
HOT = MATERIAL.replace("MAT1,3,2.1+5,,.3,7.8-9", "MAT1,3,2.1+5,,0.,7.8-9,1.2-5,20.")
HEAT = "TEMPD,5,120.,6,20.\nTEMP,5,1,150.,2,151.\nTEMP,5,3,152.\nTEMPD,7,70.\n"


def read(folder, more: str = "", head: str = "SOL 101\nCEND\nSPC = 1\n"):
    return read_model(write(folder, lines_of(MESH).replace(MATERIAL, HOT) + HELD + more, head), quiet=True)


def test_temperatures_by_set(tmp_path):
    model = read(tmp_path, HEAT)
    (solid,) = model.materials.values()
    assert (solid.expansion, solid.reference) == (1.2e-5, 20.0)
    assert [*model.load_steps] == ["TEMP 5", "TEMP 6", "TEMP 7"]
    field = temperature_field(model.mesh, "TEMP 5", steps=model.load_steps)
    np.testing.assert_array_equal(field[:4], [150.0, 151.0, 152.0, 120.0])
    np.testing.assert_array_equal(temperature_field(model.mesh, "TEMP 7", steps=model.load_steps), 70.0)


def test_the_initial_set_of_the_case_control(tmp_path):
    model = read(tmp_path, HEAT, "SOL 101\nCEND\nSPC = 1\nTEMPERATURE(INITIAL) = 7\nTEMPERATURE(LOAD) = 5\n")
    assert [*model.load_steps] == ["TEMP 5", "TEMP 6", "INITIAL"]
    keep = [f"n{TIP[0]}x"]
    body = ss.reduced_body(model, keep=keep, modes=3, temperature={"hot": "TEMP 6"})
    assert body.structure.shapes["temperature hot"].static_response[0] == pytest.approx(-ALPHA * 50.0 * L, rel=1e-3)


@pytest.mark.parametrize("how", ["SPC", "SPCD"])
def test_a_prescribed_displacement_moves_the_body(tmp_path, how):
    rows = "".join(f"{how},{9 if how == 'SPCD' else 1},{n},1,.01\n" for n in ROOT)
    model = read(tmp_path, rows)
    name = "SPCD 9" if how == "SPCD" else "SPC 1"
    assert model.load_steps[name].loads[0] == StepLoad(
        kind="displacement", where=str(ROOT[0]), value=0.01, axis=1, replaces=True
    )
    body = ss.reduced_body(model, keep=[f"n{TIP[0]}x"], modes=3, displacement={"push": name})
    assert body.structure.shapes["displacement push"].static_response[0] == pytest.approx(0.01, rel=1e-9)


def test_a_displacement_that_no_support_holds_is_a_fault(tmp_path):
    model = read(tmp_path, f"SPCD,9,{TIP[0]},1,.01\n")
    with pytest.raises(ss.InputError, match="1 of the dofs that move are not held"):
        ss.reduced_body(model, keep=[f"n{TIP[1]}x"], modes=3, displacement={"push": "SPCD 9"})


MATT1 = "MATT1,3,11,,,,12\n"
TABLES = "TABLEM1,11,,,,,,,,\n,0.,2.+5,100.,1.5+5,200.,1.+5,ENDT\nTABLEM1,12\n,0.,1.-5,200.,2.-5,ENDT\n"


def test_tables_over_temperature(tmp_path):
    model = read(tmp_path, HEAT + MATT1 + TABLES, "SOL 101\nCEND\nSPC = 1\nTEMP(INIT) = 7\n")
    (solid,) = model.materials.values()
    assert solid.tables == {
        "young": ((0.0, 2e5), (100.0, 1.5e5), (200.0, 1e5)), "expansion": ((0.0, 1e-5), (200.0, 2e-5))
    }  # fmt: skip
    assert (solid.reference, solid.expansion) == (20.0, pytest.approx(1.1e-5))
    np.testing.assert_array_equal(model.mesh.temperature, 70.0)
    keep = [f"n{TIP[0]}x"]
    body = ss.reduced_body(model, keep=keep, modes=3, temperature={"cold": "TEMP 6"})
    wanted = -1.35e-5 * 50.0 * L
    assert body.structure.shapes["temperature cold"].static_response[0] == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize("card", ["MATT1,3,,,,11\n", "MATT1,3,99\n", "MATT1,3,,14\n"])
def test_tables_that_are_not_read_are_told(tmp_path, card):
    model = read(tmp_path, card + TABLES)
    assert any("MATT1 lets a material depend on temperature otherwise" in warning for warning in model.warnings)
    assert not next(iter(model.materials.values())).tables
