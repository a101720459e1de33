"""Cases computed into folders, and gone on with: everything is kept as it comes, nothing is printed."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

_PUBLIC = {"run_up": "slipstick.runs.passing_through", "save_table": "slipstick.runs.tables"}

__all__ = sorted(_PUBLIC)

if TYPE_CHECKING:
    from slipstick.runs.passing_through import run_up as run_up
    from slipstick.runs.tables import save_table as save_table


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'slipstick.runs' has no attribute '{name}'")
    return getattr(import_module(_PUBLIC[name]), name)
