"""Compiled functions that only compiled ones call: linked into their callers, without machine code of their own.

Numba makes machine code of every function with all that it calls, again at each level of calls, for Python to start
at, and optimises each level twice, the first time for reference counts. Nobody starts at the inner functions, and
they count no references: leaving both out takes a third off the first compilation, and nothing
changes in what is computed. This reaches into numba, whose insides change from version to version: with one that it was
not tried with this module cannot be imported, and compilation goes numba's own way.
"""

from __future__ import annotations

from typing import Any

import numba
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.typed_passes import NativeLowering

TRIED = ("0.68.",)
"""Beginnings of the versions of numba that this was tried with."""

if not numba.__version__.startswith(TRIED):
    raise ImportError(f"not tried with numba {numba.__version__}")


class Linked(JITCodeLibrary):
    """A library to be linked only."""

    def get_pointer_to_function(self, name: str) -> int:
        """None, as of every function without an entry from Python."""
        return 0

    def _optimize_final_module(self) -> None:
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    @property
    def codegen(self) -> Linked:
        """Where the environment of a function is set: nowhere."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """An environment serves entries from Python and exceptions, which inner functions have not."""


@register_pass(mutates_CFG=False, analysis_only=False)
class IntoLinked(LoweringPass):
    """Gives the lowering a library of that kind."""

    _name = "slipstick_into_linked"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Before the lowering, which makes one of its own where there is none."""
        state.library = Linked(state.targetctx.codegen(), state.func_id.func_qualname)
        return True


class InnerCompiler(CompilerBase):
    """Numba's own passes, with that one before the lowering."""

    def define_pipelines(self) -> list[Any]:
        """As numba asks for them."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        place = next(i for i, (kind, _) in enumerate(passes.passes) if issubclass(kind, NativeLowering))
        passes.passes.insert(place, (IntoLinked, "links inner functions"))
        passes.finalize()
        return [passes]
