"""The first run on a machine: a small case starts at once as plain Python while another process compiles for later."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from time import time
from typing import TYPE_CHECKING

from slipstick.cli.terminal import guard
from slipstick.contact.kernel.compilation import INTERPRETED, is_compiled, is_interpreted
from slipstick.trig.compiled import cache_folder

if TYPE_CHECKING:
    from slipstick.case.case import Case

SMALL = 30
"""Unknowns up to which a curve of one contact takes less time interpreted than the compilation does: 5 s for 15 s."""
_COMPILE = "from slipstick.balance.kernel.compilation import compile_all; compile_all()"
_A_COMPILATION = 300.0
"""Seconds after which another compilation that has left nothing is taken as ended."""


def is_small(case: Case) -> bool:
    """Whether the curve is worth starting before the kernel is compiled."""
    wanted, problem = case.response, case.problem()
    more = wanted.judged or wanted.period_ratio is not None or problem.thermal is not None or "wear" in case.further
    return not more and len(problem.contacts) == 1 and case.balance.size <= SMALL


def start_interpreted(case: Case, tell: Callable[[str], None]) -> None:
    """Begin the command again without compilation, and compile beside it; returns where that is not worth it.

    The results are those of the compiled kernel: the functions are the same ones. Only on POSIX can a process
    begin again in its place, so that signals reach it; elsewhere the kernel is compiled first, as for large cases.
    """
    alone = (os.cpu_count() or 1) < 2
    if guard.command is None or os.name != "posix" or alone or is_interpreted() or is_compiled() or not is_small(case):
        return
    tell("the contact kernel is being compiled beside this, once on this machine: this small case runs without it")
    _compile_beside()
    again = [sys.executable, "-m", "slipstick", *guard.command]
    os.execve(sys.executable, again, os.environ | {INTERPRETED: "1"})


def _compile_beside() -> None:
    """Compile in a process that this command leaves behind, unless one of the last minutes is at it."""
    mark = cache_folder() / "compiling"
    if mark.exists() and time() - mark.stat().st_mtime < _A_COMPILATION:
        return
    mark.touch()
    null = subprocess.DEVNULL
    subprocess.Popen([sys.executable, "-c", _COMPILE], stdin=null, stdout=null, stderr=null, start_new_session=True)
