"""Lock of a folder for one writer at a time, which the operating system releases when the process ends."""

from __future__ import annotations

import json
import os
import platform
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from slipstick.errors import InputError

NAME = ".slipstick.lock"
_LOCKED_BYTE = 1 << 30  # behind the text: on Windows others cannot read a locked byte


class FolderLock:
    """Held from its construction to :meth:`release`, or to the end of the process.

    The file names its holder, but only the lock on it counts: the file of a killed process blocks no other.
    On a file system without locks there is none. ``name`` is that of the lock: several may be held in one folder.

    Raises
    ------
    InputError
        If another run holds it; the sentence says which.
    OSError
        If the file cannot be made.
    """

    def __init__(self, folder: Path, name: str = NAME) -> None:
        self._path = folder / name
        while True:
            self._file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                if not _locked(self._file):
                    raise InputError(
                        f"{folder}: another run writes there ({_holder(self._file)}); wait for its end, or choose "
                        "another folder with -o"
                    )
                if self._is_current():
                    break
            except BaseException:
                os.close(self._file)
                raise
            os.close(self._file)  # the run before removed the file after it was opened here
        os.ftruncate(self._file, 0)
        os.write(self._file, json.dumps(_myself()).encode())

    def release(self) -> None:
        """Remove the file and release the lock."""
        if self._file < 0:
            return
        if os.name == "nt":  # an open file cannot be removed there
            self._close()
        with suppress(OSError):
            self._path.unlink(missing_ok=True)
        self._close()

    def _close(self) -> None:
        if self._file >= 0:
            os.close(self._file)
        self._file = -1

    def _is_current(self) -> bool:
        try:
            return os.path.samestat(os.fstat(self._file), os.stat(self._path))
        except FileNotFoundError:
            return False


def _locked(file: int) -> bool:
    """Lock the file: whether it is ours now; True too where the file system has no locks."""
    try:
        if os.name == "nt":
            import msvcrt

            windows: Any = msvcrt
            os.lseek(file, _LOCKED_BYTE, os.SEEK_SET)
            windows.locking(file, windows.LK_NBLCK, 1)
            os.lseek(file, 0, os.SEEK_SET)
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:
        return True
    return True


def _myself() -> dict[str, Any]:
    return {"process": os.getpid(), "host": platform.node(), "since": time.strftime("%Y-%m-%d %H:%M:%S")}


def _holder(file: int) -> str:
    try:
        os.lseek(file, 0, os.SEEK_SET)
        known = json.loads(os.read(file, 1000))
        return f"process {int(known['process'])} on {known['host']!s}, since {known['since']!s}"
    except (OSError, ValueError, KeyError, TypeError):
        return "its process is not known"
