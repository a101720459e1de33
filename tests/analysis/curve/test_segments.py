"""Branches that break off are followed from the other end too: joined, told, stored, drawn."""

import numpy as np
import pytest
from helpers.oscillator import opening
from helpers.results import corrected

import slipstick as ss
from slipstick.analysis.curve.segments import Segment, joined
from slipstick.errors import Outcome
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


@pytest.fixture(scope="module")
def turned():
    return ss.forced_response(opening(), omega=(2.0, 15.0))


def test_a_branch_that_turns_back_is_joined_from_the_other_end(turned):
    d = turned.dataset
    assert turned.outcome is Outcome.COMPLETED
    text = d.attrs["outcome_text"]
    assert "two parts" in text
    assert "turned back" in text
    assert "from 15 to 2" in text
    first, second = (d.omega.values[d.branch_part.values == k] for k in (1, 2))
    assert first[0] == 2.0
    assert first[-1] == 2.0
    assert second[0] == 15.0
    assert second[-1] == 2.0
    assert str(d.kind.values[d.branch_part.values == 2][0]) == "start"
    assert float(corrected(d).residual.max()) < 1e-8


def test_no_line_is_drawn_between_parts(turned):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    line = turned.plot.response("x").lines[0]
    x = line.get_xdata()
    (gap,) = np.flatnonzero(np.isnan(x))
    assert gap == int((turned.dataset.branch_part.values == 1).sum())
    assert x[gap - 1] == 2.0
    assert x[gap + 1] == 15.0


def test_listeners_hear_of_all_points_once():
    events = []
    branch = ss.forced_response(opening(), omega=(2.0, 15.0), listeners=[events.append])
    found = [e for e in events if type(e).__name__ == "PointFound"]
    assert [e.number for e in found] == list(range(1, len(branch) + 1))
    assert all(0.0 <= e.progress <= 1.0 for e in found)
    assert events[-1].points == len(branch)


def test_a_velocity_goes_on_beyond_the_jump_at_zero():
    """At v = 0 the mean force of a contact that sticks part of the period jumps from one bound to the other."""
    branch = ss.parameter_response(oscillator(velocity=10.0), "damper.velocity", (-10.0, 20.0), omega=6.0)
    d = branch.dataset
    assert branch.outcome is Outcome.COMPLETED
    assert "end on the two sides of" in d.attrs["outcome_text"]
    v, mean = d.parameter.values, d["mean"].values[:, 0]
    assert v.min() == -10.0
    assert v.max() == 20.0
    assert np.max(np.diff(np.sort(v))) < 0.5  # 1/120 of the range: no gap
    left, right = (mean[np.argmin(np.where(side, np.abs(v), np.inf))] for side in (v < 0, v > 0))
    assert left == pytest.approx(-right, rel=1e-4)
    assert abs(right) > 0.1


def test_the_sides_of_the_jump_mirror_each_other():
    """v -> -v with the load half a period later turns the motion round: amplitudes are even, means odd in v."""
    branch = ss.parameter_response(
        oscillator(velocity=10.0), "damper.velocity", (-10.0, 10.0), omega=6.0, at=(-4.0, 4.0)
    )
    d = branch.dataset
    at = [branch.at(v) for v in (-4.0, 4.0)]
    assert list(d.kind.values[at]) == ["requested", "requested"]
    assert d.amplitude.values[at[0], 0] == pytest.approx(d.amplitude.values[at[1], 0], rel=1e-8)
    assert d["mean"].values[at[0], 0] == pytest.approx(-d["mean"].values[at[1], 0], rel=1e-8)


def part(number, start, stop, values, outcome):
    made = Segment(number=number, start=start, stop=stop)
    for value in values:
        made.add(value, np.array([value, 1.0]))
    made.outcome = outcome
    return made


def test_a_gap_keeps_the_fault_and_is_named():
    first = part(1, 2.0, 15.0, [2.0, 5.0, 2.0], Outcome.TURNED_BACK)
    second = part(2, 15.0, 2.0, [15.0, 9.0, 15.0], Outcome.TURNED_BACK)
    outcome, text = joined([first, second])
    assert outcome is Outcome.TURNED_BACK
    assert "between 5 and 9 nothing was found" in text


@pytest.mark.parametrize(
    ("start", "stop", "ends", "covered"),
    [
        (2.0, 1e12, (87.0, 16300.0), False),  # 1.6e-8 of the range, and many resonances
        (2.0, 15.0, (5.0, 5.0 + 1e-6), True),
        (-1.0, 1.0, (-1e-9, 1e-9), True),  # the jump at a velocity of zero
        (0.0, 1.0, (1e-12, 1e-8), True),
    ],
)
def test_a_gap_is_judged_by_the_value_there_too(start, stop, ends, covered):
    first = part(1, start, stop, [start, ends[0]], Outcome.STEP_TOO_SMALL)
    second = part(2, stop, start, [stop, ends[1]], Outcome.STEP_TOO_SMALL)
    assert joined([first, second])[0] is (Outcome.COMPLETED if covered else Outcome.STEP_TOO_SMALL)


def test_nothing_from_either_end():
    first, second = part(1, 2.0, 15.0, [], Outcome.NO_FIRST_POINT), part(2, 15.0, 2.0, [], Outcome.NO_FIRST_POINT)
    outcome, text = joined([first, second])
    assert outcome is Outcome.NO_FIRST_POINT
    assert "from the other end, from 15 no first point was found" in text


def test_a_range_followed_from_its_other_end_alone_is_complete():
    first, second = part(1, 2.0, 15.0, [], Outcome.NO_FIRST_POINT), part(2, 15.0, 2.0, [15.0, 2.0], Outcome.COMPLETED)
    outcome, text = joined([first, second])
    assert outcome is Outcome.COMPLETED
    assert "from 2 no first point was found" in text


def test_parts_that_meet_say_where():
    first = part(1, 2.0, 15.0, [2.0, 5.0], Outcome.STEP_TOO_SMALL)
    second = part(2, 15.0, 2.0, [15.0, 5.0], Outcome.COMPLETED)
    assert second.reaches(*first.last)
    second.met = True
    outcome, text = joined([first, second])
    assert outcome is Outcome.COMPLETED
    assert "meet at 5" in text
