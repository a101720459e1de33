"""``[response]`` and ``[output]``: what is followed, its exact points, its steps; the dofs that results hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, PlainValidator

from slipstick.case.script_text import Call, Code, call, literal, quantity_text
from slipstick.case.table import Frequency, RawTable, Table, is_number, positive_frequency, toml, unexpected
from slipstick.errors import IS_MISSING, Fault, InputError, Where
from slipstick.quantities import frequency_unit, ratio_of_periods
from slipstick.studies.parameter_values import SPACINGS
from slipstick.units import Units

MOST_VALUES = 100_000
_EXPECTED = 'a list of values, or a table such as { count = 50, spacing = "log" }'


@dataclass(frozen=True, kw_only=True)
class Spacing:
    """``count`` values from the first end of a range to the last, both included.

    >>> Spacing(count=3, spacing="log").values(1.0, 100.0)
    (1.0, 10.0, 100.0)
    """

    count: int
    spacing: str = "linear"

    def values(self, start: float, stop: float) -> tuple[float, ...]:
        """The values."""
        import numpy as np

        spread = np.geomspace if self.spacing == "log" else np.linspace
        return tuple(spread(start, stop, self.count).tolist())


def _spacing_or_list(value: object) -> list[Any] | Spacing:
    """The value of ``at``; InputError for anything else."""
    if isinstance(value, list):
        return value
    if not isinstance(value, Mapping) or "count" not in value or set(value) - {"count", "spacing"}:
        raise unexpected(_EXPECTED)
    count, spacing = value["count"], value.get("spacing", "linear")
    faults = []
    if type(count) is not int or not 2 <= count <= MOST_VALUES:
        faults.append(Fault("count", found=toml(count), expected=f"a whole number from 2 to {MOST_VALUES}"))
    if spacing not in SPACINGS:
        faults.append(Fault("spacing", found=toml(spacing), expected='"linear" or "log"'))
    if faults:
        raise InputError(faults)
    return Spacing(count=count, spacing=spacing)


Length = Annotated[Annotated[float, Field(gt=0)] | None, Field(description="a number > 0")]


class StepKeys(BaseModel):
    """Named as in ``slipstick.analysis.road.request.ResponseOptions``; missing keys keep their default there."""

    max_points: Annotated[int, Field(ge=2, le=1_000_000)] | None = Field(
        default=None, description="a whole number from 2 to 1000000"
    )
    first_step: Length = None
    max_step: Length = None
    min_step: Length = None
    output_step: Length = None
    output_tolerance: Length = None
    adapt_harmonics: Annotated[float, Field(gt=0, lt=1)] | None = Field(
        default=None, description="a number between 0 and 1 such as 1e-3, the relative accuracy"
    )


STEP_KEYS = tuple(StepKeys.model_fields)


def _step_faults(raw: RawTable) -> list[Fault]:
    """Steps that are right each by itself but not beside each other; those left out have their defaults."""
    from slipstick.analysis.road.request import response_options

    usual = response_options()
    steps = {name: raw.get(name, getattr(usual, name)) for name in ("first_step", "max_step", "min_step")}
    if not all(isinstance(v, int | float) and not isinstance(v, bool) and 0 < v < float("inf") for v in steps.values()):
        return []
    if steps["min_step"] > steps["max_step"]:
        name, limit = ("min_step", "at most max_step") if "min_step" in raw else ("max_step", "at least min_step")
        other = steps["max_step"] if "min_step" in raw else steps["min_step"]
        return [Fault(name, found=f"{steps[name]:g}", expected=f"{limit}, {other:g}")]
    if {"first_step", "max_step"} <= set(raw) and steps["first_step"] > steps["max_step"]:
        limit = f"at most max_step, {steps['max_step']:g}"
        return [Fault("first_step", found=f"{steps['first_step']:g}", expected=limit)]
    return []


class ResponseTable(StepKeys, Table):
    """``[response]``: the curve that is followed."""

    start: Any = Field(alias="from", description="a number")
    stop: Any = Field(alias="to", description="a number")
    parameter: str | None = Field(default=None, description='the name of a parameter such as "damper.velocity"')
    omega: Frequency | None = Field(default=None, description="the fixed frequency of a parameter curve, rad/s")
    at: Annotated[list[Any] | Spacing, PlainValidator(_spacing_or_list)] = Field(
        default=[], description='a list of values that become exact points, or { count = 50, spacing = "log" }'
    )
    period_ratio: Annotated[tuple[int, int], PlainValidator(ratio_of_periods)] | None = Field(
        default=None, description='the period of the load over that of the rub, such as "3/2" or [3, 2]'
    )
    peaks_of: str | list[str] | None = Field(
        default=None, description='the name of a dof, a list of names, or "largest"'
    )
    stability: bool | Literal["full"] = Field(
        default=False, description='true, false or "full": whether every point is judged stable or not'
    )
    follow: Literal["subharmonic"] | None = Field(
        default=None, description='"subharmonic": where the period doubles, motion of twice the period is followed too'
    )

    @property
    def judged(self) -> bool | Literal["full"]:
        """Whether points are judged stable or not, which ``follow`` needs."""
        return self.stability or self.follow is not None

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """Values of the swept quantity: frequencies with units, or plain numbers of a parameter."""
        swept = "parameter" in raw
        faults = [fault for key in ("from", "to") if key in raw for fault in _value_faults((key,), raw[key], swept)]
        values = raw.get("at", [])
        if isinstance(values, list):
            if len(values) > MOST_VALUES:
                faults.append(Fault("at", found=f"{len(values)} values", expected=f"at most {MOST_VALUES}"))
            ends = (raw.get("from"), raw.get("to")) if not faults else (None, None)
            faults += [fault for i, v in enumerate(values) for fault in _at_faults(i, v, ends, swept)]
        if swept and "omega" not in raw:
            remedy = "a parameter is followed at one frequency, give omega in rad/s"
            faults.append(Fault("omega", IS_MISSING, remedy=remedy))
        if "omega" in raw and not swept:
            faults.append(Fault("omega", "is given without parameter", remedy="give parameter, or from and to alone"))
        low = min((end for key in ("from", "to") if (end := _value(raw.get(key), swept)) is not None), default=1.0)
        if isinstance(values, Mapping) and values.get("spacing") == "log" and low <= 0:
            remedy = 'give spacing = "linear", or a list'
            faults.append(Fault(("at", "spacing"), found='"log", which needs from and to > 0', remedy=remedy))
        return [*faults, *_step_faults(raw), *_range_faults(raw, swept)]


def frequencies_met(response: ResponseTable) -> tuple[float, float]:
    """The frequencies a case meets, rad/s: the ends of a range, or twice the fixed one."""
    if response.parameter is None:
        return swept_value(response.start, False), swept_value(response.stop, False)
    assert response.omega is not None
    return response.omega, response.omega


def swept_value(value: object, parameter: bool) -> float:
    """A value of the swept quantity: rad/s, or the plain number of a parameter."""
    if not parameter:
        return positive_frequency(value)
    if not is_number(value):
        raise unexpected("a finite number")
    return float(value)


def _value(value: object, swept: bool) -> float | None:
    """A value of the swept quantity, or None where it is none."""
    try:
        return swept_value(value, swept)
    except InputError:
        return None


def _value_faults(where: Where, value: object, swept: bool) -> list[Fault]:
    try:
        swept_value(value, swept)
    except InputError as error:
        return [replace(fault.inside(*where), found=toml(value)) for fault in error.faults]
    return []


def _at_faults(number: int, value: object, ends: tuple[Any, Any], swept: bool) -> list[Fault]:
    """Faults of one requested value; it lies in the range where both ends of that are right."""
    wrong = _value_faults(("at", number), value, swept)
    start, stop = (_value(end, swept) for end in ends)
    if wrong or start is None or stop is None:
        return wrong
    point, (low, high) = swept_value(value, swept), sorted((start, stop))
    unit = "" if swept else " rad/s"
    outside = f"{point:g}{unit} lies outside the range {low:g} to {high:g}{unit}"
    return [] if low <= point <= high else [Fault(("at", number), outside, remedy="widen the range or leave it out")]


def _range_faults(raw: RawTable, swept: bool) -> list[Fault]:
    start, stop = (_value(raw.get(key), swept) for key in ("from", "to"))
    if start is None or start != stop:
        return []
    unit = "" if swept else " rad/s"
    return [Fault("to", f"is {stop:g}{unit}, the same as from", remedy="give a range that is not empty")]


def written_frequencies(response: RawTable) -> Iterator[tuple[Where, Any]]:
    """The frequencies that the table says, as they stand there."""
    for key in ("omega",) if "parameter" in response else ("from", "to"):
        yield ("response", key), response.get(key)
    requested = response.get("at")
    if "parameter" not in response and isinstance(requested, list):
        yield from ((("response", "at", i), value) for i, value in enumerate(requested))


def display_unit(response: RawTable, units: Units) -> str:
    """The unit the range of a case is written in, else rad/time."""
    written = (frequency_unit(value) for _, value in written_frequencies(response))
    return next((unit for unit in written if unit is not None), units.angular)


def response_script(raw: RawTable) -> str:
    """The call that follows the same."""
    table = ResponseTable.model_validate(raw)
    ends = [quantity_text(raw[key]) for key in ("from", "to")]
    named: dict[str, Any] = {"at": Code(_requested(table.at, ends))} if table.at else {}
    named |= table.given("peaks_of", "stability", "follow")
    named |= {"options": options} if (options := table.given(*STEP_KEYS)) else {}
    problem, span = Code("problem()"), Code(f"({', '.join(ends)})")
    if table.parameter is None:
        return Call("ss.forced_response", (problem,), {"omega": span, **named}).written()
    arguments = (problem, table.parameter, span)
    return Call("ss.parameter_response", arguments, {"omega": table.omega, **named}).written()


def frequencies_script(raw: RawTable) -> str:
    """``frequencies_met`` as Python writes them."""
    keys = ("from", "to") if "parameter" not in raw else ("omega", "omega")
    return f"({', '.join(quantity_text(raw[key]) for key in keys)})"


def _requested(at: list[Any] | Spacing, ends: list[str]) -> str:
    """Values at which points are wanted."""
    if isinstance(at, Spacing):
        return call("np.geomspace" if at.spacing == "log" else "np.linspace", *ends, literal(at.count))
    return f"[{', '.join(quantity_text(value) for value in at)}]"


class OutputTable(Table):
    """``[output]``."""

    dofs: list[str] = Field(min_length=1, description='a list of dof names such as ["x"]')
