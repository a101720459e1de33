"""Limit cycles and steady sliding as one branch: its parts, kinds and work; an interruption loses nothing."""

import numpy as np
import pytest
from helpers.stability import brake

import slipstick as ss
from slipstick.analysis.self_excited.limit_cycles import SelfExcitedRun


def test_parts_and_kinds():
    data = ss.limit_cycles(brake(), "pad.mu", (0.4, 0.6), at=0.55).dataset
    part, kind = data.branch_part.values, data.kind.values
    assert list(part) == sorted(part)
    for k, first in ((1, ["start", "state change"]), (2, ["start"])):
        own = kind[part == k].tolist()
        assert own[: len(first)] == first
        assert own[-1] == "end"
        assert own.count("requested") == 1
    assert kind[part == 2].tolist().count("Hopf") == 1
    assert data.residual.values.max() < 1e-9
    assert data.attrs["vibration"] == "self-excited"
    assert data.attrs["evaluations"] > 0
    assert set(data.stability_method.values[part == 2]) == {"eigenvalues"}


def test_an_interruption_loses_nothing(monkeypatch):
    whole, stop = SelfExcitedRun._followed, iter([False] * 4 + [True])

    def interrupted(self, step, special):
        if next(stop):
            raise KeyboardInterrupt
        return whole(self, step, special)

    monkeypatch.setattr(SelfExcitedRun, "_followed", interrupted)
    branch = ss.limit_cycles(brake(), "pad.mu", (0.4, 0.6))
    assert branch.outcome is ss.Outcome.INTERRUPTED
    assert int(np.sum(branch.dataset.branch_part.values == 1)) == 2 + 4
    assert int(np.sum(branch.dataset.branch_part.values == 2)) > 60


def test_hysteretic_damping_is_named():
    structure = ss.MatrixStructure(
        M=np.eye(2), C=0.45 * np.eye(2), K=[[100.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"], loss_factor=0.005
    )
    with pytest.warns(ss.SlipstickWarning, match="hysteretic damping"):
        branch = ss.limit_cycles(brake(structure=structure), "pad.mu", (0.4, 0.6))
    assert branch.outcome.ok
    hopf = branch.bifurcations()[-1]
    said = f"viscous damping, equal to it at {hopf.omega:.6g} rad/s"
    assert any(said in sentence for sentence in branch.warnings)
    # as viscous as that there is no difference at the Hopf point, and little at cycles of nearly its frequency
    C = 0.45 * np.eye(2) + 0.005 / hopf.omega * structure.K
    viscous = ss.MatrixStructure(M=np.eye(2), C=C, K=structure.K, dofs=["x", "y"])
    other = ss.limit_cycles(brake(structure=viscous), "pad.mu", (0.4, 0.6))
    assert other.bifurcations()[-1].value == pytest.approx(hopf.value, rel=1e-10)
    ends = [b.dataset.isel(point=np.flatnonzero(b.dataset.branch_part.values == 1)[-1]) for b in (branch, other)]
    assert float(ends[0].omega) == pytest.approx(float(ends[1].omega), rel=1e-4)
    assert float(ends[0].multiplier_max) == pytest.approx(float(ends[1].multiplier_max), rel=1e-3)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_two_hopf_points_are_told_where_equations_in_time_leave_something_out():
    """Two of three modes with static and second residual: the balance knows more of the third than eigenvalues do."""
    K = np.array([[100.0, -20.0, 0.0], [-20.0, 62.8, -50.0], [0.0, -50.0, 900.0]])
    squared, shapes = np.linalg.eigh(K)
    dofs, beyond = ["x", "y", "z"], shapes[:, 2:]
    whole = ss.MatrixStructure(M=np.eye(3), C=0.5 * shapes[:, :2] @ shapes[:, :2].T, K=K, dofs=dofs)
    modal = ss.ModalStructure(
        omega=np.sqrt(squared[:2]), mode_shapes=shapes[:, :2], static_compliance=np.linalg.inv(K), dofs=dofs,
        damping_ratio=0.25 / np.sqrt(squared[:2]), second_residual=beyond / squared[2:] ** 2 @ beyond.T,
    )  # fmt: skip
    exact, found = (
        ss.limit_cycles(brake(structure=s, harmonics=4), "pad.mu", (0.4, 0.8), options={"max_points": 2})
        for s in (whole, modal)
    )
    begins = float(found.dataset.parameter[0])
    hopf, true = (branch.bifurcations()[-1].value for branch in (found, exact))
    assert f"Hopf point at {begins:.6g} (pad.mu), by eigenvalues at {hopf:.6g}" in found.message
    assert "eigenvalues" not in exact.message
    # what is still left out is smaller by the square of the frequency over that of the third mode
    assert (begins - true) / (hopf - true) == pytest.approx(100.0 / squared[2], rel=0.02)
