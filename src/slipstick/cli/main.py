"""The command line: a command is imported, and its options are read, where it is called or the help shows all."""

from __future__ import annotations

import atexit
import gc
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from errno import EPIPE
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from slipstick.case import RENAMED
from slipstick.cli.names import OF_TABLES, VERBS, command_name

_ASKED = "slipstick.json"

_arguments: Sequence[str] | None = None
"""Those of this process, where it is a command."""


class _Commands(Mapping[str, Any]):
    """The commands by name, each made when it is asked for: to make all of them takes longer than most calls."""

    def __init__(self) -> None:
        self._groups = {name: group for group, names in VERBS.items() for name in names} | dict.fromkeys(RENAMED)
        self._names = {command_name(name): name for name in self._groups}
        self._made: dict[str, Any] = {}

    def __getitem__(self, command: str) -> Any:
        if command not in self._made:
            name = self._names[command]
            one = typer.Typer(add_completion=False, rich_markup_mode=app.rich_markup_mode)
            one.command(command, rich_help_panel=self._groups[name], hidden=name in RENAMED)(_whole_verb(name))
            self._made[command] = get_command(one)
        return self._made[command]

    def __contains__(self, command: object) -> bool:
        return command in self._names

    def get(self, command: str, default: Any = None) -> Any:
        """See Mapping, which takes a KeyError of a verb's own module for a command that is not there."""
        return self[command] if command in self._names else default

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _verb(name: str) -> Any:
    if name in OF_TABLES or name in RENAMED:
        from slipstick.cli.verbs.requests import OLD_NAMES, REQUESTS

        return (REQUESTS | OLD_NAMES)[name]
    return getattr(import_module(f"slipstick.cli.verbs.{name}"), name)


def _whole_verb(name: str) -> Any:
    """The verb; a fault of its module is one of the program itself."""
    try:
        return _verb(name)
    except Exception:
        from slipstick.cli.terminal.guard import guarded

        with guarded():
            raise


class Verbs(TyperGroup):
    """All commands; calls that the parser refuses are bad input."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings | {"commands": _Commands()})

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """See typer; refused calls are answered too."""
        ctx.meta[_ASKED] = "--json" in args
        with _answered(ctx):
            return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """See typer; refused calls are answered too."""
        with _answered(ctx):
            return super().invoke(ctx)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Refuse an option of one value that is given twice; typer would take the last one."""
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
    """A call that the parser refuses (its errors format themselves) is answered, if an answer was asked for.

    One that is interrupted before its verb begins says so.
    """
    try:
        yield
    except KeyboardInterrupt:
        from slipstick.cli.terminal.guard import guarded

        with guarded():
            raise
    except OSError as error:  # of the parser's own output, a help or a version
        from slipstick.cli.terminal.guard import PIPE_CLOSED, guarded, mute, unwritten

        if error.errno == EPIPE:
            mute()
            raise typer.Exit(PIPE_CLOSED) from None
        with guarded():
            raise unwritten(error) from None
    except SystemExit as ended:
        if not isinstance(ended.__context__, BrokenPipeError):  # which rich, that prints the help, ends the process for
            raise
        from slipstick.cli.terminal.guard import PIPE_CLOSED, mute

        mute()
        raise typer.Exit(PIPE_CLOSED) from None
    except Exception as error:
        formatted = getattr(error, "format_message", None)
        if ctx.meta[_ASKED] and formatted is not None:
            from slipstick.cli.terminal.answers import print_answer
            from slipstick.cli.terminal.guard import BAD_INPUT
            from slipstick.errors import Fault, InputError

            print_answer({"exit_code": BAD_INPUT}, InputError(Fault(statement=str(formatted()))))
        raise


app = typer.Typer(
    name="slipstick",
    help="Steady vibration of structures that stick, slip, separate and rub.",
    epilog="Exit codes: 0 done, 1 stopped early with what was found saved, 2 bad input, 130 interrupted before.",
    cls=Verbs,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        from slipstick import __version__

        typer.echo(f"slipstick {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    from slipstick.cli.terminal import guard

    guard.command = _arguments


def main() -> None:
    """Entry point of the ``slipstick`` command."""
    global _arguments
    # at its end Python would look through all that was imported for cycles, for memory that ends with it anyway
    atexit.register(gc.freeze)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    _arguments = sys.argv[1:]
    app(prog_name="slipstick")
