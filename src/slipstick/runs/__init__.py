"""Cases computed into folders, and gone on with: everything is kept as it comes, nothing is printed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from slipstick.public_names import on_first_use

_PUBLIC = {"run_up": "slipstick.runs.passing_through", "save_table": "slipstick.runs.tables"}

__all__ = sorted(_PUBLIC)

if TYPE_CHECKING:
    from slipstick.runs.passing_through import run_up as run_up
    from slipstick.runs.tables import save_table as save_table


__getattr__, __dir__ = on_first_use("slipstick.runs", _PUBLIC)
