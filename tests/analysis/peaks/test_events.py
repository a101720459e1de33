"""Peaks as events: where the amplitude's derivative along the branch falls through zero, and nowhere on a plateau."""

from dataclasses import replace

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.curve.follow import frequency_request
from slipstick.analysis.events import PointFound
from slipstick.analysis.road.checkpoint import resumable
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


def chain(n):
    """Masses in a row, one of them rubbed; light damping."""
    K = 40.0 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    names = [f"d{i}" for i in range(n)]
    structure = ss.MatrixStructure(M=np.eye(n), C=0.002 * K + 0.01 * np.eye(n), K=K, dofs=names)
    pair = ss.ContactPair(name="c", tangential="d1", contact=ss.FrictionContact(kt=30.0, mu=0.3, normal_load=2.0))
    problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="d0", sin=1.0)], harmonics=range(6))
    return problem, (0.5 * np.sqrt(np.linalg.eigvalsh(K)[0]), 4.0)


def test_the_largest_of_many_outputs_is_among_the_points():
    problem, span = chain(6)
    branch = ss.forced_response(problem, omega=span)
    assert branch.dataset.attrs["peaks_of"] == "d0"
    assert branch.dataset.attrs["largest_of"].split("\n") == ["d1", "d2", "d3", "d4", "d5"]
    assert branch.sought("peaks_of").tolist() == [True, *[False] * 5]
    for name in problem.outputs:
        top = max(size for _, size in ss.forced_response(problem, omega=span, peaks_of=name).peaks(name))
        assert float(branch.dataset.amplitude.sel(dof=name).max()) == pytest.approx(top, rel=2e-6)
    with pytest.warns(ss.SlipstickWarning, match="the peaks of 'd3' were not sought"):
        assert branch.peaks("d3") == []


def test_a_study_says_what_was_not_sought():
    problem, span = chain(6)
    curve = {"omega": span, "workers": 1}
    all_of_them = ss.study(problem, {"c.mu": [0.3]}, **curve).isel({"c.mu": 0})
    one = ss.study(problem, {"c.mu": [0.3]}, peaks_of="d2", **curve).isel({"c.mu": 0})
    assert np.all(all_of_them.peak_located.values == 1)
    top = ss.forced_response(problem, omega=span, peaks_of="d5").peaks("d5")
    assert float(all_of_them.peak_amplitude.sel(dof="d5")) == pytest.approx(max(a for _, a in top), rel=2e-6)
    sought = one.dof.values == "d2"
    assert np.all(np.isnan(one.peak_amplitude.values) == ~sought)
    assert np.all((one.peak_located.values == -1) == ~sought)


def test_many_outputs_are_taken_up_where_a_run_stood():
    """The largest values so far are among what a checkpoint keeps: the points to come are the same."""
    problem, span = chain(6)
    request = frequency_request(problem, span)
    marks = []
    whole = list(replace(request, listeners=(marks.append,)).run().follow())
    stood = [event.checkpoint for event in marks if isinstance(event, PointFound)]
    n = resumable(stood[: len(stood) // 2])
    again = frequency_request(problem, span)
    rest = list(replace(again, checkpoints=stood[:n]).run().follow())
    assert [p.omega for p in rest] == [p.omega for p in whole[n:]]
