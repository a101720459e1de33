"""Compiled functions that only compiled functions call: how numba is spared work that would be thrown away.

Of every function numba makes machine code, optimised together with all that it calls: what lies six calls deep is
optimised seven times. A part is handed to its callers as it is; once they are complete they are optimised as a whole.
The results are the same, and the first compilation takes two thirds of the time.

Numba has no public way to say this; where its own ways are others than those known here, it does that work as well.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core import types

try:
    from numba.core.codegen import JITCodeLibrary
    from numba.core.compiler import Compiler
except ImportError:
    JITCodeLibrary = Compiler = object  # type: ignore[assignment, misc]

SMALL = 6
"""Functions in a part, up to which it is optimised by itself: loops are vectorised that are not within a long one."""


class PartCode(JITCodeLibrary):
    """The code of a part, and of all that it calls."""

    def _optimize_final_module(self) -> None:
        if sum(not function.is_declaration for function in self._final_module.functions) <= SMALL:
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        """Without machine code."""
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """None: there is no entry from Python."""
        return 0

    @property
    def codegen(self) -> Any:
        """Who is told the environment of an entry from Python: nobody."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Not kept."""


class PartCompiler(Compiler):
    """Numba's compiler, with such code for its result."""

    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        super().__init__(typing, target, library or PartCode(target.codegen(), "part"), *rest)


def as_part() -> dict[str, Any]:
    """Options of a part, for the numba that is there."""
    used = ("_optimize_final_module", "_finalize_final_module", "_finalize_dynamic_globals")
    known = all(hasattr(JITCodeLibrary, name) for name in used)
    compiler = {"pipeline_class": PartCompiler} if known else {}
    return {**compiler, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


def without_literals(dispatcher: Any) -> None:
    """Let a number written in a call be of its type like any other: numba would compile a version for each."""
    template: Callable[..., Any] = dispatcher.get_call_template

    def of_types(args: Any, named: dict[str, Any]) -> Any:
        return template([types.unliteral(a) for a in args], {k: types.unliteral(a) for k, a in named.items()})

    dispatcher.get_call_template = of_types
