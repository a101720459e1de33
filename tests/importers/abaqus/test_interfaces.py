"""Contact pairs with their friction, sections of bolts, dofs of a substructure: kept by name, and told."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.input_file import CUBE, HELD, write

from slipstick.errors import InputError
from slipstick.fem.interfaces import PretensionSection, SurfacePair
from slipstick.importers.import_model import read_mesh, read_model
from slipstick.importers.roles import ImportOptions
from slipstick.io.model_file import load_model, save_model

SIDES = """*SURFACE, NAME=Low, TYPE=ELEMENT
EALL, S1
*SURFACE, NAME=Front, TYPE=ELEMENT
EALL, S2
*SURFACE, NAME=Points, TYPE=NODE
2
"""
PAIRS = (
    SIDES
    + """*SURFACE INTERACTION, NAME=Dry
1.,
*FRICTION, SLIP TOLERANCE=0.005
0.35,
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*SURFACE INTERACTION, NAME=Smooth
*CONTACT PAIR, INTERACTION=Dry, TYPE=SURFACE TO SURFACE
Low, Front
*CONTACT PAIR, INTERACTION=Smooth
Points, Front
"""
)
BOLT = (
    SIDES
    + """*NODE, NSET=PULL
77, 3., 3., 3.
*PRE-TENSION SECTION, SURFACE=Low, NODE=PULL
0., 0., 2.
*STEP
*STATIC
*CLOAD
PULL, 1, 5000.
*END STEP
*STEP
*STATIC
*BOUNDARY, FIXED
PULL, 1, 1
*BOUNDARY
PULL, 1, 1, 0.01
*TEMPERATURE
NALL, 80.
*END STEP
"""
)


def test_pairs_are_kept_with_their_friction_and_told(tmp_path):
    model = read_model(write(tmp_path, CUBE + HELD + PAIRS), quiet=True)
    assert model.contact_pairs == {
        "LOW/FRONT": SurfacePair(dependent="LOW", independent="FRONT", mu=0.35, interaction="DRY", card="*FRICTION"),
        "POINTS/FRONT": SurfacePair(dependent="POINTS", independent="FRONT", interaction="SMOOTH"),
    }
    assert model.warnings == (
        "m.inp, line 36 and 1 more: *CONTACT PAIR is kept as model.contact_pairs: nothing joins its surfaces until "
        "contacts are put there ([[joint]] of a case, ss.surface_pair)",
    )
    for pair in model.contact_pairs.values():
        assert {pair.dependent, pair.independent} <= {*model.mesh.all_sets}
    plain = read_model(write(tmp_path, CUBE + HELD + SIDES))
    assert abs(model.K - plain.K).max() == 0.0


def test_a_section_of_a_bolt_is_whole(tmp_path):
    """Neither the load nor the shortening of its node has an effect; the node has no dofs."""
    model = read_model(write(tmp_path, CUBE + HELD + BOLT), quiet=True)
    assert model.pretension_sections == {"LOW": PretensionSection(node=77, normal=(0.0, 0.0, 2.0))}
    assert not {77} & {*model.dof_nodes.tolist()}
    assert 77 not in model.constrained[:, 0]
    (said,) = model.warnings
    assert said.startswith(
        "m.inp, line 32: *PRE-TENSION SECTION is kept as model.pretension_sections: the bolt stays whole"
    )
    plain = read_model(write(tmp_path, CUBE + HELD))
    assert abs(model.K - plain.K).max() == 0.0
    assert any("*CLOAD" in note and "*TEMPERATURE" in note for note in model.notes)


def test_they_go_with_the_model(tmp_path):
    """Into its file, other units and a quadratic mesh."""
    text = CUBE + HELD + PAIRS + BOLT.removeprefix(SIDES)
    model = read_model(write(tmp_path, text), ImportOptions(scale={"length": 1e-3}), quiet=True)
    again = load_model(save_model(model, tmp_path / "m.h5"), quiet=True)
    for one in (model, again, model.fix("n2x")):
        assert set(one.contact_pairs) == {"LOW/FRONT", "POINTS/FRONT"}
        assert one.contact_pairs == model.contact_pairs
        assert one.pretension_sections == {"LOW": PretensionSection(node=77, normal=(0.0, 0.0, 2.0))}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("Low, Front", "Low, Back", "line 37: *CONTACT PAIR names BACK, which the file does not have"),
        ("0.35,", "-0.35,", "*FRICTION cannot be read (a coefficient of -0.35)"),
        ("0.35,", "high,", "*FRICTION cannot be read"),
        ("SURFACE=Low, NODE", "SURFACE=Deep, NODE", "*PRE-TENSION SECTION names DEEP, which the file does not have"),
        ("NODE=PULL", "NODE=PUSH", "*PRE-TENSION SECTION names PUSH, which the file does not have"),
        ("SURFACE=Low, NODE", "NODE", "*PRE-TENSION SECTION lacks SURFACE="),
        ("0., 0., 2.", "0., 0., 0.", "*PRE-TENSION SECTION cannot be read (a normal without length)"),
    ],
)
def test_faults(tmp_path, old, new, said):
    text = CUBE + HELD + PAIRS + BOLT.removeprefix(SIDES)
    assert old in text
    with pytest.raises(InputError) as caught:
        read_model(write(tmp_path, text.replace(old, new, 1)))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (", ROUGH", "gives no coefficient of friction (no number, ROUGH or USER): the contact pairs have none"),
        ("\n0.3, 10.\n0.2, 20.", "depends on slip rate; the coefficient of its first line is kept"),
        ("\n0.3, , 1e6, 20.\n0.2, , 2e6, 80.", "depends on pressure and temperature; the coefficient of its first"),
        (", TAUMAX=5e6\n0.3,", "limits the friction stress by TAUMAX, which is left out"),
        (", EXPONENTIAL DECAY\n0.3, 0.2, 5.", "decays with the slip rate (EXPONENTIAL DECAY); the first coefficient"),
        (", ANISOTROPIC\n0.3, 0.2", "differs with the direction (ANISOTROPIC); the first coefficient is kept"),
        ("\n0.3, 1e5", "has 1e5 beside its coefficient (slip rate, or stick slope of CalculiX), which is not used"),
        ("\n0.3,", ""),
    ],
)
def test_what_is_not_used_of_friction_is_told(tmp_path, more, said):
    text = PAIRS.replace("*FRICTION, SLIP TOLERANCE=0.005\n0.35,", f"*FRICTION{more}")
    model = read_model(write(tmp_path, CUBE + HELD + text), quiet=True)
    ours = [sentence for sentence in model.warnings if "*FRICTION" in sentence]
    assert [f"*FRICTION {said}" in sentence for sentence in ours] == [True] * bool(said)
    assert model.contact_pairs["LOW/FRONT"].mu == (None if "ROUGH" in more else 0.3)


def test_what_a_substructure_retains_moves(tmp_path):
    """Abaqus wants it held in the step before, for the fixed modes of Craig and Bampton."""
    step = (
        "*STEP, NAME=MODES\n*FREQUENCY\n3\n*BOUNDARY\nROOT, ENCASTRE\n2, 1\n*END STEP\n*STEP\n*SUBSTRUCTURE GENERATE\n"
    )
    mesh = read_mesh(write(tmp_path, CUBE + step + "*RETAINED NODAL DOFS, SORTED=NO\nROOT, 1, 2\n3\n*END STEP\n"))
    moving = {(node, axis) for node in (1, 3, 4, 7, 8, 10) for axis in (0, 1)} | {(3, 2)}
    assert {pair for pair in mesh.held if pair[1] < 3} == (
        {(node, axis) for node in (1, 3, 4, 7, 8, 10) for axis in range(3)} | {(2, 0)}
    ) - moving
    assert any("*RETAINED NODAL DOFS frees 16 dofs that the step before holds" in note for note in mesh.notes)
    with pytest.raises(InputError, match="directions 0 to 7"):
        read_mesh(write(tmp_path, CUBE + step + "*RETAINED NODAL DOFS\nROOT, 0, 7\n*END STEP\n"))
    assert np.all(np.isfinite(mesh.mesh.nodes))


@pytest.mark.parametrize("word", ["9" * 20, "\u00b2"])
def test_a_surface_of_no_element_label_is_refused(tmp_path, word):
    with pytest.raises(InputError, match=f"SURFACE names .*{word}, which the file does not have"):
        read_model(write(tmp_path, CUBE + HELD + f"*SURFACE, NAME=Low, TYPE=ELEMENT\n{word}, S1\n"), quiet=True)
