"""Case files with contacts that slide in two directions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.case.case import Case
from slipstick.case.script import python_script
from slipstick.cli.examples import examples
from slipstick.errors import InputError

CASE = """
format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["x", "y", "z"]
mass = [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]
damping = [[0.4, 0, 0], [0, 0.4, 0], [0, 0, 0.4]]
stiffness = [[40.0, 0, 0], [0, 40.0, 0], [0, 0, 40.0]]
[[load]]
dof = "x"
cos = 200.0
[[load]]
dof = "y"
sin = 100.0
[[contact]]
name = "foot"
tangential = ["x", { y = 1.0 }]
kt = 100.0
mu = 0.3
normal_load = 800.0
rubbing = { velocity = [3.0, -1.0], cos = { "1" = [0.5, 0.0], "2" = 0.25 } }
[response]
from = 8.0
to = 9.0
"""


def test_two_tangential_directions() -> None:
    (pair,) = Case.from_text(CASE).problem().contacts
    assert pair.contact == ss.PlanarFrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    assert pair.direction("tangential") == {"x": 1.0}
    assert pair.direction("second") == {"y": 1.0}
    assert pair.rubbing == ss.RubbingMotion(velocity=3.0, second_velocity=-1.0, cos={1: 0.5, 2: 0.25})


def test_the_script_says_the_same(tmp_path: Path) -> None:
    text = python_script(CASE, "case.toml", tmp_path)
    assert "ss.PlanarFrictionContact(kt=100.0" in text
    given: dict[str, object] = {"__name__": "script"}
    exec(compile(text, "script.py", "exec"), given)
    ours, theirs = Case.from_text(CASE).run().dataset, given["compute"]().dataset  # type: ignore[operator]
    np.testing.assert_array_equal(theirs["displacement"], ours["displacement"])


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('["x", { y = 1.0 }]', '"x"', "slides in one direction"),
        ('["x", { y = 1.0 }]', '["x", "y", "z"]', "two such as"),
        ('["x", { y = 1.0 }]', '["x", "q"]', "there is no dof"),
        ("[3.0, -1.0]", "[3.0, -1.0, 2.0]", "finite number"),
        ('"2" = 0.25', '"7" = [0.25, 0.0]', "not among the harmonics kept"),
    ],
)
def test_faults(old: str, new: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Case.from_text(CASE.replace(old, new)).problem()


def test_planar_friction_on_a_surface(tmp_path: Path) -> None:
    """The second direction is across the first, in the surface."""
    found = examples()["blade"]
    for path in found.needs:
        (tmp_path / path.name).write_bytes(path.read_bytes())
    text = found.path.read_text(encoding="utf-8")
    for old, new in (
        ("[[contact]]\n", '[[contact]]\nfriction = "planar"\n'),
        ("modes = 32", "modes = 4\ncontacts = 2\nforce = true"),
    ):
        assert old in text
        text = text.replace(old, new)
    case = Case.from_text(text, tmp_path / "case.toml")
    pairs = case.problem().contacts
    assert all(isinstance(pair.contact, ss.PlanarFrictionContact) for pair in pairs)
    for pair in pairs:
        first, second = (dict(pair.direction(port) or {}) for port in ("tangential", "second"))
        assert abs(sum(first[dof] * second.get(dof, 0.0) for dof in first)) < 1e-12
        assert sum(c * c for c in second.values()) == pytest.approx(1.0)
    assert "ss.PlanarFrictionContact" in python_script(text, "case.toml", tmp_path)


def test_a_surface_chooses_by_its_motion(tmp_path: Path) -> None:
    """``friction = "auto"``: the choice of the public function, said, and the script makes the same one."""
    found = examples()["blade"]
    for path in found.needs:
        (tmp_path / path.name).write_bytes(path.read_bytes())
    planar = found.path.read_text(encoding="utf-8")
    for old, new in (
        ("[[contact]]\n", '[[contact]]\nfriction = "planar"\n'),
        ("modes = 32", "modes = 4\ncontacts = 2\nforce = true"),
        ('to = "330 Hz"', 'to = "151 Hz"'),
    ):
        assert old in planar
        planar = planar.replace(old, new)
    auto = planar.replace('"planar"', '"auto"')
    given = Case.from_text(planar, tmp_path / "planar.toml")
    case = Case.from_text(auto, tmp_path / "auto.toml")
    (told,) = (sentence for sentence in case.noticed if "auto" in sentence)
    with pytest.warns(ss.SlipstickWarning, match="contacts are planar"):
        own = ss.models.straight_contacts(given.problem(), omega=given.omega)
    assert case.problem().contacts == own.contacts
    count = sum(isinstance(pair.contact, ss.PlanarFrictionContact) for pair in own.contacts)
    assert told.startswith(f'friction = "auto": {count} of 2 contacts are planar')
    (tmp_path / "script.py").write_text(python_script(auto, "auto.toml", tmp_path))
    names: dict[str, object] = {"__name__": "script", "__file__": str(tmp_path / "script.py")}
    exec(compile((tmp_path / "script.py").read_text(), "script.py", "exec"), names)
    with pytest.warns(ss.SlipstickWarning, match="contacts are planar"):
        script = names["problem"]()  # type: ignore[operator]
    assert script.contacts == own.contacts
    wrong = auto.replace('friction = "auto"', 'friction = "any"')
    with pytest.raises(InputError, match=r'expected "planar": .*; "auto": '):
        Case.from_text(wrong, tmp_path / "case.toml")
