"""Cases of other codes that are nonlinear modes, rebuilt from their published parameters.

NLvib (M. Krack and J. Gross, https://github.com/maltekrack/NLvib, examples 05, 08, 09 and the one of the RubBeR beam)
and tmdsimpy (J. H. Porter, https://github.com/tmd-lab/tmdsimpy, tests/test_epmc.py and examples). What they publish as
a number is asked for; everything else is held against extended periodic motion written down once more: all dofs of the
structure, forces sampled in time, plain Newton (``helpers.extended_motion``). With ``-s`` the figures are printed.
"""

from __future__ import annotations

import numpy as np
import pytest
from helpers.extended_motion import beam, extended_motion, jenkins

import slipstick as ss

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def chain(masses, springs):
    """Matrices of masses in a row; the first spring holds the first mass, the last one the last."""
    k = np.asarray(springs, dtype=float)
    return np.diag(np.asarray(masses, dtype=float)), np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(
        k[1:-1], -1
    )


def structure(M, K, C=None, dofs=None):
    return ss.MatrixStructure(M=M, K=K, C=C, dofs=dofs or [f"x{i + 1}" for i in range(len(M))])


def deflections(nodes):
    return [f"{name}{node}" for node in range(2, nodes + 1) for name in ("v", "r")]


def followed(own, pairs, harmonics, **more):
    problem = ss.Problem(
        own, contacts=pairs, harmonics=harmonics, loads=ss.Load(dof=own.dofs[0], cos=1.0), outputs=own.dofs
    )
    branch = ss.nonlinear_modes(problem, **more)
    assert branch.outcome is ss.Outcome.COMPLETED, branch.message
    return branch


def against_sampled(title, branch, M, K, rows, force, *, C=None, points=6, samples=4096, also=(), static=None):
    """Largest differences of frequency (relative) and damping (over the largest) at points of the branch."""
    d, dof = branch.dataset, branch.dataset.attrs["mode_of"]
    chosen = sorted({*np.linspace(0, len(branch) - 1, points).astype(int)[1:].tolist(), *map(int, also)})
    most, off = float(np.abs(d.modal_damping).max()), []
    for k in chosen:
        w, D = float(d.omega[k]), float(d.modal_damping[k])
        omega, damping, _ = extended_motion(
            M, np.zeros_like(M) if C is None else C, K, rows, force, d.displacement.values[k].T, w, 2.0 * w * D,
            list(d.dof.values).index(dof), samples=samples, static=static,
        )  # fmt: skip
        off.append((abs(w / omega - 1.0), abs(D - damping) / most if most > 1e-9 else abs(D - damping)))
        print(f"{title}: amplitude {float(d.modal_amplitude[k]):.4e} omega {w:.9g} {omega:.9g} D {D:.8g} {damping:.8g}")
    worst = np.max(off, axis=0)
    print(f"{title}: {len(branch)} points, largest differences {worst[0]:.1e} {worst[1]:.1e} at {len(chosen)} points")
    return worst


def tanh_friction(limit, eps, samples):
    return ss.SampledLaw(
        force=lambda x, velocity, limit, eps: limit * np.tanh(velocity / eps), ports=("x",), samples=samples,
        parameters={"limit": limit, "eps": eps},
    )  # fmt: skip


def cubic(k3):
    return ss.SampledLaw(force=lambda x, velocity, k3: k3 * x**3, parameters={"k3": k3}, ports=("x",))


@pytest.mark.verify
def test_nlvib_05_two_masses_with_regularised_friction():
    """Example 05: 21 harmonics, 1024 samples; the mode begins with the sliding mass held by the regularisation."""
    M, K = chain([0.02, 1.0], [0.0, 40.0, 600.0])
    pair = ss.ContactPair(name="dry", contact=tanh_friction(5.0, 0.05, 1024), ports={"x": "x1"})
    branch = followed(structure(M, K), pair, range(22), amplitude=(10**-1.5, 10.0), dof="x2")
    d = branch.dataset
    peak = int(np.argmax(d.modal_damping.values))
    worst = against_sampled(
        "NLvib 05", branch, M, K, [[1.0, 0.0]], lambda x, v: 5.0 * np.tanh(v / 0.05), samples=1024, also=[peak]
    )
    assert worst.max() < 2e-5  # of 1024 samples: the largest velocity is 4000 times that at which friction turns
    assert float(d.omega[0]) == pytest.approx(np.sqrt(640.0), rel=0.01)  # held
    assert float(d.omega[-1]) == pytest.approx(ss_omega(M, K), rel=2e-3)  # free


def ss_omega(M, K, mode=0):
    return float(np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[mode]))


@pytest.mark.verify
def test_nlvib_08_beam_with_regularised_friction_forced():
    """Example 08, the forced response: 13 harmonics, 128 samples; the structure is the one of its advanced version."""
    M, K = beam(2.0, 0.1, 0.3, 185e9, 7830.0, 9)
    at, tip = 2 * (4 - 2), 14
    held = np.delete(np.arange(16), at)
    fixed = ss_omega(M[np.ix_(held, held)], K[np.ix_(held, held)])
    C = 0.02 / fixed * K
    start = 1.5 * fixed
    free = np.linalg.solve(-(start**2) * M + 1j * start * C + K, 0.2 * np.eye(16)[tip])
    eps = ss_omega(M, K) * abs(free[at])
    pair = ss.ContactPair(name="dry", contact=tanh_friction(1.5, eps, 128), ports={"x": "v4"})
    own = structure(M, K, C, deflections(9))
    problem = ss.Problem(own, contacts=pair, harmonics=range(14), loads=ss.Load(dof="v9", cos=0.2), outputs=own.dofs)
    branch = ss.forced_response(problem, omega=(start, 0.9 * ss_omega(M, K)), peaks_of="v9")
    assert branch.outcome is ss.Outcome.COMPLETED
    d = branch.dataset
    peaks = np.flatnonzero(d.kind.values == "peak")
    off = []
    for k in sorted({*np.linspace(0, len(branch) - 1, 7).astype(int), *peaks}):
        w, q = float(d.omega[k]), d.displacement.values[k].T
        tau, m = 2.0 * np.pi * np.arange(128) / 128, np.arange(1, 14)
        v = w * (m * (np.cos(np.outer(tau, m)) * q[2::2, at] - np.sin(np.outer(tau, m)) * q[1::2, at])).sum(axis=1)
        f = np.fft.rfft(1.5 * np.tanh(v / eps))[:14] / 64.0
        excess = [0.2 * (j == 1) * np.eye(16)[tip] - f[j] * np.eye(16)[at] for j in m]
        z = [np.linalg.solve(-((j * w) ** 2) * M + 1j * j * w * C + K, e) for j, e in zip(m, excess, strict=True)]
        own = q[1::2] - 1j * q[2::2]
        if d.kind.values[k] != "interpolated":
            off.append(np.abs(np.array(z) - own).max() / np.abs(own).max())
    top = peaks[np.argmax(d.sel(dof="v9").amplitude.values[peaks])]
    print(
        f"NLvib 08: peak {float(d.sel(dof='v9').amplitude[top]):.6e} at {float(d.omega[top]):.6f}, {max(off):.1e} off"
    )
    assert max(off) < 1e-8


@pytest.mark.verify
def test_nlvib_09_beam_with_cubic_spring():
    """Example 09, the ECL benchmark: 5 harmonics, and the tongue of the internal resonance near 30 Hz."""
    M, K = beam(0.7, 0.014, 0.014, 2.05e11, 7800.0, 20)
    own = structure(M, K, dofs=deflections(20))
    pair = ss.ContactPair(name="spring", contact=cubic(6e9), ports={"x": "v20"})
    branch = followed(own, pair, range(6), amplitude=(1e-5, 2e-3), dof="v20")
    d = branch.dataset.sel(dof="v20")
    hertz, fifth = d.omega.values / (2.0 * np.pi), np.abs(d.displacement.values[:, 9])
    tip, a = int(np.argmax(fifth)), d.modal_amplitude.values
    enters, leaves = int(np.argmax(a[:tip])), tip + int(np.argmax(fifth[tip:] < 0.05 * fifth[tip]))
    print(f"NLvib 09: {hertz[0]:.6f} Hz to {hertz[-1]:.6f} Hz, tongue {hertz[enters]:.4f} Hz at {a[enters]:.4e}, "
          f"{hertz[tip]:.4f} Hz where harmonic 5 alone moves by {fifth[tip]:.4e}, {hertz[leaves]:.4f} Hz")  # fmt: skip
    also = [enters, leaves, (enters + tip) // 2, (leaves + tip) // 2]
    worst = against_sampled("NLvib 09", branch, M, K, np.eye(38)[36:37], lambda x, v: 6e9 * x**3, samples=64, also=also)
    assert worst[0] < 1e-8
    assert worst[1] < 1e-8
    assert 0.0 < a[tip] < 0.1 * a[enters]
    for options in ({"max_step": 0.005}, {"max_step": 0.06}):
        other = followed(own, pair, range(6), amplitude=(1e-5, 2e-3), dof="v20", options=options).dataset.sel(dof="v20")
        assert float(np.abs(other.displacement.values[:, 9]).max()) == pytest.approx(fifth[tip], rel=2e-3)
        assert float(other.omega[-1]) == pytest.approx(float(d.omega[-1]), rel=1e-10)


@pytest.mark.verify
def test_nlvib_rubber_beam_with_elastic_friction():
    """The RubBeR beam (M. Scheel, T. Weigele, M. Krack, J. Sound Vib. 2020, doi 10.1016/j.jsv.2020.115580) of NLvib."""
    M, K = beam(0.710, 0.05, 0.06, 210e9 * 0.6725, 7850.0, 15)
    own = structure(M, K, dofs=deflections(15))
    law = ss.FrictionContact(kt=1e8, mu=0.5, normal_load=53.0 * 4.0)
    pair = ss.ContactPair(name="pocket", tangential="v6", contact=law)
    shape = abs(own.by_modes().mode_shapes[26, 0])
    ends = (1e-5 * shape, 10**-2.5 * shape)
    branch = followed(own, pair, range(8), amplitude=ends, dof="v15")
    d = branch.dataset
    peak = int(np.argmax(d.modal_damping.values))
    worst = against_sampled("RubBeR", branch, M, K, np.eye(28)[8:9], jenkins(1e8, 106.0), also=[peak])
    assert worst[0] < 1e-6
    assert worst[1] < 5e-5  # of its samples at the onset of slip
    assert float(d.omega[0]) == pytest.approx(ss_omega(M, K + 1e8 * np.diag(np.eye(28)[8])), rel=1e-9)
    fine = followed(
        own, pair, range(8), amplitude=ends, dof="v15", options={"max_step": 3e-3, "output_tolerance": 5e-5}
    )
    off = off_lines(branch.dataset, fine.dataset)
    print(f"RubBeR: largest damping {float(d.modal_damping[peak]):.6f} at {float(d.omega[peak]):.4f} rad/s; default "
          f"({len(branch)} points) off fine steps ({len(fine)}): {off[0]:.1e} {off[1]:.1e}")  # fmt: skip
    assert off.max() < 5e-4


def off_lines(coarse, fine):
    """How far points of a fine curve are off the lines of a coarse one: of frequency, and of damping over itself."""
    p, q = (
        np.column_stack([np.log(d.modal_amplitude.values), np.log(d.omega.values), d.modal_damping.values])
        for d in (coarse, fine)
    )
    lines, off = np.diff(p, axis=0), []
    for point in q:
        along = np.clip(((point - p[:-1]) * lines).sum(axis=1) / (lines**2).sum(axis=1), 0.0, 1.0)
        away = np.abs(point - p[:-1] - along[:, None] * lines)
        nearest = away[np.argmin((away**2).sum(axis=1))]
        off.append((nearest[1], nearest[2] / max(point[2], 0.02 * q[:, 2].max())))
    return np.max(off, axis=0)


def test_tmdsimpy_duffing():
    """One harmonic: frequency ``sqrt(k + 3/4 k3 a^2)`` to 1e-8, which its test asks for, over four decades."""
    own = structure([[1.0]], [[1.0]], [[0.01]])
    pair = ss.ContactPair(name="cubic", contact=cubic(1.0), ports={"x": "x1"})
    d = followed(own, pair, [0, 1], amplitude=(1e-2, 1e2)).dataset
    exact = np.sqrt(1.0 + 0.75 * d.modal_amplitude.values**2)
    print(f"tmdsimpy Duffing: {np.abs(d.omega.values / exact - 1.0).max():.1e}")
    assert d.omega.values == pytest.approx(exact, rel=1e-9)
    assert 2.0 * d.modal_damping.values * d.omega.values == pytest.approx(0.01, rel=1e-7)


def test_tmdsimpy_jenkins():
    """Its test asks for the frequencies of stick to 1e-12 and of full slip to 1e-7, at amplitudes 0.01 and 1e5."""
    own = structure([[1.0]], [[1.0]], [[0.01]])
    law = ss.FrictionContact(kt=0.25, mu=0.2, normal_load=1.0)
    pair = ss.ContactPair(name="jenkins", tangential="x1", contact=law)
    branch = followed(own, pair, range(4), amplitude=(1e-2, 1e5))
    d = branch.dataset
    stuck, slid = abs(float(d.omega[0]) - np.sqrt(1.25)), abs(float(d.omega[-1]) - 1.0)
    print(f"tmdsimpy Jenkins: {stuck:.1e} {slid:.1e}")
    assert stuck < 1e-12
    assert slid < 1e-7


@pytest.mark.verify
@pytest.mark.parametrize("kind", ["cubic", "jenkins"])
def test_tmdsimpy_two_dofs(kind):
    """Its two-dof systems: a cubic spring 0.5, or a slider 0.25 with limit 0.2, on the second mass."""
    M, K, C = np.eye(2), np.array([[2.0, -1.0], [-1.0, 2.0]]), 0.01 * np.eye(2)
    own, rows = structure(M, K, C), [[0.0, 1.0]]
    if kind == "cubic":
        pair = ss.ContactPair(name="c", contact=cubic(0.5), ports={"x": "x2"})
        branch = followed(own, pair, range(8), amplitude=(1e-2, 3.0), dof="x2")
        worst = against_sampled("tmdsimpy 2 dof cubic", branch, M, K, rows, lambda x, v: 0.5 * x**3, C=C, samples=64)
        assert worst.max() < 1e-8
    else:
        law = ss.FrictionContact(kt=0.25, mu=0.2, normal_load=1.0)
        pair = ss.ContactPair(name="j", tangential="x2", contact=law)
        branch = followed(own, pair, range(8), amplitude=(1e-2, 1e2), dof="x2")
        worst = against_sampled("tmdsimpy 2 dof Jenkins", branch, M, K, rows, jenkins(0.25, 0.2), C=C)
        assert worst[0] < 1e-6
        assert worst[1] < 2e-5
        stuck = ss_omega(M, K + 0.25 * np.diag([0.0, 1.0]))
        assert float(branch.dataset.omega[0]) == pytest.approx(stuck, rel=1e-9)


@pytest.mark.verify
def test_tmdsimpy_elastic_dry_friction_with_a_normal_direction():
    """Example 2dof_eldry_fric: the normal dof carries 100 N by two springs of 21 N/m, one of them the contact."""
    M, K = np.eye(2), np.diag([12.0, 21.0])
    C = np.diag([2 * 0.05 * np.sqrt(12.0), 2 * 0.1 * np.sqrt(100.0)])
    law = ss.FrictionContact(kt=5.0, mu=0.85, kn=21.0, gap=0.0)
    pair = ss.ContactPair(name="foot", tangential="x", normal="y", contact=law)
    own = structure(M, K, C, ["x", "y"])
    loads = [ss.Load(dof="y", harmonic=0, cos=100.0), ss.Load(dof="x", cos=1.0)]
    problem = ss.Problem(own, contacts=pair, loads=loads, harmonics=range(9))
    branch = ss.nonlinear_modes(problem, amplitude=(1e-2, 1e4), dof="x")
    assert branch.outcome is ss.Outcome.COMPLETED, branch.message
    limit = 0.85 * 21.0 * 100.0 / 42.0

    def force(x, v):
        return np.vstack([jenkins(5.0, limit)(x[:1], v), 21.0 * np.maximum(x[1:], 0.0)])

    peak = int(np.argmax(branch.dataset.modal_damping.values))
    worst = against_sampled(
        "tmdsimpy eldry", branch, M, K, np.eye(2), force, C=C, also=[peak], static=np.array([0.0, 100.0])
    )
    assert worst[0] < 1e-6
    assert worst[1] < 2e-5
    assert branch.dataset.displacement.values[:, 1, 0] == pytest.approx(100.0 / 42.0, rel=1e-9)


@pytest.mark.verify
@pytest.mark.parametrize(("mode", "harmonics", "last"), [(1, range(3), 200.0), (2, range(4), 60.0)])
def test_tmdsimpy_iwan_element_of_100_sliders(mode, harmonics, last):
    """Example vprnm_rom_iwan (J. H. Porter and M. R. W. Brake, arXiv 2405.15918): three dofs, a four-parameter Iwan
    element (D. J. Segalman, J. Appl. Mech. 72 (2005) 752) in 100 sliders between the second and the third."""
    phi = np.array([[1.0, 2.0, 3.0], [2.0, 1.0, -1.0], [-2.0, 1.0, 1.0]]).T
    inverse = np.linalg.inv(phi)
    row = np.array([0.0, 1.0, -1.0])
    M = inverse.T @ inverse
    K = inverse.T @ np.diag([1.0, 9.0, 56.25]) @ inverse - 0.3 * np.outer(row, row)
    kt, slip, chi, count = 0.6, 10.0, -0.5, 100
    furthest = slip / kt * (chi + 2.0) / (chi + 1.0)
    width = furthest / count
    at = width * (np.arange(count) + 0.5)
    springs = slip * (chi + 2.0) / furthest ** (chi + 2.0) * at**chi * width
    law = ss.FrictionContact(kt=springs, mu=np.ones(count), normal_load=springs * at)
    pair = ss.ContactPair(name="iwan", tangential=[{"x2": 1.0, "x3": -1.0}] * count, contact=law)
    branch = followed(structure(M, K, 0.01 * M), pair, harmonics, amplitude=(1e-3, last), mode=mode, dof="x1")
    d, C = branch.dataset, 0.01 * M

    def force(x, v):
        return jenkins(springs, springs * at)(np.repeat(x, count, axis=0), v).sum(axis=0, keepdims=True)

    peak = int(np.argmax(d.modal_damping.values))
    worst = against_sampled(
        f"tmdsimpy Iwan mode {mode}", branch, M, K, row, force, C=C, points=4, samples=2048, also=[peak]
    )
    assert worst[0] < 1e-6
    assert worst[1] < 5e-5
    assert float(d.omega[0]) == pytest.approx(ss_omega(M, K + springs.sum() * np.outer(row, row), mode - 1), rel=1e-9)
