"""A sector in a wave against the whole ring of which it is one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.rings import DOFS, a_sector, pairs, ring_influence, ring_of, wave_problem, whole_ring

import slipstick as ss
from slipstick.errors import InputError
from slipstick.solve.newton import NewtonOptions
from slipstick.structure.cyclic import CyclicStructure, WaveHarmonic


@pytest.mark.parametrize(
    ("sectors", "engine_order", "force", "velocity", "proportional"),
    [
        pytest.param(6, 2, 1 - 6j, 0.3, False, id="travelling"),
        pytest.param(6, 3, 1 - 6j, 0.3, True, id="standing"),
        pytest.param(6, 6, 0.2 - 1j, 0.3, True, id="in phase"),
        pytest.param(7, 5, 1 - 6j, -0.2, False, id="backward"),
        pytest.param(12, 4, 2 - 14j, 0.0, False, id="three nodal diameters, separating", marks=pytest.mark.verify),
        pytest.param(24, 19, 2 - 12j, 0.5, False, id="aliased", marks=pytest.mark.verify),
        pytest.param(16, 3, 2 - 14j, -0.2, False, id="16 sectors", marks=pytest.mark.verify),
        pytest.param(12, 6, 1 - 6j, 0.3, False, id="12 sectors standing", marks=pytest.mark.verify),
        pytest.param(12, 4, 1 - 6j, 0.3, False, id="12 sectors rubbing", marks=pytest.mark.verify),
        pytest.param(12, 7, 1 - 6j, 0.3, False, id="five nodal diameters, against", marks=pytest.mark.verify),
        pytest.param(12, 12, 0.2 - 1j, 0.3, False, id="12 sectors in phase", marks=pytest.mark.verify),
    ],
)
def test_a_wave_is_the_response_of_the_whole_ring(
    sectors: int, engine_order: int, force: complex, velocity: float, proportional: bool
) -> None:
    """The ring is followed by itself, without any use of its symmetry; sector 0 of it has all that the wave has."""
    matrices = pairs(proportional=proportional)
    case = sectors, engine_order, matrices, force, velocity
    at, d = 7.9, [f"{name}@0" for name in DOFS]
    curve: dict[str, Any] = {
        "omega": (7.8, 8.0),
        "at": [at],
        "options": {"newton": NewtonOptions(tolerance=1e-12)},
    }
    wave = ss.forced_response(wave_problem(*case), **curve).dataset
    ring = ss.forced_response(whole_ring(*case), peaks_of=["tip@0"], **curve).dataset
    one, all_of_it = (found.isel(point=int(np.argmin(np.abs(found.omega.to_numpy() - at)))) for found in (wave, ring))
    sector = one.displacement.sel(dof=list(DOFS)).to_numpy()
    np.testing.assert_allclose(all_of_it.displacement.sel(dof=d).to_numpy(), sector, atol=1e-10 * np.abs(sector).max())
    every = all_of_it.amplitude.sel(dof=[f"tip@{s}" for s in range(sectors)]).to_numpy()
    np.testing.assert_allclose(every, float(one.amplitude.sel(dof="tip")), rtol=1e-9)
    assert float(one.slip_fraction.max()) > 0.0


def test_frequencies_of_all_nodal_diameters_are_those_of_the_ring() -> None:
    """Each but 0 and N/2 twice."""
    from scipy.linalg import eigvalsh

    matrices, sectors = pairs(), 8
    sector = CyclicStructure(**matrices, dofs=DOFS, sectors=sectors)
    found = np.concatenate([sector.phase_modes(k).omega for k in range(sectors)])
    ring = np.sqrt(eigvalsh(ring_of(matrices["K"], sectors), ring_of(matrices["M"], sectors)))
    np.testing.assert_allclose(np.sort(found), ring, rtol=1e-12)
    np.testing.assert_array_equal(sector.natural_frequencies(3), sector.phase_modes(5).omega)


@pytest.mark.parametrize("proportional", [True, False])
@pytest.mark.parametrize("name", ["omega", "loss_factor", "damping"])
def test_derivatives_of_the_receptance_are_those_of_differences(name: str, proportional: bool) -> None:
    """Central differences; orders of different phases."""
    sector = CyclicStructure(**pairs(proportional=proportional), dofs=DOFS, sectors=12, loss_factor=0.02)
    rows = np.random.default_rng(2).normal(size=(6, 2))
    receptance: Any = sector.travelling_wave(4).project(rows, rows)
    orders, omega, step = np.array([1, 2, 3, 4]), 7.7, 1e-5

    def at(change: float) -> Any:
        if name == "omega":
            return receptance.at(orders, omega + change)[0]
        return receptance.changed(**{name: sector.values[name] + change}).at(orders, omega)[0]

    exact = receptance.at(orders, omega)[1] if name == "omega" else receptance.by_parameter(name, orders, omega)
    difference = (at(step) - at(-step)) / (2 * step)
    np.testing.assert_allclose(exact, difference, atol=2e-8 * np.abs(difference).max())


def test_receptance_is_that_of_the_matrices() -> None:
    """Solved by order, with the phase on rows and its conjugate on columns; of several frequencies at once."""
    matrices = pairs(proportional=False)
    sector = CyclicStructure(**matrices, dofs=DOFS, sectors=12, loss_factor=0.02, load_shapes={"gas": [1.0, 2.0, 3.0]})
    wave = sector.travelling_wave(4)
    rows = np.random.default_rng(2).normal(size=(6, 2))
    receptance: Any = wave.project(rows, rows, ["gas"])
    found = receptance.at(np.array([1, 3]), np.array([5.0, 7.0]))[0]
    assert found.shape == (2, 2, 2, 3)
    for i, omega in enumerate((5.0, 7.0)):
        for k, order in enumerate((1, 3)):
            turn = np.exp(-2j * np.pi * 4 * order / 12)
            at = sector.matrices(4 * order)
            w = order * omega
            Z = (1.0 + 0.02j) * at["K"] + 1j * w * at["C"] - w * w * at["M"]
            P = np.vstack([np.eye(3), turn * np.eye(3)])
            columns = np.column_stack([P.conj().T @ rows, [1.0, 2.0, 3.0]])
            np.testing.assert_allclose(found[i, k], rows.T @ P @ np.linalg.solve(Z, columns), rtol=1e-10, atol=1e-14)
            np.testing.assert_allclose(receptance.of_order(order, w), found[i, k], rtol=1e-12)


def test_harmonics_alias_to_nodal_diameters() -> None:
    """N = 12, E = 4: nodal diameters 4 forward, 4 backward, 0, 4 forward (24.4)."""
    wave = CyclicStructure(**pairs(), dofs=DOFS, sectors=12).travelling_wave(4)
    assert [wave.harmonic(m) for m in range(5)] == [
        WaveHarmonic(0, 0, "standing"), WaveHarmonic(1, 4, "forward"), WaveHarmonic(2, 4, "backward"),
        WaveHarmonic(3, 0, "standing"), WaveHarmonic(4, 4, "forward"),
    ]  # fmt: skip
    assert CyclicStructure(**pairs(), dofs=DOFS, sectors=12).travelling_wave(6).harmonic(1).direction == "standing"


def _one(value: float) -> tuple[list[list[float]], list[list[float]]]:
    return [[value]], [[0.0]]


@pytest.mark.parametrize(
    ("changed", "fragments"),
    [
        ({"K": ([[1.0]], [[-1.0]])}, ("K", "not positive definite", "nodal diameter 0")),
        ({"M": ([[1.0, 0.0]], [[0.0]])}, ("M", "(1, 2)", "(1, 1)")),
        ({"K": [[1.0 + 1j]]}, ("K", "complex")),
        ({"dofs": ["x@next"]}, ("x@next",)),
        ({"sectors": 1}, ("sectors", "2")),
        ({"loss_factor": -1.0}, ("loss_factor",)),
    ],
)
def test_faults(changed: dict[str, Any], fragments: tuple[str, ...]) -> None:
    """Each in one sentence."""
    given = {"M": _one(1.0), "K": _one(3.0), "dofs": ["x"], "sectors": 6} | changed
    with pytest.raises(InputError) as raised:
        CyclicStructure(**given).travelling_wave(6).project(np.eye(2), np.eye(2))
    for fragment in fragments:
        assert fragment in str(raised.value)


def test_gas_is_that_of_the_whole_ring() -> None:
    """Complex coefficients that differ for waves forward and backward; the ring is solved without its symmetry."""
    rng, sectors = np.random.default_rng(3), 6
    shape = np.diag([1.0, 0.3, 0.0])
    coefficients = rng.normal(size=sectors) + 1j * rng.normal(size=sectors)
    sector = a_sector(sectors, proportional=False).with_aerodynamics(coefficients, shape)
    for d in range(sectors):
        np.testing.assert_allclose(sector.influence(d), coefficients[d] * shape, atol=1e-13)
    rows = np.random.default_rng(2).normal(size=(6, 2))
    matrices = pairs(proportional=False)
    for engine_order in (-2, 1, 3, 10):
        wave = sector.travelling_wave(engine_order)
        found, w = wave.project(rows, rows).at(np.array([1]), 7.0)[0][0], 7.0
        K, M, C = (ring_of(matrices[name], sectors) for name in "KMC")
        Z = (1.0 + 0.003j) * K + 1j * w * C - w * w * M + ring_influence(sector)
        turns = np.exp(-2j * np.pi * engine_order * np.arange(sectors) / sectors)
        own = np.vstack([np.eye(3), turns[1] * np.eye(3)])
        columns = own.conj().T @ rows
        force = (turns[:, None, None] * columns).reshape(3 * sectors, -1)
        moved = np.linalg.solve(Z, force).reshape(sectors, 3, -1)
        np.testing.assert_allclose(found, rows.T @ own @ moved[0], rtol=1e-10, atol=1e-13)


def test_sign_of_the_engine_order() -> None:
    """Blades numbered in the sense of rotation meet a pattern fixed in space earlier: E = -EO."""
    sectors, EO = 12, 4
    wave = a_sector(sectors).travelling_wave(-EO)
    assert wave.harmonic(1) == WaveHarmonic(1, 4, "backward")
    # blade s stands at angle Omega t + 2 pi s / N: p(theta) = cos(EO theta); tau = EO Omega t
    tau = 0.7
    for s in range(sectors):
        force = np.cos(EO * (tau / EO + 2 * np.pi * s / sectors))
        assert force == pytest.approx(np.cos(tau - s * 2 * np.pi * wave.engine_order / sectors), abs=1e-12)


def test_modes_left_out_of_some_phases(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer modes in one nodal diameter than in the others, with both residuals: close below the modes kept."""
    sector, rows = a_sector(12, proportional=False), np.random.default_rng(2).normal(size=(6, 2))
    exact = sector.travelling_wave(4).project(rows, rows)
    whole = sector.phase_modes

    def fewer(k: int) -> Any:
        modes, kept = whole(k), 2 if k % 12 == 4 else 3
        others, squared = modes.shapes[:, kept:], modes.omega[kept:] ** 2
        return replace(
            modes, omega=modes.omega[:kept], shapes=modes.shapes[:, :kept], damping=modes.damping[:kept, :kept],
            second=(others / squared**2) @ others.conj().T,
        )  # fmt: skip

    monkeypatch.setattr(sector, "phase_modes", fewer)
    found: Any = sector.travelling_wave(4).project(rows, rows)
    orders, w, step = np.array([1, 2, 3]), 1.5, 1e-5
    for k, order in enumerate(orders):
        value = found.at(orders, w)[0][k]
        np.testing.assert_allclose(value, exact.at([order], w)[0][0], atol=2e-2 * np.abs(value).max())
    slope = (found.at(orders, w + step)[0] - found.at(orders, w - step)[0]) / (2 * step)
    np.testing.assert_allclose(found.at(orders, w)[1], slope, atol=1e-7 * np.abs(slope).max())
    by_loss = found.by_parameter("loss_factor", orders, w)
    changed = [found.changed(loss_factor=0.003 + c).at(orders, w)[0] for c in (step, -step)]
    np.testing.assert_allclose(by_loss, (changed[0] - changed[1]) / (2 * step), atol=1e-7 * np.abs(by_loss).max())


@pytest.mark.parametrize(
    ("shape", "says"),
    [(np.eye(3) + np.eye(3, k=1), "symmetric"), (np.eye(2), "shape"), ([["a"]], "numbers")],
)
def test_gas_is_felt_by_a_symmetric_matrix_of_the_dofs(shape, says) -> None:
    sector = a_sector(6, proportional=False)
    with raises_fault(says=says):
        sector.with_aerodynamics(np.zeros(6), shape)
