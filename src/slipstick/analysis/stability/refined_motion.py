"""The motion at the contacts once more through the structure, with four times as many harmonics (THEORY.md (11.1)).

The forces at a solution have harmonics beyond those of the balance. The motion that these make is added: it becomes
smoother, and the times at which contacts change their states become accurate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipstick.analysis.time_domain.law_in_time import LawInTime, LawsInTime
from slipstick.analysis.time_domain.piecewise_model import HELD_PARAMETERS, law_in_time, slider_values
from slipstick.balance.evaluation import forces_together, respond
from slipstick.balance.inputs import Assigned
from slipstick.contact.forces import element_forces
from slipstick.contact.friction_law import is_friction
from slipstick.contact.law import Motion
from slipstick.contact.rest import rest_of
from slipstick.results.truncation import moved
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.balance import Balance
    from slipstick.balance.evaluation import Detail
    from slipstick.balance.inputs import Inputs

WIDER = 4
"""Highest harmonic of the iterated motion over that of the balance."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothMotion:
    """Motion and forces of n friction contacts in many harmonics, (n, L') each; the rubbing motion is included.

    Sliders of contacts of other laws follow them. All further laws are in ``laws``, with motions and forces (P, L') in
    its order.
    """

    harmonics: Harmonics
    omega: float
    X: Array
    Y: Array
    rubbing: tuple[Array, Array]
    """Rubbing motion, which X and Y include."""
    force: tuple[Array, Array]
    """Friction and normal forces that the iteration began with."""
    values: dict[str, Array]
    """``v, kt, mu, kn, gap`` as ``element_forces`` takes them."""
    laws: LawsInTime
    law_motion: Array
    law_rubbing: Array
    """Motion of the opposing surface, which ``law_motion`` includes."""
    law_force: Array
    law_drift: Array
    """Constant velocity (P,) over omega."""

    def of_law(self, law: LawInTime, ports: slice) -> Motion:
        """Motion of the contacts of one law, whose rows among the ports are ``ports``, as the law takes it."""
        p, _, n = law.shape
        Q = self.law_motion[ports].reshape(p, n, -1)
        return Motion(self.harmonics, self.omega, tuple(Q), self.law_drift[ports].reshape(p, n))

    def law_arguments(self, tau: Array) -> tuple[Array, Array]:
        """Motion and velocity (k, P) of contacts of other laws at phases (k,)."""
        h = self.harmonics
        H = h.H_minus(tau)
        return H @ self.law_motion.T, self.omega * (H @ h.derivative(self.law_motion).T + self.law_drift)

    def law_acceleration(self, tau: Array) -> Array:
        """Their acceleration (k, P)."""
        h = self.harmonics
        return np.asarray(self.omega**2 * (h.H_minus(tau) @ h.derivative(h.derivative(self.law_motion)).T))


class Iteration:
    """One iteration of the contacts' motion through the structure, prepared once a branch."""

    def __init__(self, balance: Balance) -> None:
        self._balance, h = balance, balance.harmonics
        self.wide = Harmonics(range(max(1, WIDER * h.highest) + 1))
        self._own_columns = self.wide.columns(h.orders)
        self._orders: dict[bytes, tuple[Array, NDArray[np.intp]]] = {}
        self._rubbing: tuple[Inputs, list[Array]] | None = None
        self.can_many = forces_together(balance) and [is_friction(b.law) for b in balance.batches] == [True]
        """Whether motions can be iterated together: friction contacts alone, without contact states."""

    def truncated(self, x: Array, detail: Detail) -> SmoothMotion:
        """The motion of the contacts at a solution (N,) in the harmonics of the balance."""
        motions = self._motions(x, detail)
        rubbing = [inputs.motion for inputs in detail.inputs.batches]
        return self._assembled(self._balance.harmonics, detail, motions, rubbing, [r.force for r in detail.responses])

    def __call__(self, x: Array, detail: Detail) -> SmoothMotion:
        """The iterated motion of the contacts at a solution (N,)."""
        if self.can_many:
            return self.many(x[None], [detail])[0]
        balance, wide, motions, forces = self._balance, self.wide, [], []
        further, columns = self._added_orders(x, detail)
        force = np.zeros((balance.n_ports + balance.n_loads, len(columns)))
        for batch, motion, response in zip(balance.batches, self._motions(x, detail), detail.responses, strict=True):
            spread = motion._replace(harmonics=wide, Q=tuple(self._widened(Q) for Q in motion.Q))
            answer = batch.law.widened(balance.harmonics, wide).respond(spread, response.values).force
            for port, coefficients in zip(batch.ports, answer, strict=True):
                port.add(coefficients[port.members][:, columns], force, 0)
            motions.append(spread)
            forces.append(answer)
        omega = np.array([detail.omega])
        added = moved(balance.receptance, further, force[None], omega, [detail.inputs.structure])[0]
        for batch, motion in zip(balance.batches, motions, strict=True):
            for port, coefficients in zip(batch.ports, motion.Q, strict=True):
                coefficients[np.ix_(np.arange(batch.count)[port.members], columns)] += added[port.rows, 1:]
        return self._assembled(wide, detail, motions, self._prescribed(detail.inputs), forces)

    def many(self, x: Array, details: Sequence[Detail]) -> list[SmoothMotion]:
        """The iterated motion at n solutions (n, N), which ``can_many``."""
        balance, wide, batch = self._balance, self.wide, self._balance.batches[0]
        further, columns = self._added_orders(x[0], details[0])
        inputs, omega = Assigned.of([d.inputs for d in details]), np.array([d.omega for d in details])
        contact_inputs, shape = inputs.contacts(0), (len(x), batch.count, wide.size)
        motion, response = respond(balance, 0, x, omega, contact_inputs, wide)
        force = np.zeros((len(x), balance.n_ports + balance.n_loads, len(columns)))
        for port, coefficients in zip(batch.ports, response.force, strict=True):
            port.add(coefficients.reshape(shape)[:, port.members][..., columns], force, 1)
        added = moved(balance.receptance, further, force, omega, inputs.structures)
        for port, coefficients in zip(batch.ports, motion.Q, strict=True):
            members = np.arange(batch.count)[port.members]
            coefficients.reshape(shape)[:, members[:, None], columns] += added[:, port.rows, 1:]
        laws, none = LawsInTime([]), np.zeros((0, wide.size))
        out = []
        for i, detail in enumerate(details):
            at, u = slice(i * batch.count, (i + 1) * batch.count), self._prescribed(detail.inputs)[0]
            (X, Y), (fx, fy) = ([part[at] for part in both] for both in (motion.Q, response.force))
            values = {"v": motion.drift[0], **rest_of(contact_inputs.values)[0]}
            out.append(SmoothMotion(
                harmonics=wide, omega=detail.omega, X=X, Y=Y, rubbing=(u[0], u[1]), force=(fx, fy),
                values={name: value[at] for name, value in values.items()}, laws=laws, law_motion=none,
                law_rubbing=none, law_force=none, law_drift=np.zeros(0),
            ))  # fmt: skip
        return out

    def _prescribed(self, inputs: Inputs) -> list[Array]:
        """The rubbing motion of every batch, (n_ports, n, L'), stored as most points of a branch have the same."""
        if self._rubbing is None or self._rubbing[0] is not inputs:
            self._rubbing = inputs, [np.array([self._widened(part) for part in b.motion]) for b in inputs.batches]
        return self._rubbing[1]

    def _motions(self, x: Array, detail: Detail) -> list[Motion]:
        batches = detail.inputs.batches
        return [self._balance.layout.motion(k, x, detail.omega, inputs) for k, inputs in enumerate(batches)]

    def _assembled(
        self, h: Harmonics, detail: Detail, motions: Sequence[Motion], rubbing: Sequence[Array],
        forces: Sequence[tuple[Array, ...]],
    ) -> SmoothMotion:  # fmt: skip
        none = np.zeros((0, h.size))
        friction = [(none, none, none, none, none, none, dict.fromkeys(("v", *HELD_PARAMETERS), np.zeros(0)))]
        sliders_last = []
        laws, rows = [], [(none, none, none, np.zeros(0))]
        for k, (batch, motion) in enumerate(zip(self._balance.batches, motions, strict=True)):
            values = detail.responses[k].values
            if is_friction(batch.law):
                own = {**values, "v": motion.drift[0]}
                friction.append((*motion.Q, rubbing[k][0], rubbing[k][1], forces[k][0], forces[k][1], own))
            elif count := batch.law.slider_count:
                X, moved = (np.repeat(part, count, axis=0) for part in (motion.Q[0], rubbing[k][0]))
                own = {**slider_values(batch.law, values), "v": np.repeat(motion.drift[0], count)}
                still = np.zeros_like(X)
                sliders = element_forces(h, X, still, **own)
                sliders_last.append((X, still, moved, still, sliders.Fx, sliders.Fy, own))
            else:
                laws.append(law_in_time(batch, values, detail.inputs.batches[k].speed(detail.omega)))
                Q, u, force = (np.concatenate(part) for part in (motion.Q, rubbing[k], forces[k]))
                rows.append((Q, u, force, motion.drift.reshape(-1)))
        moved, prescribed, force, drift = (np.concatenate(part) for part in zip(*rows, strict=True))
        *motion_and_force, each = zip(*friction, *sliders_last, strict=True)
        X, Y, u, u_normal, fx, fy = (np.concatenate(part) for part in motion_and_force)
        return SmoothMotion(
            harmonics=h, omega=detail.omega, X=X, Y=Y, rubbing=(u, u_normal), force=(fx, fy),
            values={name: np.concatenate([own[name] for own in each]) for name in each[0]}, laws=LawsInTime(laws),
            law_motion=moved, law_rubbing=prescribed, law_force=force, law_drift=drift,
        )  # fmt: skip

    def _added_orders(self, x: Array, detail: Detail) -> tuple[Array, NDArray[np.intp]]:
        """Orders whose motion is added, and their columns: those outside the balance or not in use at a point."""
        h = self._balance.harmonics
        in_use = np.ones(h.n, dtype=bool)
        if detail.adapted is not None:
            used = np.any(x.reshape(self._balance.n_ports, -1) != 0.0, axis=0)
            in_use = used[1::2] | used[2::2]
        key = in_use.tobytes()
        if key not in self._orders:
            orders = sorted(set(self.wide.orders) - {0, *h.m[in_use].tolist()})
            self._orders[key] = np.array(orders, dtype=float), self.wide.columns(orders)
        return self._orders[key]

    def _widened(self, coefficients: Array) -> Array:
        out = np.zeros((len(coefficients), self.wide.size))
        out[:, self._own_columns] = coefficients
        return out
