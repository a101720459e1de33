"""Contacts about the axis of a rotor in a case file: what they become, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.case.script import python_script
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.io.model_file import save_model

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

CONTACT = """name = "tip"
points = "all"
direction = "circumferential"
normal = "radial"
axis = { point = [0, -0.3, -0.1], direction = [1, 0, 0], zero = [0, 1, 0] }
rotor = { engine_order = 2, profile = { cos = { "2" = 3e-4 } } }
kt = 1e5
kn = 1e5
mu = 0.15
gap = 2.9e-4
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("rotor")
    mesh = MeshModel(mesh=box((0.2, 0.02, 0.01), (4, 2, 1), "hex20"))
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    save_model(assemble_mesh(mesh, source="beam", material=steel, fixed=["x0"]), found / "model.h5")
    return found


def text(contact: str = CONTACT, start: float = 800.0) -> str:
    return f"""format = 1
harmonics = "0..4"
[structure]
kind = "fe"
file = "model.h5"
surface = "y1"
contacts = 2
modes = 6
loss_factor = 0.02
[[contact]]
{contact}[response]
from = {start}
to = {start + 4.0}
"""


def test_each_contact_has_its_own_radius_and_angle(folder: Path) -> None:
    case = ss.Case.from_text(text(), path=folder / "case.toml")
    places = case.body.reduced.points.positions[:, 1:] - [-0.3, -0.1]
    for pair, (y, z) in zip(case.problem().contacts, places, strict=True):
        assert float(pair.rubbing.velocity_per_omega) == pytest.approx(0.5 * np.hypot(y, z))
        assert float(pair.rubbing.normal_cos[1]) == pytest.approx(3e-4 * np.cos(2 * np.arctan2(z, y)))


def test_the_velocity_of_the_results_follows_the_frequency(folder: Path) -> None:
    """And the script of the case says the same to the last bit."""
    path = folder / "sweep.toml"
    path.write_text(text(), encoding="utf-8")
    ours = ss.Case.from_file(path).run().dataset
    radius = np.asarray(ours["rubbing_velocity"]) / np.asarray(ours["omega"])[:, None] * 2.0
    assert len(ours["omega"]) > 1
    np.testing.assert_allclose(radius, np.broadcast_to(radius[0], radius.shape), rtol=1e-13)
    assert np.all((radius > 0.32) & (radius < 0.36))
    code = python_script(path.read_text("utf-8"), path.name, folder)
    assert "velocity" not in code
    space = {"__file__": str(folder / "sweep.py"), "__name__": "sweep"}
    exec(compile(code, "sweep.py", "exec"), space)
    theirs = space["compute"]().dataset
    for name in ours:
        np.testing.assert_array_equal(theirs[name].values, ours[name].values, err_msg=str(name))


def test_the_script_says_the_axis_in_the_order_of_the_keys(folder: Path) -> None:
    """The same text every time: the keys that were given are a set, whose order changes from run to run."""
    names = ("point", "direction", "zero")
    code = python_script(text(), "sweep.toml", folder)
    assert sorted(names, key=lambda name: code.index(f'"{name}": (')) == list(names)


def test_a_fixed_speed_backwards(folder: Path) -> None:
    fixed = CONTACT.replace("rotor = { engine_order = 2,", 'rotor = { speed = "6000 rpm", backward = true,')
    (pair, *_) = ss.Case.from_text(text(fixed), path=folder / "case.toml").problem().contacts
    assert float(pair.rubbing.velocity_per_omega) == 0.0
    assert -0.36 < float(pair.rubbing.velocity) / (200.0 * np.pi) < -0.32


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("axis = { point = [0, -0.3, -0.1], direction = [1, 0, 0], zero = [0, 1, 0] }\n", "", "axis is missing"),
        ("direction = [1, 0, 0]", "direction = [0, 0, 0]", "axis.direction: found [0, 0, 0]"),
        ("zero = [0, 1, 0]", "zero = [2, 0, 0]", "expected a direction that is not along the axis"),
        ('"circumferential"', '"around"', 'direction: found "around"; expected three numbers such as'),
        ('normal = "radial"', 'normal = "outward"', "normal: found"),
        ('normal = "radial"', 'normal = "axial"', "runs along the surface at point 1"),
        ("engine_order = 2", "engine_order = 0", "rotor.engine_order: found 0"),
        ("engine_order = 2", "engine_ordr = 2", "did you mean 'engine_order'"),
        ('cos = { "2" = 3e-4 }', 'cosine = { "2" = 3e-4 }', "rotor.profile"),
        ('{ cos = { "2" = 3e-4 } }', "[[0.0, 1.0]]", "rotor.profile: found a table of shape (1, 2)"),
        ('cos = { "2" = 3e-4 }', 'cos = { "12" = 3e-4 }', "harmonic 6"),
        ("kn = 1e5\n", "", "kn is missing"),
        ("kt = 1e5", "kt = 1e5\nrubbing = { velocity = 1.0 }", "rotor is given together with rubbing"),
    ],
)
def test_faults(folder: Path, old: str, new: str, said: str) -> None:
    assert old in CONTACT
    with pytest.raises(InputError) as raised:
        ss.Case.from_text(text(CONTACT.replace(old, new)), path=folder / "case.toml").problem()
    assert said in str(raised.value)


def test_an_axis_that_nothing_goes_by(folder: Path) -> None:
    plain = CONTACT.replace('"circumferential"', "[1, 0, 0]").replace('"radial"', '"surface"')
    plain = "\n".join(line for line in plain.splitlines() if not line.startswith("rotor")) + "\n"
    with raises_fault("contact", "tip", "axis", says="axis is given, but nothing goes by it"):
        ss.Case.from_text(text(plain), path=folder / "case.toml").problem()
