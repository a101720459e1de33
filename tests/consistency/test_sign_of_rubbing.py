"""The sign of rubbing, against bodies in space: a pad on a belt goes with it, a blade in a casing is held back."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import slipstick as ss

ROOT = Path(__file__).parents[2]
M, C, K, KT, LIMIT, P, OMEGA = 1.0, 0.4, 40.0, 100.0, 30.0, 60.0, 3.0


def in_space(surface: float, periods: int = 12, steps: int = 4000) -> tuple[float, float]:
    """Mean and amplitude of a pad whose bristle is rooted in a surface that is at the place ``surface * t``.

    The last of the periods. Written in places of bodies alone: no sliding coordinate enters, so nothing is to agree on.
    """
    h = 2.0 * np.pi / OMEGA / steps
    x, v, root, found = 0.0, 0.0, 0.0, []
    for i in range(periods * steps):
        force = KT * (x - root)  # of the bristle, against the pad
        root = x - np.clip(force, -LIMIT, LIMIT) / KT + surface * h  # it slips, and goes on with the surface
        v += h * (P * np.sin(OMEGA * i * h) - C * v - K * x - np.clip(force, -LIMIT, LIMIT)) / M
        x += h * v
        found.append(x)
    last = np.array(found[-steps:])
    return float(last.mean()), float(np.abs(last - last.mean()).max())


def computed(rubbing: ss.RubbingMotion) -> tuple[float, float]:
    structure = ss.MatrixStructure(M=[[M]], C=[[C]], K=[[K]], dofs=["x"])
    contact = ss.FrictionContact(kt=KT, mu=0.3, normal_load=LIMIT / 0.3)
    pair = ss.ContactPair(name="pad", contact=contact, tangential="x", rubbing=rubbing)
    problem = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=P), harmonics=range(11))
    branch = ss.forced_response(problem, omega=(OMEGA, 1.01 * OMEGA))
    return float(branch.dataset["mean"][0, 0]), float(branch.dataset["amplitude"][0, 0])


@pytest.mark.parametrize("belt", [2.0, -2.0])
def test_a_pad_moves_with_its_belt(belt: float) -> None:
    """A belt at +V is ``velocity = -V``, as ``RubbingMotion`` says."""
    mean, size = computed(ss.RubbingMotion(velocity=-belt))
    assert mean * belt > 0
    assert (mean, size) == pytest.approx(in_space(belt), rel=5e-3)


def test_a_blade_in_a_casing_is_held_back() -> None:
    """The tip runs towards growing angles at 2; seen from the rotor the casing goes back at 2."""
    mean, size = computed(ss.casing_motion({}, angles=0.0, radius=0.5, speed=4.0, orders=0))
    assert mean < 0
    assert (mean, size) == pytest.approx(in_space(-2.0), rel=5e-3)


def case_in(page: str, name: str) -> str:
    """The toml block of a page that begins with ``# name``."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return next(block for block in re.findall(r"```toml\n(.*?)```", text, flags=re.DOTALL) if name in block)


def test_the_pad_of_the_tutorial_is_carried_along_by_its_belt(tmp_path: Path) -> None:
    """Its belt runs to the right."""
    case = tmp_path / "two_masses.toml"
    case.write_text(case_in("tutorial.md", "A pad on a moving belt"), encoding="utf-8")
    problem = ss.load_case(case)
    assert float(problem.contacts[0].rubbing.speed(1.0)) == -0.2
    branch = ss.forced_response(problem, omega=(300.0, 310.0))
    assert float(branch.dataset["mean"].sel(dof="pad")[0]) > 0


def test_the_tip_of_the_tutorial_runs_in_a_casing_at_rest() -> None:
    """Held back, as the negative mean position that the page shows."""
    page = (ROOT / "docs" / "tutorial-blade-tip.md").read_text(encoding="utf-8")
    assert tomllib.loads(case_in("tutorial-blade-tip.md", "Blade with a rubbing tip"))["contact"][0]["rubbing"] == {
        "velocity": 0.5
    }
    assert re.search(r"mean position -\d", page)
    assert "held back" in page or "holds it back" in page


def test_every_text_speaks_of_the_opposing_surface() -> None:
    """Whose motion is meant decides about the sign: "counter surface" stood for ``u`` and for the surface itself."""
    files = [*ROOT.glob("docs/*.md"), *ROOT.glob("docs/*.ipynb"), ROOT / "README.md"]
    files += [p for folder in ("src", "examples") for p in (ROOT / folder).rglob("*") if p.suffix in (".py", ".toml")]
    said = [p.name for p in files if re.search("counter[- ]surface", p.read_text(encoding="utf-8"), re.IGNORECASE)]
    assert said == []
