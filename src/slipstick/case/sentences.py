"""Faults in the words of a case file: where its reader finds the place, and values as TOML spells them."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import date, time
from typing import Any

from slipstick.errors import UNKNOWN_KEY, Fault, InputError, Where
from slipstick.faults import shown

REPEATED_SECTIONS = ("load", "contact")
_VERBS = ("track", "optimal", "modes", "cycles")
CASE_SECTIONS = ("structure", *REPEATED_SECTIONS, "thermal", "response", "output", "study", *_VERBS)

_LONGEST, _MOST = 60, 20


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
    """
    section, rest = where[:1], where[1:]
    if section and section[0] in REPEATED_SECTIONS:
        words = [f"[[{section[0]}]]", *(_which(name) for name in rest[:1])]
        rest = rest[1:]
    elif section and section[0] in CASE_SECTIONS:
        words = [f"[{section[0]}]"]
    else:
        words, rest = [], where
    key = "".join(f", number {part + 1}" if isinstance(part, int) else f".{part}" for part in rest)
    return " ".join([*words, key.lstrip(".")]).strip().replace(" ,", ",")


def _which(name: str | int) -> str:
    return f"number {name + 1}" if isinstance(name, int) else f"'{name}'"


def toml(value: Any) -> str:
    """A value as it looks in the file, shortened.

    >>> toml(True), toml("x"), toml({"a": 1}), toml(["x", 2.0]), toml([0] * 30), toml([{}])
    ('true', '"x"', '{ a = 1 }', '["x", 2.0]', 'a list of 30', 'a list of tables')
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        text = f"{{ {', '.join(f'{key} = {toml(inner)}' for key, inner in list(value.items())[:_MOST])} }}"
        return text if value and len(value) <= _MOST and len(text) <= _LONGEST and text.isprintable() else "a table"
    if isinstance(value, list):
        if value and isinstance(value[0], Mapping):
            return "a list of tables"
        text = f"[{', '.join(map(toml, value[:_MOST]))}]"
        return text if len(value) <= _MOST and len(text) <= _LONGEST else f"a list of {len(value)}"
    if isinstance(value, str):
        text = "".join(c if c.isprintable() else "?" for c in value)
        return f'"{text}"' if len(text) <= _LONGEST - 2 else f'"{text[: _LONGEST - 4]}...'
    return value.isoformat() if isinstance(value, date | time) else shown(value)


def unexpected(expected: str) -> InputError:
    """The exception for a value of which only what was expected is to be said; what was found is known outside."""
    return InputError(Fault(expected=expected))
