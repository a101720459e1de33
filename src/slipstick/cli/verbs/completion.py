"""What a shell offers for an argument: names of examples, case files, results files. Nothing heavy is imported."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from textwrap import shorten


def example_names(incomplete: str) -> list[tuple[str, str]]:
    """Examples whose name begins so, with what they show."""
    from slipstick.cli.verbs.examples import examples

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
