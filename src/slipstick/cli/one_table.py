"""What verbs share that compute what one table of a case asks for, into a folder of its own."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from slipstick.cli.options import run_options
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import (
    complain,
    prepare_kernel,
    termination_as_interrupt,
)
from slipstick.errors import InputError, SlipstickWarning

if TYPE_CHECKING:
    from slipstick.analysis.road.events import EventFunction
    from slipstick.case.case import Case


P = ParamSpec("P")
T = TypeVar("T")


@contextmanager
def shown(time_limit: str | None, *, quiet: bool, answer: Answer) -> Iterator[tuple[EventFunction, ...]]:
    """Who listens to an analysis: the terminal, and the clock that ends it; kills are as Ctrl-C meanwhile."""
    from slipstick.cli.terminal.display import ShownAnalysis, curve_display
    from slipstick.runs.run import Clock

    options = run_options(time_limit, figures=True, report=True, quiet=quiet, answer=answer)
    with termination_as_interrupt(), curve_display(0.0, 1.0, "", quiet=quiet) as display:
        yield ShownAnalysis(display), Clock(options.until)


def quietly(compute: Callable[P, T], *arguments: P.args, **more: P.kwargs) -> T:
    """What is computed; its warnings are told from the results."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SlipstickWarning)
        return compute(*arguments, **more)


def case_with(path: Path, name: str, example: str) -> tuple[Case, Any]:
    """A case and its table of that name, without which it is refused; the kernel is ready then."""
    from slipstick.case.case import Case

    case = Case.from_file(path)
    if name not in case.further:
        raise InputError(f"{path}: [{name}] is missing; give it, such as {example}")
    prepare_kernel(complain)
    return case, case.further[name]
