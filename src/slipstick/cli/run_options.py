"""How a computation goes, and which of its ends can be gone on from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from slipstick.cli.output import FIGURES, FORMATS
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import say
from slipstick.errors import InputError, Outcome

UNFINISHED = (Outcome.INTERRUPTED, Outcome.TIME_LIMIT)
"""Outcomes of a run that can be gone on with."""


@dataclass(frozen=True)
class Wanted:
    """Names of the figures, and formats; or all figures that say something (``all_there``)."""

    names: tuple[str, ...] = ()
    formats: tuple[str, ...] = ("png",)
    all_there: bool = False


NO_FIGURES = Wanted()


def wanted_figures(names: str | None, formats: str | None) -> Wanted:
    """What ``--figures`` and ``--format`` ask for; raises InputError for what is not known."""
    everything = names is not None and names.strip() == "all"
    chosen = FIGURES if everything else _chosen("--figures", names, FIGURES, ' or "all"')
    if formats is not None and not chosen:
        raise InputError("--format: found no figures to draw; choose with --figures, such as --figures response")
    return Wanted(chosen, _chosen("--format", formats, FORMATS) or ("png",), everything)


def _chosen(option: str, given: str | None, known: Sequence[str], more: str = "") -> tuple[str, ...]:
    found = tuple(dict.fromkeys(name.strip() for name in (given or "").split(",") if name.strip()))
    for name in found:
        if name not in known:
            raise InputError(f"{option}: found '{name}'; expected {', '.join(known)}{more}, with commas between")
    if given is not None and not found:
        raise InputError(f"{option}: found nothing; expected {', '.join(known)}{more}, with commas between")
    return found


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Options of a run: what is drawn and shown, and after how many seconds it ends."""

    figures: bool = True
    """Whether any are drawn: those of a study, and of a run those that are wanted."""
    wanted: Wanted = NO_FIGURES
    report: bool = True
    quiet: bool = False
    time_limit: float | None = None
    answer: Answer | None = None
    """What is found goes here too."""

    @property
    def tell(self) -> Callable[[str], None]:
        """What is said on the way."""
        return (lambda _: None) if self.quiet else say


PLAIN = RunOptions()


def run_options(
    time_limit: str | None, wanted: tuple[str | None, str | None] = (None, None), **others: Any
) -> RunOptions:
    """Options as the command line gives them; raises InputError for what is not known or does not go together."""
    from slipstick.quantities import read_duration

    if wanted[0] is not None and not others["figures"]:
        raise InputError("--no-figures: --figures is given too; leave one of them out")
    try:
        seconds = None if time_limit is None else read_duration(time_limit)
    except ValueError as error:
        raise InputError(f"--time-limit: found '{time_limit}'; {error}") from None
    return RunOptions(time_limit=seconds, wanted=wanted_figures(*wanted), **others)
