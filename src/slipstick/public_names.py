"""Public names of a package that are imported on first use, so that importing the package does no work."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def on_first_use(
    package: str, modules: Mapping[str, str], subpackages: Sequence[str] = ()
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """``__getattr__`` and ``__dir__`` of a package.

    Parameters
    ----------
    package
        Its name, as ``"slipstick.models"``.
    modules
        The module of each public name.
    subpackages
        Reached by their names.
    """

    def get(name: str) -> Any:
        if name in subpackages:
            return import_module(f"{package}.{name}")
        if name in modules:
            return getattr(import_module(modules[name]), name)
        from slipstick.errors import close_names

        close = close_names(name, [*modules, *subpackages])
        hint = f"; did you mean '{close[0]}'?" if close else ""
        raise AttributeError(f"module '{package}' has no attribute '{name}'{hint}")

    def names() -> list[str]:
        return sorted([*modules, *subpackages])

    return get, names
