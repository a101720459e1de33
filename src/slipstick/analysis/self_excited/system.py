"""The balance of self-excited vibration as a system of equations, and the first limit cycle near a Hopf point.

Nothing prescribes the phase of motion that nothing excites. One more equation fixes it, ``p . X = 0``, and the
frequency is one more unknown: ``R(X, w, s) = 0``, ``p . X = 0`` for ``(X, w)`` over a parameter s.

While no contact changes its state, the vibration of the growing pair is a solution of any size at the parameter of the
Hopf point itself. Only above the size at which a contact first changes its state does each parameter have one size.
"""

from __future__ import annotations

from math import isfinite

import numpy as np

from slipstick.analysis.augmented import Augmented, Bordered
from slipstick.analysis.peaks.system import StateSpace
from slipstick.analysis.self_excited.steady_sliding import Sliding
from slipstick.analysis.sensitivity.linearization import FREQUENCY
from slipstick.analysis.stability.floquet import StabilityWatch
from slipstick.analysis.stability.harmonic_form import HarmonicForm
from slipstick.analysis.stability.special_points import SpecialPoints
from slipstick.analysis.stability.state_sequence import StateOrder, state_order_at
from slipstick.balance.evaluation import Detail
from slipstick.balance.inputs import Inputs
from slipstick.balance.scaling import scales
from slipstick.contact.friction_law import is_friction
from slipstick.results.stability import PointStability
from slipstick.solve.continuation import ArclengthScaling, Step
from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import Array, ComplexArray


class CycleSystem(Augmented):
    """``(R, p . X) = 0`` for the unknowns ``(X, w)`` over a parameter; its Jacobian is a full matrix.

    Without the border the Jacobian of the balance is singular at every limit cycle: the phase is arbitrary.

    Parameters
    ----------
    space
        The states, with a parameter.
    phase
        ``p`` (N,), such as the rate of a motion similar to the cycles, which are then in phase with it.
    """

    def __init__(self, space: StateSpace, phase: Array) -> None:
        self.space, self.balance = space, space.outputs.balance
        self.phase = phase / np.linalg.norm(phase)

    def state(self, y: Array, parameter: float, context: Array | None = None) -> Bordered | None:
        """The balance at ``y = (X, w)`` with ``p . X = 0``."""
        if not (isfinite(y.dot(y)) and y[-1] > 0.0 and isfinite(parameter)):
            return None
        x, still = y[:-1], np.zeros(y.size - 1)
        here = self.space.at(x, float(y[-1]), parameter)
        by_omega, by_parameter = (here.change(still, way)[0] for way in (FREQUENCY, self.space.along(parameter)))
        size = np.abs(self.phase) @ np.abs(x)
        return Bordered(
            here, here.jacobian.bordered(by_omega, np.append(self.phase, 0.0)), np.array([self.phase @ x]),
            np.array([size]), lambda way: np.zeros(1), np.append(by_parameter, 0.0), here.detail,
        )  # fmt: skip


class CycleWatch(StabilityWatch):
    """Stability of limit cycles, without the multiplier 1 of a shift in time."""

    free = True

    def at(self, x: Array, detail: Detail, *, odd: bool | None = None, error: float | None = None) -> PointStability:
        """Stability at ``(X, w)``; the sign of the bordered determinant has no meaning here."""
        return super().at(x[:-1], detail, error=error)

    def growing(self, x: Array, detail: Detail) -> int:
        """Number of growing disturbances of a wave at ``(X, w)``."""
        return super().growing(x[:-1], detail)

    def judged(self, multipliers: ComplexArray) -> ComplexArray:
        """All multipliers but the 1 of a shift in time."""
        return np.delete(multipliers, int(np.argmin(np.abs(multipliers - 1.0)))) if multipliers.size else multipliers

    def form(self, x: Array, detail: Detail) -> HarmonicForm:
        """The harmonic form at ``(X, w)``."""
        return super().form(x[: self.balance.size], detail)


class CycleSpecialPoints(SpecialPoints):
    """Changes of the kind of motion along a branch of limit cycles."""

    def __init__(self, watch: CycleWatch, system: CycleSystem) -> None:
        super().__init__(watch, system)  # type: ignore[arg-type]
        self._cycles = system

    def _placed(self, x: Array, parameter: float) -> tuple[Array, Inputs, float]:
        """Motion (N,), inputs and frequency at unknowns and parameter."""
        return x[:-1], self._cycles.space.at_value(parameter), float(x[-1])


_SETTLING_SIZES = (0.5, 0.05)
"""Sizes of vibration at which the Hopf point of the balance is sought, over the size at the first change of state."""
_FIRST_GROWTHS = (0.02, 0.05, 0.1, 0.2, 0.01, 0.005, 0.002, 0.001)
"""Growths beyond the size at the first change of state, at which the first cycle is sought."""
_SMOOTH_SIZES, _SMOOTH_GROWTHS = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8), (9.0, 4.0, 1.0, 19.0)
"""The same where laws other than friction curve the branch from the Hopf point on."""
_FIRST_DISTANCE = 0.1
"""Distance of a cycle from the Hopf point, over the range, up to which it is the first one without further search."""
_AT_HOPF_POINT = 1e-3
"""Distance over the range, up to which a small vibration has the parameter of the Hopf point."""
_VERTICAL = 1e-9
"""Change of the parameter over the range, up to which it is rounding and the branch is vertical."""
_DOUBLINGS = 60
"""Largest number of doublings, and of bisections, for the size at the first change of state."""


class CycleStart:
    """The vibration at a Hopf point of the balance, and the first limit cycle.

    Eigenvalues give an estimate. The Hopf point of the balance differs a little where damping has no eigenvalues, or
    where equations in time omit part of the compliance; only the vibration of that point solves the balance.

    Attributes
    ----------
    system
        Equations of the limit cycles, in phase with the vibration.
    exists
        Whether the balance has a Hopf point there.
    rest, omega, value
        Steady sliding (N,), frequency and parameter there.
    motion
        Vibration (N,): harmonic 1 only, of norm 1.
    largest
        Size at which a contact first changes its state; None where no contact does. A small size where ``smooth``.
    smooth
        Whether laws other than friction curve the branch from the Hopf point on.
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
        self.largest = self._first_change()
        if laws and not self.smooth:
            self.smooth = not self._vertical()
        self.exists = self._settle()

    def size(self, x: Array) -> float:
        """Size of the vibration in a motion (N,): norm without the mean."""
        return float(np.linalg.norm(x.reshape(self._balance.n_ports, -1)[:, 1:]))

    def unit(self, x: Array) -> Array:
        """Typical sizes of the unknowns (N + 1,)."""
        return np.append(np.full(x.size, self.scale), self.omega)

    def vibrating(self, size: float) -> Array:
        """Unknowns (N,) of the vibration of a size up to ``largest``, which solves the balance."""
        return self.rest + size * self.motion

    def first(self) -> Step | None:
        """A slightly larger cycle, at its value of the parameter; None where no cycle is found in the range."""
        assert self.largest is not None
        sizes = ((1.0 + growth) * self.largest for growth in (_SMOOTH_GROWTHS if self.smooth else _FIRST_GROWTHS))
        found: Step | None = None
        for step in map(self._corrected, sizes):
            if step is None or not self._inside(step) or (not self.smooth and self._slides_on(step)):
                continue
            if found is None or self._distance(step) < self._distance(found):
                found = step
            if self._distance(found) < _FIRST_DISTANCE:
                break
        return found

    def _distance(self, step: Step) -> float:
        """Distance of a vibration from the Hopf point, over the range."""
        return abs(step.parameter - self.value) / abs(self._span[1] - self._span[0])

    def _at_hopf_point(self, step: Step) -> bool:
        """Whether a vibration has the parameter of the Hopf point."""
        return self._distance(step) < _AT_HOPF_POINT

    def _settle(self) -> bool:
        """Move from the estimate to the Hopf point of the balance; False where there is no such point."""
        size = self.largest or self.scale
        for part in _SMOOTH_SIZES if self.smooth else _SETTLING_SIZES:
            step = self._corrected(part * size, exact=True)
            if step is not None and self._slides_on(step) and (not self.smooth or self._at_hopf_point(step)):
                x, self.omega, self.value = step.x[:-1], float(step.x[-1]), step.parameter
                X = x.reshape(self._balance.n_ports, -1)
                first, c = np.zeros_like(X), self._balance.harmonics.index(1, "c")
                first[:, c : c + 2] = X[:, c : c + 2]
                self.motion = first.reshape(-1) / np.linalg.norm(first)
                self.rest = np.where(np.arange(X.shape[1]) == 0, X, 0.0).reshape(-1)
                self.largest = part * size if self.smooth else self._first_change()
                if self.smooth and (half := self._corrected(0.5 * part * size, exact=True)) is not None:
                    self.value += 4.0 / 3.0 * (half.parameter - self.value)  # linear in size squared
                return True
        return False

    def _vertical(self) -> bool:
        """Whether vibration of all sizes without a change of contact state has the same parameter."""
        steps = [self._corrected(part * (self.largest or self.scale), exact=True) for part in (0.5, 0.25)]
        there = [step.parameter for step in steps if step is not None and self._slides_on(step)]
        return len(there) == len(steps) and abs(there[1] - there[0]) < _VERTICAL * abs(self._span[1] - self._span[0])

    def _corrected(self, size: float, *, exact: bool = False) -> Step | None:
        """The solution of the balance whose component along the vibration has a size."""
        guess = np.concatenate([self.vibrating(size), [self.omega, self.value]])
        scaling = ArclengthScaling(x=self.unit(self.rest), weight=0.1)
        metric = Metric(scaling, guess[:-1], abs(self._span[1] - self._span[0]))
        way = np.concatenate([self.motion, [0.0, 0.0]]) / metric.weights**2
        corrector = Corrector(self.system, guess.size - 1, metric, NewtonOptions())
        return corrector.correct(guess, way, "start", options=corrector.exact if exact else None)[0]

    def _inside(self, step: Step) -> bool:
        return min(self._span) < step.parameter < max(self._span)

    def _slides_on(self, step: Step) -> bool:
        """Whether no contact changes its state during the period."""
        return self._state_sequence(step.x[:-1], float(step.x[-1]), step.parameter) == self._state_sequence(self.rest)

    def _state_sequence(self, x: Array, omega: float | None = None, value: float | None = None) -> StateOrder:
        inputs = self._space.at_value(self.value if value is None else value)
        return state_order_at(self._balance, x, omega or self.omega, inputs)

    def _first_change(self) -> float | None:
        still = self._state_sequence(self.rest)
        high = self.scale
        for _ in range(_DOUBLINGS):
            if self._state_sequence(self.vibrating(high)) != still:
                break
            high *= 2.0
        else:
            return None
        low = 0.0
        for _ in range(_DOUBLINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self._state_sequence(self.vibrating(middle)) == still else (low, middle)
        return high
