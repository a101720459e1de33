"""Verbs and options that are not there: with ``--json`` they are told in an answer too."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from typer.core import TyperGroup

from slipstick.app.terminal.answers import print_answer
from slipstick.app.terminal.guard import BAD_INPUT
from slipstick.errors import Fault, InputError

_ASKED = "slipstick.json"


class Verbs(TyperGroup):
    """All commands; what the parser refuses is bad input like any other."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """As typer does it."""
        ctx.meta[_ASKED] = "--json" in args
        with _answered(ctx):
            return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """As typer does it."""
        with _answered(ctx):
            return super().invoke(ctx)


@contextmanager
def _answered(ctx: Any) -> Iterator[None]:
    """A call that the parser refuses (its errors format themselves) is answered, if an answer was asked for."""
    try:
        yield
    except Exception as error:
        formatted = getattr(error, "format_message", None)
        if ctx.meta[_ASKED] and formatted is not None:
            print_answer({"exit_code": BAD_INPUT}, InputError(Fault(statement=str(formatted()))))
        raise
