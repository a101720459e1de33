"""A sector in a wave against the whole ring of which it is one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import slipstick as ss
from slipstick.errors import InputError
from slipstick.structure.cyclic import CyclicStructure, WaveHarmonic
from slipstick.typing import Array

DOFS = ("tip", "left", "right")
TANGENTIAL = {"right": 0.8, "tip": 0.6, "left@next": -0.8, "tip@next": -0.6}
NORMAL = {"right": -0.6, "tip": 0.8, "left@next": 0.6, "tip@next": -0.8}
SHROUD = ss.FrictionContact(kt=50.0, mu=0.4, kn=60.0, gap=-0.1)
CASING = ss.FrictionContact(kt=30.0, mu=0.3, normal_load=0.8)


def pairs(*, proportional: bool = True, seed: int = 1) -> dict[str, tuple[Array, Array]]:
    """Matrices of a sector, coupled to the next one without symmetry."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(3, 3))
    K = A @ A.T + np.diag([60.0, 80.0, 100.0]), -rng.uniform(1.0, 4.0, size=(3, 3))
    M = np.diag([1.0, 1.2, 0.8]), 0.02 * rng.normal(size=(3, 3))
    C = 0.01 * K[0] + 0.02 * M[0], 0.01 * K[1] + 0.02 * M[1]
    if not proportional:
        C = C[0] + np.diag([0.1, 0.05, 0.02]), C[1]
    return {"M": M, "K": K, "C": C}


def ring_of(pair: tuple[Array, Array], sectors: int) -> Array:
    """The matrix of the whole ring."""
    n = len(pair[0])
    ring = np.zeros((sectors, n, sectors, n))
    for s in range(sectors):
        ring[s, :, s, :] += pair[0]
        ring[s, :, (s + 1) % sectors, :] += pair[1]
        ring[(s + 1) % sectors, :, s, :] += pair[1].T
    return ring.reshape(sectors * n, sectors * n)


def whole_ring(sectors: int, engine_order: int, matrices: Any, force: complex, velocity: float) -> ss.Problem:
    """The ring with all contacts, and the wave as loads."""

    def at(s: int, cosines: dict[str, float]) -> dict[str, float]:
        return {
            name.removesuffix("@next") + f"@{(s + name.endswith('@next')) % sectors}": cosine
            for name, cosine in cosines.items()
        }

    structure = ss.MatrixStructure(
        **{name: ring_of(pair, sectors) for name, pair in matrices.items()},
        dofs=[f"{name}@{s}" for s in range(sectors) for name in DOFS], loss_factor=0.003,
    )  # fmt: skip
    every = range(sectors)
    shroud = ss.ContactPair(
        name="shroud",
        contact=SHROUD,
        tangential=[at(s, TANGENTIAL) for s in every],
        normal=[at(s, NORMAL) for s in every],
    )
    rub = ss.RubbingMotion(velocity=velocity)
    casing = ss.ContactPair(name="casing", contact=CASING, tangential=[f"tip@{s}" for s in every], rubbing=rub)
    loads = []
    for s in every:
        p = force * np.exp(-2j * np.pi * engine_order * s / sectors)
        loads.append(ss.Load(dof=f"tip@{s}", cos=p.real, sin=-p.imag))
    return ss.Problem(structure, contacts=[shroud, casing], loads=loads, harmonics=ss.Harmonics(range(6)))


def wave_problem(sectors: int, engine_order: int, matrices: Any, force: complex, velocity: float) -> ss.Problem:
    """The same by its sector."""
    sector = CyclicStructure(**matrices, dofs=DOFS, sectors=sectors, loss_factor=0.003)
    rub = ss.RubbingMotion(velocity=velocity)
    contacts = [
        ss.ContactPair(name="shroud", contact=SHROUD, tangential=TANGENTIAL, normal=NORMAL),
        ss.ContactPair(name="casing", contact=CASING, tangential="tip", rubbing=rub),
    ]
    load = ss.Load(dof="tip", cos=force.real, sin=-force.imag)
    return ss.Problem(
        sector.travelling_wave(engine_order), contacts=contacts, loads=load, harmonics=ss.Harmonics(range(6))
    )


@pytest.mark.parametrize(
    ("sectors", "engine_order", "force", "velocity", "proportional"),
    [
        pytest.param(6, 2, 1 - 6j, 0.3, False, id="travelling"),
        pytest.param(6, 3, 1 - 6j, 0.3, True, id="standing"),
        pytest.param(6, 6, 0.2 - 1j, 0.3, True, id="in phase"),
        pytest.param(7, 5, 1 - 6j, -0.2, False, id="backward"),
        pytest.param(12, 4, 2 - 14j, 0.0, False, id="three nodal diameters, separating", marks=pytest.mark.verify),
        pytest.param(24, 19, 2 - 12j, 0.5, False, id="aliased", marks=pytest.mark.verify),
    ],
)
def test_a_wave_is_the_response_of_the_whole_ring(
    sectors: int, engine_order: int, force: complex, velocity: float, proportional: bool
) -> None:
    """The ring is followed by itself, without any use of its symmetry; sector 0 of it has all that the wave has."""
    matrices = pairs(proportional=proportional)
    case = sectors, engine_order, matrices, force, velocity
    at, d = 7.9, [f"{name}@0" for name in DOFS]
    wave = ss.forced_response(wave_problem(*case), omega=(7.8, 8.0), requested=[at]).dataset
    ring = ss.forced_response(whole_ring(*case), omega=(7.8, 8.0), requested=[at], peaks_of=["tip@0"]).dataset
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
            Z = 1.02j * 0.0 + (1.0 + 0.02j) * at["K"] + 1j * w * at["C"] - w * w * at["M"]
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
