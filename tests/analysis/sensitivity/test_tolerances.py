from __future__ import annotations

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.figures import branch

import slipstick as ss
from slipstick.analysis.sensitivity.tolerances import amplitude_band, checked_tolerances, ranked_bars


def test_a_band_holds_what_small_tolerances_do():
    """Against curves computed with the parameters at their ends, at the same frequencies."""
    own, shares = branch(), {"c0.mu": 1e-3, "load.x0.amplitude": 1e-3}
    found = amplitude_band(own, "x0", shares)
    solved = np.flatnonzero(own.dataset.kind.values != "interpolated")[1:-1:6]
    omega = own.dataset.omega.values[solved]
    least, most = np.full(omega.size, np.inf), np.zeros(omega.size)
    for mu in (-1e-3, 1e-3):
        for load in (-1e-3, 1e-3):
            problem = own.problem.with_parameter("c0.mu", 0.3 * (1 + mu)).with_parameter("load", 1 + load)
            other = ss.forced_response(problem, omega=(5.0, 8.0), at=omega)
            size = np.array([float(other.dataset.amplitude.sel(dof="x0")[other.at(w)]) for w in omega])
            least, most = np.minimum(least, size), np.maximum(most, size)
    assert found.low[solved] == pytest.approx(least, rel=2e-5)
    assert found.high[solved] == pytest.approx(most, rel=2e-5)


def test_bars_are_ranked():
    found = ranked_bars(branch(), "x0", 10)
    assert found[0].share == 0.1
    assert "c0.velocity" not in {bar.name for bar in found}
    assert np.all(np.diff([abs(bar.change) for bar in found]) <= 0.0)


def test_shares_are_checked():
    problem = branch().problem
    assert checked_tolerances(problem, {"c0.mu": 0.2}) == {"c0.mu": 0.2}
    with raises_fault("tolerances", found="0.1"):
        checked_tolerances(problem, 0.1)
