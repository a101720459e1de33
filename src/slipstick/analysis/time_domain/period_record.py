"""Results of one period of a time integration.

``PeriodRecord`` has harmonic coefficients, extremes, work and state fractions of a steady period; ``PeriodSums`` adds
the energy balance over all periods of a long run. Both integrate over the pieces between state changes by Gauss
quadrature on the exact polynomials of each piece: corners cost no accuracy, and no sampling theorem is involved.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slipstick.analysis.time_domain.event_integrator import Piece, StateChange, Stepper
from slipstick.analysis.time_domain.piecewise import LinearPiece, State
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2
_SLIPPING = (State.SLIP_PLUS, State.SLIP_MINUS)
_PARTS = 4
"""Parts of a step with laws that switch, which is long: extremes are those of a cubic in each part."""


class PeriodRecord:
    """Collects the pieces of one period; state lives here because the pieces come one by one."""

    def __init__(self, stepper: Stepper, harmonics: Harmonics) -> None:
        system = stepper.model.system
        self._stepper, self._harmonics, self._nc = stepper, harmonics, system.n_contacts
        self._n_motions = len(system.equations.rows)
        self._law_ports = system.laws.n_ports
        self._integral = np.zeros((harmonics.size, self._n_motions + 2 * self._nc))
        self._time_in_state = np.zeros((self._nc, len(State)))
        self.time_in_regime = [np.zeros(len(contact.regimes.names)) for contact in system.laws.switching]
        """Fractions of the period in the regimes of each contact whose law switches."""
        self.work = np.zeros(self._nc)
        """Energy a period / (2 pi) of each friction contact."""
        self.law_work = np.zeros(system.laws.n_ports)
        """Work along each port of other laws, likewise."""
        self.tau: list[float] = []
        self.changes: list[StateChange] = []
        self._values: list[Array] = []
        self._slopes: list[Array] = []
        self._widths: list[float] = []

    def add(self, item: Piece | StateChange) -> None:
        """Takes the next piece or state change."""
        if isinstance(item, StateChange):
            self.changes.append(item)
            return
        linear, step = item.linear, self._stepper.step
        rows, split = _recorded(linear)
        path = self._stepper.path(item)
        powers = self._stepper.extended_path(item) @ rows
        values, _, rates = np.split(
            np.vander(item.fraction * _NODES, len(path), increasing=True) @ powers, split, axis=1
        )
        width = item.fraction * step
        H = self._harmonics.H_plus(item.tau + width * _NODES) * (_WEIGHTS * width / np.pi)[:, None]
        self._integral += H.T @ values
        fx = values[:, self._n_motions : self._n_motions + self._nc]
        self.work += (_WEIGHTS * width / (2 * np.pi)) @ (fx * rates)
        if self._law_ports:
            z, model = np.vander(item.fraction * _NODES, len(path), increasing=True) @ path, self._stepper.model
            q, velocity, memory = model.law_motion(linear, z)
            forces = model.system.laws.rate(q, velocity, memory, linear.regimes)[0]
            self.law_work += (_WEIGHTS * width / (2 * np.pi)) @ (forces * velocity) / model.system.omega
        for j, state in enumerate(item.states[: self._nc]):
            self._time_in_state[j, state] += width / (2 * np.pi)
        for own, regime in zip(self.time_in_regime, linear.regimes, strict=True):
            own[regime] += width / (2 * np.pi)
        parts = _PARTS if linear.regimes else 1
        at = item.fraction * np.arange(parts + 1) / parts
        values, slopes, _ = np.split(np.vander(at, len(path), increasing=True) @ powers, split, axis=1)
        for k in range(parts):
            self.tau.append(item.tau + at[k] * step)
            self._widths.append(width / parts)
            self._values.append(values[k : k + 2])
            self._slopes.append(slopes[k : k + 2])

    @property
    def fractions(self) -> Array:
        """Fraction of the period in each ``State``, (n_contacts, 4)."""
        return self._time_in_state

    @property
    def coefficients(self) -> tuple[Array, Array, Array]:
        """Coefficients of the motions (n_rows, L), the friction and the normal forces (n_contacts, L)."""
        motions, fx, fy = np.split(self._integral.T, [self._n_motions, self._n_motions + self._nc])
        return motions, fx, fy

    def series(self) -> tuple[Array, Array, Array, Array]:
        """Phase (n,), motions (n, n_rows), friction and normal forces (n, n_contacts), at the starts of the pieces."""
        first = np.array([values[0] for values in self._values])
        motions, fx, fy = np.split(first, [self._n_motions, self._n_motions + self._nc], axis=1)
        return np.array(self.tau), motions, fx, fy

    def extremes(self) -> tuple[Array, Array]:
        """Smallest and largest value of each motion over the period, from the cubic of each piece."""
        values, slopes = np.array(self._values), np.array(self._slopes)
        return _extremes(np.array(self.tau), np.array(self._widths), values[:, :, : self._n_motions], slopes)[:2]


def _recorded(linear: LinearPiece) -> tuple[Array, list[int]]:
    """Columns times z, and where they are split: motions and forces, rates of the motions, rates of the contacts."""
    if "recorded" not in linear.cache:
        parts = [np.vstack([linear.motion, linear.fx, linear.fy]), linear.rates_of(linear.motion), linear.rate]
        split = np.cumsum([len(part) for part in parts])[:-1].tolist()
        linear.cache["recorded"] = np.ascontiguousarray(np.vstack(parts).T), split
    return linear.cache["recorded"]  # type: ignore[return-value]


@dataclass(kw_only=True)
class Energy:
    """Work done since the start, force x length; carried from period to period."""

    load: float = 0.0
    rubbing: float = 0.0
    """By the motion of the opposing surfaces."""
    damping: float = 0.0
    contact: float = 0.0
    """Dissipated by friction, and taken by contacts of other laws."""
    turned_over: float = 0.0
    """Sum of the magnitudes of all of it."""
    at_start: float = np.nan
    """Kinetic energy and that of springs, of the structure and of contacts."""

    def error(self, now: float) -> float:
        """Error of the energy balance, relative to all energy that was stored at the start or turned over."""
        balance = now - self.at_start - (self.load + self.rubbing - self.damping - self.contact)
        return abs(balance) / max(self.at_start + self.turned_over, 1e-300)


@dataclass(kw_only=True)
class PeriodSums:
    """Collects the pieces of one period.

    Parameters
    ----------
    stepper
        Source of the pieces.
    outputs
        Rows of the outputs among the motions.
    energy
        Sums over all periods so far; the period adds to it.
    """

    stepper: Stepper
    outputs: slice
    energy: Energy
    changes: list[StateChange] = field(default_factory=list)
    _pieces: list[tuple[float, float, Array, Array]] = field(default_factory=list)
    _length: float = 0.0
    _integral: Any = 0.0
    _work: Any = 0.0
    _law_work: Any = 0.0
    _in_state: Array | None = None
    _in_regime: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        switching = self.stepper.model.system.laws.switching
        self._in_regime = [np.zeros(len(contact.regimes.names)) for contact in switching]

    def add(self, item: Piece | StateChange) -> None:
        """Takes the next piece or change of state."""
        if isinstance(item, StateChange):
            self.changes.append(item)
            return
        path, step = self.stepper.extended_path(item), self.stepper.step
        width, reach = item.fraction * step, np.arange(len(path))
        powers = np.vander(item.fraction * _NODES, len(path), increasing=True)
        rising = reach[1:, None] * path[1:] / step
        z, slopes, weights = powers @ path, powers[:, :-1] @ rising, _WEIGHTS * width
        values, work, law_work = self._work_of(item, z, slopes, weights)
        self._length += width
        self._integral = self._integral + weights @ values
        self._work, self._law_work = self._work + work, self._law_work + law_work
        count = self.stepper.model.system.n_contacts
        if self._in_state is None:
            self._in_state = np.zeros((count, len(State)))
        self._in_state[np.arange(count), list(map(int, item.states[:count]))] += width
        for own, regime in zip(self._in_regime, item.linear.regimes, strict=True):
            own[regime] += width
        rows = item.linear.motion[self.outputs].T
        end = item.fraction**reach
        ends, rates = np.stack([path[0], end @ path]), np.stack([rising[0], end[:-1] @ rising])
        self._pieces.append((item.tau, width, ends @ rows, rates @ rows))

    def _work_of(self, item: Piece, z: Array, slopes: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Outputs at the nodes of a piece, and the work that contacts dissipate; adds to the energy.

        A contact dissipates its force times its velocity less that of its spring. The difference between the work that
        contacts take and the work that the structure gives is done by the motion of the opposing surfaces.
        """
        model, linear = self.stepper.model, item.linear
        system, energy = model.system, self.energy
        split, rows, moving = _rows(self.stepper, item.linear, self.outputs)
        outputs, p, resisted, columns, loads, force, rate = np.split(z @ rows, split, axis=1)
        contact = force.shape[1]
        driven = columns.shape[1] - loads.shape[1]
        load = float(weights @ np.sum(loads * columns[:, driven:], axis=1))
        damping = system.omega * float(weights @ np.sum(p * resisted, axis=1))
        work, law_work = np.zeros(system.n_contacts), np.zeros(0)
        taken = 0.0
        given = float(weights @ np.sum(force * columns[:, :contact], axis=1))
        if contact:
            nc, moved = system.n_contacts, slopes @ moving
            sides = np.concatenate([rate, moved[:, nc:]], axis=1)
            taken = float(weights @ np.sum(force * sides, axis=1))
            slipping = [j for j, state in enumerate(item.states[:nc]) if state in _SLIPPING and system.kt[j] > 0.0]
            if slipping:
                sliding = rate[:, slipping] - moved[:, slipping] / system.kt[slipping]
                work[slipping] = weights @ (force[:, slipping] * sliding)
        if system.laws:
            own = z[:, : system.size]
            law_force, velocity = model.law_forces(linear, own)[0], model.law_motion(linear, own)[1]
            law_work = weights @ (law_force * velocity) / system.omega
            given += float(weights @ np.sum(law_force * columns[:, contact:driven], axis=1))
            taken += float(law_work.sum())
        dissipated = float(work.sum() + law_work.sum())
        energy.load, energy.rubbing = energy.load + load, energy.rubbing + taken - given
        energy.damping, energy.contact = energy.damping + damping, energy.contact + dissipated
        energy.turned_over += abs(load) + abs(taken - given) + abs(damping) + abs(dissipated)
        return outputs, work, law_work

    def stored(self) -> float:
        """Kinetic energy and that of springs now."""
        system, z = self.stepper.model.system, self.stepper.z
        linear, equations = self.stepper.model(self.stepper.states), system.equations
        q, v = z[: system.n], system.omega * z[system.n : 2 * system.n]
        out = 0.5 * float(v @ equations.M @ v + q @ equations.K @ q)
        extended = self.stepper.model.extended(linear, z[None])[0]
        fx, fy = linear.fx @ extended, linear.fy @ extended
        stiff, pressed = system.kt > 0.0, system.has_normal & (system.kn > 0.0)
        out += 0.5 * float(np.sum(fx[stiff] ** 2 / system.kt[stiff]))
        return out + 0.5 * float(np.sum(fy[pressed] ** 2 / system.kn[pressed]))

    @property
    def work(self) -> Array:
        """Dissipated by each friction contact in the period, (n_contacts,)."""
        return np.asarray(self._work)

    @property
    def law_work(self) -> Array:
        """Work along each port of other laws, likewise."""
        return np.asarray(self._law_work)

    @property
    def mean(self) -> Array:
        """Mean of the outputs."""
        return np.asarray(self._integral / self._length)

    @property
    def fractions(self) -> Array:
        """Fraction of the period in each ``State``, (n_contacts, 4)."""
        assert self._in_state is not None
        return self._in_state / self._length

    @property
    def time_in_regime(self) -> list[Array]:
        """Fraction of the period in each regime, of every contact whose law switches."""
        return [own / self._length for own in self._in_regime]

    def extremes(self) -> tuple[Array, Array, Array, Array]:
        """Smallest and largest values (n_outputs,) of the outputs, and tau of each, from the cubic of each piece."""
        tau, widths, values, slopes = (np.array([piece[k] for piece in self._pieces]) for k in range(4))
        return _extremes(tau, widths, values, slopes)


def _extremes(tau: Array, widths: Array, values: Array, slopes: Array) -> tuple[Array, Array, Array, Array]:
    """Smallest and largest values (n,) over k pieces that begin at ``tau``, and the phase of each.

    ``values`` and ``slopes`` (k, 2, n) are those at the ends of each piece: between them stands a cubic.
    """
    tau, width = tau[:, None], widths[:, None]
    a, b = values[:, 0], values[:, 1]
    da, db = slopes[:, 0] * width, slopes[:, 1] * width
    c3, c2 = da + db - 2 * (b - a), 3 * (b - a) - 2 * da - db
    with np.errstate(all="ignore"):
        root = np.sqrt(np.maximum(c2**2 - 3 * c3 * da, 0.0))
        # the stable form of the root of 3 c3 s^2 + 2 c2 s + da that lies in (0, 1)
        s = np.where(da > 0, -da / (c2 - root), -da / (c2 + root))
    s = np.where((da * db < 0) & np.isfinite(s), s, 0.0)
    inner = a + s * (da + s * (c2 + s * c3))
    all_values = np.concatenate([a, inner, b])
    all_times = np.concatenate([np.broadcast_to(tau, a.shape), tau + s * width, np.broadcast_to(tau + width, a.shape)])
    low, high = all_values.argmin(axis=0), all_values.argmax(axis=0)
    d = np.arange(a.shape[1])
    return all_values[low, d], all_values[high, d], all_times[low, d], all_times[high, d]


def _rows(stepper: Stepper, linear: LinearPiece, outputs: slice) -> tuple[Array, Array, Array]:
    """Where the first columns times z are split, these columns, and those times dz/dtau.

    The first are outputs, velocities by tau, damping forces, velocities along the columns, loads, forces and rates of
    contacts. The others are friction forces and normal approaches.
    """
    if "sums" not in linear.cache:
        system = stepper.model.system
        equations, n, one = system.equations, system.n, system.n_dynamic
        width = linear.motion.shape[1]
        p = np.zeros((n, width))
        p[:, n : 2 * n] = np.eye(n)
        loads = np.zeros((len(system.loads), width))
        loads[:, one : system.size] = system.loads
        forces = np.vstack([linear.fx, linear.fy[system.has_normal]])
        parts = [linear.motion[outputs], p, equations.C @ p, equations.columns.T @ p, loads, forces, linear.rate]
        pressing = linear.motion[system.n_contacts : system.n_forces].copy()
        pressing[:, one : system.size] += system.approach[system.has_normal]
        split = np.cumsum([len(part) for part in parts])[:-1]
        linear.cache["sums"] = split, np.vstack(parts).T, np.vstack([linear.fx, pressing]).T
    return linear.cache["sums"]  # type: ignore[return-value]
