"""Modes fitted to synthetic receptances with noise, held against the modes that they were computed of."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy.linalg import eigh

from slipstick.structure.measured import Receptances, checked, deviation
from slipstick.structure.modal_fit import ModalFit, fit_modes

MANY = 12
"""Seeds of the long tests; the fast ones have one."""


def receptances(w, zeta, shapes, omega, inputs=(0, 3), flat=0.0, share=0.0, seed=0) -> Receptances:
    """Of modes with shapes (n_dofs, n_modes); noise: a floor, of the largest receptance, and a share of each."""
    rng, w = np.random.default_rng(seed), np.asarray(w, dtype=float)
    inputs, D = list(inputs), 1.0 / (w**2 + 2j * zeta * w * omega[:, None] - omega[:, None] ** 2)
    H = np.einsum("kr,ir,jr->kij", D, shapes, shapes[inputs])
    parts = np.sqrt(0.5) * rng.standard_normal((2, 2, *H.shape))
    of_all, of_each = parts[:, 0] + 1j * parts[:, 1]
    H = H * (1.0 + share * of_each) + flat * np.abs(H).max() * of_all
    rows, columns = np.meshgrid(np.arange(len(shapes)), inputs, indexing="ij")
    names = tuple(f"d{k}" for k in range(len(shapes)))
    return Receptances(
        dofs=names, omega=omega, values=H.reshape(omega.size, -1), rows=rows.ravel(), columns=columns.ravel()
    )


def chain(lines=600, **noise) -> tuple[np.ndarray, np.ndarray, np.ndarray, Receptances]:
    """Four masses in a row; the fourth mode, at 11.9 rad/s, lies above the range measured."""
    M = np.diag([1.0, 1.2, 0.8, 1.0])
    K = np.array([[60.0, -25, 0, 0], [-25, 70, -30, 0], [0, -30, 80, -35], [0, 0, -35, 90]])
    squares, shapes = eigh(K, M)
    w = np.sqrt(squares)
    zeta = 0.5 * (0.004 * w + 0.02 / w)
    return w, zeta, shapes, receptances(w, zeta, shapes, np.linspace(2.0, 11.0, lines), **noise)


def plate(w, low=2.0, high=12.0, lines=800, dofs=8, **noise):
    """Modes of any frequencies with 1 % damping and random shapes."""
    w = np.asarray(w, dtype=float)
    zeta, shapes = np.full(w.size, 0.01), np.random.default_rng(1).standard_normal((dofs, w.size))
    return w, zeta, shapes, receptances(w, zeta, shapes, np.linspace(low, high, lines), **noise)


def held_against(fit: ModalFit, w, zeta, shapes, measured: Receptances, frequency, damping, shape=0.99) -> None:
    """Every mode of the range is there once, nothing else is in it, and shapes lie in those of their frequency."""
    found, low, high = fit.structure, *measured.omega[[0, -1]]
    truth = np.flatnonzero((w > low) & (w < high))
    inside = np.flatnonzero((found.omega > low) & (found.omega < high))
    assert inside.size == truth.size
    for r, k in zip(truth, inside, strict=True):
        assert abs(found.omega[k] / w[r] - 1.0) < frequency
        assert abs(found.damping_ratio[k] / zeta[r] - 1.0) < damping
        same = np.flatnonzero(np.abs(w / w[r] - 1.0) < 1e-2)
        span, phi = np.linalg.qr(shapes[:, same])[0], found.mode_shapes[:, k]
        order = [int(name[1:]) for name in found.dofs]
        assert np.sum((span[order].T @ phi) ** 2) / (phi @ phi) > shape


CASES = {
    "floor of -60 dB": (lambda s: chain(flat=1e-3, seed=s), 1e-4, 0.01),
    "floor of -50 dB": (lambda s: chain(flat=3e-3, seed=s), 2e-4, 0.03),
    "floor of -40 dB": (lambda s: chain(flat=1e-2, seed=s), 6e-4, 0.06),
    "floor of -30 dB": (lambda s: chain(flat=3e-2, seed=s), 2e-3, 0.15),
    "share of 1 %": (lambda s: chain(share=1e-2, seed=s), 1e-4, 0.01),
    "share of 10 %": (lambda s: chain(share=0.1, seed=s), 1e-3, 0.05),
    "one input": (lambda s: chain(flat=3e-3, seed=s, inputs=(0,)), 5e-4, 0.05),
    "30 lines": (lambda s: chain(lines=30, flat=1e-3, seed=s), 2e-4, 0.03),
    "two shapes at one frequency": (lambda s: plate([4.0, 6.0, 6.0, 9.0], flat=3e-3, seed=s), 5e-4, 0.05),
    "modes as close as a quarter of their width": (
        lambda s: plate([4.0, 6.0, 6.03, 9.0], flat=3e-3, seed=s), 5e-4, 0.05,
    ),
    "modes below and above the range": (
        lambda s: plate(np.arange(1.0, 15.0) + 0.2, low=4.7, high=8.7, lines=300, flat=3e-3, seed=s), 5e-4, 0.03,
    ),
}  # fmt: skip
"""Table by seed, tolerances of frequency and damping ratio: about five standard deviations of the best estimate."""


def held(case: str, seed: int) -> None:
    make, frequency, damping = CASES[case]
    w, zeta, shapes, measured = make(seed)
    fit = fit_modes(measured)
    held_against(fit, w, zeta, shapes, measured, frequency, damping)


@pytest.mark.parametrize("case", CASES)
def test_modes_come_back_out_of_noise(case):
    held(case, 0)


@pytest.mark.verify
@pytest.mark.parametrize("case", CASES)
def test_modes_come_back_out_of_noise_of_many_seeds(case):
    for seed in range(1, MANY):
        held(case, seed)


def test_standard_deviations_are_those_of_many_measurements():
    """Errors of 8 measurements over what is stated: 1 in the mean, within what 48 numbers scatter."""
    off = []
    for seed in range(8):
        w, zeta, _, measured = chain(lines=100, flat=1e-2, seed=seed)
        fit = fit_modes(measured)
        off.append((fit.structure.omega[:3] / w[:3] - 1.0) / fit.omega_error[:3])
        off.append((fit.structure.damping_ratio[:3] / zeta[:3] - 1.0) / fit.damping_error[:3])
    assert 0.65 < np.sqrt(np.mean(np.square(off))) < 1.4


def test_strong_modes_stand_out_of_a_floor_of_a_tenth():
    w, zeta, _, measured = chain(flat=0.1)
    fit = fit_modes(measured)
    for r in range(2):
        k = int(np.argmin(np.abs(fit.structure.omega - w[r])))
        assert fit.structure.omega[k] == pytest.approx(w[r], rel=3e-3)
        assert fit.structure.damping_ratio[k] == pytest.approx(zeta[r], rel=0.2)


def test_a_mode_that_is_hardly_seen_is_not_trusted():
    """Of the fourth mode, above the range, the damping hardly shows."""
    _, _, _, measured = chain(flat=0.03)
    fit = fit_modes(measured)
    unsure = fit.damping_error > 0.2
    assert unsure.any()
    assert sum("is not to be trusted: its damping ratio is" in sentence for sentence in fit.warnings) == unsure.sum()


def test_fewer_modes_keep_the_accuracy_of_all():
    """Three of four modes: the fourth, above the range, is taken into account all the same."""
    w, zeta, _, measured = chain(flat=1e-3)
    fit = fit_modes(measured, 3)
    assert fit.structure.omega.size == 3
    np.testing.assert_allclose(fit.structure.omega, w[:3], rtol=1e-4)
    np.testing.assert_allclose(fit.structure.damping_ratio, zeta[:3], rtol=0.01)
    assert any("6 modes were asked for, 4 stand out" in sentence for sentence in fit_modes(measured, 6).warnings)


def test_noise_alone_is_refused():
    _, _, _, measured = chain()
    rng = np.random.default_rng(0)
    values = rng.standard_normal((2, *measured.values.shape))
    with raises_fault("receptances", says="no resonance above their noise"):
        fit_modes(_with(measured, values[0] + 1j * values[1]))


def test_a_fit_that_was_stopped_says_so():
    _, _, _, measured = chain(flat=1e-3)
    assert any("was stopped after 0 s" in sentence for sentence in fit_modes(measured, time_limit=0.0).warnings)


def _with(measured: Receptances, values) -> Receptances:
    return Receptances(
        dofs=measured.dofs, omega=measured.omega, values=values, rows=measured.rows, columns=measured.columns
    )


@pytest.mark.parametrize("flat", [0.0, 1e-3, 1e-2])
@pytest.mark.parametrize(
    ("changed", "says"),
    [
        (lambda A, w: A.conj(), "they are conjugated"),
        (lambda A, w: -(w**2) * A, 'look like accelerances .*quantity="acceleration"'),
        (lambda A, w: 1j * w * A, 'look like mobilities .*quantity="velocity"'),
        (lambda A, w: -A, "their residue at the driving point 'd0' is negative"),
        (lambda A, w: -(w**2) * A.conj(), "they are conjugated"),
    ],
)
def test_what_is_no_receptance_is_named(changed, says, flat):
    _, _, _, measured = chain(flat=flat)
    checked(measured)
    with raises_fault("receptances", says=says):
        checked(_with(measured, changed(measured.values, measured.omega[:, None])))


@pytest.mark.parametrize("kind", ["flat", "share"])
def test_noise_is_estimated_from_the_table(kind):
    _, _, _, measured = chain(lines=3000, **{kind: 1e-2})
    exact = np.abs(chain(lines=3000)[3].values)
    truth = 1e-2 * np.sqrt(0.5) * (exact if kind == "share" else exact.max() * np.ones_like(exact))
    ratio = deviation(measured.omega, measured.values) / truth
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1.0, abs=0.1)
    assert np.median(ratio, axis=0) == pytest.approx(np.ones(8), abs=0.15)
