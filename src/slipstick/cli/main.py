"""The command line: what it does in the order of its help, each a file of its own."""

from __future__ import annotations

import atexit
import gc
import os
import sys
from importlib import import_module
from typing import Annotated

import typer

from slipstick.cli.terminal import guard
from slipstick.cli.verb import app, command_name
from slipstick.cli.verbs.requests import OLD_NAMES, REQUESTS

VERBS = {
    "Begin": ("init", "check", "import_"),
    "Compute a case": ("run", *REQUESTS, "run_up", "preload", "resume"),
    "Many cases, and measurements": ("study", "identify"),
    "Rotors and discs without contacts": ("campbell", "interference"),
    "Results": ("report", "table"),
    "This installation": ("info", "verify"),
}
"""In the order and the groups of the help; all others are files in the folder of that name, each with a function of its
own name."""

for _group, _names in VERBS.items():
    for _name in _names:
        _called = REQUESTS.get(_name) or getattr(import_module(f"slipstick.cli.verbs.{_name}"), _name)
        app.command(command_name(_name), rich_help_panel=_group)(_called)

for _name, _called in OLD_NAMES.items():
    app.command(command_name(_name), hidden=True)(_called)


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
    pass


def main() -> None:
    """Entry point of the ``slipstick`` command."""
    # at its end Python would look through all that was imported for cycles, for memory that ends with it anyway
    atexit.register(gc.freeze)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    guard.command = sys.argv[1:]
    app(prog_name="slipstick")
