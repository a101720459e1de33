from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.resumption import Heard

import slipstick as ss
from slipstick.analysis.peaks import optimum
from slipstick.analysis.peaks.optimum import optimum_request
from slipstick.analysis.road import run as road
from slipstick.io.journal import unpacked
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


@pytest.mark.parametrize("start", [300.0, 500.0])
def test_the_best_normal_load_in_under_ten_factorisations(start):
    best = ss.optimal(oscillator(), "damper.normal_load", omega=(2.0, 15.0), start=start)
    assert best.outcome is ss.Outcome.COMPLETED
    assert best.value == pytest.approx(471.69623374, rel=1e-9)
    assert best.omega == pytest.approx(9.50476392, rel=1e-8)
    assert best.amplitude == pytest.approx(2.80373291, rel=1e-8)
    assert (best.kind, best.parameter, best.dof) == ("lowest", "damper.normal_load", "x")
    assert best.factorisations < 10
    assert best.hessian[0, 1] == pytest.approx(best.hessian[1, 0], rel=1e-8)


def test_far_away_the_peak_is_tracked_first():
    best = ss.optimal(oscillator(), "damper.normal_load", omega=(2.0, 15.0), start=5000.0)
    assert best.value == pytest.approx(471.69623374, rel=1e-8)


def test_by_another_name_it_is_the_same_damper():
    best = ss.optimal(oscillator(), "damper.mu", omega=(2.0, 15.0))
    assert best.value == pytest.approx(0.3 * 471.69623374 / 800.0, rel=1e-8)


def test_the_point_holds_everything(tmp_path):
    best = ss.optimal(oscillator(), "damper.normal_load", omega=(2.0, 15.0), start=500.0)
    d = best.branch.dataset
    assert d.kind.values.tolist() == ["optimum"]
    assert float(d.parameter[0]) == best.value
    assert best.branch.problem_at(0).parameter("damper.normal_load") == pytest.approx(best.value)
    slopes = best.branch.sensitivity("damper.normal_load")
    assert float(slopes.amplitude[0, 0]) == pytest.approx(0.0, abs=1e-12)
    assert len(ss.load(best.branch.save(tmp_path / "best.nc"))) == 1


def test_curvature_is_that_of_peaks_nearby():
    best = ss.optimal(oscillator(), "damper.normal_load", omega=(2.0, 15.0), start=500.0)
    peaks = []
    for step in (-1.0, 0.0, 1.0):
        problem = oscillator(normal_load=best.value + step)
        peaks.append(max(a for _, a in ss.forced_response(problem, omega=(9.0, 10.0)).peaks("x")))
    H = best.hessian
    assert np.linalg.det(H) / H[0, 0] == pytest.approx(peaks[0] - 2 * peaks[1] + peaks[2], rel=1e-3)


def test_none_is_an_outcome():
    """The peak at full slip does not depend on the stiffness: nothing is lowest."""
    found = ss.optimal(oscillator(), "damper.normal_load", omega=(2.0, 3.0))
    assert found.outcome is ss.Outcome.NO_FIRST_POINT
    assert np.isnan(found.value)
    found = ss.optimal(oscillator(), "load.x.amplitude", omega=(2.0, 15.0))
    assert (found.outcome, found.kind) == (ss.Outcome.NO_OPTIMUM, "")
    assert found.message.startswith("no optimum of load.x.amplitude was found from 100 to 3.33333: the highest peak is")
    assert "completed" not in found.message


def highest(problem, omega=(2.0, 15.0)):
    return max(a for _, a in ss.forced_response(problem, omega=omega).peaks("x"))


@pytest.mark.parametrize("start", [100.0, 300.0, 800.0])
def test_the_highest_peak_is_meant_whichever_it_is(start):
    """Of two peaks the lower has a minimum at 465 and a maximum at 231: neither is one of the highest peak, which falls
    to a plateau, where the friction force never slips back and its vibration does not depend on the normal load."""
    found = ss.optimal(oscillator(velocity=10.0), "damper.normal_load", omega=(2.0, 15.0), start=start)
    assert (found.outcome, found.kind) == (ss.Outcome.NO_OPTIMUM, "")
    assert np.isnan(found.value)
    loads = (20.0, 100.0, 231.0, 300.0, 465.0, 800.0, 3000.0)
    heights = [highest(oscillator(velocity=10.0, normal_load=load)) for load in loads]
    assert heights[:4] == sorted(heights[:4], reverse=True)
    np.testing.assert_allclose(heights[4:], heights[-1], rtol=1e-6)
    assert f"{heights[-1]:.6g} at" in found.message  # the plateau is told
    assert "completed" not in found.message


def absorber(kt: float) -> ss.Problem:
    """A mass with a tuned absorber, whose spring is a contact that sticks; two peaks."""
    C = [[0.13, -0.03], [-0.03, 0.03]]
    structure = ss.MatrixStructure(M=np.diag([1.0, 0.05]), C=C, K=np.diag([40.0, 1e-6]), dofs=["x", "y"])
    law = ss.FrictionContact(kt=kt, mu=1.0, normal_load=1e6)
    pair = ss.ContactPair(name="spring", tangential={"x": 1.0, "y": -1.0}, contact=law)
    return ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=10.0), harmonics=range(3))


def absorbed(kt: float) -> tuple[float, float]:
    """Heights of both peaks, from the matrices."""
    w = np.linspace(4.0, 10.0, 60_001)
    a, d = 40.0 + kt - w**2 + 0.13j * w, kt + 1e-6 - 0.05 * w**2 + 0.03j * w
    height = np.abs(10.0 * d / (a * d - (kt + 0.03j * w) ** 2))
    tops = height[1:-1][(height[1:-1] > height[:-2]) & (height[1:-1] > height[2:])]
    return tuple(tops)


@pytest.mark.parametrize("start", [1.2, 2.5])
def test_an_optimum_of_two_peaks_that_are_equally_high(start):
    """The stiffness of an absorber is best where one peak falls and the other rises."""
    best = ss.optimal(absorber(2.0), "spring.kt", omega=(4.0, 10.0), dof="x", start=start)
    assert (best.outcome, best.kind) == (ss.Outcome.COMPLETED, "lowest")
    low, high = absorbed(best.value)
    assert low == pytest.approx(high, rel=1e-6)
    assert best.amplitude == pytest.approx(low, rel=1e-6)
    assert max(absorbed(0.99 * best.value)) > 1.001 * low
    assert max(absorbed(1.01 * best.value)) > 1.001 * low
    assert "two peaks are equally high there, at 5.52872 and 6.91276 rad/s" in best.message
    assert best.branch.dataset.attrs["outcome_text"] == best.message
    assert not any("higher than the one followed" in said for said in best.branch.warnings)


def test_an_optimum_of_two_peaks_is_taken_up_again():
    request = optimum_request(absorber(2.0), "spring.kt", 1.7, (4.0, 10.0), "x", beside=1.2)
    whole = Heard(request)
    stood = [request.checkpoint(unpacked(note)) for note in whole.notes]
    cut = len(stood) // 2
    rest = Heard(replace(request, checkpoints=stood[:cut]))
    assert rest.points == whole.points[cut:]
    assert rest.end == whole.end
    assert "two peaks are equally high there" in rest.end["outcome_text"]


def test_a_plateau_without_end_is_told():
    found = ss.optimal(oscillator(velocity=250.0), "damper.normal_load", omega=(2.0, 15.0))
    assert (found.outcome, found.kind) == (ss.Outcome.NO_OPTIMUM, "")
    assert found.message.startswith("the peak does not depend on damper.normal_load at 800; no optimum of")
    assert "from 800 to 26.6667" in found.message
    assert "from 800 to 24000" in found.message


def test_a_start_of_zero_is_refused():
    with raises_fault("start", says="damper.velocity is 0"):
        ss.optimal(oscillator(), "damper.velocity", omega=(2.0, 15.0))


def beside(**more):
    return optimum_request(oscillator(), "damper.normal_load", 500.0, (2.0, 15.0), "x", beside=1.5, **more)


def test_beside_it_the_peak_is_followed():
    branch = ss.Branch.of(beside().solutions())
    locus = ss.track_peak(oscillator(), "damper.normal_load", (471.69623374 / 1.5, 471.69623374 * 1.5), omega=(2, 15.0))
    assert branch.dataset.attrs["optimum"] == pytest.approx(471.69623374, rel=1e-9)
    assert branch.dataset.sizes["point"] == locus.dataset.sizes["point"]
    np.testing.assert_allclose(branch.dataset.amplitude, locus.dataset.amplitude, rtol=1e-8)


def test_where_the_peak_beside_it_is_lost_the_optimum_comes_last(monkeypatch):
    monkeypatch.setattr(optimum, "_SAME_OPTIMUM", -1.0)
    branch = ss.Branch.of(beside().solutions())
    d = branch.dataset
    assert (branch.outcome, str(d.kind.values[-1])) == (ss.Outcome.COMPLETED, "optimum")
    assert float(d.parameter[-1]) == pytest.approx(471.69623374, rel=1e-9)
    assert int(d.branch_part[-1]) == int(d.branch_part[-2]) + 1
    assert "the peak beside it: " in branch.message


def test_an_optimum_is_kept_where_the_time_is_up_before_another_point(monkeypatch):
    monkeypatch.setattr(road, "_SILENCE", 0.0)

    def late(event):
        if "normal_load = 314" in getattr(event, "doing", ""):
            raise ss.errors.TimeIsUp

    branch = ss.Branch.of(beside(listeners=late).solutions())
    assert (branch.outcome, branch.dataset.kind.values.tolist()) == (ss.Outcome.TIME_LIMIT, ["optimum"])
