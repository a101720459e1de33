"""Truncation error: the motion that harmonics outside the set would add, from one evaluation with more of them.

Contact forces hold orders outside the set. They move the structure by ``-A(m omega) F_m``, which the balance leaves out
(THEORY.md (11.1)). That motion changes the forces of the orders in the set, and so their motion: by the last Jacobian
of the point (11.2). What stiff contacts let pass of it is found together with that reaction (11.3). The further orders
are all that are missing below the highest one, and half as many above it, at least two. A set of odd orders under
rubbing lacks the even ones most of all. Loads have no further orders.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from slipstick.balance.compliance import Compliance, FactoredCompliance
from slipstick.balance.evaluation import respond
from slipstick.balance.inputs import Assigned
from slipstick.results.measures import largest_deviation
from slipstick.solve.linear.dense import solution
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.structure.receptance import SMALL, Receptance, mapped
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, BoolArray, ComplexArray, IntArray

if TYPE_CHECKING:
    from slipstick.balance.balance import Balance
    from slipstick.balance.layout import Tangents
    from slipstick.results.record import Outputs

Structures = Sequence[Mapping[str, float]]

_WORTH, _ROUGH = 1e-5, 1e-2
"""Relative motion of the further orders from which the reaction of the set is solved for, a hundred times what they
move next to resonances of 1 % damping; and the error to which an iterative Jacobian solves for it."""

_HELD = 4_000_000
"""Entries of the derivatives of one batch of points: 32 MB."""

_MANY = 1000
"""Entries of a receptance from which it is applied by its modes."""

WARNED_TRUNCATION = 1e-2
"""Truncation error from which results carry a warning."""
_STIFF = 1e-3
"""Estimate from which the contacts' stiffness in the further orders counts: a linear system at each point. It counts
where it makes the estimate smaller: of the first order, it exaggerates next to resonances and where contacts change."""
_LARGEST_SYSTEM = 1000
"""Unknowns of that system up to which it is solved, 40 ms each; beyond, stiff contacts make the estimate too large."""
_LARGEST_BOTH = 200_000
"""These times the unknowns of the set up to which both are found together; beyond, the set is held there: the solutions
of the set for all of them would take longer than the point itself (1860 and 960: 0.4 s)."""


@lru_cache(maxsize=16)
def with_further(harmonics: Harmonics) -> Harmonics:
    """The set with the further orders.

    >>> with_further(Harmonics([0, 1, 3, 5])).orders
    (0, 1, 2, 3, 4, 5, 6, 7, 8)
    """
    return Harmonics(range(harmonics.highest + max(2, ceil(harmonics.highest / 2)) + 1))


class Reaction(NamedTuple):
    """Change of the solution at a point with a residual, by ``J`` (N, N) or by ``J`` bordered with the parameter.

    A bordered Jacobian moves the point across the branch. From there the motion follows the branch back to the same
    parameter: along its tangent and, at a turning point, its curvature.
    """

    jacobian: Jacobian
    tangent: Array | None = None
    """``(x, parameter)`` along the branch (N + 1,)."""
    bend: float = 0.0
    """Curvature: change of the tangent's parameter along the branch."""

    def __call__(self, r: Array) -> Array:
        """``J^-1 r`` (N,)."""
        if self.tangent is None:
            return self.jacobian.solve_correction(r, _ROUGH)
        z = self.jacobian.solve_correction(np.append(r, 0.0), _ROUGH)
        return at_their_parameter(z[None], self.tangent[None], np.array([self.bend]))[0]


def at_their_parameter(z: Array, tangents: Array, bends: Array) -> Array:
    """Changes (k, N) at the same parameter, from those across the branch, ``z`` (k, N + 1)."""
    missing, rate = z[:, -1], tangents[:, -1]
    with np.errstate(invalid="ignore", divide="ignore"):
        # rate s + bend s^2 / 2 = missing
        reach = np.abs(rate) + np.sqrt(rate * rate + 2.0 * np.abs(bends * missing))
        along = np.where(missing == 0.0, 0.0, np.copysign(2.0 * missing / reach, missing * rate))
    return np.asarray(z[:, :-1] - np.where(reach == 0.0, 0.0, along)[:, None] * tangents[:, :-1])


class Reactions(Protocol):
    """A ``Reaction`` of each of n points."""

    @property
    def known(self) -> BoolArray:
        """Which points have one, (n,)."""
        ...

    def at(self, which: Any) -> Reactions:
        """The reactions of some points."""
        ...

    def answers(self, which: IntArray, residuals: Array) -> Array:
        """Changes (k, N) of some points with their residuals (k, N)."""
        ...

    def across(self, which: IntArray, residuals: Array) -> Array:
        """Changes (k, N, r) of some points with several residuals (k, N, r), before they follow the branch back."""
        ...


class EachReaction(Reactions):
    """Reactions that are solved one by one; None where there is none."""

    def __init__(self, each: Sequence[Reaction | None]) -> None:
        self._each = each

    @property
    def known(self) -> BoolArray:
        """Which points have one, (n,)."""
        return np.array([one is not None for one in self._each], dtype=bool)

    def at(self, which: Any) -> EachReaction:
        """The reactions of some points."""
        return EachReaction([self._each[i] for i in np.arange(len(self._each))[which].tolist()])

    def across(self, which: IntArray, residuals: Array) -> Array:
        """One solve for each point."""
        reactions = [one for i in which.tolist() if (one := self._each[i]) is not None]
        out = np.empty(residuals.shape)
        for k, (one, right) in enumerate(zip(reactions, residuals, strict=True)):
            if one.tangent is None:
                out[k] = one.jacobian.solve(right)
            else:
                out[k] = one.jacobian.solve(np.vstack([right, np.zeros(right.shape[1])]))[:-1]
        return out

    def answers(self, which: IntArray, residuals: Array) -> Array:
        """One solve for each point."""
        reactions = [one for i in which.tolist() if (one := self._each[i]) is not None]
        tangents = [one.tangent for one in reactions if one.tangent is not None]
        if len(tangents) < len(reactions):
            return np.array([one(r) for one, r in zip(reactions, residuals, strict=True)])
        across = np.concatenate([residuals, np.zeros((len(residuals), 1))], axis=1)
        z = np.array([one.jacobian.solve_correction(r, _ROUGH) for one, r in zip(reactions, across, strict=True)])
        return at_their_parameter(z, np.array(tangents), np.array([one.bend for one in reactions]))


def truncation(
    outputs: Outputs, x: Array, motion: Array, omega: Array, inputs: Assigned, reactions: Reactions
) -> Array:
    """Largest deviation of the motion left out over that of the motion itself, (n_points,).

    Both are the largest over the period, without the mean, among all relative motions of the contacts and all
    outputs; 0 where nothing moves. ``x`` (n, N) and ``motion`` (n, n_outputs, L) are those of the balance, ``inputs``
    those at the contact states. The reaction of the set is included at points that have one, unless the further orders
    move less than ``_WORTH``.
    """
    balance, n = outputs.balance, len(x)
    h, wide = balance.harmonics, with_further(balance.harmonics)
    within = omega * wide.highest <= balance.receptance.highest
    if not within.all():  # nan beyond the end of a table of receptances
        out = np.full(n, np.nan)
        if within.any():
            out[within] = truncation(
                outputs, x[within], motion[within], omega[within], inputs.at(within), reactions.at(within)
            )
        return out
    held = sum(batch.count * (len(batch.ports) * wide.size) ** 2 for batch in balance.batches)
    most = max(1, _HELD // max(1, held))
    if n > most:
        slices = [slice(first, first + most) for first in range(0, n, most)]
        each = (truncation(outputs, x[at], motion[at], omega[at], inputs.at(at), reactions.at(at)) for at in slices)
        return np.concatenate(list(each))
    size = largest_deviation(h, np.concatenate([x.reshape(n, balance.n_ports, balance.L), motion], axis=1))
    largest = size.max(axis=1, initial=0.0)
    wider = _Wider(outputs, x, omega, inputs, wide)
    free = wider.moved(wider.force)
    added, more = free.copy(), largest_deviation(wide, free).max(axis=1, initial=0.0)
    dense, small = balance.backend.name == "dense", wider.size <= _LARGEST_SYSTEM
    together = reactions.known & (dense and small and wider.size * balance.size <= _LARGEST_BOTH)
    yielding = ~together & small  # the contacts' stiffness in the further orders was not counted yet
    at = np.flatnonzero(yielding & (more > _STIFF * largest))
    if at.size:
        resisted = wider.held(at, free[at])
        less = largest_deviation(wide, resisted).max(axis=1, initial=0.0)
        smaller = less < more[at]
        added[at[smaller]], more[at[smaller]], yielding[at] = resisted[smaller], less[smaller], False
    at = np.flatnonzero(reactions.known & (more > _WORTH * largest))
    if at.size:
        more[at] = largest_deviation(wide, wider.with_reaction(at, added[at], reactions)).max(axis=1, initial=0.0)
    for these, reacting in ((together, reactions), (reactions.known & yielding, None)):
        at = np.flatnonzero(these & (more > _STIFF * largest))
        if at.size:
            passed = wider.with_reaction(at, wider.held(at, free[at], reacting), reactions)
            more[at] = np.minimum(more[at], largest_deviation(wide, passed).max(axis=1, initial=0.0))
    return np.asarray(np.divide(more, largest, out=np.zeros_like(more), where=largest > 0))


class _Wider:
    """The further orders beside those of a set, at n points.

    Motions (n, n_rows, L') are those of the ports and then of the outputs, in all coefficients of the ``wide`` set.

    Attributes
    ----------
    force
        Forces at the ports (n, n_ports, k), in the coefficients of the further orders.
    size
        Coefficients of the further orders at all ports.
    """

    def __init__(self, outputs: Outputs, x: Array, omega: Array, inputs: Assigned, wide: Harmonics) -> None:
        self._outputs, self._balance, self._omega, self._structures = outputs, outputs.balance, omega, inputs.structures
        b, h = outputs.balance, outputs.balance.harmonics
        further = [m for m in wide.orders if m not in h.orders]
        self._orders, self._L = np.array(further, dtype=float), wide.size
        self._kept, self._new = wide.columns(h.orders), wide.columns(further)
        self.size = b.n_ports * self._new.size
        n, force = len(x), np.zeros((len(x), b.n_ports, wide.size))
        self._tangents = list[dict[tuple[int, int], Array]]()
        for k, batch in enumerate(b.batches if n else ()):
            response = respond(b, k, x, omega, inputs.contacts(k), wide)[1]
            for port, F in zip(batch.ports, response.force, strict=True):
                port.add(F.reshape(n, batch.count, -1)[:, port.members], force, 1)
            self._tangents.append({
                pair: T.reshape(n, batch.count, *T.shape[1:])
                for pair, T in response.by_motion.items() if pair in batch.coupled
            })  # fmt: skip
        self.force = force[..., self._new]

    @property
    def _receptances(self) -> list[Receptance]:
        of_outputs = self._outputs.receptance
        return [self._balance.receptance, *([] if of_outputs is None else [of_outputs])]

    def moved(self, force: Array, at: Any = slice(None)) -> Array:
        """Motion by forces (k, n_ports, ...) of the further orders, at some points."""
        structures = [self._structures[i] for i in np.arange(len(self._omega))[at].tolist()]
        loaded, omega = _loaded(self._balance, force), self._omega[at]
        parts = [moved(one, self._orders, loaded, omega, structures)[..., 1:] for one in self._receptances]
        out = np.zeros((len(force), sum(part.shape[1] for part in parts), self._L))
        out[..., self._new] = np.concatenate(parts, axis=1)
        return out

    def with_reaction(self, at: IntArray, change: Array, reactions: Reactions) -> Array:
        """Motions of the further orders at some points, with what they change in the set."""
        b, change = self._balance, change.copy()
        where = self._omega[at], [self._structures[i] for i in at]
        pairs = zip(b.batches, self._tangents, strict=True)
        tangents = [{pair: T[np.ix_(at, batch.coupled[pair].members)] for pair, T in by.items()} for batch, by in pairs]
        right = _answered(b, _changes(b, tangents, change)[..., self._kept], *where)
        answers = reactions.answers(at, right)
        change[:, : b.n_ports, self._kept] = -np.reshape(answers, (len(at), b.n_ports, -1))
        if self._outputs.receptance is not None:
            G = _loaded(b, _changes(b, tangents, change)[..., self._kept])
            change[:, b.n_ports :, self._kept] = moved(self._outputs.receptance, b.orders, G[..., 1:], *where)
        return change

    def held(self, at: IntArray, free: Array, reactions: Reactions | None = None) -> Array:
        """Motions of the further orders at some points where the contacts' stiffness acts on them, of those without,
        ``free``.

        ``(1 + A D) X = free``: stiff contacts let pass far less than their forces would move the structure alone. With
        ``reactions`` the set moves as well, and ``D`` is the stiffness that is left of the contacts then.
        """
        out, together = free.copy(), max(1, _HELD // (self._balance.n_ports * self._L) ** 2)
        for first in range(0, at.size, together):
            part = slice(first, first + together)
            out[part] = self._held(at[part], free[part], reactions)
        return out

    def _held(self, at: IntArray, free: Array, reactions: Reactions | None) -> Array:
        b, new, kept, ports, k = self._balance, self._new, self._kept, self._balance.n_ports, at.size
        stiffness = self._stiffness(at)
        D = _part(stiffness, new, new)
        if reactions is not None:
            right = _products(self._of_set(at), _part(stiffness, kept, new)).reshape(k, b.size, -1)
            back = _part(stiffness, new, kept).reshape(k, -1, b.size)
            D -= (back @ reactions.across(at, right)).reshape(D.shape)
        A = self._conjugates(self._orders, at)
        A[..., 0] = 0.0
        still = np.zeros((k, ports, 1, self.size))
        answered = _products(A, np.concatenate([still, D], axis=2))[:, :, 1:]
        passing = np.eye(self.size) + answered.reshape(k, self.size, -1)
        solved = [solution(one, X.ravel()) for one, X in zip(passing, free[:, :ports, new], strict=True)]
        found = np.array([i for i, X in enumerate(solved) if X is not None], dtype=np.intp)  # others: exactly singular
        out = free.copy()
        if found.size:
            X = np.array([solved[i] for i in found])
            out[found] = self.moved(self.force[at[found]] + (D[found] @ X[:, None, :, None])[..., 0], at[found])
        return out

    def _of_set(self, at: IntArray) -> ComplexArray:
        """``conj(A)`` of the orders of the set at some points, as the Jacobians are made with."""
        b = self._balance
        if b.springs is None and at.size > 1:
            return self._conjugates(b.orders, at)
        each = [b.compliance(float(self._omega[i]), self._structures[i]) for i in at.tolist()]
        return np.array([one.value for one in each if isinstance(one, Compliance)])  # dense Jacobians have no others

    def _conjugates(self, orders: Array, at: IntArray) -> ComplexArray:
        """``conj(A)`` (k, n_columns, n_ports, 1 + n_orders) at some points."""
        structures = [self._structures[i] for i in at.tolist()]
        return self._balance.receptance.conjugates_of_each(orders, self._omega[at], structures)[:, 0]

    @cached_property
    def _places(self) -> list[dict[tuple[int, int], tuple[IntArray, IntArray, IntArray]]]:
        """By batch and pair of ports: members in the order of their places, the places, and where each begins."""
        out = []
        for batch, by_pair in zip(self._balance.batches, self._tangents, strict=True):
            places = {}
            for pair in by_pair:
                members, felt, moving = batch.coupled[pair]
                place = felt * self._balance.n_ports + moving
                order = np.argsort(place, kind="stable")
                places[pair] = (members[order], *np.unique(place[order], return_index=True))
            out.append(places)
        return out

    def _stiffness(self, at: IntArray) -> Array:
        """Derivatives (k, n_ports, n_ports, L', L') of all forces by all motions, at some points."""
        ports = self._balance.n_ports
        T = np.zeros((at.size, ports * ports, self._L, self._L))
        for by_pair, places in zip(self._tangents, self._places, strict=True):
            for pair, tangent in by_pair.items():
                # elements may have ports in common: sums of those at each place, many times faster than np.add.at
                members, place, starts = places[pair]
                T[:, place] += np.add.reduceat(tangent[np.ix_(at, members)], starts, axis=1)
        return T.reshape(at.size, ports, ports, self._L, self._L)


def _part(stiffness: Array, rows: IntArray, columns: IntArray) -> Array:
    """Those (k, n_ports, r, n_ports * c) of r coefficients of the forces by c of the motions."""
    part = stiffness[..., rows[:, None], columns].swapaxes(2, 3)
    return part.reshape(*part.shape[:3], -1)


def _products(value: ComplexArray, F: Array) -> Array:
    """``A F`` (k, n_rows, L, c) of forces at the ports (k, n_ports, L, c), by ``conj(A)``."""
    A = value[:, : F.shape[1]].transpose(0, 3, 2, 1)
    out = np.empty((len(F), A.shape[2], *F.shape[2:]))
    out[:, :, 0] = A[:, 0].real @ F[:, :, 0]
    z = A[:, 1:] @ (F[:, :, 1::2] + 1j * F[:, :, 2::2]).swapaxes(1, 2)
    out[:, :, 1::2], out[:, :, 2::2] = z.real.swapaxes(1, 2), z.imag.swapaxes(1, 2)
    return out


def _changes(balance: Balance, tangents: Tangents, change: Array) -> Array:
    """Change of the forces (n, n_ports, L') by a change (n, n_ports or more, L') of the motion at the ports."""
    out = np.zeros((len(change), balance.n_ports, change.shape[2]))
    for batch, by_port in zip(balance.batches, tangents, strict=True):
        for pair, tangent in by_port.items():
            _, felt, moving = batch.couplings[pair]
            forces = (tangent @ change[:, moving, :, None])[..., 0]
            np.add.at(out.swapaxes(0, 1), felt, forces.swapaxes(0, 1))  # elements may have a port in common
    return out


def _loaded(balance: Balance, F: Array) -> Array:
    """Forces at the ports (n, n_ports, k) with those of the loads, zero."""
    return np.concatenate([F, np.zeros((len(F), balance.n_loads, F.shape[2]))], axis=1)


def _answered(balance: Balance, F: Array, omega: Array, structures: Structures) -> Array:
    """``A F`` (n, N) for forces at the ports (n, n_ports, L), with the receptance that the Jacobian is made with."""
    if balance.springs is None and isinstance(balance.receptance.static, np.ndarray):
        out = -moved(balance.receptance, balance.orders, _loaded(balance, F[..., 1:]), omega, structures)
        for receptance, part in balance.receptance.adjusted_runs(structures):
            out[part, :, :1] = mapped(receptance.static[:, : balance.n_ports], F[part, :, :1])
        return out.reshape(len(F), -1)
    pairs = np.zeros((*F.shape[:2], balance.L + 1))
    pairs[..., 0], pairs[..., 2:] = F[..., 0], F[..., 1:]
    at = (balance.compliance(float(w), values) for w, values in zip(omega, structures, strict=True))
    return np.array([one.answer(G) for one, G in zip(at, pairs.view(complex), strict=True)])


def truncation_sentence(
    name: str, values: Array, estimate: Array, unit: str = "rad/s", asked: float | None = None
) -> str | None:
    """A warning where harmonics are missing, None where they are not.

    ``name`` is the quantity of ``values`` (n,), ``unit`` that of frequencies, ``asked`` the requested accuracy.
    """
    limit = min(WARNED_TRUNCATION, asked or WARNED_TRUNCATION)
    if not np.any(estimate > limit):  # nan: unknown
        return None
    worst = int(np.nanargmax(estimate))
    above, least = int(np.sum(estimate > limit)), 100.0 * limit
    where = f"{name} = {values[worst]:.6g}" + (f" {unit}" if name == "omega" else "")
    percent = 100.0 * estimate[worst]
    most = f"{percent:.2g}" if percent < 99.5 else f"{percent:.0f}"
    return (
        f"the harmonics left out would add about {most} % of the amplitude at {where} (and more "
        f"than {least:g} % at {above} of {estimate.size} points): keep more harmonics"
    )


def moved(receptance: Receptance, orders: Array, G: Array, omega: Array, structures: Structures) -> Array:
    """``-A G`` (n, n_rows, 1 + 2 k) for forces (n, n_columns, 2 k), harmonic 0 zero.

    ``structures`` (n) holds the parameters of the structure at each point that are not its own.
    """
    out = np.zeros((len(G), receptance.static.shape[0], 1 + 2 * orders.size))
    for adjusted, part in receptance.adjusted_runs(structures):
        out[part] = _moved(adjusted, orders, G[part], omega[part])
    return out


def _moved(receptance: Receptance, orders: Array, G: Array, omega: Array) -> Array:
    """The same of one structure, in slices of limited memory."""
    n = orders.size
    if receptance.static.size > _MANY and receptance.summed:
        return _moved_by_modes(receptance, orders, G, omega)
    out = np.zeros((len(G), receptance.static.shape[0], 1 + 2 * n))
    slices = max(1, int(4e6 / max(1, n * receptance.static.size)))
    for first in range(0, len(G) if n else 0, slices):
        w, g = omega[first : first + slices], G[first : first + slices]
        out[first : first + slices, :, 1:] = -receptance.answer(orders, w, g)
    return out


def _moved_by_modes(receptance: Receptance, orders: Array, G: Array, omega: Array) -> Array:
    """The same without a receptance between all ports, which would be large."""
    rows, k = receptance.static.shape[0], orders.size
    out, together = np.zeros((len(G), rows, 1 + 2 * k)), len(G) if receptance.static.size > SMALL else 1
    for first in range(0, len(G), max(1, together)):
        w, F = (part[first : first + together] for part in (omega, G))
        n = len(w)
        force = np.zeros((F.shape[1], 1 + n * k), dtype=complex)
        force[:, 1:] = (F[:, :, 0::2] + 1j * F[:, :, 1::2]).transpose(1, 0, 2).reshape(-1, n * k)
        answer = FactoredCompliance(receptance.factors(orders, w)).answer(force)
        answered = answer.reshape(rows, -1)[:, 1:].reshape(rows, n, 2 * k)
        out[first : first + n, :, 1:] = -answered.transpose(1, 0, 2)
    return out
