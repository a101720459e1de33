"""``[output]``: the dofs that results hold."""

from __future__ import annotations

from pydantic import Field

from slipstick.case.table import Table


class OutputTable(Table):
    """``[output]``."""

    dofs: list[str] = Field(min_length=1, description='a list of dof names such as ["x"]')
