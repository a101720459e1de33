"""``[structure] kind = "disc"`` from finite elements: the case file and the script it becomes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.case.case import Case
from slipstick.case.script import python_script
from slipstick.errors import InputError
from slipstick.models.parametric_sector import sector_shape

CASE = """
format = 1
harmonics = "0..5"

[structure]
kind = "disc"
size = "coarse"
sectors = 30
engine_order = -3
surface = "tip"
contacts = 2
between = ["shroud_low", "shroud_high"]
between_contacts = 1
pressure = "concave"
modes = 12
speed = "3000 rpm"
loss_factor = 0.002

[[load]]
shape = "pressure"
sin = 20.0

[[contact]]
name = "tip"
points = "all"
direction = "circumferential"
axis = { direction = [0, 0, 1] }
kt = 1e5
mu = 0.3
normal_load = 1.0
rubbing = { velocity = 0.1 }

[[contact]]
name = "shroud"
between = true
direction = [0, 0, 1]
normal = "surface"
kt = 1e5
mu = 0.4
kn = 1e5
gap = -1e-5

[output]
dofs = ["c1y"]

[response]
from = "{low}"
to = "{high}"
"""
CASE = CASE.replace("{low}", "340 rad/s").replace("{high}", "341 rad/s")


def test_a_case_is_its_sector_in_a_wave(tmp_path: Path) -> None:
    problem = Case.from_text(CASE, tmp_path).problem()
    model = ss.models.bladed_sector(sector_shape("coarse", sectors=30))
    sector = ss.reduced_sector(
        model, surface="tip", contacts=2, between=("shroud_low", "shroud_high"), between_contacts=1,
        pressure="concave", modes=12, speed="3000 rpm", loss_factor=0.002,
    )  # fmt: skip
    wave = sector.travelling_wave(-3)
    assert problem.structure.dofs == wave.dofs
    assert np.allclose(problem.structure.natural_frequencies, wave.natural_frequencies, rtol=1e-10)
    own = ss.surface_contacts(
        sector, "shroud", contact=problem.contacts[2].contact, direction=(0, 0, 1), normal=True, between=True
    )
    assert [pair.name for pair in problem.contacts] == ["tip 1", "tip 2", "shroud 1"]
    assert problem.contacts[2].tangential == own[0].tangential
    assert problem.contacts[2].normal == own[0].normal


def test_the_script_makes_the_same(tmp_path: Path) -> None:
    script = python_script(CASE, "disc.toml", tmp_path)
    assert 'ss.models.bladed_sector(sector_shape("coarse", sectors=30))' in script
    assert "between=True" in script
    space: dict[str, object] = {"__file__": str(tmp_path / "disc.py"), "__name__": "made"}
    exec(compile(script, "disc.py", "exec"), space)
    problem = space["problem"]()  # type: ignore[operator]
    case = Case.from_text(CASE, tmp_path).problem()
    assert problem.structure.dofs == case.structure.dofs
    assert [pair.tangential for pair in problem.contacts] == [pair.tangential for pair in case.contacts]


def test_an_accuracy_of_a_case_is_that_of_the_library(tmp_path: Path) -> None:
    text = CASE.replace("modes = 12", 'accuracy = 1e-6\nup_to = "900 rad/s"').replace("sectors = 30", "sectors = 24")
    found = Case.from_text(text, tmp_path).problem().structure
    script = python_script(text, "disc.toml", tmp_path)
    assert "accuracy=1e-6" in script or "accuracy=1e-06" in script
    sector = ss.reduced_sector(
        ss.models.bladed_sector("coarse"), surface="tip", contacts=2, between=("shroud_low", "shroud_high"),
        between_contacts=1, pressure="concave", accuracy=1e-6, up_to=900.0, speed="3000 rpm",
    )  # fmt: skip
    np.testing.assert_allclose(found.natural_frequencies, sector.natural_frequencies(3), rtol=1e-10)


def _differing() -> str:
    text = CASE.replace("sectors = 30", "sectors = 24").replace("engine_order = -3", "engine_order = 1")
    text = text.replace("speed =", 'mistuning = { spread = 0.02, seed = 3, blade = "blade" }\nspeed =')
    return text.replace("modes = 12", "modes = 4")


def test_blades_of_elements_that_differ_in_a_script(tmp_path: Path) -> None:
    """The whole disc of a sector and its wave."""
    script = python_script(_differing(), "disc.toml", tmp_path)
    assert 'disc = body.mistuned(spread=0.02, seed=3, blade="blade")' in script
    assert "return disc.problem(" in script


@pytest.mark.verify
def test_blades_of_elements_that_differ(tmp_path: Path) -> None:
    """The whole disc of a case, that of its script and that of the library."""
    text = _differing()
    disc = Case.from_text(text, tmp_path).problem().structure
    space: dict[str, object] = {"__file__": str(tmp_path / "disc.py"), "__name__": "made"}
    exec(compile(python_script(text, "disc.toml", tmp_path), "disc.py", "exec"), space)
    script = space["problem"]()  # type: ignore[operator]
    body = ss.reduced_sector(
        ss.models.bladed_sector(sector_shape("coarse", sectors=24)), surface="tip", contacts=2,
        between=("shroud_low", "shroud_high"), between_contacts=1, pressure="concave", modes=4, speed="3000 rpm",
        loss_factor=0.002, cache=tmp_path / "slipstick-cache",
    )  # fmt: skip
    own = body.mistuned(spread=0.02, seed=3, blade="blade")
    for found in (disc, script.structure):
        np.testing.assert_array_equal(found.deviations, own.deviations)
        np.testing.assert_array_equal(found.natural_frequencies, own.natural_frequencies)
    assert [len(pair) for pair in script.contacts] == [24, 24, 24]
    assert script.outputs == tuple(f"c1y@{s}" for s in range(24))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('size = "coarse"', 'size = "huge"', "size: found 'huge'"),
        ('size = "coarse"', 'size = "coarse"\nlow = "low"', "low is that of the parametric sector"),
        ("between = true", "between = true\npoints = [2]", "shroud.*points: found 2; expected .*1"),
        ('between = ["shroud_low", "shroud_high"]\nbetween_contacts = 1', "", "no contact points towards neighbours"),
        ('surface = "tip"', 'surface = "TIP"', "surface: there is no surface 'TIP'"),
        ('size = "coarse"', 'file = "no.h5"', "no.h5"),
        ("modes = 12", "modes = 12\naccuracy = 1e-6", "modes is given together with accuracy; keep one"),
        ("modes = 12", "accuracy = 1e-6", "accuracy is given without up_to; give both"),
        ("modes = 12", "modes = 12\nmistuning = { spread = 0.1 }", "mistuning.blade is missing; give an element set"),
        ("modes = 12", 'modes = 12\nmistuning = { spread = 0.1, blade = "blad" }', "mistuning.blade: .*'blad'"),
        ("modes = 12", 'modes = 12\nmistuning = { blade = "blade" }', "mistuning.stiffness is missing; give one for"),
    ],
)
def test_what_is_wrong_is_said_at_its_key(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Case.from_text(CASE.replace(old, new), tmp_path)
