"""The first point of a branch without an initial guess: strategies in order of cost, each reported to the caller."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite, nan

import numpy as np

from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import AnySystem, FrequencySystem, ParameterSystem
from slipstick.balance.inputs import Inputs, Line
from slipstick.balance.scaling import Scales, motions_at, scales
from slipstick.contact.rubbing import VELOCITIES
from slipstick.errors import Reason
from slipstick.interrupts import pass_on
from slipstick.solve.continuation import ContinuationOptions, continuation
from slipstick.solve.newton import Evaluation, NewtonOptions, newton_at
from slipstick.solve.norm import norm
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

Strategy = tuple[str, Callable[[], "Array | None"]]

# Newton's method: cheap attempts first; only when all have failed, the same starts with more iterations.
_NEWTON = NewtonOptions(max_iterations=40)
_QUICK = NewtonOptions(max_iterations=12, min_damping=0.05, non_monotone=2, patience=3)
_GROWTH, _SLOWEST_GROWTH, _LEAST_SHARE = 8.0, 3.0, 1e-5
"""Of a share of the excitation that grows from rest: largest and least factor, and the least share to begin with."""
_FROM_NEAR = replace(_QUICK, max_iterations=20, patience=5)
"""From the solution of a similar problem, where a few more iterations are worth while."""

# Ramps: long steps, roughly corrected, because only their end is used.
_RAMP = ContinuationOptions(
    first_step=0.05, max_step=0.3, min_step=1e-5, max_points=400, locate_turning_points=False,
    aimed_angle=0.8, max_angle=1.5, max_correction=10.0, contraction=0.5, target_iterations=8, kink_step=1e-3,
    newton=NewtonOptions(max_iterations=8, min_damping=0.4, non_monotone=1, tolerance=1e-4),
)  # fmt: skip
_LOAD_RAMP = replace(_RAMP, max_step=0.6)
_LOAD_RAMP_WEIGHT = 2.0
"""Weight of the motion in the arclength of a load ramp. Where contacts lift off together the load turns back while the
motion grows by a few per cent: measured by the load alone this fold is a corner."""

# Friction that reverses over a velocity: first over a large one, then over ever smaller ones.
_SMOOTH_VELOCITY = 0.1
"""First velocity of reversal, over that of the vibration."""
_DECADE = 10.0
"""Largest ratio of successive velocities."""
_SLOWEST_CHANGE = 0.9
"""Ratio of successive velocities, towards 1, at which the search ends."""

_MIN_SCALE = 1e-6
"""Scale of a start, over the typical displacement, where it is almost zero."""
_PAUSE = 1.0
"""Seconds between two ``Searching`` events."""


@dataclass(frozen=True, kw_only=True)
class StrategyTried:
    """One strategy for a first point."""

    name: str
    found: bool
    omega: float
    seconds: float
    reason: Reason | None = None
    """Why it failed; None where it did not, or where the reason is unknown."""


@dataclass(frozen=True, kw_only=True)
class Searching:
    """Progress of a long search for a first point, reported at intervals."""

    name: str
    """The present strategy, with those nested in it."""
    omega: float
    evaluations: int
    """Of the balance, in this search so far."""
    residual: float
    """Residual of the balance, relative to the motion; nan where the strategy has none."""
    share: float | None
    """Fraction of a ramp; None of other strategies."""

    @property
    def parts(self) -> tuple[str, ...]:
        """Texts of the innermost strategy, the evaluations and the residual.

        >>> name = "fewer harmonics first: load ramp"
        >>> event = Searching(name=name, omega=1.0, evaluations=9, residual=0.02, share=0.5)
        >>> event.parts
        ('load ramp at 50 %', 'evaluation 9', 'residual 2.0e-02')
        """
        way = self.name.rpartition(": ")[2]
        way = way if self.share is None else f"{way} at {self.share:.0%}".replace("%", " %")
        left = (f"residual {self.residual:.1e}",) if isfinite(self.residual) else ()
        return way, f"evaluation {self.evaluations}", *left


class NoStart(Reason):
    """Why a strategy could not begin."""

    RAMP = "no solution where the ramp begins"
    AT_REST = "no equilibrium was found under the static loads alone"
    FROM_REST = "the motion was lost while the excitation grew from a small share"
    FEWER_HARMONICS = "no solution with fewer harmonics"
    SMOOTHER = "no solution with smoother friction"
    LESS_SMOOTH = "the motion was lost while friction was made less smooth"
    NEAR_FIELD = "no solution with the near field of the residuals"


class _Watch:
    """Counts the evaluations of a search and reports them at intervals."""

    def __init__(self, report: Callable[[Searching], None] | None) -> None:
        self._report, self._evaluations, self._last = report, 0, time.monotonic()

    def count(self, name: str, omega: float, x: Array, value: Evaluation, share: float | None) -> None:
        """Count an evaluation, and let a pending interrupt through."""
        pass_on()
        self._evaluations += 1
        if time.monotonic() - self._last >= _PAUSE:
            self.report(name, omega, norm(value.residual) / (norm(x) or 1.0), share)

    def report(self, name: str, omega: float, residual: float = nan, share: float | None = None) -> None:
        """Report now."""
        self._last = time.monotonic()
        if self._report is None:
            return
        self._report(Searching(name=name, omega=omega, evaluations=self._evaluations, residual=residual, share=share))


class _Watched:
    """A system that calls ``see(state, evaluation, parameter)`` at each evaluation."""

    def __init__(self, system: AnySystem, see: Callable[[Array, Evaluation, float], None]) -> None:
        self._system, self._see = system, see

    def evaluate(self, x: Array, parameter: float, context: Array | None = None) -> Evaluation:
        """See ``FrequencySystem.evaluate``."""
        value = self._system.evaluate(x, parameter, context)
        self._see(x, value, parameter)
        return value


class FirstPoint:
    """Search for a solution at one frequency.

    Parameters
    ----------
    balance, inputs, omega
        The balance, its inputs, the frequency.
    guess
        Unknowns (N,) to try first.
    report
        Called with every ``StrategyTried``.
    last_resort
        Returns a motion (N,) found by other means, or None: called when all else failed.
    searching
        Called at intervals with the progress.
    """

    def __init__(
        self,
        balance: Balance,
        inputs: Inputs,
        omega: float,
        *,
        guess: Array | None = None,
        report: Callable[[StrategyTried], None] | None = None,
        last_resort: Callable[[], Array | None] | None = None,
        searching: Callable[[Searching], None] | None = None,
    ) -> None:
        self.balance, self.inputs, self.omega = balance, inputs, omega
        self.guess, self.report, self.last_resort = guess, report or (lambda event: None), last_resort
        self.scales: Scales = scales(balance, inputs, omega)
        self._reason: Reason | None = None
        self._watch, self._name, self._nested = _Watch(searching), "", False

    def find(self) -> Array | None:
        """Unknowns (N,), or None when every strategy failed."""
        within = self._name
        for name, attempt in self.strategies():
            begin, self._reason = time.perf_counter(), None
            self._name = f"{within}: {name}" if within else name
            x = attempt()
            self.report(
                StrategyTried(
                    name=name,
                    found=x is not None,
                    omega=self.omega,
                    seconds=time.perf_counter() - begin,
                    reason=None if x is not None else self._reason,
                )
            )
            if x is not None:
                return x
        return None

    def strategies(self) -> Iterator[Strategy]:
        """The strategies in order; later ones cost more."""
        guess = self.guess
        if guess is not None:
            yield "guess given", lambda: self._solve(guess)
        near = self.balance.nearly()
        if near is not None:
            yield "near field of the residuals first", lambda: self._near_field_first(near)
        motions = motions_at(self.balance, self.inputs, self.omega)
        linear = [(f"from the linear response, contacts {name}", x) for name, x in motions.items()]
        for name, x in linear[:1]:
            yield name, lambda x=x: self._solve(x, _QUICK)  # type: ignore[misc]
        if self.balance.harmonics.size > 1 and np.any(self.inputs.P[:, 0]) and not self._nested:
            yield "at rest first", self._from_rest
        for parameter, factor in self._smoother_ones():
            yield "smoother friction first", partial(self._smoother_first, parameter, factor)
        essential = self._essential()
        if essential != self.balance.harmonics:
            yield "fewer harmonics first", lambda: self._fewer_harmonics(essential)
        for name, x in linear[1:]:
            yield name, lambda x=x: self._solve(x, _QUICK)  # type: ignore[misc]
        yield from self._ramps()
        for name, x in linear:
            yield f"{name}, with patience", lambda x=x: self._solve(x)  # type: ignore[misc]
        start = next(iter(motions.values()), np.zeros(self.balance.size))
        yield "Newton homotopy", lambda: self._homotopy(start)
        if self.last_resort is not None:
            yield "time integration", self._from_last_resort

    def _ramps(self) -> Iterator[Strategy]:
        """Continuations in a parameter from a problem that is easily solved."""
        still = self.inputs.only("load", "motion")
        if still.any("load") or still.any("motion"):
            yield "load ramp", lambda: self._ramp(self.inputs.moved(still, -1.0), still, _LOAD_RAMP, _LOAD_RAMP_WEIGHT)
        speeds = self._speeds()
        if speeds.size:
            fast = self.inputs.only(*VELOCITIES).scaled(max(2.0 * self.scales.velocity / float(speeds.min()), 1.0))
            yield (
                "velocity ramp from full slip",
                lambda: self._ramp(self.inputs.moved(fast, 1.0), fast.scaled(-1)),
            )
        for name, parameter, fraction in self._law_ramps():
            missing = self.inputs.only(parameter).scaled(1.0 - fraction)
            yield name, lambda missing=missing: self._ramp(self.inputs.moved(missing, -1.0), missing)  # type: ignore[misc]

    def _law_ramps(self) -> dict[tuple[str, str, float], None]:
        """Ramps of the laws, each once."""
        pairs = zip(self.balance.batches, self.inputs.batches, strict=True)
        return dict.fromkeys(ramp for batch, contact_inputs in pairs for ramp in batch.law.ramps(contact_inputs.values))

    def _solve(self, x: Array, options: NewtonOptions = _NEWTON) -> Array | None:
        system = self._watched(FrequencySystem(self.balance, self.inputs))
        result = newton_at(system, x, self.omega, options=options, scale=self._scale(x))
        self._reason = result.reason
        return result.x if result.converged else None

    def _homotopy(self, x: Array) -> Array | None:
        """Reduce the residual of a first guess to zero by continuation."""
        from slipstick.solve.homotopy import homotopy

        system = self._watched(FrequencySystem(self.balance, self.inputs))
        result = homotopy(lambda z: system.evaluate(z, self.omega), x, scale=self._scale(x), options=_NEWTON)
        self._reason = result.reason
        return result.x if result.converged else None

    def _watched(self, system: AnySystem, *, ramp: bool = False) -> _Watched:
        """The system with evaluations counted; along a ramp its parameter is the fraction of the ramp."""

        def see(x: Array, value: Evaluation, parameter: float) -> None:
            self._watch.count(self._name, self.omega, x, value, parameter if ramp else None)

        return _Watched(system, see)

    def _part(self, balance: Balance, inputs: Inputs) -> FirstPoint:
        """A search nested in this one."""
        part = FirstPoint(balance, inputs, self.omega)
        part._watch, part._name, part._nested = self._watch, self._name, True
        return part

    def _scale(self, x: Array) -> float:
        size = float(np.linalg.norm(x))
        return max(size, _MIN_SCALE * self.scales.displacement)

    def _ramp(
        self, base: Inputs, direction: Inputs, options: ContinuationOptions = _RAMP, weight: float = 0.1
    ) -> Array | None:
        """Follow ``base + s direction`` from s = 0 to 1, the problem itself."""
        first = self._part(self.balance, base)
        for _, attempt in first._simple():
            x = attempt()
            if x is not None:
                break
        else:
            self._reason = NoStart.RAMP
            return None
        system = self._watched(ParameterSystem(self.balance, Line(base, direction), self.omega), ramp=True)
        run = continuation(system, x, 0.0, 1.0, options=options, scaling=self.scales.arclength(weight=weight))
        last = None
        for step in run:
            last = step
        self._reason = run.outcome
        return self._solve(last.x) if last is not None and last.parameter == 1.0 else None

    def _simple(self) -> Iterator[Strategy]:
        motions = motions_at(self.balance, self.inputs, self.omega)
        for name, x in motions.items():
            yield name, lambda x=x: self._solve(x)  # type: ignore[misc]

    def _speeds(self) -> Array:
        """Magnitudes of the nonzero rubbing velocities of all ports, length/time."""
        speeds = np.concatenate(
            [np.abs(contact_inputs.speed(self.omega)).reshape(-1) for contact_inputs in self.inputs.batches]
        )
        return speeds[speeds > 0]

    def _fewer_harmonics(self, kept: Harmonics) -> Array | None:
        """Solve with the driven harmonics and the lower half, by the same strategies, then with all."""
        x = self._with(kept)
        if x is None:
            self._reason = NoStart.FEWER_HARMONICS
            return None
        return self._solve(x, _FROM_NEAR)

    def _with(self, kept: Harmonics) -> Array | None:
        """Unknowns (N,) of the solution with some harmonics, by the same strategies; zero in the others."""
        places = [self.balance.harmonics.labels.index(label) for label in kept.labels]
        balance = self.balance.narrowed(kept)
        inputs = self.inputs.map(lambda name, array: array[..., places] if name in ("load", "motion") else array)
        x = self._part(balance, inputs).find()
        if x is None:
            return None
        full = np.zeros((self.balance.n_ports, self.balance.L))
        full[:, places] = x.reshape(-1, kept.size)
        return full.reshape(-1)

    def _from_rest(self) -> Array | None:
        """The equilibrium at rest, then a small share of what vibrates, which grows as long as the motion follows."""
        rest = self._with(Harmonics([0]))
        if rest is None:
            self._reason = NoStart.AT_REST
            return None
        vibrating = self.inputs.only("load", "motion").map(
            lambda name, array: array * (np.arange(array.shape[-1]) > 0) if name in ("load", "motion") else array
        )
        stuck = next(iter(motions_at(self.balance, self.inputs, self.omega).values()), rest)
        moving = np.tile(np.arange(self.balance.L) > 0, self.balance.n_ports)
        x, reached, share, ratio = rest + np.where(moving, stuck, 0.0), 0.0, 1.0, _GROWTH
        while reached < 1.0:
            guess = rest + share / (reached or 1.0) * (x - rest)
            found = self._part(self.balance, self.inputs.moved(vibrating, share - 1.0))._solve(guess, _FROM_NEAR)
            if found is not None:
                x, reached, ratio = found, share, min(ratio * ratio, _GROWTH)
            elif reached:
                ratio = np.sqrt(ratio)
            else:
                share /= _GROWTH
            if reached:
                share = min(ratio * reached, 1.0)
            if ratio < _SLOWEST_GROWTH or share < _LEAST_SHARE:
                self._reason = NoStart.FROM_REST
                return None
        return x

    def _smoother_ones(self) -> Iterator[tuple[str, float]]:
        """Parameters of the velocity over which friction reverses, with the factor to the first, large velocity."""
        for batch, contact_inputs in zip(self.balance.batches, self.inputs.batches, strict=True):
            parameter = batch.law.slow
            least = 0.0 if parameter is None else float(np.min(contact_inputs.values[parameter], initial=np.inf))
            if parameter is not None and 0.0 < least < _SMOOTH_VELOCITY / _DECADE * self.scales.velocity:
                yield parameter, _SMOOTH_VELOCITY * self.scales.velocity / least

    def _smoother_first(self, parameter: str, factor: float) -> Array | None:
        """Solve with friction that reverses over a large velocity, by the same strategies, then reduce the velocity."""
        extra = self.inputs.only(parameter)
        x = self._part(self.balance, self.inputs.moved(extra, factor - 1.0)).find()
        if x is None:
            self._reason = NoStart.SMOOTHER
            return None
        share = 1.0 / _DECADE
        while factor > 1.0 and share < _SLOWEST_CHANGE:
            smaller = max(share * factor, 1.0)
            found = self._part(self.balance, self.inputs.moved(extra, smaller - 1.0))._solve(x, _FROM_NEAR)
            if found is None:
                share = np.sqrt(share)
            else:
                x, factor, share = found, smaller, max(share * share, 1.0 / _DECADE)
        self._reason = None if factor == 1.0 else NoStart.LESS_SMOOTH
        return x if factor == 1.0 else None

    def _near_field_first(self, near: Balance) -> Array | None:
        """Solve without the far coupling by residuals, by the same strategies, then with it."""
        x = self._part(near, self.inputs).find()
        if x is None:
            self._reason = NoStart.NEAR_FIELD
            return None
        return self._solve(x, _FROM_NEAR)

    def _essential(self) -> Harmonics:
        """The driven harmonics and the lower half."""
        harmonics = self.balance.harmonics
        driven = np.any(self.inputs.P != 0, axis=0)
        for contact_inputs in self.inputs.batches:
            driven = driven | np.any(contact_inputs.motion != 0, axis=(0, 1))
        orders = {0, *harmonics.orders[1 : max(2, (len(harmonics.orders) + 1) // 2)]}
        orders |= {m for i, m in enumerate(harmonics.orders[1:]) if driven[2 * i + 1 : 2 * i + 3].any()}
        return Harmonics(sorted(orders))

    def _from_last_resort(self) -> Array | None:
        assert self.last_resort is not None
        self._watch.report(self._name, self.omega)
        x = self.last_resort()
        return None if x is None else self._solve(x)
