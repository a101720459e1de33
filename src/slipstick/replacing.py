"""Files that are replaced as a whole or not at all, and the one sentence where that fails."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import get_ident

from slipstick.errors import InputError


@dataclass(frozen=True)
class Kind:
    """Files that may take each other's place."""

    name: str
    mark: bytes = b""
    """What they have near their beginning; without one any file of the name may be replaced."""

    def has(self, path: Path) -> bool:
        """Whether a file is of this kind; an empty one may become anything."""
        with path.open("rb") as stream:
            begin = stream.read(_BEGIN)
        return not begin or self.mark in begin


ANY, HDF5, XML = Kind("file"), Kind("netCDF or HDF5 file", b"\x89HDF\r\n\x1a\n"), Kind("XML file", b"<?xml")
_BEGIN = 2000
"""Bytes that show what a file is."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary name beside ``path`` that takes its place at the end; on any failure ``path`` stays as it was.

    It is another one in each process and thread: two writers of one name do not write into each other.
    """
    temporary = path.parent / f"{_begin(path)}{os.getpid()}-{get_ident()}.tmp"
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise OSError("found a device; expected a file")
    try:
        yield temporary
        _sync(temporary)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def writing(path: Path, kind: Kind = ANY) -> Iterator[Path]:
    """As ``replacing``; InputError where the file cannot be written, or one of another kind is there."""
    with telling(path):
        if path.is_file() and not kind.has(path):
            raise InputError(f"{path}: there is a file that is no {kind.name}; choose another name")
        with replacing(path) as temporary:
            yield temporary


@contextmanager
def telling(path: Path) -> Iterator[None]:
    """Make failures of the operating system in the block an InputError that names the file, or the folder."""
    try:
        yield
    except OSError as error:
        raise unwritable(path, _reason(path, error)) from None


def make_folder(path: Path) -> None:
    """Make a folder, with those above it, unless it is there; InputError where that fails."""
    with telling(path):
        path.mkdir(parents=True, exist_ok=True)


def unwritable(path: str | Path, reason: str) -> InputError:
    """What is raised where a file or a folder cannot be written."""
    return InputError(f"{path}: cannot be written ({reason}); choose another place")


def _reason(path: Path, error: OSError) -> str:
    if isinstance(error, FileNotFoundError) and not path.parent.exists():
        return f"there is no folder {path.parent}"
    if isinstance(error, FileExistsError):
        return "found a file; expected a folder"
    return (error.strerror or str(error) or type(error).__name__).lower()


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
