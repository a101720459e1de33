"""Cases of a study solved in lockstep: those of small problems, whose curves differ in numbers alone."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil
from typing import TYPE_CHECKING, NamedTuple

from slipstick.analysis.curve.lockstep import Lockstep, alike, in_lockstep, most_together
from slipstick.errors import InputError, Outcome
from slipstick.studies.plan import StudyPlan
from slipstick.studies.solving import CaseSolved, Job, solve, solved_case

if TYPE_CHECKING:
    from slipstick.analysis.curve.follow import CurveRequest
    from slipstick.results.solutions import Solutions

_TRIED = 16
"""Cases of the first portion, which is timed before workers are started."""


class Portion(NamedTuple):
    """Cases that are computed in one go, in lockstep or each alone."""

    cases: tuple[int, ...]
    lockstep: bool = False


def portions(job: Job, todo: Sequence[int], count: int = 1, *, tried: bool = False) -> list[Portion]:
    """Portions for ``count`` processes.

    ``tried``: the first portion of many is small, to measure the time of a case.
    """
    most = _together_at_most(job) if todo else 0
    if not most:
        return [Portion((case,)) for case in todo]
    most = most if count == 1 else ceil(most / 2)  # for processes to end at about the same time
    first = _TRIED if tried and len(todo) > 4 * _TRIED else 0
    rest = len(todo) - first
    parts = min(rest, count * ceil(rest / (count * most)))
    ends = [*([0] if first else []), *(first + i * rest // parts for i in range(parts + 1))]
    return [Portion(tuple(todo[a:b]), lockstep=True) for a, b in pairwise(ends)]


def _together_at_most(job: Job) -> int:
    """How many cases are followed in lockstep, judged by the base problem; 0: each is solved alone."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            request = None if job.stability else job.request(replace(job.problem, told=None))
            return most_together(request) if request is not None and in_lockstep(request) else 0
    except InputError:  # the cases may be right even so; each reports its own faults
        return 0


def solve_portion(job: Job, plan: StudyPlan, portion: Portion) -> Iterator[CaseSolved]:
    """The cases of a portion, in lockstep where possible, else by ``solve``."""
    together = _together(job, plan, portion.cases) if portion.lockstep else {}
    for case in portion.cases:
        yield together.get(case) or solve(job, plan, case)


def _together(job: Job, plan: StudyPlan, cases: Sequence[int]) -> dict[int, CaseSolved]:
    """Cases that were solved in lockstep."""
    begin = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        requests = {case: request for case in cases if (request := _request(job, plan, case)) is not None}
        groups: list[list[int]] = []
        for case, request in requests.items():
            known = (group for group in groups if alike(requests[group[0]], request))
            if (group := next(known, None)) is None:
                groups.append([case])
            else:
                group.append(case)
        branches = {case: branch for group in groups for case, branch in _branches(group, requests)}
        seconds = (time.perf_counter() - begin) / max(1, len(requests))
        return {case: solved_case(job, case, branch, seconds, lockstep=True) for case, branch in branches.items()}


def _branches(cases: Sequence[int], requests: dict[int, CurveRequest]) -> Iterator[tuple[int, Solutions]]:
    """Cases that were followed to their end, and their branches."""
    try:
        branches = Lockstep([requests[case] for case in cases]).branches()
    except Exception:  # solved alone, the case at fault fails without the others
        if len(cases) > 1:
            yield from (found for case in cases for found in _branches([case], requests))
        return
    for case, branch in zip(cases, branches, strict=True):
        if branch is not None and branch.outcome is Outcome.COMPLETED:
            yield case, branch


def _request(job: Job, plan: StudyPlan, case: int) -> CurveRequest | None:
    """The request of one case; None where it has to be solved alone."""
    try:
        request = job.request(plan.problem(job.problem, case))
        return request if in_lockstep(request) else None
    except Exception:  # solved alone, the case fails with its reason
        return None
