"""Packages that read the files of other programs, where they are installed."""

from __future__ import annotations

import contextlib
import io
from importlib import import_module
from pathlib import Path
from typing import Any

from slipstick.errors import Fault, InputError


def require(module: str, distribution: str) -> Any:
    """The module, or one sentence that says how to get it.

    Raises
    ------
    InputError
        If the module cannot be imported.
    """
    try:
        return import_module(module)
    except ImportError:
        raise InputError(
            Fault(
                statement=f"this file is read with the package {distribution}, which is not installed",
                remedy="pip install slipstick[fe]",
            )
        ) from None


def read_by_meshio(path: Path) -> Any:
    """What meshio reads of a file: points, cells, their data and sets.

    Raises
    ------
    InputError
        If meshio is not installed, or cannot read it.
    """
    meshio = require("meshio", "meshio")
    printed = io.StringIO()
    try:
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
            return meshio.read(path)
    except (Exception, SystemExit) as error:
        said = " ".join((printed.getvalue() if isinstance(error, SystemExit) else str(error)).split())[:100]
        what = f"is damaged or not a mesh that meshio reads ({said})"
    raise InputError(Fault(path.name, what))
