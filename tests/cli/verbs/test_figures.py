"""``run --figures all``: what there is to draw is drawn, whatever the law of the contacts."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.command import slipstick

HEAD = """
format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["n1x", "n1y"]
mass = [[1.0, 0.0], [0.0, 1.0]]
damping = [[0.4, 0.0], [0.0, 0.4]]
stiffness = [[40.0, 0.0], [0.0, 44.0]]
[[load]]
dof = "n1x"
sin = 100.0
[[load]]
dof = "n1y"
cos = 60.0
[response]
from = 6.0
to = 6.3
"""
PLANAR = """
[[contact]]
tangential = ["n1x", "n1y"]
kt = 100.0
mu = 0.3
normal_load = 400.0
"""
STATOR = """
[[contact]]
law = "stator"
ports = { x = "n1x", y = "n1y" }
kn = 20.0
gap = 1.0
mu = 0.1
slip_velocity = 0.1
rubbing = { velocity_per_omega = 0.5 }
"""


@pytest.mark.parametrize(
    ("contact", "drawn", "not_drawn"),
    [(PLANAR, {"loop", "states", "fractions"}, {"orbit"}), (STATOR, {"loop", "states", "orbit"}, {"fractions"})],
)
def test_every_figure_there_is(tmp_path: Path, contact: str, drawn: set[str], not_drawn: set[str]) -> None:
    (tmp_path / "case.toml").write_text(HEAD + contact.replace("[[contact]]", '[[contact]]\nname = "c"'))
    told = slipstick("run", tmp_path / "case.toml", "-o", tmp_path / "out", "--figures", "all", "--no-report")
    assert told.exit_code == 0, told.output
    there = {path.stem for path in (tmp_path / "out").glob("*.png")}
    assert {"response", "phase", "mean", "spectrum", "history", "power", *drawn} <= there
    assert not not_drawn & there


def test_steady_sliding_has_no_phase_and_no_peaks(tmp_path: Path) -> None:
    """Nothing vibrates over the whole range of the parameter."""
    slipstick("init", "brake_squeal", tmp_path)
    told = slipstick("run", tmp_path / "brake_squeal.toml", "-o", tmp_path / "out", "--figures", "phase", "--no-report")
    assert told.exit_code == 0, told.output
    assert "nothing in these results to draw of 'phase'" in told.output
    assert not (tmp_path / "out" / "phase.png").exists()
    assert "peak of" not in told.output
