"""Exceptions and outcomes, each with a text that says the cause and the remedy."""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import Enum

_LONG = re.compile(r"[^\s/\\]{256,}")
"""No name of a person or a file system is as long; a path may be, piece by piece."""


class SlipstickError(Exception):
    """Base of every exception this package raises on purpose."""


class InputError(SlipstickError, ValueError):
    """Input that cannot be computed; ``problems`` holds one sentence for each fault found.

    Names of hundreds of characters are shortened in them.

    >>> str(InputError(["contact 'tip': kt = -1 is negative; give a stiffness >= 0"]))
    "contact 'tip': kt = -1 is negative; give a stiffness >= 0"
    """

    def __init__(self, problems: str | Sequence[str]) -> None:
        given = (problems,) if isinstance(problems, str) else problems
        self.problems: tuple[str, ...] = tuple(_LONG.sub(lambda word: word[0][:60] + "...", text) for text in given)
        super().__init__("\n".join(self.problems))


class SlipstickWarning(UserWarning):
    """Something that can be computed but looks wrong; one sentence each."""


class Reason(Enum):
    """Why something ended or was not taken: code compares members, people read ``text``."""

    @property
    def text(self) -> str:
        """One sentence."""
        return str(self.value)


class Outcome(Reason):
    """How a computation ended; ``text`` says the cause and the remedy."""

    COMPLETED = "completed: the whole requested range was followed"
    STEP_TOO_SMALL = (
        "stopped early: the continuation step fell below its smallest value; look at the last points' states, "
        "allow smaller steps (min_step) or add harmonics"
    )
    TURNED_BACK = (
        "stopped early: the branch turned back and left the range where it began; every point found is kept: "
        "start where there is only one solution, further from resonance"
    )
    POINT_LIMIT = "stopped early: the largest number of points was reached; raise max_points or narrow the range"
    NO_FIRST_POINT = (
        "no first point was found by any starting strategy; start at a frequency further from resonance, "
        "ramp a parameter (normal load, velocity) to its value, or check the units of kt and the normal load"
    )
    SINGULAR = "stopped: the Jacobian became singular; perturb the starting frequency or add a little damping"
    OUTSIDE_TABLE = (
        "stopped early: a contact temperature left its table; extend the table by measured rows, or lower the thermal "
        "resistance, the normal load or the velocity"
    )
    INTERRUPTED = "interrupted by the user; every point found is kept"
    TIME_LIMIT = "stopped at the time limit; every point found is kept"

    @property
    def ok(self) -> bool:
        """Whether the whole request was fulfilled."""
        return self is Outcome.COMPLETED


class TimeIsUp(KeyboardInterrupt):
    """Raised by a listener to end a computation as Ctrl-C does, but with the outcome TIME_LIMIT."""

    outcome = Outcome.TIME_LIMIT
