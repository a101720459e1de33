"""Dynamic stiffness of matrices, and what named parameters of a structure do to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from slipstick.errors import InputError
from slipstick.faults import number, suggestion
from slipstick.typing import Matrix

FACTOR_UNITS = "1"
"""Units of loss factors and of factors on the damping."""


@dataclass(frozen=True, kw_only=True)
class DynamicStiffness:
    """``Z(w) = K (1 + i loss_factor) + i w damping C - w^2 M``, dense or scipy sparse; C may be None."""

    M: Matrix
    C: Matrix
    K: Matrix
    loss_factor: float
    damping: float

    def __call__(self, w: float) -> tuple[Any, Any]:
        """``Z(w)`` and ``dZ/dw``."""
        stiffness, slope = self.K * (1.0 + 1j * self.loss_factor) - w * w * self.M, -2.0 * w * self.M
        if self.C is None:
            return stiffness, slope
        return stiffness + 1j * w * self.damping * self.C, slope + 1j * self.damping * self.C

    def rate(self, name: str, w: float) -> Any:
        """``dZ/dname`` at ``w``."""
        return 1j * self.K if name == "loss_factor" else 1j * w * self.C

    def changed(self, **values: float) -> DynamicStiffness:
        """With another loss factor, or factor on the damping."""
        return replace(self, **values)


def structure_values(structure: Any) -> Mapping[str, float]:
    """Named parameters of a structure, which it may have or not."""
    return dict(getattr(structure, "values", {}))


def checked_values(known: Mapping[str, float], values: Mapping[str, Any]) -> dict[str, float]:
    """New values >= 0 of parameters a structure has; InputError for others."""
    for name in values:
        if name not in known:
            raise InputError(f"the structure has no parameter '{name}'; {suggestion(name, list(known))}")
    return {name: number(name, value, "a number >= 0", above=0.0) for name, value in values.items()}


def adjusted(receptance: Any, values: Mapping[str, float]) -> Any:
    """A receptance with other values of the structure's parameters; InputError where it knows none."""
    if not values:
        return receptance
    missing = [name for name in ("changed", "by_parameter") if not hasattr(receptance, name)]
    if missing:
        raise InputError(
            f"{', '.join(values)} cannot be followed: a {type(receptance).__name__} has no {missing[0]}; "
            "change the structure instead, one problem for each value"
        )
    return receptance.changed(**values)
