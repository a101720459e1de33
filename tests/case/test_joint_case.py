"""``[[joint]]``: contacts between two surfaces of a finite element model in a case file."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest

import slipstick as ss
from slipstick.case.case import read_case
from slipstick.case.script import python_script
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.interfaces import SurfacePair
from slipstick.fem.mesh import together
from slipstick.fem.model import elastic_model
from slipstick.io.model_file import save_model

CASE = """
format = 1
harmonics = [0, 1]

[structure]
kind = "fe"
file = "leaves.h5"
pressure = { below = "lower.z0", above = "upper.z1" }
base = ["z"]
modes = 20
loss_factor = 0.01

[[load]]
shape = "below"
harmonic = 0
cos = 1e6

[[load]]
shape = "above"
harmonic = 0
cos = 1e6

[[load]]
base = "z"
motion = "acceleration"
cos = 100.0

[[joint]]
name = "leaf"
surfaces = ["lower.z1", "upper.z0"]
kt = 1e11
kn = 1e12
mu = 0.3
points = 6

[response]
from = 5000.0
to = 5200.0
"""


SECOND = """
[[joint]]
name = "leaf"
surfaces = ["lower.z1", "upper.z0"]
kt = 1.0
kn = 1.0
mu = 0.1

[response]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    there = tmp_path_factory.mktemp("joint")
    size = (0.06, 0.04, 0.004)
    lower, upper = box(size, (3, 2, 1)), box(size, (2, 3, 1), "tet10", at=(0.0, 0.0, size[2]))
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    save_model(
        elastic_model(together({"lower": lower, "upper": upper}), steel, ["lower.x0", "upper.x0"]), there / "leaves.h5"
    )
    return there


def case(folder, text=CASE):
    return ss.Case.from_text(text, folder / "case.toml")


def test_a_case_with_a_joint_is_the_problem_in_python(folder):
    found = case(folder)
    model = ss.import_model(folder / "leaves.h5")
    law = ss.PlanarFrictionContact(kt=1e11, kn=1e12, mu=0.3, gap=0.0)
    joint = ss.surface_pair(model, "lower.z1", "upper.z0", contact=law, name="leaf", points=6)
    body = ss.reduced_body(
        model, pairs=joint, pressure={"below": "lower.z0", "above": "upper.z1"}, base="z", modes=20, loss_factor=0.01
    )
    problem = found.problem()
    assert problem.elements == tuple(one.name for one in joint)
    assert [one.contact.gap for one in problem.contacts] == [one.contact.gap for one in joint]
    assert problem.structure.dofs == body.structure.dofs
    np.testing.assert_allclose(problem.structure.omega, body.structure.omega, rtol=1e-12)


def test_the_script_of_a_case_with_a_joint_makes_the_same_problem(folder):
    script = python_script(CASE, "case.toml", folder)
    assert "joint_1 = ss.surface_pair(" in script
    assert "pairs=[joint_1]" in script
    assert "contacts = [*joint_1]" in script
    space = {"__name__": "script", "__file__": str(folder / "case.py")}
    exec(compile(script, "case.py", "exec"), space)  # the text is our own
    again, found = space["problem"](), case(folder).problem()
    assert again.elements == found.elements
    assert [one.contact for one in again.contacts] == [one.contact for one in found.contacts]


def test_the_coefficient_of_the_file_is_the_default(folder):
    """It is told while the structure is made, as one that overrides it is, and the script does the same."""
    model = ss.import_model(folder / "leaves.h5")
    stated = SurfacePair(dependent="upper.z0", independent="lower.z1", mu=0.15, interaction="DRY", card="*FRICTION")
    save_model(replace(model, contact_pairs={"upper.z0/lower.z1": stated}), folder / "stated.h5")
    text = CASE.replace("leaves.h5", "stated.h5")
    for given, mu, words in (("", 0.15, "mu = 0.15 of"), ("mu = 0.3\n", 0.3, "mu = 0.3 is used, not mu = 0.15 of")):
        told = list[str]()
        read = read_case(tomllib.loads(text.replace("mu = 0.3\n", given)), folder, told.append)
        assert {one.contact.mu for one in read.problem.contacts} == {mu}
        assert f"structure: contacts 'leaf': {words} the deck's *FRICTION (DRY)" in told
    script = python_script(text.replace("mu = 0.3\n", ""), "case.toml", folder)
    space = {"__name__": "script", "__file__": str(folder / "case.py")}
    exec(compile(script, "case.py", "exec"), space)  # the text is our own
    assert {one.contact.mu for one in space["problem"]().contacts} == {0.15}
    with pytest.raises(ss.InputError, match=r"'leaf' mu is missing; give the friction coefficient: the model has none"):
        case(folder, CASE.replace("mu = 0.3\n", "")).problem()


def test_joints_beside_contacts_on_a_surface_and_followed_parameters(folder):
    text = CASE.replace('base = ["z"]', 'base = ["z"]\nsurface = "lower.x1"\ncontacts = 2')
    text = text.replace(
        "[response]",
        """
[[contact]]
name = "end"
points = "all"
direction = [0, 1, 0]
kt = 1e5
mu = 0.2
normal_load = 10.0

[response]
parameter = "leaf.mu"
omega = 5000.0""",
    ).replace("from = 5000.0\nto = 5200.0", "from = 0.2\nto = 0.4")
    found = case(folder, text)
    assert found.problem().elements[:2] == ("end 1", "end 2")
    assert found.problem().elements[-1] == "leaf 6"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"upper.z0"]', '"upper.z7"]', r"\[\[joint\]\] 'leaf' surfaces: surface 'upper.z7' is not in the mesh"),
        ('"upper.z0"]', '"upper.z1"]', r"\[\[joint\]\] 'leaf' surfaces: surface 'lower.z1' and surface 'upper.z1' lie"),
        ('["lower.z1", "upper.z0"]', '["lower.z1"]', r"\[\[joint\]\] 'leaf' surfaces: found"),
        ("kt = 1e11", "kt = -1.0", r"\[\[joint\]\] 'leaf' kt: found -1.0; expected a number >= 0"),
        ("kt = 1e11\n", "", r"\[\[joint\]\] 'leaf' kt is missing"),
        ("points = 6", "point = 6", r"unknown key 'point' in \[\[joint\]\] 'leaf'; did you mean 'points'"),
        ("points = 6", "gap = 0.0\nnormal_load = 1.0", r"\[\[joint\]\] 'leaf' gap is given together with normal_load"),
        ("[response]", "[thermal]\nambient = 20.0\n[response]", r"\[\[joint\]\] is given together with thermal"),
        ("[response]", SECOND, "leaf"),
        ("points = 6", "points = 6\nexponent = 0.33", r"\[\[joint\]\] 'leaf' exponent: belongs to patches"),
        ("points = 6", "points = 6\npatches = 2", r"\[\[joint\]\] 'leaf' patches: needs load steps"),
        ("points = 6", "points = 6\npatches = 7", r"\[\[joint\]\] 'leaf' patches: found 7; expected at most 6"),
        (
            "points = 6",
            "points = 6\npatches = 0",
            r"\[\[joint\]\] 'leaf' patches: found 0; expected a whole number >= 1",
        ),
        ("modes = 20", 'modes = 20\n"[[joint]]" = 5', r"unknown key 'joint' in \[structure\]"),
        ("modes = 20", "modes = 20\njoint = []", r"unknown key 'joint' in \[structure\]"),
        ("modes = 20", "modes = 20\njoints = []", r"unknown key 'joints' in \[structure\]"),
        (
            'kind = "fe"\nfile = "leaves.h5"',
            'kind = "blade"\nsize = "coarse"',
            r'\[\[joint\]\]: the structure is of kind "blade"',
        ),
    ],
)
def test_faults_of_joints_are_told_at_their_key(folder, old, new, said):
    assert old in CASE
    with pytest.raises(ss.InputError, match=said) as caught:
        case(folder, CASE.replace(old, new))
    assert "nothing is kept" not in str(caught.value)


def test_warnings_of_joints_are_those_of_the_case(folder):
    found = case(folder, CASE.replace("points = 6", "points = 1"))
    assert any("1 patch for both surfaces" in sentence for sentence in found.warnings())


PRESSED = CASE.replace("points = 6\n", 'points = 6\npressure = "p.csv"\n')


@pytest.fixture
def pressed(folder):
    """A table of places with areas: 2 MPa, more to one side."""
    x, y = (part.ravel() for part in np.meshgrid((np.arange(12) + 0.5) / 200.0, (np.arange(8) + 0.5) / 200.0))
    rows = np.stack([x, y, np.full_like(x, 0.004), 2e6 * (1.0 + 5.0 * x), np.full_like(x, 2.5e-5)], axis=1)
    np.savetxt(folder / "p.csv", rows, delimiter=",", header="x,y,z,CPRESS,area", comments="", fmt="%.17g")
    return folder


def test_pressures_of_a_file_are_those_of_python(pressed):
    problem = case(pressed, PRESSED).problem()
    model = ss.import_model(pressed / "leaves.h5")
    law = ss.PlanarFrictionContact(kt=1e11, kn=1e12, mu=0.3, gap=0.0)
    joint = ss.surface_pair(
        model, "lower.z1", "upper.z0", contact=law, name="leaf", points=6, pressure=pressed / "p.csv"
    )
    assert joint.mapped.force[2] == pytest.approx(2e6 * (1.0 + 5.0 * 0.03) * 0.06 * 0.04, rel=1e-12)
    assert [one.contact.gap for one in problem.contacts] == [one.contact.gap for one in joint]
    assert list(problem.loads)[-len(joint.loads) :] == joint.loads
    space = {"__name__": "script", "__file__": str(pressed / "case.py")}
    exec(compile(python_script(PRESSED, "case.toml", pressed), "case.py", "exec"), space)  # the text is our own
    again = space["problem"]()
    assert [one.contact for one in again.contacts] == [one.contact for one in problem.contacts]
    assert list(again.loads) == list(problem.loads)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"p.csv"', '"q.csv"', "there is no such file"),
        ('"p.csv"', '"../p.csv"', "the path leaves the folder of the case"),
        ('"p.csv"', '"leaves.h5"', "cannot be read as text"),
        ('"p.csv"', '"p.csv"\ncolumns = { pressure = "q" }', "there is no column 'q'"),
        ('"p.csv"', '"p.csv"\ngap = 1e-6', "is given together with pressure"),
        ('pressure = "p.csv"', 'columns = { pressure = "q" }', "belongs to a file of pressures"),
    ],
)
def test_faults_of_a_file_of_pressures(pressed, old, new, said):
    with pytest.raises(ss.InputError) as caught:
        case(pressed, PRESSED.replace(old, new)).problem()
    assert said in str(caught.value)
    assert "joint" in str(caught.value)


BOLTED = """
[[bolt]]
name = "bolt"
elongation = { "upper.z1 z" = 1.0, "lower.z0 z" = -1.0 }
stiffness = 1e8
force = 50.0

[[load]]
dof = "lower.x1 y"
cos = 2.0

[response]
"""


def test_bolts_and_loads_lie_on_means_of_surfaces(folder):
    text = CASE.replace("[response]", BOLTED)
    with pytest.raises(InputError) as error:
        case(folder, text)
    named = '"lower.x1 y", "upper.z1 z", "lower.z0 z"'
    assert str(error.value) == f"[structure] keep: lacks dofs of the mesh that other tables name; add keep = [{named}]"
    made = case(folder, text.replace("modes = 20", f"modes = 20\nkeep = [{named}]"))
    state = made.preloaded
    assert state.dataset.normal_force.values[0, -1] == pytest.approx(50.0, rel=1e-9)
    assert made.problem().contacts[-1].name == "bolt"


def test_contacts_are_gathered_into_patches_after_the_load_steps(folder):
    named = '"lower.x1 y", "upper.z1 z", "lower.z0 z"'
    text = CASE.replace("[response]", BOLTED).replace("modes = 20", f"modes = 20\nkeep = [{named}]")
    whole = case(folder, text)
    text = text.replace("points = 6", "points = 6\npatches = 2\nexponent = 0.25")
    made = case(folder, text)
    joint = whole.body.joints[0].gathered(2, whole.preloaded, exponent=0.25)
    problem = joint.replaced_in(whole.problem_)
    state = ss.preload(problem, made.steps.steps, pairs=joint)
    again = problem.preloaded(state)
    assert made.problem().elements == again.elements
    assert [len(pair) for pair in made.problem().contacts] == [len(pair) for pair in joint] + [1]
    np.testing.assert_allclose(made.preloaded.dataset.normal_force, state.dataset.normal_force, rtol=1e-12)
    assert set(made.preloaded.dataset.joint.values) == {"leaf", "bolt"}
    space = {"__name__": "script", "__file__": str(folder / "case.py")}
    exec(compile(python_script(text, "case.toml", folder), "case.py", "exec"), space)  # the text is our own
    scripted = space["problem"]()
    assert scripted.elements == again.elements
    for one, other in zip(scripted.contacts, again.contacts, strict=True):
        np.testing.assert_allclose(one.values("kt"), other.values("kt"), rtol=1e-12)
        np.testing.assert_allclose(one.values("gap"), other.values("gap"), rtol=1e-9, atol=1e-18)
