"""The verb ``campbell``: crossings said and told as data, a figure, faults."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import slipstick as ss
from slipstick.cli.main import app

CASE = """format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["x", "y"]
mass = [[2.0, 0.0], [0.0, 2.0]]
stiffness = [[40.0, 0.0], [0.0, 40.0]]
gyroscopic = [[0.0, 1.2], [-1.2, 0.0]]
engine_order = 1
[[load]]
dof = "x"
motion = "unbalance"
cos = 0.1
[[contact]]
name = "stop"
tangential = "x"
kt = 1.0
mu = 0.3
normal_load = 1.0
[response]
from = 1.0
to = 3.0
"""


def test_a_case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """``k = n^2 It W^2 -+ n Ip W^2``."""
    monkeypatch.chdir(tmp_path)
    Path("disc.toml").write_text(CASE)
    result = CliRunner().invoke(app, ["campbell", "disc.toml", "--to", "20 rad/s", "--orders", "1,2", "--json"])
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout)
    exact = sorted((40.0 / (n * n * 2.0 - sense * n * 1.2)) ** 0.5 for n in (1, 2) for sense in (1, -1))
    assert [row["speed"] for row in answer["crossings"]] == pytest.approx(exact)
    assert Path("disc-campbell.png").stat().st_size > 10_000
    said = CliRunner().invoke(app, ["campbell", "disc.toml", "--to", "9 rad/s", "-o", "own.svg"])
    assert "engine order 1 meets mode 2 (forward) at 7.07107 rad/s" in said.output
    drawn = Path("own.svg").read_bytes()
    assert drawn
    for name in ("own.svg", "disc-campbell.png"):
        option = ["-o", name] if name == "own.svg" else []
        refused = CliRunner().invoke(app, ["campbell", "disc.toml", "--to", "9 rad/s", *option])
        said = f"error: {name}: is there already; choose another name, or --force to replace it"
        assert (refused.exit_code, " ".join(refused.output.split())) == (2, said)
        assert Path("own.svg").read_bytes() == drawn


def test_speeds_without_a_unit_are_rad_per_second(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("disc.toml").write_text(CASE)
    results = [
        CliRunner().invoke(app, ["campbell", "disc.toml", "--to", to, "-o", "own.svg", "--force"])
        for to in ("9", "9 rad/s", "9 x")
    ]
    assert [result.exit_code for result in results] == [0, 0, 2]
    assert results[0].output == results[1].output
    assert "--to: found '9 x'" in results[2].output


def test_a_figure_of_no_format_is_a_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("disc.toml").write_text(CASE)
    said = CliRunner().invoke(app, ["campbell", "disc.toml", "--to", "9", "-o", "own.nc"])
    assert said.exit_code == 2
    assert "own.nc: found 'nc'; expected a format of figures: " in said.output.replace("\n", " ")


def test_damped_and_undamped_frequencies_are_told_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With heavy damping they differ: 4.47 rad/s undamped, sqrt(20 - 4) = 4 rad/s damped at rest."""
    monkeypatch.chdir(tmp_path)
    damped = CASE.replace("gyroscopic", "damping = [[8.0, 0.0], [0.0, 8.0]]\ngyroscopic")
    Path("disc.toml").write_text(damped.replace("engine_order = 1", "speed = 0.0001"))
    said = CliRunner().invoke(app, ["campbell", "disc.toml", "--to", "9", "-o", "own.svg"])
    assert "damped frequencies, without contacts ('slipstick check' has the undamped ones)" in said.output
    checked = CliRunner().invoke(app, ["check", "disc.toml"])
    assert "undamped natural frequencies without contact" in checked.output
    assert "4.472" in checked.output
    structure = ss.load_case("disc.toml").structure
    found = ss.models.campbell(structure, [0.0, 1.0])
    assert found.frequency.values[0] == pytest.approx([4.0, 4.0])
    assert found.frequency.attrs["long_name"].startswith("damped frequency")
    assert ss.plots.campbell(found).get_ylabel() == "Damped frequency [rad/s]"


def test_what_does_not_turn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    still = "".join(line + "\n" for line in CASE.splitlines() if not line.startswith(("gyro", "engine")))
    Path("still.toml").write_text(still)
    result = CliRunner().invoke(app, ["campbell", "still.toml", "--to", "20 rad/s"])
    assert result.exit_code == 2
    assert "nothing in it turns" in result.output


def test_a_rotor_is_no_disc(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("disc.toml").write_text(CASE)
    result = CliRunner().invoke(app, ["interference", "disc.toml", "--to", "20 rad/s", "--orders", "4"])
    assert result.exit_code == 2
    assert "no sector of a disc" in result.output


def test_a_disc_is_no_rotor() -> None:
    """What to do instead is said, and no name of a class."""
    sector = ss.CyclicStructure(M=([[1.0]], [[0.0]]), K=([[3.0]], [[-1.0]]), dofs=["x"], sectors=4)
    with pytest.raises(ss.InputError, match=r"is a sector of a disc.*'slipstick interference'"):
        ss.models.campbell(sector.travelling_wave(1), [0.0, 1.0])
    still = ss.ModalStructure(omega=[1.0], mode_shapes=[[1.0]], dofs=["x"])
    with pytest.raises(ss.InputError, match=r"^structure has no gyroscopic matrices; expected kind"):
        ss.models.campbell(still, [0.0, 1.0])
