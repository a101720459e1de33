"""Initial states of a time integration: rest, the equilibrium of a preload, or a given periodic motion of contacts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slipstick.analysis.time_domain.equilibrium import Equilibrium
from slipstick.analysis.time_domain.event_integrator import Stepper, replaced, spring_memory
from slipstick.analysis.time_domain.law_in_time import LawInTime, LawsInTime, port_motion
from slipstick.analysis.time_domain.piecewise import Combination, FrictionSystem, State
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import AnyArray, Array

_SAMPLES, _LAPS = 2048, 3
"""Samples of a period at which forces along a given motion are marched, and periods until those of laws that switch
repeat. A start need not be exact."""

_ALMOST_SLIPPING = 1e-6
"""A friction force is at its limit when it is closer, relative to that."""

_ROUNDS, _SWEEPS = 3, 30
"""Repetitions until regimes and velocities agree, and until memories of coupled contacts do."""

_STEPS, _PERIODS, _SAME = 64, 20, 1e-3
"""Steps a period and most periods in which the memory of a law becomes periodic, and its relative change then."""


_LONGEST_NEWTON, _SETTLED = 20, 1e-15
"""Most iterations until the structure is in balance, and the last correction, over its motion, that is rounding."""


@dataclass(frozen=True, kw_only=True)
class HarmonicStart:
    """Periodic relative motion of each contact, as a branch point holds it.

    ``tangential`` and ``normal`` are (n, L), without the rubbing motion; ``normal`` of a contact with constant
    normal load is not used. Both have a row for every friction contact; ``ports`` is the motion at the ports of
    contacts of other laws, (n, L) in the order of ``LawsInTime``.
    """

    harmonics: Harmonics
    tangential: Array
    normal: Array
    ports: Array | None = None
    mean_force: Array | None = None
    """Mean forces along them (n,): of contacts that settle on no force of their own."""
    friction: Array | None = None
    """Mean friction forces (n,) of friction contacts that stick all period; nan: the middle of what is admissible."""


def started(stepper: Stepper, start: HarmonicStart | Equilibrium | None) -> tuple[Array, Combination]:
    """State and contact states with which an integration begins; None is rest."""
    if start is None:
        return start_at_rest(stepper)
    if isinstance(start, HarmonicStart):
        return start_from_motion(stepper, start)
    return start_from_equilibrium(stepper, start)


def start_at_rest(stepper: Stepper) -> tuple[Array, Combination]:
    """No displacement, no velocity, springs without force; contacts touch where their gap is closed."""
    system = stepper.model.system
    closed = system.approach @ system.forcing(0.0) > 0
    states: Combination = tuple(State.STICK if touching else State.SEPARATION for touching in closed)
    z = np.zeros(system.size)
    z[system.n_dynamic :] = system.forcing(0.0)
    return with_forces(stepper, z, states, np.zeros(system.n_contacts))


def start_from_equilibrium(stepper: Stepper, start: Equilibrium) -> tuple[Array, Combination]:
    """The structure in balance with contacts that stick with the forces of an equilibrium, as far as they are closed.

    The balance is solved for once more by the equations in time, so that nothing moves until something acts. Loads and
    prescribed motions that vary set in suddenly, and contacts answer that at once.
    """
    model, system = stepper.model, stepper.model.system
    n, laws, z = system.n, system.laws, np.zeros(system.size)
    z[system.n_dynamic] = 1.0
    states: list[State | int] = []
    for j in range(system.n_contacts):
        stuck = State.STICK if model.frictional[j] else model.without_friction(j)
        states.append(stuck if start.normal[j] > 0.0 else State.SEPARATION)
        if states[j] is State.STICK:
            z[2 * n + j] = start.friction[j] - system.kt[j] * start.tangential[j]
    still = start.ports[None], np.zeros((1, laws.n_ports)), np.zeros((1, laws.n_memory))
    for own in laws.switching:
        (regime,), memory = own.regimes.begin(start.forces[own.ports, None], own.at(*still))
        z[system.memory.start + own.memory] = memory[:, 0]
        states.append(int(regime))
    combination = tuple(states)
    linear = model(combination)
    for _ in range(_LONGEST_NEWTON):
        missing = model.rate(linear, z[None])[0][n : 2 * n]
        A = model.rate_slopes(linear, z[None])[0] if linear.smooth else linear.A
        step = _solution(A[n : 2 * n, :n], -missing)
        z[:n] += step
        if np.abs(step).max(initial=0.0) <= _SETTLED * np.abs(z[:n]).max(initial=0.0):
            break
    z[system.n_dynamic :] = system.forcing(0.0)
    return _admissible(stepper, z, combination)


def _admissible(stepper: Stepper, z: Array, combination: Combination) -> tuple[Array, Combination]:
    """Contacts closed where they touch, and with the friction forces that they have in z, up to their limits."""
    model, system = stepper.model, stepper.model.system
    linear, states = model(combination), list(combination)
    extended, others = model.extended(linear, z[None])[0], model.law_forces(linear, z[None])[0][0]
    y = system.approach @ z[system.n_dynamic :]
    y[system.has_normal] += linear.motion[system.n_contacts : system.n_forces] @ extended
    limit = system.mu * system.kn * np.maximum(y, 0.0)
    for j in range(system.n_contacts):
        if y[j] <= 0.0:
            states[j] = State.SEPARATION
        elif states[j] is State.SEPARATION:
            states[j] = State.STICK
    fx = np.clip(linear.fx @ extended, -limit, limit)
    return with_forces(stepper, z, tuple(states), fx, others)


def start_from_motion(stepper: Stepper, start: HarmonicStart) -> tuple[Array, Combination]:
    """The structure's answer to the contact forces that go with a periodic motion of the contacts."""
    system, model = stepper.model.system, stepper.model
    y_g, fx, fy = sampled_forces(system, start)
    z = np.zeros(system.size)
    z[system.n_dynamic :] = system.forcing(0.0)
    others, z[system.memory] = law_forces(system, start)
    z[: system.n], z[system.n : 2 * system.n] = _answer(system, fx, fy, others)
    limit = system.mu * fy[:, 0]
    states: list[State] = []
    for j in range(system.n_contacts):
        if y_g[j, 0] <= 0:
            states.append(State.SEPARATION)
        elif not model.frictional[j]:
            states.append(model.without_friction(j))
        elif abs(fx[j, 0]) < limit[j] * (1 - _ALMOST_SLIPPING):
            states.append(State.STICK)
        else:
            states.append(State.SLIP_PLUS if fx[j, 0] > 0 else State.SLIP_MINUS)
    return with_forces(stepper, z, tuple(states), fx[:, 0], others[:, 0])


def with_forces(
    stepper: Stepper, z: Array, states: Combination, fx: Array, others: Array | None = None
) -> tuple[Array, Combination]:
    """Sets the memory of contacts so that friction forces are ``fx``, and the regimes of contacts whose law switches.

    Regimes follow from the forces ``others`` (n_ports,), zero by default.

    With a feedthrough contacts act on each other: the memories follow one after another until they agree.
    """
    model, laws = stepper.model, stepper.model.system.laws
    states = states[: model.system.n_contacts]
    for j, state in enumerate(states):
        if not model.frictional[j] and state is not State.SEPARATION:
            states = replaced(states, j, model.without_friction(j))
    force = np.zeros(laws.n_ports) if others is None else others
    combination = states
    for _ in range(_ROUNDS if model.at_once and laws.switching else 1):
        combination, wanted = _with_regimes(stepper, z, states, force)
        _remember(stepper, z, combination, fx, wanted)
    return z, combination


def _with_regimes(stepper: Stepper, z: Array, states: Combination, force: Array) -> tuple[Combination, list[Array]]:
    """Puts contacts whose law switches into the regimes of their forces; the forces that they have there."""
    model, laws, memory = stepper.model, stepper.model.system.laws, stepper.model.system.memory
    linear, regimes, wanted = model(states), [], []
    motion = (z[None] @ linear.law_rows.T, z[None] @ linear.law_speed.T, z[None, memory])
    if laws.switching and linear.residual is not None:
        moved, none = motion[0] - force @ linear.residual.T, np.zeros((1, laws.n_memory))
        first = [own.regimes.begin(force[own.ports, None], own.at(moved, *motion[1:]))[0] for own in laws.switching]
        # the velocity of sticking decides whether it slips
        closed = [
            own.regimes.fastest if own.regimes.memory_used[int(regime[0])] else int(regime[0])
            for own, regime in zip(laws.switching, first, strict=True)
        ]
        motion = moved, port_motion(laws, linear.residual, motion[0], motion[1], none, tuple(closed)).velocity, none
    for own in laws.switching:
        at = own.at(*motion)
        (regime,), memory_rows = own.regimes.begin(force[own.ports, None], at)
        z[memory.start + own.memory] = memory_rows[:, 0]
        regimes.append(int(regime))
        wanted.append(own.regimes.force_and_slopes(int(regime), at._replace(memory=memory_rows[:, :, None]))[0])
    return (*states, *regimes), wanted


def _remember(stepper: Stepper, z: Array, states: Combination, fx: Array, wanted: list[Array]) -> None:
    """Writes the memory that goes with forces of friction contacts and of those whose law switches."""
    model, system = stepper.model, stepper.model.system
    stuck = [j for j in range(system.n_contacts) if states[j] is State.STICK and model.frictional[j]]
    linear = model(states)
    for _ in range(_SWEEPS):
        for j in stuck:
            z[2 * system.n + j] = spring_memory(model, states, j, z, float(fx[j]))
        if linear.residual is None:
            continue
        motion = model.law_motion(linear, z[None])
        for own, regime, force in zip(system.laws.switching, linear.regimes, wanted, strict=True):
            z[system.memory.start + own.memory] = own.regimes.memory_of(regime, force, own.at(*motion))[:, 0, 0]


def sampled_forces(system: FrictionSystem, start: HarmonicStart) -> tuple[Array, Array, Array]:
    """Normal approach, friction and normal force over one period, each (n_contacts, samples), marched from sample to
    sample from the limits of the friction force (enough for a start: the integration itself is exact)."""
    tau = 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    H = start.harmonics.H_minus(tau)
    H_u = Harmonics((0, *system.orders)).H_minus(tau)
    w = start.tangential @ H.T + system.rubbing @ H_u.T
    y_g = np.where(system.has_normal[:, None], start.normal @ H.T, 0.0) + system.approach @ H_u.T
    fy = system.kn[:, None] * np.maximum(y_g, 0.0)
    b = np.where(y_g > 0, system.mu[:, None] * fy, 0.0)
    v = system.velocity / system.omega
    increments = system.kt[:, None] * (np.roll(w, -1, axis=1) - w + (v * 2 * np.pi / _SAMPLES)[:, None])

    def march(f: Array) -> Array:
        path = np.empty((len(f), _SAMPLES + 1))
        for i in range(_SAMPLES):
            path[:, i] = f
            j = (i + 1) % _SAMPLES
            f = np.clip(f + increments[:, i], -b[:, j], b[:, j])
        path[:, -1] = f
        return path

    high, low = march(b[:, 0])[:, -1], march(-b[:, 0])[:, -1]
    first = np.where(v > 0, high, np.where(v < 0, low, (high + low) / 2))
    fx = march(first)[:, :-1]
    if start.friction is not None:
        known = (v == 0) & (low < high) & np.isfinite(start.friction)
        fx[known] += (start.friction - fx.mean(axis=1))[known, None]
        fx = np.clip(fx, -b, b)
    return y_g, fx, fy


def law_forces(system: FrictionSystem, start: HarmonicStart) -> tuple[Array, Array]:
    """Forces (n_ports, samples) of contacts of other laws over one period, and their memory at its start.

    The memory of contacts whose law switches stays zero here, as it follows from the force there.
    """
    laws = system.laws
    forces = np.zeros((laws.n_ports, _SAMPLES))
    if not laws or start.ports is None:
        return forces, np.zeros(laws.n_memory)
    computed, moved = start.harmonics, Harmonics((0, *system.orders))
    parts = ((computed, start.ports), (moved, system.law_motion))

    def motion(tau: Array) -> tuple[Array, Array]:
        q = np.sum([h.H_minus(tau) @ X.T for h, X in parts], axis=0)
        rate = np.sum([h.H_minus(tau) @ h.derivative(X).T for h, X in parts], axis=0)
        return q, system.omega * rate + system.law_velocity

    tau = 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES
    known, (q, velocity) = periodic_memory(system, motion), motion(tau)
    at = 2 * np.pi * np.arange(len(known)) / len(known)
    memory = np.array([np.interp(tau, at, row, period=2 * np.pi) for row in known.T]).reshape(-1, _SAMPLES).T
    for law, ports, kept, _ in laws.each:
        if law.law.regimes is None:
            own = LawsInTime([law])
            forces[ports] = own.rate(q[:, ports], velocity[:, ports], memory[:, kept])[0].T
        else:
            mean = None if start.mean_force is None else start.mean_force[ports]
            forces[ports] = _switching_forces(law, q[:, ports], system.omega, mean)
    return forces, known[0]


def _switching_forces(law: LawInTime, q: Array, omega: float, mean: Array | None) -> Array:
    """Forces (n_ports, samples) of a law that switches along a periodic motion (samples, n_ports), from none on.

    ``mean`` (n_ports,) is that of the forces on which a motion from none on does not settle.
    """
    p, _, n = law.shape
    assert law.law.regimes is not None
    way = 2.0 * np.pi / omega * law.velocity
    samples, path = q.T.reshape(p, n, _SAMPLES), np.zeros((p, n, _SAMPLES))
    force = np.zeros((p, n))
    for _ in range(_LAPS):
        for i in range(_SAMPLES):
            last = samples[..., i - 1] - way / _SAMPLES
            force = law.law.regimes.next_force(force, last, samples[..., i], law.values)
            path[..., i] = force
    if mean is not None:
        free = law.law.regimes.unsettled(samples, path, law.values)
        path[:, free] += (mean.reshape(p, n) - path.mean(axis=2))[:, free, None]
    return path.reshape(p * n, _SAMPLES)


def periodic_memory(system: FrictionSystem, motion: Callable[[Array], tuple[Array, Array]]) -> Array:
    """Approximate memory of contacts of other laws along a periodic motion, at equidistant phases, (k, m).

    ``motion`` gives motion and velocity (j, P) at phases (j,). Integrated from nothing until a period leaves it nearly
    as it was. Laws that switch are left out.
    """
    out = np.zeros((_STEPS, system.laws.n_memory))
    for law, ports, kept, _ in system.laws.each:
        if law.law.regimes is None and law.law.memory:
            out[:, kept] = _periodic(LawsInTime([law]), system.omega, motion, ports)
    return out


def _periodic(laws: LawsInTime, omega: float, motion: Callable[[Array], tuple[Array, Array]], ports: slice) -> Array:
    from scipy.integrate import solve_ivp

    memory = np.zeros((_STEPS, laws.n_memory))
    at = 2 * np.pi * np.arange(_STEPS + 1) / _STEPS

    def rate(tau: float, w: Array) -> Array:
        q, velocity = motion(np.array([tau]))
        return laws.rate(q[:, ports], velocity[:, ports], w[None])[1][0] / omega

    w = memory[0]
    for _ in range(_PERIODS):
        solution = solve_ivp(rate, (0.0, at[-1]), w, method="LSODA", t_eval=at, rtol=1e-4, atol=1e-8 * _size(memory))
        if not solution.success:
            break
        first, w, memory = w, solution.y[:, -1], solution.y[:, :-1].T
        if np.abs(w - first).max() <= _SAME * _size(memory):
            break
    return memory


def _size(memory: Array) -> float:
    return float(np.abs(memory).max(initial=0.0)) or 1e-6


def _answer(system: FrictionSystem, fx: Array, fy: Array, others: Array) -> tuple[Array, Array]:
    """q and dq/dtau at tau = 0 of the linear structure under the sampled contact forces and the loads."""
    equations, orders = system.equations, np.arange(_SAMPLES // 2 + 1)
    contact = np.fft.rfft(np.vstack([fx, fy[system.has_normal], others])) * 2 / _SAMPLES
    contact[:, 0] /= 2
    force = np.zeros((equations.columns.shape[1], len(orders)), dtype=complex)
    force[: len(contact)] = -contact
    force[len(contact) :, 0] = system.loads[:, 0]
    for k, m in enumerate(system.orders):
        force[len(contact) :, m] += system.loads[:, 1 + 2 * k] - 1j * system.loads[:, 2 + 2 * k]
    kept = np.unique([*range(min(64, len(orders))), 0, *system.orders])
    q = np.zeros(system.n)
    p = np.zeros(system.n)
    for m in kept:
        w = m * system.omega
        Z = equations.K - w**2 * equations.M + 1j * w * equations.C
        right = equations.columns @ force[:, m]
        answer = _solution(Z, right)
        q += answer.real
        p += (1j * m * answer).real
    return q, p


def _solution(matrix: AnyArray, right: AnyArray) -> AnyArray:
    """Of linear equations; at rest that of a structure that is not held is without rigid-body motion."""
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return np.linalg.lstsq(matrix, right, rcond=None)[0]
