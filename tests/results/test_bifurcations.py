"""Bifurcations read from results alone."""

import numpy as np
import pytest
from helpers.stability import flutter

import slipstick as ss


@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
def test_a_stored_branch_has_the_same_bifurcations(tmp_path) -> None:
    branch = ss.parameter_response(flutter(), "load.y.1.amplitude", (47.0, 45.0), omega=6.0, stability=True)
    again = ss.load(branch.save(tmp_path / "r.nc"))
    assert [(f.kind, f.value, f.multiplier) for f in again.bifurcations()] == [
        (f.kind, f.value, f.multiplier) for f in branch.bifurcations()
    ]
    (found,) = again.bifurcations()
    assert found.omega == 6.0
    assert np.isnan(found.second_omega)
    assert str(again.dataset.kind.values[found.point]) == "period doubling"
