"""What a period of a long time integration amounts to: extremes, work, states, section; and energy over all periods."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slipstick.analysis.time_domain.event_integrator import Piece, StateChange, Stepper
from slipstick.analysis.time_domain.piecewise import LinearPiece, State
from slipstick.typing import Array

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2
_SLIPPING = (State.SLIP_PLUS, State.SLIP_MINUS)


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
        """What is missing in the balance, relative to all energy that was turned over."""
        balance = now - self.at_start - (self.load + self.rubbing - self.damping - self.contact)
        return abs(balance) / max(self.turned_over, 1e-300)


@dataclass(kw_only=True)
class PeriodSums:
    """Collects the pieces of one period.

    Parameters
    ----------
    stepper
        What makes them.
    outputs
        Rows of the outputs among the motions.
    energy
        Goes on over all periods.
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
        path, step = self.stepper.seen_path(item), self.stepper.step
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
        self._pieces.append((item.tau, width, ends @ rows, width * (rates @ rows)))

    def _work_of(self, item: Piece, z: Array, slopes: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Outputs at the nodes of a piece, and the work that contacts dissipate; adds to the energy.

        Contacts dissipate their force times the velocity of sliding beside that of their spring. What they take or give
        beside what the structure gives or takes is work of the opposing surfaces' motion.
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
        seen = self.stepper.model.seen(linear, z[None])[0]
        fx, fy = linear.fx @ seen, linear.fy @ seen
        stiff, pressed = system.kt > 0.0, system.has_normal & (system.kn > 0.0)
        out += 0.5 * float(np.sum(fx[stiff] ** 2 / system.kt[stiff]))
        return out + 0.5 * float(np.sum(fy[pressed] ** 2 / system.kn[pressed]))

    @property
    def work(self) -> Array:
        """Dissipated by each friction contact in the period, (n_contacts,)."""
        return np.asarray(self._work)

    @property
    def law_work(self) -> Array:
        """The same along each port of other laws."""
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
        tau, width = (np.array([piece[k] for piece in self._pieces])[:, None] for k in (0, 1))
        values, slopes = (np.array([piece[k] for piece in self._pieces]) for k in (2, 3))
        a, b, da, db = values[:, 0], values[:, 1], slopes[:, 0], slopes[:, 1]
        c3, c2 = da + db - 2 * (b - a), 3 * (b - a) - 2 * da - db
        with np.errstate(all="ignore"):
            root = np.sqrt(np.maximum(c2**2 - 3 * c3 * da, 0.0))
            # the stable form of the root of 3 c3 s^2 + 2 c2 s + da that lies in (0, 1)
            s = np.where(da > 0, -da / (c2 - root), -da / (c2 + root))
        s = np.where((da * db < 0) & np.isfinite(s), s, 0.0)
        inner = a + s * (da + s * (c2 + s * c3))
        all_values = np.concatenate([a, inner, b])
        all_times = np.concatenate(
            [np.broadcast_to(tau, a.shape), tau + s * width, np.broadcast_to(tau + width, a.shape)]
        )
        low, high = all_values.argmin(axis=0), all_values.argmax(axis=0)
        d = np.arange(a.shape[1])
        return all_values[low, d], all_values[high, d], all_times[low, d], all_times[high, d]


def _rows(stepper: Stepper, linear: LinearPiece, outputs: slice) -> tuple[Array, Array, Array]:
    """What is looked at along a piece, as columns times z: where it is split into outputs, velocities by tau, damping,
    velocities along the columns, loads, forces and rates of contacts; and forces and pressing of contacts, whose
    derivatives are looked at."""
    if "looked at" not in linear.cache:
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
        linear.cache["looked at"] = split, np.vstack(parts).T, np.vstack([linear.fx, pressing]).T
    return linear.cache["looked at"]  # type: ignore[return-value]
