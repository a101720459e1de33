"""Input files whose keywords couple, add, rotate or hold: refused by name; approximated: warned; the rest is listed."""

import pytest
from helpers.input_file import CUBE, HELD, write

from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.materials import Material
from slipstick.importers.abaqus.keywords import KEYWORDS
from slipstick.importers.findings import Table, Verdict
from slipstick.importers.import_model import read_mesh, read_model
from slipstick.importers.roles import ImportOptions


def test_the_plain_file_says_nothing(tmp_path):
    model = read_model(write(tmp_path, CUBE + HELD))
    assert model.n_dofs == 12
    assert model.warnings == ()


COUPLED = [
    "*EQUATION, REMOVE\n2, 1",
    "*MPC\nMEANROT, 2, 2, 2, 5, 5, 5, 6",
    "*TIE, NAME=GLUE, MULTISTAGE\nS1, S2",
    "*CONTACT",
    "*CONTACT PAIR, TIED\nS1, S2",
    "*SURFACE INTERACTION, NAME=I\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TIED\n"
    "1e6\n*CONTACT PAIR, INTERACTION=I\nS1, S2",
    "*RIGID BODY, NSET=ROOT",
    "*COUPLING, REF NODE=2, SURFACE=S, CONSTRAINT NAME=C",
    "*COUPLING, REF NODE=2, SURFACE=S, ORIENTATION=NOWHERE, CONSTRAINT NAME=C\n*KINEMATIC\n1, 3",
    "*DISTRIBUTING COUPLING, ELSET=EALL\n2, 1.",
    "*EMBEDDED ELEMENT\nEALL",
    "*ELEMENT, TYPE=MASS, ELSET=POINT\n9, 2\n*MASS, ELSET=POINT, TYPE=ANISOTROPIC\n1., 2., 3.",
    "*ELEMENT, TYPE=SPRINGA, ELSET=SP\n9, 2, 3\n*SPRING, ELSET=SP, NONLINEAR\n0., 0.\n1., 1.",
    "*GAP, ELSET=G\n0.1",
    "*ELEMENT, TYPE=S3, ELSET=SH\n9, 2, 3, 4\n*SHELL SECTION, ELSET=SH, MATERIAL=STEEL\n0.1",
    "*ELEMENT, TYPE=B31, ELSET=B\n9, 2, 3\n*BEAM SECTION, ELSET=B, MATERIAL=STEEL, SECTION=RECT\n1., 1.",
    "*ELEMENT, TYPE=M3D3, ELSET=SK\n9, 2, 3, 4\n*MEMBRANE SECTION, ELSET=SK, MATERIAL=STEEL\n0.1",
    "*FOUNDATION\nEALL, F1, 1e3",
    "*BOUNDARY\n2, 1, 1, 0.5",
    "*BOUNDARY, TYPE=VELOCITY\n2, 1, 1, 0.",
    "*STEP\n*FREQUENCY\n3\n*BOUNDARY, OP=NEW\n2, 1, 3\n*END STEP",
    "*STEP\n*STATIC\n*MODEL CHANGE, TYPE=ELEMENT, REMOVE\nEALL\n*END STEP",
]


@pytest.mark.parametrize("more", COUPLED, ids=lambda more: more.split(",")[0].split("\n")[0][1:])
def test_what_couples_adds_rotates_or_holds_is_refused_by_name(tmp_path, more):
    keywords = [line.split(",")[0] for line in more.split("\n") if line.startswith("*")]
    with pytest.raises(InputError) as caught:
        read_model(write(tmp_path, CUBE + HELD + more + "\n"))
    for sentence in caught.value.sentences:
        assert sentence.startswith("m.inp, line ")
        assert "export the assembled matrices" in sentence
        assert any(f": {keyword} " in sentence for keyword in keywords)


def test_a_set_that_is_held_may_name_nodes_that_are_not_there(tmp_path):
    more = "*NSET, NSET=Q\n2, 99999\n*BOUNDARY\nQ, 1\n"
    model = read_model(write(tmp_path, CUBE + HELD + more))
    assert model.n_dofs == 11
    assert "m.inp: node set Q names 1 nodes that are not in the file (99999, ...)" in model.notes
    with pytest.raises(InputError, match=r"m.inp, line 24: \*BOUNDARY names node 99999"):
        read_model(write(tmp_path, CUBE + HELD + "*BOUNDARY\n99999, 1\n"))


@pytest.mark.parametrize("first", ["*STEP\n*FREQUENCY\n3", "*STEP\n*BUCKLE\n3", "*STEP, PERTURBATION\n*STATIC"])
def test_small_motions_after_a_step_that_leaves_nothing_loaded(tmp_path, first):
    more = f"{first}\n*END STEP\n*STEP, PERTURBATION\n*FREQUENCY\n3\n*END STEP\n"
    assert read_model(write(tmp_path, CUBE + HELD + more)).n_dofs == 12


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "*ELASTIC\n2.1e5, 0.3",
            "*ELASTIC, DEPENDENCIES=1\n2.1e5, 0.3, 20., 1.\n1.8e5, 0.3, 600., 2.",
            "*ELASTIC of material STEEL depends on fields",
        ),
        ("*ELASTIC", "*ELASTIC, TYPE=ORTHO", "is not isotropic elasticity, TYPE=ORTHO"),
        ("*ELASTIC", "*USER MATERIAL, CONSTANTS=2", "*USER MATERIAL of material STEEL is not isotropic elasticity"),
        ("7.8e-9", "7.8e-9, 20.\n7e-9, 600.", "*DENSITY of material STEEL depends on temperature"),
        ("*DENSITY\n7.8e-9\n", "", "has no density; give young, poisson and density"),
    ],
)
def test_materials_that_cannot_be_used(tmp_path, old, new, said):
    """Refused, unless a material is given for the whole mesh: then it is said which wins."""
    path = write(tmp_path, (CUBE + HELD).replace(old, new))
    with pytest.raises(InputError, match=r"STEEL|EALL") as caught:
        read_model(path)
    assert said in str(caught.value)
    given = Material(young=1e5, poisson=0.2, density=1e-9)
    assert read_model(path, ImportOptions(material=given), quiet=True).n_dofs == 12


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("*STRANGE THING, A=1\n1, 2", "m.inp, line 24: *STRANGE THING is not understood: it has no effect here"),
        ("*NSET, NSET=Q, ODD=3\n1", "m.inp, line 24: *NSET has the parameter ODD, which is not understood"),
        ("*INITIAL CONDITIONS, TYPE=STRESS\nEALL, 1., 0., 0., 0., 0., 0.", "*INITIAL CONDITIONS sets stresses, whose"),
        (
            "*STEP\n*STATIC\n*CLOAD\n2, 1, 5.\n*END STEP\n*STEP, PERTURBATION\n*FREQUENCY\n3\n*END STEP",
            "*STEP vibrates about the loaded state of the step before: its stiffening by stress and rotation",
        ),
        ("*DAMPING, ALPHA=1.", "*DAMPING is not read; give the structure's loss_factor or damping_ratio"),
        (
            "*STEP\n*STATIC\n*DLOAD\nEALL, CENTRIF, 1., 0., 0., 0., 1., 0., 0.\n*END STEP",
            "*DLOAD rotates the structure",
        ),
        (
            "*STEP, NLGEOM\n*STATIC\n*END STEP\n*STEP\n*FREQUENCY\n3\n*END STEP",
            "*FREQUENCY is computed about the unloaded state; in Abaqus",
        ),
        (
            "*ELEMENT, TYPE=MASS, ELSET=P\n9, 2",
            "m.inp: 1 elements of type MASS share nodes with solids, and no section",
        ),
        (
            "*ELEMENT, TYPE=S3, ELSET=SK\n9, 2, 3, 4\n*SURFACE, NAME=SKIN\nSK, SPOS",
            "*SURFACE SKIN lies on no solid element and is left out",
        ),
    ],
)
def test_what_is_approximated_or_not_understood_is_warned_of(tmp_path, more, said):
    with pytest.warns(SlipstickWarning) as caught:
        model = read_model(write(tmp_path, CUBE + HELD + more + "\n"))
    assert [str(warning.message) for warning in caught] == list(model.warnings)
    assert any(said in warning for warning in model.warnings)


@pytest.mark.parametrize("kind", ["C3D10M", "C3D10T", "DC3D10"])
def test_other_formulations_are_named(tmp_path, kind):
    with pytest.warns(SlipstickWarning, match=f"1 elements of type {kind} are computed as fully integrated tet10"):
        read_model(write(tmp_path, (CUBE + HELD).replace("C3D10", kind)))


def test_a_material_given_wins_and_says_so(tmp_path):
    path = write(tmp_path, CUBE + HELD)
    same = Material(young=2.1e5, poisson=0.3, density=7.8e-9)
    assert read_model(path, ImportOptions(material=same)).warnings == ()
    with pytest.warns(SlipstickWarning, match=r"given \(E = 100000, .*not the file's own: EALL \(E = 210000") as caught:
        read_model(path, ImportOptions(material=Material(young=1e5, poisson=0.2, density=1e-9)))
    assert len(caught) == 1


def test_the_rest_is_listed_with_its_count(tmp_path):
    more = "*ELEMENT, TYPE=S3, ELSET=SK\n9, 2, 3, 4\n10, 1, 2, 3\n*ORIENTATION, NAME=O\n1., 0., 0., 0., 1., 0.\n"
    more += "*STEP\n*FREQUENCY\n3\n*NODE FILE\nU\n*NODE FILE\nV\n*ODD REQUEST\n*END STEP\n"
    notes = read_mesh(write(tmp_path, CUBE + HELD + more)).notes
    assert "m.inp: 2 elements of type S3 are no solids and were left out" in notes
    assert "m.inp: without effect here: *FREQUENCY, *NODE FILE (2), *END STEP, *ORIENTATION" in notes
    assert "m.inp: not understood, without effect here: *ODD REQUEST" in notes


def test_no_keyword_has_two_fates():
    assert all((entry.read is not None) == (entry.verdict is Verdict.READ) for entry in KEYWORDS.values())
    with pytest.raises(ValueError, match="TIE is in the table already"):
        KEYWORDS.reads("TIE")(lambda: None)
    with pytest.raises(ValueError, match="TIE is in the table already"):
        Table(("TIE MPC", Verdict.COUPLING, "ties"), ("TIE", Verdict.HARMLESS, ""))


def test_rotated_nodes_that_are_free_or_wholly_held_do_not_matter(tmp_path):
    axes = "1., 1., 0., -1., 1., 0.\n"
    more = f"*TRANSFORM, NSET=ROOT\n{axes}*TRANSFORM, NSET=TIP\n{axes}*NSET, NSET=TIP\n2\n"
    assert read_model(write(tmp_path, CUBE + HELD + more)).n_dofs == 12


def test_couplings_beside_matrices_are_in_the_matrices(tmp_path):
    """A mesh that only tells positions may couple: the matrices hold it, and the user is told."""
    from scipy.sparse import csr_array, save_npz

    own = read_model(write(tmp_path, CUBE + HELD))
    for name in "KM":
        save_npz(tmp_path / f"{name}.npz", csr_array(getattr(own, name)))
    (tmp_path / "dofs.map").write_text(
        "\n".join(f"{n} {c + 1}" for n, c in zip(own.dof_nodes, own.dof_components, strict=True))
    )
    path = write(tmp_path, CUBE + HELD + "*EQUATION\n2\n2, 1, 1., 5, 1, -1.\n")
    files = [tmp_path / "K.npz", tmp_path / "M.npz", tmp_path / "dofs.map", path]
    with pytest.warns(SlipstickWarning, match=r"\*EQUATION ties"):
        model = read_model(files)
    assert model.n_dofs == 12
    path.write_text(CUBE + HELD + "*TRANSFORM, NSET=TIP\n1., 1., 0., -1., 1., 0.\n*NSET, NSET=TIP\n2\n")
    with pytest.raises(InputError, match=r"1 nodes \(2, ...\) have rotated directions"):
        read_model(files)
    heavy, wrong = CUBE.replace("7.8e-9", "7.9e-9"), CUBE.replace("7.8e-9", "7800.")
    path.write_text(heavy + HELD)
    with pytest.warns(SlipstickWarning, match=r"the mesh beside them .*, 1\.28 % apart"):
        read_model(files)
    path.write_text(wrong + HELD)
    with pytest.raises(InputError, match="same units"):
        read_model(files)
    path.write_text(CUBE + HELD + "*ELSET, ELSET=TWICE\n1\n*SOLID SECTION, ELSET=TWICE, MATERIAL=STEEL\n")
    with pytest.warns(SlipstickWarning, match=r"is not compared .* element 1 has more than one material"):
        read_model(files)
    path.write_text(CUBE + HELD + "*DAMPING, ALPHA=1.\n")
    model = read_model(files)
    assert model.warnings == ()  # of an assembly here; the matrices are theirs
    assert any("not the matrices: m.inp, line 24: *DAMPING" in note for note in model.notes)


@pytest.mark.parametrize(
    "more",
    [
        "*ELEMENT, TYPE=MASS, ELSET=P\n9, 2\n*MASS, ELSET=P\n1e-6\n",
        "*ELEMENT, TYPE=SPRING1, ELSET=SP\n9, 2\n*SPRING, ELSET=SP\n1\n1e3\n",
    ],
)
def test_masses_and_springs_that_are_read_are_not_called_left_out(tmp_path, more):
    model = read_model(write(tmp_path, CUBE + HELD + more))
    assert model.warnings == ()
    assert not any("left out" in note for note in model.notes)
