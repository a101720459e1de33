"""Files a case names: they must lie in the case's own folder, because a case may come from somebody else."""

from __future__ import annotations

from pathlib import Path, PurePosixPath, PureWindowsPath

from slipstick.case.sentences import toml
from slipstick.errors import Fault, InputError

_COPY = "copy the file beside the case and name it relatively"


def inside(folder: Path, name: str) -> Path:
    """The file ``name`` in ``folder``; raises InputError where it leaves the folder or is no file."""
    pure = PurePosixPath(name.replace("\\", "/"))
    if "\0" in name or not name.strip():
        raise InputError(Fault(found=toml(name), expected="the name of a file in the folder of the case"))
    if pure.is_absolute() or PureWindowsPath(name).drive or ".." in pure.parts:
        raise _refused(name, "the path leaves the folder of the case", _COPY)
    path = folder / pure
    real, home = path.resolve(), folder.resolve()
    if not real.is_relative_to(home):
        raise _refused(name, "the link leads out of the folder of the case", "copy the file itself beside the case")
    if not real.is_file():
        raise _refused(name, f"there is no such file in {home}", "check its name")
    return path


def _refused(name: str, why: str, remedy: str) -> InputError:
    return InputError(Fault(found=toml(name), statement=why, remedy=remedy))
