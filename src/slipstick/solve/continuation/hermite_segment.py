"""The cubic between two neighbouring points of a branch."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.solve.continuation.metric import (
    Metric,
    Scalars,
    angle_of,
    chosen,
    column,
    entries,
    mixed,
    stacked,
)
from slipstick.typing import Array

_BISECTIONS = 60
"""Halvings of an interval of ``u``: to rounding from any interval of length 1."""


class HermiteBasis:
    """Places ``u`` (n,) on segments, with the Hermite basis ``shares`` (n, 4) and its derivatives ``slopes`` there."""

    __slots__ = ("shares", "slopes", "u")

    def __init__(self, u: Array) -> None:
        self.u, self.shares, self.slopes = u, np.transpose(blend(u)), np.transpose(blend_slope(u))


class HermiteSegment:
    """Cubic Hermite curve through two states with tangents; ``u`` is 0 at the first and 1 at the second.

    Extrapolated to ``u > 1`` it predicts the next point with an error of fourth order in the step; between the two
    the error is about a hundredth of that. States are (N + 1,), or (k, N + 1) for k segments at once.

    Attributes
    ----------
    nodes
        Both states and both derivatives by ``u``, (..., 4, N + 1).
    length
        Arc length, a float or (k,).
    rates
        Factors of the tangents that make them derivatives by ``u``: the ``length`` where tangents have unit length.
    """

    def __init__(
        self,
        first: Array,
        first_tangent: Array,
        second: Array,
        second_tangent: Array,
        length: Scalars,
        *,
        rates: tuple[Scalars, Scalars] | None = None,
    ) -> None:
        self.length, self.rates = length, rates or (length, length)
        before, after = map(column, self.rates)
        self.nodes = stacked(first, second, before * first_tangent, after * second_tangent)

    @classmethod
    def of(
        cls, metric: Metric, first: tuple[Array, Array], second: tuple[Array, Array], angle: Scalars = None
    ) -> HermiteSegment:
        """Segment between two points, each a state and a tangent, in a metric.

        The arc is longer than its chord by as much as that of a circle whose end tangents enclose ``angle`` (radians),
        which is computed if None.
        """
        (a, before), (b, after) = first, second
        if angle is None:
            angle = angle_of(metric.cosine(before, after))
        length = metric.length(b - a) * (1.0 + angle * angle / 24.0)
        rates = length / metric.length(before), length / metric.length(after)
        return cls(a, before, b, after, length, rates=rates)

    def at(self, which: Any) -> HermiteSegment:
        """Some of k segments."""
        some = HermiteSegment.__new__(HermiteSegment)
        some.nodes, some.length = self.nodes[which], self.length[which]
        some.rates = self.rates[0][which], self.rates[1][which]
        return some

    def put(self, which: Any, those: HermiteSegment) -> None:
        """Replace, in place, some of k segments."""
        self.nodes[which], self.length[which] = those.nodes, those.length
        for rate, new in zip(self.rates, those.rates, strict=True):
            rate[which] = new

    def between(
        self, first: Array, second: Array, first_rate: Array, second_rate: Array, places: HermiteBasis
    ) -> tuple[Array, Array]:
        """Any quantity and its derivative by ``u``, both (n, ...), at n places, from values and rates at the ends.

        Rates are derivatives by the same variable as the tangents.
        """
        nodes = np.array((first, second, self.rates[0] * first_rate, self.rates[1] * second_rate))
        flat = nodes.reshape(4, -1)
        shape = (-1, *nodes.shape[1:])
        return (places.shares @ flat).reshape(shape), (places.slopes @ flat).reshape(shape)

    def point(self, u: Scalars) -> Array:
        """State (..., N + 1) at ``u``."""
        return mixed(blend(u), self.nodes)

    def derivative(self, u: Scalars) -> Array:
        """Derivative by ``u`` (..., N + 1)."""
        return mixed(blend_slope(u), self.nodes)

    def points(self, places: HermiteBasis) -> Array:
        """States (..., n, N + 1) at n places."""
        return np.asarray(places.shares @ self.nodes)

    def derivatives(self, places: HermiteBasis) -> Array:
        """Derivatives by ``u`` (..., n, N + 1) at n places."""
        return np.asarray(places.slopes @ self.nodes)

    def parameter_rates(self, places: HermiteBasis) -> Array:
        """Derivatives of the parameter by ``u`` (n,) at n places."""
        return np.asarray(places.slopes @ self.nodes[:, -1])

    def parameter(self, u: Scalars) -> Scalars:
        """Parameter (last entry of the state) at ``u``."""
        (p, q, r, s), (a, b, c, d) = blend(u), entries(self.nodes[..., -1])
        return p * a + q * b + r * c + s * d

    def where(self, parameter: float, low: Scalars, high: Scalars) -> Scalars:
        """The ``u`` in [low, high] at which the cubic passes ``parameter`` (bisection; the ends must bracket it)."""
        rising = self.parameter(high) > self.parameter(low)
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            beyond = (self.parameter(middle) > parameter) == rising
            low, high = chosen(beyond, low, middle), chosen(beyond, middle, high)
        return 0.5 * (low + high)


def blend(u: Scalars) -> tuple[Scalars, Scalars, Scalars, Scalars]:
    """Hermite basis at ``u``: shares of the first value, the second, and the derivatives by ``u`` at both."""
    v = u - 1.0
    return (1.0 + 2.0 * u) * v * v, u * u * (3.0 - 2.0 * u), u * v * v, u * u * v


def blend_slope(u: Scalars) -> tuple[Scalars, Scalars, Scalars, Scalars]:
    """Derivatives of ``blend`` by ``u``."""
    v = u - 1.0
    return 6.0 * u * v, -6.0 * u * v, v * (3.0 * u - 1.0), u * (3.0 * u - 2.0)
