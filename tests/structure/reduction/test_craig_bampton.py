"""Reduction of unsymmetric matrices: exact at rest, right below the modes left out, exact with all of them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csc_array

import slipstick as ss
from slipstick.errors import InputError
from slipstick.models.rotor import Bearing, Disc, Shaft, beam_rotor
from slipstick.structure import matrices
from slipstick.structure.matrices import MatrixStructure
from slipstick.structure.reduction.craig_bampton import craig_bampton

STEEL = ss.Material(young=211e9, poisson=0.3, density=7810.0)
KEPT = ["n2x", "n2y", "n8x", "n8y"]


def rotor(**speed: float | int) -> MatrixStructure:
    """On bearings that push across."""
    oil = Bearing(node=0, kxx=1e6, kyy=2e6, kxy=4e5, kyx=-7e5, cxx=2e3, cyy=3e3, cxy=-4e2, cyx=3e2)
    other = Bearing(node=10, kxx=2e6, kxy=-3e5, kyx=5e5, cxx=2e3)
    discs = [Disc(node=4, mass=30.0, polar=0.33, diametral=0.18)]
    shaft = Shaft(length=1.5, outer=0.05, elements=10)
    return beam_rotor([shaft], material=STEEL, discs=discs, bearings=[oil, other], loss_factor=0.003, **speed)


def receptance(structure: MatrixStructure, omega: float) -> tuple[np.ndarray, np.ndarray]:
    at = np.zeros((len(structure.dofs), len(KEPT)))
    at[[structure.dofs.index(name) for name in KEPT], range(len(KEPT))] = 1.0
    found = structure.project(at, at)
    return found.static, found.at([1, 2], omega)[0]


def held_frequencies(full: MatrixStructure) -> np.ndarray:
    inside = [i for i, name in enumerate(full.dofs) if name not in KEPT]
    K = 0.5 * (full.K + full.K.T)
    return np.sqrt(eigh(K[np.ix_(inside, inside)], full.M[np.ix_(inside, inside)], eigvals_only=True))


@pytest.mark.parametrize("tie", [{"speed": 250.0}, {"engine_order": 1}])
def test_it_converges_to_the_full_matrices(tie: dict[str, float]) -> None:
    full, errors = rotor(**tie), []
    static, exact = receptance(full, 300.0)
    for modes in (4, 8, 16, 40):
        small = craig_bampton(full, KEPT, modes=modes)
        at_rest, found = receptance(small, 300.0)
        assert at_rest == pytest.approx(static, rel=1e-9, abs=1e-9 * np.abs(static).max())
        errors.append(np.linalg.norm(found - exact) / np.linalg.norm(exact))
        if modes < 40:
            assert errors[-1] < (2 * 300.0 / held_frequencies(full)[modes]) ** 2
    assert errors[-1] < 1e-10
    assert np.all(np.diff(errors) < 0.0)
    assert small.speed == full.speed
    assert small.engine_order == full.engine_order


def test_the_speed_changes_afterwards() -> None:
    small = craig_bampton(rotor(speed=0.0), KEPT, modes=20).changed(speed=400.0)
    found, exact = receptance(small, 250.0)[1], receptance(rotor(speed=400.0), 250.0)[1]
    assert np.abs(found - exact).max() < (2 * 250.0 / 3.5e4) ** 2 * np.abs(exact).max()
    poles, all_poles = small.natural_frequencies[:6], rotor(speed=400.0).natural_frequencies[:6]
    assert poles == pytest.approx(all_poles, rel=1e-5)


def test_sparse_matrices(monkeypatch: pytest.MonkeyPatch) -> None:
    dense = rotor(speed=100.0)
    given = {name: csc_array(value) if np.ndim(value) == 2 else value for name, value in dense.arguments.items()}
    monkeypatch.setattr(matrices, "DENSE_LIMIT", 0)
    sparse = MatrixStructure(**given)
    monkeypatch.undo()
    found, exact = (receptance(craig_bampton(one, KEPT, modes=10), 200.0)[1] for one in (sparse, dense))
    assert np.abs(found - exact).max() < 1e-9 * np.abs(exact).max()


def test_faults() -> None:
    full = rotor(speed=0.0)
    with pytest.raises(InputError, match="there is no dof 'n99x'"):
        craig_bampton(full, ["n99x"], modes=2)
    with pytest.raises(InputError, match="modes: found 44; expected at most 43"):
        craig_bampton(full, ["n2x"], modes=44)
    with pytest.raises(InputError, match="each once"):
        craig_bampton(full, ["n2x", "n2x"], modes=1)


def test_coordinates_of_modes_are_outputs_only_where_they_are_named() -> None:
    small = craig_bampton(rotor(speed=400.0), KEPT, modes=2)
    assert small.dofs[: len(KEPT) + 2] == (*KEPT, "mode 1", "mode 2")
    load = ss.Load(dof=KEPT[0], cos=1.0)
    assert list(ss.Problem(small, loads=load, harmonics=[0, 1]).outputs) == list(KEPT)
    assert list(ss.Problem(small, loads=load, harmonics=[0, 1], outputs=["mode 2"]).outputs) == ["mode 2"]
