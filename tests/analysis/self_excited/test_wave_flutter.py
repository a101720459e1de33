"""Flutter of a wave that friction limits: against the closed form of one harmonic, and the whole ring's own cycles."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

import slipstick as ss

N, E = 6, 2
FED, DAMPED, KT, LEVEL = 0.6, 0.4, 0.5, 0.5
CONTACT = ss.FrictionContact(kt=KT, mu=0.5, normal_load=1.0)
DAMPING = "ignore:the structure's:slipstick.SlipstickWarning", "ignore:nothing moves:slipstick.SlipstickWarning"
pytestmark = [pytest.mark.filterwarnings(sentence) for sentence in DAMPING]


def influence(fed: float = FED) -> Any:
    """The gas feeds two nodal diameters forward and damps them backward: real stiffness, without symmetry."""
    kappa = np.zeros(N, dtype=complex)
    kappa[E], kappa[-E] = -1j * fed, 1j * fed
    return kappa


def wave(harmonics: Iterable[int], *, engine_order: int = E, fed: float = FED, **contact: Any) -> ss.Problem:
    sector = ss.CyclicStructure(M=[[1.0]], K=([[1.4]], [[-0.2]]), C=[[DAMPED]], dofs=["x"], sectors=N)
    fluttering = sector.with_aerodynamics(influence(fed), [[1.0]])
    shroud = ss.ContactPair(name="shroud", contact=CONTACT, tangential={"x": 1.0, "x@next": -1.0}, **contact)
    return ss.Problem(fluttering.travelling_wave(engine_order), contacts=shroud, harmonics=harmonics, outputs=["x"])


def ring(harmonics: Iterable[int]) -> ss.Problem:
    names, L, one = [f"x@{s}" for s in range(N)], np.fft.ifft(influence()).real, np.eye(N)
    K = sum((np.roll(one, j, axis=1) * L[j] for j in range(N)), start=1.4 * one)
    K = K - 0.2 * (np.roll(one, 1, axis=1) + np.roll(one, -1, axis=1))
    structure = ss.MatrixStructure(M=one, K=K, C=DAMPED * one, dofs=names)
    across = [{names[s]: 1.0, names[(s + 1) % N]: -1.0} for s in range(N)]
    shroud = ss.ContactPair(name="shroud", contact=CONTACT, tangential=across)
    return ss.Problem(structure, contacts=shroud, harmonics=harmonics)


def friction_stiffness(size: float, kt: float = KT, level: float = LEVEL) -> complex:
    """Of motion ``size cos(tau)`` that slips, first harmonic of the force over the motion."""
    ratio = min(1.0, level / kt / size)
    angle = np.arccos(1.0 - 2.0 * ratio)
    return kt / np.pi * (angle - 0.5 * np.sin(2.0 * angle) + 4j * ratio * (1.0 - ratio))


def cycles(branch: ss.Branch) -> Any:
    data = branch.dataset
    return data.isel(point=np.flatnonzero(data.branch_part.values == 1))


@pytest.mark.filterwarnings("ignore:stability is not known:slipstick.SlipstickWarning")
def test_cycles_of_one_harmonic_are_in_closed_form():
    """Amplitude and frequency of every point."""
    branch = ss.limit_cycles(wave([0, 1]), "damping", (0.9, 0.75), options={"max_step": 0.3})
    found = cycles(branch)
    slips = found.isel(point=slice(2, None))
    assert slips.sizes["point"] > 3
    for p, w, x in zip(slips.parameter.values, slips.omega.values, slips.amplitude.values[:, 0], strict=True):
        k = 3.0 * friction_stiffness(np.sqrt(3.0) * x)  # |1 - e^(2 pi i / 3)|^2
        assert abs(1.6 - w * w + k + 1j * (DAMPED * p * w - FED)) < 1e-8
    hopf = [point for point in branch.bifurcations() if point.kind == "Hopf"]
    omega = np.sqrt(1.6 + 3.0 * KT)
    assert [(point.value, point.omega) for point in hopf] == [pytest.approx((FED / DAMPED / omega, omega), rel=1e-9)]


@pytest.mark.filterwarnings("ignore:stability is not known:slipstick.SlipstickWarning")
def test_cycles_of_one_harmonic_move_as_the_closed_form():
    """Its implicit derivatives of frequency and amplitude, by a contact's parameters and by the one followed."""
    branch = ss.limit_cycles(wave([0, 1]), "damping", (0.9, 0.75), options={"max_step": 0.3})
    point = int(np.flatnonzero(branch.dataset.branch_part.values == 1)[4])
    here = branch.dataset.isel(point=point)
    slopes = branch.sensitivity(["shroud.kt", "shroud.mu", "damping"], points=point).isel(point=0)

    def left(numbers: Any) -> Any:
        w, x, kt, mu, p = numbers
        total = 1.6 - w * w + 3.0 * friction_stiffness(np.sqrt(3.0) * x, kt, mu) + 1j * (DAMPED * p * w - FED)
        return np.array([total.real, total.imag])

    at = np.array([float(here.omega), float(here.amplitude[0]), KT, LEVEL, float(here.parameter)])
    J = np.column_stack([(left(at + step) - left(at - step)) / 2e-6 for step in 1e-6 * np.eye(5)])
    expected = -np.linalg.solve(J[:, :2], J[:, 2:])
    assert slopes.omega.values == pytest.approx(expected[0], rel=1e-7, abs=1e-9)
    assert slopes.amplitude.values == pytest.approx(expected[1], rel=1e-7, abs=1e-9)


@pytest.mark.parametrize(
    ("span", "expected"), [((0.9, 0.45), [0]), pytest.param((0.9, 0.1), [0, 1], marks=pytest.mark.verify)]
)
def test_cycles_are_those_of_the_whole_ring(span, expected):
    """Which finds the wave itself, and judges it by multipliers in time; the larger cycle is beyond the turn."""
    orders, at = range(4), 0.5
    found = []
    for problem in (wave(orders), ring(orders)):
        points = cycles(ss.limit_cycles(problem, "damping", span, at=at, options={"max_step": 0.2}))
        found.append(points.isel(point=np.flatnonzero(points.parameter.values == at)))
    own, whole = found
    np.testing.assert_allclose(own.omega.values, whole.omega.values, rtol=1e-10)
    np.testing.assert_allclose(whole.amplitude.values, np.repeat(own.amplitude.values, N, axis=1), rtol=1e-9)
    assert own.unstable_multipliers.values.tolist() == whole.unstable_multipliers.values.tolist() == expected


@pytest.mark.filterwarnings("ignore:stability is not known:slipstick.SlipstickWarning")
def test_steady_sliding_of_a_wave_is_unstable_beyond_its_hopf_point():
    branch = ss.limit_cycles(wave([0, 1]), "damping", (0.9, 0.84))
    data = branch.dataset
    rest = data.isel(point=data.branch_part.values == 2)
    grows = rest.parameter.values < FED / DAMPED / np.sqrt(3.1) - 1e-9
    np.testing.assert_array_equal(rest.unstable_multipliers.values, 2 * grows)


def test_another_wave_that_grows_is_counted_and_named():
    """Two nodal diameters backward are damped: those forward grow, wave number 2 - 4 modulo 6."""
    with pytest.warns(ss.SlipstickWarning, match="disturbance of wave number 4 grows"):
        branch = ss.limit_cycles(wave([0, 1], engine_order=-E), "damping", (1.2, 0.6))
    data = branch.dataset
    last = data.isel(point=-1)
    assert "there is no Hopf point" in branch.message
    assert int(last.unstable_multipliers) == 2
    assert int(last.wave_number) == 4


@pytest.mark.verify
@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_the_nonlinear_mode_of_a_wave_is_the_line_of_its_forced_peaks() -> None:
    """Limit cycles of a sector from which mass-proportional damping xi is taken, ``C = -M``.

    What xi gives is given by a load in phase with the velocity: ``p |q_tip| = xi w q^H M q`` at the peak.
    """
    blade, disc, between = 4.0e4, 4.0e5, 1.5e5
    M, K = np.diag([0.3, 1.2]), np.array([[blade, -blade], [-blade, blade + disc + 2.0 * between]])
    given = {"M": M, "K": (K, np.diag([0.0, -between])), "dofs": ["tip", "disc"], "sectors": 6, "loss_factor": 2e-3}
    law = ss.FrictionContact(kt=4.0e3, mu=0.3, normal_load=10.0)
    common = {"contacts": ss.ContactPair(name="shroud", contact=law, tangential={"tip": 1.0, "tip@next": -1.0}),
              "harmonics": [0, 1, 3]}  # fmt: skip
    taken = ss.CyclicStructure(**given, C=-M, damping=0.0).travelling_wave(1)
    cycles = ss.limit_cycles(ss.Problem(taken, **common), "damping", (0.0, 4.0), at=3.0)
    mode = cycles.dataset.isel(point=cycles.at(3.0))
    w, q = float(mode.omega), mode.displacement.sel(dof=["tip", "disc"], coefficient=["c1", "s1"]).values
    load = 3.0 * w * np.sum(M.diagonal()[:, None] * q**2) / np.hypot(*q[0])
    wave = ss.CyclicStructure(**given).travelling_wave(1)
    forced = ss.Problem(wave, **common, loads=ss.Load(dof="tip", amplitude=load), outputs=["tip"])
    ((at, size),) = ss.forced_response(forced, omega=(0.98 * w, 1.02 * w)).peaks("tip")
    assert at == pytest.approx(w, rel=2e-4)
    assert size == pytest.approx(float(mode.amplitude.sel(dof="tip")), rel=2e-3)
