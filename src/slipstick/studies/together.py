"""Cases of a study solved side by side: those of small problems, whose curves differ in numbers alone."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING

from slipstick.analysis.curve.lockstep import Lockstep, alike, in_lockstep
from slipstick.errors import InputError, Outcome
from slipstick.studies.plan import StudyPlan
from slipstick.studies.solving import CaseSolved, Job, kept, solve

if TYPE_CHECKING:
    from slipstick.analysis.curve.follow import CurveRequest
    from slipstick.branch import Branch

PORTION = 64
"""So many cases are solved side by side: of twice as many each takes hardly less time."""

Portion = tuple[int, ...]


def portions(job: Job, plan: StudyPlan, todo: Sequence[int]) -> list[Portion]:
    """What is computed in one go: cases whose numbers follow one another, or each alone.

    Which cases share a portion depends on their numbers alone, not on who computes them.
    """
    if len(todo) < 2 or not _small(job):
        return [(case,) for case in todo]
    return [tuple(cases) for _, cases in groupby(todo, lambda case: case // PORTION)]


def _small(job: Job) -> bool:
    """Whether curves of this kind can be followed side by side, seen from the problem that all cases begin from."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return not job.stability and in_lockstep(job.request(replace(job.problem, told=None)))
    except InputError:  # the cases may be right all the same, and say themselves what is wrong
        return False


def solve_portion(job: Job, plan: StudyPlan, cases: Portion) -> Iterator[CaseSolved]:
    """The cases of a portion, those alone that cannot be solved with others; as ``solve`` each, whatever happens."""
    together = _together(job, plan, cases)
    for case in cases:
        yield together.get(case) or solve(job, plan, case)


def _together(job: Job, plan: StudyPlan, cases: Portion) -> dict[int, CaseSolved]:
    """Those that were solved side by side."""
    begin = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        requests: dict[int, CurveRequest] = {}
        for case in cases:
            request = _request(job, plan, case)
            if request is not None and all(alike(first, request) for first in list(requests.values())[:1]):
                requests[case] = request
        if not requests:
            return {}
        branches = _branches(list(requests.values()))
        found = {case: branch for case, branch in zip(requests, branches, strict=True) if branch is not None}
        seconds = (time.perf_counter() - begin) / len(requests)
        return {case: kept(job, case, branch, seconds, lockstep=True) for case, branch in found.items()}


def _branches(requests: Sequence[CurveRequest]) -> Sequence[Branch | None]:
    try:
        branches = Lockstep(requests).branches()
    except Exception:  # whose fault it is shows where each is alone
        return [None] * len(requests)
    return [branch if branch is not None and branch.outcome is Outcome.COMPLETED else None for branch in branches]


def _request(job: Job, plan: StudyPlan, case: int) -> CurveRequest | None:
    """What is followed for one case; None where it is to be solved alone."""
    try:
        request = job.request(replace(plan.problem(job.problem, case), told=None))
        return request if in_lockstep(request) else None
    except Exception:  # it is a row that says why, made where it is alone
        return None
