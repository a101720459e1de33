"""Exceptions, faults and outcomes: what went wrong as data, and the sentence that says the cause and the remedy."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

Where = tuple[str | int, ...]
"""Path of names to what is at fault, from the whole to the part; a place in a list is its number, from 0. In a file:
its name, "line 12", what stands there."""

IS_MISSING = "is missing"
"""Statement of a fault whose path names what is not there."""

UNKNOWN_KEY = "unknown key"
"""Statement of a fault whose path ends with a name that means nothing there."""

NAMED = ("contact", "load", "load shape")
"""Words of a path after which the user's own name, or a number, follows."""

_LONG = re.compile(r"[^\s/\\]{256,}")
"""No name of a person or a file system is as long; a path may be, piece by piece."""


_LINE = re.compile(r"line \d+(?: and \d+ more)?")
_VERB = re.compile(r"(?:(?!its |this |as )[a-z]+s|cannot|add|are|have)[ ,;]")
"""Begins a statement that goes on from what stands in a file: "*TIE names A, ..."."""


class File(str):
    """The name of a file, or of several, in a path: what follows is a place in it."""

    __slots__ = ()


class Place(tuple[str | int, ...]):
    """Where something stands in a file, a path that begins with its name; ``str`` has the words.

    >>> place = Place("a.inp", "line 12").at("*TIE")
    >>> str(place), str(Fault(place, "names A, which the file does not have"))
    ('a.inp, line 12: *TIE', 'a.inp, line 12: *TIE names A, which the file does not have')
    """

    __slots__ = ()

    def __new__(cls, *names: str | int) -> Place:  # noqa: D102
        return super().__new__(cls, (File(names[0]), *names[1:]))

    def at(self, *names: str | int) -> Place:
        """A part of it."""
        return Place(*self, *names)

    def __str__(self) -> str:
        return in_python(self)

    def __getnewargs__(self) -> Where:
        return tuple(self)


class SlipstickError(Exception):
    """Base of every exception this package raises on purpose."""


def in_python(where: Where) -> str:
    """A place in the words of a Python user.

    >>> in_python(("contact", "damper", "kt")), in_python(("contacts", 1)), in_python(("load", 0, "dof"))
    ("contact 'damper', kt", 'contacts, number 2', 'load number 1, dof')
    """
    words: list[str] = []
    for before, part in zip((None, *where), where, strict=False):
        said = f"number {part + 1}" if isinstance(part, int) else part
        if before in NAMED and words:
            words[-1] += f" {said}" if isinstance(part, int) else f" {part!r}"
        else:
            words.append(said)
    text = ""
    for before, word in zip((None, *words), words, strict=False):
        within = before is not None and (
            _LINE.fullmatch(before) or (isinstance(before, File) and not _LINE.fullmatch(word))
        )
        text += word if before is None else f"{': ' if within else ', '}{word}"
    return text


@dataclass(frozen=True, init=False)
class Fault:
    """One thing that is wrong with a user's input, as data; ``str`` is the sentence. Any text may be empty.

    Parameters
    ----------
    where
        Path of names such as ``("contact", "damper", "kt")``; one name alone is taken too.
    statement
        What is wrong where it is no single value: "is missing", "the normal load is missing".
    found, expected
        The value as it is shown, and what was expected instead.
    remedy
        What to do.

    >>> str(Fault("kt", found="-1", expected="a number >= 0").inside("contact", "tip"))
    "contact 'tip', kt: found -1; expected a number >= 0"
    >>> str(Fault("omega", IS_MISSING, remedy="give it in rad/s"))
    'omega is missing; give it in rad/s'
    """

    where: Where
    statement: str
    found: str
    expected: str
    remedy: str

    def __init__(
        self, where: str | Where = (), statement: str = "", *, found: str = "", expected: str = "", remedy: str = ""
    ) -> None:
        object.__setattr__(self, "where", (where,) if isinstance(where, str) else tuple(where))
        texts = {"statement": statement, "found": found, "expected": expected, "remedy": remedy}
        for name, text in texts.items():
            object.__setattr__(self, name, _shortened(text))

    def inside(self, *where: str | int) -> Fault:
        """The same fault, told by somebody who knows what the place lies in."""
        return replace(self, where=(*where, *self.where))

    def below(self, *where: str | int) -> Fault:
        """The same fault without the first words of its path, where these are ``where``."""
        known = len(where) if self.where[: len(where)] == where else 0
        return replace(self, where=self.where[known:])

    @property
    def words(self) -> str:
        """What is said after the place, the same wherever it is said."""
        found, expected = (
            f"{word} {text}" if text else "" for word, text in (("found", self.found), ("expected", self.expected))
        )
        return "; ".join(part for part in (found, self.statement, expected, self.remedy) if part)

    def said(self, place: Callable[[Where], str]) -> str:
        """The sentence, its place in the words of ``place``; a statement that begins with a verb goes on from it."""
        name = _shortened(place(self.where))
        if not name:
            return self.words
        if any(isinstance(part, File) for part in self.where):
            last = str(self.where[-1])
            named = not (isinstance(self.where[-1], File | int) or _LINE.fullmatch(last))
            goes_on = named and _VERB.match(self.statement) is not None
        else:
            goes_on = self.statement.startswith(("is ", "has "))
        return f"{name} {self.words}" if goes_on and not self.found else f"{name}: {self.words}"

    def __str__(self) -> str:
        return self.said(in_python)


class InputError(SlipstickError, ValueError):
    """Input that cannot be computed.

    ``faults`` holds all that is wrong, as data, ``sentences`` the same in words. A text instead of a fault is the
    statement of a fault without a place. Names of hundreds of characters are shortened.

    Parameters
    ----------
    faults
        One fault, or all of them.
    say
        How a fault is worded; in the words of Python by default.

    >>> str(InputError([Fault(("contact", "tip", "kt"), found="-1", expected="a stiffness >= 0")]))
    "contact 'tip', kt: found -1; expected a stiffness >= 0"
    """

    def __init__(self, faults: str | Fault | Iterable[str | Fault], say: Callable[[Fault], str] = str) -> None:
        self.faults, self._say = tuple(faults_of(faults)), say
        super().__init__("\n".join(self.sentences))

    @property
    def sentences(self) -> tuple[str, ...]:
        """One sentence for each fault."""
        return tuple(self._say(fault) for fault in self.faults)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.faults, self._say)


def faults_of(faults: str | Fault | Iterable[str | Fault]) -> tuple[Fault, ...]:
    """Faults, each once; a text is a fault without a place."""
    listed = (faults,) if isinstance(faults, str | Fault) else faults
    return tuple(dict.fromkeys(Fault(statement=one) if isinstance(one, str) else one for one in listed))


def _shortened(text: str) -> str:
    return _LONG.sub(lambda word: word[0][:60] + "...", text)


def reason_of(error: Exception) -> str:
    """Any exception in words: of input its sentences, of what else may happen its kind too.

    >>> reason_of(InputError("samples: too few")), reason_of(ZeroDivisionError("division by zero"))
    ('samples: too few', 'ZeroDivisionError: division by zero')
    """
    if isinstance(error, InputError):
        return "; ".join(error.sentences)
    words = " ".join(str(error).split())
    return f"{type(error).__name__}: {words}" if words else type(error).__name__


def first_line(error: Exception) -> str:
    """The first line of what an exception of a library says, or its kind where it says nothing.

    >>> first_line(ValueError("no header\\nin the file")), first_line(EOFError())
    ('no header', 'EOFError')
    """
    return str(error).splitlines()[0] if str(error) else type(error).__name__


class SlipstickWarning(UserWarning):
    """Input or a result that can be computed but is suspicious, approximated or unused; one sentence each.

    Examples
    --------
    >>> import warnings
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0)
    >>> foot = ss.ContactPair(name="foot", contact=law, tangential="x")
    >>> problem = ss.Problem(structure, contacts=foot, loads=ss.Load(dof="x", sin=5.0), harmonics=[0, 1])
    >>> with warnings.catch_warnings(record=True) as heard:
    ...     warnings.simplefilter("always", ss.SlipstickWarning)
    ...     branch = ss.steady_response(problem, omega=8.0)
    >>> [warning.category is ss.SlipstickWarning for warning in heard]
    [True, True]

    To stop a script at the first of them: ``warnings.simplefilter("error", ss.SlipstickWarning)``.
    """


class Reason(Enum):
    """Why something ended or was not taken: code compares members, people read ``text``."""

    @property
    def text(self) -> str:
        """One sentence."""
        return str(self.value)

    @property
    def words(self) -> str:
        """Its name for the reader, such as "point limit"."""
        return self.name.lower().replace("_", " ")

    def __str__(self) -> str:
        return self.text


KEPT = "every point found is kept"


def without_points(sentence: str, where: str = "") -> str:
    """What is said of a run that ended before its first point.

    >>> without_points(Outcome.TIME_LIMIT.text, " at 4 rad/s")
    'stopped at the time limit; no point was found at 4 rad/s'
    """
    return sentence.replace(KEPT, f"no point was found{where}")


class Outcome(Reason):
    """How a computation ended; ``text`` says the cause and the remedy.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0)
    >>> foot = ss.ContactPair(name="foot", contact=law, tangential="x")
    >>> problem = ss.Problem(structure, contacts=foot, loads=ss.Load(dof="x", sin=5.0), harmonics=range(6))
    >>> branch = ss.forced_response(problem, (4.0, 14.0))
    >>> branch.outcome.ok, branch.outcome.words, ss.Outcome.POINT_LIMIT.ok
    (True, 'completed', False)
    """

    COMPLETED = "completed: the whole requested range was followed"
    STEP_TOO_SMALL = (
        "stopped early: the continuation step fell below its smallest value; look at the last points' states, "
        "allow smaller steps (min_step) or add harmonics"
    )
    TURNED_BACK = (
        f"stopped early: the branch turned back and left the range where it began; {KEPT}: "
        "start where there is only one solution, further from resonance"
    )
    POINT_LIMIT = "stopped early: the largest number of points was reached; raise max_points or narrow the range"
    NO_FIRST_POINT = (
        "no first point was found by any starting strategy; start further from resonance, "
        "ramp a parameter (normal load, velocity) to its value, or check the units of kt and the normal load"
    )
    SINGULAR = "stopped: the Jacobian became singular; perturb the starting frequency or add a little damping"
    NO_OPTIMUM = (
        "no optimum was found: the highest peak has no minimum in the range searched; where it only falls towards one "
        "end, the last value that is possible is the best; or start elsewhere"
    )
    OUTSIDE_TABLE = (
        "stopped early: a contact temperature left its table; extend the table by measured rows, or lower the thermal "
        "resistance, the normal load or the velocity"
    )
    WORN_OUT = f"stopped: a contact reached the largest wear depth allowed; {KEPT}"
    NOTHING_TOUCHES = "stopped: the contacts that wear have lost their load, and wear has ended"
    MOTION_LOST = (
        "stopped early: the steady motion ends there, as at a fold of the response curve; what follows is a jump to "
        "another motion: look at the response curve of the worn problem (Branch.problem_at)"
    )
    INTERRUPTED = f"interrupted by the user; {KEPT}"
    FAILED = f"failed: its message names the fault that ended it; {KEPT}"
    TIME_LIMIT = f"stopped at the time limit; {KEPT}"

    @property
    def ok(self) -> bool:
        """Whether the whole request was fulfilled."""
        return self is Outcome.COMPLETED


class TimeIsUp(KeyboardInterrupt):
    """Raised by a listener to end a computation as Ctrl-C does, but with the outcome TIME_LIMIT."""

    outcome = Outcome.TIME_LIMIT


def close_names(name: str, known: Iterable[str]) -> list[str]:
    """The known name that is spelt like one, whatever its case, or of the same words in another order, if any.

    >>> close_names("Stifness", ["mass", "stiffness"]), close_names("step_max", ["max_step"]), close_names("q", ["x"])
    (['stiffness'], ['max_step'], [])
    """
    from difflib import get_close_matches

    names = list(known)
    folded = {each.casefold(): each for each in names}
    if close := get_close_matches(name, names, n=1):
        return close
    close = [folded[each] for each in get_close_matches(name.casefold(), folded, n=1)]
    return close or [each for each in names if _words(each) == _words(name)][:1]


def _words(name: str) -> list[str]:
    return sorted(name.casefold().replace("-", "_").split("_"))
