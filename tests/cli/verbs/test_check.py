"""What ``check`` says about rubbing: which way each contact slides, is held, and where the opposing surface goes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.cases import oscillator
from helpers.command import slipstick

import slipstick as ss
from slipstick.cli.verbs.check import dragged

FRICTION = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
STRUCTURE = ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=40.0 * np.eye(2), dofs=["x", "y"])


def said(*pairs: ss.ContactPair, omega: tuple[float, float] = (2.0, 15.0), **more: Any) -> list[str]:
    problem = ss.Problem(STRUCTURE, contacts=pairs, loads=ss.Load(dof="x", sin=1.0), harmonics=range(4), **more)
    return list(dragged(problem, omega))


def pair(name: str = "damper", tangential: Any = "x", contact: Any = FRICTION, **rub: Any) -> ss.ContactPair:
    ports = {"ports": {"x": tangential}} if contact is not FRICTION else {"tangential": tangential}
    return ss.ContactPair(name=name, contact=contact, rubbing=ss.RubbingMotion(**rub), **ports)


@pytest.mark.parametrize(
    "tangential, velocity, ahead, back",
    [
        ("x", 10.0, "+x", "-x"),
        ("x", -10.0, "-x", "+x"),
        ({"x": -1.0}, 10.0, "-x", "+x"),
        ({"x": 1.0, "y": -1.0}, -10.0, "-x + y", "x - y"),
    ],
)
def test_a_contact_with_rubbing(tangential: Any, velocity: float, ahead: str, back: str) -> None:
    assert said(pair(tangential=tangential, velocity=velocity)) == [
        f"contact 'damper': slides towards {ahead} at 10 over the opposing surface; "
        f"seen from it that surface moves towards {back}, and friction pushes it that way"
    ]


def test_the_case_file_page_shows_the_sentence() -> None:
    page = (Path(__file__).parents[3] / "docs" / "case-file.md").read_text(encoding="utf-8")
    assert said(pair(velocity=10.0))[0].removeprefix("contact 'damper': ") in " ".join(page.split())


def test_without_rubbing_nothing_is_said() -> None:
    assert said(pair(), pair("b", cos={0: 1.0}), pair("c", cos={1: 0.0})) == []


def test_units_and_periodic_parts() -> None:
    (first,) = said(pair(velocity=-3.0, sin={1: 2.0}), units={"length": "mm", "time": "s", "force": "N"})
    assert "slides towards -x at 3 mm/s and to and fro with order 1 over the opposing surface;" in first
    (second,) = said(pair(cos={2: 0.5, 3: 1.0}))
    assert second == (
        "contact 'damper': slides to and fro with order 2, 3 over the opposing surface, positive towards +x, "
        "without a mean direction"
    )


def test_a_velocity_that_sweeps() -> None:
    """One direction where its sign is the same over the range, else none."""
    (one,) = said(pair(velocity_per_omega=-0.2))
    assert "slides towards -x at 0.2 x omega over the opposing surface" in one
    (both,) = said(pair(velocity=5.0, velocity_per_omega=-1.0))
    assert "5 + -1 x omega over the opposing surface, positive towards +x" in both
    assert "without a mean direction" in both


def test_many_contacts_are_one_sentence() -> None:
    many = ss.ContactPair(
        name="tip", contact=FRICTION, tangential=["x", "y"] * 50, rubbing=ss.RubbingMotion(velocity=[1.0] * 99 + [2.0])
    )
    found = said(many)
    assert len(found) == 2
    assert found[0].startswith("contacts 'tip.1', 'tip.2', ")
    assert (
        "(99): slide towards +x, +y at 1 over the opposing surface; seen from them that surface moves towards -x, -y, "
        "and friction pushes them" in found[0]
    )
    assert max(map(len, found)) < 400


def test_a_law_that_is_no_friction_is_not_said_to_hold() -> None:
    spring = ss.SampledLaw(force=lambda q, velocity, k: k * q**3, parameters={"k": 1.0}, ports=("x",))
    (found,) = said(pair(contact=spring, velocity=2.0))
    assert found == (
        "contact 'damper': slides towards +x at 2 over the opposing surface; seen from it that surface moves towards -x"
    )


PLANAR = ss.PlanarFrictionContact(kt=100.0, mu=0.3, normal_load=800.0)


@pytest.mark.parametrize(
    "rubbing, expected",
    [
        (
            {"velocity": (3.0, 0.0)},
            "slides towards +x at 3 over the opposing surface; seen from it that surface moves towards -x, "
            "and friction pushes it that way",
        ),
        (
            {"velocity": (-3.0, 4.0)},
            "slides towards -0.6 x + 0.8 y at 5 over the opposing surface; seen from it that surface moves towards "
            "0.6 x - 0.8 y, and friction pushes it that way",
        ),
        (
            {"velocity_per_omega": (0.0, 2.0)},
            "slides towards +y at 2 x omega over the opposing surface; seen from it that surface moves towards -y, and "
            "friction pushes it that way",
        ),
        (
            {"cos": {2: (0.0, 1.0)}},
            "slides to and fro with order 2 over the opposing surface, positive towards +y, without a mean direction",
        ),
    ],
)
def test_a_contact_that_slides_in_the_plane(rubbing: Any, expected: str) -> None:
    foot = ss.ContactPair(name="foot", contact=PLANAR, tangential=("x", "y"), rubbing=ss.RubbingMotion(**rubbing))
    assert said(foot) == [f"contact 'foot': {expected}"]


def test_a_contact_in_the_plane_is_told_in_a_line(tmp_path: Path) -> None:
    slipstick("init", "sliding_in_the_plane", tmp_path)
    result = slipstick("check", tmp_path / "sliding_in_the_plane.toml")
    assert result.exit_code == 0
    told = "contact 'foot': slides along x and y, kt 100, mu 0.3, normal_load 400, rubbing at (3, 0)\n"
    assert told in result.output


def test_the_damping_ratio_of_every_mode_that_is_listed(tmp_path: Path) -> None:
    """``C / (2 w)`` of unit masses, and half the loss factor; verbs of other tables are named."""
    (tmp_path / "case.toml").write_text(
        oscillator(
            head="harmonics = [0, 1, 2, 3, 4]\n",
            rubbing="velocity = 10.0",
            response="from = 2.0\nto = 15.0\n[track]\nparameter = 'damper.mu'\nfrom = 0.1\nto = 0.5\n",
        ).replace("stiffness", "loss_factor = 0.02\nstiffness"),
        encoding="utf-8",
    )
    result = slipstick("check", tmp_path / "case.toml")
    ratio = 0.4 / (2.0 * np.sqrt(40.0)) + 0.01
    assert result.exit_code == 0
    assert f"1  6.32456 rad/s (1.0066 Hz), damping ratio {ratio:.3g}\n" in result.output
    assert f"[track]: 'slipstick track {tmp_path / 'case.toml'}' computes it" in result.output


def test_a_rotor_runs_in_a_sense() -> None:
    """Its surface has no dof along which it slides."""
    law = ss.models.StatorContact(kn=1.0, gap=1.0)
    rubs = [
        ss.ContactPair(name=name, contact=law, ports={"x": "x", "y": "y"}, rubbing=ss.RubbingMotion(velocity=v))
        for name, v in (("a", 2.0), ("b", -2.0))
    ]
    rotor = ss.models.jeffcott_rotor(damping=0.1)
    problem = ss.Problem(rotor, contacts=rubs, loads=ss.Load(dof="x", cos=1.0), harmonics=[0, 1])
    assert list(dragged(problem, (1.0, 2.0))) == [
        "contact 'a': the surface of the rotor runs at 2 in the sense from x to y",
        "contact 'b': the surface of the rotor runs at 2 in the sense from y to x",
    ]


def limits_of(folder: Path, range_: str) -> list[str]:
    path = folder / "case.toml"
    path.write_text(oscillator(head='title = "t"\nharmonics = "0..5"\n', rubbing="velocity = 10.0", response=range_))
    return [line for line in slipstick("check", path).output.splitlines() if line.startswith("linear response")]


def test_an_end_of_the_range_is_no_resonance(tmp_path: Path) -> None:
    """Stiffness 40 and 140, mass 1: sqrt(40) and sqrt(140)."""
    free, stuck = limits_of(tmp_path, "from = 2.0\nto = 15.0")
    assert float(free.split(" near ")[1].split()[0]) == pytest.approx(np.sqrt(40.0), rel=0.01)
    assert float(stuck.split(" near ")[1].split()[0]) == pytest.approx(np.sqrt(140.0), rel=0.01)
    below = limits_of(tmp_path, "from = 2.0\nto = 5.0")
    assert all("at 5 rad/s" in line and line.endswith("an end of the range") for line in below)
