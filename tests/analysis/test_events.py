"""What listeners are told: one beginning, every point with its numbers, one end."""

import slipstick as ss
from slipstick.analysis.events import Listener, PointFound, Searching, Started, Stopped, StrategyTried
from slipstick.balance import start
from slipstick.verify.cases import oscillator


def test_a_curve_is_told_from_its_beginning_to_its_end():
    told = []
    branch = ss.forced_response(oscillator(velocity=10.0), omega=(4.0, 6.0), listeners=told.append)
    assert isinstance(told[0], Started)
    assert isinstance(told[-1], Stopped)
    assert [type(event) for event in told].count(Started) == [type(event) for event in told].count(Stopped) == 1
    assert any(isinstance(event, StrategyTried) and event.found for event in told)
    points = [event for event in told if isinstance(event, PointFound)]
    assert [event.number for event in points] == list(range(1, len(points) + 1))
    assert [event.omega for event in points] == branch.dataset["omega"].values.tolist()
    assert [event.kind for event in points] == branch.dataset["kind"].values.tolist()
    assert points[-1].progress == 1.0
    assert all(event.parameter == event.omega for event in points)
    last = points[-1].values
    for name in ("amplitude", "dissipated_power", "displacement"):
        assert (last[name] == branch.dataset[name].to_numpy()[-1]).all()
    end = told[-1]
    assert (end.outcome, end.points) == (branch.outcome, len(points))
    assert end.attributes["outcome"] == branch.dataset.attrs["outcome"]


def test_a_listener_overrides_the_methods_it_wants():
    class Counter(Listener):
        def __init__(self):
            self.points, self.end = 0, None

        def point_found(self, event):
            self.points += 1

        def stopped(self, event):
            self.end = event

    counter = Counter()
    branch = ss.forced_response(oscillator(velocity=10.0), omega=(4.0, 6.0), listeners=counter)
    assert counter.points == len(branch) == counter.end.points


def test_a_listener_is_told_of_a_long_search_for_the_first_point(monkeypatch):
    class Searches(Listener):
        def __init__(self):
            self.seen = []

        def searching(self, event):
            self.seen.append(event)

    monkeypatch.setattr(start, "_PAUSE", 0.0)
    searches = Searches()
    ss.forced_response(oscillator(velocity=10.0), omega=(4.0, 6.0), listeners=searches)
    assert searches.seen
    assert all(isinstance(event, Searching) and event.omega == 4.0 for event in searches.seen)
    assert searches.seen[0].parts[0].startswith("from the linear response")
