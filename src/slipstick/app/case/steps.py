"""Keys of ``[response]`` that are options of the continuation."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field

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


STEP_KEYS = tuple(StepKeys.model_fields)
