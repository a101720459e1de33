"""Signals wait while something is computed, and are not lost."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers.cases import oscillator
from helpers.command import slipstick

import slipstick as ss
from slipstick.analysis.curve.segments import Segment
from slipstick.interrupts import held, pass_on, unbroken
from slipstick.io.store import ResultStore
from slipstick.results.record import Recorder

pytestmark = pytest.mark.skipif(os.name != "posix", reason="POSIX signals")


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def test_an_interrupt_waits_for_the_end() -> None:
    reached = []
    with pytest.raises(KeyboardInterrupt), held():  # noqa: PT012
        os.kill(os.getpid(), signal.SIGINT)
        reached.append(1)
    assert reached == [1]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_it_is_raised_where_that_is_safe() -> None:
    reached = []
    with pytest.raises(KeyboardInterrupt), held():  # noqa: PT012
        pass_on()
        os.kill(os.getpid(), signal.SIGINT)
        reached.append(1)
        pass_on()
        reached.append(2)
    assert reached == [1]


def test_a_second_one_does_not_wait() -> None:
    reached = []
    with pytest.raises(KeyboardInterrupt), held():  # noqa: PT012
        os.kill(os.getpid(), signal.SIGINT)
        reached.append(1)
        os.kill(os.getpid(), signal.SIGINT)
        reached.append(2)
    assert reached == [1]


def test_short_work_is_finished_even_then() -> None:
    reached = []
    with pytest.raises(KeyboardInterrupt), held():  # noqa: PT012
        with unbroken():
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGINT)
            reached.append(1)
        reached.append(2)
    assert reached == [1]


@pytest.mark.parametrize("at", ["found", "recorded", "kept"])
def test_as_many_points_are_told_as_are_kept_after_two_signals(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, at: str
) -> None:
    """The second one reaches a point while it is found, recorded or written."""
    calls = 0

    def hurry(method: Callable[..., Any]) -> Callable[..., Any]:
        def called(*arguments: Any) -> Any:
            nonlocal calls
            calls += 1
            if calls == 9:
                os.kill(os.getpid(), signal.SIGINT)
                os.kill(os.getpid(), signal.SIGINT)
            return method(*arguments)

        return called

    owner, name = {"found": (Segment, "add"), "recorded": (Recorder, "values"), "kept": (ResultStore, "append")}[at]
    monkeypatch.setattr(owner, name, hurry(getattr(owner, name)))
    case = oscillator(head="harmonics = [0, 1, 2, 3]\n", rubbing="velocity = 10.0", response="from = 3.0\nto = 6.0\n")
    (tmp_path / "own.toml").write_text(case, encoding="utf-8")
    done = slipstick("run", tmp_path / "own.toml", "-o", tmp_path / "out", "--no-figures", "--no-report")
    assert done.exit_code == 1
    found = ss.load(tmp_path / "out" / "results.nc")
    assert calls > 8
    assert f"the last of {len(found)} points is at {float(found.dataset.omega[-1]):.6g} rad/s" in done.output


def test_handlers_of_ones_own_are_told_later_and_once() -> None:
    heard: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, frame: heard.append(number))
    with held():
        os.kill(os.getpid(), signal.SIGTERM)
        assert heard == []
    assert heard == [signal.SIGTERM]
    with held():
        pass
    assert heard == [signal.SIGTERM]


def test_what_is_ignored_or_left_to_the_system_stays_so() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    with held():
        assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
        assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_another_exception_goes_its_way() -> None:
    with pytest.raises(ZeroDivisionError), held():  # noqa: PT012
        os.kill(os.getpid(), signal.SIGINT)
        raise ZeroDivisionError
    with pytest.raises(KeyboardInterrupt):  # it was not lost
        pass_on()


def test_other_threads_are_left_alone() -> None:
    found: list[object] = []

    def work() -> None:
        with held():
            found.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [signal.default_int_handler]


def test_one_within_another_waits_for_the_end_of_that() -> None:
    reached = []
    with pytest.raises(KeyboardInterrupt), held():  # noqa: PT012
        with held():
            os.kill(os.getpid(), signal.SIGINT)
            reached.append(1)
        reached.append(2)
    assert reached == [1, 2]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
