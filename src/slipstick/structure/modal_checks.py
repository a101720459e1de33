"""What is wrong with the arrays of a modal structure: complex values, residuals that no modes can leave."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import Fault
from slipstick.faults import shown
from slipstick.structure.checks import REAL_MODES, array_faults, number_faults, real, symmetry_faults
from slipstick.structure.definite import semidefinite_to
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.structure.modal import LoadShape


_COMPLIANCES = ("static_compliance", "second_residual")
"""Arrays that may be left out."""

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


def modal_faults(given: Mapping[str, Any], load_shapes: Mapping[str, LoadShape], n: int | None) -> list[Fault]:
    """Faults of all modal arrays at ``n`` dofs (None: not known), those of one beside those of the others.

    What is of the wrong shape, or is no number, does not say how many modes or dofs there are.
    """
    faults = modal_number_faults(given, load_shapes)
    wrong = {fault.where for fault in faults}
    there = {name: v for name, v in given.items() if v is not None or name not in _COMPLIANCES}
    known = {name: real(v) for name, v in there.items() if (name,) not in wrong}
    shapes: tuple[int, ...] = known["mode_shapes"].shape if "mode_shapes" in known else ()
    omega = known.pop("omega", None)
    if omega is not None and (omega.ndim != 1 or omega.size == 0):
        faults.append(Fault("omega", found=f"shape {omega.shape}", expected="(n_modes,), at least one mode"))
        omega = None
    if n is None and len(shapes) == 2:
        n = shapes[0]
    modes = omega.size if omega is not None else shapes[1] if len(shapes) == 2 else None
    if omega is not None:
        faults += array_faults("omega", omega, omega.shape, positive=True)
    for name, value in known.items():
        faults += _array_faults(name, value, n, modes)
    for name, shape in load_shapes.items():
        if hasattr(shape, "arrays"):
            for part, value in shape.arrays().items():
                where = ("load shape", name, part)
                size = modes if part == "participation" else n
                faults += [] if where in wrong or size is None else array_faults(where, real(value), (size,))
    return faults


def _array_faults(name: str, value: Any, n: int | None, modes: int | None) -> list[Fault]:
    """Faults of one of the arrays with the sizes that are known."""
    if name == "mode_shapes":
        rows, columns = value.shape if value.ndim == 2 else (None, None)
        return array_faults(name, value, (n or rows or 1, modes or columns or 1))
    if name in _COMPLIANCES:
        square = (n or len(np.atleast_1d(value)),) * 2
        return array_faults(name, value, square) or symmetry_faults(name, value, tolerance=1e-5)
    size = () if name == "damping" or value.ndim == 0 else value.shape if modes is None else (modes,)
    return array_faults(name, value, size, non_negative=name != "damping_ratio")


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
