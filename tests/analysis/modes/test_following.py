from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from helpers.extended_motion import beam, extended_motion
from helpers.oscillator import closed

import slipstick as ss
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def test_lines_between_points_are_frequency_and_damping():
    """Of default steps, against the closed form: the corner of first slip and the steep rise after it too."""
    branch = ss.nonlinear_modes(oscillator(harmonics=(0, 1)), amplitude=(1.0, 80.0))
    d = branch.dataset
    a = d.modal_amplitude.values
    corner = float(a[d.kind.values == "corner"][0])
    assert corner == pytest.approx(2.4, rel=1e-4)
    between = np.concatenate([np.linspace(p, q, 9) for p, q in pairwise(a)])
    exact = np.array([closed(x) for x in between])
    for scale in (np.asarray, np.log):
        lines = [np.interp(scale(between), scale(a), d[name].values) for name in ("omega", "modal_damping")]
        assert np.abs(np.transpose(lines) / exact - 1.0).max() < 5e-4


ECL = (0.7, 0.014, 0.014, 2.05e11, 7800.0, 20)


def cantilever(harmonics=range(6)) -> ss.Problem:
    """The ECL benchmark (F. Thouverez, Mech. Syst. Signal Process. 17 (2003) 195): a cubic spring at the tip."""
    M, K = beam(*ECL)
    dofs = [f"{name}{node}" for node in range(2, 21) for name in ("v", "r")]
    spring = ss.SampledLaw(force=lambda x, velocity, k3: k3 * x**3, parameters={"k3": 6e9}, ports=("x",))
    pair = ss.ContactPair(name="spring", contact=spring, ports={"x": "v20"})
    return ss.Problem(
        ss.MatrixStructure(M=M, K=K, dofs=dofs), contacts=pair, loads=ss.Load(dof="v20", cos=1.0), harmonics=harmonics
    )


def test_an_internal_resonance_is_entered_and_left():
    """Near 30 Hz harmonic 5 meets the second mode: harmonic 1 vanishes on the way, and the backbone goes on."""
    branch = ss.nonlinear_modes(cantilever(), amplitude=(1e-5, 1e-3), dof="v20")
    assert branch.outcome is ss.Outcome.COMPLETED
    d = branch.dataset.sel(dof="v20")
    hertz, fifth = d.omega.values / (2.0 * np.pi), d.displacement.values[:, 9]
    tip = int(np.argmax(np.abs(fifth)))
    a = d.modal_amplitude.values
    assert np.abs(fifth[tip]) == pytest.approx(6.245e-4, rel=1e-3)
    assert a[tip] < 0.1 * a[:tip].max()
    assert np.abs(hertz[tip] - 29.77) < 0.01
    before, after = fifth[:tip], fifth[tip + 1 :]
    assert before[np.abs(before) > 1e-6].min() * after[np.abs(after) > 1e-6].max() < 0.0
    M, K = beam(*ECL)
    rows = np.eye(len(M))[-2:-1]
    omega, *_ = extended_motion(
        M, 0.0 * M, K, rows, lambda x, velocity: 6e9 * x**3, branch.dataset.displacement.values[-1].T,
        float(d.omega[-1]), 0.0, len(M) - 2, samples=64,
    )  # fmt: skip
    assert float(d.omega[-1]) == pytest.approx(omega, rel=1e-8)
    assert np.abs(d.modal_damping.values).max() < 1e-9


def test_a_mode_that_does_not_come_to_the_last_amplitude_says_so():
    """A contact that holds the output on a stop so stiff that only the rest of the structure moves on."""
    M, K = np.diag([1.0, 1.0]), np.array([[10.0, -10.0], [-10.0, 20.0]])
    stop = ss.SampledLaw(force=lambda x, velocity, k: k * x**9, parameters={"k": 1e9}, ports=("x",))
    pair = ss.ContactPair(name="stop", contact=stop, ports={"x": "a"})
    problem = ss.Problem(
        ss.MatrixStructure(M=M, K=K, dofs=["a", "b"]), contacts=pair, loads=ss.Load(dof="b", cos=1.0), harmonics=[0, 1]
    )
    branch = ss.nonlinear_modes(problem, amplitude=(1e-3, 1e3), dof="a")
    assert branch.outcome is ss.Outcome.TURNED_BACK
    assert "the motion at the output does not come to 1000" in branch.message
    assert len(branch) > 10


def test_a_contact_that_just_touches_is_nowhere_linear_and_has_its_mode():
    """Half a period with the contact spring, half without: ``2 w1 w2 / (w1 + w2)`` at all amplitudes."""
    structure = ss.MatrixStructure(M=np.eye(2), K=np.diag([100.0, 40.0]), dofs=["x", "y"])
    law = ss.FrictionContact(kt=1.0, mu=0.1, kn=100.0, gap=0.0)
    pair = ss.ContactPair(name="foot", tangential="x", normal="y", contact=law)
    problem = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="y", cos=1.0), harmonics=range(16))
    d = ss.nonlinear_modes(problem, amplitude=(0.01, 1.0), dof="y").dataset
    low, high = np.sqrt([40.0, 140.0])
    assert d.omega.values == pytest.approx(2.0 * low * high / (low + high), rel=1e-6)
