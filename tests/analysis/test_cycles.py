"""Limit cycles and steady sliding as one branch: its parts, kinds and work; an interruption loses nothing."""

import numpy as np
import pytest
from helpers.stability import brake

import slipstick as ss
from slipstick.analysis import cycles


def test_parts_and_kinds():
    data = ss.limit_cycles(brake(), "pad.mu", (0.4, 0.6), requested=0.55).dataset
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
    whole, stop = cycles.Cycles._followed, iter([False] * 4 + [True])

    def interrupted(self, step, special):
        if next(stop):
            raise KeyboardInterrupt
        return whole(self, step, special)

    monkeypatch.setattr(cycles.Cycles, "_followed", interrupted)
    branch = ss.limit_cycles(brake(), "pad.mu", (0.4, 0.6))
    assert branch.outcome is ss.Outcome.INTERRUPTED
    assert int(np.sum(branch.dataset.branch_part.values == 1)) == 2 + 4
    assert int(np.sum(branch.dataset.branch_part.values == 2)) > 60


def test_hysteretic_damping_is_named():
    structure = ss.MatrixStructure(
        M=np.eye(2), C=0.45 * np.eye(2), K=[[100.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"], loss_factor=0.005
    )
    with pytest.warns(ss.SlipstickWarning, match="hysteretic damping has no meaning for disturbances that grow"):
        branch = ss.limit_cycles(brake(structure=structure), "pad.mu", (0.4, 0.6))
    assert branch.outcome.ok
    assert any("hysteretic" in sentence for sentence in branch.warnings)
