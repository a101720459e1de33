"""The reduced rubbing blade: against direct solutions, over meshes, kept on disk."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.fem.materials import Material
from slipstick.models.blade import BLADE_STEEL, INCONEL_718, BladeModel, finite_element_blade, reduced_blade
from slipstick.models.blade_mesh import blade_shape
from slipstick.solve.linear.factorisation import factorise
from slipstick.structure.reduction import store as reduction_store

SMALL = BladeModel(shape=blade_shape("small"), modes=24)
METAL = Material(young=1.0, poisson=0.3, density=1.0, conductivity=2.0)


@pytest.fixture(scope="module")
def full():
    return finite_element_blade(SMALL)


@pytest.fixture(scope="module")
def reduced():
    return reduced_blade("small", modes=24, loss_factor=0.002)


def test_reduced_blade_against_direct_solution(full, reduced):
    """24 modes with both residual terms; receptance and pressure response up to twice the first resonance."""
    loads = np.column_stack([full.directions.toarray(), full.loads["pressure"]])
    structure = reduced.structure
    eye = np.eye(24)
    receptance = structure.project(eye, eye, ["pressure"])
    assert structure.dofs == full.points.dofs
    np.testing.assert_allclose(
        receptance.static, full.directions.T @ factorise(full.model.K).solve(loads), rtol=1e-7, atol=1e-16
    )
    for ratio in (0.6, 2.0):
        w = ratio * structure.omega[0]
        direct = full.directions.T @ factorise(full.model.K - w**2 * full.model.M).solve(loads)
        found = receptance.at([1], w)[0][0]
        lossless = found.real  # the loss factor moves it by about its square off resonance
        assert np.linalg.norm(lossless - direct) < 3e-5 * np.linalg.norm(direct)


def test_blade_directions_areas_and_influence(full, reduced):
    assert sum(reduced.points.areas) == pytest.approx(5.96e-4, rel=1e-2)
    np.testing.assert_allclose(reduced.points.normals, np.tile([0, 0, 1.0], (8, 1)), atol=1e-12)
    assert reduced.points.tangential((0.0, 2.0, 1.0))[2] == {"c3y": 1.0}
    assert reduced.points.normal[0] == {"c1z": pytest.approx(1.0)}
    assert np.all(np.diag(reduced.points.influence) > 3.0)
    assert np.linalg.eigvalsh(reduced.points.influence).min() > 0.0
    np.testing.assert_array_equal(reduced.points.influence, full.points.influence)
    with raises_fault("direction", says="normal to the surface"):
        reduced.points.tangential((0.0, 0.0, 1.0))


def test_a_stored_blade_is_reused_and_a_changed_one_is_not(tmp_path, reduced):
    setup = {"modes": 8, "cache": tmp_path}
    first = reduced_blade("small", **setup)
    again = reduced_blade(blade_shape("small"), **setup, loss_factor=0.01)
    other = reduced_blade("small", **setup, material=INCONEL_718)
    assert not first.reused
    assert again.reused
    assert not other.reused
    assert len(list(tmp_path.iterdir())) == 2
    np.testing.assert_array_equal(first.structure.omega, again.structure.omega)
    np.testing.assert_array_equal(first.points.influence, again.points.influence)
    assert again.structure.loss_factor[0] == 0.01
    ratio = np.sqrt(208 / 200 * BLADE_STEEL.density / INCONEL_718.density)
    assert other.structure.omega[0] / first.structure.omega[0] == pytest.approx(ratio, rel=2e-3)
    next(tmp_path.iterdir()).write_bytes(b"broken")
    assert len({reduced_blade("small", **setup, material=m).reused for m in (BLADE_STEEL, INCONEL_718)}) == 2
    np.testing.assert_allclose(first.structure.omega, reduced.structure.omega[:8], rtol=1e-9)


def test_a_blade_of_other_code_or_another_solver_is_made_again(tmp_path, monkeypatch):
    setup = {"contacts": 2, "modes": 4, "cache": tmp_path}
    assert not reduced_blade("small", **setup).reused
    assert not reduced_blade("small", **setup, solver="superlu").reused
    assert reduced_blade("small", **setup, solver="superlu").reused
    monkeypatch.setattr(reduction_store, "code_digest", lambda *rooms: f"other code in {rooms}")
    assert not reduced_blade("small", **setup).reused
    assert reduced_blade("small", **setup).reused


@pytest.mark.verify
def test_blade_converges_with_the_mesh():
    """Same contacts on three meshes: frequency, contact compliance and influence settle."""
    places = tuple(map(tuple, finite_element_blade(BladeModel(shape=blade_shape("medium"))).points.positions.tolist()))
    found = []
    for size in ("small", "medium", "large"):
        result = reduced_blade(size, contacts=places, radius=4e-3, modes=4)
        compliance = np.diag(result.structure.static_compliance)
        found.append(np.array([result.structure.omega[0], *compliance[1:3], *np.diag(result.points.influence)[:2]]))
    change = [np.abs(found[k + 1] / found[k] - 1.0) for k in (0, 1)]
    assert change[1][0] < 2e-3
    assert change[1].max() < 0.03
    assert np.all(change[1] < np.maximum(change[0], 2e-3))


def test_modes_are_counted_or_found_by_a_range_not_both():
    with raises_fault("blade, modes", statement="both modes and up_to are given"):
        reduced_blade("small", modes=3, up_to=5.0)


def test_stress_at_the_root_is_stored(tmp_path: Path) -> None:
    """Of the elements on the root, from the store as computed: a unit pressure bends the blade about it."""
    options: dict[str, Any] = {"contacts": 2, "modes": 4, "cache": tmp_path, "stress": ["root"]}
    made, again = ss.reduced_blade("small", **options), ss.reduced_blade("small", **options)
    first, second = made.structure.strains, again.structure.strains
    assert again.reused
    assert first is not None
    assert second is not None
    for name in ("modes", "static", "second"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    np.testing.assert_array_equal(first.loads["pressure"], second.loads["pressure"])
    assert (first.places.positions[:, 2] < 0.02).all()
    with pytest.raises(ss.InputError, match="there is no element set or surface 'foot' in the model"):
        ss.reduced_blade("small", contacts=2, modes=4, stress="foot")
    assert ss.reduced_blade("small", contacts=2, modes=4, cache=tmp_path).structure.strains is None
