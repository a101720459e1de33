"""Faults of a case file as sentences: which key, what was found, what was expected."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from pydantic import BaseModel, ValidationError

Location = tuple[int | str, ...]


def shown(value: Any, limit: int = 60) -> str:
    """A value as it looks in the file, shortened."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list):
        text = "a list of tables" if value and isinstance(value[0], Mapping) else str(value[:20])
        return text if len(value) <= 20 and len(text) <= limit else f"a list of {len(value)}"
    text = f'"{value}"' if isinstance(value, str) else str(value)
    text = "".join(c if c.isprintable() else "?" for c in text)
    return text if len(text) <= limit else text[: limit - 3] + "..."


def suggestion(word: object, known: Iterable[str]) -> str:
    """``; did you mean 'kt'?``, or the list of what there is.

    >>> suggestion("stifness", ["mass", "stiffness"])
    "did you mean 'stiffness'?"
    """
    names = list(known)
    close = get_close_matches(str(word), names, n=1, cutoff=0.6)
    if close:
        return f"did you mean '{close[0]}'?"
    if not names:
        return "there is none"
    return "there are " + ", ".join(names[:12]) + (f", ... ({len(names)} in all)" if len(names) > 12 else "")


def section_name(section: str, index: int | None = None, table: Any = None) -> str:
    """``[structure]``, or ``[[contact]] 'damper'`` for one of several tables."""
    if index is None:
        return f"[{section}]" if section else "the case file"
    name = table.get("name") if isinstance(table, Mapping) else None
    return f"[[{section}]] '{name}'" if isinstance(name, str) else f"[[{section}]] number {index + 1}"


def model_faults(model: type[BaseModel], table: Any, section: str) -> tuple[BaseModel | None, list[str]]:
    """The validated model, or one sentence for each fault in the table."""
    try:
        return model.model_validate(table), []
    except ValidationError as error:
        faults = error.errors(include_url=False)
    unknown = {_last(f["loc"]): f for f in faults if f["type"] == "extra_forbidden"}
    fields = _keys(model)
    meant = {m for word in unknown for m in get_close_matches(word, [k for k in fields if k not in table], n=1)}
    sentences = []
    for fault in faults:
        if fault["type"] == "missing" and len(fault["loc"]) == 1 and _last(fault["loc"]) in meant:
            continue
        sentences.append(_sentence(model, fault, section, table))
    return None, list(dict.fromkeys(sentences))


def _sentence(model: type[BaseModel], fault: Any, section: str, table: Any) -> str:
    location: Location = fault["loc"]
    key, where = ".".join(str(part) for part in location), section if section != "the case file" else ""
    path = f"{where} {key}".strip()
    expected = _description(model, location)
    kind = fault["type"]
    if kind == "extra_forbidden":
        owner = _owner(model, location)
        place = f"{section} {'.'.join(str(p) for p in location[:-1])}".strip()
        known = [k for k in _keys(owner) if not isinstance(table, Mapping) or len(location) > 1 or k not in table]
        return f"unknown key '{_last(location)}' in {place}; {suggestion(_last(location), known or _keys(owner))}"
    if kind == "missing":
        return f"{path} is missing; give {expected}"
    found = f"{path}: found {shown(fault['input'])}"
    if kind == "value_error":
        return f"{found}; {fault['ctx']['error']}"
    return f"{found}; expected {expected}"


def _last(location: Sequence[int | str]) -> str:
    return str(location[-1]) if location else ""


def _keys(model: type[BaseModel]) -> list[str]:
    return [field.alias or name for name, field in model.model_fields.items()]


def _owner(model: type[BaseModel], location: Location) -> type[BaseModel]:
    """The nested model that holds the last key of a location."""
    for part in location[:-1]:
        field = next((f for n, f in model.model_fields.items() if (f.alias or n) == part), None)
        nested = list(_models_in(field.annotation)) if field else []
        model = nested[0] if nested else model
    return model


def _models_in(annotation: Any) -> Iterable[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in getattr(annotation, "__args__", ()):
        yield from _models_in(argument)


def _description(model: type[BaseModel], location: Location) -> str:
    """What the innermost described field of a location expects."""
    best = "a table with the keys " + ", ".join(_keys(model))
    owner: type[BaseModel] | None = model
    for part in location:
        field = next((f for n, f in owner.model_fields.items() if (f.alias or n) == part), None) if owner else None
        if field is None:
            continue
        best = field.description or best
        owner = next(iter(_models_in(field.annotation)), None)
    return best
