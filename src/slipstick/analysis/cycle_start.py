"""The first limit cycle beside a Hopf point.

While no contact changes its state the vibration of the growing pair is a solution of any size at the parameter of the
Hopf point itself. Only beyond the size at which a contact first does so there is one size to each value.
"""

from __future__ import annotations

import numpy as np

from slipstick.analysis.cycle_system import CycleSystem
from slipstick.analysis.sliding import Sliding
from slipstick.analysis.slope import StateSpace
from slipstick.analysis.stability.intervals import Word, word_of
from slipstick.balance.scaling import scales
from slipstick.solve.continuation import ArclengthScaling, Step
from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import Array

_BEYOND = (0.02, 0.05, 0.1, 0.2, 0.01)
"""How much larger than that size cycles are sought."""
_DOUBLINGS = 60


class CycleStart:
    """What is known of the vibration at a Hopf point.

    Attributes
    ----------
    motion
        Of the pair, (N,): harmonic 1 alone, of length 1.
    phase
        Its rate by phase.
    largest
        Size at which a contact changes its state; None where none ever does.
    """

    def __init__(self, space: StateSpace, hopf: Sliding, rest: Array) -> None:
        self._space, self._hopf, self._rest = space, hopf, rest
        self._balance = space.outputs.balance
        h, shape = self._balance.harmonics, hopf.shapes[:, hopf.pairs[0]]
        c, s = h.index(1, "c"), h.index(1, "s")
        X, rate = np.zeros((2, shape.size, h.size))
        X[:, c], X[:, s] = shape.real, -shape.imag
        rate[:, c], rate[:, s] = -shape.imag, -shape.real
        length = float(np.linalg.norm(X))
        self.motion, self.phase = X.reshape(-1) / length, rate.reshape(-1) / length
        self.scale = scales(self._balance, space.at_value(hopf.value), hopf.omega).displacement
        self.largest = self._largest()

    def size(self, x: Array) -> float:
        """Of the vibration in a motion (N,): length of all but its zero harmonic."""
        return float(np.linalg.norm(x.reshape(self._balance.n_ports, -1)[:, 1:]))

    def unit(self, x: Array) -> Array:
        """Typical sizes of the unknowns (N + 1,), from the motion of a first cycle."""
        return np.append(np.full(x.size, self.scale), self._hopf.omega)

    def _word(self, size: float) -> Word:
        hopf, balance = self._hopf, self._balance
        inputs = self._space.at_value(hopf.value).batches[0]
        motion = balance.motion(0, self._rest + size * self.motion, hopf.omega, inputs)
        return word_of(balance.harmonics, motion.Q[0], motion.Q[1], {**inputs.values, "v": motion.drift[0]})

    def _largest(self) -> float | None:
        still = self._word(0.0)
        high = self.scale
        for _ in range(_DOUBLINGS):
            if self._word(high) != still:
                break
            high *= 2.0
        else:
            return None
        low = 0.0
        for _ in range(_DOUBLINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._word(middle) == still else (low, middle)
        return high

    def first(self, system: CycleSystem, span: tuple[float, float]) -> Step | None:
        """A cycle a little larger, at whatever value of the parameter it has; None where none is found in the range."""
        assert self.largest is not None
        way = np.concatenate([self.motion, [0.0, 0.0]])
        for beyond in _BEYOND:
            x = self._rest + (1.0 + beyond) * self.largest * self.motion
            guess = np.concatenate([x, [self._hopf.omega, self._hopf.value]])
            metric = Metric(ArclengthScaling(x=self.unit(x), weight=0.1), guess[:-1], abs(span[1] - span[0]))
            corrector = Corrector(system, guess.size - 1, metric, NewtonOptions())
            step, _ = corrector.correct(guess, way / metric.weights**2, "start")
            if step is not None and min(span) < step.parameter < max(span) and step.parameter != self._hopf.value:
                return step
        return None
