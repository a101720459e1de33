"""Files that are replaced as a whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import get_ident


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary name beside ``path`` that takes its place at the end; on any failure ``path`` stays as it was.

    It is another one in each process and thread: two writers of one name do not write into each other.
    """
    temporary = path.parent / f"{_begin(path)}{os.getpid()}-{get_ident()}.tmp"
    try:
        yield temporary
        _sync(temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def remove_leftovers(path: Path) -> None:
    """Remove the unfinished files that killed writers of ``path`` left; only for whom no other writer disturbs."""
    for part in path.parent.iterdir():
        if part.name.startswith(_begin(path)) and part.name.endswith(".tmp"):
            part.unlink(missing_ok=True)


def _begin(path: Path) -> str:
    """How the temporary names of a file begin."""
    return f".{path.name}."


def _sync(path: Path) -> None:
    """Bring a file to the disk itself before it takes another's place: a power failure finds one of the two whole."""
    file = os.open(path, os.O_RDWR)
    try:
        os.fsync(file)
    finally:
        os.close(file)
