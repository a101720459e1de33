"""What happens once before the first computation on a machine: the contact kernel is compiled, and the user is told."""

from __future__ import annotations

from collections.abc import Callable


def prepare_kernel(tell: Callable[[str], None]) -> None:
    """Load the compiled contact kernel; where it must be compiled first, say so before and after."""
    from slipstick.balance.kernel.compilation import compile_all
    from slipstick.contact.kernel.compilation import COMPILE_TIME, is_compiled

    if is_compiled():
        return
    tell(f"compiling the contact kernel, once on this machine, {COMPILE_TIME} ...")
    seconds = compile_all()
    tell(f"compiled in {seconds:.0f} s; later runs start at once")
