"""The decorator of verbs: exit codes, answers as JSON, also to calls that the parser refuses."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Annotated, Any, get_type_hints

import typer
from typer.core import TyperGroup

from slipstick.cli.terminal.answers import answering, print_answer
from slipstick.cli.terminal.guard import BAD_INPUT, DONE, guarded
from slipstick.errors import Fault, InputError
from slipstick.plots.shown import for_files

_ASKED = "slipstick.json"


class Verbs(TyperGroup):
    """All commands; calls that the parser refuses are bad input."""

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
        with guarded():
            raise
    except Exception as error:
        formatted = getattr(error, "format_message", None)
        if ctx.meta[_ASKED] and formatted is not None:
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

_JSON = inspect.Parameter(
    "as_json",
    inspect.Parameter.KEYWORD_ONLY,
    default=False,
    annotation=Annotated[bool, typer.Option("--json", help="The answer as JSON on standard output.")],
)


def command_name(name: str) -> str:
    """The command of a function or of a table, as it is typed.

    >>> command_name("limit_cycles"), command_name("import_")
    ('limit-cycles', 'import')
    """
    return name.rstrip("_").replace("_", "-")


def verb(function: Callable[..., int | None]) -> Callable[..., None]:
    """Make a function a verb: its docstring is the help, its parameters are arguments and options.

    It returns the exit code (None: done); faults become sentences and exit codes. One with a parameter ``answer`` gets
    the option ``--json``: what it puts there is printed as one JSON document.
    """
    hints = get_type_hints(function, include_extras=True)
    signature = inspect.signature(function)
    shown = [p.replace(annotation=hints[p.name]) for p in signature.parameters.values() if p.name != "answer"]
    answers = "answer" in signature.parameters

    @wraps(function)
    def called(as_json: bool = False, **arguments: Any) -> None:
        with answering(as_json) as answer, for_files():
            code = function(**arguments, **({"answer": answer} if answers else {}))
            if code is not None and code != DONE:
                raise typer.Exit(code)

    del called.__wrapped__
    called.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[*shown, _JSON] if answers else shown, return_annotation=None
    )
    called.__annotations__ = {}
    return called
