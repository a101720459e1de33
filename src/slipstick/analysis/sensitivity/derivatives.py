"""Exact derivatives of a branch by named parameters: one factorisation a point gives those by all of them.

``da/ds = a_s - z . R_s`` with ``J^T z = a_X``, at a fixed value of what the branch follows. At a peak the amplitude's
derivative is the same, wherever the peak moves to; its place moves by ``-G_s / G_w`` with ``G`` the slope of the
amplitude along the branch. All coefficients of a motion are had the direct way: ``dU/ds = U_s - U_X J^-1 R_s``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipstick.analysis.peaks.system import FLAT, Extreme, PeakGradient, StateSpace
from slipstick.analysis.sensitivity.linearization import FREQUENCY, Linearization, Move
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import terms
from slipstick.balance.inputs import SURFACE, Inputs
from slipstick.balance.parameters import parameter_path
from slipstick.balance.states import Powered
from slipstick.results.record import Outputs, contact_states, unknowns
from slipstick.results.schema import state_names
from slipstick.results.sensitivities import (
    PointDerivatives,
    direction_of,
    known_problem,
)
from slipstick.results.view import analysis_of
from slipstick.solve.norm import norm
from slipstick.state.contact_state import Carried
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem
    from slipstick.results.solutions import Solutions


_JUMPS = "it sets contacts in motion that are stuck all period, and their mean friction force jumps"
_BEGINS = "contacts at rest without tangential stiffness have no mean friction force yet"
_OPENS = "contacts that just touch, and do not move across, open on one side of its value and close on the other"

_TOUCHING = 1e-12
"""Distance over the gap within which the sides of a contact touch."""

_EQUAL_SLOPES = 1e-6
"""Relative difference up to which two slopes are equal."""
_ROUNDING = 1e-12
"""Slope over amplitude per size of the parameter, up to which it is rounding."""
_SOLVED = 1e-10
"""Residual over its terms, above which a point is corrected first."""
_CORRECTIONS = 4
"""Largest number of corrections."""


class Functional(NamedTuple):
    """A differentiated quantity of a point: ``h . U`` and weighted powers."""

    h: Array
    """Weights of the motion of the outputs, (n_outputs, L); not zero for the last output only."""
    powers: tuple[tuple[Powered, Array], ...]
    """Powers of batches at fixed contact states with weights (n,) that include the effect of the states."""
    gradient: Array
    """Gradient by the unknowns, (N,)."""


class Sensitivities:
    """Derivatives along a branch of vibration at a given frequency; subclasses are for other branches.

    Parameters
    ----------
    branch
        The branch, with its problem.
    parameters
        Names of the parameters.
    dof
        Name of the output.

    Attributes
    ----------
    found
        Variables of the results that are unknowns besides the motion.
    """

    found: tuple[str, ...] = ()

    def __init__(self, branch: Solutions, parameters: tuple[str, ...], dof: str) -> None:
        self.parameters, self.dof, self._table = parameters, dof, branch.table
        self._problem = known_problem(branch)
        self._worn = analysis_of(self._table) == "wear"
        followed = str(self._table.attrs.get("parameter", ""))
        self._followed = "" if self._worn else followed  # at each point the gaps are held as worn
        self._path = parameter_path(self._problem, self._followed) if self._followed else None
        self._along = self._table[branch.followed].to_numpy()
        self._without: Counter[tuple[str, str]] = Counter()
        self._sizes = np.abs([self._problem.parameter(name) or 1.0 for name in parameters])
        self._prepare()

    def _prepare(self) -> None:
        """Make balance and outputs."""
        self.balance = Balance(self._problem)
        self.balance.anchor_if_undamped(float(self._table["omega"].to_numpy()[0]))
        self.outputs = Outputs(self.balance, (self.dof,))

    def at(self, point: int) -> PointDerivatives:
        """Derivatives at one point."""
        here = self._linearized(point)
        if here is None:
            unknown = np.full(len(self.parameters), np.nan)
            states = np.tile(unknown, (len(set(state_names(self.balance.problem))), 1))
            return PointDerivatives(
                unknown, unknown, unknown, states, unknown, unknown, unknown, dict.fromkeys(self.found, unknown)
            )
        parts = list(self._functionals(here))
        ties = list(self._ties(here))
        directions = self._directions(float(self._along[point]))
        rates, found = self._rates(here, (*parts, *ties), directions)
        place = self._place_rates(here, point, directions)
        undecided = self._undecided(here, directions)
        rows = np.where(undecided, np.nan, [*rates, place])
        either = rows[[0, *range(len(parts), len(parts) + len(ties))]]
        above, below = either.max(axis=0), either.min(axis=0)
        least = _ROUNDING * Extreme.largest(self.balance.harmonics, here.motion()[-1]).value / self._sizes
        corner = above - below > np.maximum(_EQUAL_SLOPES * np.maximum(np.abs(above), np.abs(below)), least)
        amplitude, followed = (np.where(corner, np.nan, row) for row in (rows[0], rows[-1]))
        return PointDerivatives(
            amplitude, rows[1], rows[2], states=rows[3 : len(parts)], followed=followed,
            above=np.where(corner, above, amplitude), below=np.where(corner, below, amplitude),
            found={name: np.where(undecided, np.nan, row) for name, row in zip(self.found, found, strict=True)},
        )  # fmt: skip

    def motion_at(self, point: int) -> Array:
        """Derivatives of all coefficients of the output at one point, (n_parameters, L)."""
        here = self._linearized(point)
        if here is None or not self.parameters:
            return np.full((len(self.parameters), self.balance.L), np.nan)
        directions = self._directions(float(self._along[point]))
        rates = self._motions(here, directions)
        return np.where(self._undecided(here, directions)[:, None], np.nan, rates)

    def _rates(
        self, here: Linearization, parts: Sequence[Functional], directions: Directions
    ) -> tuple[Array, Sequence[Array]]:
        """Derivatives (n_parts, K) of functionals along the solutions, and (K,) of each that is ``found``."""
        Z = here.jacobian.solve(np.column_stack([part.gradient for part in parts]), transposed=True).T
        return directions.changes(here, list(zip(parts, Z, strict=True))), ()

    def _slopes(self, here: Linearization, directions: Directions) -> Array:
        """Derivatives (K, N) of the unknowns of the balance."""
        return here.solutions(directions.moves)[0]

    def _motions(self, here: Linearization, directions: Directions) -> Array:
        """Derivatives (K, L) of the motion of the output."""
        return here.solutions(directions.moves)[1][:, -1]

    def _undecided(self, here: Linearization, directions: Directions) -> NDArray[np.bool_]:
        """By which parameters (K,) there is no derivative; why is kept."""
        out = np.zeros(len(self.parameters), dtype=bool)
        for reason, undecided in directions.undecided(here, lambda: self._slopes(here, directions)).items():
            out |= undecided
            for k in np.flatnonzero(undecided):
                self._without[self.parameters[k], reason] += 1
        return out

    def warnings(self) -> Iterator[str]:
        """By which parameters there was no derivative, at how many points, and why."""
        for (name, reason), times in self._without.items():
            yield f"there is no derivative by {name} at {times} {'point' if times == 1 else 'points'}: {reason}"

    def _functionals(self, here: Linearization) -> Iterator[Functional]:
        """Amplitude, mean, power of all contacts, the largest of each contact state."""
        still = np.zeros((len(here.outputs), self.balance.L))
        mean = still.copy()
        mean[-1, 0] = 1.0
        h = still.copy()
        h[-1] = Extreme.largest(self.balance.harmonics, here.motion()[-1]).h
        yield Functional(h, (), here.pull(h=h))
        yield Functional(mean, (), here.pull(h=mean))
        states, powers = here.detail.states, here.powers()
        weights = [np.ones(self.balance.batches[powered.batch].count) for powered in powers]
        for state in states:
            weights[state.batch] += state.gain.T @ state.power_by_value
        pairs = tuple(zip(powers, weights, strict=True))
        yield Functional(still, pairs, np.sum([here.power_pulled(*pair) for pair in pairs], axis=0))
        largest: dict[str, Carried] = {}
        for name, state in zip(state_names(self.balance.problem), states, strict=True):
            if name not in largest or state.values.max() > largest[name].values.max():
                largest[name] = state
        for state in largest.values():
            pair = powers[state.batch], state.gain[int(np.argmax(state.values))]
            yield Functional(still, (pair,), here.power_pulled(*pair))

    def _ties(self, here: Linearization) -> Iterator[Functional]:
        """Other extremes that are as large as the amplitude: along a parameter the larger of them is the amplitude."""
        U = here.motion()[-1]
        for extreme in Extreme.largest(self.balance.harmonics, U).tied(U):
            h = np.zeros((len(here.outputs), self.balance.L))
            h[-1] = extreme.h
            yield Functional(h, (), here.pull(h=h))

    def _place_rates(self, here: Linearization, point: int, directions: Directions) -> Array:
        """``-G_s / G_w``: how the place of a smooth peak moves; nan where there is none."""
        rates, of = np.full(len(directions.moves), np.nan), self._table["peak_dof"].to_numpy()
        if str(self._table["dof"].to_numpy()[of[point]]) != self.dof or of[point] < 0 or self._worn:
            return rates
        value = float(self._along[point])
        surface = StateSpace(self.outputs, here.inputs, self._path)
        over = FREQUENCY if self._path is None else surface.along(value)
        extreme = Extreme.largest(self.balance.harmonics, here.motion()[0])
        slope = PeakGradient(surface, here, value, extreme, over)
        if not abs(slope.value) <= FLAT * slope.size:
            return rates
        beside = slope.displaced(np.ptp(self._along) or abs(value))
        bend = beside.by_motion()
        q = here.jacobian.solve(bend, transposed=True)
        steps = (over,) if self._path is None else tuple(surface.along(v) for v in beside.values)
        bent = bend @ slope.t + beside.along(*steps)
        still = Functional(np.zeros((1, self.balance.L)), (), bend)
        turned = [self._directions(v).moves for v in beside.values]
        explicit = [beside.along(*sides) for sides in zip(*turned, strict=True)]
        return -(directions.changes(here, [(still, q)])[0] + explicit) / bent

    def _linearized(self, point: int) -> Linearization | None:
        """The balance at a point; None where it has no derivatives."""
        near = contact_states(self._table, self.balance, point)
        x = unknowns(self._table, self.balance.problem, point).reshape(-1)
        omega = float(self._table["omega"].to_numpy()[point])
        inputs = self.balance.problem.inputs
        if self._path is not None:
            inputs = self._path.at(float(self._table["parameter"].to_numpy()[point]))[0]
        here = self._solved(x, omega, inputs, near)
        unknown = not np.all(np.isfinite(here.at.residual)) or here.lost or here.jacobian.singular
        return None if unknown else here

    def _solved(self, x: Array, omega: float, inputs: Inputs, near: Array | None) -> Linearization:
        """The balance linearised at the solution, to which points between computed ones are brought first."""
        here = Linearization(self.outputs, x, omega, inputs, near)
        for _ in range(_CORRECTIONS):
            wrong, size = norm(here.at.residual), norm(terms(self.balance, here.x, here.at))
            if not wrong > _SOLVED * size or here.lost or here.jacobian.singular:
                break
            moved = here.x - here.jacobian.solve(here.at.residual)
            corrected = Linearization(self.outputs, moved, omega, inputs, near)
            if not norm(corrected.at.residual) < wrong:
                break
            here = corrected
        return here

    def _directions(self, value: float) -> Directions:
        """Of the parameters, at a value of what the branch follows: some turn with it."""
        if self._path is None:
            return self._unchanged
        return self._directions_of(self._problem.at_parameter(self._followed, value))

    @cached_property
    def _unchanged(self) -> Directions:
        return self._directions_of(self._problem)

    def _directions_of(self, problem: Problem) -> Directions:
        return Directions(problem.inputs, [direction_of(problem, name) for name in self.parameters])


class Directions:
    """Directions in the ``inputs`` of a problem, one for each of K parameters, as a sparse matrix."""

    def __init__(self, inputs: Inputs, directions: Sequence[Inputs]) -> None:
        from scipy.sparse import csr_array, vstack

        self.moves = [Move(inputs=direction) for direction in directions]
        none = csr_array((0, _flat(inputs).size))
        self._flat = vstack([none, *(csr_array(_flat(direction)[None]) for direction in directions)], format="csr")
        self._moved = {
            (k, name)
            for direction in directions
            for k, batch in enumerate(direction.batches)
            for name, array in (*batch.values.items(), *((name, getattr(batch, name)) for name in SURFACE))
            if array.any()
        }
        self._slides = [
            np.array([along.batches[k].slides for along in directions], dtype=bool).reshape(
                len(directions), *batch.velocity.shape
            )
            for k, batch in enumerate(inputs.batches)
        ]

    def changes(self, here: Linearization, parts: Sequence[tuple[Functional, Array]]) -> Array:
        """Changes (n_parts, K) along the solutions of functionals with ``z`` (N,): ``h . U_s + power_s - z . R_s``."""
        on_forces = ((here.columns_pulled(part.h, -z), part.powers) for part, z in parts)
        gradients = [_flat(here.inputs_pulled(psi, powers, self._moved)) for psi, powers in on_forces]
        rates: Array = (self._flat @ np.array(gradients).T).T
        for k, move in enumerate(self.moves):
            if move.inputs is not None and move.inputs.structure:
                R, U = here.structural_change(move.inputs.structure)
                rates[:, k] += [float(np.sum(part.h * U) - z @ R) for part, z in parts]
        return rates

    def undecided(self, here: Linearization, solutions: Callable[[], Array]) -> Mapping[str, NDArray[np.bool_]]:
        """Directions (K,) along which the solution has a corner or jumps, by reason; ``solutions``: slopes (K, N)."""
        jumps, begins, opens = (np.zeros(len(self.moves), dtype=bool) for _ in range(3))
        for k, (batch, response) in enumerate(zip(here.balance.batches, here.detail.responses, strict=True)):
            loose = batch.law.undecided(response)
            if np.any(loose):
                jumps |= np.any(self._slides[k] & loose, axis=(1, 2))
            values, inputs = response.values, [move.inputs.batches[k] for move in self.moves if move.inputs is not None]
            loose = (values["kt"] == 0.0) & ~here.inputs.batches[k].slides.any(axis=0) if "kt" in values else loose[:0]
            if np.any(loose):
                begins |= [bool(np.any(loose & (along.values["kt"] != 0.0))) for along in inputs]
            touching = _touching(here, k)
            if np.any(touching):
                opens |= self._distance_changes(here, k, touching, solutions())
        return {_JUMPS: jumps, _BEGINS: begins, _OPENS: opens}

    def _distance_changes(
        self, here: Linearization, k: int, touching: NDArray[np.bool_], slopes: Array
    ) -> NDArray[np.bool_]:
        """Directions (K,) along which the normal distance of touching contacts (n,) of a batch changes."""
        batch, balance = here.balance.batches[k], here.balance
        i = batch.law.ports.index(batch.law.surface_ports["normal"])
        moved = [direction.inputs.batches[k] for direction in self.moves if direction.inputs is not None]
        distances = np.array([along.values["gap"] - along.motion[i][:, 0] for along in moved])
        own = np.array([np.abs(along.motion[i]).max(axis=1) for along in moved]) + np.abs(distances)
        port = batch.ports[i]
        if port.size:
            dX = slopes.reshape(-1, balance.n_ports, balance.L)
            own[:, port.members] += np.abs(dX[:, port.rows]).max(axis=2)
        return np.asarray(np.any((own > 0.0) & touching, axis=1))


def _touching(here: Linearization, k: int) -> NDArray[np.bool_]:
    """Contacts (n,) of a batch that are neither open nor closed: without normal motion at zero distance."""
    batch, values = here.balance.batches[k], here.detail.responses[k].values
    across = batch.law.surface_ports.get("normal")
    if across is None or "gap" not in values:
        return np.zeros(batch.count, dtype=bool)
    motion = here.balance.layout.motion(k, here.x, here.omega, here.inputs.batches[k])
    Y, gap = motion.Q[batch.law.ports.index(across)], values["gap"]
    least = _TOUCHING * np.maximum(np.abs(Y[:, 0]), np.abs(gap))
    return np.asarray((np.abs(Y[:, 0] - gap) <= least) & (np.abs(Y[:, 1:]).max(axis=1, initial=0.0) <= least))


def _flat(inputs: Inputs) -> Array:
    """All inputs of contacts and loads in one row."""
    arrays = [inputs.P]
    for batch in inputs.batches:
        arrays += [*batch.values.values(), *(getattr(batch, name) for name in SURFACE)]
    return np.concatenate([array.ravel() for array in arrays])
