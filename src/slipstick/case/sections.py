"""The sections of a case: the right ones of their tables, and every fault within one table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from slipstick.case.fe_tables import contact_table
from slipstick.case.peak_tables import PEAK_TABLES
from slipstick.case.response_table import ResponseTable
from slipstick.case.sentences import CASE_SECTIONS, toml
from slipstick.case.tables import LoadTable, OutputTable, Table, ThermalTable, TopTable
from slipstick.case.validation import ReadTable, close_key, key_suggestion, read_table
from slipstick.errors import IS_MISSING, UNKNOWN_KEY, Fault, Where

MOST_TABLES = 10_000

_MISSING = {
    "structure": "describe the structure by its matrices or its modes",
    "contact": "give at least one contact, without any the response is linear",
    "response": "give it with the keys from and to",
}
"""Sections that every case has, and what to do where one has not."""


@dataclass(frozen=True, kw_only=True)
class Sections:
    """The tables of a case but ``[structure]``; None where there is none, or something else than a table."""

    top: ReadTable
    loads: tuple[ReadTable, ...]
    contacts: tuple[ReadTable, ...]
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


def read_sections(raw: Mapping[str, Any]) -> tuple[Sections, list[Fault]]:
    """All sections but ``[structure]``, and what is wrong with each of them alone."""
    top, faults = _top(raw)
    reader = _Reader(raw, faults)
    sections = Sections(
        top=top,
        loads=reader.many("load", lambda _: LoadTable),
        contacts=reader.many("contact", contact_table),
        thermal=reader.one("thermal", ThermalTable),
        response=reader.one("response", ResponseTable),
        output=reader.one("output", OutputTable),
    )
    return sections, faults


def _top(raw: Mapping[str, Any]) -> tuple[ReadTable, list[Fault]]:
    """Keys above the first section, and sections that are not there; a misspelt name is told alone."""
    keys = [field.alias or name for name, field in TopTable.model_fields.items()]
    absent = [key for key in (*keys, *CASE_SECTIONS) if key not in raw]
    unknown = [key for key in raw if key not in (*keys, *CASE_SECTIONS)]
    close = {key: close_key(key, absent) for key in unknown}
    elsewhere = {"study", *PEAK_TABLES}  # read by themselves, before
    remedies = {key: key_suggestion(key, absent, () if close[key] else elsewhere) for key in unknown}
    faults = [Fault(key, UNKNOWN_KEY, remedy=remedy) for key, remedy in remedies.items()]
    row, own = read_table(TopTable, {key: raw[key] for key in keys if key in raw}, ())
    own += [
        Fault(name, IS_MISSING, remedy=remedy)
        for name, remedy in _MISSING.items()
        if not raw.get(name, name not in raw and [])
    ]
    meant = {word for words in close.values() for word in words}
    return row, faults + [f for f in own if not (f.statement == IS_MISSING and f.where[0] in meant)]


class _Reader:
    """Reads tables by the name of their section; keeps their faults."""

    def __init__(self, raw: Mapping[str, Any], faults: list[Fault]) -> None:
        self._raw, self._faults = raw, faults

    def one(self, section: str, model: type[Table]) -> ReadTable | None:
        if section not in self._raw:
            return None
        table = self._raw[section]
        if isinstance(table, Mapping):
            return self._row(model, table, (section,))
        self._faults.append(Fault(section, found=toml(table), expected=f"one table [{section}]"))
        return None

    def many(self, section: str, model: Callable[[Mapping[str, Any]], type[Table]]) -> tuple[ReadTable, ...]:
        given = self._raw.get(section, [])
        tables = isinstance(given, list) and all(isinstance(table, Mapping) for table in given)
        if not tables or len(given) > MOST_TABLES:
            double = f"tables that begin with [[{section}]] (double brackets)"
            expected = f"at most {MOST_TABLES}" if tables else double
            found = "a table" if isinstance(given, Mapping) else toml(given)
            self._faults.append(Fault(section, found=found, expected=expected))
            return ()
        names = Counter(table.get("name") for table in given if isinstance(table.get("name"), str))
        return tuple(
            self._row(model(table), table, _place(section, i, table.get("name"), names))
            for i, table in enumerate(given)
        )

    def _row(self, model: type[Table], table: Mapping[str, Any], where: Where) -> ReadTable:
        row, faults = read_table(model, table, where)
        self._faults += faults
        return row


def _place(section: str, number: int, name: Any, names: Mapping[str, int]) -> Where:
    """By its name where that is its own, else by its number."""
    return (section, name if isinstance(name, str) and name and names[name] == 1 else number)
