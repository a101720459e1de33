"""How the compiled functions of this package are compiled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

from slipstick.trig.compile_cache import keep

FAST = {"reassoc", "contract", "nsz", "arcp"}
"""Floating-point freedoms: sums may be reordered; infinities and NaN stay honest."""


def compiled(function: Callable[..., Any] | None = None, *, allocates: bool = False, **options: Any) -> Any:
    """Decorator: compile with numba at the first call, kept on disk; with NUMBA_DISABLE_JIT=1 they stay Python.

    Functions that make no new arrays go without reference counts (see ``uncounted``). Such functions may return arrays
    to each other, but not to one that ``allocates``.
    """
    if function is None:
        return lambda f: compiled(f, allocates=allocates, **options)
    defaults: dict[str, Any] = {"fastmath": FAST, "error_model": "numpy"}
    # without arrays of their own they are called by compiled functions alone: no entry from Python is made for them
    inner = {**uncounted(), "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    dispatcher = numba.njit(**{**defaults, **({} if allocates else inner), **options})(function)
    if allocates and dispatcher is not function:
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
