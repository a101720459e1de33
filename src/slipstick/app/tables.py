"""The tables of a case file: which keys there are and what each expects (its description is used in messages)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PlainValidator

from slipstick.app.quantity_texts import harmonic_orders, ratio_of_periods, read_angle, read_frequency
from slipstick.app.spacing import Spacing, spacing_or_list
from slipstick.errors import InputError
from slipstick.units import LONGEST, Units, label_fault


def _positive_frequency(value: Any) -> float:
    number = read_frequency(value)
    if number <= 0:
        raise ValueError("expected a frequency > 0")
    return number


def _cosines(value: Any) -> dict[str, float]:
    """``"x"`` or ``{x = 1.0, y2 = -1.0}``."""
    if isinstance(value, str) and value:
        return {value: 1.0}
    numbers = isinstance(value, dict) and value and all(_is_number(c) for c in value.values())
    if not numbers:
        raise ValueError('expected the name of a dof such as "x", or a table of cosines such as { x = 1.0, x2 = -1.0 }')
    if not any(value.values()):
        raise ValueError("expected at least one cosine that is not 0")
    return {str(dof): float(cosine) for dof, cosine in value.items()}


def _base(value: Any) -> str | dict[str, float]:
    """``"x"`` as it is, or ``{x1 = 1.0, x2 = 1.0}``."""
    cosines = _cosines(value)
    return value if isinstance(value, str) else cosines


def _orders_to_numbers(value: Any) -> dict[int, float]:
    """``{ "1" = 2.0 }``: harmonic of the rubbing motion -> amplitude."""
    right = isinstance(value, dict) and all(
        k.isdecimal() and len(k) < 7 and _is_number(v) for k, v in value.items() if isinstance(k, str)
    )
    if not right:
        raise ValueError('expected a table of harmonic = amplitude such as { "1" = 2.0 }, amplitudes finite lengths')
    return {int(order): float(amplitude) for order, amplitude in value.items()}


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < float("inf")


def _number_or_table(value: Any) -> Any:
    """A number >= 0, or ``{ table = [[25, 0.5], [200, 0.45]], interpolation = "pchip" }`` over temperature."""
    if not isinstance(value, dict):
        if not _is_number(value):
            raise ValueError("expected a number >= 0, or { table = [[temperature, value], ...] }")
        if value < 0:
            raise ValueError("expected a number >= 0")
        return float(value)
    from slipstick.thermal.friction_curve import FrictionCurve

    unknown = set(value) - {"table", "interpolation"}
    if unknown or "table" not in value:
        found = f"the key '{min(unknown)}'" if unknown else "no table"
        raise ValueError(f'it has {found}; expected {{ table = [[temperature, value], ...], interpolation = "pchip" }}')
    try:
        FrictionCurve(mu=value["table"], interpolation=str(value.get("interpolation", "pchip")))
    except InputError as error:
        raise ValueError("; ".join(problem.removeprefix("mu: ") for problem in error.problems)) from None
    return value


Frequency = Annotated[float, PlainValidator(_positive_frequency)]
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
        raise ValueError("expected a square list of rows such as [[1.0, 0.0], [0.0, 1.0]], or a file .npz or .mtx")
    for i, row in enumerate(value):
        if len(row) != len(value):
            raise ValueError(f"row {i + 1} has {len(row)} entries but there are {len(value)} rows; expected a square")
        for j, entry in enumerate(row):
            if not _is_number(entry):
                raise ValueError(f"row {i + 1}, column {j + 1} is {entry!r}; expected a finite number")
    return value


class Table(BaseModel):
    """A table of the file: no unknown keys, no silent conversion, no inf or nan."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True, populate_by_name=False)

    @classmethod
    def cross_check(cls, raw: Mapping[str, Any]) -> list[str]:
        """Faults between keys, found on the raw table so that they are told together with wrong values."""
        return []


def _label(value: Any) -> str:
    if label_fault(value):
        raise ValueError(f'expected a short text such as "mm", at most {LONGEST} characters')
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


class MatricesTable(Table):
    """``[structure] kind = "matrices"``."""

    kind: Literal["matrices"]
    dofs: list[str] | None = Field(default=None, description='a list of names such as ["x", "y"]')
    count: int | None = Field(
        default=None, ge=1, le=10_000_000, description='a whole number >= 1: the dofs are then named "1", "2", ...'
    )
    mass: MatrixGiven = Field(description="a square list of rows, or the name of an .npz or .mtx file")
    damping: MatrixGiven | None = Field(default=None, description="a square list of rows, or the name of a file")
    stiffness: MatrixGiven = Field(description="a square list of rows, or the name of an .npz or .mtx file")
    loss_factor: NotNegative = Field(default=0.0, description="a number >= 0, the hysteretic loss factor")

    @classmethod
    def cross_check(cls, raw: Mapping[str, Any]) -> list[str]:
        """Dofs or count, not both."""
        if "dofs" in raw and "count" in raw:
            return ["both 'dofs' and 'count' are given; keep one of them"]
        return []


class ModalTable(Table):
    """``[structure] kind = "modal"``."""

    kind: Literal["modal"]
    file: str = Field(description="the name of an .npz file with omega, mode_shapes and static_compliance")
    dofs: list[str] | None = Field(default=None, description='a list of names; by default "n1x", "n1y", "n1z", "n2x"')
    modes: int | None = Field(default=None, ge=1, description="a whole number >= 1, how many modes to use")
    loss_factor: NotNegative | None = Field(default=None, description="a number >= 0, the hysteretic loss factor")
    damping_ratio: NotNegative | None = Field(default=None, description="a number >= 0, the ratio to critical damping")
    force: bool = Field(default=False, description="true or false: take modes that are too few")


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
    def cross_check(cls, raw: Mapping[str, Any]) -> list[str]:
        """Where and how much, each said once."""
        faults = []
        if len({"dof", "shape", "base"} & set(raw)) != 1:
            faults.append('expected either dof = "name" or shape = "name" or base = "name", and one of them alone')
        if ("base" in raw) != ("motion" in raw):
            given, missing = ("base", "motion") if "base" in raw else ("motion", "base")
            faults.append(f"{given} is given without {missing}; give both for a support that moves")
        if "amplitude" in raw and ("cos" in raw or "sin" in raw):
            faults.append("amplitude is given together with cos or sin; keep one way to say the force")
        elif not {"amplitude", "cos", "sin"} & set(raw):
            faults.append("no force is given; give cos, sin, or amplitude with phase")
        if "phase" in raw and "amplitude" not in raw:
            faults.append("phase is given without amplitude; give both")
        if raw.get("harmonic") == 0 and raw.get("sin"):
            faults.append("a sine part at harmonic 0 does nothing; give a static load as cos")
        return faults


class RubbingTable(Table):
    """``rubbing = { velocity = 10.0, cos = { "1" = 2.0 } }``."""

    velocity: float = Field(default=0.0, description="a finite number, length/time")
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
    def cross_check(cls, raw: Mapping[str, Any]) -> list[str]:
        """The normal load is said in one way."""
        faults = []
        if "gap" in raw and "normal_load" in raw:
            faults.append("both gap and normal_load are given; keep one (normal_load = -kn gap)")
        elif "gap" not in raw and "normal_load" not in raw:
            faults.append("the normal load is missing; give normal_load = 800.0, or normal, kn and gap")
        if "kn" not in raw and ("normal" in raw or ("gap" in raw and "normal_load" not in raw)):
            faults.append("kn is missing; give the normal contact stiffness, needed with normal or gap")
        elif raw.get("kn") == 0 and raw.get("normal_load"):
            faults.append("kn = 0 cannot carry a normal load; give kn > 0")
        return faults


class ResponseTable(Table):
    """``[response]``: what is followed, from where to where."""

    start: Any = Field(alias="from", description="a number")
    stop: Any = Field(alias="to", description="a number")
    parameter: str | None = Field(default=None, description='the name of a parameter such as "damper.velocity"')
    omega: Frequency | None = Field(default=None, description="the fixed frequency of a parameter curve, rad/s")
    at: Annotated[list[Any] | Spacing, PlainValidator(spacing_or_list)] = Field(
        default=[], description='a list of values that become exact points, or { count = 50, spacing = "log" }'
    )
    period_ratio: Annotated[tuple[int, int], PlainValidator(ratio_of_periods)] | None = Field(
        default=None, description='the period of the load over that of the rub, such as "3/2" or [3, 2]'
    )
    peaks_of: str | list[str] | None = Field(default=None, description="the name of a dof, or a list of names")
    max_points: Annotated[int, Field(ge=2, le=1_000_000)] | None = Field(
        default=None, description="a whole number from 2 to 1000000"
    )
    first_step: Annotated[float, Field(gt=0)] | None = Field(default=None, description="a number > 0")
    max_step: Annotated[float, Field(gt=0)] | None = Field(default=None, description="a number > 0")
    min_step: Annotated[float, Field(gt=0)] | None = Field(default=None, description="a number > 0")

    @classmethod
    def cross_check(cls, raw: Mapping[str, Any]) -> list[str]:
        """Values of the swept quantity: frequencies with units, or plain numbers of a parameter."""
        swept = "parameter" in raw
        faults = [f"{key}: {fault}" for key in ("from", "to") if key in raw and (fault := _fault(raw[key], swept))]
        values = raw.get("at", [])
        if isinstance(values, list):
            faults += [f"at, value {i + 1}: {fault}" for i, v in enumerate(values) if (fault := _fault(v, swept))]
            if len(values) > 100_000:
                faults.append(f"at: found {len(values)} values; expected at most 100000")
        if swept and "omega" not in raw:
            faults.append("omega is missing; a parameter is followed at one frequency, give omega in rad/s")
        if "omega" in raw and not swept:
            faults.append("omega is given without parameter; give parameter, or from and to alone")
        if not faults and "from" in raw and "to" in raw:
            ends = swept_value(raw["from"], swept), swept_value(raw["to"], swept)
            faults += _range_faults(*ends, values, swept)
            if isinstance(values, Mapping) and values.get("spacing") == "log" and min(ends) <= 0:
                faults.append('at: spacing "log" needs from and to > 0; give spacing = "linear", or a list')
        return faults


def frequencies_met(response: ResponseTable) -> tuple[float, float]:
    """The frequencies a case meets, rad/s: the ends of a range, or twice the fixed one."""
    if response.parameter is None:
        return swept_value(response.start, False), swept_value(response.stop, False)
    assert response.omega is not None
    return response.omega, response.omega


def swept_value(value: Any, parameter: bool) -> float:
    """A value of the swept quantity: rad/s, or the plain number of a parameter."""
    if not parameter:
        return _positive_frequency(value)
    if not _is_number(value):
        raise ValueError("expected a finite number")
    return float(value)


def _fault(value: Any, parameter: bool) -> str | None:
    from slipstick.app.sentences import shown

    try:
        swept_value(value, parameter)
    except ValueError as error:
        return f"found {shown(value)}; {error}"
    return None


def _range_faults(start: float, stop: float, values: Any, swept: bool) -> list[str]:
    unit = "" if swept else " rad/s"
    if start == stop:
        return [f"from and to are both {start:g}{unit}; give a range that is not empty"]
    low, high = sorted((start, stop))
    numbers = [swept_value(v, swept) for v in values] if isinstance(values, list) else []
    outside = [v for v in numbers if not low <= v <= high]
    return [f"at: {outside[0]:g}{unit} lies outside the range {low:g} to {high:g}{unit}"] if outside else []


class OutputTable(Table):
    """``[output]``."""

    dofs: list[str] = Field(min_length=1, description='a list of dof names such as ["x"]')
