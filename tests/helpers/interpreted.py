"""The compiled rooms as plain Python, so that each inner function can be called and stepped through."""

from __future__ import annotations

import importlib
import sys
from functools import cache
from types import ModuleType

import numba

ROOMS = ("slipstick.trig", "slipstick.contact.kernel")


@cache
def interpreted(name: str) -> ModuleType:
    """A module such as "contact.kernel.element" whose functions, and all they call, are not compiled."""
    return _modules()[f"slipstick.{name}"]


@cache
def _modules() -> dict[str, ModuleType]:
    for room in ROOMS:
        importlib.import_module(room)
    parents = {room: importlib.import_module(room.rpartition(".")[0]) for room in ROOMS}
    kept = {name: sys.modules.pop(name) for name in list(sys.modules) if name.startswith(ROOMS)}
    before, numba.config.DISABLE_JIT = numba.config.DISABLE_JIT, 1
    try:
        for name in ("contact.kernel.batch", "trig.extremes", "trig.integrals"):
            importlib.import_module(f"slipstick.{name}")
        return {name: module for name, module in sys.modules.items() if name.startswith(ROOMS)}
    finally:
        numba.config.DISABLE_JIT = before
        for name in [name for name in sys.modules if name.startswith(ROOMS)]:
            del sys.modules[name]
        sys.modules.update(kept)
        for room, parent in parents.items():
            setattr(parent, room.rpartition(".")[2], kept[room])
