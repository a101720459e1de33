"""Output to the user: lines, warnings, results; faults as sentences with an exit code, never a traceback."""

from __future__ import annotations

import signal
import sys
import unicodedata
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from io import TextIOBase
from pathlib import Path
from types import FrameType
from typing import Any, ParamSpec, TypeVar

from slipstick.errors import InputError, Outcome, SlipstickWarning, TimeIsUp, reason_of
from slipstick.replacing import unwritable
from slipstick.runs.failures import fault_sentence, internal_sentence, os_sentence
from slipstick.runs.folder import REPORT, OutputFolder

P = ParamSpec("P")
T = TypeVar("T")

DONE, STOPPED, BAD_INPUT = 0, 1, 2
INTERRUPTED = 130
"""By Ctrl-C with nothing to keep, as shells name it; what is stopped with something found is STOPPED."""
PIPE_CLOSED = 141
"""A help or a version that nobody reads to its end: that of any program of the shell."""

command: Sequence[str] | None = None
"""The arguments of the command line, where this process is one and so can begin again."""


def plain(text: str) -> str:
    r"""The text with control and hidden characters spelt out: names from files are not trusted.

    >>> print(plain("grün\x1b[2J\ttab\u202e"))
    grün\x1b[2J\ttab\u202e
    """
    return "".join(c if c.isprintable() or unicodedata.category(c) == "Zs" else ascii(c)[1:-1] for c in text)


def say(text: str = "") -> None:
    """Print a line on standard output."""
    put(plain(text))


def put(line: str) -> None:
    """Print a line as it is; a closed pipe is no fault.

    Raises
    ------
    InputError
        If standard output cannot be written, as on a full disk.
    """
    try:
        print(line, flush=True)
    except BrokenPipeError:
        mute()
    except OSError as error:
        raise unwritten(error) from None


def mute() -> None:
    """Let nothing more be written to a standard output that takes nothing."""
    sys.stdout = _Nowhere()


class _Nowhere(TextIOBase):
    """Takes all that is written, and keeps nothing."""

    def write(self, text: str) -> int:
        return len(text)


def unwritten(error: OSError) -> InputError:
    """What is raised where standard output cannot be written; the end of the process does not try once more."""
    mute()
    return unwritable("standard output", (error.strerror or str(error)).lower())


def complain(text: str) -> None:
    """Print a line on standard error."""
    print(plain(text), file=sys.stderr, flush=True)


def warn_user(sentence: str) -> None:
    """Print a warning on standard error."""
    complain(f"warning: {sentence}")


def report_or_warn(write: Callable[[], object]) -> bool:
    """Write a report; whether it is written. What cannot be reported has its results all the same."""
    try:
        write()
    except InputError as error:
        warn_user(reason_of(error))
    except KeyboardInterrupt:
        warn_user("interrupted: the report is not written; 'slipstick report' writes it from the results")
    except Exception as error:
        warn_user(f"report: {fault_sentence(error)}")
    else:
        return True
    return False


def say_results(folder: Path, files: str = "", *, reported: bool) -> None:
    """Print the place of the results and, if a report was written, the page to open."""
    say(f"results in {folder}/{f': {files}' if files else ''}")
    if reported:
        say_page(folder / REPORT)


def say_untouched(place: OutputFolder) -> None:
    """Print, of results that are not complete, that the earlier ones are still there."""
    if place.replaces:
        complain(f"the earlier results in {place.folder} are untouched; the new ones are not complete")


def say_page(page: Path) -> None:
    """Print the page to open."""
    say(f"open {page} in a browser")


def stopped_code(outcome: Outcome | None, found: int) -> int:
    """The exit code of what stopped early, with so many points, cases or periods."""
    return INTERRUPTED if outcome is Outcome.INTERRUPTED and not found else STOPPED


def prepare_kernel(tell: Callable[[str], None]) -> None:
    """Load the compiled contact kernel, or compile it with a message before and after."""
    from slipstick.balance.kernel.compilation import compile_all
    from slipstick.contact.kernel.compilation import COMPILE_TIME, is_compiled, is_interpreted

    if is_interpreted() or is_compiled():
        return
    tell(f"compiling the contact kernel, once on this machine, {COMPILE_TIME} ...")
    seconds = compile_all()
    tell(f"compiled in {seconds:.0f} s; later runs start at once")


@contextmanager
def warnings_at_once() -> Iterator[None]:
    """Print warnings of this package raised in the block on standard error, each once and when it comes."""
    before, said = warnings.showwarning, set[str]()

    def show(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
        if not issubclass(category, SlipstickWarning):
            before(message, category, *where, **more)
        elif str(message) not in said:
            said.add(str(message))
            warn_user(str(message))

    with warnings.catch_warnings():
        warnings.simplefilter("always", SlipstickWarning)
        warnings.showwarning = show
        yield


@contextmanager
def warnings_said() -> Iterator[None]:
    """Print warnings raised in the block on standard error, each once."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SlipstickWarning)
        yield
    for sentence in dict.fromkeys(str(warning.message) for warning in caught):
        warn_user(sentence)


def quietly(compute: Callable[P, T], *arguments: P.args, **more: P.kwargs) -> T:
    """Compute without warnings; the results hold them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SlipstickWarning)
        return compute(*arguments, **more)


@contextmanager
def guarded(heard: Callable[[Sequence[str]], None] = lambda sentences: None) -> Iterator[None]:
    """Turn expected failures into sentences and exit codes: 2 bad input, 1 stopped, 130 interrupted.

    ``heard`` is told the sentences, too.
    """
    import typer

    def ended(sentences: Sequence[str], code: int) -> typer.Exit:
        heard(sentences)
        report_faults(sentences)
        return typer.Exit(code)

    try:
        yield
    except InputError as error:
        raise ended(error.sentences, BAD_INPUT) from None
    except OSError as error:
        raise ended([os_sentence(error)], BAD_INPUT) from None
    except MemoryError:
        said = "there is not enough memory for this case; keep fewer harmonics, contacts or output dofs"
        raise ended([said], BAD_INPUT) from None
    except KeyboardInterrupt as stop:
        late = isinstance(stop, TimeIsUp)
        complain("stopped at the time limit; nothing was found yet" if late else "interrupted")
        raise typer.Exit(STOPPED if late else INTERRUPTED) from None
    except typer.Exit:
        raise
    except Exception as error:
        raise ended([internal_sentence(error)], STOPPED) from None


def report_faults(sentences: Sequence[str]) -> None:
    """Print all faults, one a line."""
    for sentence in sentences:
        complain(f"error: {sentence}")
    if len(sentences) > 1:
        complain(f"{len(sentences)} faults; nothing was computed")


@contextmanager
def termination_as_interrupt() -> Iterator[None]:
    """A polite kill (SIGTERM, as sent by cluster schedulers) ends a run like Ctrl-C: what was found is kept."""

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    try:
        before = signal.signal(signal.SIGTERM, interrupt)
    except ValueError:
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
