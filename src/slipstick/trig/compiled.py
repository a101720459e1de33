"""How the compiled functions of this package are compiled and cached.

The cache lives in a folder named by the content of every compiled source and by the version of numba: a function is
compiled again when one it calls has changed, which numba alone would not notice, and environments with different
versions do not overwrite each other's files.
"""

from __future__ import annotations

import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba

FAST = {"reassoc", "contract", "nsz", "arcp"}
"""Floating-point freedoms: sums may be reordered; infinities and NaN stay honest."""

SOURCES = (
    *(f"trig/{name}.py" for name in ("compiled", "basis", "roots", "integrals", "extremes")),
    *(f"contact/{name}.py" for name in ("states", "critical", "steep", "kernel")),
)


@cache
def cache_folder() -> Path:
    """Folder of the compiled functions: the user's cache, or a temporary one where that cannot be written."""
    package = Path(__file__).parent.parent
    content = b"".join((package / name).read_bytes() for name in SOURCES)
    key = hashlib.sha256(content + numba.__version__.encode()).hexdigest()[:16]
    for root in _roots():
        try:
            if found := _private(root / key):
                return found
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
    given = [os.environ[name] for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA") if os.environ.get(name)]
    home = Path(os.path.expanduser("~"))
    usual = home / "Library" / "Caches" if sys.platform == "darwin" else home / ".cache"
    shared = f"slipstick-{os.getuid()}" if hasattr(os, "getuid") else "slipstick"
    return [*(root / "slipstick" for root in (*map(Path, given), usual)), Path(tempfile.gettempdir()) / shared]


def compiled(function: Callable[..., Any] | None = None, *, allocates: bool = False, **options: Any) -> Any:
    """Decorator: compile with numba, cached on disk.

    Functions that make no new arrays go without reference counts: counting costs atomic operations for every slice, a
    third of the kernel's time. Such functions may return arrays to each other, but not to one that ``allocates``.
    """
    if function is None:
        return lambda f: compiled(f, allocates=allocates, **options)
    config: Any = numba.config
    previous = config.CACHE_DIR
    config.CACHE_DIR = str(cache_folder())
    try:
        return numba.njit(
            **{
                "cache": True,
                "fastmath": FAST,
                "error_model": "numpy",
                "_nrt": allocates,
                **_inner(allocates),
                **options,
            }
        )(function)
    finally:
        config.CACHE_DIR = previous


def _inner(allocates: bool) -> dict[str, bool]:
    """Functions that make no arrays are called by compiled ones alone: no entry from Python is made for them."""
    return {} if allocates else {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


inlined: Any = compiled(forceinline=True)
"""Decorator for the small functions of the innermost loops: compiled into their callers."""
