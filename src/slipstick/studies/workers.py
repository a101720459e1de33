"""Solve cases in this process, in local workers or on a Dask cluster, with the same numbers."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from queue import SimpleQueue
from typing import TYPE_CHECKING

from slipstick.errors import InputError
from slipstick.interrupts import held
from slipstick.studies.plan import StudyPlan
from slipstick.studies.processes import DIED, environment, side_by_side
from slipstick.studies.solving import CaseSolved, Job
from slipstick.studies.together import Portion, portions, solve_portion

if TYPE_CHECKING:
    from distributed import Client, Future

WORTH = 6.0
"""Seconds that Dask workers on this machine must save to be started; their start takes about three."""
WORTH_BESIDE = 2.0
"""The same for further processes, while this one computes."""
_QUEUED = 4
"""Portions of cases that are sent to each worker in advance."""
_WAIT = 30
"""Seconds to wait for a scheduler or a worker."""
_CLOSING = 10.0
"""Seconds that a cluster has to end."""


def in_turn(job: Job, plan: StudyPlan, todo: Iterable[Portion]) -> Iterator[CaseSolved]:
    """One portion after another, here."""
    for portion in todo:
        yield from solve_portion(job, plan, portion)


def on_cluster(client: Client, job: Job, plan: StudyPlan, todo: Iterable[Portion]) -> Iterator[CaseSolved]:
    """Cases as they are finished by the workers of a Dask client.

    Dask holds locks where an interrupt would leave them: it waits while Dask is at work, and cases are waited for in a
    queue of our own. Where a worker dies, the cases it had are computed once more, each alone: the one that kills its
    worker again is a case that failed.
    """
    # a task, not scattered data: it is made again where every worker that holds it is gone
    with held(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Sending large graph")  # a reduced model may have hundreds of megabytes
        shared = client.submit(_Shared, job, plan, pure=False)
    waiting, sent, suspects = iter(todo), {}, list[Portion]()
    finished: SimpleQueue[Future] = SimpleQueue()

    def send(portion: Portion) -> None:
        future = client.submit(_solve_shared, shared, portion, pure=False)
        sent[future.key] = portion
        future.add_done_callback(finished.put)

    with held():
        for portion in islice(waiting, _QUEUED * max(1, sum(client.nthreads().values()))):
            send(portion)
    while sent:
        future = finished.get()
        with held():
            portion = sent.pop(future.key)
            for more in islice(waiting, 1):
                send(more)
            solved = _outcome_of(future, portion)
        if solved is None:
            suspects += [Portion((case,), portion.lockstep) for case in portion.cases]
        else:
            yield from solved
    for portion in suspects:
        with held():
            send(portion)
        future = finished.get()
        with held():
            solved = _outcome_of(future, sent.pop(future.key))
        yield from solved or [CaseSolved.failed(case, DIED) for case in portion.cases]


class _Shared:
    """Data that every case of a study needs, held once on every worker."""

    def __init__(self, job: Job, plan: StudyPlan) -> None:
        self.job, self.plan = job, plan


def _solve_shared(shared: _Shared, portion: Portion) -> list[CaseSolved]:
    return list(solve_portion(shared.job, shared.plan, portion))


def _outcome_of(future: Future, portion: Portion) -> list[CaseSolved] | None:
    """The cases, or None where their worker died."""
    try:
        solved: list[CaseSolved] = future.result()
        return solved
    except Exception as error:
        kind = type(error).__name__
        if kind == "KilledWorker":
            return None
        first = next(iter(str(error).splitlines()), "")[:200]
        return [
            CaseSolved.failed(case, f"the worker that computed it failed ({kind}: {first})") for case in portion.cases
        ]
    finally:
        future.release()


def has_dask() -> bool:
    """Whether Dask is installed."""
    from importlib.util import find_spec

    return find_spec("distributed") is not None


def cores() -> int:
    """Processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def connected(scheduler: str) -> Iterator[Client]:
    """A client of the cluster at an address.

    Raises
    ------
    InputError
        If there is no Dask, or no scheduler answers.
    """
    require_dask()
    from distributed import Client

    try:
        client = Client(scheduler, timeout=_WAIT)
    except (OSError, TimeoutError, ValueError) as error:
        first = next((line for line in str(error).splitlines() if line), type(error).__name__)
        raise InputError(
            f"--scheduler: no Dask scheduler answers at {scheduler} ({first[:120]}); expected an address such as "
            "tcp://host:8786"
        ) from None
    try:
        yield client
    finally:
        client.close()


@contextmanager
def local_workers(count: int) -> Iterator[Client]:
    """A client of ``count`` processes on this machine, one thread each.

    They are processes of their own, not children made by ``multiprocessing``: a script needs no main guard, and Ctrl-C
    reaches this process alone.
    """
    require_dask()
    with ExitStack() as stack:
        with held():
            client = _begun(stack, count)
        yield client


def _begun(stack: ExitStack, count: int) -> Client:
    """A client with its workers, which end with the stack."""
    import dask
    from distributed import Client, LocalCluster

    stack.enter_context(
        dask.config.set({"logging.distributed": "critical", "distributed.scheduler.allowed-failures": 0})
    )
    folder = stack.enter_context(tempfile.TemporaryDirectory())
    cluster = LocalCluster(
        n_workers=0, host="127.0.0.1", protocol="tcp://", dashboard_address="127.0.0.1:0", silence_logs=50
    )
    client = Client(cluster, timeout=_WAIT)
    stack.callback(_within, _CLOSING, client.close, cluster.close)
    options = {"nworkers": count, "nthreads": 1, "memory-limit": 0, "death-timeout": _WAIT, "local-directory": folder}
    command = [sys.executable, "-m", "distributed.cli.dask_worker", str(cluster.scheduler_address), "--no-dashboard"]
    command += [f"--{name}={value}" for name, value in options.items()]
    null = subprocess.DEVNULL
    process = subprocess.Popen(command, env=environment(), stdin=null, stdout=null, stderr=null, start_new_session=True)
    stack.callback(_kill, process)
    client.wait_for_workers(1, timeout=2 * _WAIT)
    return client


def _within(seconds: float, *steps: Callable[[], object]) -> None:
    """Close in a thread, and give up after some seconds: after Ctrl-C closing may never end."""
    thread = threading.Thread(target=lambda: [step() for step in steps], daemon=True)
    thread.start()
    thread.join(seconds)


def _kill(process: subprocess.Popen[bytes]) -> None:
    """End the workers with the process that holds them: they keep nothing."""
    if os.name == "posix":
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.terminate()
    process.wait()


def solutions(
    job: Job,
    plan: StudyPlan,
    todo: Sequence[int],
    *,
    workers: int | None = None,
    client: Client | None = None,
    tell: Callable[[str], object] = str,
) -> Generator[CaseSolved, None, None]:
    """Every case of ``todo`` as it is finished.

    ``workers`` None: as many as there are processors, started only where that saves time. ``tell`` hears why there are
    none where they would help.
    """
    if client is not None:
        yield from on_cluster(client, job, plan, portions(job, todo, max(1, sum(client.nthreads().values()))))
        return
    count = min(workers or cores(), max(1, len(todo)))
    rest = portions(job, todo, count, tried=workers is None and count > 1)
    light = any(portion.lockstep for portion in rest)
    if workers is not None and count > 1 and not light:
        require_dask()
    while rest and count > 1 and workers is None:
        begin, some = time.perf_counter(), rest.pop(0)
        yield from solve_portion(job, plan, some)
        each = (time.perf_counter() - begin) / len(some.cases)
        left = sum(len(portion.cases) for portion in rest)
        if left * each * (1.0 - 1.0 / count) > (WORTH_BESIDE if light else WORTH):
            break
    if light:
        yield from (
            in_turn(job, plan, rest) if count == 1 else side_by_side(job, plan, rest, min(count, len(rest)), tell)
        )
        return
    with ExitStack() as stack:
        workers_client = _started(stack, min(count, len(rest)), tell) if rest and count > 1 else None
        yield from in_turn(job, plan, rest) if workers_client is None else on_cluster(workers_client, job, plan, rest)


def _started(stack: ExitStack, count: int, tell: Callable[[str], object]) -> Client | None:
    """Local workers, or None where there can be none: the work is done here then."""
    if not has_dask():
        tell(f"one case after another: for {count} workers, pip install 'slipstick[study]'")
        return None
    try:
        return stack.enter_context(local_workers(count))
    except (OSError, RuntimeError, TimeoutError) as error:
        tell(f"one case after another: workers did not start ({type(error).__name__}: {str(error)[:100]})")
        return None


def require_dask() -> None:
    """Raises InputError where Dask is not installed."""
    if not has_dask():
        raise InputError("workers need Dask, which is not installed; run: pip install 'slipstick[study]'")
