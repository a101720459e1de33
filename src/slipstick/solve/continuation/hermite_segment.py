"""The cubic between two neighbouring points of a branch."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.typing import Array


class HermiteBasis:
    """Places ``u`` (n,) on segments, and the shares (n, 4) of what is known at the ends in values and slopes there."""

    __slots__ = ("shares", "slopes", "u")

    def __init__(self, u: Array) -> None:
        self.u, self.shares, self.slopes = u, np.transpose(blend(u)), np.transpose(blend_slope(u))


class HermiteSegment:
    """Cubic Hermite curve through two states with tangents; ``u`` is 0 at the first and 1 at the second.

    Extrapolated to ``u > 1`` it predicts the next point with an error of fourth order in the step; between the two it
    is the branch but for a hundredth of that error.

    ``rates`` times the tangents are derivatives by ``u``: the ``length`` where these have unit length.
    """

    def __init__(
        self,
        first: Array,
        first_tangent: Array,
        second: Array,
        second_tangent: Array,
        length: float,
        *,
        rates: tuple[float, float] | None = None,
    ) -> None:
        self.length, self.rates = length, rates or (length, length)
        self._nodes = np.array((first, second, self.rates[0] * first_tangent, self.rates[1] * second_tangent))

    def between(
        self, first: Array, second: Array, first_rate: Array, second_rate: Array, places: HermiteBasis
    ) -> tuple[Array, Array]:
        """Any quantity and its derivative by ``u``, both (n, ...), at n places, from values and rates at the ends.

        Rates are derivatives by what the tangents are derivatives by.
        """
        nodes = np.array((first, second, self.rates[0] * first_rate, self.rates[1] * second_rate))
        flat = nodes.reshape(4, -1)
        shape = (-1, *nodes.shape[1:])
        return (places.shares @ flat).reshape(shape), (places.slopes @ flat).reshape(shape)

    def point(self, u: float) -> Array:
        """State (N + 1,) at ``u``."""
        return np.asarray(np.array(blend(u)) @ self._nodes)

    def derivative(self, u: float) -> Array:
        """Derivative by ``u`` (N + 1,)."""
        return np.asarray(np.array(blend_slope(u)) @ self._nodes)

    def points(self, places: HermiteBasis) -> Array:
        """States (n, N + 1) at n places."""
        return np.asarray(places.shares @ self._nodes)

    def derivatives(self, places: HermiteBasis) -> Array:
        """Derivatives by ``u`` (n, N + 1) at n places."""
        return np.asarray(places.slopes @ self._nodes)

    def parameter_rates(self, places: HermiteBasis) -> Array:
        """Derivatives of the parameter by ``u`` (n,) at n places."""
        return np.asarray(places.slopes @ self._nodes[:, -1])

    def parameter(self, u: float) -> float:
        """Parameter (last entry of the state) at ``u``."""
        (a, b, c, d), (p, q, r, s) = self._nodes[:, -1].tolist(), blend(u)
        return float(p * a + q * b + r * c + s * d)

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


def blend(u: Any) -> tuple[Any, Any, Any, Any]:
    """Shares at ``u`` of: first value, second value, derivatives by ``u`` at the first and at the second."""
    v = u - 1.0
    return (1.0 + 2.0 * u) * v * v, u * u * (3.0 - 2.0 * u), u * v * v, u * u * v


def blend_slope(u: Any) -> tuple[Any, Any, Any, Any]:
    """Derivatives of ``blend`` by ``u``."""
    v = u - 1.0
    return 6.0 * u * v, -6.0 * u * v, v * (3.0 * u - 1.0), u * (3.0 * u - 2.0)
