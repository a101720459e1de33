"""Sectors of a disc, and whole rings of them that are put together without their symmetry."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import slipstick as ss
from slipstick.typing import Array

DOFS = ("tip", "left", "right")
TANGENTIAL = {"right": 0.8, "tip": 0.6, "left@next": -0.8, "tip@next": -0.6}
NORMAL = {"right": -0.6, "tip": 0.8, "left@next": 0.6, "tip@next": -0.8}
SHROUD = ss.FrictionContact(kt=50.0, mu=0.4, kn=60.0, gap=-0.1)
CASING = ss.FrictionContact(kt=30.0, mu=0.3, normal_load=0.8)
BLADE = np.array([[30.0, 5.0, 0.0], [5.0, 20.0, 0.0], [0.0, 0.0, 8.0]])
"""Share of the blade in the stiffness of a sector."""


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


def a_sector(sectors: int, *, proportional: bool = True, loss_factor: float = 0.003, **more: Any) -> ss.CyclicStructure:
    """Of these matrices."""
    return ss.CyclicStructure(
        **{**pairs(proportional=proportional), **more}, dofs=DOFS, sectors=sectors, loss_factor=loss_factor
    )


def ring_of(pair: tuple[Array, Array], sectors: int) -> Array:
    """The matrix of the whole ring."""
    n = len(pair[0])
    ring = np.zeros((sectors, n, sectors, n))
    for s in range(sectors):
        ring[s, :, s, :] += pair[0]
        ring[s, :, (s + 1) % sectors, :] += pair[1]
        ring[(s + 1) % sectors, :, s, :] += pair[1].T
    return ring.reshape(sectors * n, sectors * n)


def ring_influence(sector: ss.CyclicStructure) -> Array:
    """Influence coefficients of the gas on the whole ring, complex."""
    N, n = sector.sectors, len(sector.dofs)
    ring = np.zeros((N, n, N, n), dtype=complex)
    for offset, matrix in sector.aerodynamic.items():
        for s in range(N):
            ring[s, :, (s + offset) % N, :] += matrix
    return ring.reshape(N * n, N * n)


def at_sector(s: int, cosines: dict[str, float], sectors: int) -> dict[str, float]:
    """Direction cosines of sector s."""
    return {
        name.removesuffix("@next") + f"@{(s + name.endswith('@next')) % sectors}": cosine
        for name, cosine in cosines.items()
    }


def whole_ring(
    sectors: int,
    engine_order: int,
    matrices: Any,
    force: complex,
    velocity: float,
    *,
    orders: int = 6,
    loss: float = 0.003,
) -> ss.Problem:
    """The ring with all contacts, and the wave as loads."""
    structure = ss.MatrixStructure(
        **{name: ring_of(pair, sectors) for name, pair in matrices.items()},
        dofs=[f"{name}@{s}" for s in range(sectors) for name in DOFS], loss_factor=loss,
    )  # fmt: skip
    every = range(sectors)
    shroud = ss.ContactPair(
        name="shroud",
        contact=SHROUD,
        tangential=[at_sector(s, TANGENTIAL, sectors) for s in every],
        normal=[at_sector(s, NORMAL, sectors) for s in every],
    )
    rub = ss.RubbingMotion(velocity=velocity)
    casing = ss.ContactPair(name="casing", contact=CASING, tangential=[f"tip@{s}" for s in every], rubbing=rub)
    loads = []
    for s in every:
        p = force * np.exp(-2j * np.pi * engine_order * s / sectors)
        loads.append(ss.Load(dof=f"tip@{s}", cos=p.real, sin=-p.imag))
    return ss.Problem(structure, contacts=[shroud, casing], loads=loads, harmonics=ss.Harmonics(range(orders)))


def wave_problem(
    sectors: int,
    engine_order: int,
    matrices: Any,
    force: complex,
    velocity: float,
    *,
    orders: int = 6,
    loss: float = 0.003,
) -> ss.Problem:
    """The same by its sector."""
    sector = ss.CyclicStructure(**matrices, dofs=DOFS, sectors=sectors, loss_factor=loss)
    rub = ss.RubbingMotion(velocity=velocity)
    contacts = [
        ss.ContactPair(name="shroud", contact=SHROUD, tangential=TANGENTIAL, normal=NORMAL),
        ss.ContactPair(name="casing", contact=CASING, tangential="tip", rubbing=rub),
    ]
    load = ss.Load(dof="tip", cos=force.real, sin=-force.imag)
    return ss.Problem(
        sector.travelling_wave(engine_order), contacts=contacts, loads=load, harmonics=ss.Harmonics(range(orders))
    )


@cache
def disc_and_wave() -> tuple[ss.Branch, ss.Branch]:
    """A point of a wave of two nodal diameters on 6 sectors, and of the tuned disc under the same loads."""
    wave = wave_problem(6, 2, pairs(), 1 - 6j, 0.3)
    disc = wave.structure.sector.mistuned().problem(wave)  # type: ignore[attr-defined]
    return ss.steady_response(wave, omega=[7.9]), ss.steady_response(disc, omega=[7.9])
