"""Work of continuations, counted."""

from __future__ import annotations

from typing import NamedTuple


class Work(NamedTuple):
    """What was done so far."""

    runs: int = 0
    evaluations: int = 0
    solves: int = 0
    rejected: int = 0

    def plus(self, other: Work) -> Work:
        """Both together."""
        return Work(*(a + b for a, b in zip(self, other, strict=True)))


NO_WORK = Work()


def counted(work: Work) -> dict[str, int]:
    """As results say it."""
    return {"evaluations": work.evaluations, "linear_solves": work.solves, "rejected_steps": work.rejected}
