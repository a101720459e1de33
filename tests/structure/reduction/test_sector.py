"""Phases of a sector are reduced as bodies are: to a number of modes, or to an accuracy up to a frequency."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy.sparse import csc_array, csr_array

from slipstick.solve.linear.factorisation import Factorisation, Inertia, SingularMatrixError
from slipstick.structure.cyclic import CyclicStructure
from slipstick.structure.reduction.data import Columns
from slipstick.structure.reduction.request import Accuracy
from slipstick.structure.reduction.sector import SectorModes, reduce_phase

N = 120


class Dense:
    """Factors of Hermitian matrices that are dense, with their inertia."""

    counted = None

    def __init__(self, K: Any, M: Any) -> None:
        self.K, self.M = K.toarray(), M.toarray()

    def at(self, shift: float, solve: bool = True) -> Factorisation:
        matrix = self.K - shift * self.M
        negative = int((np.linalg.eigvalsh(matrix) < 0.0).sum())
        return Factorisation("dense", partial(np.linalg.solve, matrix), 0, Inertia(N - negative, negative, 0), complex)


def phase() -> tuple[csr_array, csr_array, csc_array]:
    """A chain of masses whose springs turn the phase: Hermitian, with frequencies from 0.6 to 27 rad/s."""
    turn = np.exp(0.3j)
    K = np.diag(2.1 + 0.05 * np.arange(N) ** 2) - turn * np.eye(N, k=1) - turn.conj() * np.eye(N, k=-1)
    keep = np.zeros((N, 2))
    keep[[3, 40], [0, 1]] = 1.0
    return csr_array(K), csr_array(np.eye(N)), csc_array(keep)


@pytest.mark.parametrize("accuracy", [1e-3, 1e-5])
def test_accuracy_up_to_a_frequency_holds_below_it(accuracy: float) -> None:
    K, M, B = phase()
    top = 1.5
    want = Accuracy(relative=accuracy, highest=top)
    made = reduce_phase(K, M, Columns(B, np.zeros((N, 0))), want, Dense(K, M))
    a, w2 = made.amplitudes, made.omega**2
    assert made.error_estimate is not None
    assert made.error_estimate <= accuracy
    assert made.omega.size < N
    for omega in np.linspace(0.05, top, 7):
        exact = B.T @ np.linalg.solve(K.toarray() - omega**2 * M.toarray(), B.toarray())
        modal = (a * (1.0 / (w2 - omega**2) - 1.0 / w2)) @ a.conj().T + made.static + omega**2 * made.second_residual
        assert np.linalg.norm(modal - exact) <= accuracy * np.linalg.norm(exact)


class Resonant(Dense):
    """Singular but at rest."""

    def at(self, shift: float, solve: bool = True) -> Factorisation:
        if shift:
            raise SingularMatrixError("singular")
        return super().at(shift, solve)


def test_a_resonance_at_the_highest_frequency_is_named_with_its_phase() -> None:
    K, M, B = phase()
    with raises_fault("up_to", says="1.5 rad/s is a natural frequency .* for nodal diameter 3; choose one beside it"):
        reduce_phase(
            K, M, Columns(B, np.zeros((N, 0))), Accuracy(highest=1.5), Resonant(K, M), where="nodal diameter 3"
        )


SECTORS, DOFS = 6, 14


def whole_sector() -> CyclicStructure:
    """A chain of 14 masses in a sector, held at its foot, whose middle is coupled to that of the next one."""
    K0 = np.diag(np.linspace(9.0, 12.0, DOFS)) - 4.0 * (np.eye(DOFS, k=1) + np.eye(DOFS, k=-1))
    K1 = np.zeros((DOFS, DOFS))
    K1[6, 7], K1[8, 6] = -0.3, -0.2
    zero = np.zeros((DOFS, DOFS))
    names = [f"u{i}" for i in range(DOFS)]
    return CyclicStructure(M=(np.eye(DOFS), zero), K=(K0, K1), dofs=names, sectors=SECTORS, loss_factor=2e-3)


def modes_of(whole: CyclicStructure, count: int) -> SectorModes:
    """The sector by the first modes of each phase and what the others leave."""
    phases = {}
    for k in range(SECTORS // 2 + 1):
        modes = whole.phase_modes(k)
        second, kept = modes.left_by(count), modes.shapes[:, :count]
        assert second is not None
        parts = {"shapes": kept, "static": modes.static, "second": second}
        pairs = {name: np.array([part.real, part.imag]) for name, part in parts.items()}
        phases[k] = {"omega": modes.omega[:count], **pairs}
    return SectorModes(dofs=whole.dofs, sectors=SECTORS, phases=phases, loss_factor=whole.loss_factor)


@pytest.mark.parametrize("size", [0.0, 0.1, 2.0])
def test_gas_on_a_reduced_sector_is_that_on_the_whole_one(size: float) -> None:
    """Differing by direction and nodal diameter, up to a sizeable share of the stiffness; loads beside it too."""
    rng = np.random.default_rng(5)
    coefficients = size * (rng.normal(size=SECTORS) + 1j * rng.normal(size=SECTORS))
    shape = np.diag(np.where(np.arange(DOFS) > 10, 1.0, 0.0))
    whole, few = whole_sector(), modes_of(whole_sector(), 7)
    rows = rng.normal(size=(2 * DOFS, 2))
    for engine_order in (-2, 1, 3):
        exact, found = (
            s.with_aerodynamics(coefficients, shape).travelling_wave(engine_order).project(rows, rows)
            for s in (whole, few)
        )
        omega = np.array([0.2, 0.4, 0.6])
        (value, _), (near, rate) = (each.at(np.array([1, 2]), omega) for each in (exact, found))
        size_of = np.abs(value).max(axis=(-1, -2), keepdims=True)
        assert (np.abs(near - value) / size_of).max() < 2e-3
        h = 1e-6
        beside = [found.at(np.array([1, 2]), omega + step)[0] for step in (h, -h)]
        np.testing.assert_allclose(rate, (beside[0] - beside[1]) / (2.0 * h), rtol=1e-5, atol=1e-7)
    assert few.with_aerodynamics(coefficients, shape).phase_modes(2) is few.phase_modes(2)


def test_flutter_of_a_reduced_sector_is_that_of_the_whole_one() -> None:
    whole, few = whole_sector(), modes_of(whole_sector(), 7)
    shape = np.diag(np.where(np.arange(DOFS) > 10, 1.0, 0.0))
    coefficients = np.where(np.arange(SECTORS) == 2, -0.2j, 0.05j)
    exact, found = (s.with_aerodynamics(coefficients, shape).travelling_wave(2) for s in (whole, few))
    first, second = exact.growing(2), found.growing(2)
    assert first.size
    for pole in second:
        assert np.abs(first - pole).min() < 2e-3 * abs(pole)
    assert found.energy_fed == exact.energy_fed == "nodal diameter 2"
    np.testing.assert_allclose(found.damping_ratios, exact.damping_ratios[:7], rtol=0.05, atol=1e-5)
    again = SectorModes(**few.with_aerodynamics(coefficients, shape).arguments)
    np.testing.assert_allclose(again.influence(2), coefficients[2] * shape, atol=1e-15)


def test_a_damping_ratio_is_that_of_every_mode() -> None:
    """With half the loss factor."""
    sector = SectorModes(**{**modes_of(whole_sector(), 5).arguments, "damping_ratio": 0.03})
    np.testing.assert_allclose(sector.travelling_wave(2).damping_ratios, 0.03 + 0.5 * sector.loss_factor, rtol=1e-12)
