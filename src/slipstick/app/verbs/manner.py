"""How a computation goes, and which of its ends can be gone on from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from slipstick.app.terminal.answers import Answer
from slipstick.app.terminal.guard import say
from slipstick.app.verbs.output import FIGURES, FORMATS
from slipstick.case.structure import silent
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
class Manner:
    """How a run goes: what is drawn and shown, and after how many seconds it ends."""

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
        return silent if self.quiet else say


PLAIN = Manner()
