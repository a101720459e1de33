"""How the compiled functions of this package are compiled by numba, and cached on disk between processes.

The cache folder is named by the content of every file of the compiled rooms and by the version of numba. A function is
compiled again when one that it calls has changed, which numba alone would not notice, and environments with different
versions do not overwrite each other's files. Each function is given its folder; numba's configuration, which all code
of the process shares, is not changed.

Numba makes machine code of every function, optimised together with all that it calls: code that lies six calls deep is
optimised seven times. Functions that only compiled functions call (``part``) are therefore passed to their callers
unoptimised, and a complete caller is optimised as a whole. The results are the same, and the first compilation takes
two thirds of the time.

Numba has no public interface for either. Where its private interface differs from the one used here, functions are
compiled as numba does it by itself.
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
from numba.core import types

from slipstick import __version__

try:
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import Compiler
except ImportError:
    JITCodeLibrary = Compiler = object  # type: ignore[assignment, misc]

FAST = {"reassoc", "contract", "nsz", "arcp"}
"""Freedoms of floating-point arithmetic: sums may be reordered; infinities and NaN keep their meaning."""

SMALL = 6
"""Largest number of functions in a part that is optimised alone: its short loops are then vectorised."""

ROOMS = (
    "trig", "solve/linear", "contact/kernel", "contact/kernel/planar", "structure/kernel", "balance/kernel",
    "analysis/stability", "analysis/time_domain/kernel",
)  # fmt: skip
"""Folders of the package with compiled code: their content is part of the key of the cache."""


def compiled(
    function: Callable[..., Any] | None = None, *, allocates: bool = False, entry: bool | None = None, **options: Any
) -> Any:
    """Decorator: compile with numba at the first call; with NUMBA_DISABLE_JIT=1 functions stay Python.

    Functions that make no new arrays go without reference counts (see ``uncounted``). Such functions may return arrays
    to each other, but not to one that ``allocates``.
    An ``entry`` is called from Python and cached on disk; by default a function that ``allocates`` is one. Others are
    parts of compiled functions (see ``PartCode``).
    """
    if function is None:
        return lambda f: compiled(f, allocates=allocates, entry=entry, **options)
    defaults: dict[str, Any] = {"fastmath": FAST, "error_model": "numpy", **({} if allocates else uncounted())}
    called_from_python = allocates if entry is None else entry
    dispatcher = numba.njit(**{**defaults, **({} if called_from_python else as_part()), **options})(function)
    if dispatcher is not function:
        without_literals(dispatcher)
        if called_from_python:
            cache_on_disk(dispatcher)
    return dispatcher


def uncounted() -> dict[str, bool]:
    """Option that omits reference counts; no option where numba does not have it.

    Counting costs atomic operations for every slice: without this option, which is a private one of numba's, a batch of
    elements takes one and a half times as long. The results are the same.
    """
    try:
        from numba.core.cpu import CPUTargetOptions
    except ImportError:
        return {}
    return {"_nrt": False} if hasattr(CPUTargetOptions, "_nrt") else {}


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
    """The folder, created where missing, if only this user can write there: its files are executed.

    In a folder open to all, such as /tmp, another user may have created it first: it and its parent must be ours.
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
    """Cache folder of one function, as numba's cache expects it."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._py_file = function.__code__.co_filename
        self._name = f"{function.__module__}-{function.__code__.co_firstlineno}"

    def get_cache_path(self) -> str:
        """The folder."""
        return str(cache_folder())

    def ensure_cache_path(self) -> None:
        """Create the folder again if it was removed since it was chosen."""
        os.makedirs(self.get_cache_path(), mode=0o700, exist_ok=True)

    def get_source_stamp(self) -> str:
        """Key that must match for a cached function to be used."""
        return code_key()

    def get_disambiguator(self) -> str:
        """Text that distinguishes functions of one name."""
        return self._name


def cache_on_disk(dispatcher: Any) -> None:
    """Make numba load a compiled function from the folder, and store it there.

    Where numba's private interface differs, the function is compiled in each process, with a warning.
    """
    try:
        from numba.core import caching

        kind: Any = type("Kept", (caching.CompileResultCacheImpl,), {"__init__": _place})
        found = {"_impl_class": kind, "load_overload": _without_compiler(caching.FunctionCache._load_overload)}
        dispatcher._cache = type("KeptFunction", (caching.FunctionCache,), found)(dispatcher.py_func)
    except (ImportError, AttributeError, TypeError):
        _warn()


def _without_compiler(load: Callable[..., Any]) -> Callable[..., Any]:
    """Numba's loading of a function without its compiler set-up, which takes 0.2 s.

    A function that is not in the cache is compiled, which makes the set-up.
    """
    from numba.core.runtime import rtsys

    def load_overload(self: Any, signature: Any, target: Any) -> Any:
        rtsys.initialize(target)
        with self._guard_against_spurious_io_errors():
            return load(self, signature, target)

    return load_overload


def _place(self: Any, function: Callable[..., Any]) -> None:
    """Set what numba's own initialiser sets, which takes the folder from its configuration."""
    self._lineno = function.__code__.co_firstlineno
    self._locator = CachePlace(function)
    self._filename_base = self.get_filename_base(function.__qualname__, getattr(sys, "abiflags", ""))


@cache
def _warn() -> None:
    warnings.warn(
        f"numba {numba.__version__} keeps compiled functions in another way: the contact kernel is compiled "
        "in each process, which takes 10 to 30 s; an older numba keeps it",
        RuntimeWarning,
        stacklevel=2,
    )


class PartCode(JITCodeLibrary):
    """The code of a part, and of all that it calls."""

    def _optimize_final_module(self) -> None:
        if sum(not function.is_declaration for function in self._final_module.functions) <= SMALL:
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        """Finish without machine code."""
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """None: there is no entry from Python."""
        return 0

    @property
    def codegen(self) -> Any:
        """Receiver of the environment of an entry from Python: this object, which ignores it."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Ignore it."""


class PartCompiler(Compiler):
    """Numba's compiler with ``PartCode`` as its result."""

    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        super().__init__(typing, target, library or PartCode(target.codegen(), "part"), *rest)


def as_part() -> dict[str, Any]:
    """Options of a part, for the numba that is installed."""
    used = ("_optimize_final_module", "_finalize_final_module", "_finalize_dynamic_globals")
    known = all(hasattr(JITCodeLibrary, name) for name in used)
    compiler = {"pipeline_class": PartCompiler} if known else {}
    return {**compiler, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def without_literals(dispatcher: Any) -> None:
    """Give literal numbers in a call their plain type: numba would compile a version for each value."""
    template: Callable[..., Any] = dispatcher.get_call_template

    def of_types(args: Any, named: dict[str, Any]) -> Any:
        return template([types.unliteral(a) for a in args], {k: types.unliteral(a) for k, a in named.items()})

    dispatcher.get_call_template = of_types


inlined: Any = compiled(forceinline=True)
"""Decorator for the small functions of the innermost loops: compiled into their callers."""

part: Any = compiled(allocates=True, entry=False)
"""Decorator for functions that make new arrays and are called by compiled functions alone."""
