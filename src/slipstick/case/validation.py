"""A table of the file against its keys: every fault in it, and the values that are right."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import copy, deepcopy
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from pydantic import BaseModel, ValidationError, create_model

from slipstick.case.table import RawTable, Table, toml
from slipstick.case.top import TopTable
from slipstick.errors import IS_MISSING, UNKNOWN_KEY, Fault, InputError, Where, close_names


@dataclass(frozen=True)
class ReadTable:
    """One table of the file.

    Parameters
    ----------
    where
        Its path.
    table
        Its keys; one that is at fault has its default, or None.
    wrong
        Paths, within the table, to its faulty values.
    """

    where: Where
    table: Any
    wrong: frozenset[Where]

    @property
    def complete(self) -> bool:
        """Whether nothing in it is at fault."""
        return not self.wrong

    def right(self, *keys: str) -> bool:
        """Whether nothing in these keys is at fault."""
        return not {place[0] for place in self.wrong if place} & set(keys)

    def get(self, key: str, name: str = "") -> Any:
        """The value of a key that is right (``name`` is that of the field where the key is none), else None."""
        return getattr(self.table, name or key) if self.right(key) else None


def read_table(model: type[Table], raw: RawTable, where: Where) -> tuple[ReadTable, list[Fault]]:
    """A table with its right values, and all faults with their whole path."""
    faults_of_keys, meant = _model_faults(model, raw)
    faults = list(dict.fromkeys([*faults_of_keys, *model.cross_check(_as_meant(raw, meant))]))
    wrong = {fault.where for fault in faults} | set(meant.values())
    if (model.chosen_by,) in wrong - set(meant.values()):
        faults = [fault for fault in faults if fault.where[0] in (model.chosen_by, *model.of_all)]
    kept: dict[str, Any] = deepcopy(dict(raw))
    for place in wrong:
        _remove(kept, place)
    try:
        table = _lenient(model).model_validate(kept)
    except ValidationError as error:  # what is left of a table is none
        for one in error.errors():
            kept.pop(str(one["loc"][0]), None)
        table = _lenient(model).model_validate(kept)
    return ReadTable(where, table, frozenset(wrong)), [fault.inside(*where) for fault in faults]


def _as_meant(raw: RawTable, meant: Mapping[Where, Where]) -> dict[str, Any]:
    """The table with its misspelt keys as they were meant, so that nothing else is said to be missing."""
    right = {place[0]: new[0] for place, new in meant.items() if len(place) == 1}
    return {str(right.get(key, key)): value for key, value in raw.items()}


def _remove(table: dict[str, Any], where: Where) -> None:
    """Leave out a faulty value; of a nested table only that value."""
    inner: Any = table
    for part in where[:-1]:
        if not isinstance(inner.get(part), dict):
            inner.pop(part, None)
            return
        inner = inner[part]
    if where:
        inner.pop(where[-1], None)


@cache
def _lenient(model: type[Table]) -> type[BaseModel]:
    """The same table, with None for required keys that are not there."""
    fields: dict[str, Any] = {}
    for name, field in model.model_fields.items():
        if field.is_required():
            optional = copy(field)
            optional.default = None
            fields[name] = (field.annotation, optional)
    return create_model(model.__name__, __base__=model, **fields)


def _model_faults(model: type[BaseModel], raw: RawTable) -> tuple[list[Fault], dict[Where, Where]]:
    """Faults of each key by itself, and the meaning of misspelt keys, which are not reported as missing."""
    try:
        model.model_validate(raw)
        return [], {}
    except ValidationError as error:
        errors = error.errors(include_url=False)
    meant: dict[Where, Where] = {}
    for where in (tuple(one["loc"]) for one in errors if one["type"] == "extra_forbidden"):
        used = _at(raw, where[:-1])
        absent = [key for key in _keys(_owner(model, where)) if key not in used]
        for key in close_key(where[-1], absent):
            meant[where] = (*where[:-1], key)
    faults = [fault for one in errors for fault in _faults(model, one, raw)]
    return [f for f in faults if not (f.statement == IS_MISSING and f.where in meant.values())], meant


def _faults(model: type[BaseModel], one: Any, raw: RawTable) -> list[Fault]:
    """Faults for one finding of pydantic."""
    where, kind = tuple(one["loc"]), one["type"]
    if kind == "extra_forbidden":
        keys, used = _keys(_owner(model, where)), _at(raw, where[:-1])
        remedy = _elsewhere(_owner(model, where), where[-1]) or key_suggestion(where[-1], keys, used)
        return [Fault(where, UNKNOWN_KEY, remedy=remedy)]
    if kind == "missing":
        return [Fault(where, IS_MISSING, remedy=f"give {_description(model, where)}")]
    where, shown = _existing(where, raw), toml(one["input"])
    error = one.get("ctx", {}).get("error")
    if isinstance(error, InputError):
        told = [fault if fault.found or fault.statement else replace(fault, found=shown) for fault in error.faults]
        return [fault.inside(*where) for fault in told]
    return [Fault(where, found=toml(_at(raw, where)), expected=_description(model, where))]


def key_suggestion(name: object, keys: Iterable[str], used: Iterable[str]) -> str:
    """The key that an unknown one was meant to be, among those that are not ``given``, else all of these.

    >>> key_suggestion("Stiffness", ["mass", "stiffness", "dofs"], ["mass"])
    "did you mean 'stiffness'?"
    >>> key_suggestion("nodes", ["mass", "stiffness"], ["mass"]), key_suggestion("nodes", ["mass"], ["mass"])
    ('keys not used yet: stiffness', 'leave it out, every key there is has been given')
    """
    absent = [key for key in keys if key not in set(used)]
    if close := close_key(name, absent):
        return f"did you mean '{close[0]}'?"
    if not absent:
        return "leave it out, every key there is has been given"
    return f"keys not used yet: {', '.join(absent)}"


def close_key(name: object, keys: Iterable[str]) -> list[str]:
    """The key that is spelt like it, if any."""
    return close_names(str(name), keys)


def _elsewhere(model: type[BaseModel], name: object) -> str:
    """Where a key belongs that the table of the file does not know; empty where nothing is known of it."""
    if name in _keys(TopTable):
        return "it belongs to the top of the file, above the first [table]"
    for field_name, field in model.model_fields.items():
        if any(name in _keys(nested) for nested in _models_in(field.annotation)):
            return f"it belongs into {field.alias or field_name} = {{ {name} = ... }}"
    return ""


def _at(raw: Any, where: Where) -> Any:
    """The value of the file at a path that exists."""
    for part in where:
        raw = raw[part]
    return raw


def _existing(where: Where, raw: Any) -> Where:
    """The part of a path that is in the file: pydantic goes on with the kinds it tried."""
    for depth, part in enumerate(where):
        if not (isinstance(raw, Mapping) and part in raw) and not (isinstance(raw, list) and isinstance(part, int)):
            return where[:depth]
        raw = raw[part]  # type: ignore[index]
    return where


def _keys(model: type[BaseModel]) -> list[str]:
    return [field.alias or name for name, field in model.model_fields.items()]


def _owner(model: type[BaseModel], where: Where) -> type[BaseModel]:
    """The nested model that holds the last key of a path."""
    for part in where[:-1]:
        field = next((f for n, f in model.model_fields.items() if (f.alias or n) == part), None)
        nested = list(_models_in(field.annotation)) if field else []
        model = nested[0] if nested else model
    return model


def _models_in(annotation: object) -> Iterable[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in getattr(annotation, "__args__", ()):
        yield from _models_in(argument)


def _description(model: type[BaseModel], where: Where) -> str:
    """The description of the innermost field of a path that has one."""
    best = "a table with the keys " + ", ".join(_keys(model))
    owner: type[BaseModel] | None = model
    for part in where:
        field = next((f for n, f in owner.model_fields.items() if (f.alias or n) == part), None) if owner else None
        if field is None:
            continue
        best = field.description or best
        owner = next(iter(_models_in(field.annotation)), None)
    return best
