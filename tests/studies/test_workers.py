"""Who computes does not matter: the same numbers from this process and from workers; a worker that dies is a row."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

import pytest

from slipstick.balance.kernel.compilation import compile_all
from slipstick.errors import InputError, Outcome
from slipstick.studies import together, workers
from slipstick.studies.plan import make_plan
from slipstick.studies.solving import CaseSolved, Job, solve
from slipstick.studies.together import Portion, portions
from slipstick.studies.workers import connected, in_turn, local_workers, on_cluster, solutions
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.skipif(find_spec("distributed") is None, reason="needs distributed")

JOB = Job(problem=oscillator(velocity=10.0), span=(5.0, 7.0))
PLAN = make_plan(JOB.problem, {"damper.velocity": [10.0, 20.0, 30.0, 40.0]})


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    compile_all()
    with local_workers(1) as found:
        yield found


def singly(todo: Iterable[int]) -> list[Portion]:
    """Portions of one case each."""
    return [Portion((case,)) for case in todo]


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every case by itself."""
    monkeypatch.setattr(workers, "portions", lambda job, todo, count=1, *, tried=False: singly(todo))


def same(one: CaseSolved, other: CaseSolved) -> bool:
    return one.curve.tobytes() == other.curve.tobytes() and one.message == other.message


@pytest.mark.verify
def test_workers_find_the_same_bits(client: Any) -> None:
    for todo in (singly(range(4)), portions(JOB, range(4))):
        here = {one.row["case"]: one for one in in_turn(JOB, PLAN, todo)}
        there = {one.row["case"]: one for one in on_cluster(client, JOB, PLAN, todo)}
        assert set(there) == {0, 1, 2, 3}
        assert all(same(here[case], there[case]) for case in here)
    assert client.submit(os.getenv, "OMP_NUM_THREADS").result() == "1"


def _dies(*_: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.verify
@pytest.mark.skipif(os.name != "posix", reason="POSIX signals")
def test_a_worker_that_dies_is_a_case_that_failed(client: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = client.submit

    def submit(function: Any, shared: Any, what: Any, **more: Any) -> Any:
        return whole(_dies if isinstance(what, Portion) and 1 in what.cases else function, shared, what, **more)

    monkeypatch.setattr(client, "submit", submit)
    found = {one.row["case"]: one for one in on_cluster(client, JOB, PLAN, portions(JOB, range(4)))}
    assert found[1].outcome is Outcome.FAILED
    assert "was killed, or ran out of memory; compute it once more with --missing" in found[1].message
    assert all(found[case].outcome.ok for case in (0, 2, 3))


@pytest.mark.usefixtures("alone")
def test_nothing_is_started_for_little_work(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(count: int) -> Any:
        raise AssertionError("workers were started")

    monkeypatch.setattr(workers, "local_workers", refuse)
    monkeypatch.setattr(together, "solve", lambda job, plan, case: CaseSolved.failed(case, ""))
    assert [one.row["case"] for one in solutions(JOB, PLAN, [2, 0])] == [2, 0]
    assert [one.row["case"] for one in solutions(JOB, PLAN, [1, 3], workers=1)] == [1, 3]


@pytest.mark.usefixtures("alone")
def test_without_dask_it_is_said_where_workers_would_help(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(workers, "has_dask", lambda: False)
    monkeypatch.setattr(workers, "cores", lambda: 8)
    monkeypatch.setattr(workers, "WORTH", 0.0)
    monkeypatch.setattr(together, "solve", lambda job, plan, case: CaseSolved.failed(case, ""))
    assert len(list(solutions(JOB, PLAN, range(4), tell=said.append))) == 4
    assert said == ["one case after another: for 3 workers, pip install 'slipstick[study]'"]
    with pytest.raises(InputError, match="run: pip install"):
        list(solutions(JOB, PLAN, range(4), workers=2))


def test_a_scheduler_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers, "_WAIT", 0.2)
    for address in ("tcp://127.0.0.1:9", "nonsense://"):
        with pytest.raises(InputError, match="no Dask scheduler answers at"), connected(address):
            pass


def test_one_case_here_is_that_of_solve() -> None:
    [found] = in_turn(JOB, PLAN, singly([3]))
    assert same(found, solve(JOB, PLAN, 3))


class KilledWorker(Exception):
    """By this name Dask says that a worker died too often with a task."""


class Inline:
    """A client whose tasks are done at once, or end with what is in ``ends``, call by call."""

    def __init__(self, ends: dict[int, list[Exception]] | None = None) -> None:
        self.sent: list[int] = []
        self.released = 0
        self._ends = ends or {}

    def nthreads(self) -> dict[str, int]:
        return {"a": 1, "b": 1}

    def submit(self, function: Any, *given: Any, pure: bool) -> Any:
        assert not pure
        if function is not workers._solve_shared:
            return function(*given)
        [case] = given[1].cases
        self.sent.append(case)
        ends = self._ends.get(case, [])
        error = ends.pop(0) if ends else None
        return Done(self, f"{case}-{len(self.sent)}", case, error)


class Done:
    def __init__(self, client: Inline, key: str, case: int, error: Exception | None) -> None:
        self.client, self.key, self.case, self.error = client, key, case, error

    def add_done_callback(self, called: Any) -> None:
        called(self)

    def result(self) -> list[CaseSolved]:
        if self.error is not None:
            raise self.error
        return [CaseSolved.failed(self.case, "done")]

    def release(self) -> None:
        self.client.released += 1


def test_so_many_cases_are_sent_ahead_and_one_for_each_that_is_done() -> None:
    client = Inline()
    cases = workers.on_cluster(client, None, None, singly(range(20)))  # type: ignore[arg-type]
    sent = []
    for number, solved in enumerate(cases, 1):
        assert solved.row["case"] == number - 1
        sent.append(len(client.sent))
    assert sent == [min(20, 8 + number) for number in range(1, 21)]  # four for each of two processors
    assert client.released == 20


@pytest.mark.usefixtures("alone")
def test_a_client_that_is_there_computes_all(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(workers, "local_workers", refuse)
    monkeypatch.setattr(together, "solve", refuse)
    client: Any = Inline()
    assert [c.row["case"] for c in solutions(JOB, PLAN, [2, 0], client=client, workers=7)] == [2, 0]
    assert client.sent == [2, 0]


@pytest.mark.usefixtures("alone")
@pytest.mark.parametrize(("asked", "todo", "started"), [(3, 5, 3), (3, 2, 2), (1, 5, 0), (None, 5, 4), (None, 1, 0)])
def test_so_many_workers_are_started(
    monkeypatch: pytest.MonkeyPatch, asked: int | None, todo: int, started: int
) -> None:
    """As many as asked for, or as processors, never more than cases; the first case tells whether it is worth it."""
    counts: list[int] = []

    @contextmanager
    def local(count: int) -> Iterator[Any]:
        counts.append(count)
        yield Inline()

    monkeypatch.setattr(workers, "local_workers", local)
    monkeypatch.setattr(workers, "cores", lambda: 4)
    monkeypatch.setattr(workers, "WORTH", 0.0)
    monkeypatch.setattr(together, "solve", lambda job, plan, case: CaseSolved.failed(case, "here"))
    found = list(solutions(JOB, PLAN, range(todo), workers=asked))
    assert sorted(c.row["case"] for c in found) == list(range(todo))
    assert counts == ([started] if started else [])
    here = sum(c.message == "here" for c in found)
    assert here == (todo if not started else 1 if asked is None else 0)


def test_a_case_whose_worker_dies_is_computed_once_more_after_the_others() -> None:
    died = KilledWorker("task")
    client = Inline({1: [died], 3: [died, died], 4: [ValueError("odd\nmore")]})
    found = {c.row["case"]: c for c in workers.on_cluster(client, None, None, singly(range(6)))}  # type: ignore[arg-type]
    assert list(found) == [0, 2, 4, 5, 1, 3]
    assert client.sent == [0, 1, 2, 3, 4, 5, 1, 3]
    assert found[1].message == "done"
    assert found[3].message.startswith("the worker that computed it was killed, or ran out of memory")
    assert found[4].message == "the worker that computed it failed (ValueError: odd)"
    assert client.released == 8
