"""Portions of a study solved by further processes on this machine, while this process solves its share too.

For cases that are followed in lockstep. A process is ready after the import of the package; portions and solved cases
go through its standard input and output. It is started as a program of its own on every system: a script needs no main
guard, and Ctrl-C reaches this process alone.

Why not ``concurrent.futures`` with ``spawn``: it imports the script again, which without a guard ends in a
RuntimeError, and of 12 tasks one that ended its process took 9 others with it (BrokenProcessPool). Why not Dask's
workers, as for cases each alone: Dask need not be installed, and its workers take 1.5 to 1.8 s before they import the
package, these 1.0 s.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from queue import SimpleQueue
from typing import Any

from slipstick.studies.plan import StudyPlan
from slipstick.studies.solving import CaseSolved, Job
from slipstick.studies.together import Portion, solve_portion

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
DIED = "the worker that computed it was killed, or ran out of memory; compute it once more with --missing"
_COMMAND = (sys.executable, "-m", "slipstick.studies.processes")
_Finished = SimpleQueue[Sequence[CaseSolved] | None]


def environment() -> dict[str, str]:
    """That of a worker: one thread, and the modules that this process finds."""
    return {**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": os.pathsep.join(sys.path)}


def side_by_side(
    job: Job, plan: StudyPlan, todo: Sequence[Portion], count: int, tell: Callable[[str], object]
) -> Iterator[CaseSolved]:
    """Every case as it is finished by one of ``count`` processes, this one among them.

    The cases that a process dies with are cases that failed. ``tell`` hears why there are fewer processes.
    """
    waiting, finished = deque(todo), _Finished()
    try:
        setup = _pickled((job, plan))
    except Exception as error:
        tell(f"one process alone: the problem cannot be sent to others ({type(error).__name__}: {str(error)[:100]})")
        count = 1
    with _one_thread(), _started(count - 1, setup if count > 1 else b"", waiting, finished, tell) as threads:
        running = len(threads)
        while waiting:
            with suppress(IndexError):  # somebody else took the last one
                yield from solve_portion(job, plan, waiting.popleft())
            while not finished.empty():
                solved = finished.get()
                running -= solved is None
                yield from solved or ()
        while running:
            solved = finished.get()
            running -= solved is None
            yield from solved or ()


@contextmanager
def _started(
    count: int, setup: bytes, waiting: deque[Portion], finished: _Finished, tell: Callable[[str], object]
) -> Iterator[Sequence[threading.Thread]]:
    """Processes, each with a thread that hands it one portion after another; they end with the block."""
    children, threads = list[subprocess.Popen[bytes]](), list[threading.Thread]()
    try:
        for _ in range(count):
            try:
                child = subprocess.Popen(
                    _COMMAND, env=environment(), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL, start_new_session=True,
                )  # fmt: skip
            except OSError as error:
                tell(f"fewer processes: one did not start ({type(error).__name__}: {str(error)[:100]})")
                break
            children.append(child)
            threads.append(threading.Thread(target=_served, args=(child, setup, waiting, finished), daemon=True))
            threads[-1].start()
        yield threads
    finally:
        for child in children:
            child.kill()
        for thread in threads:
            thread.join()
        for child in children:
            child.wait()
            for pipe in (child.stdin, child.stdout):
                if pipe is not None:
                    with suppress(OSError):
                        pipe.close()


def _served(child: subprocess.Popen[bytes], setup: bytes, waiting: deque[Portion], finished: _Finished) -> None:
    """Hand portions to a process once it is ready for them, until there are none or it dies; then put None."""
    assert child.stdin is not None
    assert child.stdout is not None
    portion: Portion | None = None
    try:
        child.stdin.write(setup)
        child.stdin.flush()
        pickle.load(child.stdout)
        while True:
            try:
                portion = waiting.popleft()
            except IndexError:
                return
            pickle.dump(tuple(portion), child.stdin)
            child.stdin.flush()
            finished.put(pickle.load(child.stdout))
            portion = None
    except (OSError, EOFError, ValueError, pickle.UnpicklingError):
        if portion is not None:
            finished.put([CaseSolved.failed(case, DIED) for case in portion.cases])
    finally:
        finished.put(None)


def _pickled(what: object) -> bytes:
    """Also what a script defines, where cloudpickle is there, which comes with Dask."""
    with suppress(ImportError):
        return bytes(import_module("cloudpickle").dumps(what))
    return pickle.dumps(what)


@contextmanager
def _one_thread() -> Iterator[None]:
    """The contacts in one thread, as in the others: every processor has a process."""
    import numba

    config: Any = numba.config
    threads, config.NUMBA_NUM_THREADS = config.NUMBA_NUM_THREADS, 1
    try:
        yield
    finally:
        config.NUMBA_NUM_THREADS = threads


def main() -> None:
    """A process beside: what it solves and its portions come in, solved cases go out, each a pickle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # nothing that is printed comes between the answers
    job, plan = pickle.load(requests)
    solve_portion(job, plan, Portion(()))
    pickle.dump(None, answers)
    answers.flush()
    with suppress(EOFError):
        while True:
            pickle.dump(list(solve_portion(job, plan, Portion(*pickle.load(requests)))), answers)
            answers.flush()


if __name__ == "__main__":
    main()
