"""Steady sliding and its Hopf points against closed forms."""

import numpy as np
import pytest
from helpers.stability import brake

import slipstick as ss


@pytest.mark.parametrize("damping", [0.25, 0.5, 1.0])
def test_the_hopf_point_has_a_closed_form(damping):
    """K + friction has eigenvalues k +- i b, b^2 = 20 (40 mu - 20); at the Hopf point w^2 = k = 100, b = c w."""
    mu = (100.0 * damping**2 / 20.0 + 20.0) / 40.0
    branch = ss.limit_cycles(brake(damping=damping), "pad.mu", (0.4, 0.7), options={"max_points": 2})
    (hopf,) = (b for b in branch.bifurcations() if b.kind == "Hopf")
    assert (hopf.value, hopf.omega) == (pytest.approx(mu, rel=1e-12), pytest.approx(10.0, rel=1e-12))
    assert (hopf.before, hopf.after) == (0, 2)
    rise = branch.dataset.isel(point=branch.dataset.branch_part.values == 1)
    assert rise.parameter.values[:2] == pytest.approx(mu, rel=1e-12)
    assert rise.amplitude.values[0].max() == 0.0
    assert rise.residual.values.max() < 1e-9


def test_steady_sliding_is_at_rest_and_told_by_eigenvalues():
    squeal = ss.limit_cycles(brake(), "pad.mu", (0.4, 0.8), options={"max_points": 2})
    data = squeal.dataset.isel(point=squeal.dataset.branch_part.values == 2)
    mu = data.parameter.values
    assert np.all(np.diff(mu) > 0)
    # K x = p - f with f_y = 40 y, f_x = mu f_y
    K = np.array([[[100.0, 40.0 * m - 20.0], [-20.0, 100.0]] for m in mu])
    rest = np.linalg.solve(K, np.tile([[0.0], [50.0]], (mu.size, 1, 1)))[:, :, 0]
    np.testing.assert_allclose(data["mean"].values, rest, rtol=1e-9, atol=1e-15)
    assert data.amplitude.values.max() == 0.0
    grows = np.array([_growth(k) for k in K])
    exact = np.abs(data.kind.values == "Hopf")
    assert np.array_equal(data.stable.values[~exact] == 0, grows[~exact] > 0)
    largest = np.exp(grows * 2 * np.pi / data.omega.values)
    np.testing.assert_allclose(data.multiplier_max.values, largest, rtol=1e-6)


def _growth(K):
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -0.5 * np.eye(2)]])
    return np.linalg.eigvals(A).real.max()


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_without_damping_the_frequencies_meet_at_the_hopf_point():
    """Below, nothing decays but by rounding: K + friction has a double eigenvalue where 40 mu = 20."""
    branch = ss.limit_cycles(brake(damping=0.0), "pad.mu", (0.4, 0.8), options={"max_points": 2})
    (hopf,) = (b for b in branch.bifurcations() if b.kind == "Hopf")
    assert (hopf.value, hopf.omega) == (pytest.approx(0.5, rel=1e-7), pytest.approx(10.0, rel=1e-6))
