"""Loads of steps: kept as they are stated, by the names of their steps; they have no effect on the matrices."""

import pytest
from helpers.input_file import CUBE, HELD, write

from slipstick.errors import InputError
from slipstick.fem.load_steps import DIMENSIONS, LoadStep, StepLoad
from slipstick.importers.import_model import read_model
from slipstick.importers.roles import ImportOptions
from slipstick.io.model_file import load_model, save_model

BOLT = """*SURFACE, NAME=Cut, TYPE=ELEMENT
EALL, S1
*SURFACE, NAME=Top, TYPE=ELEMENT
EALL, S2
*NODE, NSET=PULL
77, 3., 3., 3.
*PRE-TENSION SECTION, SURFACE=Cut, NODE=77
"""
STEPS = """*INITIAL CONDITIONS, TYPE=TEMPERATURE
NALL, 20.
*STEP, NAME=Assembly, NLGEOM
*STATIC
*CLOAD
PULL, 1, 5000.
ROOT, 2, -3.,
*END STEP
*STEP
*STATIC
*BOUNDARY, OP=MOD, FIXED
77, 1, 1
*DSLOAD, AMPLITUDE=Ramp, OP=NEW
Top, P, 2.5
*DLOAD
EALL, P3, 1.5
EALL, GRAV, 9.81, 0., 0., -1.
EALL, CENTRIF, 1.e4, 0., 0., 0.5, 0., 0., 1.
EALL, BX, 4.
*TEMPERATURE
NALL, 80.
3, 90.
*END STEP
*STEP, PERTURBATION
*STATIC
*BOUNDARY
PULL, 1, 1, 0.01
ROOT, 3, 3, 0.02
*CLOAD
2, 4, 7.
*END STEP
"""


@pytest.fixture
def model(tmp_path):
    return read_model(write(tmp_path, CUBE + HELD + BOLT + STEPS), quiet=True)


def test_loads_are_kept_by_step(model):
    assert model.load_steps == {
        "INITIAL": LoadStep(loads=(StepLoad(kind="temperature", where="NALL", value=20.0),)),
        "ASSEMBLY": LoadStep(
            procedure="static",
            large=True,
            loads=(
                StepLoad(kind="bolt force", where="CUT", value=5000.0),
                StepLoad(kind="force", where="ROOT", value=-3.0, axis=2),
            ),
        ),
        "STEP-2": LoadStep(
            procedure="static",
            loads=(
                StepLoad(kind="bolt locked", where="CUT"),
                StepLoad(kind="pressure", where="TOP", value=2.5, amplitude="RAMP", replaces=True),
                StepLoad(kind="pressure", where="EALL", value=1.5, face=3),
                StepLoad(kind="gravity", where="EALL", value=9.81, direction=(0.0, 0.0, -1.0)),
                StepLoad(kind="centrifugal", where="EALL", value=1e4, point=(0.0, 0.0, 0.5), direction=(0.0, 0.0, 1.0)),
                StepLoad(kind="body force", where="EALL", value=4.0, direction=(1.0, 0.0, 0.0)),
                StepLoad(kind="temperature", where="NALL", value=80.0),
                StepLoad(kind="temperature", where="3", value=90.0),
            ),
        ),
        "STEP-3": LoadStep(
            procedure="static",
            perturbation=True,
            loads=(
                StepLoad(kind="bolt shortening", where="CUT", value=0.01),
                StepLoad(kind="displacement", where="ROOT", value=0.02, axis=3),
                StepLoad(kind="moment", where="2", value=7.0, axis=1),
            ),
        ),
    }
    said = (
        "loads are kept as model.load_steps and have no effect here: INITIAL (1), ASSEMBLY (2), STEP-2 (8), STEP-3 (3)"
    )
    assert any(said in note for note in model.notes)


def test_they_have_no_effect(model, tmp_path):
    plain = read_model(write(tmp_path, CUBE + HELD), quiet=True)
    assert abs(model.K - plain.K).max() == 0.0
    assert abs(model.M - plain.M).max() == 0.0


def test_they_go_with_the_model(model, tmp_path):
    again = load_model(save_model(model, tmp_path / "m.h5"), quiet=True)
    assert again.load_steps == model.load_steps
    assert model.fix("n2x").load_steps == model.load_steps


def test_a_temperature_of_every_node_fits_into_the_file(tmp_path):
    """More than an attribute of HDF5 holds."""
    rows = "".join(f"{1 + i % 10}, {i}.\n" for i in range(3000))
    model = read_model(write(tmp_path, CUBE + HELD + "*STEP\n*STATIC\n*TEMPERATURE\n" + rows), quiet=True)
    again = load_model(save_model(model, tmp_path / "m.h5"), quiet=True)
    assert len(again.load_steps["STEP-1"].loads) == 3000
    assert again.load_steps == model.load_steps


def test_in_other_units(tmp_path):
    """From N, mm, s to SI: a pressure in MPa, an acceleration in mm/s^2, a length in mm."""
    text = CUBE + HELD + BOLT + STEPS
    model = read_model(write(tmp_path, text), ImportOptions(units="N, mm, t, s", to="SI"), quiet=True)
    value = {load.kind: load.value for step in model.load_steps.values() for load in step.loads}
    assert value.pop("pressure") == pytest.approx(1.5e6)
    assert value.pop("gravity") == pytest.approx(9.81e-3)
    assert value.pop("bolt shortening") == pytest.approx(1e-5)
    assert value.pop("displacement") == pytest.approx(2e-5)
    assert value.pop("body force") == pytest.approx(4e9)
    assert value.pop("moment") == pytest.approx(7e-3)
    assert value == {
        "temperature": 90.0, "bolt force": 5000.0, "force": -3.0, "bolt locked": 0.0, "centrifugal": 1e4
    }  # fmt: skip
    (spin,) = (load for load in model.load_steps["STEP-2"].loads if load.kind == "centrifugal")
    assert spin.point == pytest.approx((0.0, 0.0, 5e-4))
    assert {load.kind for step in model.load_steps.values() for load in step.loads} == {*DIMENSIONS}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "ROOT, 2, -3.,",
            "PUSH, 2, -3.",
            "line 37: *CLOAD names PUSH, which the file does not have: not kept as a load",
        ),
        ("Top, P, 2.5", "Top, P, high", "*DSLOAD has a line that is no load: it is not kept"),
        ("Top, P, 2.5", "Top", "*DSLOAD has a line that is no load: it is not kept"),
        ("Top, P, 2.5", "Top, TRVEC, 2.5, 1., 0., 0.", "*DSLOAD gives loads TRVEC, which are not kept"),
        ("EALL, BX, 4.", "EALL, P9, 4.", "*DLOAD gives loads P9, which are not kept"),
        ("*TEMPERATURE\n", "*TEMPERATURE, FILE=hot\n", "*TEMPERATURE takes its values from elsewhere"),
        ("ROOT, 2, -3.,", "ROOT, 11, 5.", "*CLOAD gives loads 11, which are not kept"),
    ],
)
def test_what_is_not_kept_is_told(tmp_path, old, new, said):
    text = CUBE + HELD + BOLT + STEPS
    assert old in text
    model = read_model(write(tmp_path, text.replace(old, new, 1)), quiet=True)
    assert any(said in sentence for sentence in model.warnings), model.warnings


@pytest.mark.parametrize("spoilt", ['"kind": "push"', '"value": NaN', '"value": null', '"loads": 3'])
def test_a_spoilt_model_file(model, tmp_path, spoilt):
    import h5py
    import numpy as np

    path = save_model(model, tmp_path / "m.h5")
    with h5py.File(path, "r+") as file:
        text = bytes(file["load_steps"][()]).decode()
        key = spoilt.split(":")[0]
        start = text.index(key)
        end = start + len(text[start:].split(", ")[0])
        del file["load_steps"]
        file["load_steps"] = np.frombuffer((text[:start] + spoilt + text[end:]).encode(), dtype=np.uint8)
    with pytest.raises(InputError, match="is damaged or not a slipstick model"):
        load_model(path)
