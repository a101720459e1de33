"""The verb ``init``: the examples, written where a user wants them."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from slipstick.cli.examples import Example, example, examples
from slipstick.cli.names import OF_TABLES, command_name
from slipstick.cli.options import example_names
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import say
from slipstick.cli.verb import verb
from slipstick.errors import InputError
from slipstick.replacing import make_folder, writing


@verb
def init(
    answer: Answer,
    example: Annotated[
        str | None, typer.Argument(help="Name of an example; without it they are listed.", autocompletion=example_names)
    ] = None,
    folder: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="Where to write it; here by default.")] = None,
    python: Annotated[
        bool, typer.Option("--python", help="Write the Python script instead; EXAMPLE may be a case file of your own.")
    ] = False,
    listed: Annotated[bool, typer.Option("--list", help="List the examples.")] = False,
) -> None:
    """Write a commented example case, or the same as a Python script."""
    if example is None or listed:
        list_examples()
        answer["examples"] = [{"name": e.name, "about": e.about, "case": e.is_case} for e in examples().values()]
    else:
        answer["files"] = write_example(example, folder, python=python)


def list_examples() -> None:
    """Print the examples."""
    known = examples().values()
    say("Examples, to be written with 'slipstick init NAME [DIR]':")
    _listed(e for e in known if e.is_case)
    say("and scripts:")
    _listed(e for e in known if not e.is_case)


def _listed(listing: Iterable[Example]) -> None:
    """A line each, no wider than the terminal."""
    listing = list(listing)
    column = max(len(one.name) for one in listing) + 2
    width = max(shutil.get_terminal_size().columns - column - 3, 20)
    for one in listing:
        say(f"  {one.name:<{column}}{textwrap.shorten(one.about, width, placeholder=' ...')}")


def write_example(name: str, folder: Path | None, *, python: bool = False) -> list[Path]:
    """Write an example and the files it needs into ``folder``, or its script; the files written.

    With ``python`` the name may be that of a case file of one's own, whose script is written beside it.

    Raises
    ------
    InputError
        If there is no such example, or a file of that name is there already.
    """
    if python and Path(name).is_file():
        return _own_script(Path(name), folder)
    if Path(name).is_file() and Path(name).stem not in examples():
        raise InputError(f"{name}: is a file, no example; of a case file, --python writes the script")
    chosen = example(name)
    main = (chosen.path.name, chosen.path.read_bytes())
    if python and chosen.is_case:
        main = _script(chosen.path, chosen.path.read_text(encoding="utf-8"))
    written = write_files(folder or Path(), dict([main, *((path.name, path.read_bytes()) for path in chosen.needs)]))
    say(f"next: {'python' if written[0].suffix == '.py' else f'slipstick {_verb_of(chosen)}'} {written[0]}")
    return written


def _verb_of(case: Example) -> str:
    """The verb that an example case is for: that of its own table, else ``run``."""
    import tomllib

    tables = tomllib.loads(case.path.read_text(encoding="utf-8"))
    return next((command_name(name) for name in (*OF_TABLES, "run_up", "study") if name in tables), "run")


def _script(path: Path, text: str) -> tuple[str, bytes]:
    """Name and content of the script of a case."""
    from slipstick.case.script import python_script

    return f"{path.stem}.py", python_script(text, path.name, path.parent).encode()


def _own_script(path: Path, folder: Path | None) -> list[Path]:
    """The script of a case, which must have no faults, beside the files it names."""
    from slipstick.case.case import Case

    if folder is not None:
        raise InputError(
            f"{folder}: the script of a case is written beside the case, whose files it reads; give no folder"
        )
    case = Case.from_file(path, say)
    written = write_files(path.parent, dict([_script(path, case.text)]))
    say(f"next: python {written[0]}")
    return written


def write_files(folder: Path, contents: dict[str, bytes]) -> list[Path]:
    """Write files by name into a folder: whole or not at all, the first one after those that it needs.

    What it needs may be there already if it is the same. Raises InputError where it differs, the first one is there, or
    the folder cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: found a file; expected a folder")
    main = next(iter(contents))
    found = {name for name in contents if (folder / name).exists()}
    kept = {name for name in found - {main} if _holds(folder / name, contents[name])}
    if there := [str(folder / name) for name in contents if name in found - kept]:
        are, them = ("is", "it") if len(there) == 1 else ("are", "them")
        raise InputError(f"{', '.join(there)}: {are} there already; move {them} away or choose another folder")
    make_folder(folder)
    for name in [*(name for name in contents if name != main), main]:
        if name not in kept:
            with writing(folder / name) as temporary:
                temporary.write_bytes(contents[name])
        say(f"{'kept' if name in kept else 'wrote'} {folder / name}{', the same' if name in kept else ''}")
    return [folder / name for name in contents]


def _holds(path: Path, content: bytes) -> bool:
    """Whether a file has this content; one that cannot be read does not."""
    try:
        return path.read_bytes() == content
    except OSError:
        return False
