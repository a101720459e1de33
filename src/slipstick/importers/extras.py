"""Readers kept by others, loaded on use."""

from __future__ import annotations

from importlib import import_module
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
