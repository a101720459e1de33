"""The road of every analysis: a run adds its points alone; sinks, warnings, interrupts and faults are the road's."""

import os
import signal
import tracemalloc
from dataclasses import dataclass, replace

import numpy as np
import pytest
from threadpoolctl import threadpool_info

import slipstick as ss
from slipstick.analysis.curve.follow import CurveRequest, frequency_request
from slipstick.analysis.events import PointFound, Started, Stopped
from slipstick.analysis.road.request import Request
from slipstick.analysis.road.run import Memory, Run, Sink, one_thread
from slipstick.errors import TimeIsUp
from slipstick.verify.cases import oscillator


def test_linear_algebra_has_one_thread_inside():
    with one_thread():
        assert {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"} == {1}


@dataclass(frozen=True, kw_only=True)
class Every(Request):
    """Every second solution of a curve, up to one at which something happens: all that an analysis needs to add."""

    analysis = "every"
    curve: CurveRequest
    last: int = 10**6
    fault: BaseException | None = None

    def run(self):
        return EveryRun(self)


class EveryRun(Run[Every]):
    def points(self):
        solutions = (point for point in self.request.curve.run().follow() if point.kind != "interpolated")
        for number, point in enumerate(solutions):
            if number == self.request.last:
                raise self.request.fault
            if number % 2 == 0:
                yield point._replace(kind="regular")
        self.outcome, self.message = ss.Outcome.COMPLETED, "every second one"

    @property
    def attributes(self):
        return {"every": 2}


def every(**more):
    problem = replace(oscillator(velocity=10.0), told=frozenset())
    curve = frequency_request(problem, (4.0, 8.0))
    return Every(problem=problem, balance=curve.balance, start=4.0, stop=8.0, curve=curve, **more)


def test_an_analysis_adds_its_points_alone():
    told = []
    with pytest.warns(ss.SlipstickWarning, match="it looks odd"):
        branch = every(listeners=(told.append,), warnings=("it looks odd",)).solutions()
    whole = ss.forced_response(oscillator(velocity=10.0), omega=(4.0, 8.0)).dataset
    solved = whole.isel(point=np.flatnonzero(whole.kind.values != "interpolated")[::2])
    for name in ("omega", "displacement", "dissipated_power", "truncation"):
        np.testing.assert_allclose(branch.dataset[name].values, solved[name].values, rtol=1e-12, atol=1e-15)
    attributes = branch.dataset.attrs
    assert (attributes["every"], attributes["outcome_text"], attributes["jacobian"]) == (2, "every second one", "dense")
    assert branch.warnings[0] == "it looks odd"
    assert isinstance(told[0], Started)
    assert isinstance(told[-1], Stopped)
    assert [event.number for event in told if isinstance(event, PointFound)] == list(range(1, len(branch) + 1))
    assert attributes["seconds"] > 0.0


def test_a_sink_gets_the_values_that_a_branch_holds():
    class Kept(Sink):
        def __init__(self, run):
            super().__init__(run)
            self.groups, self.omega = [], []

        def keep(self, events, values):
            assert [event.omega for event in events] == values["omega"].tolist()
            self.groups.append([event.kind for event in events])
            self.omega += values["omega"].tolist()

        def values(self):
            return {"omega": np.array(self.omega)}

    request = frequency_request(oscillator(velocity=10.0), (4.0, 8.0))
    run = request.run()
    sink = Kept(run)
    assert len(list(run.follow(sink))) == len(sink.omega)
    assert sink.omega == request.solutions().dataset.omega.values.tolist()
    assert sink.end.outcome.ok
    # what is interpolated comes with the solution it leads to
    assert all(group[-1] != "interpolated" and set(group[:-1]) <= {"interpolated"} for group in sink.groups)
    assert max(map(len, sink.groups)) > 1


def test_what_was_found_is_worth_more_than_a_fault():
    branch = every(last=5, fault=ZeroDivisionError("oops")).solutions()
    assert branch.outcome is ss.Outcome.FAILED
    assert "oops" in branch.message
    assert len(branch) == 3
    with pytest.raises(ZeroDivisionError):
        every(last=0, fault=ZeroDivisionError("oops")).solutions()


def test_an_interrupt_keeps_what_was_found():
    branch = every(last=5, fault=KeyboardInterrupt()).solutions()
    assert branch.outcome is ss.Outcome.INTERRUPTED
    assert len(branch) == 3
    branch = every(last=5, fault=TimeIsUp()).solutions()
    assert branch.outcome is ss.Outcome.TIME_LIMIT


@pytest.mark.parametrize("event", [PointFound, Stopped])
def test_a_signal_keeps_what_was_found_wherever_it_comes(event):
    """Between points that take no iterations, and after the last one."""

    def interrupt(told):
        if isinstance(told, event):
            os.kill(os.getpid(), signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        branch = every(listeners=(interrupt,)).solutions()
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(branch) == (1 if event is PointFound else len(every().solutions()))
    assert branch.outcome is (ss.Outcome.INTERRUPTED if event is PointFound else ss.Outcome.COMPLETED)


def test_pieces_of_a_branch_in_memory_are_let_go_as_they_are_joined():
    """All values once, and one of the eight variables twice."""
    memory, names = Memory(every().run()), "abcdefgh"
    size = 8 * 40_000
    tracemalloc.start()
    try:
        for k in range(5):
            memory.keep([], {name: np.full(40_000, float(k)) for name in names})
        before = tracemalloc.get_traced_memory()[0]
        tracemalloc.reset_peak()
        values = memory.values()
        most = tracemalloc.get_traced_memory()[1] - before
    finally:
        tracemalloc.stop()
    assert most < 1.5 * 5 * size
    assert all(np.array_equal(values[name], np.repeat(np.arange(5.0), 40_000)) for name in names)
    assert memory.values() is values
