"""What listeners are told: one beginning, every point with its numbers, one end."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.events import Listener, PointFound, Searching, Started, Stopped, StrategyTried, Working
from slipstick.analysis.road import run as road
from slipstick.balance import start
from slipstick.errors import TimeIsUp
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


def problem(**given):
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    damper = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=700.0)
    contacts = ss.ContactPair(name="damper", tangential="x", contact=damper)
    return ss.Problem(
        structure, contacts=contacts, loads=ss.Load(dof="x", sin=100.0), harmonics=range(6), told=None, **given
    )


def brake():
    structure = ss.MatrixStructure(
        M=np.eye(2), C=0.5 * np.eye(2), K=[[100.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"]
    )  # fmt: skip
    pad = ss.FrictionContact(kt=200.0, mu=0.4, kn=40.0, gap=0.0)
    rubs = ss.RubbingMotion(velocity=1.0)
    pair = ss.ContactPair(name="brake", tangential="x", normal="y", contact=pad, rubbing=rubs)
    return ss.Problem(
        structure, contacts=pair, loads=ss.Load(dof="y", harmonic=0, cos=50.0), harmonics=range(4), told=None
    )


ANALYSES = {
    "track": lambda heard: ss.track_peak(
        problem(), "damper.normal_load", (600.0, 800.0), omega=(8.0, 12.0), listeners=heard
    ),
    "modes": lambda heard: ss.nonlinear_modes(problem(), amplitude=(3.0, 5.0), listeners=heard),
    "cycles": lambda heard: ss.limit_cycles(brake(), "brake.mu", (0.4, 0.56), listeners=heard),
}
FIRST = {
    "track": "looking for the highest peak at damper.normal_load = 600",
    "modes": "looking for the mode at the amplitude 3",
    "cycles": "steady sliding",
}


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("name", ANALYSES)
def test_every_analysis_says_what_it_does_and_each_point(name, monkeypatch):
    """What it does until a first point, then points one by one, with work between them."""
    monkeypatch.setattr(road, "_SILENCE", 0.0)
    told = []
    branch = ANALYSES[name](told.append)
    points = [i for i, event in enumerate(told) if isinstance(event, PointFound)]
    works = [i for i, event in enumerate(told) if isinstance(event, Working)]
    assert len(points) == len(branch)
    assert told[works[0]].text.startswith(FIRST[name])
    assert works[0] < points[0] < works[-1]
    assert any(told[i].doing == "" for i in works)
    evaluations = [told[i].evaluations for i in works]
    assert evaluations == sorted(evaluations)
    assert isinstance(told[-1], Stopped)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("name", ANALYSES)
def test_what_takes_too_long_is_ended_and_its_points_are_kept(name, monkeypatch):
    monkeypatch.setattr(road, "_SILENCE", 0.0)

    def first(event):
        if isinstance(event, Working):
            raise TimeIsUp

    def after_three(event):
        if isinstance(event, Working) and event.points == 3:
            raise TimeIsUp

    none, some = ANALYSES[name](first), ANALYSES[name](after_three)
    assert (none.outcome, len(none)) == (ss.Outcome.TIME_LIMIT, 0)
    assert some.outcome is ss.Outcome.TIME_LIMIT
    assert len(some) in (3, 4)  # the newest of a mode is kept until it is known whether it is the last
    assert np.isfinite(some.dataset.amplitude.values).all()


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_a_search_within_an_analysis_is_told_by_it(monkeypatch):
    """The curve on which the highest peak is sought belongs to the tracking: one beginning, one end."""
    monkeypatch.setattr(road, "_SILENCE", 0.0)
    told = []
    ss.optimal(problem(), "damper.normal_load", omega=(8.0, 12.0), start=500.0, listeners=told.append)
    kinds = [type(event) for event in told]
    assert kinds.count(Started) == kinds.count(Stopped) == 1
    doing = list(dict.fromkeys(event.doing for event in told if isinstance(event, Working)))
    assert doing[0] == "looking for the highest peak at damper.normal_load = 500"
    assert "going to the optimum" in doing


def test_a_fit_tells_its_evaluations():
    measured = ss.steady_response(problem(), omega=[8.0, 9.0, 10.0]).dataset
    told = []
    fit = ss.identify(problem(), measured, {"damper.kt": 90.0}, listeners=told.append)
    assert [event.evaluations for event in told] == list(range(1, fit.evaluations + 1))
    assert told[0].doing == "fitting from start 1 of 1"


def test_stages_of_a_reduction_are_told():
    told = []
    K = np.diag(np.arange(2.0, 42.0)) - 0.4 * (np.eye(40, k=1) + np.eye(40, k=-1))

    class Stages(Listener):
        def stage(self, event):
            told.append(event.stage)

    ss.reduce(K, np.eye(40), keep=["0"], dofs=[str(i) for i in range(40)], modes=4, listener=Stages())
    assert "static solutions" in told
