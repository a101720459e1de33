"""Unsymmetric matrices and rotation: receptance, derivatives, natural frequencies, time equations, by brute force."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csc_array

from slipstick.errors import InputError
from slipstick.structure import matrices
from slipstick.structure.complex_modes import complex_modes
from slipstick.structure.matrices import MatrixStructure
from slipstick.structure.receptance import PoleReceptance, SolvedReceptance

N = 4
RNG = np.random.default_rng(5)


def _random() -> dict[str, np.ndarray]:
    A, B, S, T = RNG.standard_normal((4, N, N))
    M = np.eye(N) + 0.1 * A @ A.T
    K = 30.0 * np.eye(N) + 4.0 * B @ B.T
    return {
        "M": M, "C": 0.3 * np.eye(N) + 0.1 * S, "K": K + 1.5 * (T - T.T), "gyroscopic": A - A.T,
        "circulatory": 0.2 * (S - S.T),
    }  # fmt: skip


GIVEN = _random()
DOFS = list("abcd")
ROWS, COLUMNS = RNG.standard_normal((2, N, 3))


def stiffness(w: float, speed: float, loss: float = 0.0, damping: float = 1.0, **left_out: Any) -> np.ndarray:
    """The dynamic stiffness, written out."""
    g = GIVEN | left_out
    C, K = g["C"], g["K"]
    C = 0.5 * damping * (C + C.T) + 0.5 * (C - C.T) + speed * g["gyroscopic"]
    return K + 0.5j * loss * (K + K.T) + speed * g["circulatory"] + 1j * w * C - w * w * g["M"]


def test_complex_modes_sum_to_the_inverse() -> None:
    M, C, K = GIVEN["M"], GIVEN["C"], GIVEN["K"]
    poles, right, left = found = complex_modes(M, C, K)
    for s in (1.3j, 0.2 + 5.0j, -2.0):
        exact = np.linalg.inv(s * s * M + s * C + K)
        assert (right / (s - poles)) @ left.T == pytest.approx(exact, rel=1e-11, abs=1e-12)
    assert np.all(found.upper.poles.imag >= 0.0)
    for pole, r, each in zip(*(part.T for part in found), strict=True):
        assert each @ (2.0 * pole * M + C) @ r == pytest.approx(1.0, rel=1e-10)


@pytest.mark.parametrize("loss", [0.0, 0.03])
@pytest.mark.parametrize("store", ["poles", "dense", "sparse"])
def test_the_receptance_at_a_fixed_speed(store: str, loss: float, monkeypatch: pytest.MonkeyPatch) -> None:
    kind: Callable[..., Any] = np.asarray
    if store == "sparse":
        monkeypatch.setattr(matrices, "DENSE_LIMIT", 0)
        kind = csc_array
    if store == "dense":
        monkeypatch.setattr(matrices, "_POLE_LIMIT", 0)
    found = MatrixStructure(**{k: kind(v) for k, v in GIVEN.items()}, dofs=DOFS, speed=2.5, loss_factor=loss)
    receptance = found.project(ROWS, COLUMNS)
    assert isinstance(receptance, PoleReceptance if store == "poles" else SolvedReceptance)
    assert receptance.static == pytest.approx(ROWS.T @ np.linalg.solve(stiffness(0.0, 2.5).real, COLUMNS), rel=1e-10)
    for omega in (1.7, 5.3):
        value, slope = receptance.at([1, 3], omega)
        for i, m in enumerate((1, 3)):
            exact = [
                ROWS.T @ np.linalg.solve(stiffness(m * w, 2.5, loss), COLUMNS)
                for w in (omega, omega - 1e-5, omega + 1e-5)
            ]
            assert value[i] == pytest.approx(exact[0], rel=1e-9, abs=1e-12)
            assert slope[i] == pytest.approx((exact[2] - exact[1]) / 2e-5, rel=1e-5, abs=1e-8)


@pytest.mark.parametrize("engine_order", [1, 3])
def test_the_receptance_at_a_speed_tied_to_the_frequency(engine_order: int) -> None:
    given = {name: value for name, value in GIVEN.items() if name != "circulatory"}
    found = MatrixStructure(**given, dofs=DOFS, engine_order=engine_order, loss_factor=0.02)
    receptance = found.project(ROWS, COLUMNS)
    none = {"circulatory": np.zeros((N, N))}
    for omega in (1.7, 5.3):
        value, slope = receptance.at([1, 3], omega)
        for i, m in enumerate((1, 3)):
            exact = [
                ROWS.T @ np.linalg.solve(stiffness(m * w, w / engine_order, 0.02, **none), COLUMNS)
                for w in (omega, omega - 1e-5, omega + 1e-5)
            ]
            assert value[i] == pytest.approx(exact[0], rel=1e-10)
            assert slope[i] == pytest.approx((exact[2] - exact[1]) / 2e-5, rel=1e-5, abs=1e-8)
        fixed = found.turning_with(omega).project(ROWS, COLUMNS).at([1, 3], omega)[0]
        assert fixed == pytest.approx(value, rel=1e-8)


@pytest.mark.parametrize("name", ["loss_factor", "damping", "speed"])
def test_derivatives_by_parameters(name: str) -> None:
    given = {key: value for key, value in GIVEN.items() if key != "circulatory"}
    found = MatrixStructure(**given, dofs=DOFS, speed=2.5, loss_factor=0.02)
    assert set(found.values) == {"loss_factor", "damping", "speed"}
    slope = found.project(ROWS, COLUMNS).by_parameter(name, [1, 2], 3.0)
    ends = [
        found.changed(**{name: found.values[name] + h}).project(ROWS, COLUMNS).at([1, 2], 3.0)[0] for h in (-1e-5, 1e-5)
    ]
    assert slope == pytest.approx((ends[1] - ends[0]) / 2e-5, rel=1e-6, abs=1e-9)


def test_natural_frequencies_are_those_of_whirl() -> None:
    """A disc on a shaft whose tilt is uncoupled: ``w^2 -+ W (Ip / It) w - k / It = 0``."""
    k, it, ip, speed = 40.0, 2.0, 3.0, 1.5
    given = {"M": it * np.eye(2), "K": k * np.eye(2), "dofs": ["a", "b"]}
    G = ip * np.array([[0.0, 1.0], [-1.0, 0.0]])
    turning = MatrixStructure(**given, gyroscopic=G, speed=speed)
    half = 0.5 * speed * ip / it
    assert turning.natural_frequencies == pytest.approx(np.sqrt(half**2 + k / it) + half * np.array([-1.0, 1.0]))
    # tied: k - w^2 (it -+ ip / n) = 0; the forward one is there while it > ip / n
    tied = MatrixStructure(**given, gyroscopic=G, engine_order=2)
    assert tied.natural_frequencies == pytest.approx(np.sqrt(k / (it + np.array([ip, -ip]) / 2)))
    assert MatrixStructure(**given, gyroscopic=G, engine_order=1).natural_frequencies == pytest.approx(
        [np.sqrt(k / (it + ip))]
    )
    damped = MatrixStructure(**given, C=0.02 * np.eye(2), gyroscopic=G, speed=speed)
    poles = complex_modes(damped.M, damped.C, damped.K).upper.poles
    assert damped.damping_ratios == pytest.approx(-poles.real / np.abs(poles), rel=1e-4)


def test_circulatory_stiffness_that_feeds_energy_in_is_named() -> None:
    """Internal damping ``ci`` in the fixed frame: whirl grows where ``W > w0 (1 + c / ci)``."""
    c, ci, w0 = 0.1, 0.2, 5.0
    N2 = ci * np.array([[0.0, 1.0], [-1.0, 0.0]])
    for speed, grows in ((7.4, False), (7.6, True)):
        found = MatrixStructure(
            M=np.eye(2), C=(c + ci) * np.eye(2), K=w0**2 * np.eye(2), circulatory=N2, speed=speed, dofs=["x", "y"]
        )
        assert bool(found.self_excited) == grows
        assert found.energy_fed == ""


def test_equations_in_time_are_those_of_the_receptance() -> None:
    found = MatrixStructure(**GIVEN, dofs=DOFS, speed=2.5, loss_factor=0.03)
    e = found.time_equations(ROWS, COLUMNS, damping_at=3.0)
    motion = e.rows @ np.linalg.solve(e.K - 9.0 * e.M + 3.0j * e.C, e.columns)
    assert motion == pytest.approx(found.project(ROWS, COLUMNS).at([1], 3.0)[0][0], rel=1e-9)
    tied = MatrixStructure(**{k: v for k, v in GIVEN.items() if k != "circulatory"}, dofs=DOFS, engine_order=2)
    with pytest.raises(InputError, match="tied to the response's frequency"):
        tied.time_equations(ROWS, COLUMNS)
    assert tied.turning_with(5.0).speed == 2.5


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"gyroscopic": np.ones((N, N))}, "gyroscopic: found a symmetric part up to 1"),
        ({"circulatory": np.eye(N)}, "circulatory: found a symmetric part"),
        ({"speed": None}, "neither is given"),
        ({"engine_order": 1}, "both are given"),
        ({"speed": None, "engine_order": 1}, "circulatory: with an engine order harmonic 0"),
        ({"gyroscopic": None, "circulatory": None}, "speed: nothing turns at it"),
        ({"speed": np.nan}, "speed: some entries are not finite"),
        ({"speed": None, "engine_order": 0.5}, "engine_order: found 0.5"),
        ({"gyroscopic": np.zeros((3, 3))}, "4 dofs are named"),
        ({"K": np.triu(GIVEN["K"])}, "K: not symmetric"),
        ({"C": np.tril(GIVEN["C"])}, "C: not symmetric"),
    ],
)
def test_faults(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        MatrixStructure(**{**GIVEN, "dofs": DOFS, "speed": 2.0} | change)


def test_real_modes_are_refused() -> None:
    with pytest.raises(InputError, match="unsymmetric matrices"):
        MatrixStructure(**GIVEN, dofs=DOFS, speed=1.0).by_modes()
