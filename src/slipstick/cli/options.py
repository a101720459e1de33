"""Options and arguments that several verbs have, and what a shell offers for them. Nothing heavy is imported."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from textwrap import shorten
from typing import Annotated, Any

import typer


def example_names(incomplete: str) -> list[tuple[str, str]]:
    """Examples whose name begins so, with what they show."""
    from slipstick.cli.examples import examples

    found = (one for one in examples().values() if one.name.startswith(incomplete))
    return [(one.name, shorten(one.about, 50, placeholder=" ...")) for one in found]


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
        found = sorted(path for path in where.iterdir() if path.name.startswith(start))
    except OSError:
        return []
    shown = [path for path in found if start.startswith(".") or not path.name.startswith(".")]
    return [
        f"{prefix}{path.name}{'/' if path.is_dir() else ''}"
        for path in shown
        if path.is_dir() or path.suffix in tuple(endings)
    ]


CasePath = Annotated[
    Path, typer.Argument(metavar="CASE.toml", help="The case file.", show_default=False, autocompletion=case_files)
]


def folder_option(by_default: str) -> Any:
    """The option that names the folder of the results."""
    return typer.Option("-o", "--output", help=f"Folder of the results; by default {by_default}, here.")


Force = Annotated[bool, typer.Option("--force", help="Replace earlier results, once the new ones are complete.")]
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
