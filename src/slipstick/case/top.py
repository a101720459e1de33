"""Keys above the first section of a case: format, title, harmonics, ratio of periods, names of units."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Literal

from pydantic import Field, PlainValidator

from slipstick.case.table import Table, toml
from slipstick.errors import InputError
from slipstick.quantities import harmonic_orders, ratio_of_periods
from slipstick.units import Units, label_faults


def _label(value: object) -> str:
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
    author: str = Field(default="", description="a text")
    remarks: str = Field(default="", description="a text")
    harmonics: Annotated[list[int], PlainValidator(harmonic_orders)] = Field(
        description='the harmonics kept, such as "0..10" or [0, 1, 3, 5]'
    )
    period_ratio: Annotated[tuple[int, int], PlainValidator(ratio_of_periods)] | None = Field(
        default=None, description='the period of the load over that of the rub, such as "3/2" or [3, 2]'
    )
    units: UnitsTable = Field(
        default=UnitsTable(), description='a table such as { length = "mm", force = "N", time = "s" }'
    )
