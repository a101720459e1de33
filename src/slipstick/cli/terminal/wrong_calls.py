"""Verbs and options that are not there: with ``--json`` they are told in an answer too."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from typer.core import TyperGroup

from slipstick.cli.terminal.answers import print_answer
from slipstick.cli.terminal.guard import BAD_INPUT
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

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """As typer does it; an option that takes one value and is given twice is refused, not the last one taken."""
        name, command, rest = super().resolve_command(ctx, args)
        for option in getattr(command, "params", ()):
            if option.param_type_name == "option" and not option.is_flag and not option.multiple:
                times = [text for text in _before_rest(rest) if _names(text, option.opts)]
                if len(times) > 1:
                    ctx.fail(f"{option.opts[-1]} is given {len(times)} times; it takes one value: keep one of them")
        return name, command, rest


def _before_rest(arguments: list[str]) -> list[str]:
    """Arguments before "--", behind which nothing is an option."""
    return arguments[: arguments.index("--")] if "--" in arguments else arguments


def _names(text: str, names: list[str]) -> bool:
    """Whether an argument is one of these options, alone or with its value ("--output=x", "-ox")."""
    long = any(text == name or text.startswith(f"{name}=") for name in names if name.startswith("--"))
    return long or any(text.startswith(name) for name in names if not name.startswith("--"))


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
