"""The ``init`` verb: commented example cases, packaged with the program."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path

from slipstick.app.guard import say
from slipstick.app.sentences import suggestion
from slipstick.errors import InputError

_EXTRA = {"blade_reduced": ("blade_reduced.npz",)}


def examples() -> dict[str, str]:
    """Names of the examples and what each shows (the first line of its file)."""
    folder = files("slipstick.app") / "templates"
    paths = sorted((p for p in folder.iterdir() if p.name.endswith(".toml")), key=lambda p: p.name)
    return {p.name.removesuffix(".toml"): p.read_text(encoding="utf-8").splitlines()[0].lstrip("# ") for p in paths}


def list_examples() -> None:
    """Print the examples."""
    say("Examples, to be written with 'slipstick init NAME [DIR]':")
    for name, about in examples().items():
        say(f"  {name:<16} {about}")


def write_example(name: str, folder: Path) -> list[Path]:
    """Write an example and the files it needs into ``folder``; the files written.

    Raises
    ------
    InputError
        If there is no such example, or a file of that name is there already.
    """
    known = examples()
    name = name.removesuffix(".toml")
    if name not in known:
        raise InputError(f"there is no example '{name}'; {suggestion(name, known)}")
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: found a file; expected a folder")
    names = (f"{name}.toml", *_EXTRA.get(name, ()))
    there = [folder / n for n in names if (folder / n).exists()]
    if there:
        raise InputError([f"{path}: is there already; move it away or choose another folder" for path in there])
    folder.mkdir(parents=True, exist_ok=True)
    with as_file(files("slipstick.app") / "templates") as source:
        for n in names:
            (folder / n).write_bytes((source / n).read_bytes())
            say(f"wrote {folder / n}")
    say(f"next: slipstick run {folder / names[0]}")
    return [folder / n for n in names]
