"""A structure with friction contacts as a piecewise linear system, one linear system per combination of contact states.

Time is ``tau = omega t``. The state vector is ``z = [q, dq/dtau, e, 1, cos m_1 tau, sin m_1 tau, ...]``: with the
forcing as part of it, every combination has ``dz/dtau = A z``, and all forces, motions and switching functions are rows
times ``z``. ``e`` (one entry a contact) is the memory of a stuck friction spring: ``f_x = kt (x + u_p) + e`` with
``de/dtau = kt v`` (THEORY.md (12.1), (12.2)). A massless feedthrough (static residual) makes the motion depend on the
forces at once: both are solved for together, exactly, in each combination.

This module shares no code with ``slipstick.contact``, as it serves to check the harmonic solutions. Contacts of other
laws enter by their ``rate``, which adds to ``dz/dtau``: a combination of friction states then has a smooth system
instead of a linear one. Their memory follows ``e`` in z. Laws that switch have a rate in each of their regimes, and
their regimes are part of the combination.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from slipstick.analysis.time_domain.kernel.steps import Rates
from slipstick.analysis.time_domain.law_in_time import (
    LawsInTime,
    PortMotion,
    RegimeNumbers,
    force_rate,
    port_motion,
    port_slopes,
)
from slipstick.errors import InputError
from slipstick.structure.protocol import TimeEquations
from slipstick.typing import Array

Combination = tuple["State | int", ...]
"""States of the friction contacts, then the regimes of the contacts whose law switches."""


class State(IntEnum):
    """State of one contact."""

    SEPARATION = 0
    STICK = 1
    SLIP_PLUS = 2
    SLIP_MINUS = 3

    @property
    def text(self) -> str:
        """The name used in results."""
        return ("separation", "stick", "slip+", "slip-")[self]


@dataclass(frozen=True, kw_only=True)
class FrictionSystem:
    """Structure, contacts and forcing at one frequency.

    Rows of ``equations`` are: tangential motion of each friction contact, normal motion of those that have one, ports
    of other laws, outputs. Columns are: tangential forces, normal forces, those of other laws, loads. Coefficients are
    ordered (0, c, s, c, s, ...) over ``orders``.

    Parameters
    ----------
    equations
        Equations of motion in time (t, not tau).
    omega
        Fundamental frequency, rad/s.
    kt, mu, kn, velocity
        Contact parameters, (n_contacts,); velocity in length/time.
    approach
        Normal motion of the opposing surface less the gap, (n_contacts, 1 + 2 len(orders)).
    has_normal
        (n_contacts,) of bool; False means that the structure does not move along the normal.
    orders
        Nonzero harmonic orders of loads and of rubbing motions.
    rubbing
        Periodic rubbing motion, (n_contacts, 1 + 2 len(orders)).
    loads
        Loads, (n_loads, 1 + 2 len(orders)).
    laws
        Contacts of other laws.
    law_motion, law_velocity
        Motion of the opposing surface along their ports, (n, 1 + 2 len(orders)), and its constant velocity, (n,).
    """

    equations: TimeEquations
    omega: float
    kt: Array
    mu: Array
    kn: Array
    approach: Array
    velocity: Array
    has_normal: NDArray[np.bool_]
    orders: tuple[int, ...]
    rubbing: Array
    loads: Array
    laws: LawsInTime = field(default_factory=lambda: LawsInTime(()))
    law_motion: Array = field(default_factory=lambda: np.zeros((0, 0)))
    law_velocity: Array = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def n(self) -> int:
        """Coordinates of the structure."""
        return len(self.equations.M)

    @cached_property
    def n_contacts(self) -> int:
        """Friction contacts."""
        return len(self.kt)

    @cached_property
    def varies(self) -> NDArray[np.bool_]:
        """Whether the normal load of each contact varies, so that it can separate."""
        return self.has_normal | np.any(self.approach[:, 1:] != 0, axis=1)

    @cached_property
    def n_dynamic(self) -> int:
        """Entries of z that are unknown: q, dq/dtau, e, memory of other laws."""
        return 2 * self.n + self.n_contacts + self.laws.n_memory

    @cached_property
    def memory(self) -> slice:
        """Places in z of the memory of other laws."""
        return slice(2 * self.n + self.n_contacts, self.n_dynamic)

    def unknowns(self, states: Combination, changing: Collection[int] | None = None) -> list[int]:
        """Free entries of z of a motion in these states.

        With ``changing``, the contacts that change their state (numbered as in ``states``), the memory of contacts
        stuck all period is left out.
        """
        nc, laws = self.n_contacts, self.laws
        stuck = [2 * self.n + j for j, state in enumerate(states[:nc]) if state is State.STICK]
        which = None
        if changing is not None:
            stuck = [e for e in stuck if e - 2 * self.n in changing]
            which = [
                k for k, (own, regime) in enumerate(zip(laws.switching, states[nc:], strict=True))
                if nc + k in changing or regime not in own.regimes.neutral
            ]  # fmt: skip
        memory = [self.memory.start + row for row in laws.remembered(tuple(states[nc:]), which)]
        return [*range(2 * self.n), *stuck, *memory]

    @cached_property
    def n_forces(self) -> int:
        """Forces of friction contacts, tangential and normal."""
        return self.n_contacts + int(self.has_normal.sum())

    @cached_property
    def size(self) -> int:
        """Length of z."""
        return self.n_dynamic + len(self.forcing_rates)

    @cached_property
    def forcing_rates(self) -> Array:
        """``d forcing/dtau`` as a matrix times the forcing."""
        out = np.zeros((1 + 2 * len(self.orders),) * 2)
        for k, m in enumerate(self.orders):
            out[1 + 2 * k, 2 + 2 * k], out[2 + 2 * k, 1 + 2 * k] = -m, m
        return out

    @property
    def sliding(self) -> Array:
        """Constant velocity of rubbing per unit of tau, as rows times the forcing, (n_contacts, n_forcing)."""
        out = np.zeros((self.n_contacts, 1 + 2 * len(self.orders)))
        out[:, 0] = self.velocity / self.omega
        return out

    @property
    def law_speed(self) -> Array:
        """Velocity of the opposing surface along the ports of other laws, as rows times the forcing, length/time."""
        out = self.omega * (self.law_motion @ self.forcing_rates)
        out[:, 0] += self.law_velocity
        return np.asarray(out)

    def time_of_phase(self, phase: float) -> float:
        """tau at which the excitation has turned by a phase, rad."""
        return phase

    def forcing(self, tau: float) -> Array:
        """The last entries of z: 1, cos m tau, sin m tau, ..."""
        return self.forcings(np.array([tau]))[0]

    def forcings(self, tau: Array) -> Array:
        """``forcing`` at phases (k,), (k, n_forcing)."""
        out = np.ones((len(tau), 1 + 2 * len(self.orders)))
        angle = np.outer(tau, np.asarray(self.orders, dtype=float))
        out[:, 1::2], out[:, 2::2] = np.cos(angle), np.sin(angle)
        return out


@dataclass(frozen=True, kw_only=True)
class Switch:
    """A function of z that is positive while a state lasts, and the state after its sign change."""

    contact: int
    target: State | None
    """None where contact begins, in stick or slip."""


@dataclass(kw_only=True)
class LinearPiece:
    """The linear system of one combination of states; all quantities are rows times z.

    Where the structure answers contacts of other laws at once, rows multiply ``PiecewiseLinear.extended`` instead: z,
    then their forces and the rates of these.
    """

    A: Array
    motion: Array
    """Tangential, normal and output motions."""
    fx: Array
    fy: Array
    rate: Array
    """``d(x + u)/dtau`` of each contact."""
    switches: tuple[Switch, ...]
    margins: Array
    """Rows of the switching functions."""
    acting: Array
    """Forces on the columns of the structure: of friction contacts, with their sign, and loads."""
    law_rows: Array
    """Motion at the ports of other laws without their own forces, and its velocity: rows times z alone."""
    law_speed: Array
    law_columns: Array
    """Rates of z by their forces, (size, P)."""
    residual: Array | None = None
    """Static compliance of the ports to these forces, (P, P)."""
    regimes: RegimeNumbers = ()
    """Regimes of the contacts whose law switches."""
    smooth: bool = False
    """Whether other laws add nonlinear terms to ``A z``."""
    cache: dict[str, object] = field(default_factory=dict)

    @property
    def is_extended(self) -> bool:
        """Whether rows multiply the extended z."""
        return self.motion.shape[1] > len(self.A)

    def rates_of(self, rows: Array) -> Array:
        """Rows of the rates by tau of quantities that depend neither on velocities nor on rates of forces."""
        size = len(self.A)
        if not self.is_extended:
            return rows @ self.A
        by_force = rows[..., size : (size + rows.shape[-1]) // 2]
        return np.concatenate([rows[..., :size] @ self.A, np.zeros_like(by_force), by_force], axis=-1)


class PiecewiseLinear:
    """Builds the linear system of each combination of states, once.

    Raises
    ------
    InputError
        If the mass matrix is singular.
    """

    def __init__(self, system: FrictionSystem) -> None:
        self.system = system
        self._systems: dict[Combination, LinearPiece] = {}
        equations = system.equations
        try:
            solved = np.linalg.solve(equations.M, np.hstack([equations.K, equations.C, equations.columns]))
        except np.linalg.LinAlgError:
            raise InputError(
                "time integration: the mass matrix is singular; give every degree of freedom a mass"
            ) from None
        n = system.n
        self._K, self._C, self._columns = np.split(solved, [n, 2 * n], axis=1)
        self._normal_of = np.cumsum(system.has_normal) - 1
        self._check_laws()

    def _check_laws(self) -> None:
        """Sets whether the structure answers forces of other laws at once, which is possible for laws that switch."""
        s = self.system
        first, through = s.n_forces, s.equations.feedthrough
        at = slice(first, first + s.laws.n_ports)
        self.at_once = bool(np.any(through[:, at]))
        reached = np.any(through[at, : at.stop], axis=1) | np.any(through[:, at], axis=0)
        for law, ports, *_ in s.laws.each:
            if law.law.regimes is None and np.any(reached[ports]):
                raise InputError(
                    f"time integration: contacts of {type(law.law).__name__} act on a static residual of "
                    "the structure, where only friction contacts can be integrated in time; "
                    "give the structure more modes and no residual"
                )

    def law_motion(self, linear: LinearPiece, z: Array) -> tuple[Array, Array, Array]:
        """Motion, velocity (k, P) and memory (k, m) of the contacts of other laws at states (k, size)."""
        if linear.residual is not None:
            at_ports = self._port_motion(linear, z)
            return at_ports.q, at_ports.velocity, z[:, self.system.memory]
        return z @ linear.law_rows.T, z @ linear.law_speed.T, z[:, self.system.memory]

    def _port_motion(self, linear: LinearPiece, z: Array) -> PortMotion:
        given, R = (z @ linear.law_rows.T, z @ linear.law_speed.T, z[:, self.system.memory]), linear.residual
        assert R is not None
        return port_motion(self.system.laws, R, *given, linear.regimes)

    def law_forces(self, linear: LinearPiece, z: Array) -> tuple[Array, Array]:
        """Their forces (k, P) and rates of their memory (k, m), per unit of time."""
        if linear.residual is not None:
            at_ports = self._port_motion(linear, z)
            return at_ports.forces, at_ports.rates
        return self.system.laws.rate(*self.law_motion(linear, z), linear.regimes)

    def law_slopes(self, linear: LinearPiece, z: Array) -> tuple[Array, ...]:
        """Derivatives by z, (k, ..., size): of motion, velocity and forces, rates of the memory and of the forces.

        Rates are per unit of time; those of the forces are computed only where the structure answers them at once.
        """
        given = np.concatenate([linear.law_rows, linear.law_speed, np.eye(self.system.size)[self.system.memory]])
        return port_slopes(self.system.laws, linear.residual, given, *self.law_motion(linear, z), linear.regimes)

    def rate(self, linear: LinearPiece, z: Array) -> Array:
        """``dz/dtau`` at states (k, size)."""
        out = np.asarray(z @ linear.A.T, dtype=float)
        if linear.smooth:
            forces, rates = self.law_forces(linear, z)
            out += forces @ linear.law_columns.T
            out[:, self.system.memory] += rates / self.system.omega
        return out

    def rate_slopes(self, linear: LinearPiece, z: Array) -> Array:
        """Its derivatives by z, (k, size, size)."""
        s = self.system
        _, _, force, rate, _ = self.law_slopes(linear, z)
        out = linear.A + linear.law_columns @ force
        out[:, s.memory] += rate / s.omega
        return np.asarray(out, dtype=float)

    def extended(self, linear: LinearPiece, z: Array) -> Array:
        """The vectors that the rows of a piece multiply, at states (k, size)."""
        if not linear.is_extended:
            return z
        at_ports, memory = self._port_motion(linear, z), z[:, self.system.memory]
        rate = force_rate(self.system.laws, at_ports.q, at_ports.velocity, memory, linear.regimes, at_ports.rates)
        return np.hstack([z, at_ports.forces, rate / self.system.omega])

    def gradient(self, linear: LinearPiece, rows: Array, z: Array) -> Array:
        """Derivatives by z, (..., size), of quantities given by rows of a piece, at one state (size,)."""
        if not linear.is_extended:
            return rows
        *_, force, _, rate = self.law_slopes(linear, z[None])
        slopes = np.concatenate([np.eye(self.system.size), force[0], rate[0] / self.system.omega])
        return np.asarray(rows @ slopes, dtype=float)

    def __call__(self, states: Combination) -> LinearPiece:
        """The linear system of a combination."""
        if states not in self._systems:
            friction, regimes = states[: self.system.n_contacts], states[self.system.n_contacts :]
            self._systems[states] = self._switched(self(friction), regimes) if regimes else self._build(friction)
        return self._systems[states]

    def _switched(self, linear: LinearPiece, regimes: RegimeNumbers) -> LinearPiece:
        """The system with laws that switch in some regimes; it is linear where these are."""
        laws, one = self.system.laws, self.system.n_dynamic
        piece = replace(linear, regimes=regimes, cache={})
        if len(laws.switching) == laws.count and all(
            regime in contact.regimes.linear for contact, regime in zip(laws.switching, regimes, strict=True)
        ):
            nothing = np.zeros((1, self.system.size))
            A = self.rate_slopes(piece, nothing)[0]
            A[:, one] += self.rate(piece, nothing)[0]
            if piece.is_extended:
                constant = self.extended(piece, nothing)[0]

                def linear_rows(rows: Array) -> Array:
                    out = self.gradient(piece, rows, nothing[0])
                    out[:, one] += rows @ constant
                    return out

                old = piece.motion, piece.fx, piece.fy, piece.rate, piece.margins
                piece.motion, piece.fx, piece.fy, piece.rate, piece.margins = map(linear_rows, old)
            piece.A, piece.smooth = A, False
        return piece

    @cached_property
    def modal_rates(self) -> tuple[Array, Array] | None:
        """Stiffness and damping (n,) per unit of tau where the coordinates are modes; None where they are coupled."""
        own = np.diag(self._K), np.diag(self._C)
        if not all(np.array_equal(part, np.diag(d)) for part, d in zip((self._K, self._C), own, strict=True)):
            return None
        return own[0] / self.system.omega**2, own[1] / self.system.omega

    @cached_property
    def loaded_columns(self) -> Array:
        """Accelerations per unit of tau by the forces ``LinearPiece.acting``, (n, n_forces)."""
        s = self.system
        loaded = s.n_forces + s.laws.n_ports
        return np.hstack([self._columns[:, : s.n_forces], self._columns[:, loaded:]]) / s.omega**2

    def rates(self, linear: LinearPiece) -> Rates:
        """``dz/dtau`` of a linear system as compiled code takes it."""
        if "rates" not in linear.cache:
            s = self.system
            n, own, acting = s.n, self.modal_rates, linear.acting
            K, C = (self._K / s.omega**2, self._C / s.omega) if own is None else (own[0][None], own[1][None])
            parts = (K, C, self.loaded_columns.T, acting[:, :n], acting[:, 2 * n :], linear.A[2 * n :, 2 * n :])
            linear.cache["rates"] = Rates._make(map(np.ascontiguousarray, parts))
        return linear.cache["rates"]  # type: ignore[return-value]

    def law_rows_of(self, linear: LinearPiece, number: int, z: Array) -> Array:
        """Derivatives of motion, velocities and memory of one contact whose law switches by z (size,).

        (2 n_ports + n_memory, size).
        """
        contact = self.system.laws.switching[number]
        motion, velocity, *_ = self.law_slopes(linear, z[None])
        remembered = np.eye(self.system.size)[self.system.memory][contact.memory]
        return np.concatenate([motion[0, contact.ports], velocity[0, contact.ports], remembered])

    def _laws(self, states: Combination) -> tuple[Array, Array]:
        """Contact forces (tangential, then the normal ones) as ``S motion + T z``."""
        s = self.system
        nc, nn = s.n_contacts, int(s.has_normal.sum())
        S, T = np.zeros((nc + nn, nc + nn)), np.zeros((nc + nn, s.size))
        one = s.n_dynamic
        for j, state in enumerate(states):
            normal = nc + self._normal_of[j] if s.has_normal[j] else None
            if state is State.SEPARATION:
                continue
            if normal is not None:
                S[normal, normal] = s.kn[j]
                T[normal, one:] = s.kn[j] * s.approach[j]
            if state is State.STICK:
                S[j, j], T[j, 2 * s.n + j] = s.kt[j], 1.0
                T[j, one:] = s.kt[j] * s.rubbing[j]
            else:
                sign = 1.0 if state is State.SLIP_PLUS else -1.0
                if normal is not None:
                    S[j, normal] = sign * s.mu[j] * s.kn[j]
                T[j, one:] = sign * s.mu[j] * s.kn[j] * s.approach[j]
        return S, T

    def _build(self, states: Combination) -> LinearPiece:
        s = self.system
        n, nc, one, sliding = s.n, s.n_contacts, s.n_dynamic, s.sliding
        S, T = self._laws(states)
        n_forces, loaded = len(S), len(S) + s.laws.n_ports
        at, forced = slice(n_forces, loaded), slice(one, s.size)
        load = np.zeros((len(s.loads), s.size))
        load[:, one:] = s.loads
        D = s.equations.feedthrough
        free = np.zeros((len(s.equations.rows), s.size))
        free[:, :n] = s.equations.rows
        free += D[:, loaded:] @ load
        coupled = np.eye(n_forces) + S @ D[:n_forces, :n_forces]
        forces = np.asarray(np.linalg.solve(coupled, S @ free[:n_forces] + T), dtype=float)
        motion = free - D[:, :n_forces] @ forces
        by_law = -np.linalg.solve(coupled, S @ D[:n_forces, at])  # forces of friction contacts by those of other laws
        moved_by_law = -D[:, at] - D[:, :n_forces] @ by_law

        A = np.zeros((s.size, s.size))
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, :n] = -self._K / s.omega**2
        A[n : 2 * n, n : 2 * n] = -self._C / s.omega
        acting = np.vstack([-forces, load])
        A[n : 2 * n] += self._columns[:, :n_forces] @ -forces / s.omega**2
        A[n : 2 * n] += self._columns[:, loaded:] @ load / s.omega**2
        for j in range(nc):
            if states[j] is State.STICK:
                A[2 * n + j, one:] = s.kt[j] * sliding[j]
        A[one:, one:] = s.forcing_rates

        law_rows, law_columns = motion[at].copy(), np.zeros((s.size, s.laws.n_ports))
        law_speed = s.omega * law_rows @ A
        if s.laws:
            law_rows[:, forced] += s.law_motion
            law_speed[:, forced] += s.law_speed
        law_columns[n : 2 * n] = -(self._columns[:, at] + self._columns[:, :n_forces] @ by_law) / s.omega**2
        if self.at_once:
            motion, forces = (
                np.hstack([rows, by, np.zeros_like(by)]) for rows, by in ((motion, moved_by_law), (forces, by_law))
            )

        total = motion[:nc].copy()
        total[:, forced] += s.rubbing
        fy = np.zeros_like(total)
        for j in range(nc):
            if s.has_normal[j]:
                fy[j] = forces[nc + self._normal_of[j]]
            elif states[j] is not State.SEPARATION:
                fy[j, forced] = s.kn[j] * s.approach[j]
        linear = LinearPiece(
            A=A, motion=motion, fx=forces[:nc], fy=fy, rate=total, switches=(),
            margins=np.zeros((0, total.shape[1])), acting=acting, law_rows=law_rows, law_speed=law_speed,
            law_columns=law_columns, residual=-moved_by_law[at] if self.at_once else None, smooth=bool(s.laws),
        )  # fmt: skip
        linear.rate = linear.rates_of(total)
        linear.rate[:, forced] += sliding
        self._add_switches(states, linear)
        return linear

    def _add_switches(self, states: Combination, linear: LinearPiece) -> None:
        s, varies, frictional = self.system, self.system.varies, self.frictional
        switches, rows = [], []
        limits = s.mu[:, None] * linear.fy
        limit_rates = linear.rates_of(limits)
        for j, state in enumerate(states):
            opening = np.zeros(linear.motion.shape[1])
            if s.has_normal[j]:
                opening = linear.motion[s.n_contacts + self._normal_of[j]].copy()
            opening[s.n_dynamic : s.size] += s.approach[j]
            if state is State.SEPARATION and varies[j]:
                switches.append(Switch(contact=j, target=None))
                rows.append(-opening)
            if state is State.SEPARATION:
                continue
            if varies[j]:
                switches.append(Switch(contact=j, target=State.SEPARATION))
                rows.append(opening)
            if not frictional[j]:
                continue
            limit = limits[j]
            if state is State.STICK:
                switches += [Switch(contact=j, target=State.SLIP_PLUS), Switch(contact=j, target=State.SLIP_MINUS)]
                rows += [limit - linear.fx[j], limit + linear.fx[j]]
            else:
                sign = 1.0 if state is State.SLIP_PLUS else -1.0
                switches.append(Switch(contact=j, target=State.STICK))
                rows.append(sign * s.kt[j] * linear.rate[j] - limit_rates[j])
        linear.switches = tuple(switches)
        linear.margins = np.array(rows) if rows else linear.margins

    @property
    def frictional(self) -> NDArray[np.bool_]:
        """Contacts with friction; the others carry no tangential force."""
        s = self.system
        return (s.mu > 0) & (s.kt > 0) & (s.kn > 0)

    def without_friction(self, contact: int) -> State:
        """The state whose law gives no tangential force where there is no friction."""
        return State.STICK if self.system.kt[contact] == 0 else State.SLIP_PLUS

    def fastest(self) -> float:
        """Largest eigenvalue magnitude of the free and of the fully stuck system, per unit of tau."""
        s = self.system
        radius = 1.0
        for state in (State.SEPARATION, State.STICK):
            states = tuple(state if s.varies[j] or state else State.SLIP_PLUS for j in range(s.n_contacts))
            linear, free = self._build(states), slice(0, 2 * s.n)
            linear.regimes = tuple(contact.regimes.fastest for contact in s.laws.switching)
            A = self.rate_slopes(linear, np.zeros((1, s.size)))[0] if s.laws else linear.A
            radius = max(radius, float(np.abs(np.linalg.eigvals(A[free, free])).max(initial=0.0)))
        return max(radius, *s.orders, 1)
