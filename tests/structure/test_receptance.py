"""Receptances: by harmonic order, symmetric or not; what is formed when, and large ones without their products."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import scipy.sparse.linalg
from scipy.sparse import csc_array, diags_array

import slipstick as ss
from slipstick.structure import receptance
from slipstick.structure.matrices import DENSE_LIMIT, MatrixStructure
from slipstick.structure.modal import ModalStructure
from slipstick.structure.receptance import ModalReceptance, PoleReceptance, Receptance, SolvedReceptance, undamped

RNG = np.random.default_rng(8)
M = np.diag([1.0, 2.0, 1.5])
K = np.array([[30.0, -10.0, 0.0], [-10.0, 25.0, -5.0], [0.0, -5.0, 20.0]])
C = np.array([[0.4, 0.0, 0.1], [0.0, 0.0, 0.0], [0.1, 0.0, 0.3]])
GYROSCOPIC = np.array([[0.0, 1.5, 0.0], [-1.5, 0.0, 0.7], [0.0, -0.7, 0.0]])
FOLLOWER = np.array([[0.0, 2.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.5, 0.0]])
ROWS, COLUMNS = RNG.standard_normal((3, 2)), RNG.standard_normal((3, 2))


def unsymmetric(w):
    """Dynamic stiffness of a rotor with follower forces, and its derivative by frequency."""
    return K + FOLLOWER + 1j * w * (C + GYROSCOPIC) - w * w * M, 1j * (C + GYROSCOPIC) - 2 * w * M


def rotor(store=np.asarray):
    static = ROWS.T @ np.linalg.solve(K + FOLLOWER, COLUMNS)
    return SolvedReceptance(
        stiffness=lambda w: tuple(map(store, unsymmetric(w))), rows=ROWS, columns=COLUMNS, static=static
    )


def every_kind():
    dofs = ["a", "b", "c"]
    modal = ModalStructure(
        omega=[3.0, 5.0], mode_shapes=RNG.standard_normal((3, 2)), dofs=dofs, loss_factor=0.02, damping_ratio=0.01
    )
    yield modal.project(ROWS, COLUMNS)
    yield MatrixStructure(M=M, C=C, K=K, dofs=dofs).project(ROWS, COLUMNS)
    yield rotor()
    yield rotor(csc_array)


def test_the_kinds_are_different():
    kinds = [ModalReceptance, PoleReceptance, SolvedReceptance, SolvedReceptance]
    assert [type(each) for each in every_kind()] == kinds


@pytest.mark.parametrize("kind", range(4))
def test_the_derivative_is_by_the_principal_frequency(kind):
    seen, orders, h = list(every_kind())[kind], np.array([1, 2, 5]), 1e-5
    for omega in (0.7, 1.9):
        slope = seen.at(orders, omega)[1]
        difference = (seen.at(orders, omega + h)[0] - seen.at(orders, omega - h)[0]) / (2 * h)
        np.testing.assert_allclose(slope, difference, rtol=1e-6, atol=1e-7 * np.abs(slope).max())


@pytest.mark.parametrize("kind", range(4))
def test_many_frequencies_are_each_alone(kind):
    seen, orders, omegas = list(every_kind())[kind], np.array([1, 3]), np.array([0.4, 1.1, 2.3])
    value, slope = seen.at(orders, omegas)
    assert value.shape == slope.shape == (3, 2, 2, 2)
    for omega, a, da in zip(omegas, value, slope, strict=True):
        alone = seen.at(orders, omega)
        np.testing.assert_allclose(a, alone[0], rtol=1e-12)
        np.testing.assert_allclose(da, alone[1], rtol=1e-12)
        third = seen.at([1], 3 * omega)
        np.testing.assert_allclose(a[1], third[0][0], rtol=1e-12)
        np.testing.assert_allclose(da[1], 3 * third[1][0], rtol=1e-12)


@pytest.mark.parametrize("store", [np.asarray, csc_array])
def test_unsymmetric_stiffness_is_solved_with_its_transpose(store):
    value, slope = rotor(store).at([1, 2], 1.3)
    for w, order, a, da in zip((1.3, 2.6), (1, 2), value, slope, strict=True):
        Z, dZ = unsymmetric(w)
        inverse = np.linalg.inv(Z)
        np.testing.assert_allclose(a, ROWS.T @ inverse @ COLUMNS, rtol=1e-12)
        np.testing.assert_allclose(da, -order * ROWS.T @ inverse @ dZ @ inverse @ COLUMNS, rtol=1e-12)


def test_undamped_receptance_of_modes():
    modes = RNG.standard_normal((3, 4))
    omega, static, second = np.array([1.0, 2.0, 4.0, 7.0]), 3 * np.eye(3), 0.1 * np.eye(3)
    value = undamped(omega, modes, static, second).at([2], 1.3)[0][0]
    w = 2.6
    tail = 1 / (omega**2 - w * w) - 1 / omega**2
    np.testing.assert_allclose(value, (modes * tail) @ modes.T + static + w * w * second, rtol=1e-12)


def modal() -> ModalReceptance:
    rng = np.random.default_rng(3)
    left, right = rng.standard_normal((4, 6)), rng.standard_normal((5, 6))
    w = np.linspace(1.0, 9.0, 6)
    static = (left / w**2) @ right.T
    return ModalReceptance(left=left, right=right, stiffness=w**2 * (1 + 0.01j), damping=0.02 * w, static=static)


def test_large_receptances_are_the_sum_without_their_products(monkeypatch: pytest.MonkeyPatch) -> None:
    frequencies = [0.0, 0.7, 3.3, 20.0]
    kept = modal().at([1], frequencies)
    monkeypatch.setattr(receptance, "_MOST_PRODUCTS", 0)
    large = modal()
    formed = large.at([1], frequencies)
    assert "_products" not in vars(large)
    for one, other in zip(kept, formed, strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-12)


def test_nothing_is_formed_before_a_frequency_is_asked() -> None:
    """A problem is projected for its warnings and for the recorder too, which need the static part alone."""
    poles = PoleReceptance(
        left=np.ones((2, 3)) + 0j, right=np.ones((2, 3)) + 0j, poles=np.array([1j, -1j, -1.0]), static=np.eye(2)
    )
    for projected in (modal(), poles):
        assert "_products" not in vars(projected)
        projected.at([1], 1.5)
        assert "_products" in vars(projected)


def test_a_stiffness_is_factorised_once(monkeypatch: pytest.MonkeyPatch) -> None:
    counted = []
    factorise = scipy.sparse.linalg.splu
    monkeypatch.setattr(scipy.sparse.linalg, "splu", lambda A, **options: counted.append(1) or factorise(A, **options))
    n = DENSE_LIMIT + 1
    K = diags_array([np.full(n - 1, -1.0), np.full(n, 2.0), np.full(n - 1, -1.0)], offsets=[-1, 0, 1])
    names = [str(i) for i in range(n)]
    structure = MatrixStructure(M=diags_array([np.ones(n)], offsets=[0]), K=K, loss_factor=0.01, dofs=names)
    before = len(counted)
    end = np.eye(n)[:, -1:]
    values = [structure.project(end, end).static for _ in range(3)]
    assert len(counted) == before + 1
    assert values[0] == values[2] == pytest.approx(n / (n + 1), rel=1e-9)
    again = pickle.loads(pickle.dumps(structure))
    assert again.project(end, end).static == pytest.approx(n / (n + 1), rel=1e-9)


@pytest.mark.parametrize("store", [np.asarray, csc_array])
def test_no_rows_or_no_columns(store):
    none = np.zeros((3, 0))
    for rows, columns in ((none, COLUMNS), (ROWS, none)):
        seen = SolvedReceptance(
            stiffness=lambda w: tuple(map(store, unsymmetric(w))), rows=rows, columns=columns, static=rows.T @ columns
        )
        value, slope = seen.at([1], 2.0)
        assert value.shape == slope.shape == (1, rows.shape[1], columns.shape[1])


@pytest.mark.parametrize("loss", [(0.1, 0.1), (0.1, 0.2)], ids=["one loss factor", "loss factors"])
def test_an_answer_is_the_receptance_times_the_forces(loss):
    random = np.random.default_rng(3)
    left, right, static, residual, second = (random.normal(size=(2, 2)) for _ in range(5))
    receptance = ModalReceptance(
        left=left, right=right, stiffness=np.array([1.0, 2.0]) * (1.0 + 1j * np.array(loss)), damping=[0.1, 0.2],
        static=static, residual=residual, second=second,
    )  # fmt: skip
    orders, omega, F = np.array([1.0, 3.0]), np.array([0.5, 1.0, 2.0]), random.normal(size=(3, 2, 4))
    A, _ = receptance.at(orders, omega)
    expected = np.einsum("nkrc,nck->nrk", A, F[:, :, 0::2] - 1j * F[:, :, 1::2])
    found = receptance.answer(orders, omega, F)
    assert found[:, :, 0::2] == pytest.approx(expected.real, rel=1e-13, abs=1e-13)
    assert found[:, :, 1::2] == pytest.approx(-expected.imag, rel=1e-13, abs=1e-13)
    assert receptance.answer(orders[:0], omega, F[:, :, :0]).shape == (3, 2, 0)


class OnlyAt(Receptance):
    """A receptance of one's own: it tells what it must."""

    def __init__(self, own):
        self.static, self.at = own.static, own.at

    def at(self, orders, omega):
        raise NotImplementedError


def test_a_receptance_that_tells_only_what_it_must() -> None:
    """All that is made of ``at`` equals what a sum over modes makes without it; the rest is said to be unknown."""
    own = ss.ModalStructure(
        omega=[2.0, 3.0], mode_shapes=[[1.0, 0.2], [0.3, -1.0]], dofs=["x", "y"], loss_factor=0.02
    ).project(np.eye(2), np.eye(2)[:, :1])
    plain, orders, omega = OnlyAt(own), np.array([1.0, 3.0]), np.array([0.7, 1.1, 2.5])
    np.testing.assert_allclose(plain.conjugates(orders, 0.7), own.conjugates(orders, 0.7), rtol=1e-12, atol=1e-15)
    outs = [np.empty((3, 2, 1, 2, 3), dtype=complex) for _ in range(2)]
    for kind, out in zip((plain, own), outs, strict=True):
        kind.conjugates_of(orders, omega, out)
    np.testing.assert_allclose(*outs, rtol=1e-12, atol=1e-15)
    forces = np.random.default_rng(1).standard_normal((3, 1, 4))
    np.testing.assert_allclose(plain.answer(orders, omega, forces), own.answer(orders, omega, forces), rtol=1e-12)
    assert not plain.summed
    assert plain.waves is plain.of_order(0, 1.0) is None
    assert plain.adjusted({}) is plain.written() is plain.nearly() is plain.turning_with(1.0) is plain
    for ask in (lambda: plain.adjusted({"k": 1.0}), lambda: plain.by_parameter("k", orders, 1.0)):
        with pytest.raises(ss.InputError, match="k cannot be followed: a OnlyAt does not know its parameters"):
            ask()
