"""How the compiled functions of this package are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

from slipstick.trig.compile_cache import keep
from slipstick.trig.parts import as_part, without_literals

FAST = {"reassoc", "contract", "nsz", "arcp"}
"""Floating-point freedoms: sums may be reordered; infinities and NaN stay honest."""


def compiled(
    function: Callable[..., Any] | None = None, *, allocates: bool = False, entry: bool | None = None, **options: Any
) -> Any:
    """Decorator: compile with numba at the first call; with NUMBA_DISABLE_JIT=1 they stay Python.

    Functions that make no new arrays go without reference counts (see ``uncounted``). Such functions may return arrays
    to each other, but not to one that ``allocates``.
    An ``entry`` is called from Python and kept on disk: what allocates is one, unless it is said not to be. Others are
    parts of compiled functions (see ``trig.parts``).
    """
    if function is None:
        return lambda f: compiled(f, allocates=allocates, entry=entry, **options)
    defaults: dict[str, Any] = {"fastmath": FAST, "error_model": "numpy", **({} if allocates else uncounted())}
    called_from_python = allocates if entry is None else entry
    dispatcher = numba.njit(**{**defaults, **({} if called_from_python else as_part()), **options})(function)
    if dispatcher is not function:
        without_literals(dispatcher)
        if called_from_python:
            keep(dispatcher)
    return dispatcher


def uncounted() -> dict[str, bool]:
    """Option that leaves out reference counts, or none where numba does not know it.

    Counting costs atomic operations for every slice: without this option, which is a private one of numba's, a batch of
    elements takes one and a half times as long. The results are the same.
    """
    try:
        from numba.core.cpu import CPUTargetOptions
    except ImportError:
        return {}
    return {"_nrt": False} if hasattr(CPUTargetOptions, "_nrt") else {}


inlined: Any = compiled(forceinline=True)
"""Decorator for the small functions of the innermost loops: compiled into their callers."""

part: Any = compiled(allocates=True, entry=False)
"""Decorator for functions that make new arrays and are called by compiled functions alone."""
