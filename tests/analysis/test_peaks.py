"""Peaks as events: where the amplitude's derivative along the branch falls through zero, and nowhere on a plateau."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.verify.cases import oscillator


@pytest.mark.parametrize("velocity", [0.0, 10.0, 1000.0])
def test_a_peak_is_the_largest_amplitude_next_to_it(velocity):
    problem = oscillator(velocity=velocity)
    d = ss.forced_response(problem, omega=(2.0, 15.0)).dataset
    peaks = np.flatnonzero(d["kind"].to_numpy() == "peak")
    assert len(peaks) >= 1
    for peak in peaks:
        omega, size = float(d["omega"][peak]), float(d["amplitude"][peak, 0])
        near = ss.forced_response(problem, omega=(omega - 0.01, omega + 0.01), peaks_of=[]).dataset
        assert float(near["amplitude"].max()) <= size * (1 + 1e-9)
        assert float(near["amplitude"].max()) > size * (1 - 1e-3)


def test_linear_peak_by_closed_form():
    """Fast rubbing leaves the linear oscillator: its largest amplitude is at k/m - c^2/2m^2."""
    d = ss.forced_response(oscillator(velocity=1e5), omega=(2.0, 15.0)).dataset
    peak = d.isel(point=np.flatnonzero(d["kind"].to_numpy() == "peak")[0])
    omega = np.sqrt(40.0 - 0.4**2 / 2)
    assert float(peak["omega"]) == pytest.approx(omega, rel=1e-6)
    assert float(peak["amplitude"][0]) == pytest.approx(100.0 / abs(40.0 - omega**2 + 0.4j * omega), rel=1e-7)


def test_peaks_are_looked_for_where_asked():
    d = ss.forced_response(oscillator(velocity=10.0), omega=(2.0, 15.0), peaks_of=[]).dataset
    assert "peak" not in d["kind"].to_numpy()
