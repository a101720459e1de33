"""Pre-tension sections of decks as bolts: cut, tightened by the deck's steps, and the same in a case file."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import slipstick as ss
from slipstick.case.script import python_script
from slipstick.errors import InputError
from slipstick.fem.assembly import assemble
from slipstick.fem.box import box
from slipstick.fem.interfaces import PretensionSection
from slipstick.fem.pretension import cut_sections
from slipstick.importers.import_model import read_model
from slipstick.io.model_file import load_model, save_model

YOUNG, LENGTH, FORCE, PUSH = 2e5, 4.0, 5000.0, 800.0
"""Of a bar of section 1, held at both ends; mm, N."""

STEPS = """*STEP, NAME=Tighten
*STATIC
*CLOAD
PULL, 1, 5000.
*END STEP
*STEP, NAME=Work
*STATIC
*BOUNDARY, FIXED
PULL, 1, 1
*END STEP
"""


def deck(section="*PRE-TENSION SECTION, SURFACE=Cut, NODE=PULL\n0., 0., 1.\n", steps=STEPS, more="", across="LOW, S2"):
    """A column of 2 x 2 x 4 bricks from z = 0 to 4, cut at z = 2; elements are LOW below and HIGH above it."""
    mesh = box((1.0, 1.0, LENGTH), (2, 2, 4), "hex8")
    nodes = "".join(f"{n}, {x:.9g}, {y:.9g}, {z:.9g}\n" for n, (x, y, z) in zip(mesh.labels, mesh.nodes, strict=True))
    rows = [
        (e + 1, [*mesh.labels[nodes]], mesh.nodes[nodes].mean(axis=0)[2]) for e, nodes in enumerate(mesh.blocks["hex8"])
    ]
    elements = "".join(f"{e}, {', '.join(map(str, nodes))}\n" for e, nodes, _ in rows)
    low = ", ".join(str(e) for e, _, z in rows if 1.0 < z < 2.0)
    high = ", ".join(str(e) for e, _, z in rows if 2.0 < z < 3.0)
    ends = ", ".join(str(n) for n, (_, _, z) in zip(mesh.labels, mesh.nodes, strict=True) if z in (0.0, LENGTH))
    return (
        f"*NODE\n{nodes}*NODE, NSET=PULL\n99, 5., 5., 2.\n*ELEMENT, TYPE=C3D8, ELSET=EALL\n{elements}"
        f"*ELSET, ELSET=LOW\n{low}\n*ELSET, ELSET=HIGH\n{high}\n*NSET, NSET=ENDS\n{ends}\n"
        f"*SURFACE, NAME=Cut, TYPE=ELEMENT\n{across}\n{more}{section}"
        f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{YOUNG}, 0.\n*DENSITY\n7.8e-9\n*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n"
        f"*BOUNDARY\nENDS, 1, 3\n{steps}"
    )


def read(folder, **parts):
    path = folder / "bar.inp"
    path.write_text(deck(**parts))
    return read_model(path, quiet=True)


def at_height(model, z):
    """Dofs along z of the nodes of the bar at a height."""
    labels = model.node_ids[(np.abs(model.coordinates[:, 2] - z) < 1e-9) & (model.coordinates[:, 0] < 2.0)]
    return [dof for dof in (f"n{label}z" for label in labels) if dof in model.dofs]


def test_the_uncut_model_is_that_with_the_shortening_held(tmp_path):
    model = read(tmp_path)
    cut, (section,) = cut_sections(model, ["CUT"])
    assert (section.dof, section.normal.tolist(), section.area) == ("n99x", [0.0, 0.0, 1.0], pytest.approx(1.0))
    assert cut.n_dofs == model.n_dofs + 1
    again = load_model(save_model(cut, tmp_path / "cut.h5"), quiet=True)
    for one in (cut, again):
        whole = one.fix("n99x")
        assert (whole.dof_nodes.tolist(), whole.dof_components.tolist()) == (
            model.dof_nodes.tolist(), model.dof_components.tolist()
        )  # fmt: skip
        assert abs(whole.K - model.K).max() <= 1e-10 * abs(model.K).max()
        assert abs(whole.M - model.M).max() <= 1e-10 * abs(model.M).max()


@pytest.mark.parametrize("kind", ["hex8", "hex20", "tet10", "hex8r"])
def test_matrices_are_those_of_the_doubled_mesh(kind):
    """Assembled on the cut mesh, and taken through the motion of its nodes; a face beyond goes with its element."""
    base = box((1.0, 1.0, 3.0), (2, 1, 3), kind.removesuffix("r"))
    mesh = replace(base, blocks={kind: base.blocks[kind.removesuffix("r")]})
    steel = ss.Material(young=2e5, poisson=0.3, density=7.8e-9)
    from slipstick.fem.elements import ELEMENTS
    from slipstick.fem.mesh import Surface
    from slipstick.fem.model import elastic_model

    faces = {}
    for element in mesh.blocks[kind]:
        for shape, local in ELEMENTS[kind].faces:
            face = element[list(local)]
            if np.allclose(mesh.nodes[face, 2], 1.0) and mesh.nodes[element, 2].mean() < 1.0:
                faces.setdefault(shape, []).append(face)
    section = Surface(faces={shape: np.array(part) for shape, part in faces.items()})
    model = elastic_model(replace(mesh, surfaces={**mesh.surfaces, "CUT": section}), steel, ["z0"])
    model = replace(model, pretension_sections={"CUT": PretensionSection(node=0)})
    cut, (made,) = cut_sections(model, ["CUT"])
    full = assemble(cut.mesh, steel)
    for ours, whole in ((cut.K, full.stiffness), (cut.M, full.mass)):
        exact = cut.motion.T @ whole @ cut.motion
        assert abs(exact - ours).max() <= 1e-12 * abs(ours).max()
    side = cut.mesh.surface("x0").nodes
    assert np.isin(made.doubled, cut.mesh.labels[side]).any()
    assert np.isin(made.nodes, cut.mesh.labels[side]).any()


def test_a_force_on_the_node_is_carried_by_every_section(tmp_path):
    """Without other loads: by the supports at both ends, and by the shortening in closed form, F L / (E A)."""
    model = read(tmp_path)
    cut, _ = cut_sections(model, ["CUT"])
    forces = np.zeros(cut.n_dofs)
    forces[cut.index("n99x")] = FORCE
    moved = np.linalg.solve(cut.K.toarray(), forces)
    assert moved[cut.index("n99x")] == pytest.approx(FORCE * LENGTH / YOUNG, rel=1e-10)
    inner = assemble(cut.mesh, cut.materials).stiffness @ (cut.motion @ moved)
    for end, sign in ((0.0, -1.0), (LENGTH, 1.0)):
        nodes = np.flatnonzero(np.abs(cut.mesh.nodes[:, 2] - end) < 1e-9)
        assert inner.reshape(-1, 3)[nodes, 2].sum() == pytest.approx(sign * FORCE, rel=1e-10)


def tightened(screws, push, **options):
    """The bolts' steps, and one that pushes the plane at z = 3 upwards."""
    held = at_height(screws.model, 3.0)
    body = ss.reduced_body(screws.model, keep=[*screws.keep, *held], modes=5)
    loads = [ss.Load(dof=dof, harmonic=0, cos=push / len(held)) for dof in held]
    problem = ss.Problem(body.structure, contacts=list(screws), outputs=[*screws.keep, held[0]], harmonics=1)
    return ss.preload(problem, [*screws.steps, ss.LoadStep(name="push", loads=loads, **options)])


def test_the_steps_of_the_deck_tighten_it_and_loads_share_as_springs(tmp_path):
    """Held in length, of a push at three quarters a quarter goes into the section below, as in a whole bar."""
    bolts = ss.models.pretension_bolts(read(tmp_path))
    assert [pair.name for pair in bolts] == ["CUT"]
    assert bolts.steps == (ss.LoadStep(name="TIGHTEN", bolts={"CUT": FORCE}), ss.LoadStep(name="WORK"))
    state = tightened(bolts, PUSH)
    force = state.dataset.normal_force.sel(contact="CUT")
    assert force[:2].values == pytest.approx([FORCE, FORCE], rel=1e-10)
    assert force[2].item() == pytest.approx(FORCE + PUSH / 4.0, rel=1e-5)
    assert state.dataset.displacement[0, 0].item() == pytest.approx(FORCE * LENGTH / YOUNG, rel=1e-8)
    again = tightened(bolts, PUSH, bolts={"CUT": FORCE})
    assert again.dataset.normal_force[2].item() == pytest.approx(FORCE, rel=1e-10)


def test_a_shortening_of_the_deck_and_a_force_that_stays(tmp_path):
    length = 0.05
    steps = f"*STEP\n*STATIC\n*BOUNDARY\nPULL, 1, 1, {length}\n*END STEP\n"
    bolts = ss.models.pretension_bolts(read(tmp_path, steps=steps), {"bolt 1": "CUT"})
    assert bolts.steps == (ss.LoadStep(name="STEP-1", shortening={"bolt 1": length}),)
    assert tightened(bolts, 0.0).dataset.normal_force[0].item() == pytest.approx(length * YOUNG / LENGTH, rel=1e-4)
    kept = STEPS.replace("*BOUNDARY, FIXED\nPULL, 1, 1\n", "*CLOAD\n99, 1, 6000.\n") + "*STEP\n*STATIC\n*END STEP\n"
    again = ss.models.pretension_bolts(read(tmp_path, steps=kept))
    assert [dict(step.bolts) for step in again.steps] == [{"CUT": 5000.0}, {"CUT": 6000.0}]
    off = kept.replace("*CLOAD\n99, 1, 6000.", "*CLOAD, OP=NEW\n44, 3, 1.")
    with pytest.warns(ss.SlipstickWarning, match=r"other loads of the steps that tighten bolts are left out: WORK"):
        off = ss.models.pretension_bolts(read(tmp_path, steps=off))
    assert [dict(step.bolts) for step in off.steps] == [{"CUT": 5000.0}, {"CUT": 0.0}]


def test_a_cut_bolt_is_not_left_loose(tmp_path):
    """Neither by a reduction nor by rotation, for which it is whole; of the model file neither."""
    model = read(tmp_path)
    cut, _ = cut_sections(model, ["CUT"])
    for one in (cut, load_model(save_model(cut, tmp_path / "cut.h5"), quiet=True)):
        assert one.loose_bolts == ["n99x"]
        with pytest.raises(InputError, match="keep has no n99x: a bolt that is cut would be slack"):
            ss.reduced_body(one, keep=at_height(one, 3.0), modes=3)
        with pytest.raises(InputError, match="which nothing holds while it begins to turn"):
            ss.at_speed(one, 100.0, axis={"point": (0.5, 0.5, 0.0), "direction": (0.0, 0.0, 1.0)})
    assert not cut.fix("n99x").loose_bolts
    turning = ss.at_speed(model, 100.0, axis={"point": (0.5, 0.5, 0.0), "direction": (0.0, 0.0, 1.0)})
    later, _ = cut_sections(turning, ["CUT"])
    assert abs(later.fix("n99x").K - turning.K).max() <= 1e-10 * abs(turning.K).max()


def test_what_is_told(tmp_path):
    model = read(tmp_path)
    (kept,) = (sentence for sentence in model.warnings if "PRE-TENSION" in sentence)
    assert "until it is cut ([[bolt]] section of a case, ss.models.pretension_bolts)" in kept
    bolts = ss.models.pretension_bolts(model)
    assert not [sentence for sentence in bolts.model.warnings if "stays whole" in sentence]
    assert "*PRE-TENSION SECTION: the bolt is cut at CUT: 9 nodes doubled, n99x is its shortening" in bolts.notes[0]
    assert bolts.model.notes[-1] == bolts.notes[-1]
    idle = ss.models.pretension_bolts(model, loaded=[])
    assert not idle.steps
    shaped = read(tmp_path, steps=STEPS.replace("*CLOAD", "*CLOAD, AMPLITUDE=Ramp"))
    with pytest.warns(ss.SlipstickWarning, match="amplitudes of loads on bolts are taken for 1: RAMP of TIGHTEN"):
        ss.models.pretension_bolts(shaped)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        free = ss.models.pretension_bolts(read(tmp_path, steps=""))
    assert free.notes[-1] == "bar.inp: no step of the file tightens CUT"


SECOND = "*SURFACE, NAME=Cut2, TYPE=ELEMENT\n{}\n*NODE, NSET=PULL2\n98, 6., 5., 2.\n"
CARD = "*PRE-TENSION SECTION, SURFACE={}, NODE={}\n"


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({"across": "EALL"}, "has a face at node 1 with elements on one side alone: it does not cut the bolt"),
        ({"section": CARD.format("Cut", "PULL") + "0., 0., -1.\n"}, "has the normal (0, 0, -1), which points into the"),
        ({"section": CARD.format("Cut", "PULL") + "1., 0., 1.\n"}, "has the normal (1, 0, 1), 45 degrees off that of"),
        ({"section": CARD.format("LOW", "PULL")}, "names LOW, which is no surface of solid elements; give the faces"),
        ({"across": "LOW, S2\nHIGH, S4"}, "has a face at node"),
        (
            {"more": SECOND.format("HIGH, S1"), "section": CARD.format("Cut", "PULL") + CARD.format("Cut2", "PULL2")},
            "shares 9 nodes with the section CUT",
        ),
        (
            {"more": SECOND.format("HIGH, S2"), "section": CARD.format("Cut", "PULL") + CARD.format("Cut2", "PULL2")},
            "cuts the same bolt as the section CUT: nothing holds the piece between them, the bolt is cut twice",
        ),
        (
            {"more": SECOND.format("HIGH, S2"), "section": CARD.format("Cut", "PULL") + CARD.format("Cut2", "PULL")},
            "shares the node 99 with the section CUT",
        ),
        (
            {"more": "*EQUATION\n2\n99, 1, 1., 44, 3, -1.\n"},
            "has the node 99, which depends on others by an equation or a coupling",
        ),
        (
            {"steps": "*BOUNDARY\nALL, 2\n" + STEPS, "more": "*NSET, NSET=ALL\n99, 1\n"},
            "has the node 99, which is held",
        ),
        ({"steps": STEPS.replace("5000.", "-5000.")}, "is pushed by 5000 in step TIGHTEN; a bolt pulls"),
    ],
)
def test_faults_name_the_card(tmp_path, parts, said):
    model = read(tmp_path, **parts)
    with pytest.raises(InputError) as caught:
        ss.models.pretension_bolts(model)
    assert said in str(caught.value)
    assert str(caught.value).startswith("bar.inp, line ")
    assert "*PRE-TENSION SECTION" in str(caught.value)


def test_a_section_that_is_not_plane_or_not_whole(tmp_path):
    bent = deck().replace(", 0.5, 0.5, 2\n", ", 0.5, 0.5, 2.3\n")
    part = deck().replace("*ELSET, ELSET=LOW\n", "*ELSET, ELSET=LOW\n**")
    first = next(line for line in deck().split("*ELSET, ELSET=LOW\n")[1].splitlines()).split(", ")[0]
    part = part.replace("*ELSET, ELSET=LOW\n", f"*ELSET, ELSET=LOW\n{first}\n")
    for text, said in (
        (bent, "is not plane: node "),
        (part, "does not cut the bolt through: both sides are joined beside it, at element"),
    ):
        (tmp_path / "bar.inp").write_text(text)
        with pytest.raises(InputError) as caught:
            ss.models.pretension_bolts(read_model(tmp_path / "bar.inp", quiet=True))
        assert f"*PRE-TENSION SECTION {said}" in str(caught.value)


def test_what_is_asked_must_be_there(tmp_path):
    model = read(tmp_path)
    for sections, said in (
        ("CUTT", "sections, CUTT is no pre-tension section of the model; did you mean 'CUT'?"),
        (["CUT", "CUT"], "sections, CUT is given twice"),
        ({"a": 1}, "sections: found"),
    ):
        with pytest.raises(InputError, match=said):
            ss.models.pretension_bolts(model, sections)
    with pytest.raises(InputError, match="there is no bolt 'x'"):
        ss.models.pretension_bolts(model, loaded=["x"])
    with pytest.raises(InputError, match="the model has no pre-tension section"):
        ss.models.pretension_bolts(replace(model, pretension_sections={}))
    stiffer = replace(model, K=2.0 * model.K)
    with pytest.raises(InputError, match="the stiffness at its nodes is not that of the elements as assembled here"):
        ss.models.pretension_bolts(stiffer)


CASE = """
format = 1
harmonics = [0, 1]

[structure]
kind = "fe"
file = "bar.inp"
modes = 5
keep = ["n4x"]

[[contact]]
name = "rub"
tangential = "n4x"
kt = 1.0
mu = 0.1
normal_load = 1.0

[[bolt]]
name = "bolt 1"
section = "CUT"

[[preload]]
name = "again"
bolts = { "bolt 1" = 6e3 }

[response]
from = 100.0
to = 200.0
"""


def test_a_section_in_a_case(tmp_path):
    """The deck's steps come first; a force of its own comes in place of them; the script makes the same."""
    (tmp_path / "bar.inp").write_text(deck())
    for text, steps, forces in (
        (CASE, ["TIGHTEN", "WORK", "again"], [5e3, 5e3, 6e3]),
        (CASE.replace('"CUT"', '"CUT"\nforce = 4e3'), ["tighten", "again"], [4e3, 6e3]),
    ):
        case = ss.Case.from_text(text, tmp_path / "case.toml")
        state = case.preloaded
        assert state.dataset.step.values.tolist() == steps
        assert state.dataset.normal_force.sel(contact="bolt 1").values == pytest.approx(forces, rel=1e-10)
        assert case.problem().structure.dofs == ("n4x", "n99x")
        space = {"__name__": "script", "__file__": str(tmp_path / "case.py")}
        exec(compile(python_script(text, "case.toml", tmp_path), "case.py", "exec"), space)  # the text is our own
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that of the import: the bolt is whole until it is cut
            assert space["problem"]().contacts == case.problem().contacts


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"CUT"', '"CAT"', r"\[\[bolt\]\] 'bolt 1' section is no pre-tension section of the model; did you mean 'CUT'"),
        ('"CUT"', '"CUT"\nstiffness = 1.0', r"\[\[bolt\]\] 'bolt 1' stiffness is given together with section"),
        ('section = "CUT"', "stiffness = 1.0", r"\[\[bolt\]\] 'bolt 1' elongation is missing"),
        ('kind = "fe"\nfile = "bar.inp"', 'kind = "blade"', r"\[\[bolt\]\]: the structure is of kind \"blade\""),
        ("modes = 5", 'modes = 5\n"[[bolt]]" = 5', r"unknown key 'bolt' in \[structure\]"),
    ],
)
def test_faults_in_a_case(tmp_path, old, new, said):
    (tmp_path / "bar.inp").write_text(deck())
    assert old in CASE
    with pytest.raises(InputError, match=said):
        ss.Case.from_text(CASE.replace(old, new), tmp_path / "case.toml")


def test_a_model_at_a_temperature_is_cut_with_the_stiffness_it_has(tmp_path):
    path = tmp_path / "bar.inp"
    path.write_text(deck().replace(f"{YOUNG}, 0.\n", f"{YOUNG}, 0., 20.\n{YOUNG / 2}, 0., 120.\n"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        hot = ss.models.at_temperature(read_model(path, quiet=True), {"all": 70.0, "ENDS": 20.0})
    cut, (section,) = cut_sections(hot, ["CUT"])
    held = [k for k, dof in enumerate(cut.dofs) if dof != section.dof]
    assert abs(cut.K[held][:, held] - hot.K).max() <= 1e-10 * abs(hot.K).max()
    along = cut.index(section.dof)
    assert cut.K[[along]][:, [along]].toarray().item() == pytest.approx(section.stiffness)
    # the layer beyond the section has 70 degrees, in the middle of the table
    assert section.stiffness == pytest.approx(0.75 * YOUNG, rel=1e-9)
