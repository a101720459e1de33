"""Modal files: the same structure from Python and from a case file; the first modes alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.app.case.case import load_case
from slipstick.errors import InputError
from slipstick.structure.modal_files import first_modes

CASE = """format = 1
harmonics = "0..3"
[structure]
kind = "modal"
file = "m.npz"
{more}
[[contact]]
name = "a"
tangential = "{dof}"
kt = 1.0
mu = 0.3
normal_load = 1.0
rubbing = {{ velocity = 1.0 }}
[response]
from = 0.5
to = 1.5
"""


def write(folder: Path, **more: object) -> Path:
    rng = np.random.default_rng(5)
    shapes, omega = rng.standard_normal((3, 8)), np.linspace(1.0, 50.0, 8)
    static = (shapes / omega**2) @ shapes.T
    np.savez(folder / "m.npz", omega=omega, mode_shapes=shapes, static_compliance=0.5 * (static + static.T), **more)
    return folder / "m.npz"


def receptance(structure: ss.ModalStructure) -> np.ndarray:
    return structure.project(np.eye(3), np.eye(3)).at([1], [0.3, 2.0])[0]


def test_dropped_modes_are_added_to_the_second_residual() -> None:
    shapes, omega = np.arange(6.0).reshape(2, 3) + 1, np.array([1.0, 2.0, 4.0])
    whole = {"omega": omega, "mode_shapes": shapes, "second_residual": np.zeros((2, 2))}
    kept = first_modes(whole, 1)
    np.testing.assert_allclose(kept["second_residual"], (shapes[:, 1:] / omega[1:] ** 4) @ shapes[:, 1:].T)
    assert kept["omega"].tolist() == [1.0]


def test_python_and_case_file_read_the_same_structure(tmp_path: Path) -> None:
    path = write(tmp_path, loss_factor=0.01)
    (tmp_path / "case.toml").write_text(CASE.format(more="modes = 6", dof="n1y"))
    case, script = load_case(tmp_path / "case.toml").structure, ss.ModalStructure.load(path, modes=6)
    assert case.dofs == script.dofs == ("n1x", "n1y", "n1z")
    np.testing.assert_array_equal(receptance(case), receptance(script))
    whole = ss.ModalStructure.load(path)
    np.testing.assert_allclose(receptance(script), receptance(whole), rtol=1e-4)


def test_names_in_the_file_are_taken(tmp_path: Path) -> None:
    """By the case file too, which took no notice of them."""
    path = write(tmp_path, loss_factor=0.01, dofs=["tip", "root", "disc"])
    (tmp_path / "case.toml").write_text(CASE.format(more="", dof="tip"))
    assert load_case(tmp_path / "case.toml").structure.dofs == ("tip", "root", "disc")
    assert ss.ModalStructure.load(path, dofs=["a", "b", "c"]).dofs == ("a", "b", "c")
    with pytest.raises(InputError, match="dofs: found 1 names; expected 3"):
        ss.ModalStructure.load(path, dofs=["a"])
    with pytest.raises(InputError, match="modes: found 9; expected 1 to 8"):
        ss.ModalStructure.load(path, modes=9)
