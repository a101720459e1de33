"""A disc with blades that differ against the full matrices of its ring."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.rings import BLADE, a_sector, pairs, ring_influence, ring_of, wave_problem

import slipstick as ss
from slipstick.errors import InputError
from slipstick.structure.disc import Disc


def deviations(sectors: int, spread: float = 0.04) -> np.ndarray:
    """Of the blades."""
    return np.random.default_rng(5).normal(0.0, spread, sectors)


def ring_stiffness(sectors: int, stiffness: Any) -> np.ndarray:
    """Full matrix with the deviations."""
    K = ring_of(pairs()["K"], sectors)
    for s, value in enumerate(stiffness):
        K[3 * s : 3 * s + 3, 3 * s : 3 * s + 3] += value * BLADE
    return K


def test_frequencies_are_those_of_the_ring() -> None:
    """All families: exact; the fewer are kept, the less (24.6)."""
    from scipy.linalg import eigvalsh

    sectors = 24
    given = deviations(sectors)
    exact = np.sqrt(eigvalsh(ring_stiffness(sectors, given), ring_of(pairs()["M"], sectors)))
    errors = []
    for families in (1, 2, 3):
        disc = a_sector(sectors).mistuned(given, BLADE, families)
        errors.append(np.abs(disc.natural_frequencies[:sectors] / exact[:sectors] - 1.0).max())
    assert errors[2] < 1e-12
    assert errors[2] < errors[1] < errors[0] < 1e-2


@pytest.mark.filterwarnings("ignore:the receptance of the reduced structure is wrong")
def test_friction_response_by_the_first_families() -> None:
    """Blades of four masses in 12 sectors, shrouds that slip: what families leave out falls with their number (24.6).

    The tuned residual stands for them.
    """
    sectors, n = 12, 5
    K0 = np.diag([9.0, 8.0, 8.0, 8.0, 4.0]) * 10.0
    K0 -= 40.0 * (np.eye(n, k=1) + np.eye(n, k=-1))
    K0[0, 0] += 40.0
    K1 = np.zeros((n, n))
    K1[0, 0] = -20.0
    dofs = ["root", "a", "b", "c", "tip"]
    sector = ss.CyclicStructure(M=np.eye(n), K=(K0, K1), dofs=dofs, sectors=sectors, loss_factor=5e-3)
    blade = K0.copy()
    blade[0, 0] = 40.0
    friction = ss.FrictionContact(kt=8.0, mu=0.3, normal_load=0.5)
    shroud = ss.ContactPair(name="shroud", contact=friction, tangential={"tip": 1.0, "tip@next": -1.0})
    at = float(sector.natural_frequencies(3)[0]) + 0.25
    wave = ss.Problem(
        sector.travelling_wave(3),
        contacts=shroud,
        loads=ss.Load(dof="tip", cos=0.8),
        harmonics=[0, 1, 3],
        outputs=["tip"],
    )
    given, found = deviations(sectors, 0.03), {}
    for families in (1, 2, 3, 4, 5):
        problem = sector.mistuned(given, blade, families).problem(wave)
        branch = ss.steady_response(problem, omega=[at])
        assert float(branch.dataset.slip_fraction.max()) > 0.1
        found[families] = branch.on_disc("tip").values[0]
    errors = [np.abs(found[k] / found[5] - 1.0).max() for k in (1, 2, 3, 4)]
    assert errors == sorted(errors, reverse=True)
    assert errors[1] < 3e-3
    assert errors[3] < 1e-3


@pytest.mark.parametrize("proportional", [True, False])
@pytest.mark.parametrize("gas", [False, True])
def test_receptance_is_that_of_the_ring(proportional: bool, gas: bool) -> None:
    """Damping that couples the modes, and the gas, included."""
    sectors, w = 6, 7.3
    given, sector = deviations(sectors), a_sector(sectors, proportional=proportional)
    if gas:
        sector = sector.with_aerodynamics(0.3 + 0.2j * np.arange(-3, 3), np.diag([1.0, 0.0, 0.4]))
    disc = sector.mistuned(given, BLADE)
    rows = np.random.default_rng(2).normal(size=(18, 3))
    receptance = disc.project(rows, rows)
    M, C = (ring_of(pairs(proportional=proportional)[name], sectors) for name in "MC")
    K = ring_stiffness(sectors, given)
    for order in (1, 2):
        at = order * w
        Z = (1.0 + 0.003j) * K + 1j * at * C - at * at * M + ring_influence(sector)
        found = receptance.at(np.array([order]), w)[0][0]
        np.testing.assert_allclose(found, rows.T @ np.linalg.solve(Z, rows.astype(complex)), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(receptance.static, rows.T @ np.linalg.solve(K, rows), rtol=1e-10)


def test_gas_that_vanishes_leaves_what_the_families_left_out_add() -> None:
    """Solved for between the modes or summed over them, the residual grows with the square of the frequency."""
    plain = a_sector(6, proportional=True)
    gas = plain.with_aerodynamics(np.full(6, 1e-12j), np.diag([1.0, 0.0, 0.4]))
    rows, omega = np.random.default_rng(2).normal(size=(18, 3)), np.array([3.0, 7.3])
    solved, summed = (s.mistuned(families=2).project(rows, rows) for s in (gas, plain))
    assert type(solved) is not type(summed)
    for found, exact in zip(solved.at(np.array([1, 2]), omega), summed.at(np.array([1, 2]), omega), strict=True):
        np.testing.assert_allclose(found, exact, rtol=1e-8, atol=1e-12)
    found, exact = (each.by_parameter("loss_factor", np.array([1, 2]), omega) for each in (solved, summed))
    np.testing.assert_allclose(found, exact, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("proportional", [True, False])
@pytest.mark.parametrize("name", ["stiffness@2", "mistuning", "loss_factor", "damping", "omega"])
def test_derivatives_of_the_receptance_are_those_of_differences(name: str, proportional: bool) -> None:
    """By every parameter, with all families and with a residual; the static compliance too."""
    for families in (3, 2):
        disc = a_sector(6, proportional=proportional, loss_factor=0.02).mistuned(deviations(6), BLADE, families)
        rows = np.random.default_rng(2).normal(size=(18, 2))
        receptance: Any = disc.project(rows, rows)
        orders, omega, step = np.array([1, 3]), 7.7, 1e-5

        def at(change: float, disc: Disc = disc, receptance: Any = receptance) -> Any:
            if name == "omega":
                return receptance.at(orders, omega + change)[0]  # noqa: B023
            return receptance.changed(**{name: disc.values[name] + change}).at(orders, omega)[0]  # noqa: B023

        exact = receptance.at(orders, omega)[1] if name == "omega" else receptance.by_parameter(name, orders, omega)
        difference = (at(step) - at(-step)) / (2 * step)
        np.testing.assert_allclose(exact, difference, atol=1e-7 * np.abs(difference).max())
        if name not in ("omega", "loss_factor", "damping"):
            still = [receptance.changed(**{name: disc.values[name] + c}).static for c in (step, -step)]
            np.testing.assert_allclose(
                receptance.static_by_parameter(name), (still[0] - still[1]) / (2 * step), rtol=1e-6, atol=1e-11
            )


def test_a_tuned_disc_moves_as_the_wave() -> None:
    """All contacts and loads of the disc by its problem; engine order with a sign, and a casing with lobes."""
    wave = wave_problem(6, -2, pairs(proportional=False), 1 - 6j, 0.3)
    rub = ss.RubbingMotion(velocity=0.2, cos={1: 0.05}, sin={2: 0.02})
    casing = ss.ContactPair(name="casing", contact=wave.contacts[1].contact, tangential="tip", rubbing=rub)
    wave = ss.Problem(wave.structure, contacts=[wave.contacts[0], casing], loads=wave.loads, harmonics=wave.harmonics)
    disc = wave.structure.sector.mistuned().problem(wave)  # type: ignore[attr-defined]
    at, d = 7.9, ["tip@0", "left@0", "right@0"]
    one = ss.steady_response(wave, omega=[at]).dataset.isel(point=0)
    all_of_it = ss.steady_response(disc, omega=[at])
    own = all_of_it.dataset.isel(point=0)
    sector = one.displacement.sel(dof=["tip", "left", "right"]).to_numpy()
    np.testing.assert_allclose(own.displacement.sel(dof=d).to_numpy(), sector, atol=1e-9 * np.abs(sector).max())
    around = all_of_it.on_disc("tip")
    assert around.dims == ("point", "sector")
    np.testing.assert_allclose(around.to_numpy(), float(one.amplitude.sel(dof="tip")), rtol=1e-8)


def test_a_wave_is_checked_in_time_by_its_disc() -> None:
    """All sectors integrated, with no harmonics cut off: what is left falls with those of the wave."""
    errors = []
    for orders in (4, 10):
        wave = wave_problem(6, 2, pairs(proportional=False), 1 - 6j, 0.3, orders=orders)
        disc = wave.structure.sector.mistuned().problem(wave)  # type: ignore[attr-defined]
        errors.append(ss.steady_response(disc, omega=[7.9]).check_in_time(0).relative_difference)
    assert errors[1] < 0.3 * errors[0]
    assert errors[1] < 3e-4
    with pytest.raises(InputError, match=r"sector\.mistuned\(\)\.problem"):
        ss.steady_response(wave, omega=[7.9]).check_in_time(0)


@pytest.mark.parametrize("N", [12, 24, 90])
def test_whitehead(N: int) -> None:
    """Engine order 0 amplifies by (1 + sqrt N) / 2 at most: met by a disc with the mode (a, b, ..., b), others far."""
    coupling, loss = 0.05, 1e-9
    sector = ss.CyclicStructure(
        M=[[1.0]], K=([[1.0 + 2 * coupling]], [[-coupling]]), dofs=["tip"], sectors=N, loss_factor=loss
    )
    mode = np.full(N, np.sqrt((1.0 - 1.0 / np.sqrt(N)) / 2.0 / (N - 1)))
    mode[0] = np.sqrt((1.0 + 1.0 / np.sqrt(N)) / 2.0)
    K = ring_of((np.array([[1.0 + 2 * coupling]]), np.array([[-coupling]])), N)
    disc = sector.mistuned((mode - K @ mode) / mode, [[1.0]])  # K + deviations has that mode at frequency 1
    tip, around = np.eye(N)[:, :1], np.ones((N, 1))
    mistuned = abs(disc.project(tip, around).at([1], 1.0)[0].item())
    one = np.eye(2)[:, :1]
    tuned = abs(sector.travelling_wave(0).project(one, one).at([1], 1.0)[0].item())
    assert mistuned / tuned == pytest.approx((1.0 + np.sqrt(N)) / 2.0, rel=1e-6)


def test_no_disc_of_single_blades_exceeds_whitehead() -> None:
    """Random deviations, linear; the bound is that of one family."""
    N, omega = 12, 1.0
    sector = ss.CyclicStructure(M=[[1.0]], K=([[1.0 + 2 * 0.02]], [[-0.02]]), dofs=["tip"], sectors=N, loss_factor=1e-3)
    tuned = abs(sector.travelling_wave(0).project(np.eye(2)[:, :1], np.eye(2)[:, :1]).at([1], omega)[0]).item()
    worst = 0.0
    for seed in range(20):
        disc = sector.mistuned(blade=[[1.0]], spread=0.01, seed=seed)
        rows, load = np.eye(N), np.ones((N, 1))
        w = np.unique(np.concatenate([disc.natural_frequencies, np.linspace(0.97, 1.06, 200)]))
        worst = max(worst, float(np.abs(disc.project(rows, load).at([1], w)[0]).max()))
    assert 1.2 < worst / tuned < (1.0 + np.sqrt(N)) / 2.0


def test_deviations_are_named_parameters(tmp_path: Path) -> None:
    """Followed, differentiated, stored with the results; "mistuning" from the tuned disc."""
    wave = wave_problem(6, 2, pairs(), 1 - 6j, 0.3)
    problem = wave.structure.sector.mistuned(deviations(6), BLADE).problem(  # type: ignore[attr-defined]
        wave, outputs=[f"tip@{s}" for s in range(6)]
    )
    at, step = 7.9, 1e-4
    names = ["stiffness@1", "mistuning"]
    branch = ss.steady_response(problem, omega=[at])
    slopes = branch.sensitivity(names, dof="tip@1")["amplitude"].to_numpy()[:, 0]
    for name, slope in zip(names, slopes, strict=True):
        value = problem.parameter(name)
        sizes = [
            float(ss.steady_response(problem.with_parameter(name, value + c), omega=[at], guess=branch.guess(0))
                  .dataset.amplitude.sel(dof="tip@1")[0])
            for c in (step, -step)
        ]  # fmt: skip
        assert slope == pytest.approx((sizes[0] - sizes[1]) / (2 * step), rel=1e-5)
    loaded = ss.load(branch.save(tmp_path / "disc.nc"))
    assert loaded.problem is not None
    assert loaded.problem.parameter("stiffness@1") == problem.parameter("stiffness@1")
    np.testing.assert_array_equal(loaded.on_disc("tip").to_numpy(), branch.on_disc("tip").to_numpy())


def test_from_tuned_to_mistuned() -> None:
    """A branch over "mistuning" begins at the wave and ends at the disc."""
    wave = wave_problem(6, 2, pairs(), 1 - 6j, 0.3)
    disc = wave.structure.sector.mistuned(deviations(6, 0.02), BLADE)  # type: ignore[attr-defined]
    problem = disc.problem(wave, outputs=[f"tip@{s}" for s in range(6)])
    branch = ss.parameter_response(problem, "mistuning", (0.0, 1.0), omega=7.9, peaks_of="tip@0")
    around = branch.on_disc("tip").to_numpy()
    one = ss.steady_response(wave, omega=[7.9]).dataset.amplitude.sel(dof="tip").to_numpy()[0]
    np.testing.assert_allclose(around[0], one, rtol=1e-7)
    end = ss.steady_response(problem, omega=[7.9]).dataset.amplitude.to_numpy()[0]
    np.testing.assert_allclose(around[-1], end, rtol=1e-6)


@pytest.mark.parametrize(
    ("given", "fragments"),
    [
        ({"stiffness": [0.1] * 5, "blade": BLADE}, ("stiffness", "(5,)", "(6,)")),
        ({"stiffness": [0.1] * 6}, ("blade", "missing")),
        ({"stiffness": [0.1] * 6, "blade": BLADE, "spread": 0.1}, ("spread", "stiffness")),
        ({"stiffness": [-50.0] * 6, "blade": BLADE}, ("unstable",)),
        ({"families": 4}, ("families", "1 to 3")),
        ({"blade": BLADE, "spread": -0.1}, ("spread",)),
    ],
)
def test_faults(given: dict[str, Any], fragments: tuple[str, ...]) -> None:
    """Each in one sentence."""
    with pytest.raises(InputError) as raised:
        a_sector(6).mistuned(**given)
    for fragment in fragments:
        assert fragment in str(raised.value)


def test_deviations_with_the_iterative_jacobian() -> None:
    """Derivatives along them and the branch over their factor are those of all entries written out."""
    wave = wave_problem(6, 2, {name: pairs()[name] for name in "MK"}, 1 - 6j, 0.3, orders=4, loss=0.02)
    disc = wave.structure.sector.mistuned(deviations(6, 0.02), BLADE)  # type: ignore[attr-defined]
    problem, names = disc.problem(wave, outputs=["tip@0", "tip@3"]), [f"stiffness@{s}" for s in range(6)]
    slopes = []
    for jacobian in ("dense", "iterative"):
        at = ss.steady_response(problem, omega=[7.9], options={"jacobian": jacobian})
        slopes.append(at.sensitivity([*names, "mistuning"], dof="tip@0")["amplitude"].to_numpy())
    np.testing.assert_allclose(slopes[1], slopes[0], rtol=1e-6)
    branch = ss.parameter_response(problem, "mistuning", (0.9, 1.0), omega=7.9, options={"jacobian": "iterative"})
    np.testing.assert_allclose(branch.dataset.amplitude.to_numpy()[-1], at.dataset.amplitude.to_numpy()[0], rtol=1e-7)


def test_several_contacts_of_a_sector_come_to_every_sector() -> None:
    """Given as one pair or as two: the same disc, which moves as the wave does."""
    wave = wave_problem(6, 2, pairs(), 1 - 6j, 0.3)
    shroud, casing = wave.contacts
    both: dict[str, Any] = {"cos": {1: np.array([1e-3, -2e-3])}}
    rubbing = ss.RubbingMotion(velocity=np.array([0.3, -0.2]), **both)
    contact = casing.contact.changed(kt=np.array([30.0, 20.0]))
    together = ss.ContactPair(name="pads", contact=contact, tangential=["tip", "left"], rubbing=rubbing)
    apart = [
        ss.ContactPair(
            name=f"pad {i}", contact=casing.contact.changed(kt=float(contact.values["kt"][i])), tangential=dof,
            rubbing=ss.RubbingMotion(velocity=float(rubbing.velocity[i]), cos={1: float(both["cos"][1][i])}),
        )
        for i, dof in enumerate(["tip", "left"])
    ]  # fmt: skip
    found = []
    for contacts in ([shroud, together], [shroud, *apart]):
        own = ss.Problem(wave.structure, contacts=contacts, loads=wave.loads, harmonics=wave.harmonics)
        disc = wave.structure.sector.mistuned().problem(own)  # type: ignore[attr-defined]
        found.append([ss.steady_response(p, omega=[7.9]).on_disc("tip").to_numpy()[0] for p in (own, disc)])
    np.testing.assert_allclose(found[0][1], found[0][0], rtol=1e-9)
    np.testing.assert_allclose(found[1][1], found[0][1], rtol=1e-9)
