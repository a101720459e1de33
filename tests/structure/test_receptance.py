"""Receptances: what is formed when, and large ones without their products."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import scipy.sparse.linalg
from scipy.sparse import diags_array

from slipstick.structure import receptance
from slipstick.structure.matrices import DENSE_LIMIT, MatrixStructure
from slipstick.structure.receptance import ModalReceptance, PoleReceptance


def modal() -> ModalReceptance:
    rng = np.random.default_rng(3)
    left, right = rng.standard_normal((4, 6)), rng.standard_normal((5, 6))
    w = np.linspace(1.0, 9.0, 6)
    static = (left / w**2) @ right.T
    return ModalReceptance(left=left, right=right, stiffness=w**2 * (1 + 0.01j), damping=0.02 * w, static=static)


def test_large_receptances_are_the_sum_without_their_products(monkeypatch: pytest.MonkeyPatch) -> None:
    frequencies = [0.0, 0.7, 3.3, 20.0]
    kept = modal().at(frequencies)
    monkeypatch.setattr(receptance, "_SMALL", 0)
    real = modal().at(frequencies)
    monkeypatch.setattr(receptance, "_LARGE", 0)
    large = modal()
    formed = large.at(frequencies)
    assert "_products" not in vars(large)
    for one, two, three in zip(kept, real, formed, strict=True):
        np.testing.assert_allclose(two, one, rtol=1e-12)
        np.testing.assert_allclose(three, one, rtol=1e-12)


def test_nothing_is_formed_before_a_frequency_is_asked() -> None:
    """A problem is projected for its warnings and for the recorder too, which need the static part alone."""
    poles = PoleReceptance(
        left=np.ones((2, 3)) + 0j, right=np.ones((2, 3)) + 0j, poles=np.array([1j, -1j, -1.0]), static=np.eye(2)
    )
    for projected in (modal(), poles):
        assert "_products" not in vars(projected)
        projected.at([1.5])
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
