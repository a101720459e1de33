from __future__ import annotations

import numpy as np
import pytest
from helpers.problems import random_problem

import slipstick as ss
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def at(branch: ss.Branch, kind: str) -> list[tuple[float, float, float]]:
    """Parameter, frequency and amplitude of the points of a kind."""
    d = branch.dataset
    points = np.flatnonzero(d.kind.values == kind)
    return [(float(d.parameter[k]), float(d.omega[k]), float(d.amplitude[k, 0])) for k in points]


def test_the_locus_over_the_normal_load():
    """Against peaks of whole curves; fewer factorisations than one of these takes evaluations."""
    problem = oscillator()
    locus = ss.track_peak(problem, "damper.normal_load", (10.0, 1000.0), omega=(2.0, 15.0), at=(100.0, 400.0))
    assert locus.outcome is ss.Outcome.COMPLETED
    ((load, omega, amplitude),) = at(locus, "optimum")
    assert (load, omega, amplitude) == (
        pytest.approx(471.69623374, rel=1e-8), pytest.approx(9.50476392, rel=1e-8), pytest.approx(2.80373291, rel=1e-9)
    )  # fmt: skip
    curve = None
    for load, omega, amplitude in at(locus, "requested"):
        curve = ss.forced_response(problem.with_parameter("damper.normal_load", load), omega=(2.0, 15.0))
        assert max(curve.peaks("x"), key=lambda peak: peak[1]) == (
            pytest.approx(omega, rel=1e-8), pytest.approx(amplitude, rel=1e-9)
        )  # fmt: skip
    assert locus.dataset.attrs["factorisations"] <= curve.dataset.attrs["evaluations"]
    assert np.all(locus.dataset.peak_dof == 0)
    assert locus.dataset.residual.values.max() < 1e-9


def test_the_peak_over_the_velocity_ends_where_stick_vanishes():
    locus = ss.track_peak(oscillator(velocity=100.0), "damper.velocity", (100.0, 260.0), omega=(2.0, 15.0))
    d = locus.dataset
    assert float(d.omega[0]) == pytest.approx(6.1431408294, rel=1e-9)
    assert float(d.amplitude[0, 0]) == pytest.approx(18.2485689822, rel=1e-9)
    assert float(d.amplitude[-1, 0]) == pytest.approx(39.548250, rel=1e-7)
    assert d.attrs["factorisations"] < 134
    assert not at(locus, "optimum")  # a plateau has none


def test_a_fold_is_turned():
    """Beyond it the points are minima of the curve, until they sit on a change of state; then the peak goes on."""
    locus = ss.track_peak(oscillator(velocity=15.0), "damper.velocity", (15.0, 9.0), omega=(3.0, 6.0))
    d = locus.dataset
    (fold,) = at(locus, "turning point")
    assert fold == pytest.approx((9.50427, 4.26478, 4.65211), abs=1e-5)
    k = int(np.flatnonzero(d.kind.values == "turning point")[0])
    assert np.all(d.peak_dof.values[:k] == 0)
    assert d.peak_dof.values[k + 1] == -1
    assert float(d.parameter[k + 1]) > fold[0]
    assert "the peak and a minimum of the curve merge at 9.50427" in locus.message


def test_a_tie_is_located_and_passed():
    """Two extremes of the period are as large: that peak is gone beyond, and the curve rises to another."""
    locus = ss.track_peak(oscillator(velocity=20.0), "damper.velocity", (20.5, 30.0), omega=(6.0, 12.0))
    ((v, _, amplitude),) = at(locus, "tie")
    assert (v, amplitude) == (pytest.approx(21.2484, abs=1e-4), pytest.approx(4.62167, abs=1e-5))
    assert locus.outcome is ss.Outcome.TURNED_BACK
    assert "up to 6 rad/s there is no other" in locus.message
    whole = ss.track_peak(oscillator(), "damper.velocity", (0.0, 60.0), omega=(3.0, 12.0))
    assert at(whole, "tie")[-1] == pytest.approx((v, 7.29691, amplitude), rel=1e-5)
    assert whole.outcome is ss.Outcome.COMPLETED
    assert "the one at 4.80244 rad/s is followed on" in whole.message
    d = whole.dataset
    (peak,) = ss.forced_response(oscillator(velocity=60.0), omega=(3.0, 12.0)).peaks("x")
    assert peak == pytest.approx((float(d.omega[-1]), float(d.amplitude[-1, 0])), rel=1e-7)


@pytest.mark.parametrize("span", [(0.0, 5.0), (0.0, -5.0), (5.0, -5.0)])
def test_a_tie_by_symmetry_is_passed(span):
    """At rest both extremes peak at one frequency: the peak goes on as that of the other."""
    locus = ss.track_peak(oscillator(), "damper.velocity", span, omega=(7.0, 15.0))
    d = locus.dataset
    assert locus.outcome is ss.Outcome.COMPLETED
    assert float(d.parameter[-1]) == span[1]
    (peak,) = ss.forced_response(oscillator(velocity=5.0), omega=(7.0, 15.0)).peaks("x")
    assert (float(d.omega[-1]), float(d.amplitude[-1, 0])) == pytest.approx(peak, rel=1e-8)
    assert all(abs(v) < 1e-6 for v, _, _ in at(locus, "tie"))


@pytest.mark.parametrize("velocity", [0.0, 5.0])
def test_the_phase_of_a_load_only_shifts_the_motion(velocity):
    """The extreme is followed however far it moves in time: no ties, no optima."""
    locus = ss.track_peak(oscillator(velocity=velocity), "load.x.phase", (-4.0, 4.0), omega=(7.0, 15.0))
    assert locus.outcome is ss.Outcome.COMPLETED
    assert set(locus.dataset.kind.values.tolist()) == {"start", "regular", "end"}
    assert np.ptp(locus.dataset.amplitude.values) < 1e-9
    assert len(locus) < 60


def test_peaks_on_changes_of_state_are_bracketed():
    """A maximum with a corner: the slope of the amplitude jumps through zero where slip begins."""
    problem = oscillator(velocity=15.0)
    locus = ss.track_peak(problem, "damper.velocity", (12.0, 9.2), omega=(3.0, 6.0))
    corners = at(locus, "corner")
    assert corners
    for v, omega, amplitude in corners[:2]:
        beside = [omega * (1.0 + step) for step in (-1e-4, -1e-5, 1e-5, 1e-4)]
        curve = ss.forced_response(problem.with_parameter("damper.velocity", v), omega=(4.2, 4.35), at=[*beside, omega])
        size = [float(curve.dataset.amplitude[curve.at(w), 0]) for w in (*beside, omega)]
        assert size[-1] == pytest.approx(amplitude, rel=1e-9)
        assert max(size[:-1]) < size[-1]
        assert (size[-1] - size[1]) / (size[-1] - size[2]) > 5.0  # a corner: steeper on one side


def test_a_locus_may_begin_at_a_corner():
    locus = ss.track_peak(oscillator(velocity=9.4), "damper.velocity", (9.4, 9.35), omega=(3.0, 6.0))
    assert locus.outcome is ss.Outcome.COMPLETED
    assert set(locus.dataset.kind.values[1:-1]) == {"corner"}
    assert np.all(np.diff(locus.dataset.amplitude.values[:, 0]) < 0.0)


def test_requested_values_are_among_corners():
    """Steps from corner to corner do not lead past what is asked for."""
    asked = [9.36, 9.3712, 9.399]
    locus = ss.track_peak(oscillator(velocity=9.4), "damper.velocity", (9.4, 9.35), omega=(3.0, 6.0), at=asked)
    assert locus.outcome is ss.Outcome.COMPLETED
    assert set(asked) <= set(locus.dataset.parameter.values.tolist())
    assert not [text for text in locus.warnings if "requested" in text]


def test_a_peak_that_ends_is_told_where_another_is_followed_on():
    """On a change of state the peak is gone, by whole curves too; the next one is 1 % beside it, on another part."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.38]], K=[[40.0]], dofs=["x"])
    contact = ss.FrictionContact(kt=190.0, mu=0.355, normal_load=300.0)
    pair = ss.ContactPair(name="damper", tangential="x", contact=contact, rubbing=ss.RubbingMotion(velocity=4.0))
    problem = ss.Problem(structure, contacts=[pair], loads=ss.Load(dof="x", sin=100.0), harmonics=range(8))
    locus = ss.track_peak(problem, "damper.normal_load", (300.0, 250.0), omega=(2.0, 4.0))
    d = locus.dataset
    (end,) = np.flatnonzero(np.diff(d.branch_part.values))
    load, omega = float(d.parameter[end]), d.omega.values
    assert d.kind.values[end] == "corner"
    assert float(d.parameter[end + 1]) == pytest.approx(load, abs=1e-4)
    assert f"at {load:.6g} the peak ends" in locus.message
    assert f"the peak at {omega[end + 1]:.6g} rad/s is followed on" in locus.message
    for value, there in ((load + 2.0, True), (load - 0.05, False)):
        curve = ss.forced_response(problem.with_parameter("damper.normal_load", value), omega=(2.9, 3.0))
        own = curve.dataset.omega.values[curve.dataset.kind.values == "peak"]  # however little they stand out
        assert bool(np.abs(own - omega[end]).min() < 1e-4) is there
        assert np.abs(own - omega[end + 1]).min() < 2e-3


def test_a_neighbouring_peak_is_not_gone_over_to_in_silence():
    """The peak merges with a minimum, by whole curves too; the next one is 0.6 % beside it."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.984]], K=[[40.0]], dofs=["x"])
    rubbing = ss.RubbingMotion(velocity=70.0, cos={2: 0.43})
    contact = ss.FrictionContact(kt=95.6, mu=0.366, normal_load=102.0)
    pair = ss.ContactPair(name="damper", tangential="x", contact=contact, rubbing=rubbing)
    problem = ss.Problem(structure, contacts=[pair], loads=ss.Load(dof="x", sin=100.0), harmonics=range(8))
    locus = ss.track_peak(problem, "damper.velocity", (70.0, 90.0), omega=(6.2, 6.4))
    d = locus.dataset
    ((fold, omega, _),) = at(locus, "turning point")
    (end,) = np.flatnonzero(np.diff(d.branch_part.values))
    beyond, there = float(d.parameter[end + 1]), float(d.omega[end + 1])
    assert locus.outcome is ss.Outcome.COMPLETED
    assert f"the peak and a minimum of the curve merge at {fold:.6g}" in locus.message
    assert f"at {beyond:.6g} the peak at {there:.6g} rad/s is followed on" in locus.message
    for velocity, old in ((fold - 0.02, True), (beyond, False)):
        curve = ss.forced_response(problem.with_parameter("damper.velocity", velocity), omega=(6.29, 6.36))
        own = curve.dataset.omega.values[curve.dataset.kind.values == "peak"]  # however little they stand out
        assert bool(np.abs(own - omega).min() < 0.01) is old
        assert bool(np.abs(own - there).min() < 1e-6) is not old


def test_several_contacts_and_an_output_that_is_no_port():
    problem = random_problem(1)
    curve = ss.forced_response(problem, omega=(4.0, 12.0), peaks_of="d3")
    locus = ss.track_peak(problem, "friction", (1.0, 2.0), omega=(4.0, 12.0), dof="d3", at=(1.5,))
    d = locus.dataset.sel(dof="d3")
    highest = max(curve.peaks("d3"), key=lambda peak: peak[1])
    assert (float(d.omega[0]), float(d.amplitude[0])) == pytest.approx(highest, rel=1e-8)
    k = locus.at(1.5)
    other = ss.forced_response(problem.with_parameter("friction", 1.5), omega=(4.0, 12.0), peaks_of="d3")
    near = min(other.peaks("d3"), key=lambda peak: abs(peak[0] - float(d.omega[k])))
    assert near == (pytest.approx(float(d.omega[k]), rel=1e-7), pytest.approx(float(d.amplitude[k]), rel=1e-9))


def test_results_are_those_of_a_branch(tmp_path):
    locus = ss.track_peak(oscillator(), "damper.normal_load", (600.0, 700.0), omega=(8.0, 12.0))
    again = ss.load(locus.save(tmp_path / "locus.nc"))
    assert again.dataset.attrs["peak_of"] == "x"
    assert again.plot.response("x").get_xlabel() == "damper.normal_load [force]"
    assert float(again.sensitivity("damper.mu").amplitude[0, 0]) > 0.0


def test_no_peak_is_an_outcome():
    found = ss.track_peak(oscillator(), "damper.normal_load", (600.0, 700.0), omega=(2.0, 3.0))
    assert found.outcome is ss.Outcome.NO_FIRST_POINT
    assert found.message == "no peak of x was found from 2 to 3 rad/s at damper.normal_load = 600"
    assert len(found) == 0


def test_wrong_arguments_are_told_together():
    with pytest.raises(ss.InputError) as caught:
        ss.track_peak(oscillator(), "damper.mu", (0.1, -0.1), omega=(2.0, 2.0), dof="y")
    text = str(caught.value)
    assert "mu" in text
    assert "frequency range" in text
    assert "there is no output" in text


def test_another_peak_that_is_higher_is_told():
    """At optima and at the last point; against the peaks of whole curves there."""
    problem = oscillator(velocity=10.0)
    with pytest.warns(ss.SlipstickWarning, match="another peak of x is higher"):
        locus = ss.track_peak(problem, "damper.normal_load", (300.0, 100.0), omega=(2.0, 15.0))
    told = [said for said in locus.warnings if "another peak of x is higher than the one followed" in said]
    assert len(told) == 2
    for said, load in zip(told, (at(locus, "optimum")[0][0], 100.0), strict=True):
        there = ss.forced_response(oscillator(velocity=10.0, normal_load=load), omega=(2.0, 15.0)).peaks("x")
        omega, amplitude = max(there, key=lambda peak: peak[1])
        assert f"at damper.normal_load = {load:.6g} " in said
        assert f": {amplitude:.6g} at {omega:.6g} rad/s, against" in said
    assert locus.dataset.attrs["curves"] == 3  # at the start, the optimum and the end
    upper = ss.track_peak(problem, "damper.normal_load", (100.0, 200.0), omega=(2.0, 15.0))
    assert not any("is higher" in said for said in upper.warnings)
