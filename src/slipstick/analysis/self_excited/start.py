"""The first limit cycle beside a Hopf point.

While no contact changes its state the vibration of the growing pair is a solution of any size at the parameter of the
Hopf point itself. Only beyond the size at which a contact first does so there is one size to each value.
"""

from __future__ import annotations

import numpy as np

from slipstick.analysis.peaks.gradient import StateSpace
from slipstick.analysis.self_excited.steady_sliding import Sliding
from slipstick.analysis.self_excited.system import CycleSystem
from slipstick.analysis.stability.state_sequence import StateOrder, state_order_at
from slipstick.balance.scaling import scales
from slipstick.contact.friction_law import is_friction
from slipstick.solve.continuation import ArclengthScaling, Step
from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import Array

_WITHIN = (0.5, 0.05)
"""Of the size at which a contact changes its state: where the balance's own Hopf point is sought."""
_BEYOND = (0.02, 0.05, 0.1, 0.2, 0.01, 0.005, 0.002, 0.001)
"""How much larger than that size cycles are sought."""
_NEAR = 0.1
"""Of the range: where a cycle is nearer to the Hopf point it is the first: little of the curve is left out."""
_DOUBLINGS = 60
_STRAIGHT = 1e-9
"""Of the range: less than that is rounding."""
_SMALL, _GROWN, _SAME_VALUE = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8), (9.0, 4.0, 1.0, 19.0), 1e-3
"""Where laws other than friction bend the curve from the Hopf point on: sizes of the vibration there, and how much
larger than that the first cycle is sought."""


class CycleStart:
    """What is known of the vibration at a Hopf point of the balance.

    Eigenvalues tell where one is. The balance has its own one there: damping that has no eigenvalues, or compliance
    that equations in time leave out, moves it a little, and its vibration is no solution beside it.

    Attributes
    ----------
    system
        Equations of the limit cycles, in phase with the vibration.
    exists
        Whether the balance has one.
    rest, omega, value
        Steady sliding (N,), frequency and parameter there.
    motion
        Of the vibration, (N,): harmonic 1 alone, of length 1.
    largest
        Size at which a contact changes its state; None where none ever does. With laws that bend the curve from the
        Hopf point on a small one.
    smooth
        Whether there are such laws.
    """

    def __init__(self, space: StateSpace, hopf: Sliding, rest: Array, span: tuple[float, float]) -> None:
        self._space, self._span = space, span
        self._balance = space.outputs.balance
        h, shape = self._balance.harmonics, hopf.shapes[:, hopf.pairs[0]]
        c, s = h.index(1, "c"), h.index(1, "s")
        X, rate = np.zeros((2, shape.size, h.size))
        X[:, c], X[:, s] = shape.real, -shape.imag
        rate[:, c], rate[:, s] = -shape.imag, -shape.real
        self.motion = X.reshape(-1) / np.linalg.norm(X)
        self.system = CycleSystem(space, rate.reshape(-1))
        self.rest, self.omega, self.value = rest, hopf.omega, hopf.value
        self.scale = scales(self._balance, space.at_value(hopf.value), hopf.omega).displacement
        laws = [batch.law for batch in self._balance.batches if not is_friction(batch.law)]
        self.smooth = any(law.regimes is None for law in laws)
        self.largest = self._largest()
        if laws and not self.smooth:
            self.smooth = not self._straight()
        self.exists = self._settle()

    def size(self, x: Array) -> float:
        """Of the vibration in a motion (N,): length of all but its mean."""
        return float(np.linalg.norm(x.reshape(self._balance.n_ports, -1)[:, 1:]))

    def unit(self, x: Array) -> Array:
        """Typical sizes of the unknowns (N + 1,), from the motion of a first cycle."""
        return np.append(np.full(x.size, self.scale), self.omega)

    def vibrating(self, size: float) -> Array:
        """Unknowns (N,) of the vibration at a size up to which it solves the balance."""
        return self.rest + size * self.motion

    def first(self) -> Step | None:
        """A cycle a little larger, at whatever value of the parameter it has; None where none is found in the range."""
        assert self.largest is not None
        sizes = ((1.0 + beyond) * self.largest for beyond in (_GROWN if self.smooth else _BEYOND))
        found: Step | None = None
        for step in map(self._corrected, sizes):
            if step is None or not self._inside(step) or (not self.smooth and self._slides_on(step)):
                continue
            if found is None or self._away(step) < self._away(found):
                found = step
            if self._away(found) < _NEAR:
                break
        return found

    def _away(self, step: Step) -> float:
        """Of the range, how far from the Hopf point a vibration is."""
        return abs(step.parameter - self.value) / abs(self._span[1] - self._span[0])

    def _beside(self, step: Step) -> bool:
        """Whether a vibration is so small that its parameter is that of the Hopf point."""
        return self._away(step) < _SAME_VALUE

    def _settle(self) -> bool:
        """Go from where eigenvalues put the Hopf point to that of the balance, and say whether there is one."""
        size = self.largest or self.scale
        for part in _SMALL if self.smooth else _WITHIN:
            step = self._corrected(part * size, exact=True)
            if step is not None and self._slides_on(step) and (not self.smooth or self._beside(step)):
                x, self.omega, self.value = step.x[:-1], float(step.x[-1]), step.parameter
                X = x.reshape(self._balance.n_ports, -1)
                first, c = np.zeros_like(X), self._balance.harmonics.index(1, "c")
                first[:, c : c + 2] = X[:, c : c + 2]
                self.motion = first.reshape(-1) / np.linalg.norm(first)
                self.rest = np.where(np.arange(X.shape[1]) == 0, X, 0.0).reshape(-1)
                self.largest = part * size if self.smooth else self._largest()
                if self.smooth and (half := self._corrected(0.5 * part * size, exact=True)) is not None:
                    self.value += 4.0 / 3.0 * (half.parameter - self.value)  # the curve bends as the size squared
                return True
        return False

    def _straight(self) -> bool:
        """Whether vibration of any size at which no contact changes its state has the same value of the parameter."""
        steps = [self._corrected(part * (self.largest or self.scale), exact=True) for part in (0.5, 0.25)]
        there = [step.parameter for step in steps if step is not None and self._slides_on(step)]
        return len(there) == len(steps) and abs(there[1] - there[0]) < _STRAIGHT * abs(self._span[1] - self._span[0])

    def _corrected(self, size: float, *, exact: bool = False) -> Step | None:
        """The solution of the balance whose part along the vibration has a size."""
        guess = np.concatenate([self.vibrating(size), [self.omega, self.value]])
        scaling = ArclengthScaling(x=self.unit(self.rest), weight=0.1)
        metric = Metric(scaling, guess[:-1], abs(self._span[1] - self._span[0]))
        way = np.concatenate([self.motion, [0.0, 0.0]]) / metric.weights**2
        corrector = Corrector(self.system, guess.size - 1, metric, NewtonOptions())
        return corrector.correct(guess, way, "start", options=corrector.exact if exact else None)[0]

    def _inside(self, step: Step) -> bool:
        return min(self._span) < step.parameter < max(self._span)

    def _slides_on(self, step: Step) -> bool:
        """Whether no contact changes its state."""
        return self._order(step.x[:-1], float(step.x[-1]), step.parameter) == self._order(self.rest)

    def _order(self, x: Array, omega: float | None = None, value: float | None = None) -> StateOrder:
        inputs = self._space.at_value(self.value if value is None else value)
        return state_order_at(self._balance, x, omega or self.omega, inputs)

    def _largest(self) -> float | None:
        still = self._order(self.rest)
        high = self.scale
        for _ in range(_DOUBLINGS):
            if self._order(self.vibrating(high)) != still:
                break
            high *= 2.0
        else:
            return None
        low = 0.0
        for _ in range(_DOUBLINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._order(self.vibrating(middle)) == still else (low, middle)
        return high
