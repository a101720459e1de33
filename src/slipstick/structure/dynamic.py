"""Dynamic stiffness of matrices, with named parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from slipstick.errors import InputError
from slipstick.faults import number, suggestion
from slipstick.typing import Matrix

FACTOR_UNITS = "1"
"""Units of loss factors and of factors on the damping."""

SPEED = "speed"
"""The parameter that is a fixed speed of rotation, rad/s, of either sense."""


@dataclass(frozen=True, kw_only=True)
class DynamicStiffness:
    """``Z = K + i loss_factor elastic + speed N + i w (damping C + S + speed G) - w^2 M``, dense or scipy sparse.

    ``speed`` is fixed, or ``omega / engine_order`` of the fundamental frequency where an engine order is given. C, S,
    G, N may be None; ``elastic`` None is K.
    """

    M: Matrix
    C: Matrix
    K: Matrix
    loss_factor: float
    damping: float
    elastic: Matrix = None
    S: Matrix = None
    G: Matrix = None
    N: Matrix = None
    speed: float = 0.0
    engine_order: int | None = None

    def __call__(self, w: float) -> tuple[Any, Any]:
        """``Z`` and ``dZ/dw`` in harmonic 1."""
        return self.at(1.0, w)

    def at(self, order: float, omega: float) -> tuple[Any, Any]:
        """``Z`` in harmonic ``order`` of the fundamental frequency ``omega``, and its derivative by ``omega``."""
        w = order * omega
        tied = 0.0 if self.engine_order is None else 1.0 / self.engine_order
        speed = tied * omega if tied else self.speed
        elastic = self.K if self.elastic is None else self.elastic
        stiffness, slope = self.K + (1j * self.loss_factor) * elastic - w * w * self.M, -2.0 * w * order * self.M
        if self.C is not None:
            stiffness, slope = stiffness + 1j * w * self.damping * self.C, slope + 1j * order * self.damping * self.C
        if self.S is not None:
            stiffness, slope = stiffness + 1j * w * self.S, slope + 1j * order * self.S
        if self.G is not None:
            stiffness = stiffness + 1j * w * speed * self.G
            slope = slope + 1j * (order * speed + w * tied) * self.G
        if self.N is not None:
            stiffness, slope = stiffness + speed * self.N, slope + tied * self.N
        return stiffness, slope

    def rate(self, name: str, w: float) -> Any:
        """``dZ/dname`` at the frequency ``w``."""
        if name == "loss_factor":
            return 1j * (self.K if self.elastic is None else self.elastic)
        return 1j * w * (self.G if name == SPEED else self.C)

    def changed(self, **values: float) -> DynamicStiffness:
        """A copy with another loss factor, factor on the damping, or fixed speed."""
        own: dict[str, Any] = dict(values)
        return replace(self, **own)


def checked_values(current: Mapping[str, float], values: Mapping[str, Any]) -> dict[str, float]:
    """New values of parameters of a structure, >= 0 except for a speed; InputError for other names."""
    for name in values:
        if name not in current:
            raise InputError(f"the structure has no parameter '{name}'; {suggestion(name, list(current))}")
    return {
        name: number(name, value) if name == SPEED else number(name, value, "a number >= 0", above=0.0)
        for name, value in values.items()
    }
