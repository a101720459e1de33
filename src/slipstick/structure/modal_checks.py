"""What is wrong with the arrays of a modal structure: complex values, residuals that no modes can leave."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from slipstick.errors import Fault
from slipstick.faults import shown
from slipstick.structure.checks import REAL_MODES, number_faults
from slipstick.structure.definite import semidefinite_to
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.structure.modal import LoadShape


RESIDUAL_ROUNDING = 1e-4
"""What a residual may lie below zero, relative to the whole: the digits of exported modes."""


def modal_number_faults(given: Mapping[str, Any], load_shapes: Mapping[str, LoadShape]) -> list[Fault]:
    """Faults of modal arrays that are not made of real numbers; those that are None are left alone."""
    faults = []
    for name, value in given.items():
        faults += [] if value is None else number_faults(name, value, REAL_MODES.get(name, ""))
    for name, shape in load_shapes.items():
        if not hasattr(shape, "arrays"):
            faults.append(Fault(("load shape", name), found=shown(shape), expected="a structure.modal.LoadShape"))
            continue
        for part, value in shape.arrays().items():
            faults += number_faults(("load shape", name, part), value)
    return faults


def residual_faults(name: str, residual: Array, whole: Array) -> list[Fault]:
    """Faults of a residual (n, n) of the modes left out: a sum of squares, so it has no negative eigenvalue.

    Judged in parts of ``whole`` (n,), the compliances it belongs to.
    """
    lowest = semidefinite_to(residual, whole, RESIDUAL_ROUNDING)
    if lowest is None:
        return []
    return [
        Fault(
            name,
            f"what it leaves to the modes not given has a negative eigenvalue ({lowest:.2g} of the whole), but modes "
            "only add compliance",
            remedy="check the order of dofs and modes, and that all arrays belong together",
        )
    ]
