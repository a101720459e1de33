"""Contact pairs and pretension sections of an archive: kept by name as those of other codes are, and told."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.ansys import PULL, stack_text

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.interfaces import PretensionSection, SurfacePair
from slipstick.fem.load_steps import StepLoad
from slipstick.fem.materials import Material
from slipstick.fem.model import elastic_model
from slipstick.fem.pretension import cut_sections
from slipstick.importers.import_model import read_model
from slipstick.io.model_file import load_model, save_model

pytest.importorskip("mapdl_archive")

LOW, HIGH = [5, 6, 7, 8], [9, 10, 11, 12]
PAIR = [(2, 2, 7, 1, LOW), (2, 3, 7, 1, HIGH)]
BOLT = [(1, 4, 1, 3, [first, second, 17]) for first, second in zip(LOW, HIGH, strict=True)]
SECTION = "SECTYPE,3,PRETENSION\nSECDATA,17,0.0,0.0,1.0\n"
FRICTION = "MPDATA,R5.0, 1,MU  ,       2, 1, 0.25\n"
APART = (
    "is kept as model.contact_pairs: nothing joins its surfaces until contacts are put there ([[joint]] of a case, "
    "ss.surface_pair)"
)


def read(folder, others, more=""):
    path = folder / "m.cdb"
    path.write_text(stack_text(others, more))
    return read_model(path, quiet=True)


def test_elements_of_one_real_constant_set_are_a_pair(tmp_path):
    model = read(tmp_path, PAIR, FRICTION)
    assert model.contact_pairs == {
        "contact 7/target 7": SurfacePair(
            dependent="contact 7", independent="target 7", mu=0.25, interaction="material 2", card="MU"
        )
    }
    for name, labels in (("contact 7", LOW), ("target 7", HIGH)):
        assert sorted(model.mesh.labels[model.mesh.surface(name).nodes]) == labels
    assert f"m.cdb: CONTA174 of real constants 7 {APART}" in model.warnings
    again = load_model(save_model(model, tmp_path / "m.h5"), quiet=True)
    assert again.contact_pairs == model.contact_pairs
    assert model.n_dofs == 3 * 12


def test_a_pair_carries_contacts(tmp_path):
    import slipstick as ss

    model = read(tmp_path, PAIR, FRICTION + "D,13,UX,0.\nD,13,UY,0.\nD,13,UZ,0.\nD,15,UX,0.\nD,15,UZ,0.\nD,14,UZ,0.\n")
    (pair,) = model.contact_pairs.values()
    law = ss.PlanarFrictionContact(kt=1e6, kn=1e6, mu=pair.mu, gap=0.0)
    joint = ss.surface_pair(model, pair.dependent, pair.independent, contact=law)
    assert joint.points.areas.sum() == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(joint.points.normals, [[0.0, 0.0, 1.0]] * len(joint), atol=1e-12)


@pytest.mark.parametrize(
    ("contact", "target", "surfaces"),
    [
        ([[5, 6, 7, 7], [5, 7, 8, 8]], [HIGH], {"contact 7": 0, "target 7": 1}),
        ([[5, 6, 7, 8, 0, 0, 0, 0]], [[9, 10, 11, 12]], {"contact 7": 1, "target 7": 1}),
    ],
)
def test_rows_of_faces(tmp_path, contact, target, surfaces):
    """Triangles on the side of a brick are no faces of it; middle nodes may be left out."""
    rows = [(2, 2, 7, 1, nodes) for nodes in contact] + [(2, 3, 7, 1, nodes) for nodes in target]
    if not all(surfaces.values()):
        with pytest.raises(InputError, match="has contact element 3 on no outer face of a solid element"):
            read(tmp_path, rows)
        return
    model = read(tmp_path, rows)
    assert {name: model.mesh.surface(name).n_faces for name in surfaces} == surfaces


def test_single_nodes_against_a_surface(tmp_path):
    model = read(tmp_path, [*((2, 5, 7, 1, [node]) for node in LOW), PAIR[1]], "MP,MU,2,0.1\n")
    (pair,) = model.contact_pairs.values()
    assert (pair.mu, sorted(model.node_sets[pair.dependent])) == (0.1, LOW)


@pytest.mark.parametrize(
    ("more", "mu", "said"),
    [
        ("", None, ""),
        ("TB,FRIC,2,1,1,ISO\nTBTEM,0.0,1\nTBDAT,1,0.4\n", 0.4, ""),
        ("TB,FRIC,2,2,1,ISO\nTBTEMP,0.\nTBDATA,1,0.4\nTBTEMP,100.\nTBDATA,1,0.2\n", 0.4, "MU of material 2 depends"),
        ("MP,MU,2,0.3,0.001\n", 0.3, "MU of material 2 depends"),
        ("TB,FRIC,2,1,2,ORTHO\nTBDATA,1,0.4,0.2\n", None, "gives friction by ORTHO"),
        ("KEYOPT,2,12,1\n" + FRICTION, None, "gives no coefficient of friction (KEYOPT(12) = 1, rough)"),
        ("KEYOPT,2,12,2\n" + FRICTION, 0.25, "never separates (KEYOPT(12) = 2, no separation)"),
    ],
)
def test_friction_of_the_contact_material(tmp_path, more, mu, said):
    model = read(tmp_path, PAIR, more)
    (pair,) = model.contact_pairs.values()
    assert pair.mu == mu
    assert not said or any(said in sentence for sentence in model.warnings)


@pytest.mark.parametrize(
    ("others", "more", "said"),
    [
        (PAIR, "KEYOPT,2,12,5\n", "glues surfaces together: KEYOPT(12) = 5, bonded (always)"),
        ([PAIR[0], (2, 3, 7, 1, [17])], "", "ties a surface to the pilot node 17"),
        ([PAIR[0], (2, 3, 7, 1, [9, 10, 17])], "", "has target element 4 on no outer face"),
        (PAIR, "MP,MU,2,-0.1\n", "m.cdb: material 2, MU: found -0.1; expected 0 or more"),
        (PAIR, "MP,MU,2,high\n", "MP cannot be read"),
        (PAIR, "R,7,,,stiff\n", "R cannot be read"),
        (PAIR, "RMODIF,7,1e30,2.\n", "RMODIF cannot be read"),
        (BOLT, "SECTYPE,3,PRETENSION\nSECDATA,17,0.0,0.0,0.0\n", "SECDATA cannot be read (a normal without length)"),
        ([(1, 4, 1, 3, [5, 13, 17])], SECTION, "joins the nodes 5 and 13, which lie 1 apart"),
        ([(1, 4, 1, 3, [5, 99, 17])], SECTION, "names node 99, which the file does not have"),
        ([(1, 4, 1, 3, [5, 9, 17])], SECTION, "PRETS179 of section 3 has nodes that form no face of a solid element"),
        ([*BOLT, (1, 4, 1, 4, [9, 5, 17])], SECTION, "cuts the bolt at node 5, where another one cuts it"),
        ([*BOLT[:3], (1, 4, 1, 3, [8, 12, 16])], SECTION, "has 2 pretension nodes (16, 17)"),
    ],
)
def test_what_cannot_be_kept_is_refused(tmp_path, others, more, said):
    with pytest.raises(InputError) as caught:
        read(tmp_path, others, more)
    assert said in str(caught.value)
    assert str(caught.value).startswith("m.cdb")


def test_symmetric_contact_is_one_pair(tmp_path):
    back = [(2, 2, 8, 1, HIGH), (2, 3, 8, 1, LOW)]
    model = read(tmp_path, [*PAIR, *back])
    assert [*model.contact_pairs] == ["contact 7/target 7"]
    assert any(
        "CONTA174 of real constants 8 is the pair contact 7/target 7 with its sides exchanged" in n for n in model.notes
    )


def test_elements_that_touch_nothing(tmp_path):
    model = read(tmp_path, [PAIR[0], (2, 3, 9, 1, HIGH)])
    assert not model.contact_pairs
    assert any("has no TARGE170 with the same real constants" in sentence for sentence in model.warnings)
    assert any("1 elements of type TARGE170 have no contact element" in note for note in model.notes)


def test_an_offset_is_told(tmp_path):
    model = read(tmp_path, PAIR, "R,7,,,1.0,0.1,0.0,0.0\nRMORE,,,,0.02\n")
    assert any("offsets its surface by CNOF = 0.02" in sentence for sentence in model.warnings)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("R,7\nRMORE,,,1e6\n", "changes friction by TAUMAX = 1e+06, which is left out: MU alone is kept"),
        ("R,7\nRMORE,,,1e20\nRMORE,,,,,,\nRMORE,,,1.0\n", ""),
        ("RMODIF,7,21,1.5\n", "changes friction by FACT = 1.5"),
        ("RMODIF,7,22,0.1\n", "changes friction by DC = 0.1"),
        ("RMODIF,7,13,0.1\n", "changes friction by COHE = 0.1"),
    ],
)
def test_what_is_not_used_of_friction_is_told(tmp_path, more, said):
    model = read(tmp_path, PAIR, FRICTION + more)
    ours = [sentence for sentence in model.warnings if "changes friction" in sentence]
    assert [said in sentence for sentence in ours] == [True] * bool(said)


def test_a_cut_bolt_is_whole(tmp_path):
    """Its stiffness is that of the same bolt meshed in one piece, and its section lies across it."""
    model = read(tmp_path, BOLT, SECTION + "D,17,UX,0.01\nF,17,FX,100.\n")
    assert model.pretension_sections == {"pretension 3": PretensionSection(node=17, normal=(0.0, 0.0, 1.0))}
    said = "m.cdb: PRETS179 of section 3 is kept as model.pretension_sections: the bolt stays whole there"
    assert any(sentence.startswith(said) for sentence in model.warnings)
    surface = model.mesh.surface("pretension 3")
    assert surface.n_faces == 1
    assert sorted(model.mesh.labels[surface.nodes]) == LOW
    assert not {*HIGH, 17} & {*model.dof_nodes.tolist()}
    steel = Material(young=3e7, poisson=0.3, density=7.3e-4)
    plain = elastic_model(box((1.0, 1.0, 2.0), (1, 1, 2), "hex8"), steel, ["z0"])
    for ours, theirs in ((model.K, plain.K), (model.M, plain.M)):
        ours, theirs = np.linalg.eigvalsh(ours.toarray()), np.linalg.eigvalsh(theirs.toarray())
        np.testing.assert_allclose(ours, theirs, atol=1e-12 * theirs.max())
    assert PULL not in model.mesh.nodes[model.mesh.used_nodes].tolist()
    cut, (section,) = cut_sections(model, ["pretension 3"])
    assert (section.dof, section.normal.tolist()) == ("n17x", [0.0, 0.0, 1.0])
    assert abs(cut.fix("n17x").K - model.K).max() == 0.0
    turned = replace(model, pretension_sections={"pretension 3": PretensionSection(node=17, normal=(0.0, 0.0, -1.0))})
    with pytest.raises(InputError, match="points into the elements of its surface"):
        cut_sections(turned, ["pretension 3"])


@pytest.mark.parametrize(
    ("more", "steps"),
    [
        (
            "SLOAD,3,PL01,TINY,FORC,5000.,2,3\n",
            {
                "STEP-2": (StepLoad(kind="bolt force", where="pretension 3", value=5000.0),),
                "STEP-3": (StepLoad(kind="bolt locked", where="pretension 3"),),
            },
        ),
        (
            "SLOAD,3,PL01,LOCK,DISP,0.01,1\n",
            {"STEP-1": (StepLoad(kind="bolt shortening", where="pretension 3", value=0.01),)},
        ),
        ("F,17,FX,5000.\n", {"STEP-1": (StepLoad(kind="bolt force", where="pretension 3", value=5000.0),)}),
        ("SLOAD,9,PL01,TINY,FORC,5000.\nF,5,FX,1.\n", {}),
    ],
)
def test_loads_of_bolts_are_kept(tmp_path, more, steps):
    model = read(tmp_path, BOLT, SECTION + more)
    assert {name: step.loads for name, step in model.load_steps.items()} == steps


def test_a_load_of_a_bolt_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="SLOAD cannot be read"):
        read(tmp_path, BOLT, SECTION + "SLOAD,3,PL01,TINY,FORC,high\n")
