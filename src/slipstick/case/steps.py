"""Keys of ``[response]`` that are options of the continuation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, Field

from slipstick.errors import Fault

Length = Annotated[Annotated[float, Field(gt=0)] | None, Field(description="a number > 0")]


class StepKeys(BaseModel):
    """Named as in ``slipstick.analysis.curve.request.ResponseOptions``; what is not given stays as it is there."""

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


def step_faults(raw: Mapping[str, Any]) -> list[Fault]:
    """Steps that are right each by itself but not beside each other; those left out have their defaults."""
    from slipstick.analysis.curve.request import response_options

    usual = response_options()
    given = {name: raw.get(name, getattr(usual, name)) for name in ("first_step", "max_step", "min_step")}
    if not all(isinstance(v, int | float) and not isinstance(v, bool) and 0 < v < float("inf") for v in given.values()):
        return []
    if given["min_step"] > given["max_step"]:
        name, limit = ("min_step", "at most max_step") if "min_step" in raw else ("max_step", "at least min_step")
        other = given["max_step"] if "min_step" in raw else given["min_step"]
        return [Fault(name, found=f"{given[name]:g}", expected=f"{limit}, {other:g}")]
    if {"first_step", "max_step"} <= set(raw) and given["first_step"] > given["max_step"]:
        limit = f"at most max_step, {given['max_step']:g}"
        return [Fault("first_step", found=f"{given['first_step']:g}", expected=limit)]
    return []


STEP_KEYS = tuple(StepKeys.model_fields)
