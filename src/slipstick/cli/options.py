"""Options and arguments that several verbs have, what they make, and what a shell offers for them; nothing heavy."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import shorten
from typing import Annotated

import typer
from typer.models import OptionInfo

from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import say
from slipstick.errors import InputError
from slipstick.runs.folder import FIGURES, FORMATS


def example_names(incomplete: str) -> list[tuple[str, str]]:
    """Examples whose name begins so, with what they show."""
    from slipstick.cli.examples import examples

    fitting = (example for example in examples().values() if example.name.startswith(incomplete))
    return [(example.name, shorten(example.about, 50, placeholder=" ...")) for example in fitting]


def case_files(incomplete: str) -> list[str]:
    """Case files, and folders on the way to them."""
    return files(incomplete, (".toml",))


def results_files(incomplete: str) -> list[str]:
    """Results files, and folders on the way to them."""
    return files(incomplete, (".nc",))


def files(incomplete: str, endings: Iterable[str]) -> list[str]:
    """Files of some endings and folders, below what was typed so far; hidden ones only where a dot was typed."""
    folder, _, start = incomplete.rpartition("/")
    where = Path(f"{folder}/" if folder or incomplete.startswith("/") else ".").expanduser()
    prefix = incomplete[: len(incomplete) - len(start)]
    try:
        paths = sorted(path for path in where.iterdir() if path.name.startswith(start))
    except OSError:
        return []
    shown = [path for path in paths if start.startswith(".") or not path.name.startswith(".")]
    return [
        f"{prefix}{path.name}{'/' if path.is_dir() else ''}"
        for path in shown
        if path.is_dir() or path.suffix in tuple(endings)
    ]


CasePath = Annotated[
    Path, typer.Argument(metavar="CASE.toml", help="The case file.", show_default=False, autocompletion=case_files)
]


def refuse_file(path: Path, *, force: bool) -> None:
    """Raises InputError for a file that is there already, unless it may be replaced."""
    if path.is_file() and not force:
        raise InputError(f"{path}: is there already; choose another name, or --force to replace it")


def folder_option(by_default: str) -> OptionInfo:
    """The option that names the folder of the results."""
    return typer.Option("-o", "--output", help=f"Folder of the results; by default {by_default}, here.")


Force = Annotated[bool, typer.Option("--force", help="Replace earlier results, once the new ones are complete.")]
ForceFile = Annotated[bool, typer.Option("--force", help="Replace the file, if it is there already.")]
Figures = Annotated[
    str | None,
    typer.Option("--figures", help='Draw these too: "all", or names such as "response,loop".', metavar="NAMES"),
]
Formats = Annotated[
    str | None, typer.Option("--format", help="Of the figures: png (the default), svg, pdf.", metavar="FORMATS")
]
NoFigures = Annotated[bool, typer.Option("--no-figures", help="Draw none, also of a study.")]
Report = Annotated[bool, typer.Option(help="Write report.html.")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="No progress.")]
TimeLimit = Annotated[
    str | None,
    typer.Option("--time-limit", help='End after this time, such as "90 s" or "2 h"; resume goes on.', metavar="TIME"),
]
KeptTimeLimit = Annotated[
    str | None,
    typer.Option("--time-limit", help='End after this time, such as "90 s" or "2 h"; the best so far is kept.',
                 metavar="TIME"),
]  # fmt: skip


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


def _chosen(option: str, text: str | None, known: Sequence[str], more: str = "") -> tuple[str, ...]:
    names = tuple(dict.fromkeys(name.strip() for name in (text or "").split(",") if name.strip()))
    wrong = next(
        (f"'{name}'" for name in names if name not in known), "nothing" if text is not None and not names else ""
    )
    if wrong:
        raise InputError(f"{option}: found {wrong}; expected {', '.join(known)}{more}, with commas between")
    return names


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
    def until(self) -> float:
        """When the time of what begins now is up, of the monotonic clock."""
        return math.inf if self.time_limit is None else time.monotonic() + self.time_limit

    @property
    def tell(self) -> Callable[[str], None]:
        """What is said on the way."""
        return (lambda _: None) if self.quiet else say


PLAIN = RunOptions()


def run_options(
    time_limit: str | None,
    wanted: tuple[str | None, str | None] = (None, None),
    *,
    figures: bool,
    report: bool,
    quiet: bool,
    answer: Answer,
) -> RunOptions:
    """Options as the command line gives them; raises InputError for what is not known or does not go together."""
    from slipstick.quantities import read_duration

    if wanted[0] is not None and not figures:
        raise InputError("--no-figures: --figures is given too; leave one of them out")
    try:
        seconds = None if time_limit is None else read_duration(time_limit)
    except ValueError as error:
        raise InputError(f"--time-limit: found '{time_limit}'; {error}") from None
    return RunOptions(
        figures=figures, wanted=wanted_figures(*wanted), report=report, quiet=quiet, time_limit=seconds, answer=answer
    )
