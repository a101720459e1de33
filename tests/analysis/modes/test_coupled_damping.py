"""Nonlinear modes of structures whose viscous damping couples the modes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import fsolve

import slipstick as ss
from slipstick.structure.complex_modes import complex_modes
from slipstick.typing import Array

M = np.diag([1.0, 1.5])
K = np.array([[60.0, -25.0], [-25.0, 70.0]])
C = np.array([[0.5, -0.1], [-0.1, 0.12]])  # couples the modes
KT = 30.0

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def problem(C: Array = C, limit: float = 9.0, harmonics: int = 4) -> ss.Problem:
    structure = ss.MatrixStructure(M=M, C=C, K=K, dofs=["a", "b"])
    contact = ss.FrictionContact(kt=KT, mu=0.3, normal_load=limit / 0.3)
    pair = ss.ContactPair(name="c", contact=contact, tangential="a")
    return ss.Problem(structure, contacts=pair, loads=ss.Load(dof="b", cos=1.0), harmonics=harmonics)


@pytest.mark.parametrize("mode", [1, 2])
@pytest.mark.parametrize("scale", [1.0, 6.0, 1e-3])
def test_a_stuck_contact_is_a_spring(mode: int, scale: float) -> None:
    """``det(K + i w (C - xi M) - w^2 M) = 0`` by brute force; with little damping it is the linear complex mode."""
    branch = ss.nonlinear_modes(problem(scale * C), amplitude=(0.01, 0.011), mode=mode)
    w, D = float(branch.dataset.omega[0]), float(branch.dataset.modal_damping[0])
    stiffness = K + np.diag([KT, 0.0])

    def determinant(at: Array) -> list[float]:
        value = np.linalg.det(stiffness + 1j * at[0] * (scale * C - at[1] * M) - at[0] ** 2 * M)
        return [value.real, value.imag]

    exact = fsolve(determinant, [w * 1.01, 2.1 * D * w], xtol=1e-13)
    assert [w, 2.0 * D * w] == pytest.approx(exact, rel=1e-8)
    if scale < 1.0:
        pole = complex_modes(M, scale * C, stiffness).upper.poles[mode - 1]
        assert [w, D] == pytest.approx([pole.imag, -pole.real / abs(pole)], rel=1e-5)


def test_forced_peaks_are_on_the_mode() -> None:
    """At phase resonance: the peak of the forced response under the load factor of a point, to one per cent."""
    branch = ss.nonlinear_modes(problem(0.3 * C), amplitude=(0.2, 1.0))
    found = branch.dataset
    k = len(branch) // 2
    factor, w = float(found.load_factor[k]), float(found.omega[k])
    forced = problem(0.3 * C).with_parameter("load", factor)
    peak = max(ss.forced_response(forced, omega=(0.93 * w, 1.07 * w)).peaks("a"), key=lambda p: p[1])
    assert peak[0] == pytest.approx(w, rel=0.01)
    assert peak[1] == pytest.approx(float(found.amplitude[k, 0]), rel=0.02)


def test_damping_that_couples_next_to_nothing_is_the_limit() -> None:
    """Proportional damping with a coupling of 1e-7 and without."""
    proportional = 0.01 * K + 0.02 * M
    plain = ss.nonlinear_modes(problem(proportional), amplitude=(0.25, 0.6)).dataset
    other = ss.nonlinear_modes(problem(proportional + 1e-7 * C), amplitude=(0.25, 0.6)).dataset
    for name in ("omega", "modal_damping", "load_factor"):
        assert float(other[name][-1]) == pytest.approx(float(plain[name][-1]), rel=1e-5)


def test_modes_of_damping_that_couples_are_refused_with_what_can_be_given() -> None:
    structure = ss.MatrixStructure(M=M, C=C, K=K, dofs=["a", "b"])
    with pytest.raises(ss.InputError, match=r"couples the modes.*ss\.ModalStructure"):
        structure.by_modes()
