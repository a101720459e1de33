"""Equilibrium along load steps: contacts open, close, stick and slip, and keep the history of their friction.

The relative motion ``q`` at the contact ports is in balance where ``q + A (f - S q - p) = 0``, with the static
compliance A from forces on the ports and loads, and reference springs S of a structure that its contacts alone hold
(``structure.supported_at``). Each increment is solved by Newton's method with the slopes of ``Law.quasi_static``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from slipstick.analysis.preload.steps import Target
from slipstick.balance.layout import Batch
from slipstick.balance.problem import Problem
from slipstick.contact.quasi_static import Increment
from slipstick.errors import Fault, InputError
from slipstick.html import some
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.newton import Evaluation, NewtonOptions, NewtonResult, newton
from slipstick.structure.checks import dense
from slipstick.typing import Array, BoolArray

_NEWTON = NewtonOptions(max_iterations=60, non_monotone=8)
_CLOSE = 1e-6
"""Last correction, over the motion with all contacts stuck, that is close enough where the iteration stands still: of
bodies on soft springs, whose compliance is a difference of large numbers."""
_NO_MOTION = 1e-150
"""Size of the motion of a step without any load."""
_STILL = 3
"""Halvings of an increment before that is taken."""
_CUTS = 12
"""Halvings of an increment, at most."""
_ROUNDING = 1e-14
"""Motion without friction force, over the largest motion of any contact, that is rounding."""
_LINES = 8
"""Contacts that a message names, at most."""


@dataclass
class BatchState:
    """Forces and the gaps of the elements of one batch at a state of equilibrium."""

    force: Array
    """(n_ports, n)"""
    gap: Array
    slip: Array
    """Slip since the beginning, (n_ports - 1, n)."""
    closed: BoolArray
    slipping: BoolArray
    before: Array
    """Motion at the ports, (n_ports, n)."""


@dataclass
class State:
    """A state of equilibrium: motion at all ports, contacts, loads, and the increments and iterations so far."""

    q: Array
    contacts: list[BatchState]
    loads: Array
    increments: int = 0
    iterations: int = 0


@dataclass
class _Control:
    """What the gaps and forces of one batch do along a step."""

    gap: Array
    """Gaps at the end, (n,)."""
    held: BoolArray
    """Elements whose force is given, (n,)."""
    force: Array
    """That force at the end, (n,)."""
    start: Array = field(default_factory=lambda: np.empty(0))
    """Force at the beginning of the step."""


class March:
    """A problem made ready for load steps.

    Parameters
    ----------
    problem
        Whose loads are all static loads that act in any of the steps.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.batches = problem, problem.batches
        self.values = [dict(given.values) for given in problem.inputs.batches]
        self.moving = [np.array(given.motion[..., 0]) for given in problem.inputs.batches]
        self.directions = problem.direction_matrix(problem.port_directions)
        self.n = len(problem.port_directions)
        self.structure, self.springs = _supported(problem, self.directions)
        receptance = problem.load_columns.receptance(self.structure, self.directions, self.directions)
        self.A = np.asarray(receptance.written().static, dtype=float)
        self.unsettled: list[str] = []
        """Steps in which an increment was taken although the iteration stalled."""

    def start(self) -> State:
        """Nothing loaded, nothing touching with force."""
        contacts = []
        for values, moving, batch in zip(self.values, self.moving, self.batches, strict=True):
            ports, count = moving.shape
            force, normal = np.zeros((ports, count)), self._has_normal(batch)
            gap = np.array(values["gap"], dtype=float)
            gap[normal] = np.maximum(gap[normal], 0.0)  # an overlap comes in with the first step
            force[-1] = np.where(normal, 0.0, values["kn"] * np.maximum(-gap, 0.0))
            contacts.append(
                BatchState(
                    force, gap, np.zeros((ports - 1, count)), moving[-1] >= gap, np.zeros(count, dtype=bool),
                    moving.copy(),
                )
            )  # fmt: skip
        return State(np.zeros(self.n), contacts, np.zeros(self.A.shape[1] - self.n))

    def step(self, state: State, target: Target, *, first: bool) -> State:
        """The state at the end of a step; InputError where there is no equilibrium on the way."""
        P = self._loads(target)
        controls = [self._control(k, state, target, first) for k in range(len(self.batches))]
        stuck = self._stuck(state, P, controls, [control.gap for control in controls], 1.0)
        scale = max(float(np.linalg.norm(stuck)), float(np.linalg.norm(state.q)), _NO_MOTION)
        begin, now, part, size, cuts = state, state, 0.0, 1.0 / target.increments, 0
        while part < 1.0:
            to = min(1.0, part + size)
            to = 1.0 if 1.0 - to < 1e-9 else to
            result, contacts = self._solved(now, begin, P, controls, to, scale)
            if result.converged or (cuts == _STILL and result.correction_norm < _CLOSE):
                if not result.converged:
                    self.unsettled.append(f"'{target.name}' at {100.0 * to:.4g} %")
                now = State(
                    result.x, contacts, begin.loads + to * (P - begin.loads),
                    now.increments + 1, now.iterations + result.iterations,
                )  # fmt: skip
                part = to
                if cuts:
                    size, cuts = 2.0 * size, cuts - 1
                continue
            if cuts == _CUTS:
                raise InputError(self._lost(target, part, result, now, contacts))
            size, cuts = 0.5 * size, cuts + 1
        self._lock(now, controls)
        return now

    def _solved(
        self, now: State, begin: State, P: Array, controls: Sequence[_Control], to: float, scale: float
    ) -> tuple[NewtonResult, list[BatchState]]:
        """Equilibrium at a part ``to`` of a step that began at ``begin``, from the one before."""
        n, load = self.n, begin.loads + to * (P - begin.loads)
        both = zip(begin.contacts, controls, strict=True)
        at = [start.gap + to * (control.gap - start.gap) for start, control in both]
        free, size = self.A[:, n:] @ load, np.abs(self.A)

        def evaluate(q: Array) -> Evaluation:
            F, K = -self.springs * q, -np.diag(self.springs)
            for k, batch in enumerate(self.batches):
                moved, control = self._motion(k, q), controls[k]
                increment = self._increment(k, now.contacts[k], moved, at[k])
                force, slopes = increment.force, increment.slopes
                if control.held.any():
                    force, slopes = force.copy(), slopes.copy()
                    given = control.start + to * (control.force - control.start)
                    force[-1, control.held], slopes[:, :, control.held] = given[control.held], 0.0
                for i, port in enumerate(batch.ports):
                    port.add(force[i][port.members], F)
                for (i, j), places in batch.coupled.items():
                    np.add.at(K, (places.felt, places.moving), slopes[i, j, places.members])
            residual, J = q + self.A[:, :n] @ F - free, DenseJacobian(np.eye(n) + self.A[:, :n] @ K)
            return Evaluation(residual, J, terms=lambda: size @ np.r_[np.abs(F) + np.abs(K) @ np.abs(q), np.abs(load)])

        result = newton(evaluate, now.q, options=_NEWTON, scale=scale)
        if not result.converged:  # as of a body that nothing holds until gaps close
            start = self._stuck(now, load, controls, at, to)
            result = newton(evaluate, start, options=_NEWTON, scale=scale)
        contacts = [self._after(k, now.contacts[k], result.x, at[k], controls[k], to) for k in range(len(self.batches))]
        return result, contacts

    def _stuck(self, now: State, load: Array, controls: Sequence[_Control], gaps: Sequence[Array], to: float) -> Array:
        """Motion with all contacts closed and stuck, whatever their forces: a guess, and a size."""
        F, K = np.zeros(self.n), -np.diag(self.springs)
        for k, batch in enumerate(self.batches):
            control, values, before = controls[k], self.values[k], now.contacts[k]
            for i, port in enumerate(batch.ports):
                if i == len(batch.ports) - 1:
                    given = control.start + to * (control.force - control.start)
                    stiff = np.where(control.held, 0.0, values["kn"])
                    force = np.where(control.held, given, stiff * (self.moving[k][i] - gaps[k]))
                else:
                    stiff = values["kt"]
                    force = before.force[i] + stiff * (self.moving[k][i] - before.before[i])
                port.add(force[port.members], F)
                port.add(stiff[port.members], K.reshape(-1)[:: self.n + 1])
        J, right = np.eye(self.n) + self.A[:, : self.n] @ K, self.A @ np.concatenate([-F, load])
        try:
            return np.asarray(np.linalg.solve(J, right))
        except np.linalg.LinAlgError:
            return np.asarray(np.linalg.lstsq(J, right, rcond=None)[0])

    def _increment(self, k: int, before: BatchState, moved: Array, gap: Array) -> Increment:
        values = {**self.values[k], "gap": gap}
        increment = self.batches[k].law.quasi_static(before.force, before.before, moved, values, before.gap)
        assert increment is not None
        return increment

    def _after(self, k: int, before: BatchState, q: Array, gap: Array, control: _Control, to: float) -> BatchState:
        moved = self._motion(k, q)
        increment = self._increment(k, before, moved, gap)
        force = increment.force.copy()
        given = control.start + to * (control.force - control.start)
        force[-1, control.held] = given[control.held]
        return BatchState(
            force, gap, before.slip + increment.slip, increment.closed, increment.slipping, moved
        )  # fmt: skip

    def _control(self, k: int, state: State, target: Target, first: bool) -> _Control:
        """Where the gaps and forces of a batch go: overlaps come in with the first step."""
        batch, values, contacts = self.batches[k], self.values[k], state.contacts[k]
        gap = np.array(values["gap"], dtype=float) if first else contacts.gap.copy()
        held, force = np.zeros(batch.count, dtype=bool), np.zeros(batch.count)
        for i, number in enumerate(batch.numbers):
            if number in target.shortening:
                gap[i] = -target.shortening[number]
            if number in target.forces:
                held[i], force[i], gap[i] = True, target.forces[number], contacts.gap[i]
        return _Control(gap=gap, held=held, force=force, start=contacts.force[-1].copy())

    def _lock(self, state: State, controls: Sequence[_Control]) -> None:
        """Bolts that were tightened by force keep the length that gives it."""
        for contacts, control, values in zip(state.contacts, controls, self.values, strict=True):
            held, kn = control.held, values["kn"]
            contacts.gap = contacts.gap.copy()
            contacts.gap[held] = contacts.before[-1, held] - control.force[held] / kn[held]
            contacts.closed = contacts.closed | held

    def _loads(self, target: Target) -> Array:
        P = np.zeros(self.A.shape[1] - self.n)
        for load in target.loads.values():
            P[self.problem.load_columns.row(load)] = load.cos
        return P

    def _motion(self, k: int, q: Array) -> Array:
        moved = self.moving[k].copy()
        for i, port in enumerate(self.batches[k].ports):
            moved[i][port.members] += q[port.rows]
        return moved

    @staticmethod
    def _has_normal(batch: Batch) -> BoolArray:
        has = np.zeros(batch.count, dtype=bool)
        has[batch.ports[-1].members] = True
        return has

    def rests(self, state: State) -> list[Array]:
        """For each batch the motion at which the tangential springs would have no force, (n_ports - 1, n)."""
        out = []
        for values, contacts in zip(self.values, state.contacts, strict=True):
            elastic = np.broadcast_to(values["kt"] > 0.0, contacts.force[:-1].shape)
            stretched = np.divide(contacts.force[:-1], values["kt"], out=np.zeros(elastic.shape), where=elastic)
            out.append(contacts.before[:-1] - stretched)
        every = [*out, *(contacts.before[:-1] for contacts in state.contacts)]
        size = max((float(np.max(np.abs(part), initial=0.0)) for part in every), default=0.0)
        return [np.where(np.abs(rest) > _ROUNDING * size, rest, 0.0) for rest in out]

    def displacement(self, state: State, outputs: Sequence[str]) -> Array:
        """Displacement of outputs (n_outputs,)."""
        rows = self.problem.direction_matrix([{dof: 1.0} for dof in outputs])
        receptance = self.problem.load_columns.receptance(self.structure, rows, self.directions)
        A = np.asarray(receptance.written().static, dtype=float)
        F = -self.springs * state.q
        for batch, contacts in zip(self.batches, state.contacts, strict=True):
            for i, port in enumerate(batch.ports):
                port.add(contacts.force[i][port.members], F)
        return np.asarray(A[:, self.n :] @ state.loads - A[:, : self.n] @ F)

    def _lost(
        self, target: Target, part: float, result: NewtonResult, now: State, contacts: Sequence[BatchState]
    ) -> Fault:
        """Where there is no equilibrium, which contacts changed last, and what to try."""
        changed = [
            self.problem.elements[batch.numbers[i]]
            for batch, old, new in zip(self.batches, now.contacts, contacts, strict=True)
            for i in np.flatnonzero((old.closed != new.closed) | (old.slipping != new.slipping))
        ]
        sliding = sum(int(np.count_nonzero(old.slipping)) for old in now.contacts)
        opened = sum(int(np.count_nonzero(~old.closed)) for old in now.contacts)
        total = len(self.problem.elements)
        why = "" if result.reason is None else f" ({result.reason.text})"
        about = f"; changing there: {some(changed, _LINES)}" if changed else ""
        what = (
            f"no equilibrium beyond {100.0 * part:.4g} % of the step{why}, with {opened} of {total} contacts open and "
            f"{sliding} slipping{about}"
        )
        remedy = (
            "a part whose contacts all open or slip has none: hold it, tighten the bolts in an earlier step, or lower "
            "the load; otherwise give more increments, or a smaller kn"
        )
        return Fault(("preload", target.name), what, remedy=remedy)


def _supported(problem: Problem, directions: Any) -> tuple[Any, Array]:
    """The structure in harmonic 0 with the reference springs at its ports: friction holds it as normal forces do."""
    structure: Any = problem.structure
    n = len(problem.port_directions)
    if structure.held:
        return structure, np.zeros(n)
    ports = np.asarray(dense(directions), dtype=float)
    supported, springs, free = structure.supported_at(ports, np.ones(n, dtype=bool))
    if free.shape[1]:
        what = f"{free.shape[1]} rigid-body motions of the structure are held by no contact"
        raise InputError(Fault("structure", what, remedy="hold it, or add contacts or bolts that do"))
    return supported, springs


def unmarched(problem: Problem) -> Iterator[Fault]:
    """Contacts whose law has no slow motion."""
    zeros = np.zeros((1, 1))
    for batch, given in zip(problem.batches, problem.inputs.batches, strict=True):
        still = np.repeat(zeros, len(batch.law.ports), axis=0)
        one = {name: np.atleast_1d(value)[:1] for name, value in given.values.items()}
        if batch.law.quasi_static(still, still, still, one) is None:
            names = [problem.elements[e] for e in batch.numbers[:_LINES]]
            kind = type(batch.law).__name__
            what = f"a {kind} cannot be followed through load steps with stick and slip ({', '.join(names)})"
            remedy = "use ss.FrictionContact or ss.PlanarFrictionContact, or give the law the method quasi_static"
            yield Fault("contacts", what, remedy=remedy)
