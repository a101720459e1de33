"""Motion of twice the period beside the results of a run: ``follow = "subharmonic"`` of a case."""

from __future__ import annotations

from pathlib import Path

from slipstick.case.case import Case
from slipstick.cli.output import SUBHARMONICS
from slipstick.cli.stored import Clock
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import say, termination_as_interrupt, warnings_said
from slipstick.io.loading import load
from slipstick.results.stability import PERIOD_DOUBLING


def follow_doubled(case: Case, results: Path, until: float) -> list[Answer]:
    """Follow it from every point of the results at which the period doubles; what was found, a file each.

    ``until`` is when that has to end, of the monotonic clock.
    """
    whole = load(results)
    with termination_as_interrupt(), warnings_said():
        found = case.subharmonics(whole, listeners=(Clock(until),))
    answers: list[Answer] = []
    for number, branch in enumerate(found, 1):
        file = results.with_name(SUBHARMONICS.format(number))
        branch.table.attrs.update(title=case.title, frequency_unit=case.frequency_unit)
        branch.save(file)
        say(f"twice the period, {file.name}: {len(branch)} points, {branch.message or branch.outcome.text}")
        ended = {"outcome": branch.outcome.name, "message": branch.message, "points": len(branch)}
        answers.append({"file": file.name, **ended})
    if PERIOD_DOUBLING not in whole.table["kind"].to_numpy():
        say("the period doubles nowhere: there is no motion of twice the period to follow")
    return answers
