"""Tables of structures that come as numbers: matrices, modes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field

from slipstick.case.tables import MatrixGiven, NotNegative, Table
from slipstick.errors import Fault


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
    def cross_check(cls, raw: Mapping[str, Any]) -> list[Fault]:
        """Dofs or count, not both."""
        if "dofs" in raw and "count" in raw:
            return [Fault("count", "is given together with dofs", remedy="keep one of them")]
        return []


class ModalTable(Table):
    """``[structure] kind = "modal"``."""

    kind: Literal["modal"]
    file: str = Field(description="the name of an .npz file with omega, mode_shapes and static_compliance")
    dofs: list[str] | None = Field(default=None, description='a list of names; by default "n1x", "n1y", "n1z", "n2x"')
    modes: int | None = Field(default=None, ge=1, description="a whole number >= 1, how many modes to use")
    loss_factor: NotNegative | None = Field(default=None, description="a number >= 0, the hysteretic loss factor")
    damping_ratio: float | None = Field(default=None, description="a number, the ratio to critical damping")
    force: bool = Field(default=False, description="true or false: take modes that are too few")
