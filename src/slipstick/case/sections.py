"""The sections of a case: their names, the right values of their tables, and every fault within one table.

A new kind of structure is a class of its keys in a file such as ``matrices.py``, and its name in :data:`STRUCTURES`.
A new table that a verb of its own computes is a class such as those in ``requests.py``, and its name in
:data:`REQUESTS`. A table of another name is one there and, by its old name, in :data:`slipstick.case.RENAMED`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from slipstick.case import RENAMED
from slipstick.case.beam_rotor import ROTOR
from slipstick.case.contact import contact_table
from slipstick.case.disc import DISC, DISC_FE
from slipstick.case.fe import BLADE, FE
from slipstick.case.joint import FIELD, JointTable
from slipstick.case.load import LoadTable
from slipstick.case.matrices import FREE, MATRICES, MODAL, MODEL
from slipstick.case.measured import MEASURED
from slipstick.case.preload import BOLT, BOLT_FIELD, PRELOAD, BoltTable, StepTable
from slipstick.case.requests import (
    IdentifyTable,
    LimitCyclesTable,
    ModesTable,
    OptimalTable,
    RequestTable,
    RunUpTable,
    TrackTable,
    WearTable,
)
from slipstick.case.response import OutputTable, ResponseTable
from slipstick.case.structure import Described, StructureKind, Tell, silent
from slipstick.case.table import RawTable, Table, toml
from slipstick.case.thermal import ThermalTable
from slipstick.case.top import TopTable
from slipstick.case.validation import ReadTable, close_key, key_suggestion, read_table
from slipstick.errors import IS_MISSING, UNKNOWN_KEY, Fault, File, InputError, Where, in_python
from slipstick.faults import Gathering, suggestion

STRUCTURES: Mapping[str, StructureKind] = {
    "matrices": MATRICES, "modal": MODAL, "fe": FE, "blade": BLADE, "disc": DISC, "rotor": ROTOR, "free": FREE,
    "measured": MEASURED,
}  # fmt: skip
"""Kinds of ``[structure]``."""

REQUESTS: Mapping[str, type[RequestTable]] = {
    "track": TrackTable, "optimal": OptimalTable, "modes": ModesTable,
    "limit_cycles": LimitCyclesTable, "wear": WearTable, "run_up": RunUpTable, "identify": IdentifyTable,
}  # fmt: skip
"""Tables that a verb of its own computes."""

REPEATED_SECTIONS = ("load", "contact", "joint", "bolt", "preload")
CASE_SECTIONS = ("structure", *REPEATED_SECTIONS, "thermal", "response", "output", "study", *REQUESTS)

MOST_TABLES = 10_000
_MISSING = {
    "structure": "describe the structure by its matrices or its modes",
    "contact": "give at least one contact, without any the response is linear",
    "response": "give it with the keys from and to",
}
"""Sections that every case needs, and the remedy where one is missing."""


def in_case(fault: Fault) -> str:
    """The sentence for a fault of a case.

    >>> in_case(Fault(("contact", "damper", "rubbing", "velocity"), found="inf", expected="a finite number"))
    "[[contact]] 'damper' rubbing.velocity: found inf; expected a finite number"
    >>> in_case(Fault(("structure", "stifness"), UNKNOWN_KEY, remedy="did you mean 'stiffness'?"))
    "unknown key 'stifness' in [structure]; did you mean 'stiffness'?"
    """
    if fault.statement != UNKNOWN_KEY:
        return fault.said(place)
    around = place(fault.where[:-1]) or "the case file"
    return f"{UNKNOWN_KEY} '{fault.where[-1]}' in {around}; {fault.remedy}"


def place(where: Where) -> str:
    """A path as it stands in the file.

    >>> place(("load", 0, "dof")), place(("response", "at", 2)), place(("units", "time"))
    ('[[load]] number 1 dof', '[response] at, number 3', 'units.time')
    >>> place(("structure", "file", File("blade.inp"), "line 12", "*TIE"))
    '[structure] file: blade.inp, line 12: *TIE'
    """
    section, rest = where[:1], where[1:]
    if section and section[0] in REPEATED_SECTIONS:
        words = [f"[[{section[0]}]]", *(_which(name) for name in rest[:1])]
        rest = rest[1:]
    elif section and section[0] in (*CASE_SECTIONS, *RENAMED):
        words = [f"[{section[0]}]"]
    else:
        words, rest = [], where
    end = next((i for i, part in enumerate(rest) if isinstance(part, File)), len(rest))
    key = "".join(f", number {part + 1}" if isinstance(part, int) else f".{part}" for part in rest[:end])
    said = " ".join([*words, key.lstrip(".")]).strip().replace(" ,", ",")
    return f"{said}: {in_python(rest[end:])}" if end < len(rest) else said


def _which(name: str | int) -> str:
    return f"number {name + 1}" if isinstance(name, int) else f"'{name}'"


@dataclass(frozen=True, kw_only=True)
class Sections:
    """The tables of a case but ``[structure]``; None where there is none, or something else than a table."""

    top: ReadTable
    loads: tuple[ReadTable, ...]
    contacts: tuple[ReadTable, ...]
    joints: tuple[ReadTable, ...]
    bolts: tuple[ReadTable, ...]
    steps: tuple[ReadTable, ...]
    thermal: ReadTable | None
    response: ReadTable | None
    output: ReadTable | None

    @property
    def period_ratio(self) -> tuple[int, int] | None:
        """As given, 1 where it is not; None where it is at fault."""
        rows = [row for row in (self.top, self.response) if row is not None]
        if self.response is None or not all(row.right("period_ratio") for row in rows):
            return None
        return next((row.table.period_ratio for row in rows if row.table.period_ratio), (1, 1))


def read_sections(raw: RawTable) -> tuple[Sections, list[Fault]]:
    """All sections but ``[structure]``, and the faults within each of them."""
    top, faults = _top(raw)
    reader = _Reader(raw, faults)
    sections = Sections(
        top=top,
        loads=reader.many("load", lambda _: LoadTable),
        contacts=reader.many("contact", contact_table),
        joints=reader.many("joint", lambda _: JointTable),
        bolts=reader.many(BOLT, lambda _: BoltTable),
        steps=reader.many(PRELOAD, lambda _: StepTable),
        thermal=reader.one("thermal", ThermalTable),
        response=reader.one("response", ResponseTable),
        output=reader.one("output", OutputTable),
    )
    return sections, faults


def _top(raw: RawTable) -> tuple[ReadTable, list[Fault]]:
    """Keys above the first section, and sections that are not there; a misspelt name is told alone."""
    keys = [field.alias or name for name, field in TopTable.model_fields.items()]
    absent = [key for key in (*keys, *CASE_SECTIONS) if key not in raw]
    unknown = [key for key in raw if key not in (*keys, *CASE_SECTIONS)]
    close = {key: close_key(key, absent) for key in unknown}
    elsewhere = {"study", *REQUESTS}  # read by themselves, before
    remedies = {key: key_suggestion(key, absent, () if close[key] else elsewhere) for key in unknown}
    faults = [Fault(key, UNKNOWN_KEY, remedy=remedy) for key, remedy in remedies.items()]
    row, top_faults = read_table(TopTable, {key: raw[key] for key in keys if key in raw}, ())
    top_faults += [
        Fault(name, IS_MISSING, remedy=remedy)
        for name, remedy in _MISSING.items()
        if not raw.get(name, name not in raw and [])
        and not (name == "contact" and (raw.get("joint") or raw.get("bolt")))
    ]
    meant = {word for words in close.values() for word in words}
    return row, faults + [f for f in top_faults if not (f.statement == IS_MISSING and f.where[0] in meant)]


class _Reader:
    """Reads tables by the name of their section; keeps their faults."""

    def __init__(self, raw: RawTable, faults: list[Fault]) -> None:
        self._raw, self._faults = raw, faults

    def one(self, section: str, model: type[Table]) -> ReadTable | None:
        if section not in self._raw:
            return None
        table = self._raw[section]
        if isinstance(table, Mapping):
            return self._row(model, table, (section,))
        self._faults.append(Fault(section, found=toml(table), expected=f"one table [{section}]"))
        return None

    def many(self, section: str, model: Callable[[RawTable], type[Table]]) -> tuple[ReadTable, ...]:
        tables = self._raw.get(section, [])
        right = isinstance(tables, list) and all(isinstance(table, Mapping) for table in tables)
        if not right or len(tables) > MOST_TABLES:
            double = f"tables that begin with [[{section}]] (double brackets)"
            expected = f"at most {MOST_TABLES}" if right else double
            shown = "a table" if isinstance(tables, Mapping) else toml(tables)
            self._faults.append(Fault(section, found=shown, expected=expected))
            return ()
        names = Counter(table.get("name") for table in tables if isinstance(table.get("name"), str))
        return tuple(
            self._row(model(table), table, _place(section, i, table.get("name"), names))
            for i, table in enumerate(tables)
        )

    def _row(self, model: type[Table], table: RawTable, where: Where) -> ReadTable:
        row, faults = read_table(model, table, where)
        self._faults += faults
        return row


def _place(section: str, number: int, name: object, names: Mapping[str, int]) -> Where:
    """By its name where that is its own, else by its number."""
    return (section, name if isinstance(name, str) and name and names[name] == 1 else number)


def structure_kind(raw: RawTable) -> StructureKind | None:
    """The kind that a ``[structure]`` table is of; None where there is no such kind."""
    kind = raw.get("kind")
    if kind == "matrices" and "file" in raw:
        return MODEL
    if kind == "disc" and {"file", "size"} & set(raw):
        return DISC_FE
    return STRUCTURES.get(kind) if isinstance(kind, str) else None


def read_structure(raw: Any, folder: Path, tell: Tell = silent) -> tuple[Described, list[Fault]]:
    """The structure of ``[structure]`` and the faults found in it; ``tell`` hears of stages that take time."""
    gathering = Gathering()
    described = gathering.take(_described, raw, folder, tell, gathering)
    return described or Described(), [_of_structure(fault) for fault in gathering.faults]


def _of_structure(fault: Fault) -> Fault:
    """A fault in the table of the structure, or in those of a joint or a bolt, which the structure keeps."""
    for field, section in ((FIELD, "joint"), (BOLT_FIELD, BOLT)):
        if fault.where[:1] == (field,) and len(fault.where) > 1:
            return replace(fault, where=(section, *fault.where[1:]))
    return fault.inside("structure")


def _described(raw: Any, folder: Path, tell: Tell, gathering: Gathering) -> Described:
    if not isinstance(raw, Mapping):
        raise InputError(Fault(found=toml(raw), expected="one table [structure]"))
    chosen, kind = structure_kind(raw), raw.get("kind")
    kinds = ", ".join(f'"{kind}"' for kind in STRUCTURES)
    if kind is None and (close := [key for key in raw if close_key(key, ["kind"])]):
        raise InputError(Fault(close[0], UNKNOWN_KEY, remedy="did you mean 'kind'?"))
    if kind is None:
        raise InputError(Fault("kind", IS_MISSING, remedy=f"give one of {kinds}"))
    if chosen is None:
        guess = suggestion(kind, STRUCTURES)
        known = f"this version knows {kinds}"
        raise InputError(Fault("kind", known, found=toml(kind), remedy=guess if guess.startswith("did") else ""))
    row, faults = read_table(chosen.table, raw, ())
    gathering.faults += faults
    return chosen.build(row, folder, tell, gathering)


def take_requests(raw: dict[str, Any]) -> tuple[dict[str, RequestTable], list[Fault]]:
    """Take the tables of :data:`REQUESTS` out of a case: their right values by the names in it, and every fault."""
    requests: dict[str, RequestTable] = {}
    faults: list[Fault] = []
    for old, new in RENAMED.items():
        if old in raw and new in raw:
            faults.append(Fault(old, f"it is the old name of [{new}], and both are given", remedy=f"leave [{old}] out"))
    for name in (*REQUESTS, *RENAMED):
        table = raw.pop(name, None)
        if isinstance(table, Mapping):
            row, wrong = read_table(REQUESTS[RENAMED.get(name, name)], table, (name,))
            requests[name] = row.table
            faults += wrong
        elif table is not None:
            faults.append(Fault(name, found=toml(table), expected=f"one table [{name}]"))
    return requests, faults
