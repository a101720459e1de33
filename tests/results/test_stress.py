"""Stress along a branch against closed forms, beam theory, and the full finite element model under the same forces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.blocks import METAL, block, branch, solved_whole, stressed, with_structure
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.strains import chosen_elements, strain_matrix
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.results.deflection import deflection_of
from slipstick.results.stress import _measured, principals, von_mises
from slipstick.structure.modal import LoadShape
from slipstick.structure.strains import Strains


def full_strain(made: ss.Branch, point: int) -> np.ndarray:
    """Coefficients (n_elements, 6, L) by direct solutions of the whole model."""
    mesh, whole = block().model.mesh, solved_whole(made, point)
    _, matrix = strain_matrix(mesh, METAL, chosen_elements(mesh, "all"))
    return np.asarray((matrix.T @ whole.reshape(-1, whole.shape[-1])).reshape(-1, 6, whole.shape[-1]))


@pytest.mark.parametrize("parameter", [False, True])
def test_the_strain_is_that_of_the_full_model(parameter: bool) -> None:
    """With the modes of the motion it is right to what these leave out of both; contacts press on it nearby."""
    made = stressed(60, parameter)
    for point in (0, len(made) - 1):
        exact = full_strain(made, point)
        found = made.stress(point)["strain"].values[0]
        np.testing.assert_allclose(found, exact, atol=2e-5 * np.abs(exact).max())


def error(made: ss.Branch, **less: Any) -> float:
    """Of all strains at the first point, with strains that know less."""
    structure = made.problem.structure  # type: ignore[union-attr]
    known = ss.ModalStructure(**{**structure.arguments, "strains": replace(structure.strains, **less)})
    exact = full_strain(made, 0)
    found = with_structure(made, known).stress(0)["strain"].values[0]
    return float(np.abs(found - exact).max() / np.abs(exact).max())


def test_what_the_modes_leave_out_counts_beside_contacts() -> None:
    """With both residuals the error is that of (omega / omega_r)^4, with the static one alone of its square."""
    whole = {modes: error(stressed(modes)) for modes in (6, 12, 24)}
    assert whole[24] < whole[12] < whole[6]
    made = stressed(12)
    structure = made.problem.structure  # type: ignore[union-attr]
    omega, top = structure.natural_frequencies, 4.0 * float(made.dataset.omega[0])
    assert whole[12] < (top / omega[-1]) ** 4
    static_alone = error(made, second=None)
    assert 3.0 * whole[12] < static_alone < (top / omega[-1]) ** 2
    strains, a = structure.strains, structure.mode_shapes
    of_modes = (strains.modes / omega**2) @ a.T
    of_loads = {
        name: (strains.modes / omega**2) @ np.asarray(shape.participation) for name, shape in structure.shapes.items()
    }
    assert error(made, second=None, static=of_modes, loads=of_loads) > 20.0 * static_alone


def test_the_static_part_is_exact_with_one_mode() -> None:
    """Mean contact forces and constant loads act through the static columns alone."""
    made = stressed(1)
    exact = full_strain(made, 2)[..., 0]
    found = made.stress(2)["strain"].sel(coefficient="0").values[0]
    np.testing.assert_allclose(found, exact, atol=1e-6 * np.abs(exact).max())


def test_stress_is_stored_and_read(tmp_path: Any) -> None:
    made = stressed(12)
    stored = ss.load(made.save(tmp_path / "r.nc"))
    for name in ("stress", "von_mises_largest"):
        np.testing.assert_allclose(stored.stress(3)[name], made.stress(3)[name], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(deflection_of(stored).at(3), deflection_of(made).at(3), atol=1e-12)


def test_nodes_lie_round_the_centroids() -> None:
    """At nodes of the block the fitted strain: its mean over the corners of an element is nearly that of the middle."""
    nodes, middle = stressed(24, at="nodes"), stressed(24)
    found, whole = nodes.stress(0), middle.stress(0)
    assert found.sizes["place"] == block().model.mesh.n_nodes
    assert found["node"].values.tolist() == block().model.mesh.labels.tolist()
    corners = nodes.problem.structure.strains.places.cells["hex8"]  # type: ignore[union-attr]
    mean = found["strain"].values[0][corners].mean(axis=1)
    size = np.abs(whole["strain"].values).max()
    assert np.abs(mean - whole["strain"].values[0]).max() < 0.3 * size


def bar(modes: int) -> ss.Branch:
    """A bar of unit section under a pull at its end, Poisson's ratio 0: (10.1) in one dimension."""
    slender = Material(young=100.0, poisson=0.0, density=1.0)
    model = assemble_mesh(
        MeshModel(mesh=box((4.0, 1.0, 1.0), (16, 1, 1))), source="bar", material=slender, fixed=["x0"]
    )
    body = ss.reduced_body(model, surface="x1", contacts=1, pressure="x1", modes=modes, loss_factor=1e-6, stress="all")
    problem = ss.Problem(body.structure, loads=ss.Load(shape="pressure", cos=-2.0), harmonics=[0, 1, 2])
    return ss.linear_response(problem, omega=[0.5, 3.0])


def test_a_bar_in_tension_has_its_closed_form() -> None:
    """``sigma(x) = p cos(k x) / cos(k l)``, ``k = omega sqrt(rho / E)``, in the mean over each element of length h."""
    found = bar(40).stress()
    x, h = found["position"].values[:, 0], 0.25
    for point, omega in enumerate((0.5, 3.0)):
        k = omega / 10.0
        exact = 2.0 * np.cos(k * x) / np.cos(4.0 * k) * np.sin(0.5 * k * h) / (0.5 * k * h)
        of_xx = {name: found[name].sel(component="xx", coefficient="c1").values[point] for name in ("stress", "strain")}
        np.testing.assert_allclose(of_xx["stress"], exact, rtol=1e-5)
        np.testing.assert_allclose(of_xx["strain"], exact / 100.0, rtol=1e-5)
        for name in ("von_mises_largest", "principal_largest", "stress_alternating"):
            np.testing.assert_allclose(found[name].values[point], exact, rtol=1e-5)
        np.testing.assert_allclose(found["stress_mean"].values[point], 0.0, atol=1e-6)


def bending_stress(along: int, through: int, at: str) -> tuple[np.ndarray, np.ndarray]:
    """Largest stress along a cantilever under a slow force at its end, and that of beam theory, at the same places."""
    metal = Material(young=100.0, poisson=0.0, density=1.0)
    mesh = box((10.0, 1.0, 1.0), (along, 1, through), "hex20")
    model = assemble_mesh(MeshModel(mesh=mesh), source="beam", material=metal, fixed=["x0"])
    tip = [label for label, node in enumerate(mesh.nodes, 1) if np.allclose(node, (10.0, 0.0, 0.5))]
    other = [label for label, node in enumerate(mesh.nodes, 1) if np.allclose(node, (10.0, 1.0, 0.5))]
    keep = [f"n{tip[0]}z", f"n{other[0]}z"]
    body = ss.reduced_body(model, keep=keep, modes=8, loss_factor=1e-6, stress="all", stress_at=at)  # type: ignore[arg-type]
    problem = ss.Problem(
        body.structure, loads=[ss.Load(dof=dof, cos=0.5) for dof in keep], harmonics=[0, 1]
    )  # fmt: skip
    found = ss.linear_response(problem, omega=[1e-4]).stress(0)
    x, _, z = found["position"].values.T
    inside = (x > 2.0) & (x < 8.0)
    stress = found["stress"].sel(component="xx", coefficient="c1").values[0]
    return stress[inside], (-(10.0 - x) * (z - 0.5) * 12.0)[inside]


def test_bending_of_a_cantilever_is_that_of_beam_theory() -> None:
    """``sigma = -M z / I`` away from both ends, at nodes of the outer fibres too; finer meshes come nearer."""
    for at in ("elements", "nodes"):
        errors = []
        for along, through in ((5, 2), (10, 2), (20, 2)):
            found, exact = bending_stress(along, through, at)
            errors.append(np.abs(found - exact).max() / np.abs(exact).max())
        assert errors[0] < 0.05
        assert errors[-1] < 2e-3
        assert errors[2] < errors[1] < errors[0] or errors[0] < 1e-4


def measured(**coefficients: dict[str, float]) -> dict[str, float]:
    """A stress given by its coefficients, measured."""
    harmonics = ss.Harmonics([0, 1, 2])
    stress = np.zeros((1, 6, 5))
    names = ("xx", "yy", "zz", "xy", "yz", "zx")
    for component, values in coefficients.items():
        for label, value in values.items():
            stress[0, names.index(component), harmonics.labels.index(label)] = value
    return {name: float(value[0]) for name, value in _measured(harmonics, stress).items()}


def test_measures_of_one_direction() -> None:
    """``30 + 40 cos tau + 10 cos 2 tau``: from 0 at half the period to 80."""
    m = measured(xx={"0": 30.0, "c1": 40.0, "c2": 10.0})
    assert m["von_mises_largest"] == pytest.approx(80.0, rel=1e-9)
    assert m["principal_smallest"] == pytest.approx(0.0, abs=1e-6)
    assert m["stress_alternating"] == pytest.approx(40.0, rel=1e-9)
    assert m["stress_mean"] == pytest.approx(40.0, rel=1e-6)
    assert m["von_mises_static"] == pytest.approx(30.0)
    assert m["von_mises_amplitude"] == pytest.approx(50.0, rel=1e-9)
    pressed = measured(xx={"0": -30.0, "s1": 7.0})
    assert pressed["stress_mean"] == pytest.approx(-30.0, rel=1e-6)
    assert pressed["principal_largest"] == pytest.approx(0.0, abs=1e-9)
    assert pressed["principal_smallest"] == pytest.approx(-37.0, rel=1e-9)


def test_measures_of_shear_and_of_a_turning_stress() -> None:
    """Pure shear counts sqrt(3); tension and shear a quarter of a period apart, of equal von Mises stress: a circle."""
    shear = measured(xy={"c1": 5.0})
    assert shear["stress_alternating"] == pytest.approx(5.0 * np.sqrt(3.0), rel=1e-9)
    assert shear["principal_largest"] == pytest.approx(5.0, rel=1e-9)
    turning = measured(xx={"0": 2.0, "c1": 6.0}, xy={"s1": 6.0 / np.sqrt(3.0)})
    assert turning["stress_alternating"] == pytest.approx(6.0, rel=1e-9)
    assert turning["von_mises_amplitude"] == pytest.approx(6.0, rel=1e-9)
    assert turning["von_mises_largest"] == pytest.approx(8.0, rel=1e-9)
    assert turning["stress_mean"] == pytest.approx(2.0, rel=1e-5)


def test_measures_hold_against_a_dense_grid() -> None:
    rng = np.random.default_rng(4)
    harmonics = ss.Harmonics(range(6))
    stress = rng.normal(size=(8, 6, harmonics.size)) / (1.0 + np.arange(harmonics.size))
    found = _measured(harmonics, stress)
    tau = np.arange(600) * (2.0 * np.pi / 600)
    history = stress @ harmonics.H_minus(tau).T
    np.testing.assert_allclose(found["von_mises_largest"], von_mises(history).max(axis=1), rtol=3e-4)
    np.testing.assert_allclose(found["principal_largest"], principals(history)[..., 0].max(axis=1), rtol=3e-4)
    np.testing.assert_allclose(found["principal_smallest"], principals(history)[..., 2].min(axis=1), rtol=3e-4)
    for k in range(8):
        apart = history[k][:, :, None] - history[k][:, None, :]
        widest = 0.5 * von_mises(apart.reshape(6, -1)[None])[0].max()
        assert found["stress_alternating"][k] == pytest.approx(widest, rel=3e-4)


def test_a_period_in_time() -> None:
    made = stressed(24)
    over, at = made.stress_history(3, [2, 5], samples=32), made.stress(3, [2, 5])
    assert over["element"].values.tolist() == [2, 5]
    assert float(over["time"][-1]) == pytest.approx(2.0 * np.pi / float(made.dataset.omega[3]) * 31 / 32)
    tau = 2.0 * np.pi * np.arange(32) / 32
    expected = at["stress"].values[0] @ made.harmonics.H_minus(tau).T
    np.testing.assert_allclose(over["stress"].values, expected, atol=1e-15)
    assert (over["von_mises"].values <= at["von_mises_largest"].values[0][:, None] * (1 + 1e-9)).all()
    np.testing.assert_allclose(over["principal"].values.sum(axis=-1), expected[:, :3].sum(axis=1), atol=1e-12)


def test_faults_are_sentences() -> None:
    made = stressed(12)
    with raises_fault("at", remedy="it is at these elements: [1, 2, 3, 4, 5]"):
        made.stress(0, at=6)
    with raises_fault("at", found="'tip'"):
        made.stress(0, at="tip")  # type: ignore[arg-type]
    with raises_fault("points", found="10000"):
        made.stress(10_000)
    with pytest.raises(ss.InputError, match="has no geometry and material of elements; ask for them where a model"):
        branch().stress()
    with pytest.raises(ss.InputError, match="the problem of this branch is not known"):
        ss.Branch.from_dataset(branch().dataset).stress()
    with raises_fault("samples", found="0"):
        made.stress_history(0, samples=0)


def test_models_without_elements_say_so() -> None:
    metal = Material(young=100.0, poisson=0.3, density=1.0)
    model = assemble_mesh(MeshModel(mesh=box((4.0, 1.0, 1.0), (4, 1, 1))), source="bar", material=metal, fixed=["x0"])
    for less, sentence in (
        (replace(model, mesh=None), "bar has no mesh, and stress comes from elements and their material"),
        (replace(model, materials={}), "bar has a mesh without materials, and stress comes from elements"),
    ):
        with pytest.raises(ss.InputError, match=sentence):
            ss.reduced_body(less, keep=["n5x"], modes=2, stress="all")
    with raises_fault("stress_at", found="'faces'"):
        ss.reduced_body(model, keep=["n5x"], modes=2, stress="all", stress_at="faces")  # type: ignore[arg-type]
    with raises_fault("stress", found="[]"):
        ss.reduced_body(model, keep=["n5x"], modes=2, stress=[])


def test_the_stress_of_rotation_is_not_in_it() -> None:
    metal = Material(young=2e11, poisson=0.3, density=7800.0)
    mesh = MeshModel(mesh=box((0.3, 0.03, 0.01), (3, 1, 1)))
    model = assemble_mesh(mesh, source="blade", material=metal, fixed=["x0"])
    turning = ss.at_speed(model, 500.0, axis={"point": (-0.1, 0, 0), "direction": (0, 0, 1)})
    with pytest.warns(ss.SlipstickWarning, match="the stress is that of vibration, from the mesh at rest"):
        body = ss.reduced_body(turning, keep=["n5x"], modes=2, stress="all")
    assert any("add the stress of rotation to the mean stress" in sentence for sentence in body.warnings)


def test_strain_follows_a_natural_frequency_that_is_changed() -> None:
    """With all modes known, static strain and motion are sums over them, before and after one becomes softer."""
    rng = np.random.default_rng(2)
    omega, a, e = np.array([3.0, 5.0, 9.0]), rng.normal(size=(2, 3)), rng.normal(size=(6, 3))
    load = rng.normal(size=3)
    places = stressed(6).problem.structure.strains.places.part(np.array([0]))  # type: ignore[union-attr]
    strains = Strains(
        places=places, modes=e, static=(e / omega**2) @ a.T, loads={"p": (e / omega**2) @ load},
        second_loads={"p": np.zeros(6)},
    )  # fmt: skip
    structure = ss.ModalStructure(
        omega=omega, mode_shapes=a, dofs=["x", "y"], strains=strains, static_compliance=(a / omega**2) @ a.T,
        load_shapes={"p": LoadShape(participation=load, static_response=(a / omega**2) @ load)},
    )  # fmt: skip
    changed = structure.changed(**{"mode2.omega": 4.0})
    new = np.array([3.0, 4.0, 9.0])
    assert changed.strains is not None
    np.testing.assert_allclose(changed.strains.static, (e / new**2) @ a.T, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(changed.strains.loads["p"], (e / new**2) @ load, rtol=1e-5, atol=1e-6)
    seen = changed.strains.of(changed, np.arange(6)).project(np.zeros((2, 0)), np.eye(2), ["p"])
    right = np.vstack([a, load])
    found, _ = seen.at([1], 2.0)
    np.testing.assert_allclose(found[0].real, (e / (new**2 - 4.0)) @ right.T, rtol=1e-5, atol=1e-6)


def test_strains_that_do_not_fit_are_refused() -> None:
    structure = stressed(6).problem.structure  # type: ignore[union-attr]
    strains, arguments = structure.strains, structure.arguments
    with raises_fault("strains", "modes", found=f"shape (3, {structure.omega.size})"):
        replace(strains, modes=strains.modes[:3])
    with raises_fault("strains", found=f"modes and dofs (5, {len(structure.dofs)})"):
        ss.ModalStructure(**{**arguments, "strains": replace(strains, modes=strains.modes[:, :5])})
    with raises_fault("strains", says="it has no load shape 'push'"):
        ss.ModalStructure(**{**arguments, "strains": replace(strains, loads={}, second_loads={})})
    with raises_fault("strains", "at", found="'faces'"):
        replace(strains.places, at="faces")
    with raises_fault("strains", "cells", "hex8", found="nodes 0 to 99 of 24"):
        replace(strains.places, cells={"hex8": np.array([[0, 1, 2, 3, 4, 5, 6, 99]] * 5)})


def test_all_arrays_are_in_the_matlab_file(tmp_path: Path) -> None:
    loadmat = pytest.importorskip("scipy.io").loadmat
    made = stressed(12)
    np.testing.assert_array_equal(
        loadmat(made.save_stress(tmp_path / "s.mat", [1, 4]))["stress"], made.stress([1, 4])["stress"]
    )
