"""Temperatures, displacements and tables of input files as load steps: a bar against a stop, in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.input_file import CUBE, HELD, write

import slipstick as ss
from slipstick.fem.box import box
from slipstick.fem.expansion import temperature_field
from slipstick.importers.import_model import read_model
from slipstick.importers.roles import ImportOptions

E, ALPHA, L, AREA, GAP, KN = 2e5, 1.2e-5, 200.0, 100.0, 0.05, 3e5
MESH = box((L, 10.0, 10.0), (10, 1, 1), "hex8")
END = [f"n{label}x" for label in MESH.labels[MESH.surface("x1").nodes]]

STEPS = """*INITIAL CONDITIONS, TYPE=TEMPERATURE
NALL, 30.
*STEP, NAME=Heat
*STATIC
*TEMPERATURE
NALL, 120.
*END STEP
*STEP, NAME=Push
*STATIC
*BOUNDARY
ROOT, 1, 1, 0.02
*END STEP
*STEP, NAME=Back
*STATIC
*BOUNDARY
ROOT, 1, 1, 0.
*TEMPERATURE, OP=NEW
TIP, 230.
*END STEP
"""


def deck(elastic: str = "2e5, 0.", steps: str = STEPS, expansion: str = "*EXPANSION, ZERO=20.\n1.2e-5\n") -> str:
    nodes = "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in zip(MESH.labels, MESH.nodes.tolist(), strict=True))
    elements = "".join(
        f"{k}, {', '.join(map(str, MESH.labels[row]))}\n" for k, row in enumerate(MESH.blocks["hex8"], 1)
    )
    sets = "".join(
        f"*NSET, NSET={name}\n" + "".join(f"{label},\n" for label in MESH.labels[MESH.surface(side).nodes])
        for name, side in (("ROOT", "x0"), ("TIP", "x1"))
    )
    return (
        f"*NODE, NSET=NALL\n{nodes}*ELEMENT, TYPE=C3D8I, ELSET=EALL\n{elements}{sets}*MATERIAL, NAME=STEEL\n"
        f"*ELASTIC\n{elastic}\n*DENSITY\n7.8e-9\n{expansion}"
        f"*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n*BOUNDARY\nROOT, 1, 3\n{steps}"
    )


def pressed(model, **fields) -> list[float]:
    """Force on the stop after each of the fields and displacements, one after the other."""
    steps = fields.pop("steps")
    body = ss.reduced_body(model, keep=END, modes=5, **fields)
    law = ss.FrictionContact(kn=KN, gap=GAP)
    stop = ss.ContactPair(name="stop", contact=law, normal=dict.fromkeys(END, 0.25))
    made = ss.Problem(body.structure, contacts=stop, loads=ss.Load(dof=END[0], cos=1.0), harmonics=1)
    return ss.preload(made, steps).dataset.normal_force.values[:, 0].tolist()


def force(heated: float, moved: float = 0.0, young: float = E) -> float:
    return max(0.0, (ALPHA * heated * L + moved - GAP) / (L / (young * AREA) + 1.0 / KN))


def test_steps_by_name(tmp_path):
    model = read_model(write(tmp_path, deck()))
    steps = [
        ss.LoadStep(temperature="hot"),
        ss.LoadStep(displacement={"push": 1.0}),
        ss.LoadStep(displacement={"push": 2.0}),
        ss.LoadStep(temperature="uneven", displacement={"push": 1.0}),
    ]
    found = pressed(model, temperature={"hot": "HEAT", "uneven": "BACK"}, displacement={"push": "PUSH"}, steps=steps)
    uneven = 200.0 * 0.05  # half of the last of ten elements
    assert found == pytest.approx([force(90.0), force(90.0, 0.02), force(90.0, 0.04), force(uneven, 0.02)], rel=1e-6)
    assert 'ss.reduced_body takes the temperature of a step by its name, temperature={"hot": "HEAT"}' in str(
        model.notes
    )
    body = ss.reduced_body(model, keep=END, modes=5, temperature={"hot": "HEAT"})
    assert "thermal strain counts from the initial temperatures of the file of the model" in body.notes


def test_the_initial_temperature_may_be_another(tmp_path):
    model = read_model(write(tmp_path, deck()))
    heat = ss.LoadStep(temperature="hot")
    found = pressed(model, temperature={"hot": "HEAT"}, initial_temperature=20.0, steps=heat)
    assert found == pytest.approx([force(100.0)], rel=1e-6)


def test_young_over_temperature_is_that_of_the_initial_temperatures(tmp_path):
    model = read_model(write(tmp_path, deck("2e5, 0., 0.\n1e5, 0., 100.")))
    heat = ss.LoadStep(temperature="hot")
    assert pressed(model, temperature={"hot": "HEAT"}, steps=heat) == pytest.approx([force(90.0, 0.0, 1.7e5)], rel=1e-6)
    np.testing.assert_array_equal(model.mesh.temperature, 30.0)
    assert any("stiffness at a temperature of 30; " in note for note in model.notes)
    with pytest.raises(ss.InputError, match="materials, EALL, young: found a temperature of 120; expected 0 to 100"):
        ss.models.at_temperature(model, "HEAT")
    hot = ss.models.at_temperature(model, 80.0)
    assert pressed(hot, temperature={"hot": "HEAT"}, steps=heat) == pytest.approx([force(90.0, 0.0, 1.2e5)], rel=1e-6)


def test_young_over_temperature_without_an_initial_one_is_told(tmp_path):
    with pytest.warns(
        ss.SlipstickWarning, match="the elasticity of EALL depends on temperature, and the file states no"
    ):
        model = read_model(write(tmp_path, deck("2e5, 0., 0.\n1e5, 0., 100.", steps="")))
    assert model.materials["EALL"].young == 1.8e5  # at the reference of the expansion
    assert model.materials["EALL"].poisson == 0.0


def test_a_table_of_expansion_is_secant(tmp_path):
    table = "*EXPANSION, ZERO=20.\n1e-5, 20.\n2e-5, 220.\n"
    model = read_model(write(tmp_path, deck(expansion=table)))
    strain = 1.5e-5 * 100.0 - 1.05e-5 * 10.0
    heat = ss.LoadStep(temperature="hot")
    found = pressed(model, temperature={"hot": "HEAT"}, steps=heat)
    assert found == pytest.approx([(strain * L - GAP) / (L / (E * AREA) + 1.0 / KN)], rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new"), [("*EXPANSION", "*EXPANSION, TYPE=ORTHO"), ("1.2e-5\n", "1.2e-5, 20., 1.\n2e-5, 20., 2.\n")]
)
def test_expansion_that_is_not_read_is_told(tmp_path, old, new):
    with pytest.warns(ss.SlipstickWarning, match=r"\*EXPANSION depends on direction, on fields or on a routine"):
        model = read_model(write(tmp_path, deck().replace(old, new)))
    assert model.materials["EALL"].expansion is None


def test_faults_of_steps_of_the_file(tmp_path):
    model = read_model(write(tmp_path, deck()))
    with raises_fault("temperature", "hot", remedy="did you mean 'HEAT'?"):
        ss.reduced_body(model, keep=END, modes=5, temperature={"hot": "HEATS"})
    with raises_fault("displacement", "push", says="no displacement acts in the load step 'HEAT' of the file"):
        ss.reduced_body(model, keep=END, modes=5, displacement={"push": "HEAT"})
    bare = read_model(
        write(tmp_path, deck(steps=STEPS.replace("NALL, 30.", "TIP, 30.").replace("NALL, 120.", "TIP, 90.")))
    )
    with raises_fault("temperature", "hot", says="40 nodes have no temperature in the load step 'HEAT' of the file"):
        ss.reduced_body(bare, keep=END, modes=5, temperature={"hot": "HEAT"}, initial_temperature=20.0)


def test_an_amplitude_is_told(tmp_path):
    model = read_model(write(tmp_path, deck().replace("*TEMPERATURE\n", "*TEMPERATURE, AMPLITUDE=Ramp\n")))
    with pytest.warns(ss.SlipstickWarning, match="the temperature of the load step 'HEAT' has the amplitude RAMP"):
        ss.reduced_body(model, keep=END, modes=5, temperature={"hot": "HEAT"})


@pytest.mark.parametrize(
    ("steps", "why"),
    [
        ("*BOUNDARY\nROOT, 1, 1, 0.5\n", "before the first step"),
        ("*STEP\n*STATIC\n*BOUNDARY\nROOT, 4, 4, 0.5\n*END STEP\n", "of a rotation"),
        (
            "*TRANSFORM, NSET=ROOT\n0., 1., 0., -1., 0., 0.\n*STEP\n*STATIC\n*BOUNDARY\nROOT, 1, 1, 0.5\n",
            "along a node's own axes",
        ),
    ],
)
def test_displacements_that_are_refused(tmp_path, steps, why):
    with pytest.raises(ss.InputError, match=rf"\*BOUNDARY prescribes a displacement that is not 0, {why}"):
        read_model(write(tmp_path, deck(steps=steps)))


REFERENCE = "*NODE, NSET=REF\n999, 210., 5., 5.\n"
PULLED = "*STEP\n*STATIC\n*BOUNDARY\nREF, 1, 1, 0.5\n*END STEP\n"


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("", "moves no free node: there is no element of the mesh between it and one"),
        ("*RIGID BODY, NSET=TIP, REF NODE=999\n*BOUNDARY\nREF, 2, 6\n", "of a rigid body those of its surface"),
        ("*RIGID BODY, NSET=TIP, REF NODE=999\n*BOUNDARY\nREF, 2, 5\n", "equations of the model may hold nodes"),
    ],
)
def test_a_reference_node_moves_nothing_here_and_that_is_said(tmp_path, more, says):
    model = read_model(write(tmp_path, deck(steps=REFERENCE + more + PULLED)), quiet=True)
    free = f"n{MESH.labels[np.argmin(np.abs(MESH.nodes[:, 0] - 100.0))]}x"
    with raises_fault("displacement", "pull", says=says):
        ss.reduced_body(model, keep=[free], modes=3, displacement={"pull": "STEP-1"})


def test_the_surface_of_a_held_rigid_body_moves(tmp_path):
    text = deck(steps=f"{REFERENCE}*RIGID BODY, NSET=TIP, REF NODE=999\n*BOUNDARY\nREF, 1, 6\n")
    model = read_model(write(tmp_path, text), quiet=True)
    free = f"n{MESH.labels[np.argmin(np.abs(MESH.nodes[:, 0] - 100.0))]}x"
    body = ss.reduced_body(model, keep=[free], modes=3, displacement={"pull": {"TIP": "x"}})
    assert body.structure.shapes["displacement pull"].static_response[0] == pytest.approx(0.5, rel=1e-9)


def test_middle_nodes_have_the_mean_of_their_ends(tmp_path):
    """Temperatures of corners alone, as files of quadratic elements have them."""
    rows = "".join(f"{label}, {10.0 * label}\n" for label in (1, 2, 3, 4))
    text = CUBE + HELD + f"*STEP\n*STATIC\n*TEMPERATURE\n{rows}*END STEP\n"
    model = read_model(write(tmp_path, text))
    field = temperature_field(model.mesh, "STEP-1", steps=model.load_steps)
    np.testing.assert_array_equal(field, [10.0, 20.0, 30.0, 40.0, 15.0, 25.0, 20.0, 25.0, 30.0, 35.0])


def test_the_material_of_the_file_may_be_replaced(tmp_path):
    given = ss.Material(young=1e5, poisson=0.0, density=7.8e-9, expansion=1e-5, reference=0.0)
    model = read_model(write(tmp_path, deck("2e5, 0., 0.\n1e5, 0., 100.")), ImportOptions(material=given), quiet=True)
    assert model.mesh.temperature is None
    assert model.materials == {"all": given}


def test_a_case_file_names_steps_of_the_deck(tmp_path):
    write(tmp_path, deck())
    case = f"""
format = 1
harmonics = "0..1"
[structure]
kind = "fe"
file = "m.inp"
keep = {END}
modes = 5
temperature = {{ hot = "HEAT" }}
displacement = {{ push = "PUSH" }}
[[contact]]
name = "stop"
normal = {{ {", ".join(f"{dof} = 0.25" for dof in END)} }}
kn = {KN}
gap = {GAP}
[[preload]]
temperature = "hot"
displacement = {{ push = 2.0 }}
[[load]]
dof = "{END[0]}"
cos = 1.0
[response]
from = 1.0
to = 2.0
"""
    (found,) = ss.Case.from_text(case, tmp_path / "case.toml").preloaded.dataset.normal_force.values[:, 0]
    assert found == pytest.approx(force(90.0, 0.04), rel=1e-6)
    with raises_fault("structure", "temperature", "hot", remedy="did you mean 'HEAT'?"):
        ss.Case.from_text(case.replace('"HEAT"', '"HEATS"'), tmp_path / "case.toml").problem()
