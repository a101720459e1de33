"""Exact steps of a piecewise linear friction system, with the instants of state changes located to rounding.

Over a step ``z(s) = sum_k s^k z_k``, ``z_k = (A d)^k z_0 / k!``: summed to rounding this is the matrix exponential, and
every switching function is a polynomial in ``s`` whose first root is the state change. Steps without a change
are taken many at a time. Where contacts of other laws make the system smooth instead of linear, z is the polynomial
that satisfies it at Gauss nodes [Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.7: order
2 x nodes]. A step is cut until the polynomial satisfies it at its ends too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import factorial

import numpy as np

from slipstick.analysis.time_domain.kernel.steps import series, steady_steps
from slipstick.analysis.time_domain.law_in_time import LawsInTime
from slipstick.analysis.time_domain.piecewise import Combination, LinearPiece, PiecewiseLinear, State
from slipstick.errors import InputError, SlipstickError
from slipstick.faults import MOST_ITEMS
from slipstick.solve.linear.dense import Factors
from slipstick.typing import Array, IntArray

_ROUNDING = 1e-12
"""Switching functions and guards below, over their size, are zero."""

_SAMPLES, _GUARD_SAMPLES = np.linspace(0.0, 1.0, 13)[1:], np.linspace(0.0, 1.0, 25)[1:]
"""Parts of a step at which switching functions, and guards of laws that switch, are sampled for a change of sign."""

_NEAR_START = 2.0 ** np.arange(-30.0, 1.0)
"""Parts of an interval at which a guard that is zero at its start is sampled for its first positive value."""

_CHUNK, _CLOSE_TO_ZERO = 64, 2e-9
"""Steps without a change are taken so many together; one with a switching function so close to zero is taken alone."""

_COUNT = 9
"""Gauss nodes of a step where the system is smooth: order 18."""

_GAUSS = 0.5 * (np.polynomial.legendre.leggauss(_COUNT)[0] + 1.0)
"""The nodes on (0, 1)."""

_FIT, _SETTLED, _LONGEST_ITERATION, _RELAXED = 1e-11, 1e-13, 60, 3
"""Errors over the size: at the ends of a polynomial that fits, and of a change in its iteration that may be rounding.
The iteration takes at most 60 rounds; with a residual the slopes of angles stay the same after 3."""

_SMALL, _SLOW = 50, 0.1
"""Length of z up to which laws that switch are iterated by Newton's steps with the slopes of all nodes together, in a
fifth of the rounds; the ratio of two changes above which the slopes are renewed."""

_SHORTEST, _SHORTEST_SWITCHING = 2.0**-16, 2.0**-44
"""Part of a step that is not cut any more, as a corner of the law lies in it.

The rate of laws that switch has no corners, but grows near a change of regime."""

_FEWEST, _FEWEST_SMOOTH = 256, 64
"""Steps a period, without and with laws that switch: of short sticks and separations none is missed."""

_STEP_ANGLE, _STEP_ANGLE_SMOOTH = 4.0, 1.5
"""Angle of the fastest motion in a step: of the power series, and of the polynomial at Gauss nodes."""


def step_angle(laws: LawsInTime) -> float:
    """Angle of the fastest motion in a step; beyond some multiples of it the series loses digits."""
    return _STEP_ANGLE_SMOOTH if laws else _STEP_ANGLE


def _steps(steps: int | None, fastest: float, fewest: int, angle: float) -> int:
    """Steps a period: those given, or by the fastest motion, per unit of tau."""
    needed = 2 * np.pi * fastest / angle
    if needed > MOST_ITEMS:
        raise InputError(
            f"time integration: the fastest motion is {fastest:.2g} times as fast as the forcing; a period takes "
            f"{needed:.1g} steps, and {MOST_ITEMS} are the most: leave out the fast modes, or check omega and the "
            "stiffness of the contacts"
        )
    if steps is not None and steps < 0.5 * needed:
        raise InputError(
            f"time integration, steps: found {steps}; expected at least {int(np.ceil(0.5 * needed))}, as the fastest "
            f"motion is {fastest:.3g} times as fast as the forcing"
        )
    return steps or int(max(fewest, np.ceil(needed)))


class ChatteringError(SlipstickError):
    """No combination of contact states is consistent at some instant."""


@dataclass(frozen=True, kw_only=True)
class Piece:
    """A part of a step with one combination of states: from ``tau``, where z is ``start``, over ``fraction`` steps."""

    tau: float
    fraction: float
    states: Combination
    linear: LinearPiece
    start: Array
    path: Array | None = None
    """Polynomial of z, (degree + 1, size), in steps from ``tau``; None where it is not stored, see ``Stepper.path``."""


@dataclass(frozen=True, kw_only=True)
class StateChange:
    """A contact changes its state at ``tau``.

    ``z``, ``linear`` and the switching function's row ``margin`` are those just before, ``states`` those just after.
    """

    tau: float
    contact: int
    """Number of the contact: friction contacts come first, then those whose law switches."""
    before: State | int
    after: State | int
    z: Array
    linear: LinearPiece
    rate: Array
    """dz/dtau just before."""
    margin: Array
    states: Combination
    value: float
    """Value of the switching function over its size.

    It is clearly below 0 where another change at the same instant caused this one by a jump of velocities."""


class Stepper:
    """Carries ``(tau, z, states)`` forward; state lives here because it iterates.

    Raises
    ------
    ChatteringError
        If states keep changing at one instant.
    InputError
        If the steps are too few or too many for the fastest motion.
    """

    def __init__(self, model: PiecewiseLinear, steps: int | None = None) -> None:
        self.model = model
        fastest = model.fastest()
        laws = model.system.laws
        self.steps = _steps(steps, fastest, _FEWEST_SMOOTH if laws.switching else _FEWEST, step_angle(laws))
        self.step = 2 * np.pi / self.steps
        angle = fastest * self.step
        self.degree = 12
        while angle**self.degree / factorial(self.degree) > 1e-18:
            self.degree += 1
        self.degree += 4
        self.changed: set[int] = set()
        """Contacts that changed their state in the current period, numbered as in the combination."""
        self.reset_lengths()
        self._vander = np.vander(_SAMPLES, self.degree + 1, increasing=True)

    def reset_lengths(self) -> None:
        """Forget the lengths of the last polynomials, so that the following depends on the state alone."""
        self._length = 1.0

    def powers(self, linear: LinearPiece, z: Array) -> Array:
        """Polynomial of z (size,) over one step, (degree + 1, size)."""
        out = np.empty((self.degree + 1, len(z)))
        out[0] = z
        if not linear.regimes:
            series(out, self.model.rates(linear), self.step)
            return out
        A = linear.A * self.step
        for k in range(1, self.degree + 1):
            np.dot(A, out[k - 1], out=out[k])
            out[k] /= k
        return out

    def propagate(self, linear: LinearPiece, Z: Array, fraction: float) -> Array:
        """``exp(A step fraction) Z``, of a length of any number of steps."""
        from scipy.linalg import expm, matrix_balance

        if "balanced" not in linear.cache:
            balanced, (scale, _) = matrix_balance(linear.A, permute=False, separate=True)
            linear.cache["balanced"] = balanced, scale[:, None]
        balanced, scale = linear.cache["balanced"]  # type: ignore[misc]
        return np.asarray(scale * (expm(balanced * (self.step * fraction)) @ (Z / scale)))

    @np.errstate(over="ignore", invalid="ignore")  # slopes of a law that jumps: the derivative is not finite then
    def carried(self, item: Piece, Phi: Array) -> Array:
        """Derivative of z at the end of a piece from that at its start, (size, ...); not finite where there is none."""
        if item.path is None or not item.linear.smooth:
            return self.propagate(item.linear, Phi, item.fraction)
        z = np.vander(item.fraction * _GAUSS, len(item.path), increasing=True) @ item.path
        J = (item.fraction * self.step) * self.model.rate_slopes(item.linear, z)
        rates = J @ Phi
        rows = [self.model.system.memory.start + row for row in self.model.system.laws.angles(item.linear.regimes)]
        inverses, change = _implicit(J[:, rows, rows].T), np.inf
        for _ in range(_LONGEST_ITERATION):
            before = rates
            rates = J @ (Phi + np.tensordot(_INTEGRALS, rates, 1))
            for row, inverse in zip(rows, inverses, strict=True):
                rates[:, row] = before[:, row] + inverse @ (rates[:, row] - before[:, row])
            last, change = change, np.abs(rates - before).max() / (np.abs(rates).max() or 1.0)
            if change <= 1e-15 or (change < _SETTLED and change > 0.5 * last):
                break
        return np.asarray(Phi + np.tensordot(_WHOLE, rates, 1))

    def path(self, item: Piece) -> Array:
        """Polynomial of z over a piece, in steps from its start."""
        return self.powers(item.linear, item.start) if item.path is None else item.path

    def extended_path(self, item: Piece) -> Array:
        """As ``path``, of the vectors that the rows of the piece multiply."""
        return self.extended(item.linear, self.path(item), item.fraction)

    def extended(self, linear: LinearPiece, path: Array, length: float) -> Array:
        """Polynomial of the vectors that rows multiply: z, and forces interpolated at Gauss nodes of the piece."""
        if not linear.is_extended:
            return path
        nodes = np.vander(length * np.append(0.0, _GAUSS), len(path), increasing=True) @ path
        forces = self.model.extended(linear, nodes)[:, path.shape[1] :]
        rising = _POWERS @ ((forces[1:] - forces[0]) / _GAUSS[:, None])
        rising /= length ** np.arange(1, _COUNT + 1)[:, None]
        return np.hstack([path, np.vstack([forces[:1], rising])])

    def _smooth(self, linear: LinearPiece, z: Array, length: float) -> tuple[Array, float]:
        """The polynomial from z on, and how far it reaches: ``length`` or less, in steps."""
        length = min(length, 2.0 * self._length)
        shortest = _SHORTEST_SWITCHING if linear.regimes else _SHORTEST
        while True:
            path = self._collocated(linear, z, length)
            if path is not None or length <= shortest:
                break
            length *= 0.5
        self._length = length
        if path is None:
            path = self._collocated(linear, z, length, fits=np.inf)
        if path is None:
            raise ChatteringError(
                "time integration: a law grows beyond all bounds; look at its rate and its parameters"
            )
        return path, length

    def difference(self, before: Array, after: Array, states: Combination) -> Array:
        """``after - before`` of z in some states, without whole turns of angles."""
        s, out = self.model.system, after - before
        for row in s.laws.angles(tuple(states[s.n_contacts :])):
            e = s.memory.start + row
            out[e] = (out[e] + np.pi) % (2.0 * np.pi) - np.pi
        return out

    def _sizes(self, linear: LinearPiece, z: Array) -> Array:
        """Magnitudes (size,), one for each group: motion and velocity, memory, angles, forcing."""
        s, out = self.model.system, np.ones_like(z)
        for block in (slice(0, 2 * s.n), slice(2 * s.n, s.memory.start)):
            out[block] = max(z[block].max(initial=0.0), 1e-300)
        angles = [s.memory.start + row for row in s.laws.angles(linear.regimes)]
        straight = np.delete(z[s.memory], [row - s.memory.start for row in angles])
        out[s.memory] = max(straight.max(initial=0.0), 1e-300)
        out[angles] = 1.0
        return out

    def _collocated(self, linear: LinearPiece, z: Array, length: float, fits: float = _FIT) -> Array | None:
        """The polynomial that satisfies the system at Gauss nodes of a length; None where it does not at the ends."""
        h = length * self.step
        rates = np.broadcast_to(h * self.model.rate(linear, z[None]), (_COUNT, len(z)))
        start, last, change, inverses = rates[0], np.inf, np.inf, np.zeros(0)
        angles = self.model.system.memory.start + np.array(self.model.system.laws.angles(linear.regimes), dtype=int)
        factors, newton = None, bool(linear.regimes) and len(z) <= _SMALL
        for count in range(_LONGEST_ITERATION):
            before, there = rates, z + _INTEGRALS @ rates
            rates = h * self.model.rate(linear, there)
            if newton:
                if factors is None or change > _SLOW * last:
                    factors = _all_nodes(h * self.model.rate_slopes(linear, there))
                rates = before + factors.solve((rates - before).ravel()).reshape(rates.shape)
            elif angles.size:  # Newton's step instead of the iteration's for angles, which may follow fast
                if linear.residual is None or count < _RELAXED:
                    inverses = _implicit(h * self._relaxation(linear, there, angles))
                for row, inverse in zip(angles, inverses, strict=True):
                    rates[:, row] = before[:, row] + inverse @ (rates - before)[:, row]
            size = self._sizes(linear, np.abs(z) + np.abs(rates).max(axis=0))  # from rest it is that of the rates
            last, change = change, float((np.abs(rates - before).max(axis=0) / size).max())
            if not change < 1e3:
                return None
            if change <= 1e-15 or (change < _SETTLED and change > 0.5 * last):
                break
        else:
            if fits < np.inf:
                return None
        coefficients = _POWERS @ rates
        end = z + _WHOLE @ rates
        ends = np.stack([coefficients[0] - start, coefficients.sum(axis=0) - h * self.model.rate(linear, end[None])[0]])
        if np.any(np.abs(ends) > fits * size):
            return None
        path = np.concatenate([z[None], coefficients / np.arange(1, _COUNT + 1)[:, None]])
        return np.asarray(path / length ** np.arange(_COUNT + 1)[:, None])

    def _relaxation(self, linear: LinearPiece, z: Array, angles: IntArray) -> Array:
        """Derivatives (angles, k) of the rates of angles by themselves, per unit of time."""
        if linear.residual is None:
            return self.model.system.laws.relaxation(*self.model.law_motion(linear, z), linear.regimes)[1]
        return self.model.law_slopes(linear, z)[3][:, angles - self.model.system.memory.start, angles].T

    def _magnitude(self, linear: LinearPiece) -> Array:
        """Magnitudes (2, m, size) of the switching functions' rows and of those of their rates over a step."""
        if "magnitude" not in linear.cache:
            rows = linear.margins
            linear.cache["magnitude"] = np.abs(np.array([rows, linear.rates_of(rows) * self.step]))
        return linear.cache["magnitude"]  # type: ignore[return-value]

    def first_change(
        self, linear: LinearPiece, z: Array, length: float, path: Array | None = None
    ) -> tuple[float, int] | None:
        """First state change in a step's first ``length`` (a fraction), as (fraction, switch), or None.

        ``path`` is the polynomial of z where the system is not linear.
        """
        extended = self.extended(linear, self.powers(linear, z) if path is None else path, length)
        if linear.smooth:  # right between Gauss nodes, not to rounding at the start
            extended = extended.copy()
            extended[1, : len(z)] = self.step * self.model.rate(linear, z[None])[0]
        c = extended @ linear.margins.T
        scale = np.maximum(self._magnitude(linear) @ np.abs(extended[0]), 1e-300)
        scale[0] += scale[1]  # a function that moves within a step has its rounding, even while it is close to zero
        c[0][np.abs(c[0]) < _ROUNDING * scale[0]] = 0.0
        # at the start of a stick the limit is touched with zero slope: that root is the start itself, not a change
        touching = (c[0] == 0.0) & (np.abs(c[1]) < 1e3 * _ROUNDING * np.maximum(scale[1], scale[0] * self.step))
        c[1][touching] = 0.0
        vander = self._vander[:, : len(c)] * length ** np.arange(len(c))
        values = vander @ c
        if touching.any():  # at its limit and at rest what is left of a motion is rounding
            values[:, touching & (np.abs(values).max(axis=0) <= _ROUNDING * scale[0])] = 0.0
        suspicious = np.flatnonzero((values.min(axis=0) < 0) | (c[0] < 0) | ((c[0] == 0) & (c[1] < 0)))
        changes = ((_first_root(c[:, k], values[:, k], length), int(k)) for k in suspicious)
        return min((change for change in changes if change[0] <= length), default=None)

    def period(self, z: Array, states: Combination, tau: float = 0.0) -> Iterator[Piece | StateChange]:
        """Pieces and state changes of one period; ends with ``self.z``, ``self.states`` set to the state at its end."""
        self.z, self.states, self.changed = z.copy(), states, set()
        system, i = self.model.system, 0
        while i < self.steps:
            linear = self.model(self.states)
            if not (linear.smooth or linear.regimes):
                now = tau + self.step * np.arange(i, min(i + _CHUNK, self.steps), dtype=float)
                starts = self._steady(linear, system.forcings(now))
                for start in starts:
                    yield Piece(tau=tau + i * self.step, fraction=1.0, states=self.states, linear=linear, start=start)
                    i += 1
                if len(starts) == _CHUNK or i == self.steps:
                    continue
            self.z[system.n_dynamic :] = system.forcing(tau + i * self.step)
            yield from self._one_step(tau + i * self.step)
            i += 1
        self.z[system.n_dynamic :] = system.forcing(tau + 2 * np.pi)

    def turn(self, number: int) -> Iterator[Piece | StateChange]:
        """Pieces and state changes of a numbered turn of the excitation, from ``self.z`` and ``self.states`` on."""
        yield from self.period(self.z, self.states)

    def _steady(self, linear: LinearPiece, forcing: Array) -> Array:
        """Starts (k, size) of the next steps in which no contact changes its state; ``self.z`` is their end."""
        if "margins" not in linear.cache:
            near = _CLOSE_TO_ZERO * self._magnitude(linear).sum(axis=0)
            linear.cache["margins"] = np.ascontiguousarray(linear.margins.T), np.ascontiguousarray(near.T)
        starts = np.empty((len(forcing) + 1, len(self.z)))
        starts[0] = self.z
        rates, margins = self.model.rates(linear), linear.cache["margins"]
        taken = steady_steps(starts, forcing, rates, self.step, self.degree, *margins, self._vander)  # type: ignore[misc]
        self.z = starts[taken].copy()
        return starts[:taken]

    def _path(self, linear: LinearPiece, tau: float, length: float) -> tuple[Array, float]:
        """The polynomial of z from ``self.z`` at tau on, and how far it reaches: ``length`` or less, in steps."""
        if linear.smooth:
            return self._smooth(linear, self.z, length)
        return self.powers(linear, self.z), length

    def _one_step(self, tau: float, whole: float = 1.0) -> Iterator[Piece | StateChange]:
        done, immediate = 0.0, 0
        while done < whole:
            linear = self.model(self.states)
            path, left = self._path(linear, tau + done * self.step, whole - done)
            change: tuple[float, int | tuple[int, int]] | None = None
            if len(linear.margins):
                change = self.first_change(linear, self.z, left, path)
            if linear.regimes:
                guard = self._first_guard(linear, path, left)
                if guard is not None and (change is None or guard[0] < change[0]):
                    change = (guard[0], (guard[1], guard[2]))
            length = change[0] if change else left
            immediate = self._immediate(immediate, length, tau)
            if length > 0.0:
                yield self._advance(linear, tau + done * self.step, length, path)
            done = whole if length == whole - done else done + length
            if change:
                at, now = change[1], tau + done * self.step
                yield self._switch(linear, at, now) if isinstance(at, int) else self._next_regime(linear, *at, now)

    def _immediate(self, before: int, length: float, tau: float) -> int:
        """Number of state changes at one instant, with the next one after ``length``; ChatteringError if too many."""
        if length > 0.0:
            return 0
        if before >= 8 * len(self.states) + 8:
            raise ChatteringError(
                f"time integration: the contact states keep changing at tau = {tau:.6g}; "
                "check the contact stiffnesses and friction coefficients"
            )
        return before + 1

    def _advance(self, linear: LinearPiece, tau: float, length: float, path: Array) -> Piece:
        start, self.z = self.z, length ** np.arange(len(path)) @ path
        return Piece(tau=tau, fraction=length, states=self.states, linear=linear, start=start, path=path)

    def _switch(self, linear: LinearPiece, index: int, tau: float) -> StateChange:
        switch = linear.switches[index]
        j, before = switch.contact, self.states[switch.contact]
        after = switch.target if switch.target is not None else self._onset(j)
        z, extended = self.z.copy(), self.model.extended(linear, self.z[None])[0]
        self.changed.add(j)
        self.enter(j, after, float(linear.fx[j] @ extended))
        size = float(np.maximum(self._magnitude(linear) @ np.abs(extended), 1e-300)[:, index].sum())
        return StateChange(
            tau=tau, contact=j, before=before, after=after, z=z, linear=linear,
            margin=self.model.gradient(linear, linear.margins[index], z),
            value=float(linear.margins[index] @ extended) / size,
            rate=self.model.rate(linear, z[None])[0], states=self.states,
        )  # fmt: skip

    def _first_guard(self, linear: LinearPiece, path: Array, length: float) -> tuple[float, int, int] | None:
        """First sign change of a guard of a law that switches: fraction, contact and guard; None without any."""
        s = np.append(0.0, length * _GUARD_SAMPLES)
        which, values = self._guards(linear, path, s)
        first: tuple[float, int, int] | None = None
        for k in np.flatnonzero((values < -_ROUNDING).any(axis=0)).tolist():
            i = int(np.argmax(values[:, k] < -_ROUNDING))
            at = self._guard_root(linear, path, k, float(s[max(i - 1, 0)]), float(s[i]))
            if first is None or at < first[0]:
                first = (at, *which[k])
        return first

    def _guards(self, linear: LinearPiece, path: Array, s: Array) -> tuple[list[tuple[int, int]], Array]:
        """Contacts and guards of laws that switch, and their values (k, n) at parts (k,) of a step."""
        z = np.vander(s, len(path), increasing=True) @ path
        return self.model.system.laws.guards(*self.model.law_motion(linear, z), linear.regimes)

    def _guard_root(self, linear: LinearPiece, path: Array, k: int, low: float, high: float) -> float:
        """Part of the step where guard k, negative at ``high``, changes sign; ``low`` if it never was positive."""
        from scipy.optimize import brentq

        near = low + (high - low) * np.append(0.0, _NEAR_START)
        values = self._guards(linear, path, near)[1][:, k]
        positive = np.flatnonzero(values > 0.0)
        if not positive.size:
            return low
        last = int(positive[0] + np.argmax(values[positive[0] :] <= 0.0))
        own = lambda x: self._guards(linear, path, np.array([x]))[1][0, k]  # noqa: E731
        return float(brentq(own, near[last - 1], near[last], xtol=1e-15, rtol=4 * np.finfo(float).eps))

    def _next_regime(self, linear: LinearPiece, number: int, guard: int, tau: float) -> StateChange:
        """A contact whose law switches goes over into its next regime."""
        s, z = self.model.system, self.z.copy()
        contact, place = s.laws.switching[number], s.n_contacts + number
        at = contact.at(*self.model.law_motion(linear, z[None]))
        before = int(self.states[place])
        self.changed.add(place)
        after = contact.regimes.after(before, guard, at)
        rate = self.model.rate(linear, z[None])[0]
        by_guard = contact.regimes.guard_slope(before, guard, at)
        value = float(contact.regimes.guards(before, at)[guard].item())
        self.z[s.memory.start + contact.memory] = contact.regimes.reset(before, after, at)[:, 0, 0]
        self.states = (*self.states[:place], after, *self.states[place + 1 :])
        return StateChange(
            tau=tau, contact=place, before=before, after=after, z=z, linear=linear, rate=rate,
            margin=by_guard @ self.model.law_rows_of(linear, number, z), states=self.states, value=value,
        )  # fmt: skip

    def enter(self, contact: int, state: State, force: float) -> None:
        """Puts a contact into a state with the friction force it has now."""
        self.states = replaced(self.states, contact, state)
        e = 2 * self.model.system.n + contact
        self.z[e] = 0.0
        if state is State.STICK:
            self.z[e] = spring_memory(self.model, self.states, contact, self.z, force)

    def _onset(self, contact: int) -> State:
        """Stick or slip where contact begins: stick if the limit grows faster than the force [THEORY.md (3.4)]."""
        if not self.model.frictional[contact]:
            return self.model.without_friction(contact)
        states = replaced(self.states, contact, State.STICK)
        z = self.z.copy()
        z[2 * self.model.system.n + contact] = spring_memory(self.model, states, contact, z, 0.0)
        linear = self.model(states)
        extended = self.model.extended(linear, z[None])[0]
        force, pressed = (float(linear.rates_of(rows[contact]) @ extended) for rows in (linear.fx, linear.fy))
        limit = float(self.model.system.mu[contact]) * pressed
        if abs(force) <= limit:
            return State.STICK
        return State.SLIP_PLUS if force > 0 else State.SLIP_MINUS


def replaced(states: Combination, contact: int, state: State) -> Combination:
    """The combination with one contact's state exchanged."""
    return (*states[:contact], state, *states[contact + 1 :])


def spring_memory(model: PiecewiseLinear, states: Combination, contact: int, z: Array, force: float) -> float:
    """The memory e of a contact that sticks in ``states`` such that its friction force is ``force`` (affine in e)."""
    linear, e = model(states), 2 * model.system.n + contact
    trial = z.copy()
    trial[e] = 0.0
    without = float(linear.fx[contact] @ model.extended(linear, trial[None])[0])
    return (force - without) / float(model.gradient(linear, linear.fx[contact], trial)[e])


def _collocation() -> tuple[Array, Array, Array]:
    """Maps from values at the Gauss nodes of [0, 1]: integrals up to each node, over all, and power coefficients."""
    nodes = np.polynomial.legendre
    basis = nodes.legvander(2.0 * _GAUSS - 1.0, _COUNT - 1)
    integrals = np.zeros((_COUNT, _COUNT))
    whole = np.zeros(_COUNT)
    for k in range(_COUNT):
        antiderivative = nodes.legint([*np.zeros(k), 1.0], lbnd=-1)
        integrals[:, k] = 0.5 * nodes.legval(2.0 * _GAUSS - 1.0, antiderivative)
        whole[k] = 0.5 * nodes.legval(1.0, antiderivative)
    fit = np.linalg.inv(basis)
    powers = np.linalg.inv(np.vander(_GAUSS, increasing=True))
    return np.asarray(integrals @ fit), np.asarray(whole @ fit), np.asarray(powers, dtype=float)


_INTEGRALS, _WHOLE, _POWERS = _collocation()


def _all_nodes(slopes: Array) -> Factors:
    """Of ``1 - slopes integrals`` of a system with slopes (nodes, n, n) over a step, for the rates at all nodes."""
    count, n, _ = slopes.shape
    matrix = np.empty((count * n, count * n), order="F")
    blocks = matrix.T.reshape(count, n, count, n)  # node and place that move, node and place that are answered
    np.multiply(_INTEGRALS.T[:, None, :, None], -slopes.transpose(2, 0, 1), out=blocks)
    matrix.ravel(order="K")[:: count * n + 1] += 1.0
    return Factors(matrix)


def _implicit(slopes: Array) -> Array:
    """``(1 - slopes integrals)^-1`` of scalar equations with slopes (n, nodes) over a step."""
    if not len(slopes):
        return np.zeros((0, _COUNT, _COUNT))
    return np.asarray(np.linalg.inv(np.eye(_COUNT) - slopes[:, :, None] * _INTEGRALS), dtype=float)


def _first_root(c: Array, values: Array, length: float) -> float:
    """First sign change to negative of the polynomial c on [0, length], given its values at the samples."""
    if c[0] < 0 or (c[0] == 0 and c[1] < 0):
        return 0.0
    k = int(np.argmax(values < 0))
    if values[k] >= 0:
        return np.inf
    low, high = (0.0 if k == 0 else length * _SAMPLES[k - 1]), length * _SAMPLES[k]
    # divide out a root at the start itself
    order = 0 if c[0] != 0 else (1 if c[1] != 0 else 2)
    falling = c[order:][::-1].tolist()

    def reduced(x: float) -> float:
        value = 0.0
        for coefficient in falling:
            value = value * x + coefficient
        return value

    if reduced(low) <= 0:
        return low
    from scipy.optimize import brentq

    return float(brentq(reduced, low, high, xtol=1e-15, rtol=4 * np.finfo(float).eps))
