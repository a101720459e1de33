"""The balance at one motion, or at n motions at once: forces, residual ``R = X + A (F - P)`` and its derivatives.

Unknowns are the coefficients of the relative motion at the contact ports, batch by batch and port by port (THEORY.md
(9.2)). One motion is (N,) with its frequency, n motions are (n, N) with frequencies (n,); arrays of elements are then
(n * count, ...), those of the first motion first. A pair (cosine, sine) is summed as the complex number ``c + i s``,
which makes ``x = conj(A) f``; harmonic 0 is one more such number with a real, static compliance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from slipstick.balance.factored import FactoredCompliance
from slipstick.balance.inputs import Assigned, ContactInputs, Inputs
from slipstick.balance.jacobian_backends import AnyCompliance
from slipstick.balance.states import add_force_changes, power_rows
from slipstick.contact.law import Motion, Response, add_to
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.state.contact_state import Carried
from slipstick.state.contact_state import respond as respond_with_states
from slipstick.structure.receptance import Receptance, mapped
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, ComplexArray

if TYPE_CHECKING:
    from slipstick.balance.balance import Balance
    from slipstick.balance.problem import Problem

Forces = Sequence[Mapping[int, Array]]
"""For each batch, coefficients (n * count, L) by port; ports left out are zero."""
Tangents = Sequence[Mapping[tuple[int, int], Array]]
"""For each batch, ``(i, j) -> dF_i/dQ_j`` (n * count, L, L)."""

_MANY = 2**18
"""Entries of a receptance from which on its size is that of its factors."""


class PortLayout:
    """Where the ports of a problem's contacts stand among the unknowns, at the problem's harmonics.

    Attributes
    ----------
    batches
        The contacts, one ``Batch`` for each kind of law.
    orders
        Harmonics above 0, as floats.
    n_ports, n_contacts, L, size
        Numbers of ports, of contacts, of coefficients of each port, and of unknowns ``N = n_ports L``.
    """

    def __init__(self, problem: Problem) -> None:
        self.harmonics, self.batches = problem.harmonics, problem.batches
        self.orders, self.L = self.harmonics.m.astype(float), self.harmonics.size
        self.n_ports, self.n_contacts = len(problem.port_directions), len(problem.elements)
        self.size = self.n_ports * self.L

    def motion(
        self,
        k: int,
        x: Array,
        omega: float | Array,
        contact_inputs: ContactInputs,
        harmonics: Harmonics | None = None,
    ) -> Motion:
        """Motion of batch ``k`` at unknowns (N,) or (n, N), the rubbing motion included.

        With other ``harmonics`` that hold those of the balance, in these.
        """
        batch, lead = self.batches[k], x.shape[:-1]
        X, moved = x.reshape(*lead, self.n_ports, self.L), []
        for port, Q in zip(batch.ports, contact_inputs.motion, strict=True):
            if port.size == batch.count:
                Q = X[..., port.rows, :].reshape(-1, self.L) + Q if lead else X[port.rows] + Q
            elif port.size:
                Q = Q.copy()
                Q.reshape(*lead, batch.count, self.L)[..., port.members, :] += X[..., port.rows, :]
            moved.append(Q if harmonics is None else _widened(self.harmonics, harmonics, Q))
        each = np.repeat(omega, batch.count) if lead else omega
        return Motion(
            harmonics or self.harmonics, each, tuple(moved), contact_inputs.drift(each),
            contact_inputs.velocity_per_omega,
        )  # fmt: skip

    def spread(self, dx: Array) -> list[dict[int, Array]]:
        """Changes of the motion by batch and port, of changes (N,) or (n, N) of the unknowns."""
        lead = dx.shape[:-1]
        dX = dx.reshape(*lead, self.n_ports, self.L)
        by_batch: list[dict[int, Array]] = []
        for batch in self.batches:
            moved: dict[int, Array] = {}
            for i, port in enumerate(batch.ports):
                if port.size == batch.count:
                    moved[i] = dX[..., port.rows, :].reshape(-1, self.L)
                elif port.size:
                    dQ = np.zeros((*lead, batch.count, self.L))
                    dQ[..., port.members, :] = dX[..., port.rows, :]
                    moved[i] = dQ.reshape(-1, self.L)
            by_batch.append(moved)
        return by_batch

    def gathered(self, forces: Forces, out: Array) -> Array:
        """Write forces on their ports in ``out`` (..., n_ports or more, L), which is zero before; returned."""
        lead = out.shape[:-2]
        for batch, by_port in zip(self.batches, forces, strict=True):
            for i, force in by_port.items():
                port = batch.ports[i]
                if port.size:
                    F = force.reshape(*lead, batch.count, self.L) if lead else force
                    out[..., port.rows, :] = F if port.size == batch.count else F[..., port.members, :]
        return out

    def excitation(self, forces: Forces, P: Array | None = None, n: tuple[int, ...] = ()) -> ComplexArray:
        """``F - P`` on all columns as complex numbers (..., n_columns, n + 1); without loads, on the ports alone.

        ``n`` is () of one motion, (n,) of n motions.
        """
        G = np.zeros((*n, self.n_ports + (0 if P is None else P.shape[-2]), self.L + 1))
        self.gathered(forces, G[..., 1:])
        if P is not None:
            np.negative(P, out=G[..., self.n_ports :, 1:])
        G[..., 0], G[..., 1] = G[..., 1], 0.0
        return G.view(complex)

    def real(self, z: ComplexArray) -> Array:
        """Complex numbers (rows, n + 1) as coefficients (rows * L,)."""
        pairs = z.view(float)
        out = np.empty((len(z), self.L))
        out[:, 0], out[:, 1:] = pairs[:, 0], pairs[:, 2:]
        return out.reshape(-1)


def _widened(narrow: Harmonics, wide: Harmonics, Q: Array) -> Array:
    """Coefficients (k, L) in a set that holds their own."""
    out = np.zeros((len(Q), wide.size))
    out[:, [wide.index(0), *(wide.index(m, part) for m in narrow.orders[1:] for part in ("c", "s"))]] = Q
    return out


class Adapted(Protocol):
    """What is known of a solution with some of the harmonics."""

    @property
    def in_use(self) -> int:
        """How many, 0 included."""
        ...

    @property
    def truncation(self) -> float:
        """What those left out would add, relative to the largest amplitude."""
        ...

    @property
    def context(self) -> Array:
        """The context with which the same harmonics are in use, near the same contact states."""
        ...


@dataclass(frozen=True, kw_only=True, slots=True)
class Detail:
    """What a solution keeps of its evaluation."""

    responses: tuple[Response, ...]
    """One for each batch; none where they are still to be had (``Together``)."""
    inputs: Inputs
    omega: Any
    """Fundamental frequency, rad/s: a float; (n,) of n motions."""
    states: tuple[Carried, ...] = ()
    """What the contacts carry beside motion, in the order of the balance."""
    adapted: Adapted | None = None
    """Which harmonics are in use; None: all."""

    @property
    def asked(self) -> Inputs:
        """The inputs with the parameters that the laws were asked with: at the contact states."""
        if not self.states:
            return self.inputs
        pairs = zip(self.inputs.batches, self.responses, strict=True)
        return replace(
            self.inputs, batches=tuple(contact_inputs.changed(**response.values) for contact_inputs, response in pairs)
        )

    @property
    def carried(self) -> Array | None:
        """Values of the contact states (n_states,), near which those of the next points are sought."""
        if len(self.states) == 1:
            return self.states[0].values
        return np.concatenate([state.values for state in self.states]) if self.states else None

    @property
    def fast(self) -> tuple[Carried, ...]:
        """The states that follow the motion; a slow one is held and adds nothing to a derivative."""
        return self.states and tuple(carried for carried in self.states if not carried.state.slow)

    @property
    def lost(self) -> bool:
        """Whether the equilibrium of some state near the values handed on has vanished."""
        return bool(self.states) and any(state.lost for state in self.states)

    @property
    def tangents(self) -> Tangents:
        """Derivatives of the forces by the motion, by batch."""
        return [response.by_motion for response in self.responses]

    @property
    def forces(self) -> Forces:
        """Forces by batch and port."""
        return [dict(enumerate(response.force)) for response in self.responses]


class Balanced(NamedTuple):
    """One evaluation: residual (N,), Jacobian, forces on all columns, what they came from, slope of the residual."""

    residual: Array
    jacobian: Jacobian
    G: ComplexArray
    compliance: AnyCompliance
    detail: Detail
    slope: Array | None = None


def detail(balance: Balance, x: Array, omega: float | Array, inputs: Inputs, near: Array | None = None) -> Detail:
    """Forces, and contact states if any, at unknowns (N,): the one place where laws meet the motion.

    ``near`` (n_states,) are the states of the neighbouring solution, near which these are sought; from their start
    without it. Without states also at n motions, of ``Assigned.joined`` inputs.
    """
    if (felt := balance.pulse.felt) is not None:
        felt()
    responses: list[Response] = []
    states: dict[int, Carried] = {}
    for k, contact_inputs in enumerate(inputs.batches):
        batch, motion = balance.batches[k], balance.layout.motion(k, x, omega, contact_inputs)
        of_batch = balance.states and [s for s, state in enumerate(balance.states) if state.batch == k]
        if of_batch:
            values = balance.by_state(near)
            response, carried = respond_with_states(
                [balance.states[s] for s in of_batch],
                batch.law,
                motion,
                contact_inputs.values,
                [values[s] for s in of_batch],
            )
            responses.append(response)
            states |= zip(of_batch, carried, strict=True)
        else:
            responses.append(batch.law.respond(motion, contact_inputs.values))
    in_order = tuple(states[s] for s in sorted(states)) if states else ()
    return Detail(responses=tuple(responses), inputs=inputs, omega=omega, states=in_order)


def unanswered(inputs: Inputs, omega: float) -> Detail:
    """Of a state whose forces are asked for later, together with those of others."""
    return Detail(responses=(), inputs=inputs, omega=omega)


def balanced(
    balance: Balance, x: Array, solution: Detail, compliance: AnyCompliance, slopes: Forces | None = None
) -> Balanced:
    """Residual and Jacobian from the forces at unknowns (N,); its slope where the ``slopes`` of the forces are given.

    That is along omega, or along what else the compliance has its derivative by.
    """
    G = balance.layout.excitation(solution.forces, solution.inputs.P)
    balance.anchoring(x, G)
    jacobian, slope = balance.jacobian(solution.tangents, compliance, solution.fast), None
    if slopes is None:
        moved = compliance.answer(G)
    else:
        dG = balance.layout.excitation(slopes) if any(slopes) else None
        moved, slope = compliance.answer_with_rate(G, dG)
    return Balanced(x + moved, jacobian, G, compliance, solution, slope)


def terms(balance: Balance, x: Array, at: Balanced) -> Array:
    """Sizes (N,) of the terms whose sum each residual is: the motion, and ``|A| k`` times all motion at the ports.

    ``k`` are the contact springs as far as they act. The stiffer they are, the more the forces cancel, and the more is
    seen of the rounding of the motion.
    """
    return _terms(balance, x, at.detail, lambda stiffness: _by_coefficient(at.compliance.reach(stiffness))).reshape(-1)


def _terms(balance: Balance, x: Array, solution: Detail, reach: Callable[[Array], Array]) -> Array:
    """The same of one motion or of n, (..., n_ports, L), by the ``reach`` of stiffnesses (..., n_ports)."""
    lead = x.shape[:-1]
    stiffness, prescribed = np.zeros((*lead, balance.n_ports)), np.zeros(lead)
    for batch, here, response in zip(balance.batches, solution.inputs.batches, solution.responses, strict=True):
        rubbing = here.motion.reshape(len(batch.ports), *lead, batch.count, balance.L)
        prescribed += np.sum(rubbing[..., 1:] ** 2, axis=(0, -2, -1))
        for i, springs in batch.law.springs(response).items():
            port = batch.ports[i]
            stiffness[..., port.rows] += springs.reshape(*lead, batch.count)[..., port.members]
    motion = np.sqrt(np.vecdot(x, x))[..., None, None]
    return np.asarray(motion + reach(stiffness) * (motion + np.sqrt(prescribed)[..., None, None]))


def _by_coefficient(reach: Array) -> Array:
    """Numbers (..., n + 1) by order for each coefficient (..., L)."""
    return np.concatenate([reach[..., :1], np.repeat(reach[..., 1:], 2, axis=-1)], axis=-1)


def force_rates(
    balance: Balance, solution: Detail, dx: Array, fixed: Forces, dpowers: Iterable[Array] = ()
) -> Forces:  # fmt: skip
    """Change of the forces for a change ``dx`` (N,) of the motion, with changes ``fixed`` at fixed motion besides.

    ``dpowers`` (n,) are changes of the powers that drive each contact state, at fixed motion and states.
    """
    changed = []
    for response, moved, extra in zip(solution.responses, balance.layout.spread(dx), fixed, strict=True):
        total = dict(extra)
        for (i, j), tangent in response.by_motion.items():
            if j in moved:
                part = np.einsum("cij,cj->ci", tangent, moved[j])
                add_to(total, i, part)
        changed.append(total)
    if solution.states:
        total_power = [
            power_rows(balance, state) @ dx + dpower for state, dpower in zip(solution.states, dpowers, strict=True)
        ]
        add_force_changes(solution.states, total_power, changed)
    return changed


def by_omega(solution: Detail) -> list[dict[int, Array]]:
    """Derivatives of the forces by omega at fixed motion; velocities that grow with omega leave the drift alone."""
    slopes = []
    for response, contact_inputs in zip(solution.responses, solution.inputs.batches, strict=True):
        slope = dict(response.by_omega)
        if response.by_drift and contact_inputs.at_speed:
            omega, velocity = solution.omega, contact_inputs.velocity
            each = np.repeat(omega, velocity.shape[1] // omega.size) if isinstance(omega, np.ndarray) else omega
            rate = velocity / -(each**2)
            for (i, j), tangent in response.by_drift.items():
                part = rate[j][:, None] * tangent
                add_to(slope, i, part)
        slopes.append(slope)
    return slopes


def by_inputs(solution: Detail, direction: Inputs) -> list[dict[int, Array]]:
    """Derivatives of the forces along a direction in the inputs at fixed motion."""
    slopes = []
    for response, along in zip(solution.responses, direction.batches, strict=True):
        slope: dict[int, Array] = {}
        for i, part in _rates(response, along, solution.omega):
            add_to(slope, i, part)
        slopes.append(slope)
    return slopes


def _rates(response: Response, along: ContactInputs, omega: float) -> Iterator[tuple[int, Array]]:
    for name, rate in along.values.items():
        if rate.any():
            for i, tangent in response.by_parameter(name).items():
                yield i, rate[:, None] * tangent
    drift = along.drift(omega)
    if drift.any():
        for (i, j), tangent in response.by_drift.items():
            yield i, drift[j][:, None] * tangent
    if along.motion.any():
        for (i, j), tangent in response.by_motion.items():
            yield i, np.einsum("cij,cj->ci", tangent, along.motion[j])


def forces_together(balance: Balance) -> bool:
    """Whether forces and residuals at motions of a balance can be computed together.

    Not with contact states, which depend on the neighbouring solution, and not with springs, whose forces go with the
    motion.
    """
    return not balance.states and balance.springs is None and balance.support_springs is None


def evaluated_together(balance: Balance) -> bool:
    """Whether motions of a balance can be evaluated together: Jacobians too, which iterative ones are not."""
    return forces_together(balance) and balance.backend.name == "dense"


def respond(
    balance: Balance, k: int, x: Array, omega: Array, inputs: ContactInputs, harmonics: Harmonics | None = None
) -> tuple[Motion, Response]:
    """Batch ``k`` at n motions that need no contact states, in other ``harmonics`` where these are given."""
    batch = balance.batches[k]
    law = batch.law if harmonics is None else batch.law.widened(balance.harmonics, harmonics)
    motion = balance.layout.motion(k, x, omega, inputs, harmonics)
    return motion, law.respond(motion, inputs.values)


class Together:
    """Forces and residuals at n motions: unknowns (n, N), frequencies (n,); see ``forces_together``."""

    def __init__(self, balance: Balance, x: Array, omega: Array, inputs: Assigned) -> None:
        self._balance, self._x, self._omega, self._inputs = balance, x, omega, inputs
        self._detail = detail(balance, x, omega, inputs.joined)
        self.responses = self._detail.responses

    @property
    def loads(self) -> Array:
        """Forces of the loads (n, n_loads, L)."""
        return self._detail.inputs.P

    @cached_property
    def forces(self) -> Array:
        """Forces on all ports (n, n_ports, L)."""
        return self._gathered(self._detail.forces)

    def force_changes(self, dx: Array) -> Array:
        """Their changes for changes (n, N) of the unknowns."""
        fixed: Forces = [{} for _ in self.responses]
        return self._gathered(force_rates(self._balance, self._detail, dx, fixed))

    def _gathered(self, forces: Forces) -> Array:
        b = self._balance
        return b.layout.gathered(forces, np.zeros((len(self._x), b.n_ports, b.L)))

    def residuals(self) -> Array:
        """``X + A (F - P)``, (n, N)."""
        return self._x + self._answer().reshape(self._x.shape)

    def relative_residuals(self) -> Array:
        """Norms (n,) of the residuals, each entry over the sizes of its ``terms``."""
        sizes = _terms(self._balance, self._x, self._detail, self._reach)
        residual = self.residuals().reshape(sizes.shape)
        return np.sqrt(np.sum((residual / np.where(sizes > 0, sizes, 1.0)) ** 2, axis=(1, 2)))

    def _reach(self, stiffness: Array) -> Array:
        reach = np.empty_like(self.forces)
        for receptance, at in self._receptances():
            reach[at] = _reach(receptance, self._balance.orders, self._omega[at], stiffness[at])
        return reach

    def _answer(self) -> Array:
        """``A (F - P)`` (n, n_ports, L)."""
        G, out = np.concatenate([self.forces, -self.loads], axis=1), np.empty_like(self.forces)
        for receptance, at in self._receptances():
            out[at, :, 0] = mapped(receptance.static, G[at, :, 0, None])[:, :, 0]
            out[at, :, 1:] = receptance.answer(self._balance.orders, self._omega[at], G[at, :, 1:])
        return out

    def _receptances(self) -> Iterator[tuple[Receptance, slice]]:
        """The receptance of each structure, and the motions that it answers."""
        first = 0
        for structure, same in groupby(self._inputs.structures):
            at = slice(first, first + len(list(same)))
            yield self._balance.receptance.adjusted(structure), at
            first = at.stop


def _reach(receptance: Receptance, orders: Array, omega: Array, stiffness: Array) -> Array:
    """``|A|`` times stiffnesses (n, n_ports), for each coefficient (n, n_ports, L)."""
    n, ports = stiffness.shape
    if receptance.static.size > _MANY and receptance.summed:
        by_modes = [
            FactoredCompliance(receptance.factors(orders, float(w))).reach(k)
            for w, k in zip(omega, stiffness, strict=True)
        ]
        return _by_coefficient(np.array(by_modes).reshape(n, -1, 1 + orders.size))
    receptance = receptance.written()
    out = np.empty((n, ports, 1 + 2 * orders.size))
    out[..., 0] = mapped(np.abs(receptance.static[:, :ports]), stiffness[:, :, None])[:, :, 0]
    if orders.size:
        A, _ = receptance.at(orders, omega)
        size = (np.abs(A[..., :ports]) @ stiffness[:, None, :, None])[..., 0].transpose(0, 2, 1)
        out[..., 1::2] = out[..., 2::2] = size
    return out
