"""Where the compiled functions of this package are kept between processes.

The folder is named by the content of every file of the compiled rooms and by the version of numba: a function is
compiled again when one it calls has changed, which numba alone would not notice, and environments with different
versions do not overwrite each other's files. Numba is told for each function; its configuration, which everybody in
the process shares, is left alone.
"""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import tempfile
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba

from slipstick import __version__

ROOMS = (
    "trig", "solve/linear", "contact/kernel", "contact/kernel/planar", "structure/kernel", "balance/kernel",
    "analysis/stability", "analysis/time_domain/kernel",
)  # fmt: skip
"""Folders of the package with compiled code."""


@cache
def code_key() -> str:
    """Key of all compiled code."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256(f"{__version__} {numba.__version__}".encode())
    for path in sorted(path for room in ROOMS for path in (package / room).glob("*.py")):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def cache_folder() -> Path:
    """Folder of the compiled functions: the user's cache, or a temporary one where that cannot be written."""
    for root in _roots():
        try:
            if folder := _private(root / code_key()):
                return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix="slipstick-"))


def _private(folder: Path) -> Path | None:
    """The folder, made if need be, where nobody else can write: what lies in it is executed.

    Somebody else may have made it first where all may write, such as /tmp: it and the one above it must be ours.
    """
    folder.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    if hasattr(os, "getuid"):
        for known in (folder.parent.lstat(), folder.lstat()):
            if not stat.S_ISDIR(known.st_mode) or known.st_uid != os.getuid() or known.st_mode & 0o022:
                return None
        folder.chmod(0o700)
    with tempfile.TemporaryFile(dir=folder):
        return folder


def _roots() -> list[Path]:
    chosen = [
        os.environ[name] for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA") if os.environ.get(name)
    ]
    home = Path(os.path.expanduser("~"))
    usual = home / "Library" / "Caches" if sys.platform == "darwin" else home / ".cache"
    shared = f"slipstick-{os.getuid()}" if hasattr(os, "getuid") else "slipstick"
    return [*(root / "slipstick" for root in (*map(Path, chosen), usual)), Path(tempfile.gettempdir()) / shared]


class CachePlace:
    """Where one function is kept, in the words of numba's cache."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._py_file = function.__code__.co_filename
        self._name = f"{function.__module__}-{function.__code__.co_firstlineno}"

    def get_cache_path(self) -> str:
        """The folder."""
        return str(cache_folder())

    def ensure_cache_path(self) -> None:
        """It was made when it was chosen; it may have been removed since."""
        os.makedirs(self.get_cache_path(), mode=0o700, exist_ok=True)

    def get_source_stamp(self) -> str:
        """What must be equal for a kept function to be used."""
        return code_key()

    def get_disambiguator(self) -> str:
        """What tells functions of one name apart."""
        return self._name


def keep(dispatcher: Any) -> None:
    """Let numba find a compiled function in the folder, and leave it there.

    Numba has no public way to say this for one function; where its own ways are others than those known here, the
    function is compiled anew in each process, and that is said.
    """
    try:
        from numba.core import caching

        kind: Any = type("Kept", (caching.CompileResultCacheImpl,), {"__init__": _place})
        found = {"_impl_class": kind, "load_overload": _without_rules(caching.FunctionCache._load_overload)}
        dispatcher._cache = type("KeptFunction", (caching.FunctionCache,), found)(dispatcher.py_func)
    except (ImportError, AttributeError, TypeError):
        _warn()


def _without_rules(load: Callable[..., Any]) -> Callable[..., Any]:
    """Numba's way to load a function, without making its rules of compilation ready first, which takes 0.2 s.

    A function that is not found is compiled, and the rules are made ready there.
    """
    from numba.core.runtime import rtsys

    def load_overload(self: Any, signature: Any, target: Any) -> Any:
        rtsys.initialize(target)
        with self._guard_against_spurious_io_errors():
            return load(self, signature, target)

    return load_overload


def _place(self: Any, function: Callable[..., Any]) -> None:
    """What numba's own initialisation sets, which looks into its configuration for the place."""
    self._lineno = function.__code__.co_firstlineno
    self._locator = CachePlace(function)
    self._filename_base = self.get_filename_base(function.__qualname__, getattr(sys, "abiflags", ""))


@cache
def _warn() -> None:
    warnings.warn(
        f"numba {numba.__version__} has changed how it keeps compiled functions: the contact kernel is compiled "
        "in each process, 10 to 30 s; an older numba keeps it",
        RuntimeWarning,
        stacklevel=2,
    )
