"""Steady motion of worn contacts, at a fixed frequency or at the peak of the response, with its derivatives.

``R(X, z) = 0`` and ``dz/dn = f(X, z) = kappa E`` are an index-1 differential-algebraic system on slow time n, the
number of cycles. The motion is solved for at every worn depth z; its derivatives are exact, so that

    df/dz = f_z + f_Y Y_z,    R_Y Y_z = -R_z,    Y = X, or Y = (X, w) with G = da/dw = 0 beside R = 0 at the peak.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slipstick.analysis.augmented import Bordered
from slipstick.analysis.peaks.continuation import LEVEL, bracketed_peak
from slipstick.analysis.peaks.system import PeakSystem, StateSpace
from slipstick.analysis.peaks.tracking import highest_peak
from slipstick.analysis.sensitivity.linearization import Linearization, Move
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Detail, FrequencySystem
from slipstick.balance.scaling import scales
from slipstick.balance.start import FirstPoint
from slipstick.balance.states import power_rows
from slipstick.results.record import Outputs
from slipstick.solve.newton import Evaluation, NewtonOptions, newton
from slipstick.solve.norm import norm, relative
from slipstick.state.wear import GAP, STIFFNESS, WornContacts
from slipstick.typing import Array

_NEWTON = NewtonOptions(max_iterations=12, min_damping=0.25, non_monotone=2, patience=3, stagnation=1e-11)
"""Options of Newton's method, which gives up early: a shorter step costs less than many iterations."""


@dataclass(frozen=True, kw_only=True)
class WornMotion:
    """A steady motion at worn depths.

    Attributes
    ----------
    z, rate
        Worn depths (n,) of all wearing contacts, and their rates, length per cycle.
    y, near
        Unknowns: of the balance (N,), at a peak with the frequency (N + 1,); and their context: time of the extreme
        (nan: the largest one), then contact states (n_states,).
    evaluation
        Evaluation at the solution.
    smooth
        Whether the motion depends smoothly on wear; a peak may lie on a change of contact state.
    """

    z: Array
    rate: Array
    y: Array
    near: Array
    evaluation: Evaluation
    residual: float
    iterations: int
    smooth: bool = True

    @property
    def detail(self) -> Detail:
        """Detail of the evaluation."""
        detail: Detail = self.evaluation.detail
        return detail


class _Worn(NamedTuple):
    """A wearing contact state: its number, and the slices of its values among those of all states and in z."""

    number: int
    state: WornContacts
    among_states: slice
    among_z: slice


class SteadyWear(ABC):
    """Steady motion over worn depths. A subclass defines which motion.

    Attributes
    ----------
    size
        Number n of worn depths.
    kappa
        Wear depth per dissipated energy, (n,).
    """

    def __init__(self, balance: Balance, omega: float, dof: str) -> None:
        self.balance = balance
        self.outputs = Outputs(balance, (dof,))
        self.inputs = balance.problem.inputs
        self._omega = omega
        self._worn, place, z = list[_Worn](), 0, 0
        for number, state in enumerate(balance.states):
            count = len(state.names)
            if isinstance(state, WornContacts):
                self._worn.append(_Worn(number, state, slice(place, place + count), slice(z, z + count)))
                z += count
            place += count
        self.size = z
        self.names = tuple(name for worn in self._worn for name in worn.state.names)
        self.kappa: Array = np.concatenate([worn.state.kappa for worn in self._worn])
        self._scale = scales(balance, self.inputs, omega).displacement

    # equations of the motion

    @abstractmethod
    def guess(self) -> Array | None:
        """Guess for the unknowns of the unworn motion."""

    @abstractmethod
    def omega(self, y: Array) -> float:
        """Frequency of the motion, rad/time."""

    @abstractmethod
    def evaluate(self, y: Array, near: Array) -> Evaluation:
        """Residual and Jacobian."""

    def slopes_by(self, motion: WornMotion, directions: list[Move]) -> Array:
        """Derivatives (N,) or (N + 1,) of the unknowns along directions, as columns; here at a fixed frequency."""
        here, still = self.linearized(motion), np.zeros(self.balance.size)
        columns = np.column_stack([here.change(still, direction)[0] for direction in directions])
        return -here.jacobian.solve(columns)

    def x(self, y: Array) -> Array:
        """Unknowns of the balance."""
        return y[: self.balance.size]

    # solutions

    def first(self) -> WornMotion | None:
        """The unworn motion; None where none is found."""
        y = self.guess()
        if y is None:
            return None
        start = [state.start for state in self.balance.states]
        near = np.concatenate([[np.nan], *start])
        if any(not state.slow for state in self.balance.states):  # from their start, then near their equilibrium
            here = Linearization(self.outputs, self.x(y), self.omega(y), self.inputs)
            near[1:] = np.nan if here.detail.carried is None else here.detail.carried
        return self.solve(np.zeros(self.size), y, near)

    def solve(self, z: Array, y: Array, near: Array) -> WornMotion | None:
        """The motion at worn depths, from unknowns ``y`` with context ``near``; None where none is found."""
        near = self._with_depths(near, z)
        scale = np.full(y.size, max(norm(self.x(y)), 1e-6 * self._scale))
        scale[self.balance.size :] = y[self.balance.size :]
        result = newton(lambda trial: self.evaluate(trial, near), y, options=_NEWTON, scale=scale)
        if not result.converged:
            return None
        return self.made(z, result.x, near, result.evaluation, result.iterations)

    def at(self, z: Array, y: Array, near: Array, iterations: int) -> WornMotion | None:
        """A known motion, evaluated again."""
        return self.made(z, y, near, self.evaluate(y, near), iterations)

    def made(
        self, z: Array, y: Array, near: Array, evaluation: Evaluation, iterations: int, *, smooth: bool = True
    ) -> WornMotion | None:
        """A motion from its evaluation."""
        if evaluation.detail is None:
            return None
        N = self.balance.size
        terms = evaluation.terms() if evaluation.terms is not None else np.ones(y.size)
        return WornMotion(
            z=z, rate=self._rate(evaluation.detail), y=y, near=near, evaluation=evaluation,
            residual=relative(evaluation.residual[:N], terms[:N]), iterations=iterations, smooth=smooth,
        )  # fmt: skip

    def onward(self, motion: WornMotion) -> Array:
        """Context of the next motions: contact states; of a peak, also the time of its extreme."""
        near = motion.near.copy()
        carried = motion.detail.carried
        if carried is not None:
            near[1:] = carried
        return near

    def _with_depths(self, near: Array, z: Array) -> Array:
        near = near.copy()
        for worn in self._worn:
            near[1:][worn.among_states] = z[worn.among_z]
        return near

    # rates and loads

    def _rate(self, detail: Detail) -> Array:
        """Wear rates ``f`` (n,) per cycle, which is one period."""
        period = 2.0 * np.pi / detail.omega
        return np.concatenate([period * detail.states[worn.number].rate.value for worn in self._worn])

    def loads(self, detail: Detail) -> Array:
        """Mean normal forces (n,)."""
        return np.concatenate([mean_load(self.balance, detail, worn.state.batch) for worn in self._worn])

    def stiffness(self, detail: Detail) -> Array:
        """Loss of load per worn depth, kn (n,)."""
        return np.concatenate([detail.responses[worn.state.batch].values[STIFFNESS] for worn in self._worn])

    # derivatives

    def drift(self, motion: WornMotion) -> Array:
        """Change of the unknowns per cycle."""
        along = self._opened(motion.rate)
        return self.slopes_by(motion, [along])[:, 0]

    def slopes(self, motion: WornMotion) -> Array:
        """``df/dz`` (n, n), with the change of motion."""
        worn = np.flatnonzero(self.kappa > 0.0)
        out = np.zeros((self.size, self.size))
        Y = self.slopes_by(motion, [self._opened(np.eye(self.size)[i]) for i in worn])
        N, detail = self.balance.size, motion.detail
        here = self.linearized(motion)
        powers, omega = here.powers(), detail.omega
        for of in self._worn:
            powered = powers[of.state.batch]
            change = power_rows(self.balance, powered) @ Y[:N]
            if len(Y) > N:
                change += np.outer(powered.power.omega, Y[N])
            own = np.zeros((self.size, of.state.kappa.size))
            own[of.among_z] = np.diag(powered.power.by_parameter(GAP))
            change += own[worn].T
            for carried in detail.states:
                if carried.batch == of.state.batch and not carried.state.slow:
                    change += carried.power_by_value[:, None] * (carried.gain @ change)
            if len(Y) > N:  # a cycle is 2 pi / omega
                change -= np.outer(powered.power.value / omega, Y[N])
            kappa = of.state.kappa[:, None]
            out[of.among_z, worn] = 2.0 * np.pi / omega * kappa * change
        return out

    def linearized(self, motion: WornMotion) -> Linearization:
        """The balance linearised at a motion."""
        y = motion.y
        return Linearization(self.outputs, self.x(y), self.omega(y), self.inputs, motion.near[1:])

    def _opened(self, dz: Array) -> Move:
        """The direction in which gaps open by ``dz`` (n,)."""
        inputs = self.inputs.scaled(0.0)
        for worn in self._worn:
            inputs = inputs.with_batch(worn.state.batch, **{GAP: dz[worn.among_z]})
        return Move(inputs=inputs)


def mean_load(balance: Balance, detail: Detail, batch: int) -> Array:
    """Mean normal forces (n,) of the contacts of a batch; of a law without a normal port, nan."""
    law, response = balance.batches[batch].law, detail.responses[batch]
    port = next((i for i, name in law.stiffness_names.items() if name == STIFFNESS), None)
    return np.full(response.work.size, np.nan) if port is None else response.force[port][:, 0]


class AtFrequency(SteadyWear):
    """The motion at a fixed frequency."""

    def __init__(self, balance: Balance, omega: float, dof: str, report: Callable[..., None] | None = None) -> None:
        super().__init__(balance, omega, dof)
        self._system, self._report = FrequencySystem(balance, self.inputs), report

    def guess(self) -> Array | None:
        """Guess by the strategies of ``FirstPoint``."""
        report = self._report
        return FirstPoint(self.balance, self.inputs, self._omega, report=report, searching=report).find()

    def omega(self, y: Array) -> float:
        """The given frequency."""
        return self._omega

    def evaluate(self, y: Array, near: Array) -> Evaluation:
        """Residual and Jacobian of the balance."""
        return self._system.evaluate(y, self._omega, near[1:])


class AtPeak(SteadyWear):
    """The peak of the response at one output, which moves with wear."""

    def __init__(self, balance: Balance, omega: tuple[float, float], dof: str) -> None:
        super().__init__(balance, omega[0], dof)
        self._space, self._range, self._dof = StateSpace(self.outputs, self.inputs), omega, dof
        self._peaks = PeakSystem(self._space)
        self._latest: tuple[WornMotion, Bordered | None] | None = None

    def guess(self) -> Array | None:
        """The highest peak in the range."""
        highest = highest_peak(self._space, 0.0, self._range, self._dof)
        return None if highest is None else highest.y

    def omega(self, y: Array) -> float:
        """The last unknown."""
        return float(y[-1])

    def evaluate(self, y: Array, near: Array) -> Evaluation:
        """The balance and the slope of the amplitude."""
        return self._peaks.evaluate(y, 0.0, near)

    def solve(self, z: Array, y: Array, near: Array) -> WornMotion | None:
        """The smooth peak of the followed extreme by Newton's method, else a corner by bracketing."""
        motion = super().solve(z, y, near)
        if motion is not None and motion.detail.ahead <= LEVEL and motion.detail.bend < 0.0:  # type: ignore[attr-defined]
            return motion
        near = self._with_depths(near, z)
        found = bracketed_peak(self._peaks, 0.0, y, near)
        if found is None:
            return None
        near[0] = np.nan
        return self.made(z, found.y, near, self.evaluate(found.y, near), found.iterations, smooth=False)

    def onward(self, motion: WornMotion) -> Array:
        """Context with the time of the extreme."""
        near = super().onward(motion)
        near[0] = np.nan if motion.evaluation.context is None else motion.evaluation.context[0]
        return near

    def slopes_by(self, motion: WornMotion, directions: list[Move]) -> Array:
        """Derivatives with the frequency in the last row, which is 0 where the peak lies on a change of state."""
        if motion.smooth:
            if self._latest is None or self._latest[0] is not motion:
                self._latest = motion, self._peaks.state(motion.y, 0.0, motion.near)
            at = self._latest[1]
            assert at is not None
            return at.slopes(directions)
        return np.vstack([super().slopes_by(motion, directions), np.zeros(len(directions))])
