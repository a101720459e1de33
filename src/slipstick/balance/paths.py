"""How what is given to the balance moves with a parameter: along a line, turning with a phase, with the structure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, sin
from typing import Protocol

from slipstick.balance.inputs import Inputs


class Path(Protocol):
    """Inputs over one parameter."""

    def at(self, value: float) -> tuple[Inputs, Inputs]:
        """Inputs at a value of the parameter, and their derivative by it."""
        ...


@dataclass(frozen=True)
class Line:
    """``base + value * direction``."""

    base: Inputs
    direction: Inputs

    def at(self, value: float) -> tuple[Inputs, Inputs]:
        """Inputs at a value of the parameter, and their derivative by it."""
        return self.base.moved(self.direction, value), self.direction


@dataclass(frozen=True)
class LoadPhase:
    """A load ``amplitude cos(m tau + value)`` at ``P[row, column]`` (its cosine) and the next (its sine)."""

    base: Inputs
    amplitude: float
    row: int
    column: int

    def at(self, value: float) -> tuple[Inputs, Inputs]:
        """Inputs at a value of the parameter, and their derivative by it."""
        c, s = self.amplitude * cos(value), self.amplitude * sin(value)
        return self._with(self.base, c, -s), self._with(self.base.scaled(0.0), -s, -c)

    def _with(self, inputs: Inputs, cosine: float, sine: float) -> Inputs:
        P = inputs.P.copy()
        P[self.row, self.column : self.column + 2] = cosine, sine
        return replace(inputs, P=P)


@dataclass(frozen=True)
class StructureValue:
    """A named parameter of the structure."""

    base: Inputs
    name: str

    def at(self, value: float) -> tuple[Inputs, Inputs]:
        """Inputs at a value of the parameter, and their derivative by it."""
        zero = self.base.scaled(0.0)
        return replace(self.base, structure={self.name: value}), replace(zero, structure={self.name: 1.0})
