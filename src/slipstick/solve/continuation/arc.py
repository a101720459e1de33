"""The cubic between two neighbouring points of a branch."""

from __future__ import annotations

import numpy as np

from slipstick.typing import Array


class Arc:
    """Cubic Hermite curve through two states with tangents; ``u`` is 0 at the first and 1 at the second.

    Extrapolated to ``u > 1`` it predicts the next point with an error of fourth order in the step.
    """

    def __init__(self, first: Array, first_tangent: Array, second: Array, second_tangent: Array, length: float) -> None:
        self.length = length
        self._nodes = np.array((first, second, length * first_tangent, length * second_tangent))

    def point(self, u: float) -> Array:
        """State (N + 1,) at ``u``."""
        v = u - 1.0
        value: Array = np.array(((1.0 + 2.0 * u) * v * v, u * u * (3.0 - 2.0 * u), u * v * v, u * u * v)) @ self._nodes
        return value

    def derivative(self, u: float) -> Array:
        """Derivative by ``u`` (N + 1,)."""
        v = u - 1.0
        value: Array = np.array((6.0 * u * v, -6.0 * u * v, v * (3.0 * u - 1.0), u * (3.0 * u - 2.0))) @ self._nodes
        return value

    def parameter(self, u: float) -> float:
        """Parameter (last entry of the state) at ``u``."""
        v = u - 1.0
        a, b, c, d = self._nodes[:, -1]
        return float((1.0 + 2.0 * u) * v * v * a + u * u * (3.0 - 2.0 * u) * b + u * v * v * c + u * u * v * d)

    def where(self, parameter: float, low: float, high: float) -> float:
        """The ``u`` in [low, high] at which the cubic passes ``parameter`` (bisection; the ends must bracket it)."""
        rising = self.parameter(high) > self.parameter(low)
        for _ in range(60):
            middle = 0.5 * (low + high)
            if (self.parameter(middle) > parameter) == rising:
                high = middle
            else:
                low = middle
        return 0.5 * (low + high)
