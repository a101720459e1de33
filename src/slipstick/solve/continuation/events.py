"""Events along a branch: sign changes of functions of the state, located by solving again on the segment between."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

from slipstick.solve.continuation.corrector import Step
from slipstick.solve.continuation.hermite_segment import HermiteBasis, HermiteSegment
from slipstick.typing import Array


@dataclass(frozen=True, kw_only=True)
class BranchEvent:
    """A sign change of ``function(step)`` along the branch, to be located by the solver.

    A peak of an amplitude is ``function = d amplitude / ds = gradient @ step.tangent_x`` with ``direction = -1``.

    Parameters
    ----------
    name, kind
        Both are written on the located step; ``kind`` is for instance "peak".
    function
        Real function of a step (``x``, ``parameter``, ``tangent_x``, ``tangent_parameter``, ``evaluation``).
    direction
        -1: only from positive to negative along the branch; +1: only the other way; 0: both.
    terminal
        Whether the continuation ends there.
    exact
        Whether a point is only yielded if it is located to the tolerance. Otherwise the closest solution is yielded.
    place
        For a function that jumps: place ``u`` of the jump on the segment between two steps, from 0 to 1. One solution
        is computed there, without locating the jump to the tolerance.
    along
        Expected values (n,) of the function between two neighbouring steps, given both, the segment and n places on it.
        With it sign changes are looked for on the whole segment; without, only from end to end.
    height
        Of a maximum, with ``direction`` -1: the quantity that is largest there; ``function`` is its slope along the
        branch. Where the slope jumps, the maximum is the higher of the two sides. A slope of 0 is a plateau, which
        counts as a continuation of the slope before it. With ``direction`` 0: a maximum or a minimum.
    """

    name: str
    kind: str
    function: Callable[[Step], float]
    direction: int = 0
    terminal: bool = False
    exact: bool = False
    place: Callable[[Step, Step, HermiteSegment], float] | None = None
    along: Callable[[Step, Step, HermiteSegment, HermiteBasis], Array] | None = None
    height: Callable[[Step], float] | None = None

    @property
    def maximum(self) -> bool:
        """Whether it is a maximum: one may be hidden between two points whose slopes do not show it."""
        return self.height is not None and self.direction < 0

    def falling(self, before: float) -> BranchEvent:
        """The event with the sign of its function such that it falls through zero from a value ``before``."""
        if before > 0.0:
            return self
        function, height = self.function, self.height
        return replace(
            self, function=lambda step: -function(step), direction=-self.direction,
            height=None if height is None else lambda step: -height(step),
        )  # fmt: skip

    def crossed(self, before: float, after: float) -> bool:
        """Whether the values at two neighbouring points enclose such a sign change."""
        rising, falling = before < 0.0 <= after, before > 0.0 >= after
        return (rising and self.direction >= 0) or (falling and self.direction <= 0)


class Watched(Protocol):
    """Quantities of which only the largest values along the branch are located."""

    events: tuple[BranchEvent, ...]
    """Maxima of each."""

    def heights(self, step: Step) -> Array:
        """Their values (n,) at a step."""
        ...

    def expected(self, first: Step, second: Step, segment: HermiteSegment, places: HermiteBasis) -> tuple[Array, Array]:
        """Between two neighbours: slopes (n_places, n), exact at the ends, and the largest values (n,) at maxima."""
        ...


def turning_parameter(step: Step) -> float:
    """Zero where the parameter turns back."""
    return step.tangent_parameter


def turning_points(*, terminal: bool = False) -> BranchEvent:
    """The event of the parameter turning back."""
    return BranchEvent(
        name="turning point", kind="turning point", function=turning_parameter, terminal=terminal,
        along=lambda first, second, segment, places: segment.parameter_rates(places) / segment.length,
        height=lambda step: step.parameter,
    )  # fmt: skip


class BracketedRoot:
    """Bracketed root of a function that is expensive to evaluate.

    T. R. Chandrupatla, Advances in Engineering Software 28 (1997) 145: inverse quadratic interpolation where it is
    safe, bisection elsewhere. Evaluate at ``trial`` and call ``update`` until ``width`` is small.

    >>> root = BracketedRoot(1.0, -1.0, 2.0, 2.0)
    >>> while root.width > 1e-12:
    ...     root.update(root.trial, root.trial**2 - 2.0)
    >>> round(root.best, 12)
    1.414213562373
    """

    def __init__(self, a: float, fa: float, b: float, fb: float) -> None:
        self._a, self._fa, self._b, self._fb = a, fa, b, fb
        self.trial = a - fa * (b - a) / (fb - fa) if fb != fa else 0.5 * (a + b)

    @property
    def best(self) -> float:
        """The end with the smaller value."""
        return self._a if abs(self._fa) < abs(self._fb) else self._b

    @property
    def width(self) -> float:
        """Width of the bracket, 0 at an exact root."""
        return 0.0 if self._fa == 0.0 or self._fb == 0.0 else abs(self._b - self._a)

    def update(self, x: float, value: float, tolerance: float = 1e-15) -> None:
        """Record the value at the trial point and choose the next one."""
        if (value > 0.0) == (self._fa > 0.0):
            c, fc = self._a, self._fa
        else:
            c, fc = self._b, self._fb
            self._b, self._fb = self._a, self._fa
        self._a, self._fa = x, value
        a, fa, b, fb = self._a, self._fa, self._b, self._fb
        t = 0.5
        if fa != fb and fc not in (fa, fb) and c != b:
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            if phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi:
                t = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        near = min(0.5, 0.5 * tolerance / abs(b - a)) if a != b else 0.5
        self.trial = a + min(1.0 - near, max(near, t)) * (b - a)
