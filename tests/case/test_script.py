"""A script says what its case says: the same numbers to the last bit."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse
from helpers.cases import BLOCKS

import slipstick as ss
from slipstick.case.script import python_script
from slipstick.case.script_text import Call, literal, quantity_text
from slipstick.cli.examples import examples
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.io.model_file import save_model
from slipstick.quantities import read_angle, read_frequency

CASES = [name for name, example in examples().items() if example.is_case]
OSCILLATOR = examples()["oscillator"].path.read_text(encoding="utf-8")
pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def written(path: Path) -> Any:
    """The script of a case file, as a module."""
    script = path.with_suffix(".py")
    script.write_text(python_script(path.read_text("utf-8"), path.name, path.parent), encoding="utf-8")
    spec = importlib.util.spec_from_file_location(f"script_{path.stem}", script)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def same(path: Path) -> None:
    theirs, ours = written(path).compute().dataset, ss.Case.from_file(path).run().dataset
    assert set(theirs) == set(ours)
    for name in (*ours, *ours.coords):
        np.testing.assert_array_equal(theirs[name].values, ours[name].values, err_msg=name)
        assert theirs[name].attrs == ours[name].attrs
    kept = {"case", "case_file", "seconds", "frequency_unit"}
    assert {k: v for k, v in theirs.attrs.items() if k not in kept | {"title"}} == {
        k: v for k, v in ours.attrs.items() if k not in kept | {"title"}
    }


def copied(name: str, folder: Path, *changes: tuple[str, str]) -> Path:
    found = examples()[name]
    for path in found.needs:
        (folder / path.name).write_bytes(path.read_bytes())
    text = found.path.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / found.path.name).write_text(text, encoding="utf-8")
    return folder / found.path.name


SHORT = {
    "blade": [('to = "330 Hz"', 'to = "151 Hz"'), ("modes = 32", "modes = 4\ncontacts = 2\nforce = true")],
    "blade_reduced": [('to = "240 Hz"', 'to = "200 Hz"')],
    "blade_reduced_hot_rub": [('to = "240 Hz"', 'to = "196 Hz"')],
    "blade_reduced_no_rub": [('to = "325 Hz"', 'to = "295 Hz"')],
    "joint": [('to = "195 Hz"', 'to = "185 Hz"')],
}
"""The whole curves are for `make verify`."""


@pytest.mark.parametrize("name", CASES)
def test_every_example_in_part(tmp_path: Path, name: str) -> None:
    same(copied(name, tmp_path, *SHORT.get(name, [])))


@pytest.mark.verify
@pytest.mark.parametrize("name", SHORT)
def test_every_example(tmp_path: Path, name: str) -> None:
    same(copied(name, tmp_path))


MORE = {
    "a parameter": (
        "from = 2.0",
        'parameter = "damper.velocity"\nomega = "40 rpm"\nfrom = 10.0\npeaks_of = "x"\nmax_step = 0.05',
    ),
    "kilohertz": ("from = 2.0", 'from = "0.0004 kHz"\nat = ["0.5 Hz", 4.0, "3.5 rad/s"]'),
    "logarithmic points": ("from = 2.0", 'from = "0.4 Hz"\nat = { count = 7, spacing = "log" }'),
    "points": ("from = 2.0", "from = 2.0\nat = { count = 5 }"),
    "units": ("harmonics =", 'units = { length = "mm", time = "s" }\nharmonics ='),
    "orders": ('harmonics = "0..10"', "harmonics = [0, 1, 2, 3, 4, 6]\nperiod_ratio = [2, 1]"),
    "a phase": ("sin = 100.0", 'amplitude = 100.0\nphase = "-30 deg"'),
    "a table of cosines": ('tangential = "x"', "tangential = { x = -0.5 }"),
    "a gap": ("normal_load = 800.0", "kn = 20.0\ngap = -40.0"),
    "mu over temperature": (
        "mu = 0.3",
        'mu = { table = [[20, 0.3], [99, 0.25], [300, 0.2]], interpolation = "natural" }\n'
        "thermal = { background = 20.0, resistance = 0.1 }",
    ),
    "a loss factor": ("stiffness =", "loss_factor = 0.01\nstiffness ="),
    "title": ("SDOF oscillator", 'A \\"mass\\" \\\\ of ö'),
}


@pytest.mark.parametrize("what", MORE)
def test_what_a_case_may_say(tmp_path: Path, what: str) -> None:
    same(copied("oscillator", tmp_path, MORE[what], ("to = 15.0", "to = 5.0")))


def test_matrices_in_files(tmp_path: Path) -> None:
    K = np.array([[60.0, -20.0], [-20.0, 20.0]])
    scipy.io.mmwrite(tmp_path / "K.mtx", scipy.sparse.coo_array(K), symmetry="symmetric")
    np.savez(tmp_path / "M.npz", mass=np.diag([1.0, 0.5]))
    scipy.sparse.save_npz(tmp_path / "C.npz", scipy.sparse.csr_array(0.01 * K))
    structure = '[structure]\nkind = "matrices"\ncount = 2\nmass = "M.npz"\nstiffness = "K.mtx"\ndamping = "C.npz"\n\n'
    begin, end = OSCILLATOR.index("[structure]"), OSCILLATOR.index("[[load]]")
    text = (OSCILLATOR[:begin] + structure + OSCILLATOR[end:]).replace('"x"', '"2"').replace("to = 15.0", "to = 4.0")
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    same(tmp_path / "case.toml")


SINGLE = """
[[contact]]
name = "beside"
tangential = "c2x"
kt = 1e5
mu = 0.3
normal_load = 1.0
thermal = { resistance = 3.0 }
"""
HEATS = {
    "with one beside": '[thermal]\ninfluence = "structure"\nbackground = 20.0\n',
    "of the structure": '[thermal]\ninfluence = "structure"\nbackground = 20.0\n',
    "of some": '[thermal]\ninfluence = "structure"\nbackground = 20.0\ncontacts = ["pad 1", "curve 3"]\n',
    "in numbers": "[thermal]\ninfluence = [[3.0, 1.0], [1.0, 3.0]]\nbackground = 20.0\n",
}


@pytest.mark.parametrize("heat", HEATS)
def test_a_finite_element_model_with_heat(tmp_path: Path, heat: str) -> None:
    mesh = MeshModel(mesh=box((0.2, 0.02, 0.01), (4, 2, 1), "hex20"))
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    save_model(assemble_mesh(mesh, source="beam", material=steel, fixed=["x0"]), tmp_path / "model.h5")
    blocks = BLOCKS.replace("points = [2, 1]", "points = [1]") if heat == "in numbers" else BLOCKS
    if heat == "with one beside":
        blocks += SINGLE
    if heat == "in numbers":
        blocks = blocks.replace("thermal = { resistance = 2.0 }\n", "")
    text = f"""format = 1
harmonics = "0..3"
[structure]
kind = "fe"
file = "model.h5"
material = {{ conductivity = 40.0 }}
surface = {{ direction = [0, 1, 0], depth = 0.3 }}
contacts = 3
radius = 1.2e-2
pressure = {{ push = "z1" }}
base = ["z"]
rotation = {{ speed = 100, models = {{ "200" = "model.h5" }} }}
films = {{ boundary = 100.0 }}
cold = "x0"
modes = 6
loss_factor = 0.01
[[load]]
shape = "push"
cos = 500.0
[[load]]
base = "z"
motion = "acceleration"
cos = 2.0
{blocks}
[response]
from = "150 Hz"
to = "170 Hz"
{HEATS[heat]}
"""
    (tmp_path / "case.toml").write_text(text)
    same(tmp_path / "case.toml")


def test_own_resistances_beside_an_influence_matrix(tmp_path: Path) -> None:
    mu = "{ table = [[20, 0.3], [300, 0.2]] }"
    text = copied("opening_contact", tmp_path).read_text()
    first = text[text.index("[[contact]]") : text.index("[response]")].replace("mu = 0.3", f"mu = {mu}")
    second = (
        first.replace('"shoe"', '"heel"').replace('"x"', "{ x = 0.5 }")
        + "thermal = { background = 30.0, resistance = 0.2 }\n"
    )
    heat = '[thermal]\ninfluence = [[0.1]]\ncontacts = ["shoe"]\nbackground = 20.0\n'
    text = text.replace(text[text.index("[[contact]]") : text.index("[response]")], first + second + heat)
    (tmp_path / "case.toml").write_text(text.replace("to = 15.0", "to = 4.0"))
    same(tmp_path / "case.toml")


@pytest.mark.parametrize("value, text", [
    ("150 Hz", "150.0 * HZ"), ("3e3rpm", "3000.0 * RPM"), (".5 kHz", "0.5 * KHZ"), ("2 rad/s", "2.0"),
    ("-90 deg", "-90.0 * DEG"), ("90°", "90.0 * DEG"), (3, "3.0"), ("1e-3 rad", "0.001"),
])  # fmt: skip
def test_quantities(value: Any, text: str) -> None:
    assert quantity_text(value) == text


def test_literals_are_exact() -> None:
    for number in (0.1, 1e300, 5e-324, -2.08e11, 1 / 3, 123456789.123456789, 1e6, -0.0):
        assert eval(literal(number)) == number
    assert eval(literal({"a": ["x" * 99, None, True, (1, 2.5)] * 9})) == {"a": ["x" * 99, None, True, (1, 2.5)] * 9}


@pytest.mark.parametrize("reduced", [False, True])
def test_matrices_of_a_model_file(reduced: bool, tmp_path: Path) -> None:
    """As they are; and with Coriolis forces, made smaller with these."""
    mesh = MeshModel(mesh=box((0.2, 0.02, 0.01), (2, 1, 1), "hex20"))
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    save_model(assemble_mesh(mesh, source="beam", material=steel, fixed=["x0"]), tmp_path / "model.h5")
    end = next(name for name in ss.import_model(tmp_path / "model.h5").dofs if name.endswith("z"))
    (tmp_path / "case.toml").write_text(f"""format = 1
harmonics = "0..1"
[structure]
kind = "matrices"
file = "model.h5"
rotation = {{ speed = "3000 rpm", axis = {{ direction = [0, 1, 0] }}{", coriolis = true" if reduced else ""} }}
loss_factor = 0.02
{f'keep = ["{end}"]' if reduced else ""}
{"modes = 5" if reduced else ""}
[[load]]
dof = "{end}"
cos = 1.0
[[contact]]
name = "pad"
tangential = "{end}"
kt = 1e4
mu = 0.3
normal_load = 0.1
[response]
from = "50 Hz"
to = "52 Hz"
""")
    same(tmp_path / "case.toml")


@pytest.mark.parametrize("speed", ['speed = "30 rpm"\ncirculatory = [[0.0, 0.05], [-0.05, 0.0]]', "engine_order = 1"])
def test_a_rotor(speed: str, tmp_path: Path) -> None:
    """Skew matrices, speeds with units and unbalance in a case: what its script makes, and the library."""
    (tmp_path / "rotor.toml").write_text(f"""format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["x", "y"]
mass = [[2.0, 0.0], [0.0, 2.0]]
damping = [[0.4, 0.1], [-0.1, 0.4]]
stiffness = [[40.0, 1.0], [-1.0, 45.0]]
gyroscopic = [[0.0, 1.2], [-1.2, 0.0]]
{speed}
[[load]]
dof = "x"
motion = "unbalance"
cos = 0.4
[[contact]]
name = "damper"
tangential = "x"
kt = 5.0
mu = 0.3
normal_load = 4.0
[response]
from = 2.0
to = 6.0
""")
    same(tmp_path / "rotor.toml")
    turning = ss.Case.from_file(tmp_path / "rotor.toml").problem().structure.turning_with(np.pi)
    assert turning.speed == pytest.approx(np.pi)
    given = {"M": 2.0 * np.eye(2), "K": [[40.0, 1.0], [-1.0, 45.0]], "C": [[0.4, 0.1], [-0.1, 0.4]], "dofs": ["x", "y"]}
    turns = {"gyroscopic": [[0.0, 1.2], [-1.2, 0.0]]}
    turns |= {"circulatory": [[0.0, 0.05], [-0.05, 0.0]]} if "circulatory" in speed else {}
    own = ss.MatrixStructure(**given, **turns, speed=np.pi)
    both = (s.project(np.eye(2), np.eye(2)).at([1], 3.0)[0] for s in (turning, own))
    np.testing.assert_allclose(*both, rtol=1e-12)


ROTOR = """format = 1
harmonics = "0..3"
[structure]
kind = "rotor"
material = { young = 211e9, poisson = 0.3, density = 7810.0 }
shaft = [{ length = 1.0, outer = 0.05, elements = 4 }, { length = 0.5, outer = 0.05, inner = 0.01, elements = 2 }]
discs = [
  { node = 2, width = 0.07, outer = 0.28, inner = 0.05 },
  { node = 4, mass = 30.0, polar = 0.5, diametral = 0.3 },
]
bearings = [
  { node = 0, kxx = 1e6, kyy = 0.8e6, cxx = 400.0 },
  { node = 6, kxx = 1e6, cxx = 400.0, kxy = 1e4, kyx = -1e4 },
]
rayleigh = [1.0, 1e-6]
SPEED
[[load]]
dof = "n2x"
motion = "unbalance"
cos = 0.02
[[load]]
dof = "n2y"
motion = "unbalance"
sin = 0.02
[[contact]]
name = "stator"
law = "stator"
ports = { x = "n2x", y = { n2y = 1.0 } }
kn = 2e6
gap = 2e-4
mu = 0.1
cn = 100.0
slip_velocity = 0.01
rubbing = { velocity_per_omega = 0.14 }
[response]
from = 76.0
to = 77.0
[output]
dofs = ["n2x", "n2y"]
"""
SPEEDS = ["engine_order = 1", 'speed = "700 rpm"\ninternal_damping = 1e-6\nshear = false',
          'engine_order = 1\nkeep = ["n2x", "n2y"]\nmodes = 4']  # fmt: skip


@pytest.mark.parametrize("speed", SPEEDS, ids=["tied", "fixed", "reduced"])
def test_a_rotor_of_beams_in_a_stator(speed: str, tmp_path: Path) -> None:
    (tmp_path / "rotor.toml").write_text(ROTOR.replace("SPEED", speed))
    same(tmp_path / "rotor.toml")
    problem = ss.Case.from_file(tmp_path / "rotor.toml").problem()
    steel = ss.Material(young=211e9, poisson=0.3, density=7810.0)
    keys = {"speed": 700.0 * (np.pi / 30), "internal_damping": 1e-6, "shear": False} if "rpm" in speed else {}
    own = ss.models.beam_rotor(
        [
            ss.models.Shaft(length=1.0, outer=0.05, elements=4),
            ss.models.Shaft(length=0.5, outer=0.05, inner=0.01, elements=2),
        ],
        material=steel,
        discs=[
            ss.models.Disc.of(node=2, material=steel, width=0.07, outer=0.28, inner=0.05),
            ss.models.Disc(node=4, mass=30.0, polar=0.5, diametral=0.3),
        ],
        bearings=[
            ss.models.Bearing(node=0, kxx=1e6, kyy=0.8e6, cxx=400.0),
            ss.models.Bearing(node=6, kxx=1e6, cxx=400.0, kxy=1e4, kyx=-1e4),
        ],
        rayleigh=(1.0, 1e-6), **(keys or {"engine_order": 1}),
    )  # fmt: skip
    if "keep" in speed:
        own = ss.models.craig_bampton(own, ["n2x", "n2y"], modes=4)
    assert problem.structure.dofs == own.dofs
    assert list(problem.structure.arguments) == list(own.arguments)
    for name, value in own.arguments.items():
        np.testing.assert_array_equal(problem.structure.arguments[name], value, err_msg=name)
    law = ss.models.StatorContact(kn=2e6, gap=2e-4, mu=0.1, cn=100.0, slip_velocity=0.01)
    (pair,) = problem.contacts
    assert pair.contact == law
    assert pair.ports == {"x": {"n2x": 1.0}, "y": {"n2y": 1.0}}


FREE = """format = 1
harmonics = "0..3"
[structure]
kind = "free"
{structure}
keep = ["a", "c"]
modes = 2
damping_ratio = 0.01
[[load]]
dof = "a"
sin = 3.0
[[contact]]
name = "clamp"
tangential = {{ a = 1.0, c = -1.0 }}
kt = 5.0
mu = 0.3
normal_load = 2.0
[response]
from = 3.0
to = 4.0
"""


def test_a_body_that_is_not_held(tmp_path: Path) -> None:
    """By its matrices, and the same from a model file."""
    structure = """dofs = ["a", "b", "c"]
mass = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]]
stiffness = [[30.0, -30.0, 0.0], [-30.0, 50.0, -20.0], [0.0, -20.0, 20.0]]"""
    (tmp_path / "free.toml").write_text(FREE.format(structure=structure))
    same(tmp_path / "free.toml")
    found: Any = ss.Case.from_file(tmp_path / "free.toml").problem().structure
    K = [[30.0, -30.0, 0.0], [-30.0, 50.0, -20.0], [0.0, -20.0, 20.0]]
    own = ss.models.free_structure(
        K, np.diag([1.0, 2.0, 1.0]), dofs=["a", "b", "c"], keep=["a", "c"], modes=2, damping_ratio=0.01
    )
    rows = np.eye(2)
    np.testing.assert_array_equal(found.project(rows, rows).at([1], 3.3)[0], own.project(rows, rows).at([1], 3.3)[0])


def test_a_model_file_of_a_body_that_is_not_held(tmp_path: Path) -> None:
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    model = assemble_mesh(MeshModel(mesh=box((0.2, 0.02, 0.01), (2, 1, 1), "hex20")), source="beam", material=steel)
    save_model(model, tmp_path / "model.h5")
    text = FREE.format(structure='file = "model.h5"').replace("modes = 2", "modes = 3")
    nodes = model.mesh.nodes
    ends = [f"n{k + 1}x" for k in (0, int(np.argmax(nodes[:, 0] - nodes[:, 1] - nodes[:, 2])))]
    text = text.replace('"a"', f'"{ends[0]}"').replace('"c"', f'"{ends[1]}"')
    text = text.replace("a = 1.0, c = -1.0", f"{ends[0]} = 1.0, {ends[1]} = -1.0")
    (tmp_path / "free.toml").write_text(text)
    script = written(tmp_path / "free.toml").problem().structure
    found: Any = ss.Case.from_file(tmp_path / "free.toml").problem().structure
    own = ss.models.free_structure(model.K, model.M, dofs=model.dofs, keep=ends, modes=3, damping_ratio=0.01)
    assert found.dofs == tuple(ends)
    for structure in (found, script):
        np.testing.assert_array_equal(structure.natural_frequencies, own.natural_frequencies)


def test_a_blade_without_a_size_is_the_small_one(tmp_path: Path) -> None:
    text = examples()["blade"].path.read_text(encoding="utf-8").replace('size = "small"', "")
    assert 'ss.reduced_blade(\n        "small",' in python_script(text, "blade.toml", tmp_path)


def test_a_stop_may_say_that_it_has_no_stiffness_along_itself(tmp_path: Path) -> None:
    changes = [('tangential = "x" ', 'normal = "x" '), ("kt = 100.0", "kt = 0.0"), ("mu = 0.3", "kn = 50.0")]
    path = copied("oscillator", tmp_path, *changes, ("rubbing = { velocity = 10.0 }", ""))
    assert written(path).problem().contacts == ss.load_case(path).contacts


def test_what_a_contact_does_not_say_is_not_said_for_it(tmp_path: Path) -> None:
    """The law of a case is that of its script; without kn, wear warns of it."""
    path = copied("oscillator", tmp_path)
    (law,) = (pair.contact for pair in ss.load_case(path).contacts)
    assert repr(law) == "FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)"
    path.write_text(path.read_text(encoding="utf-8") + "[wear]\nkappa = 1e-6\nto = 10.0\nomega = 9.0\n")
    assert any("kn is not given and taken as 1" in said for said in ss.Case.from_file(path).warnings())


def test_numbers_with_units_are_written_with_them() -> None:
    speed = read_frequency("12800 rpm")
    assert literal({"speed": speed}) == '{"speed": 12800.0 * RPM}'
    call = Call("ss.Load", named={"dof": "x", "amplitude": 2.0, "phase": read_angle("-450 deg")})
    assert call.written() == 'ss.Load(dof="x", amplitude=2.0, phase=-450.0 * DEG)'
    assert call.made() == ss.Load(dof="x", amplitude=2.0, phase=-np.pi / 2)
