"""The decorator of verbs: exit codes, answers as JSON."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any, get_type_hints

import typer

from slipstick.cli.terminal.answers import answering
from slipstick.cli.terminal.guard import DONE, warnings_at_once
from slipstick.plots.shown import for_files

_JSON = inspect.Parameter(
    "as_json",
    inspect.Parameter.KEYWORD_ONLY,
    default=False,
    annotation=Annotated[bool, typer.Option("--json", help="The answer as JSON on standard output.")],
)


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
        with answering(as_json) as answer, warnings_at_once(), for_files():
            code = function(**arguments, **({"answer": answer} if answers else {}))
            if code is not None and code != DONE:
                raise typer.Exit(code)

    del called.__wrapped__
    called.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[*shown, _JSON] if answers else shown, return_annotation=None
    )
    called.__annotations__ = {}
    return called
