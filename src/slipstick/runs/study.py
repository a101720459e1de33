"""A study of a case computed into a folder, on this machine, on a cluster, or a share of it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from slipstick.case.case import Case
from slipstick.errors import InputError, Outcome
from slipstick.faults import real_path
from slipstick.runs.failures import os_sentence
from slipstick.studies.folder import WHOLE, Share, StudyFolder
from slipstick.studies.plan import StudyPlan
from slipstick.studies.solving import CaseSolved
from slipstick.studies.workers import connected, solutions

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, kw_only=True)
class Spread:
    """Who computes: processes on this machine, a Dask cluster at an address, or one of several jobs its share."""

    workers: int | None = None
    scheduler: str | None = None
    share: Share | None = None


HERE = Spread()


def _ignored(_: object) -> None:
    pass


class StudyRun:
    """The cases of a study, kept in its folder one by one; used as a context, which others wait for.

    Attributes
    ----------
    folder
        Where they are kept, with all that were computed so far.
    todo
        Numbers of the cases to compute.
    stopped
        How it ended early, if it did.
    failure
        What kept it from storing a case.
    """

    def __init__(self, case: Case, path: Path, spread: Spread = HERE, *, missing: bool = False) -> None:
        if case.plan is None:
            raise InputError(
                f'{case.path}: [study] is missing; give the parameters, such as "damper.velocity" = [0, 1, 10]'
            )
        self.case, self._spread = case, spread
        self.plan: StudyPlan = case.plan
        self.folder = StudyFolder(
            path, case.study_job(), case.plan, about=case.names, path=str(real_path(case.path)),
            share=spread.share or WHOLE,
        )  # fmt: skip
        self.todo = self.folder.todo(missing=missing)
        self.stopped: Outcome | None = None
        self.failure = ""

    def __enter__(self) -> StudyRun:
        """Hold the folder."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Let others in."""
        if isinstance(error, InputError | OSError):
            self.folder.abandon()
        self.folder.release()

    def begin(self) -> None:
        """From here on it can be gone on with."""
        if self.todo:
            self.folder.begin()

    def compute(
        self,
        listener: Callable[[CaseSolved], None] = _ignored,
        tell: Callable[[str], None] = _ignored,
        *,
        until: float = math.inf,
    ) -> None:
        """Compute what there is to do; the listener gets each case once it is kept, ``tell`` what it waits for.

        ``until`` is when its time is up, of the monotonic clock.
        """
        self.begin()
        try:
            self.stopped = self._solve(listener, tell, until)
        except OSError as error:
            self.failure = os_sentence(error)

    def write(self) -> xarray.Dataset:
        """The results of all cases so far, in the folder."""
        return self.folder.write()

    def _solve(
        self, listener: Callable[[CaseSolved], None], tell: Callable[[str], None], until: float
    ) -> Outcome | None:
        folder, client = self.folder, None
        workers = 1 if folder.share.of > 1 else self._spread.workers
        try:
            with ExitStack() as stack:
                if self._spread.scheduler is not None:
                    client = stack.enter_context(connected(self._spread.scheduler))
                    if not client.nthreads():
                        tell(f"waiting for workers at {self._spread.scheduler}")
                cases = solutions(folder.job, folder.plan, self.todo, workers=workers, client=client, tell=tell)
                stack.callback(cases.close)
                for solved in cases:
                    folder.add(solved)
                    listener(solved)
                    if time.monotonic() > until and len(folder.cases) < len(folder.plan):
                        return Outcome.TIME_LIMIT
        except KeyboardInterrupt:
            return Outcome.INTERRUPTED
        return None
