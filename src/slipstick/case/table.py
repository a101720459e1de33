"""The base class of every table of a case file, the values it may hold, and how a value looks in the file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import date, time
from typing import Annotated, Any, ClassVar, TypeGuard

from pydantic import BaseModel, ConfigDict, Field, PlainValidator, ValidationError

from slipstick.errors import Fault, InputError
from slipstick.faults import shown
from slipstick.quantities import read_frequency

_LONGEST, _MOST = 60, 20


RawTable = Mapping[str, Any]
"""A table of the file as TOML reads it, before anything in it is checked."""


def toml(value: object) -> str:
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
    """The exception for a wrong value; it states the expected one, and the caller adds the value found."""
    return InputError(Fault(expected=expected))


@contextmanager
def at(*where: str) -> Iterator[None]:
    """Put this path in front of faults that a block raises."""
    try:
        yield
    except InputError as error:
        raise InputError([fault.inside(*where) for fault in error.faults]) from None


class Table(BaseModel):
    """A table of the file: no unknown keys, no silent conversion, no inf or nan."""

    model_config = ConfigDict(
        strict=True, extra="forbid", allow_inf_nan=False, frozen=True, populate_by_name=False,
        defer_build=True,  # tables that a case does not have need no validators
    )  # fmt: skip

    chosen_by: ClassVar[str] = ""
    """The key whose value says which further keys there are; where it is at fault these are not judged."""
    of_all: ClassVar[tuple[str, ...]] = ()
    """Keys that are judged then all the same."""

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """Faults between keys, found on the raw table so that they are told together with wrong values."""
        return []

    @property
    def stated(self) -> dict[str, Any]:
        """The keys that the file gives, by the names of their fields and in the order of these."""
        return self.given(*type(self).model_fields)

    def given(self, *names: str) -> dict[str, Any]:
        """Those of some keys that the file gives, in this order."""
        values = {name: getattr(self, name) for name in names if name in self.model_fields_set}
        return {name: value.stated if isinstance(value, Table) else value for name, value in values.items()}


def right_tables(model: type[Table]) -> Callable[[Any], list[Any] | None]:
    """A validator of tables that another one keeps; None where one is not right: its section finds the faults."""

    def validate(tables: Any) -> list[Any] | None:
        try:
            found = [model.model_validate(raw) for raw in tables]
        except (ValidationError, InputError, TypeError):
            return None
        return None if any(model.cross_check(raw) for raw in tables) else found

    return validate


def is_number(value: object) -> TypeGuard[float]:
    """Whether it is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < float("inf")


def is_whole(value: object) -> TypeGuard[int]:
    """Whether it is a whole number."""
    return isinstance(value, int) and not isinstance(value, bool)


def positive_frequency(value: object) -> float:
    """A frequency with or without a unit, rad/s."""
    number = read_frequency(value)
    if number <= 0:
        raise unexpected("a frequency > 0")
    return number


def vector(value: object) -> tuple[float, ...]:
    """Three numbers, not all zero."""
    if not (isinstance(value, list) and len(value) == 3 and all(map(is_number, value)) and any(value)):
        raise unexpected("three numbers such as [0, 1, 0], not all 0")
    return tuple(map(float, value))


def cosines(value: Any) -> dict[str, float]:
    """Direction cosines by dof, from ``"x"`` or ``{x = 1.0, y2 = -1.0}``."""
    if isinstance(value, str) and value:
        return {value: 1.0}
    numbers = isinstance(value, dict) and value and all(is_number(c) for c in value.values())
    if not numbers:
        raise unexpected('the name of a dof such as "x", or a table of cosines such as { x = 1.0, x2 = -1.0 }')
    if not any(value.values()):
        raise unexpected("at least one cosine that is not 0")
    return {str(dof): float(cosine) for dof, cosine in value.items()}


def directions(value: Any) -> dict[str, float] | tuple[dict[str, float], dict[str, float]]:
    """One direction, or the two of a surface that slides in its plane, ``["x", "y"]``."""
    if not isinstance(value, list):
        return cosines(value)
    if len(value) != 2:
        raise unexpected('one direction such as "x", or two such as ["x", "y"]')
    return cosines(value[0]), cosines(value[1])


def _along_both(value: Any) -> bool:
    """Whether it is a vector of two finite numbers."""
    return isinstance(value, list) and len(value) == 2 and all(map(is_number, value))


def along_surface(value: Any) -> float | tuple[float, float]:
    """A number, or a vector of two for a surface that slides in its plane."""
    if _along_both(value):
        return float(value[0]), float(value[1])
    if not is_number(value):
        raise unexpected("a finite number, or two such as [3.0, 0.0] with two tangential directions")
    return float(value)


def _orders_to_numbers(value: Any) -> dict[int, float]:
    """``{ "1" = 2.0 }``: harmonic of the rubbing motion -> amplitude."""
    right = isinstance(value, dict) and all(
        k.isdecimal() and len(k) < 7 and is_number(v) for k, v in value.items() if isinstance(k, str)
    )
    if not right:
        raise unexpected('a table of harmonic = amplitude such as { "1" = 2.0 }, amplitudes finite lengths')
    return {int(order): float(amplitude) for order, amplitude in value.items()}


def _orders_along(value: Any) -> dict[int, Any]:
    """The same with amplitudes that may be vectors of two."""
    plain = isinstance(value, dict) and {k: 0.0 if _along_both(v) else v for k, v in value.items()}
    return {order: along_surface(value[str(order)]) for order in _orders_to_numbers(plain)}


def list_or_file(value: Any) -> Any:
    """A square list of rows, or the name of a file."""
    if isinstance(value, str) and value:
        return value
    square = isinstance(value, list) and value and all(isinstance(row, list) for row in value)
    if not square:
        raise unexpected("a square list of rows such as [[1.0, 0.0], [0.0, 1.0]], or a file .npz or .mtx")
    for i, row in enumerate(value):
        if len(row) != len(value):
            rows = f"row {i + 1} has {len(row)} entries but there are {len(value)} rows"
            raise InputError(Fault(statement=rows, expected="a square"))
        for j, entry in enumerate(row):
            if not is_number(entry):
                wrong = f"row {i + 1}, column {j + 1} is {toml(entry)}"
                raise InputError(Fault(found=toml(value), statement=wrong, expected="a finite number"))
    return value


Frequency = Annotated[float, PlainValidator(positive_frequency)]
Cosines = Annotated[dict[str, float], PlainValidator(cosines)]
Directions = Annotated[Any, PlainValidator(directions)]
AlongSurface = Annotated[Any, PlainValidator(along_surface)]
PeriodicAlong = Annotated[dict[int, Any], PlainValidator(_orders_along)]
Periodic = Annotated[dict[int, float], PlainValidator(_orders_to_numbers)]
Harmonic = Annotated[int, Field(ge=0, le=10_000)]
NotNegative = Annotated[float, Field(ge=0)]
Positive = Annotated[float, Field(gt=0)]
MatrixGiven = Annotated[list[Any] | str, PlainValidator(list_or_file)]
Vector = Annotated[tuple[float, float, float], PlainValidator(vector)]
