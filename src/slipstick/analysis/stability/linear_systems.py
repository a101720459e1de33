"""Structure and contacts linearised in each combination of contact states, along a branch.

``df = D ds + E dc``, with ``dc`` the memory of a stuck friction spring. Every combination is made once, for as long as
structure and contacts keep their parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slipstick.analysis.stability.dynamics import Dynamics, dynamics
from slipstick.analysis.time_domain.piecewise_model import slider_values
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Detail
from slipstick.balance.inputs import Inputs
from slipstick.contact.friction_law import is_friction
from slipstick.contact.kernel.tuples import SEPARATION, SLIP_PLUS, STICK
from slipstick.errors import InputError
from slipstick.structure.checks import dense
from slipstick.typing import Array, IntArray

StateCodes = tuple[int, ...]
"""State code of every contact."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionPorts:
    """Ports and parameters of n friction contacts, (n,) each."""

    tangential: IntArray
    """Number of the tangential port among all, -1 where there is none."""
    normal: IntArray
    """Number of the normal port, likewise."""
    kt: Array
    mu: Array
    kn: Array
    n_ports: int

    @property
    def count(self) -> int:
        """Number of contacts."""
        return len(self.kt)

    def tangent(self, states: StateCodes) -> tuple[Array, Array]:
        """``D`` (n_ports, n_ports) and ``E`` (n_ports, n) (THEORY.md (13.1))."""
        D, E = np.zeros((self.n_ports, self.n_ports)), np.zeros((self.n_ports, self.count))
        for i, state in enumerate(states):
            if state == SEPARATION:
                continue
            x, y = self.tangential[i], self.normal[i]
            if y >= 0:
                D[y, y] += self.kn[i]
            if x < 0:
                continue
            if state == STICK:
                D[x, x] += self.kt[i]  # sliders side by side share a port
                E[x, i] = 1.0
            elif y >= 0:
                D[x, y] += (1.0 if state == SLIP_PLUS else -1.0) * self.mu[i] * self.kn[i]
        return D, E


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearisedStates:
    """The linear system of one combination: ``q'' = -forces [q, q'/scale, dc]``.

    Attributes
    ----------
    forces
        (r, 2 r + n), divided by the scale.
    motion
        Rows (n_ports, 2 r + n) that give ``ds``.
    relative
        ``(I + R D)^-1`` (n_ports, n_ports): rates of the motion at the ports from those of the modes.
    D, E
        The contacts linearised, see ``FrictionPorts.tangent``.
    rate
        Bound (1/time) on the fastest motion.
    sound
        Whether ``det(I + R D) > 0``: the motion at the ports follows from that of the modes without a jump.
    """

    forces: Array
    motion: Array
    relative: Array
    D: Array
    E: Array
    rate: float
    sound: bool


@dataclass(eq=False)
class Combinations:
    """Linear systems of the combinations, each built once (THEORY.md (13.3))."""

    dynamics: Dynamics
    contacts: FrictionPorts
    scale: float = 0.0
    """Divisor of velocities (1/time), which gives them the size of the motion."""
    _made: dict[StateCodes, LinearisedStates] = field(default_factory=dict)
    _latest: tuple[tuple[StateCodes, ...], tuple[Array, Array, bool]] = ((), (np.empty(0), np.empty(0), True))

    def __post_init__(self) -> None:
        d, c = self.dynamics, self.contacts
        spring = np.zeros(c.n_ports)
        for ports, stiffness in ((c.tangential, c.kt), (c.normal, c.kn)):
            np.add.at(spring, ports[ports >= 0], stiffness[ports >= 0])
        self.scale = float(np.sqrt(_size(d.K + (d.columns * spring) @ d.rows))) or 1.0

    def __call__(self, states: StateCodes) -> LinearisedStates:
        """The linear system of a combination."""
        if states not in self._made:
            self._made[states] = self._make(states)
        return self._made[states]

    def of_each(self, all_states: tuple[StateCodes, ...]) -> tuple[Array, Array, bool]:
        """Forces (k, r, 2 r + n) and rates (k,) of several combinations, and whether all of them are sound."""
        if all_states != self._latest[0]:  # neighbouring points have the same
            pieces = [self(states) for states in all_states]
            forces, rates = np.array([piece.forces for piece in pieces]), np.array([piece.rate for piece in pieces])
            self._latest = all_states, (forces, rates, all(piece.sound for piece in pieces))
        return self._latest[1]

    def _make(self, states: StateCodes) -> LinearisedStates:
        d, (D, E) = self.dynamics, self.contacts.tangent(states)
        r, n = d.size, self.contacts.count
        coupled = np.eye(len(D)) + d.R @ D
        relative = np.asarray(np.linalg.inv(coupled), dtype=float)
        motion = np.zeros((len(D), 2 * r + n))
        motion[:, :r], motion[:, 2 * r :] = relative @ d.rows, -relative @ d.R @ E
        force = D @ motion
        force[:, 2 * r :] += E
        answer = d.columns @ force
        answer[:, :r] += d.K
        rate = float(np.sqrt(_size(answer[:, :r]))) + _size(d.C)
        answer /= self.scale
        answer[:, r : 2 * r] += d.C
        return LinearisedStates(
            forces=np.ascontiguousarray(answer), motion=motion, relative=relative, D=D, E=E, rate=rate,
            sound=float(np.linalg.det(coupled)) > 0.0,
        )  # fmt: skip


def _size(matrix: Array) -> float:
    """Largest column sum of magnitudes."""
    return float(np.abs(matrix).sum(axis=0).max(initial=0.0))


IN_MOTION = 4.0
"""Frequency up to which modes stay in motion, over that of the highest harmonic."""


def friction_batches(balance: Balance) -> list[int]:
    """Numbers of the batches of friction contacts: those that know their motion at rest are one by themselves."""
    return [k for k, batch in enumerate(balance.batches) if is_friction(batch.law)]


def friction_values(balance: Balance, detail: Detail) -> Mapping[str, Array]:
    """Parameters (n,) of the friction contacts at a point, then of the sliders of other contacts."""
    inputs = detail.asked.batches
    each = [inputs[k].values for k in friction_batches(balance)]
    each += [slider_values(balance.batches[k].law, inputs[k].values) for k in slider_batches(balance)]
    return {name: np.concatenate([np.zeros(0), *(one[name] for one in each)]) for name in ("kt", "mu", "kn", "gap")}


def slider_batches(balance: Balance) -> list[int]:
    """Numbers of the batches whose contacts consist of sliders; these are counted after the friction contacts."""
    return [k for k, batch in enumerate(balance.batches) if batch.law.slider_count]


def port_numbers(balance: Balance, k: int) -> IntArray:
    """Numbers of the ports of a batch among all ports of the balance, (n_ports, n); -1 where there is none."""
    batch, numbers = balance.batches[k], np.arange(balance.n_ports)
    out = np.full((len(batch.ports), batch.count), -1)
    for place, port in zip(out, batch.ports, strict=True):
        place[port.members] = numbers[port.rows]
    return out


class LinearSystems:
    """The combinations at the points of a branch, built again only where structure or contacts differ.

    Hysteretic damping becomes viscous, equal at each natural frequency or at ``damping_at``, rad/s.

    Attributes
    ----------
    in_time
        Whether the structure has equations in time; without them only :meth:`contacts` is available.
    law_ports
        Numbers among all ports of those of other laws, -1 where there is none, in the order of ``LawsInTime``. With
        such contacts all modes stay in motion.
    """

    def __init__(self, balance: Balance, *, full: bool, damping_at: float | None = None) -> None:
        self._balance, self._full = balance, full
        self._damping: dict[str, Any] = {} if damping_at is None else {"damping_at": damping_at}
        friction, sliders = friction_batches(balance), slider_batches(balance)
        others = [k for k in range(len(balance.batches)) if k not in (*friction, *sliders)]
        rows = [np.concatenate([*port_numbers(balance, k)]) for k in others]
        self.law_ports = np.concatenate([np.zeros(0, dtype=int), *rows])
        none = np.zeros((2, 0), dtype=int)
        own = np.concatenate([none, *(port_numbers(balance, k) for k in friction)], axis=1)
        joints = [np.repeat(port_numbers(balance, k)[0], balance.batches[k].law.slider_count) for k in sliders]
        with_joints = np.concatenate([own[0], *joints])
        self._ports = np.stack([with_joints, np.append(own[1], np.full(len(with_joints) - len(own[1]), -1))])
        self._structures: dict[tuple[tuple[str, float], ...], Dynamics] = {}
        self._key: object = None
        self._structure: Dynamics | None = None
        self._inputs: Inputs | None = None
        self._contacts: FrictionPorts | None = None
        self._combinations: Combinations | None = None
        try:
            self._dynamics({}, 1.0)
            self.in_time = True
        except (InputError, NotImplementedError):
            self.in_time = False

    def contacts(self, detail: Detail) -> FrictionPorts:
        """The contacts with the parameters of a point."""
        inputs = detail.asked
        if self._contacts is None or inputs is not self._inputs:
            values = friction_values(self._balance, detail)
            self._inputs, self._contacts = inputs, FrictionPorts(
                tangential=self._ports[0], normal=self._ports[1], kt=values["kt"], mu=values["mu"], kn=values["kn"],
                n_ports=self._balance.n_ports,
            )  # fmt: skip
        return self._contacts

    def at(self, detail: Detail) -> Combinations:
        """The combinations at a point."""
        contacts, structure, size = self.contacts(detail), self._dynamics(detail.inputs.structure, detail.omega), 0
        if not self._full and not self.law_ports.size:
            size = structure.count_below(IN_MOTION * self._balance.harmonics.highest * detail.omega)
        parameters = (p.tobytes() for p in (contacts.kt, contacts.mu, contacts.kn))
        key = (size, *parameters)
        if self._combinations is None or key != self._key or structure is not self._structure:
            self._structure = structure
            self._key = key
            self._combinations = Combinations(structure.slowest(size) if size else structure, contacts)
        return self._combinations

    def _dynamics(self, values: Mapping[str, float], omega: float) -> Dynamics:
        structure = self._balance.problem.structure
        own = structure.turning_with(omega)
        key = (*sorted(values.items()), *(() if own is structure else (("omega", omega),)))
        if key not in self._structures:
            changed = own.changed(**values) if values else own
            directions, driven = dense(self._balance.directions), self._balance.problem.load_columns
            columns = np.hstack([directions, driven.vectors])
            equations = changed.time_equations(directions, columns, driven.shapes, **self._damping)
            self._structures = {key: dynamics(equations)}
        return self._structures[key]
