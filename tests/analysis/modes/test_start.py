from __future__ import annotations

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.modes.free_problem import linear_mode

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def test_the_mode_is_numbered_without_contacts_and_followed_to_them():
    """Of two coupled oscillators the one with the stiffer contact is the second mode with it, and the first without."""
    structure = ss.MatrixStructure(M=np.eye(2), K=[[40.0, 0.0], [0.0, 60.0]], dofs=["a", "b"])
    pair = ss.ContactPair(name="foot", tangential="a", contact=ss.FrictionContact(kt=100.0, mu=0.5, normal_load=10.0))
    problem = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="a", sin=1.0), harmonics=range(4))
    d = ss.nonlinear_modes(problem, amplitude=(0.01, 0.02), mode=1, dof="a").dataset
    assert d.omega.values == pytest.approx(np.sqrt(140.0), rel=1e-9)
    assert d.attrs["mode"] == 1


def test_the_linear_mode_of_springs_dampers_and_a_preload_solves_the_linear_equations():
    """``(K + K_c + i w (C + C_c - xi M) - w^2 M) q = 0``: a damper law, a stuck contact closed by a static load."""
    n = 5
    K = 50.0 * np.eye(n) - 20.0 * np.eye(n, k=1) - 20.0 * np.eye(n, k=-1)
    M, dofs = np.diag([1.0, 0.5, 2.0, 1.0, 1.5]), ["a", "b", "c", "d", "e"]
    structure = ss.MatrixStructure(M=M, C=0.01 * M, K=K, dofs=dofs)
    damper = ss.SampledLaw(force=lambda x, velocity, c: c * velocity, parameters={"c": 0.7}, ports=("x",))
    foot = ss.FrictionContact(kt=30.0, mu=0.4, kn=25.0, gap=0.1)
    pairs = [
        ss.ContactPair(name="damper", contact=damper, ports={"x": {"a": 1.0, "b": -1.0}}),
        ss.ContactPair(name="foot", contact=foot, tangential="c", normal="e"),
    ]
    loads = [ss.Load(dof="e", harmonic=0, cos=20.0)]
    problem = ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(3))
    modal = structure.by_modes()
    row, unit = np.array([1.0, -1.0, 0.0, 0.0, 0.0]), np.eye(n)
    contact = np.diag(30.0 * unit[2] + 25.0 * unit[4])
    for number, at in ((0, "a"), (2, "d")):
        found = linear_mode(problem, modal, number, at)
        q = modal.mode_shapes @ found.modal
        w = found.omega
        Z = K + contact - w**2 * M + 1j * w * (0.01 * M + 0.7 * np.outer(row, row) - found.xi * M)
        assert np.abs(Z @ q).max() < 1e-9 * np.abs(K @ q).max()
        assert found.at_dof == pytest.approx(q[dofs.index(at)], rel=1e-9)
        assert found.ports[:1] == pytest.approx([row @ q], rel=1e-9)
    assert found.static[-1] == pytest.approx(
        np.linalg.solve(K + 25.0 * np.outer(unit[4], unit[4]), 22.5 * unit[4])[4], rel=1e-9
    )


def test_a_mode_that_slips_from_its_first_amplitude_begins_by_few_solutions():
    """It is that of a branch from where everything sticks; a continuation to there took 154 evaluations more."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.01]], K=[[40.0]], dofs=["x"])
    damper = ss.FrictionContact(kt=10.0, mu=0.3, normal_load=10.0)
    pair = ss.ContactPair(name="damper", tangential="x", contact=damper)
    problem = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=1.0), harmonics=range(6))
    slipping = ss.nonlinear_modes(problem, amplitude=(2.0, 2.01)).dataset
    assert slipping.attrs["evaluations"] < 100
    whole = ss.nonlinear_modes(problem, amplitude=(0.1, 2.0)).dataset
    for name in ("omega", "modal_damping"):
        assert slipping[name].values[0] == pytest.approx(whole[name].values[-1], rel=1e-9)
