"""Structures that are not held: receptance against the full matrices, statics by inertia relief, whole problems."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.imported import STEEL
from scipy import sparse
from scipy.linalg import eigh

import slipstick as ss
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.solve.linear.factorisation import Factorisation
from slipstick.structure.free import FreeStructure, free_structure

N = 40


def chain() -> tuple[np.ndarray, np.ndarray]:
    """Forty masses in a row, that nothing holds."""
    k = np.linspace(800.0, 1500.0, N - 1)
    K = np.diag(np.append(k, 0.0) + np.append(0.0, k)) - np.diag(k, 1) - np.diag(k, -1)
    return K, np.diag(np.linspace(1.0, 2.0, N))


NAMES = [f"u{i}" for i in range(N)]
KEPT = ["u0", "u10", "u39"]


def reduced(modes: int = 20, **given: Any) -> FreeStructure:
    K, M = chain()
    return free_structure(K, M, dofs=NAMES, keep=KEPT, modes=modes, **given)


def exact(w: float) -> np.ndarray:
    K, M = chain()
    own = [0, 10, 39]
    return np.linalg.inv(K - w * w * M)[np.ix_(own, own)]


def test_the_receptance_is_that_of_the_matrices() -> None:
    receptance = reduced(modes=39).project(np.eye(3), np.eye(3))
    for w in (0.05, 2.0, 5.0):
        value, slope = receptance.at([1, 2], w)
        for i, m in enumerate((1, 2)):
            assert value[i].real == pytest.approx(exact(m * w), rel=1e-8, abs=1e-9 * np.abs(exact(m * w)).max())
            ends = (exact(m * (w + 1e-6)) - exact(m * (w - 1e-6))) / 2e-6
            assert slope[i].real == pytest.approx(ends, rel=1e-4, abs=1e-4 * np.abs(ends).max())


def test_all_that_a_balance_asks_is_the_same_receptance() -> None:
    """Compiled sums, products, the sum taken apart, and derivatives by central differences."""
    receptance = reduced(modes=20, loss_factor=0.01, damping_ratio=0.02).project(np.eye(3), np.eye(3))
    orders, omega = np.array([1, 2, 5]), np.array([0.7, 1.9])
    value, slope = receptance.at(orders, omega)
    many = np.empty((2, 2, 3, 3, 4), dtype=complex)
    receptance.conjugates_of(orders, omega, many)
    for i, w in enumerate(omega):
        for found in (receptance.conjugates(orders, float(w)), many[i]):
            np.testing.assert_allclose(found[0, :, :, 1:].conj().T, value[i].transpose(0, 1, 2), rtol=1e-12)
            np.testing.assert_allclose(found[1, :, :, 1:].conj().T, slope[i], rtol=1e-12)
            np.testing.assert_allclose(found[0, :, :, 0].T, receptance.static, rtol=1e-12)
    forces = np.random.default_rng(1).normal(size=(2, 3, 6))
    hat = forces[:, :, 0::2] - 1j * forces[:, :, 1::2]
    moved = receptance.answer(orders, omega, forces)
    exact_moved = np.einsum("nkij,njk->nik", value, hat)
    np.testing.assert_allclose(moved[:, :, 0::2] - 1j * moved[:, :, 1::2], exact_moved, rtol=1e-10)
    apart = receptance.factors(orders, 0.7)
    at_rest = (apart.left * apart.weight[0]) @ apart.right.T + apart.part_weight[0, 0] * apart.parts.matrices[0]  # type: ignore[attr-defined]
    np.testing.assert_allclose(at_rest, receptance.static, rtol=1e-9)
    for name, own in (("loss_factor", 0.01), ("damping", 1.0), ("mode2.omega", reduced().natural_frequencies[1])):
        h = 1e-6 * max(own, 0.1)
        ends = [receptance.changed(**{name: own + step}) for step in (h, -h)]
        rate = (ends[0].at(orders, omega)[0] - ends[1].at(orders, omega)[0]) / (2.0 * h)
        found = receptance.by_parameter(name, orders, omega)
        np.testing.assert_allclose(found, rate, rtol=1e-5, atol=1e-7 * np.abs(rate).max())
        static = (ends[0].static - ends[1].static) / (2.0 * h)
        np.testing.assert_allclose(receptance.static_by_parameter(name), static, rtol=1e-5, atol=1e-9)


def test_statics_are_those_of_inertia_relief() -> None:
    """By the sum over all elastic modes, and between two dofs by the springs between them."""
    K, M = chain()
    values, shapes = eigh(K, M)
    elastic = shapes[[0, 10, 39], 1:]
    static = reduced(modes=4).elastic.static_compliance
    assert static == pytest.approx((elastic / values[1:]) @ elastic.T, rel=1e-9, abs=1e-12)
    apart = np.array([[1.0], [-1.0], [0.0]])
    springs = np.sum(1.0 / np.linspace(800.0, 1500.0, N - 1)[:10])
    assert reduced(modes=4).project(apart, apart).static == pytest.approx(springs, rel=1e-10)


def test_a_mesh_that_floats() -> None:
    """Six rigid-body modes; sparse matrices, Lanczos."""
    model = assemble_mesh(MeshModel(mesh=box((0.3, 0.03, 0.01), (8, 2, 1), "hex20")), source="free", material=STEEL)
    K, M = model.K, model.M
    assert K.shape[0] > 400
    keep = [model.dofs[0], model.dofs[100], model.dofs[-1]]
    found = free_structure(K, M, dofs=model.dofs, keep=keep, modes=12)
    assert found.rigid_shapes.shape == (3, 6)
    values = eigh(K.toarray(), M.toarray(), eigvals_only=True, subset_by_index=(6, 8))
    assert found.natural_frequencies[:3] == pytest.approx(np.sqrt(values), rel=1e-6)
    w = 0.5 * found.natural_frequencies[0]
    own = [model.dofs.index(name) for name in keep]
    full = np.linalg.inv(K.toarray() - w * w * M.toarray())[np.ix_(own, own)]
    value = found.project(np.eye(3), np.eye(3)).at([1], w)[0][0].real
    assert np.abs(value - full).max() < 1e-6 * np.abs(full).max()


def test_hundreds_of_kept_dofs_take_what_a_body_on_soft_springs_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Solutions are counted, and both receptances held against the full model."""
    model = assemble_mesh(MeshModel(mesh=box((0.3, 0.03, 0.02), (12, 2, 2), "hex20")), source="free", material=STEEL)
    K, M, n = model.K, model.M, len(model.dofs)
    own = np.linspace(0, n - 1, 120).astype(int)
    columns: list[int] = []
    solve = Factorisation.solve

    def counted(self: Factorisation, B: np.ndarray) -> np.ndarray:
        if self.solver.__name__ != "_elastic":  # which solves with the factors of a body on supports
            columns.append(np.atleast_2d(B.T).shape[0])
        return solve(self, B)

    monkeypatch.setattr(Factorisation, "solve", counted)
    free = free_structure(K, M, dofs=model.dofs, keep=[model.dofs[i] for i in own], modes=20)
    taken = sum(columns)
    columns.clear()
    springs = np.zeros(n)
    springs[own] = 1e-9 * K.diagonal().max()
    soft = sparse.csr_array(K + sparse.diags_array(springs))
    reduced = ss.reduce(soft, M, keep=[model.dofs[i] for i in own], dofs=model.dofs, modes=26)
    assert taken < 1.5 * sum(columns)
    monkeypatch.undo()
    w = 0.6 * free.natural_frequencies[0]
    values = [body.project(np.eye(120), np.eye(120)).at([1], w)[0][0].real for body in (free, reduced)]
    for value, stiffness, error in zip(values, (K, soft), (1e-8, 1e-4), strict=True):  # soft springs lose digits
        full = np.linalg.inv(stiffness.toarray() - w * w * M.toarray())[np.ix_(own, own)]
        assert np.abs(value - full).max() < error * np.abs(full).max()
    assert np.abs(values[0] - values[1]).max() < 1e-3 * np.abs(values[0]).max()


def test_directions_are_kept_as_by_reduce() -> None:
    """A column of a matrix is a direction: here a difference, whose forces are in balance."""
    K, M = chain()
    apart = np.zeros((N, 1))
    apart[0], apart[10] = 1.0, -1.0
    found = free_structure(K, M, dofs=NAMES, keep=apart, names=["opening"], modes=4)
    assert found.dofs == ("opening",)
    assert np.abs(found.rigid_shapes).max() < 1e-12
    springs = np.sum(1.0 / np.linspace(800.0, 1500.0, N - 1)[:10])
    assert found.elastic.static_compliance == pytest.approx(springs, rel=1e-10)


def test_negative_stiffness_is_told() -> None:
    K, M = chain()
    K[:2, :2] -= 5000.0 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    with pytest.raises(InputError, match="K has negative eigenvalues"):
        free_structure(K, M, dofs=NAMES, keep=KEPT, modes=3)


def floating(load: ss.Load | None = None, **ports: Any) -> ss.Problem:
    damper = ss.FrictionContact(kt=300.0, mu=0.3, normal_load=10.0)
    pair = ss.ContactPair(name="damper", contact=damper, **(ports or {"tangential": {"u10": 1.0, "u39": -1.0}}))
    loads = [ss.Load(dof="u0", sin=8.0), *([] if load is None else [load])]
    return ss.Problem(reduced(modes=12, damping_ratio=0.02), contacts=pair, loads=loads, harmonics=range(8))


def test_a_floating_chain_with_a_damper_against_time_integration() -> None:
    branch = ss.forced_response(floating(), omega=(1.3, 1.9), at=[1.5])
    assert branch.outcome is ss.Outcome.COMPLETED
    assert branch.dataset.newton_iterations.values.mean() < 5
    at = branch.at(1.5)
    assert branch.dataset.slip_fraction.values[at, 0] > 0.0
    assert branch.check_in_time(at).relative_difference < 5e-3


def test_rigid_body_motion_is_no_loss_of_stability() -> None:
    data = ss.steady_response(floating(), omega=1.5, stability=True).dataset
    assert bool(data.stable[0])


def test_it_is_stored(tmp_path: Path) -> None:
    branch = ss.steady_response(floating(), omega=1.5)
    branch.save(tmp_path / "free.nc")
    again = ss.steady_response(ss.load(tmp_path / "free.nc").problem, omega=1.5)
    assert again.dataset.displacement.values == pytest.approx(branch.dataset.displacement.values, rel=1e-12)


def test_what_pushes_it_away_is_refused() -> None:
    with pytest.raises(InputError, match="contact 'damper': its mean force pushes the structure away"):
        floating(tangential="u10")
    with pytest.raises(InputError, match="those of harmonic 0 are not in balance"):
        floating(ss.Load(dof="u0", harmonic=0, cos=1.0))
    K, M = chain()
    K[0, 0] += 100.0
    with pytest.raises(InputError, match="K: holds the body"):
        free_structure(K, M, dofs=NAMES, keep=KEPT, modes=3)
    with pytest.raises(InputError, match="there is no dof 'v'"):
        free_structure(K, M, dofs=NAMES, keep=["v"], modes=3)
