"""The balance at one motion, or at n motions at once: forces, residual ``R = X + A (F - P)`` and its derivatives.

Unknowns are the coefficients of the relative motion at the contact ports, batch by batch and port by port (THEORY.md
(9.2)). One motion is (N,) with its frequency, n motions are (n, N) with frequencies (n,); arrays of elements are then
(n * count, ...), those of the first motion first. A pair (cosine, sine) is summed as the complex number ``c + i s``,
which makes ``x = conj(A) f``; harmonic 0 is one more such number with a real, static compliance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, isfinite
from typing import Any, Protocol

import numpy as np

from slipstick.balance.balance import Balance
from slipstick.balance.compliance import FactoredCompliance, driving, sums
from slipstick.balance.inputs import Assigned, ContactInputs, Inputs, Path
from slipstick.balance.jacobian_backends import AnyCompliance
from slipstick.balance.layout import Forces, Tangents
from slipstick.balance.layout import by_omega as batch_by_omega
from slipstick.balance.states import add_force_changes, answer_to_powers, at_states, power_along, power_rows
from slipstick.contact.law import Motion, Response, add_to
from slipstick.solve.newton import Evaluation
from slipstick.state.contact_state import Carried
from slipstick.state.contact_state import respond as respond_with_states
from slipstick.structure.receptance import Receptance, mapped
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, ComplexArray

_WRITTEN_UP_TO = 2**12
"""Entries of a receptance at all orders up to which all of them are written for each motion: as many single motions
do, and in a third of the time of products with the modes; larger ones cost more memory than they save time."""
_MODAL_BOUND_FROM = 2**18
"""Entries of a receptance (2 MB) from which its bound is computed by modes, in place of all entries."""


class Adapted(Protocol):
    """Properties of a solution with some of the harmonics."""

    @property
    def in_use(self) -> int:
        """Number of harmonics in use, 0 included."""
        ...

    @property
    def truncation(self) -> float:
        """Contribution of the harmonics left out, relative to the largest amplitude."""
        ...

    @property
    def context(self) -> Array:
        """The context that gives the same harmonics and contact states."""
        ...


@dataclass(frozen=True, kw_only=True, slots=True)
class Detail:
    """Data of an evaluation that a solution keeps."""

    responses: tuple[Response, ...]
    """One for each batch; none where they are computed later (``Together``)."""
    inputs: Inputs
    omega: Any
    """Fundamental frequency, rad/s: a float; (n,) of n motions."""
    states: tuple[Carried, ...] = ()
    """Contact states, in the order of the balance."""
    on_ports: Array = field(default_factory=lambda: np.empty(0))
    """Forces on all ports, and their derivatives by omega at fixed motion, (2, [n,] n_ports, L); without ``responses``
    empty."""
    adapted: Adapted | None = None
    """Which harmonics are in use; None: all."""

    @property
    def asked(self) -> Inputs:
        """The inputs with the parameters of the laws at the contact states."""
        if not self.states:
            return self.inputs
        pairs = zip(self.inputs.batches, self.responses, strict=True)
        return replace(
            self.inputs, batches=tuple(contact_inputs.changed(**response.values) for contact_inputs, response in pairs)
        )

    @property
    def carried(self) -> Array | None:
        """Values of the contact states (n_states,), from which those of the next points start."""
        if len(self.states) == 1:
            return self.states[0].values
        return np.concatenate([state.values for state in self.states]) if self.states else None

    @property
    def fast(self) -> tuple[Carried, ...]:
        """The states that follow the motion; a slow one is held and contributes no derivative."""
        return self.states and tuple(carried for carried in self.states if not carried.state.slow)

    @property
    def lost(self) -> bool:
        """Whether the equilibrium of some state near the values passed on has vanished."""
        return bool(self.states) and any(state.lost for state in self.states)

    @property
    def tangents(self) -> Tangents:
        """Derivatives of the forces by the motion, by batch."""
        return [response.by_motion for response in self.responses]

    @property
    def forces(self) -> Forces:
        """Forces by batch and port."""
        return [dict(enumerate(response.force)) for response in self.responses]


class Balanced:
    """One evaluation.

    Attributes
    ----------
    residual, slope
        Residual (N,), and its derivative at fixed motion and forces that change with omega alone: by what the
        compliance is differentiated by.
    jacobian, compliance, detail
        Jacobian, and what it was made from.
    """

    def __init__(self, balance: Balance, x: Array, solution: Detail, compliance: AnyCompliance) -> None:
        self._driving = x.reshape(balance.n_ports, balance.L), solution.on_ports, solution.inputs.P, *balance.anchors
        self.residual, self.slope = compliance.residual_with_slope(*self._driving)
        self.jacobian = balance.jacobian(solution.tangents, compliance, solution.fast)
        self.compliance, self.detail = compliance, solution

    @property
    def G(self) -> ComplexArray:
        """Forces on all columns (n_columns, n + 1), see ``driving``."""
        x, on_ports, *others = self._driving
        return driving(x, on_ports[0], *others)


def detail(balance: Balance, x: Array, omega: float | Array, inputs: Inputs, near: Array | None = None) -> Detail:
    """Forces, and contact states if any, at unknowns (N,): the only place where the laws are evaluated.

    ``near`` (n_states,) are the states of the neighbouring solution, from which these are found; without it they start
    from their initial values. Without states also at n motions, of ``Assigned.joined`` inputs.
    """
    if (felt := balance.pulse.felt) is not None:
        felt()
    responses: list[Response] = []
    states: dict[int, Carried] = {}
    layout = balance.layout
    on_ports = np.zeros((2, *x.shape[:-1], layout.n_ports, layout.L))
    for k, contact_inputs in enumerate(inputs.batches):
        of_batch = balance.states and [s for s, state in enumerate(balance.states) if state.batch == k]
        if of_batch:
            values = balance.by_state(near)
            response, carried = respond_with_states(
                [balance.states[s] for s in of_batch],
                balance.batches[k].law,
                layout.motion(k, x, omega, contact_inputs),
                contact_inputs.values,
                [values[s] for s in of_batch],
            )
            layout.write(k, response, contact_inputs, omega, on_ports)
            responses.append(response)
            states |= zip(of_batch, carried, strict=True)
        else:
            responses.append(layout.respond(k, x, omega, contact_inputs, on_ports))
    in_order = tuple(states[s] for s in sorted(states)) if states else ()
    return Detail(responses=tuple(responses), inputs=inputs, omega=omega, states=in_order, on_ports=on_ports)


def unanswered(inputs: Inputs, omega: float) -> Detail:
    """The detail of a solution whose forces are computed later, together with those of others."""
    return Detail(responses=(), inputs=inputs, omega=omega)


def terms(balance: Balance, x: Array, at: Balanced) -> Array:
    """Sizes (N,) of the terms whose sum each residual is: the motion, and ``|A| k`` times all motion at the ports.

    ``k`` are the acting contact springs. The stiffer they are, the more the forces cancel, and the larger the rounding
    error of the residual is.
    """
    return _terms(balance, x, at.detail, lambda stiffness: _by_coefficient(at.compliance.bound(stiffness))).reshape(-1)


def _terms(balance: Balance, x: Array, solution: Detail, bound: Callable[[Array], Array]) -> Array:
    """Sizes (..., n_ports, L) at one motion or at n; ``bound`` gives ``|A|`` times stiffnesses (..., n_ports)."""
    lead = x.shape[:-1]
    stiffness, prescribed = np.zeros((*lead, balance.n_ports)), np.zeros(lead)
    for batch, here, response in zip(balance.batches, solution.inputs.batches, solution.responses, strict=True):
        rubbing = here.motion.reshape(len(batch.ports), *lead, batch.count, balance.L)
        prescribed += np.sum(rubbing[..., 1:] ** 2, axis=(0, -2, -1))
        for i, springs in batch.law.springs(response).items():
            port = batch.ports[i]
            port.add(springs.reshape(*lead, batch.count)[..., port.members], stiffness)
    motion = np.sqrt(np.vecdot(x, x))[..., None, None]
    return np.asarray(motion + bound(stiffness) * (motion + np.sqrt(prescribed)[..., None, None]))


def _by_coefficient(by_order: Array) -> Array:
    """Numbers (..., n + 1) by order for each coefficient (..., L)."""
    return np.concatenate([by_order[..., :1], np.repeat(by_order[..., 1:], 2, axis=-1)], axis=-1)


def force_rates(
    balance: Balance, solution: Detail, dx: Array, fixed: Forces, dpowers: Iterable[Array] = ()
) -> Forces:  # fmt: skip
    """Change of the forces for a change ``dx`` (N,) of the motion, plus changes ``fixed`` at fixed motion.

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
    """Derivatives of the forces by omega at fixed motion, by batch and port."""
    pairs = zip(solution.responses, solution.inputs.batches, strict=True)
    return [batch_by_omega(response, contact_inputs, solution.omega) for response, contact_inputs in pairs]


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
        self._balance, self._omega, self._inputs = balance, omega, inputs
        self._x = np.ascontiguousarray(x)
        self._detail = detail(balance, self._x, omega, inputs.joined)
        self.responses = self._detail.responses

    @property
    def loads(self) -> Array:
        """Forces of the loads (n, n_loads, L)."""
        return self._detail.inputs.P

    @cached_property
    def forces(self) -> Array:
        """Forces on all ports (n, n_ports, L)."""
        return self._detail.on_ports[0]

    def force_changes(self, dx: Array) -> Array:
        """Their changes for changes (n, N) of the unknowns."""
        fixed: Forces = [{} for _ in self.responses]
        changes = force_rates(self._balance, self._detail, dx, fixed)
        return self._balance.layout.gathered(changes, np.zeros_like(self.forces))

    def residuals(self) -> Array:
        """``X + A (F - P)``, (n, N)."""
        both, b = self._conjugates, self._balance
        if both is None:
            return self._x + self._answer().reshape(self._x.shape)
        n, shape = len(self._x), (b.n_ports, b.L)
        out = np.empty((n, 2, *shape))
        sums().residuals_of_many(both, self._x.reshape(-1, *shape), self._detail.on_ports, self.loads, out)
        return out[:, 0].reshape(n, -1)

    @cached_property
    def _conjugates(self) -> ComplexArray | None:
        """As of a ``Compliance`` (n, 2, n_columns, n_ports, n + 1); None where they would be large."""
        b = self._balance
        if b.receptance.static.size * b.orders.size > _WRITTEN_UP_TO:
            return None
        return b.receptance.conjugates_of_each(b.orders, self._omega, self._inputs.structures)

    def relative_residuals(self) -> Array:
        """Norms (n,) of the residuals, each entry over the sizes of its ``terms``."""
        sizes = _terms(self._balance, self._x, self._detail, self._bound)
        residual = self.residuals().reshape(sizes.shape)
        return np.sqrt(np.sum((residual / np.where(sizes > 0, sizes, 1.0)) ** 2, axis=(1, 2)))

    def _bound(self, stiffness: Array) -> Array:
        if self._conjugates is not None:
            sizes = np.abs(self._conjugates[:, 0, : self._balance.n_ports])
            return _by_coefficient(np.einsum("ncrm,nc->nrm", sizes, stiffness))
        bound = np.empty_like(self.forces)
        for receptance, at in self._receptances():
            bound[at] = _bound(receptance, self._balance.orders, self._omega[at], stiffness[at])
        return bound

    def _answer(self) -> Array:
        """``A (F - P)`` (n, n_ports, L)."""
        G, out = np.concatenate([self.forces, -self.loads], axis=1), np.empty_like(self.forces)
        for receptance, at in self._receptances():
            out[at, :, 0] = mapped(receptance.static, G[at, :, 0, None])[:, :, 0]
            out[at, :, 1:] = receptance.answer(self._balance.orders, self._omega[at], G[at, :, 1:])
        return out

    def _receptances(self) -> Iterator[tuple[Receptance, slice]]:
        """The receptance of each structure, and its motions."""
        return self._balance.receptance.adjusted_runs(self._inputs.structures)


def _bound(receptance: Receptance, orders: Array, omega: Array, stiffness: Array) -> Array:
    """``|A|`` times stiffnesses (n, n_ports), for each coefficient (n, n_ports, L)."""
    n, ports = stiffness.shape
    if receptance.static.size > _MODAL_BOUND_FROM and receptance.summed:
        by_modes = [
            FactoredCompliance(receptance.factors(orders, float(w))).bound(k)
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


class FrequencySystem:
    """The balance as a system in omega."""

    def __init__(self, balance: Balance, inputs: Inputs) -> None:
        self.balance, self.inputs = balance, inputs

    def at(self, parameter: float) -> tuple[Inputs, float]:
        """Inputs and frequency at ``parameter``."""
        return self.inputs, parameter

    def evaluate(self, x: Array, parameter: float, context: Array | None = None) -> Evaluation:
        """Residual, Jacobian and derivative by omega at ``parameter`` = omega.

        All nan where the motion is not finite, where the structure is not supported, and where the equilibrium of a
        contact state near that of ``context`` has vanished.

        ``context`` holds the contact states (n_states,) of the last accepted point, from which these are found.
        """
        if not (isfinite(x.dot(x)) and 0.0 < parameter < inf):
            return Evaluation.undefined(x.size)
        balance = self.balance
        solution = detail(balance, x, parameter, self.inputs, context)
        if solution.lost or balance.is_unsupported(solution.tangents):
            return Evaluation.undefined(x.size)
        compliance = balance.compliance(parameter, self.inputs.structure)
        at = Balanced(balance, x, solution, compliance)
        slope = at.slope
        if fast := solution.fast:
            slope += answer_to_powers(balance, fast, (state.power.omega for state in fast), at.compliance)
        return Evaluation(at.residual, at.jacobian, slope, solution, lambda: terms(balance, x, at), solution.carried)

    def rates(self, solution: Detail, parameter: float, dx: Array, rate: float) -> tuple[Forces, Array]:
        """Change of the forces and of the loads at ``parameter`` for changes ``dx`` (N,) and ``rate`` of it."""
        slopes_here = [{i: rate * part for i, part in slopes.items()} for slopes in by_omega(solution)]
        dpowers = (rate * carried.power.omega for carried in solution.states)
        return force_rates(self.balance, solution, dx, slopes_here, dpowers), np.zeros_like(solution.inputs.P)


class ParameterSystem:
    """The balance at a fixed frequency as a system in a parameter, on whose path the inputs lie."""

    def __init__(self, balance: Balance, path: Path, omega: float) -> None:
        self.balance, self.path, self.omega = balance, path, omega
        self._loads_known: tuple[Array, AnyCompliance, Array] | None = None

    def at(self, parameter: float) -> tuple[Inputs, float]:
        """Inputs and frequency at ``parameter``."""
        return self.path.at(parameter)[0], self.omega

    def evaluate(self, x: Array, parameter: float, context: Array | None = None) -> Evaluation:
        """Residual, Jacobian and derivative by the parameter; nan as in a ``FrequencySystem``."""
        if not (isfinite(x.dot(x)) and isfinite(parameter)):
            return Evaluation.undefined(x.size)
        balance = self.balance
        inputs, direction = self.path.at(parameter)
        solution = detail(balance, x, self.omega, inputs, context)
        if solution.lost or balance.is_unsupported(solution.tangents):
            return Evaluation.undefined(x.size)
        compliance = balance.compliance(self.omega, inputs.structure, direction.structure)
        at = Balanced(balance, x, solution, compliance)
        direction = at_states(solution.states, direction)
        slope = self._moved_by(by_inputs(solution, direction), direction.P, at.compliance)
        if direction.structure:
            slope += at.compliance.rate(at.G)
        if fast := solution.fast:
            dpowers = (power_along(state, direction) for state in fast)
            slope += answer_to_powers(balance, fast, dpowers, at.compliance)
        return Evaluation(at.residual, at.jacobian, slope, solution, lambda: terms(balance, x, at), solution.carried)

    def rates(self, solution: Detail, parameter: float, dx: Array, rate: float) -> tuple[Forces, Array]:
        """Change of the forces and of the loads at ``parameter`` for changes ``dx`` (N,) and ``rate`` of it."""
        direction = at_states(solution.states, self.path.at(parameter)[1])
        slopes_here = [{i: rate * part for i, part in slopes.items()} for slopes in by_inputs(solution, direction)]
        dpowers = (rate * power_along(carried, direction) for carried in solution.states)
        return force_rates(self.balance, solution, dx, slopes_here, dpowers), rate * direction.P

    def _moved_by(self, slopes: Forces, P: Array, compliance: AnyCompliance) -> Array:
        """Derivative of the residual (N,) by forces and loads; it is constant, and cached, where only loads change."""
        if any(slopes):
            return self.balance.moved_by(slopes, P, compliance)
        known = self._loads_known
        if known is None or known[0] is not P or known[1] is not compliance:
            self._loads_known = known = P, compliance, self.balance.moved_by(slopes, P, compliance)
        return known[2].copy()


AnySystem = FrequencySystem | ParameterSystem
