"""Portions solved by processes beside this one: the same bits, whoever solves; what a process dies with is a row."""

from __future__ import annotations

import pickle
import sys
import threading
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from slipstick.errors import Outcome
from slipstick.studies import processes
from slipstick.studies.plan import make_plan
from slipstick.studies.processes import DIED
from slipstick.studies.solving import CaseSolved, Job
from slipstick.studies.together import Portion, solve_portion
from slipstick.verify.cases import oscillator

JOB = Job(problem=oscillator(velocity=10.0), span=(5.0, 7.0))
PLAN = make_plan(JOB.problem, {"damper.velocity": [float(v) for v in range(10, 22)]})
TODO = [Portion((2 * i, 2 * i + 1), lockstep=True) for i in range(6)]


def solved(count: int, told: list[str] | None = None) -> dict[int, CaseSolved]:
    tell = (lambda text: None) if told is None else told.append
    found = list(processes.side_by_side(JOB, PLAN, TODO, count, tell))
    assert sorted(one.row["case"] for one in found) == list(range(12))
    return {one.row["case"]: one for one in found}


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Portions of this process are rows at once."""

    def rows(job: Job, plan: object, portion: Portion) -> list[CaseSolved]:
        return [CaseSolved.failed(case, "here") for case in portion.cases]

    monkeypatch.setattr(processes, "solve_portion", rows)


def beside(monkeypatch: pytest.MonkeyPatch, program: Sequence[str]) -> None:
    monkeypatch.setattr(processes, "_COMMAND", (sys.executable, "-c", "\n".join(program)))


READY = (
    "import pickle, sys",
    "i, o = sys.stdin.buffer, sys.stdout.buffer",
    "pickle.load(i)",
    "pickle.dump(None, o)",
    "o.flush()",
)


@pytest.mark.verify
def test_processes_find_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    here = {one.row["case"]: one for portion in TODO for one in solve_portion(JOB, PLAN, portion)}
    taken, own, handed = list[Portion](), processes.solve_portion, threading.Event()

    def dump(*given: Any) -> None:
        handed.set()
        pickle.dump(*given)

    def late(job: Job, plan: Any, portion: Portion) -> Any:
        assert handed.wait(600)  # until the process beside has taken one
        taken.append(portion)
        return own(job, plan, portion)

    monkeypatch.setattr(processes, "pickle", SimpleNamespace(**{**vars(pickle), "dump": dump}))
    monkeypatch.setattr(processes, "solve_portion", late)
    found = solved(2)
    assert len(taken) < len(TODO)
    for case, one in found.items():
        assert one.curve.tobytes() == here[case].curve.tobytes()
        assert one.row["lockstep"] == 1


@pytest.mark.usefixtures("quick")
def test_all_is_done_here_where_no_process_can_be_started(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(processes, "_COMMAND", ("/nowhere/python",))
    assert {one.message for one in solved(3, told).values()} == {"here"}
    assert [text.split(":")[0] for text in told] == ["fewer processes"]
    told.clear()
    monkeypatch.setattr(processes, "_pickled", lambda what: 1 / 0)
    assert {one.message for one in solved(2, told).values()} == {"here"}
    assert "cannot be sent to others (ZeroDivisionError" in told[0]


@pytest.mark.usefixtures("quick")
def test_a_process_that_ends_before_it_is_ready_takes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    beside(monkeypatch, ["raise SystemExit(1)"])
    assert {one.message for one in solved(2).values()} == {"here"}


def test_cases_that_a_process_dies_with_are_rows_that_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    """It takes one portion, which this process leaves to it, and ends."""
    beside(monkeypatch, [*READY, "pickle.load(i)"])
    waiting, finished = processes.deque(TODO[:1]), processes._Finished()
    with processes._started(1, processes._pickled(None), waiting, finished, print) as threads:
        lost, ended = finished.get(), finished.get()
    assert not threads[0].is_alive()
    assert ended is None
    assert lost is not None
    assert [(one.row["case"], one.outcome, one.message) for one in lost] == [
        (case, Outcome.FAILED, DIED) for case in TODO[0].cases
    ]


def test_a_process_takes_portions_until_there_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    answer = (
        "while True:",
        "    cases, lockstep = pickle.load(i)",
        "    pickle.dump([(case, lockstep) for case in cases], o)",
        "    o.flush()",
    )
    beside(monkeypatch, [*READY, *answer])
    waiting, finished = processes.deque(TODO[:3]), processes._Finished()
    with processes._started(1, processes._pickled(None), waiting, finished, print):
        got = [finished.get() for _ in range(4)]
    assert got == [[(2 * i, True), (2 * i + 1, True)] for i in range(3)] + [None]


def test_what_is_left_running_ends_with_the_study(monkeypatch: pytest.MonkeyPatch) -> None:
    beside(monkeypatch, ["import time", "time.sleep(1000)"])
    waiting, finished = processes.deque(TODO), processes._Finished()
    with processes._started(2, b"", waiting, finished, print) as threads:
        assert all(thread.is_alive() for thread in threads)
    assert not any(thread.is_alive() for thread in threads)
    assert len(waiting) == len(TODO)
