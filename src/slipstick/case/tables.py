"""The tables of a case file: which keys there are and what each expects (its description is used in messages)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PlainValidator

from slipstick.balance.loads import place_faults, way_faults
from slipstick.case.sentences import toml, unexpected
from slipstick.errors import IS_MISSING, UNKNOWN_KEY, Fault, InputError
from slipstick.faults import suggestion
from slipstick.quantities import harmonic_orders, ratio_of_periods, read_angle, read_frequency
from slipstick.units import Units, label_faults


def positive_frequency(value: Any) -> float:
    """A frequency with or without a unit, rad/s."""
    number = read_frequency(value)
    if number <= 0:
        raise unexpected("a frequency > 0")
    return number


def _cosines(value: Any) -> dict[str, float]:
    """``"x"`` or ``{x = 1.0, y2 = -1.0}``."""
    if isinstance(value, str) and value:
        return {value: 1.0}
    numbers = isinstance(value, dict) and value and all(is_number(c) for c in value.values())
    if not numbers:
        raise unexpected('the name of a dof such as "x", or a table of cosines such as { x = 1.0, x2 = -1.0 }')
    if not any(value.values()):
        raise unexpected("at least one cosine that is not 0")
    return {str(dof): float(cosine) for dof, cosine in value.items()}


def _base(value: Any) -> str | dict[str, float]:
    """``"x"`` as it is, or ``{x1 = 1.0, x2 = 1.0}``."""
    cosines = _cosines(value)
    return value if isinstance(value, str) else cosines


def _orders_to_numbers(value: Any) -> dict[int, float]:
    """``{ "1" = 2.0 }``: harmonic of the rubbing motion -> amplitude."""
    right = isinstance(value, dict) and all(
        k.isdecimal() and len(k) < 7 and is_number(v) for k, v in value.items() if isinstance(k, str)
    )
    if not right:
        raise unexpected('a table of harmonic = amplitude such as { "1" = 2.0 }, amplitudes finite lengths')
    return {int(order): float(amplitude) for order, amplitude in value.items()}


def is_number(value: Any) -> bool:
    """Whether it is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < float("inf")


def _number_or_table(value: Any) -> Any:
    """A number >= 0, or ``{ table = [[25, 0.5], [200, 0.45]], interpolation = "pchip" }`` over temperature."""
    if not isinstance(value, dict):
        if not is_number(value):
            raise unexpected("a number >= 0, or { table = [[temperature, value], ...] }")
        if value < 0:
            raise unexpected("a number >= 0")
        return float(value)
    from slipstick.state.thermal.friction_curve import FrictionCurve

    known = ("table", "interpolation")
    faults = [Fault(key, UNKNOWN_KEY, remedy=suggestion(key, known)) for key in value if key not in known]
    if "table" not in value and not any(get_close_matches(key, known) for key in value):
        faults.append(Fault("table", IS_MISSING, remedy="give rows of temperature and value"))
    elif "table" in value:
        try:
            FrictionCurve(mu=value["table"], interpolation=str(value.get("interpolation", "pchip")))
        except InputError as error:
            faults += [fault.below("mu") for fault in error.faults]
    if faults:
        raise InputError(faults)
    return value


Frequency = Annotated[float, PlainValidator(positive_frequency)]
Cosines = Annotated[dict[str, float], PlainValidator(_cosines)]
Periodic = Annotated[dict[int, float], PlainValidator(_orders_to_numbers)]
Harmonic = Annotated[int, Field(ge=0, le=10_000)]
NotNegative = Annotated[float, Field(ge=0)]
NumberOrTable = Annotated[float | dict[str, Any], PlainValidator(_number_or_table)]
MatrixGiven = Annotated[list[Any] | str, PlainValidator(lambda value: _list_or_file(value))]


def _list_or_file(value: Any) -> Any:
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


class Table(BaseModel):
    """A table of the file: no unknown keys, no silent conversion, no inf or nan."""

    model_config = ConfigDict(
        strict=True, extra="forbid", allow_inf_nan=False, frozen=True, populate_by_name=False,
        defer_build=True,  # tables that a case does not have need no validators
    )  # fmt: skip

    @classmethod
    def cross_check(cls, raw: Mapping[str, Any]) -> list[Fault]:
        """Faults between keys, found on the raw table so that they are told together with wrong values."""
        return []


def _label(value: Any) -> str:
    if faults := label_faults(value):
        raise InputError([replace(fault, found=toml(value)) for fault in faults])
    return str(value)


Label = Annotated[str, PlainValidator(_label)]


class UnitsTable(Table):
    """``units = { length = "mm", force = "N", time = "s" }``: names alone, nothing is converted."""

    length: Label | None = Field(default=None, description='a text such as "mm"')
    force: Label | None = Field(default=None, description='a text such as "N"')
    time: Label | None = Field(default=None, description='a text such as "s"')
    temperature: Label | None = Field(default=None, description='a text such as "degC"')

    @property
    def units(self) -> Units:
        """The names given, over the words for the dimensions."""
        return Units(**self.model_dump(exclude_none=True))


class TopTable(Table):
    """Keys above the first section."""

    format: Literal[1] = Field(description="format = 1, the version of the case file")
    title: str = Field(default="", description="a text")
    harmonics: Annotated[list[int], PlainValidator(harmonic_orders)] = Field(
        description='the harmonics kept, such as "0..10" or [0, 1, 3, 5]'
    )
    period_ratio: Annotated[tuple[int, int], PlainValidator(ratio_of_periods)] | None = Field(
        default=None, description='the period of the load over that of the rub, such as "3/2" or [3, 2]'
    )
    units: UnitsTable = Field(
        default=UnitsTable(), description='a table such as { length = "mm", force = "N", time = "s" }'
    )


class LoadTable(Table):
    """``[[load]]``."""

    dof: str | None = Field(default=None, description="the name of a dof")
    shape: str | None = Field(default=None, description="the name of a load shape of the structure")
    base: Annotated[str | dict[str, float], PlainValidator(_base)] | None = Field(
        default=None,
        description='dofs with their motion for a unit motion of the support, { x1 = 1.0, x2 = 1.0 }, or a name: "x"',
    )
    motion: Literal["displacement", "acceleration"] | None = Field(
        default=None, description='"displacement" or "acceleration", what is given of the support'
    )
    harmonic: Harmonic = Field(default=1, description="a whole number >= 0 (0 is a static load)")
    cos: float = Field(default=0.0, description="a finite number, the cosine part")
    sin: float = Field(default=0.0, description="a finite number, the sine part")
    amplitude: float | None = Field(default=None, description="a finite number: amplitude * cos(harmonic tau + phase)")
    phase: Annotated[float, PlainValidator(read_angle)] | None = Field(
        default=None, description='a number in rad, or text such as "90 deg"'
    )

    @classmethod
    def cross_check(cls, raw: Mapping[str, Any]) -> list[Fault]:
        """Where and how much, each said once."""
        faults = [*place_faults(raw), *way_faults(raw)]
        if not {"amplitude", "cos", "sin"} & set(raw):
            faults.append(Fault(statement="no force is given", remedy="give cos, sin, or amplitude with phase"))
        return faults


class RubbingTable(Table):
    """``rubbing = { velocity = 10.0, cos = { "1" = 2.0 } }``."""

    velocity: float = Field(default=0.0, description="a finite number, length/time")
    velocity_per_omega: float = Field(default=0.0, description="a finite number, length: added for each rad/s of omega")
    cos: Periodic = Field(default={}, description='a table such as { "1" = 2.0 }')
    sin: Periodic = Field(default={}, description='a table such as { "1" = 2.0 }')
    normal_cos: Periodic = Field(default={}, description='a table such as { "2" = 3.7e-4 }')
    normal_sin: Periodic = Field(default={}, description='a table such as { "2" = 3.7e-4 }')


class ContactThermalTable(Table):
    """``[contact.thermal]``: how friction heats one contact."""

    background: float | None = Field(default=None, description="a finite number, the temperature without friction")
    resistance: NotNegative | None = Field(default=None, description="a number >= 0, temperature per dissipated power")


class ThermalTable(Table):
    """``[thermal]``: how friction heats contacts that share a body."""

    influence: MatrixGiven = Field(
        description="a square list of rows, or the name of an .npz or .mtx file: temperature per power"
    )
    contacts: list[str] | None = Field(
        default=None, min_length=1, description="a list of contact names, in the order of the influence matrix"
    )
    background: float | None = Field(default=None, description="a finite number, the temperature without friction")


class ContactTable(Table):
    """``[[contact]]``."""

    name: str = Field(min_length=1, description='a name for the contact, such as "damper"')
    tangential: Cosines = Field(description='the dof that slides, such as "x" or { x = 1.0, x2 = -1.0 }')
    normal: Cosines | None = Field(default=None, description='the dof across the contact, such as "z" or { z = 1.0 }')
    kt: NumberOrTable = Field(description="a number >= 0, the tangential contact stiffness (force/length)")
    mu: NumberOrTable = Field(description="a number >= 0, the friction coefficient")
    kn: NumberOrTable | None = Field(
        default=None, description="a number >= 0, the normal contact stiffness (force/length)"
    )
    gap: float | None = Field(default=None, description="a finite number, the gap (> 0) or interference (< 0)")
    normal_load: NotNegative | None = Field(default=None, description="a number >= 0, the static normal load (force)")
    rubbing: RubbingTable | None = Field(default=None, description="a table such as { velocity = 10.0 }")
    thermal: ContactThermalTable | None = Field(
        default=None, description="a table such as { background = 25.0, resistance = 8.0 }"
    )

    @classmethod
    def cross_check(cls, raw: Mapping[str, Any]) -> list[Fault]:
        """The normal load is said in one way."""
        faults = []
        if "gap" in raw and "normal_load" in raw:
            faults.append(Fault("gap", "is given together with normal_load", remedy="keep one (normal_load = -kn gap)"))
        elif "gap" not in raw and "normal_load" not in raw:
            remedy = "give normal_load = 800.0, or normal, kn and gap"
            faults.append(Fault(statement="the normal load is missing", remedy=remedy))
        if "kn" not in raw and (_moves_along_normal(raw) or ("gap" in raw and "normal_load" not in raw)):
            remedy = "give the normal contact stiffness, needed with normal, gap, normal_cos, normal_sin and profile"
            faults.append(Fault("kn", IS_MISSING, remedy=remedy))
        elif raw.get("kn") == 0 and raw.get("normal_load"):
            faults.append(Fault("kn", found="0, which cannot carry a normal load", expected="kn > 0"))
        return faults


class StopTable(ContactTable):
    """``[[contact]]`` without friction and without a tangential direction."""

    tangential: Cosines | None = Field(default=None, exclude=True, description="the dof that slides")  # type: ignore[assignment]
    normal: Cosines = Field(description='the dof across the contact, such as "z" or { z = 1.0 }')
    kt: NumberOrTable = Field(default=0.0, description="0: there is no friction")
    mu: NumberOrTable = Field(default=0.0, description="0: there is no friction")


def _moves_along_normal(contact: Mapping[str, Any]) -> bool:
    """Whether a contact, or its opposing surface, is said to move along the normal."""
    rubbing = contact.get("rubbing")
    across = ("normal_cos", "normal_sin")
    rotor = contact.get("rotor")
    along_casing = isinstance(rotor, Mapping) and bool(rotor.get("profile"))
    return "normal" in contact or along_casing or (isinstance(rubbing, Mapping) and any(rubbing.get(k) for k in across))


class OutputTable(Table):
    """``[output]``."""

    dofs: list[str] = Field(min_length=1, description='a list of dof names such as ["x"]')
