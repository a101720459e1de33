"""The continuation of a nonlinear mode: its first point, its branch, and points close enough for straight lines."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from math import inf, log, sqrt
from typing import Any

import numpy as np

from slipstick.analysis.modes.free_problem import LinearMode
from slipstick.analysis.modes.system import ModeSystem, TargetMode
from slipstick.analysis.road.checkpoint import Checkpoint
from slipstick.analysis.road.run import NO_WORK, Work
from slipstick.balance.balance import Balance
from slipstick.errors import Outcome
from slipstick.solve.continuation import (
    ArclengthScaling,
    BranchEvent,
    Continuation,
    ContinuationOptions,
    RestartPoint,
    Step,
    continuation,
)
from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.newton import NewtonOptions, NewtonResult, newton
from slipstick.solve.norm import norm
from slipstick.typing import Array

_NEWTON = NewtonOptions(tolerance=1e-13, max_iterations=20)
"""Options of Newton's method at a fixed amplitude of the output."""
_AMPLITUDE_RATIO, _AMPLITUDES = 0.25, 24
"""Ratio of successive amplitudes at which the linear mode is tried, and their number."""
_LINEAR = 0.02
"""Correction of a guess of size 1, up to which the motion is that of the linear mode."""
_NEAR, _SHORTEST = 0.2, 1.04
"""Change of a motion of size 1 from one amplitude to the next that is small, and the least ratio of two amplitudes."""
_MOTION_GROWTH = log(1e4)
"""Logarithm of the growth of the motion beyond that of the amplitude at the output, at which a branch stops."""
_HARMONIC, _HARMONIC_ERROR = 1e-4, 0.5
"""A higher harmonic above that size, relative to the motion, has to be predicted with at most this relative error."""
_STICKS = 1.0 - 1e-6
"""Fraction of the period above which a contact sticks at all times."""
_PLACES = (0.25, 0.5, 0.75)
"""Places in a segment at which its deviation from a straight line is measured."""
_HALVINGS = 12
"""Number of halvings of a segment at most."""
_DAMPING_SHARE, _LEAST_DAMPING = 0.02, 1e-9
"""Least damping ratio for relative deviations: share of the largest one of the branch, and absolute."""
_AMPLITUDE = "amplitude"
"""Name of the event at the last amplitude."""


class ModePath:
    """The continuation of a nonlinear mode.

    Parameters
    ----------
    system, at_dof
        The system of equations over the size of the motion, and over the amplitude at the output.
    linear
        The mode at small amplitude.
    ends
        First and last amplitude of harmonic 1 at the output.
    """

    def __init__(
        self, system: ModeSystem, at_dof: ModeSystem, linear: LinearMode, ends: tuple[float, float],
        options: ContinuationOptions,
    ) -> None:  # fmt: skip
        self.system, self.at_dof, self.linear = system, at_dof, linear
        self.first, self.last = ends
        self.options = replace(options, output_step=inf)
        self._runs: list[Continuation | Corrector | NewtonResult] = []
        self._earlier, self._begin, self._most = NO_WORK, 0.0, 0.0
        self._restart_points: deque[RestartPoint] = deque(maxlen=2)

    @property
    def work(self) -> Work:
        """Work of all continuations, correctors and solutions so far."""
        return self._work_of(self._runs)

    def _work_of(self, runs: Sequence[Continuation | Corrector | NewtonResult]) -> Work:
        rejected = sum(run.rejected for run in runs if isinstance(run, Continuation))
        return self._earlier.plus(
            Work(0, sum(run.evaluations for run in runs), sum(run.solves for run in runs), rejected)
        )

    def begin(self) -> tuple[Array, float] | None:
        """Unknowns (N + 4,) and parameter at the first amplitude; None where no solution is found.

        If the mode is not linear there, it is followed from a smaller amplitude at which it is: from amplitude to
        amplitude where the motion changes little between them, else by a continuation. Without one, it is followed from
        the largest amplitude at which the linear mode leads to a solution.
        """
        amplitude, near = self.first, None
        for _ in range(_AMPLITUDES):
            guess = first_guess(self.system.balance, self.system.target, self.linear, amplitude)
            result = self._solved(guess, amplitude)
            guess[:-2] /= self.at_dof.sizes(amplitude)
            if result.converged and norm((result.x - guess) / self._unit) < _LINEAR:
                break
            near = near or ((result, amplitude) if result.converged else None)
            amplitude *= _AMPLITUDE_RATIO
        else:  # e.g. a contact that just touches is not linear at any amplitude
            if near is None:
                return None
            result, amplitude = near
        if (climbed := self._climbed(result, amplitude)) is not None:
            return self._resized(climbed.x, self.first)
        y, parameter = self._resized(result.x, amplitude)
        last: Step | None = None
        run = self._run(y, parameter, (amplitude, self.first), [])
        for step in run:
            last = step
        if run.error is not None:  # an error, not a mode without a solution
            raise run.error
        if last is None or last.name != _AMPLITUDE:
            return None
        exact = self._exact(last, self.first)
        return self._resized(exact.x, self.first) if exact.converged else None

    def _climbed(self, result: NewtonResult, amplitude: float) -> NewtonResult | None:
        """The solution at the first amplitude, from one at a smaller amplitude; None where the motion changes much.

        Each solution is the guess of the next, in steps short enough that it stays near.
        """
        ratio = 1.0 / _AMPLITUDE_RATIO
        while amplitude < self.first:
            ahead = min(ratio * amplitude, self.first)
            guess = result.x.copy()
            guess[:-2] *= self.at_dof.sizes(amplitude)
            guess[:-2][self.at_dof.vibration] *= ahead / amplitude
            new = self._solved(guess, ahead)
            guess[:-2] /= self.at_dof.sizes(ahead)
            if new.converged and norm((new.x - guess) / self._unit) < _NEAR:
                result, amplitude, ratio = new, ahead, min(ratio * ratio, 1.0 / _AMPLITUDE_RATIO)
            elif (ratio := sqrt(ratio)) < _SHORTEST:
                return None
        return result

    def follow(self, y: Array, parameter: float, events: Iterable[BranchEvent]) -> Continuation:
        """The continuation from the first point; the step at the last amplitude is of kind "end"."""
        self._begin = parameter
        return self._run(y, parameter, (self.first, self.last), events)

    def resumed(self, checkpoint: Checkpoint, events: Iterable[BranchEvent]) -> Continuation:
        """The continuation from a checkpoint of the same mode: it finds the same points."""
        own, restart = checkpoint.own, tuple(filter(None, (checkpoint.before, checkpoint.restart_point)))
        self._begin, self._most, self._earlier = own["begin"], own["most"], own["work"]
        self._restart_points.extend(restart)
        return self._run(restart[-1].state[:-1], self._begin, (self.first, self.last), events, restart)

    def refined(self, run: Continuation) -> Iterator[Step]:
        """Steps with corrected points between them, so that frequency and damping are linear between points."""
        before = run.resumed_at
        for step in run:
            self._most = max(self._most, abs(float(_values(step.state)[1])))
            if run.restart_point is not None and run.restart_point.state is step.state:
                self._restart_points.append(run.restart_point)
            if before is not None:
                yield from self._between(before, step, max(_DAMPING_SHARE * self._most, _LEAST_DAMPING), _HALVINGS)
            yield step
            before = step

    def checkpoint(self, run: Continuation, step: Step, seconds: float) -> Checkpoint:
        """Checkpoint at a step of ``refined``, before the next step.

        Its ``own`` entries are the parameter at which the continuation began (``begin``), the largest damping so far
        (``most``) and the ``work`` of everything but this continuation.
        """
        accepted = bool(self._restart_points) and self._restart_points[-1].state is step.state
        others = self._work_of([one for one in self._runs if one is not run])
        return Checkpoint(
            value=step.evaluation.detail.amplitude, seconds=seconds, goes_on=accepted,
            restart_point=self._restart_points[-1] if accepted else None,
            before=self._restart_points[0] if accepted and len(self._restart_points) > 1 else None,
            own={"begin": self._begin, "most": self._most, "work": others},
        )  # fmt: skip

    def arrived(self, step: Step) -> tuple[Outcome, str]:
        """Outcome of a branch with this last step, and its message."""
        if step.name == _AMPLITUDE:
            return Outcome.COMPLETED, Outcome.COMPLETED.text
        return Outcome.TURNED_BACK, f"stopped early: the motion at the output does not come to {self.last:.6g}"

    def finished(self, step: Step) -> Step:
        """The step at exactly the last amplitude, from one near it."""
        result = self._exact(step, self.last)
        if not result.converged:
            return step
        return Step(np.append(result.x, log(self.last)), step.tangent, result, "end", _AMPLITUDE, result.x.size)

    def _solved(self, state: Array, amplitude: float) -> NewtonResult:
        """Solution at an amplitude of the output, from motion, frequency and damping (N + 4,)."""
        parameter, y = log(amplitude), state.copy()
        y[:-2] /= self.at_dof.sizes(amplitude)
        result = newton(lambda z: self.at_dof.evaluate(z, parameter), y, options=_NEWTON, scale=self._unit)
        self._runs.append(result)
        return result

    def _exact(self, step: Step, amplitude: float) -> NewtonResult:
        """Solution at an amplitude of the output, from a step near it."""
        state, detail = step.x.copy(), step.evaluation.detail
        state[:-2] *= self.system.sizes(detail.size)
        state[:-2] = self.system.turned(state[:-2], -float(np.angle(detail.at_dof)))
        return self._solved(state, amplitude)

    def _resized(self, y: Array, amplitude: float) -> tuple[Array, float]:
        """Unknowns and parameter over the size of the motion, from unknowns over the amplitude at the output."""
        state = y.copy()
        state[:-2] *= self.at_dof.sizes(amplitude)
        size = norm(state[:-2][self.system.vibration])
        state[:-2] /= self.system.sizes(size)
        return state, log(size)

    @property
    def _unit(self) -> Array:
        """Typical sizes of the unknowns."""
        unit = np.ones(self.system.size)
        unit[-2:] = self.linear.omega
        return unit

    def _run(
        self, y: Array, parameter: float, ends: tuple[float, float], events: Iterable[BranchEvent],
        restart: Sequence[RestartPoint] = (),
    ) -> Continuation:  # fmt: skip
        first, last = ends
        span = log(last / first)
        stop = parameter + span + np.copysign(_MOTION_GROWTH, span)
        scaling = ArclengthScaling(x=self._unit, parameter=abs(span), adaptive=False)
        reached = BranchEvent(
            name=_AMPLITUDE, kind="end", function=lambda s: log(s.evaluation.detail.amplitude / last),
            direction=1 if span > 0.0 else -1, terminal=True,
        )  # fmt: skip
        slip = BranchEvent(name="first slip", kind="corner", function=_sticking)
        self._scaling, self._length = scaling, abs(span)
        run = continuation(
            self.system, y, parameter, stop, options=self.options, scaling=scaling, doubted=self._may_jump,
            events=[slip, *events, reached], restart=restart,
        )  # fmt: skip
        self._runs.append(run)
        return run

    def _may_jump(self, last: Step, new: Step, guess: Array) -> bool:
        """Whether a higher harmonic differs from its prediction: a step across an internal resonance or first slip."""
        before, after, expected = (self._by_harmonic(z) for z in (last.state, new.state, guess))
        sizes = np.maximum(np.linalg.norm(before, axis=0), np.linalg.norm(after, axis=0))
        wrong = np.linalg.norm(after - expected, axis=0)
        return bool(np.any((sizes > _HARMONIC) & (wrong > _HARMONIC_ERROR * sizes)))

    def _by_harmonic(self, state: Array) -> Array:
        """Motion of the ports in each harmonic above 1, (2 n_ports, n - 1)."""
        b = self.system.balance
        X = state[: b.size].reshape(b.n_ports, b.L)
        return np.concatenate([X[:, 1::2], X[:, 2::2]])[:, b.orders > 1.0]

    def _between(self, first: Step, second: Step, least: float, halvings: int) -> Iterator[Step]:
        """Corrected points between two steps; ``least`` as in ``_deviation``."""
        metric = Metric(self._scaling, first.x, self._length)
        corrector = Corrector(self.system, first.x.size, metric, self.options.newton)
        segment = corrector.segment(first, second)
        tolerance = self.options.output_tolerance
        near = segment.length <= self.options.kink_step
        if (
            near
            or not halvings
            or _deviation([first.state, *map(segment.point, _PLACES), second.state], least) <= tolerance
        ):
            return
        corrector.context = first.evaluation.context
        guess = segment.point(0.5)
        middle, _ = corrector.correct(guess, segment.derivative(0.5), "regular")
        self._runs.append(corrector)
        if middle is None or not corrector.near(middle.state - guess, segment.length):
            return
        yield from self._between(first, middle, least, halvings - 1)
        yield middle
        yield from self._between(middle, second, least, halvings - 1)


def first_guess(balance: Balance, target: TargetMode, linear: LinearMode, amplitude: float) -> Array:
    """The linear mode with an amplitude at the output: motion of ports and mode, frequency and damping (N + 4,)."""
    turn = amplitude / linear.at_dof
    X, shape = np.zeros((balance.n_ports, balance.L)), linear.ports * turn
    c, s = (balance.harmonics.index(1, part) for part in "cs")
    X[:, 0], X[:, c], X[:, s] = linear.static, shape.real, -shape.imag
    q = complex(linear.modal[target.number]) * turn * target.scale
    return np.concatenate([X.reshape(-1), [q.real, -q.imag, linear.omega, linear.xi]])


def _sticking(step: Step) -> float:
    """1 while no contact slips, else -1."""
    slipping = any(bool(np.any(s < _STICKS)) for s in _stick_fractions(step.evaluation.detail.responses))
    return -1.0 if slipping else 1.0


def _stick_fractions(responses: Iterable[Any]) -> list[Array]:
    fractions = (getattr(response.detail, "stick_fraction", None) for response in responses)
    return [fraction for fraction in fractions if fraction is not None]


def _values(state: Array) -> Array:
    """Frequency and damping ratio of a state (N + 5,)."""
    return np.array([state[-3], state[-2] / (2.0 * state[-3])])


def _deviation(states: list[Array], least: float) -> float:
    """Relative deviation of frequency and damping between two points from the straight line through them.

    The line is over the amplitude and over its logarithm; where the amplitude turns back, over the arclength.
    ``least`` is the least damping ratio by which deviations are divided.
    """
    p, values = np.array([state[-1] for state in states]), np.array([_values(state) for state in states])
    shares = [np.linspace(0.0, 1.0, len(states))]
    if abs(p[-1] - p[0]) > 0.5 * np.abs(np.diff(p)).sum():
        shares = [(x - x[0]) / (x[-1] - x[0]) for x in (p, np.exp(p - p[0]))]
    deviation = [np.abs(values - values[0] - s[:, None] * (values[-1] - values[0])).max(axis=0) for s in shares]
    size = np.maximum(np.abs(values).max(axis=0), [0.0, least])
    return float(np.max(deviation / size))
