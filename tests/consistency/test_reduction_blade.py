"""The blade with its contacts: receptance of the reduction against direct solution of the full model."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from helpers.reductions import receptance_errors
from scipy.sparse.linalg import splu

from slipstick.fem.retained import Retained
from slipstick.models.blade import BladeModel, finite_element_blade
from slipstick.models.blade_mesh import blade_shape
from slipstick.structure.reduction.reduce import Reduction, reduce_model


@cache
def full(size: str) -> Retained:
    return finite_element_blade(BladeModel(shape=blade_shape(size)))


@cache
def reduced(size: str, **wishes: object) -> tuple[Retained, Reduction]:
    whole = full(size)
    return whole, reduce_model(whole.model.K, whole.model.M, **whole.request, **wishes)


FEW_AND_MANY = pytest.mark.parametrize("count", [4, pytest.param(20, marks=pytest.mark.verify)])


@FEW_AND_MANY
def test_small_blade_up_to_five_times_the_first_resonance(count: int) -> None:
    whole, reduction = reduced("small", modes=128)
    omega = reduction.structure.omega
    errors = receptance_errors(reduction, whole.model.K, whole.model.M, omega[0] * np.linspace(0.1, 5.0, count))
    assert max(errors.values()) < 1e-7
    beside_resonance = receptance_errors(reduction, whole.model.K, whole.model.M, omega[0] * np.array([0.999, 1.001]))
    assert max(beside_resonance.values()) < 1e-6
    assert reduction.complete is True


def test_modes_follow_from_the_accuracy() -> None:
    whole, reduction = reduced("small", frequency_range=(0.0, 5.0 * 1317.0))
    assert reduction.structure.omega.size < 100
    errors = receptance_errors(reduction, whole.model.K, whole.model.M, 1317.0 * np.array([0.5, 2.5, 3.3, 4.6, 5.0]))
    assert max(errors.values()) < 1e-7


def test_residual_terms_earn_their_place() -> None:
    """Without them 128 modes miss a good part of the compliance at the contacts."""
    _, reduction = reduced("small", modes=128)
    s = reduction.structure
    modal = (s.mode_shapes / s.omega**2) @ s.mode_shapes.T
    missed = np.diag(s.static_compliance - modal)[2::3] / np.diag(s.static_compliance)[2::3]  # normal directions
    assert missed.max() > 1e-3
    assert missed.min() > 0.0


@pytest.mark.verify
def test_large_blade() -> None:
    whole, reduction = reduced("large", modes=128)
    assert reduction.n_full > 101_200
    assert reduction.complete is True
    assert reduction.residuals.max() < 1e-7
    frequencies = reduction.structure.omega[0] * np.array([0.5, 1.5, 3.0, 4.7, 5.0])
    assert max(receptance_errors(reduction, whole.model.K, whole.model.M, frequencies).values()) < 1e-7


@FEW_AND_MANY
def test_damped_small_blade_against_the_damped_full_model(count: int) -> None:
    """``K (1 + i eta) - w^2 M`` solved directly, over the range and exactly at the first resonances."""
    eta = 0.001
    whole, reduction = reduced("small", modes=64, loss_factor=eta)
    K, M = whole.model.K, whole.model.M
    n = len(reduction.structure.dofs)
    receptance = reduction.structure.project(np.eye(n), np.eye(n))
    B = reduction.directions.toarray() if hasattr(reduction.directions, "toarray") else reduction.directions
    first = reduction.structure.natural_frequencies

    def error(w: float) -> float:
        full = B.T @ splu((K * (1 + 1j * eta) - w * w * M).tocsc()).solve(B.astype(complex))
        return float(np.linalg.norm(receptance.at([1], w)[0][0] - full) / np.linalg.norm(full))

    assert max(map(error, np.linspace(0.05, 5.0, count) * first[0])) < 1e-7
    assert max(map(error, first[: count // 4 + 1])) < 1e-6
