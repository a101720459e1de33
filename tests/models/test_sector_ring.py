"""Finite element sectors against the whole ring of the same mesh, which knows nothing of phases."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.ring_mesh import in_sector, ring_model
from scipy.sparse import csc_array
from scipy.sparse.linalg import spsolve

import slipstick as ss
from slipstick.errors import InputError
from slipstick.fem.assembly import assemble
from slipstick.fem.contact_points import contact_patches
from slipstick.fem.expansion import expansion_load, temperature_field
from slipstick.fem.loads import pressure_load
from slipstick.fem.mesh import Mesh
from slipstick.models.blade import BLADE_STEEL
from slipstick.models.parametric_sector import SectorShape
from slipstick.solve.linear.lanczos import modes
from slipstick.structure.reduction.reduce import reduce_model

N = 6
SHAPE = SectorShape(
    sectors=N, element_size=0.03, bore=0.04, rim=0.08, tip=0.14, thickness=0.2, stagger=3.0, twist=5.0
)  # fmt: skip
OUTPUTS = tuple(f"{point}{axis}" for point in ("c1", "h1", "l1") for axis in "xyz")


@cache
def the_model() -> Any:
    return ss.models.bladed_sector(SHAPE)


@cache
def the_ring() -> Any:
    mesh = the_model().mesh
    faces = np.union1d(mesh.surfaces["low"].nodes, mesh.surfaces["high"].nodes)
    return ring_model(mesh, N, faces, mesh.surfaces["bore"].nodes)


@cache
def the_sector() -> Any:
    return ss.reduced_sector(
        the_model(), surface="tip", contacts=1, between=("shroud_low", "shroud_high"), between_contacts=1,
        pressure="concave", modes=30, loss_factor=2e-3,
    )  # fmt: skip


def test_frequencies_of_all_phases_are_those_of_the_ring() -> None:
    ring, _ = the_ring()
    exact = modes(ring.K, ring.M, 60).omega
    found = [(w, k) for k in range(N // 2 + 1) for w in the_sector().natural_frequencies(k)]
    every = np.sort([w for w, k in found for _ in range(1 if k in (0, N // 2) else 2)])
    assert np.allclose(every[:60], exact, rtol=1e-9)
    assert all(the_sector().complete(k) for k in range(N // 2 + 1))


@pytest.mark.parametrize("k", [0, 1, 2, 3])
def test_modes_are_counted_by_inertia(k: int) -> None:
    omega = the_sector().natural_frequencies(k)
    for n in (1, 7, 20):
        assert the_sector().modes_below(k, 0.5 * (omega[n - 1] + omega[n])) == n
    assert the_sector().receptance_error(k, 0.7 * omega[3]) < 1e-8


def the_wave(E: int, load: float) -> ss.Problem:
    sector = the_sector()
    tip = ss.surface_contacts(
        sector, "tip", contact=ss.FrictionContact(kt=2e6, mu=0.3, normal_load=20.0), direction="circumferential",
        rubbing=ss.RubbingMotion(velocity=0.01),
    )  # fmt: skip
    shroud = ss.surface_contacts(
        sector, "shroud", contact=ss.FrictionContact(kt=5e6, mu=0.4, kn=5e6, gap=-2e-6), direction="axial",
        normal=True, between=True,
    )  # fmt: skip
    return ss.Problem(
        sector.travelling_wave(E), contacts=[*tip, *shroud], loads=[ss.Load(shape="pressure", harmonic=1, sin=load)],
        harmonics=ss.Harmonics(range(4)), outputs=OUTPUTS,
    )  # fmt: skip


@cache
def the_ring_body() -> Any:
    """The ring reduced to the ports of all sectors, by a reduction for real structures."""
    ring, number = the_ring()
    mesh, sector = the_model().mesh, the_sector()
    places = sector.points.positions, sector.between.high.positions, sector.between.high.positions @ sector.turn
    columns = []
    for place, surface in zip(places, ("tip", "shroud_high", "shroud_low"), strict=True):
        patch = contact_patches(mesh, mesh.surfaces[surface], place)
        columns += [patch.directions(axis[None])[:, [0]].toarray() for axis in np.eye(3)]
    every = [in_sector(ring, number, np.hstack(columns), s).toarray() for s in range(N)]
    load = pressure_load(mesh, mesh.surfaces["concave"]).reshape(-1, 1)
    loads = {f"pressure@{s}": in_sector(ring, number, load, s).toarray()[:, 0] for s in range(N)}
    names = [f"{dof}@{s}" for s in range(N) for dof in OUTPUTS]
    keep = np.hstack(every)
    return reduce_model(ring.K, ring.M, keep=keep, names=names, load_shapes=loads, modes=110, loss_factor=2e-3)


def the_ring_problem(wave: ss.Problem, E: int) -> ss.Problem:
    contacts, loads = [], []
    for s in range(N):
        for pair in wave.contacts:
            sides = {
                side: {f"{dof.removesuffix('@next')}@{(s + dof.endswith('@next')) % N}": c for dof, c in given.items()}
                for side in ("tangential", "normal")
                if (given := getattr(pair, side)) is not None
            }
            contacts.append(
                ss.ContactPair(name=f"{pair.name}, {s}", contact=pair.contact, rubbing=pair.rubbing, **sides)
            )
        z = -1j * wave.loads[0].sin * np.exp(-2j * np.pi * E * s / N)
        loads.append(ss.Load(shape=f"pressure@{s}", harmonic=1, cos=z.real, sin=-z.imag))
    outputs = [f"{dof}@{s}" for s in range(N) for dof in OUTPUTS]
    structure = the_ring_body().structure
    return ss.Problem(structure, contacts=contacts, loads=loads, harmonics=wave.harmonics, outputs=outputs)


@pytest.mark.filterwarnings("ignore:the harmonics left out")  # the ring keeps as many
@pytest.mark.parametrize("E", [2, 3, -1])
def test_a_wave_with_friction_is_the_motion_of_the_whole_ring(E: int) -> None:
    wave = the_wave(E, 4e5)
    omega = 0.99 * the_sector().natural_frequencies(abs(E))[0]
    found = ss.steady_response(wave, omega=omega).dataset
    exact = ss.steady_response(the_ring_problem(wave, E), omega=omega).dataset
    assert 0.0 < float(found.stick_fraction.sel(contact="shroud 1").item()) < 1.0
    of_0 = exact.displacement.sel(dof=[f"{dof}@0" for dof in OUTPUTS]).to_numpy()
    size = np.abs(of_0).max()
    assert np.abs(found.displacement.sel(dof=list(OUTPUTS)).to_numpy() - of_0).max() < 1e-8 * size
    for s in range(1, N):  # amplitudes repeat
        own = exact.amplitude.sel(dof=[f"{dof}@{s}" for dof in OUTPUTS]).to_numpy()
        assert np.allclose(own, found.amplitude.sel(dof=list(OUTPUTS)).to_numpy(), atol=1e-8 * size)


DEVIATIONS = np.array([0.05, -0.03, 0.02, 0.0, -0.04, 0.01])


@cache
def the_mistuned_ring() -> Any:
    """Frequencies of the ring with blades that differ."""
    ring, number = the_ring()
    mesh = the_model().mesh
    blade = mesh.blocks["hex20"][mesh.element_sets["blade"]["hex20"]]
    K = ring.K
    for s, deviation in enumerate(DEVIATIONS):
        own = Mesh(nodes=ring.mesh.nodes, blocks={"hex20": number[s][blade]})
        K = K + deviation * ring.restrict(ring.restrict(assemble(own, BLADE_STEEL).stiffness).T).T
    return modes(K, ring.M, 24).omega


def test_blades_that_differ_are_nearly_those_of_the_ring_with_some_families() -> None:
    disc = the_sector().mistuned(DEVIATIONS, blade="blade")  # 30 of 300
    exact = the_mistuned_ring()
    assert np.allclose(np.sort(disc.omega)[:12], exact[:12], rtol=2e-4)
    assert not np.allclose(np.sort(the_sector().mistuned().omega)[:12], exact[:12], rtol=5e-3)
    again = type(disc)(**disc.arguments)
    assert np.array_equal(again.omega, disc.omega)
    other = the_sector().mistuned(2.0 * DEVIATIONS, blade="blade")
    assert np.allclose(disc.changed(mistuning=2.0).omega, other.omega)
    with pytest.raises(InputError, match="there is no element set 'blades'"):
        the_sector().mistuned(DEVIATIONS, blade="blades")


@pytest.mark.verify
def test_blades_that_differ_are_those_of_the_ring_with_all_families() -> None:
    sector = ss.reduced_sector(the_model(), surface="tip", contacts=1, modes=the_sector().n_dofs)
    disc = sector.mistuned(DEVIATIONS, blade="blade")
    assert np.allclose(np.sort(disc.omega)[:24], the_mistuned_ring(), rtol=1e-9)


@pytest.mark.parametrize("how", [{"hot": 300.0}, {"hot": {"all": 20.0, "tip": 400.0}}])
def test_a_hot_sector_grows_as_the_ring(how: dict[str, Any]) -> None:
    """All sectors alike: wave number 0 against the whole ring, its elements and temperatures by its own assembly."""
    hot = BLADE_STEEL.but(expansion=1.2e-5, reference=20.0)
    model = ss.models.bladed_sector(SHAPE, material=hot)
    sector = ss.reduced_sector(model, surface="tip", contacts=1, temperature=how, modes=60, loss_factor=0.0)
    ring, number = the_ring()
    field = np.zeros(ring.mesh.n_nodes)
    field[number] = temperature_field(model.mesh, how["hot"])
    u = spsolve(csc_array(ring.K), ring.restrict(expansion_load(ring.mesh, hot, field)))
    patch = contact_patches(model.mesh, model.mesh.surfaces["tip"], sector.points.positions)
    wave = sector.structure.travelling_wave(1)
    dofs = ["c1x", "c1y", "c1z"]
    rows = np.array([[float(dof == name) for name in dofs] for dof in wave.dofs])
    found = wave.project(rows, np.zeros((len(wave.dofs), 0)), ["temperature hot"]).static[:, 0]
    for axis in range(3):
        column = patch.directions(np.eye(3)[axis][None])[:, [0]].toarray()
        exact = float((in_sector(ring, number, column, 0).T @ u).item())
        assert found[axis] == pytest.approx(exact, rel=1e-6, abs=1e-6 * np.abs(found).max())
