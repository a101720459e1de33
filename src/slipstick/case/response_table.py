"""The table ``[response]`` of a case file: its keys, and the values of what is swept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator

from slipstick.case.sentences import toml, unexpected
from slipstick.case.spacing import MOST_VALUES, Spacing, spacing_or_list
from slipstick.case.steps import StepKeys, step_faults
from slipstick.case.tables import Frequency, Table, is_number, positive_frequency
from slipstick.errors import IS_MISSING, Fault, InputError, Where
from slipstick.quantities import ratio_of_periods


class ResponseTable(StepKeys, Table):
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
    def cross_check(cls, raw: Mapping[str, Any]) -> list[Fault]:
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
        return [*faults, *step_faults(raw), *_range_faults(raw, swept)]


def frequencies_met(response: ResponseTable) -> tuple[float, float]:
    """The frequencies a case meets, rad/s: the ends of a range, or twice the fixed one."""
    if response.parameter is None:
        return swept_value(response.start, False), swept_value(response.stop, False)
    assert response.omega is not None
    return response.omega, response.omega


def swept_value(value: Any, parameter: bool) -> float:
    """A value of the swept quantity: rad/s, or the plain number of a parameter."""
    if not parameter:
        return positive_frequency(value)
    if not is_number(value):
        raise unexpected("a finite number")
    return float(value)


def _value(value: Any, swept: bool) -> float | None:
    """A value of the swept quantity, or None where it is none."""
    try:
        return swept_value(value, swept)
    except InputError:
        return None


def _value_faults(where: Where, value: Any, swept: bool) -> list[Fault]:
    try:
        swept_value(value, swept)
    except InputError as error:
        return [replace(fault.inside(*where), found=toml(value)) for fault in error.faults]
    return []


def _at_faults(number: int, value: Any, ends: tuple[Any, Any], swept: bool) -> list[Fault]:
    """Faults of one requested value; it lies in the range where both ends of that are right."""
    wrong = _value_faults(("at", number), value, swept)
    start, stop = (_value(end, swept) for end in ends)
    if wrong or start is None or stop is None:
        return wrong
    found, (low, high) = swept_value(value, swept), sorted((start, stop))
    unit = "" if swept else " rad/s"
    outside = f"{found:g}{unit} lies outside the range {low:g} to {high:g}{unit}"
    return [] if low <= found <= high else [Fault(("at", number), outside, remedy="widen the range or leave it out")]


def _range_faults(raw: Mapping[str, Any], swept: bool) -> list[Fault]:
    start, stop = (_value(raw.get(key), swept) for key in ("from", "to"))
    if start is None or start != stop:
        return []
    unit = "" if swept else " rad/s"
    return [Fault("to", f"is {stop:g}{unit}, the same as from", remedy="give a range that is not empty")]
