"""Cases computed into folders, and gone on with: everything is kept as it comes, nothing is printed."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__all__ = ["run_up"]

if TYPE_CHECKING:
    from slipstick.runs.passing_through import run_up as run_up


def __getattr__(name: str) -> Any:
    if name != "run_up":
        raise AttributeError(f"module 'slipstick.runs' has no attribute '{name}'")
    return import_module("slipstick.runs.passing_through").run_up
