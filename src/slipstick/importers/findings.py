"""Verdicts on keywords, commands and cards, each of which is read, refused, warned of or listed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum
from typing import TypeVar

from slipstick.errors import Fault, File, InputError, Place, Where

ROUTE = (
    "export the assembled matrices and import those "
    "(CalculiX: *FREQUENCY, SOLVER=MATRIXSTORAGE; Abaqus: *MATRIX OUTPUT; Ansys: .full or HBMAT; "
    "any: K, M, dof_nodes, dof_components in one .npz)"
)

DAMAGED = "the file is damaged or truncated: write it again"


def refused(
    where: str | Where, statement: str = "", *, found: str = "", expected: str = "", remedy: str = ""
) -> InputError:
    """The exception of one fault in a file, at a place or with the name of the file alone."""
    place = Place(where) if isinstance(where, str) else where
    return InputError(Fault(place, statement, found=found, expected=expected, remedy=remedy))


@contextmanager
def made_of(source: str) -> Iterator[None]:
    """Context in which faults are placed in a file, unless they have a place of their own."""
    try:
        yield
    except InputError as error:
        raise InputError(
            [fault if any(isinstance(part, File) for part in fault.where) else fault.inside(*Place(source))
             for fault in error.faults]
        ) from None  # fmt: skip


class Verdict(Enum):
    """The treatment of an entry."""

    READ = "read and applied"
    INCOMPLETE = "refused: what the file describes is not all in it"
    COUPLING = "refused where the mesh is assembled here: it couples, adds, rotates or holds"
    APPROXIMATED = "warned of"
    HARMLESS = "listed"
    UNKNOWN = "listed; warned of among the data of the model"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """The treatment of a keyword, command or card.

    ``what`` it does, in words that go on from its name; ``read`` is the function that reads it, ``parameters`` those
    that it understands (None: all), ``stage`` its turn: what says something of all that the file names comes later.
    """

    verdict: Verdict
    what: str = ""
    read: Callable[..., object] | None = None
    parameters: frozenset[str] | None = None
    stage: int = 0


Reader = TypeVar("Reader", bound=Callable[..., object])


class Table(dict[str, Entry]):
    """Every entry of a code, by name, with its one treatment.

    ``rows``: names, separated by blanks, the verdict on them, and what they do.
    """

    def __init__(self, *rows: tuple[str, Verdict, str]) -> None:
        super().__init__()
        for names, verdict, what in rows:
            for name in names.split():
                self._set(name, Entry(verdict=verdict, what=what))

    def reads(self, names: str, parameters: str | None = None, *, stage: int = 0) -> Callable[[Reader], Reader]:
        """Decorator of the function that reads these."""

        def register(read: Reader) -> Reader:
            known = None if parameters is None else frozenset(parameters.split())
            for name in names.split():
                self._set(name, Entry(verdict=Verdict.READ, read=read, parameters=known, stage=stage))
            return read

        return register

    def _set(self, name: str, entry: Entry) -> None:
        if name in self:
            raise ValueError(f"{name} is in the table already")
        self[name] = entry


@dataclass(frozen=True, kw_only=True)
class Coupling:
    """A coupling that the assembly from a mesh does not apply: its place, and its effect on the model."""

    where: Place
    what: str

    @property
    def refused(self) -> Fault:
        """The fault where the mesh is assembled here."""
        return Fault(self.where, f"{self.what}; an assembly of the mesh here does not apply this", remedy=ROUTE)

    @property
    def beside_matrices(self) -> str:
        """The sentence where the matrices come from the other code and the mesh tells positions only."""
        what = f"{self.what}: the matrices must hold it; a dof it removes can carry no contact or load"
        return str(Fault(self.where, what))


@dataclass(kw_only=True)
class Findings:
    """Entries met, in the order of the file: (verdict, name, sentence) -> lines.

    ``extra`` are further notes; ``origin`` names each line where a text is made of several files.
    """

    source: str
    met: dict[tuple[Verdict, str, str], list[int]] = field(default_factory=dict)
    extra: list[str] = field(default_factory=list)
    origin: list[tuple[str, int]] = field(default_factory=list)
    elsewhere: list[Coupling] = field(default_factory=list)

    def place(self, line: int, *names: str) -> Place:
        """A place: file, line, name of the entry."""
        name, number = self.origin[line - 1] if 0 < line <= len(self.origin) else (self.source, line)
        return Place(name, f"line {number}", *names)

    def add(self, verdict: Verdict, name: str, what: str, line: int) -> None:
        """Remember one entry."""
        self.met.setdefault((verdict, name, what), []).append(line)

    def look_up(self, table: Table, name: str, shown: str, line: int, *, of_the_model: bool = True) -> None:
        """Give an entry the verdict of the table; one that is not in it is not understood."""
        unknown = Verdict.APPROXIMATED if of_the_model else Verdict.UNKNOWN
        entry = table.get(name, Entry(verdict=unknown, what="is not understood: it has no effect here"))
        if entry.verdict is not Verdict.READ:
            self.add(entry.verdict, shown, entry.what, line)

    def refuse_incomplete(self) -> None:
        """Raise InputError with all entries that leave the model of the file incomplete."""
        faults = [Fault(where, what) for where, what in self._of(Verdict.INCOMPLETE)]
        if faults:
            raise InputError(faults)

    def couple(self, where: Place, what: str) -> None:
        """Remember a coupling that an assembly here would leave out and that no single line states."""
        self.elsewhere.append(Coupling(where=where, what=what))

    @property
    def couplings(self) -> tuple[Coupling, ...]:
        """Couplings that an assembly here would leave out."""
        counted = (Coupling(where=where, what=what) for where, what in self._of(Verdict.COUPLING))
        return (*counted, *self.elsewhere)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on entries that are approximated or not understood."""
        return tuple(str(Fault(where, what)) for where, what in self._of(Verdict.APPROXIMATED))

    @property
    def notes(self) -> tuple[str, ...]:
        """Entries that are not needed, and those not understood, each in one list with counts."""
        heads = {Verdict.HARMLESS: "without effect here", Verdict.UNKNOWN: "not understood, without effect here"}
        listed = (
            f"{self.source}: {head}: {', '.join(names)}"
            for verdict, head in heads.items()
            if (names := self._list(verdict))
        )
        return (*self.extra, *listed)

    def _of(self, verdict: Verdict) -> list[tuple[Place, str]]:
        return [
            (with_more(self.place(lines[0]) if lines[0] else Place(self.source), len(lines) - 1).at(name), what)
            for (of, name, what), lines in self.met.items()
            if of is verdict
        ]

    def _list(self, verdict: Verdict) -> list[str]:
        counts: dict[str, int] = {}
        for (of, name, _), lines in self.met.items():
            if of is verdict:
                counts[name] = counts.get(name, 0) + len(lines)
        return [f"{name} ({count})" if count > 1 else name for name, count in counts.items()]


def with_more(place: Place, count: int) -> Place:
    """A place that stands for some others too."""
    return Place(*place[:-1], f"{place[-1]} and {count} more") if count > 0 else place
