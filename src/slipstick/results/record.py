"""From points of a branch to the values of every variable that the schema declares."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from slipstick.balance.balance import Balance
from slipstick.balance.compliance import Compliance
from slipstick.balance.evaluation import Adapted, Detail, FrequencySystem, ParameterSystem, Together
from slipstick.balance.inputs import Assigned
from slipstick.balance.problem import Problem
from slipstick.contact.law import Response
from slipstick.results.measures import amplitude
from slipstick.results.postprocessing import Postprocessing
from slipstick.results.schema import Layout, law_variables, layout_of, state_names
from slipstick.results.stability import PointStability, Unjudged, is_wave, judged, stability_values
from slipstick.results.table import ResultTable
from slipstick.results.truncation import EachReaction, Reaction, Reactions, Structures, moved, truncation
from slipstick.solve.continuation import LatestSteps, Step
from slipstick.typing import AnyArray, Array, IntArray, Matrix

_REMEMBERED = 8


class Point(NamedTuple):
    """A point of a branch: the solution and what was measured on its contacts."""

    omega: float
    parameter: float
    """Value of the followed quantity: the frequency itself or the named parameter."""
    kind: str
    """One of ``schema.POINT_KINDS``."""
    peak_of: str
    """Name of the dof whose amplitude peaks here, else empty."""
    x: Array
    """Unknowns of the balance (N,)."""
    detail: Detail
    iterations: int
    residual: float
    """Relative to the sizes of its terms."""
    part: int = 1
    """Number of the part of the branch: 2 where it was also followed from the other end."""
    stability: PointStability | Unjudged | None = None
    """None where stability was not requested."""
    reaction: Reaction | None = None
    """Change of the solution with a residual, for the truncation error; None where there is no Jacobian."""

    @classmethod
    def at(cls, detail: Detail, *, x: Array, residual: float, iterations: int, kind: str, **names: object) -> Point:
        """From the evaluation at a solution."""
        return cls(
            omega=detail.omega,
            x=x,
            kind=kind,
            detail=detail,
            iterations=iterations,
            residual=residual,
            **names,  # type: ignore[arg-type]
        )


@dataclass(frozen=True, kw_only=True)
class Columns:
    """n points as arrays: a row of each attribute of ``Point`` for each."""

    x: Array
    omega: Array
    parameter: Array
    residual: Array
    iterations: IntArray
    kind: NDArray[np.str_]
    peak_of: Sequence[str]
    inputs: Assigned
    """Numbers of contacts and loads."""
    reactions: Reactions
    part: IntArray
    details: Sequence[Detail] = ()
    """None where all that contacts do is still to be had."""
    stability: Sequence[PointStability | Unjudged | None] = ()

    @classmethod
    def of(cls, balance: Balance, points: Sequence[Point]) -> Columns:
        """Of points one by one."""
        inputs = Assigned.of([point.detail.inputs for point in points])
        return cls(
            x=_stack([p.x for p in points], (balance.size,)),
            omega=np.array([p.omega for p in points], dtype=float),
            parameter=np.array([p.parameter for p in points], dtype=float),
            residual=np.array([p.residual for p in points], dtype=float),
            iterations=np.array([p.iterations for p in points], dtype=int),
            kind=np.array([p.kind for p in points], dtype=np.str_),
            peak_of=[p.peak_of for p in points],
            part=np.array([p.part for p in points], dtype=int),
            inputs=inputs if points else Assigned([balance.problem.inputs], np.empty(0, dtype=int)),
            reactions=EachReaction([p.reaction for p in points]),
            details=[p.detail for p in points],
            stability=[p.stability for p in points],
        )

    def __len__(self) -> int:
        return len(self.x)

    def at(self, which: IntArray) -> Columns:
        """Some of them."""
        columns: dict[str, Any] = {name: getattr(self, name)[which] for name in _ARRAYS}
        columns |= {"inputs": self.inputs.at(which), "reactions": self.reactions.at(which)}
        columns |= {name: [getattr(self, name)[i] for i in which] for name in _LISTS if len(getattr(self, name))}
        return replace(self, **columns)


_ARRAYS = ("x", "omega", "parameter", "residual", "iterations", "kind", "part")
_LISTS = ("peak_of", "details", "stability")


class Outputs:
    """Motion of the output dofs from the motion of the contacts and the forces.

    A dof that is a contact port itself needs no receptance. All others are computed by the receptance from forces.
    """

    def __init__(self, balance: Balance, names: Sequence[str]) -> None:
        self.balance, self.names = balance, tuple(names)
        ports = _ports_alone(balance.directions)
        dofs = {name: i for i, name in enumerate(balance.problem.structure.dofs)}
        self._ports = [ports.get(dofs[name]) for name in names]
        self.far = [i for i, port in enumerate(self._ports) if port is None]
        """Which of them are no contact ports."""
        wanted = balance.problem.direction_matrix({names[i]: 1.0} for i in self.far)
        self.receptance = balance.rows_to(wanted) if self.far else None
        self._latest = LatestSteps[tuple[Array, Array]](_REMEMBERED)

    def __len__(self) -> int:
        return len(self.names)

    def motion(self, x: Array, force: Array, P: Array, omega: Array, structures: Structures) -> Array:
        """Coefficients (n, n_outputs, L) of n points: x (n, N), port forces (n, n_ports, L), loads (n, n_loads, L).

        ``structures`` holds for each the parameters of the structure that are not its own.
        """
        b = self.balance
        X = x.reshape(len(x), b.n_ports, b.L)
        out = np.empty((len(x), len(self), b.L))
        for i, port in enumerate(self._ports):
            if port is not None:
                out[:, i] = X[:, port[0]] / port[1]
        if self.far:
            out[:, self.far] = self.far_motion(x, force, P, omega, structures)
        return out

    def far_motion(self, x: Array, force: Array, P: Array, omega: Array, structures: Structures) -> Array:
        """The same of those that are no contact ports, (n, n_far, L)."""
        b = self.balance
        if b.support_springs is not None:
            force = force.copy()
            force[:, :, 0] -= b.support_springs * x.reshape(force.shape)[:, :, 0]
        return self._answer(np.concatenate([force, -P], axis=1), omega, structures)

    def motion_along(self, step: Step, system: FrequencySystem | ParameterSystem) -> tuple[Array, Array]:
        """Motion of the outputs at a step and its derivative along the branch, both (n_outputs, L).

        Those of the last steps are remembered.
        """
        motion = self._latest.known(step)
        if motion is None:
            motion = self._motion_along(step, system)
            self._latest.keep(step, motion)
        return motion

    def _motion_along(self, step: Step, system: FrequencySystem | ParameterSystem) -> tuple[Array, Array]:
        b, tangent, detail = self.balance, step.tangent, step.evaluation.detail
        motion, change = self.assembled(step.x, None), self.assembled(tangent[:-1], None)
        if self.far:
            rate = float(tangent[-1])
            G = b.layout.excitation(detail.forces, detail.inputs.P)
            dG = b.layout.excitation(*system.rates(detail, step.parameter, tangent[:-1], rate))
            b.subtract_support(step.x, G)
            b.subtract_support(tangent[:-1], dG)
            assert self.receptance is not None
            along = None if isinstance(system, FrequencySystem) else system.path.at(step.parameter)[1].structure
            at = Compliance(self.receptance.adjusted(detail.inputs.structure), b.orders, detail.omega, along)
            rates = at.answer(dG)
            if along is None or along:
                rates += rate * at.rate(G)
            motion[self.far] = -at.answer(G).reshape(-1, b.L)
            change[self.far] = -rates.reshape(-1, b.L)
        return motion, change

    def assembled(self, x: Array, far: Array | None) -> Array:
        """Motion of the outputs (n_outputs, L) from that of the ports (N,) and of the outputs that are no port."""
        b = self.balance
        X, out = x.reshape(b.n_ports, b.L), np.empty((len(self), b.L))
        for i, port in enumerate(self._ports):
            if port is not None:
                out[i] = X[port[0]] / port[1]
        if far is not None:
            out[self.far] = far.reshape(-1, b.L)
        return out

    def transposed(self, h: Array) -> tuple[Array, Array]:
        """The transpose of ``assembled``: numbers ``h`` (n_outputs, L) as (N,), and those of outputs without a port."""
        b = self.balance
        out = np.zeros((b.n_ports, b.L))
        for i, port in enumerate(self._ports):
            if port is not None:
                out[port[0]] += h[i] / port[1]
        return out.reshape(-1), h[self.far]

    def _answer(self, G: Array, omega: Array, structures: Structures) -> Array:
        """``-A G`` (n, n_far, L) for forces less loads ``G`` (n, n_columns, L)."""
        assert self.receptance is not None
        out = moved(self.receptance, self.balance.orders, G[:, :, 1:], omega, structures)
        for i, values in enumerate(structures):
            out[i, :, 0] = -(self._static(values) @ G[i, :, 0])
        return out

    def _static(self, values: Mapping[str, float]) -> Array:
        """Static compliance with parameters of the structure, on which that of few depends."""
        assert self.receptance is not None
        return self.receptance.adjusted(values).static


def _ports_alone(directions: Matrix) -> dict[int, tuple[int, float]]:
    """By dof the first port that is along it alone, and its cosine."""
    columns = csc_array(directions)
    columns.eliminate_zeros()
    alone = np.flatnonzero(np.diff(columns.indptr) == 1)
    places = columns.indptr[alone]
    found = zip(columns.indices[places].tolist(), alone.tolist(), columns.data[places].tolist(), strict=True)
    return {dof: (port, cosine) for dof, port, cosine in reversed(list(found))}


class Recorder:
    """Values of all variables at points of a problem's branch, those of stability on request.

    A variable other than the solution that cannot be computed is nan, and ``postprocessing`` has a warning of it.
    """

    def __init__(self, balance: Balance, *, parameter: str = "", stability: bool = False) -> None:
        self.balance, self.parameter, self.stability = balance, parameter, stability
        self.postprocessing = Postprocessing()
        self.outputs = Outputs(balance, balance.problem.outputs or ())

    @cached_property
    def layout(self) -> Layout:
        """Which variables there are, their dimensions and meaning."""
        return layout_of(self.balance.problem, parameter=self.parameter, stability=self.stability)

    def values(self, points: Sequence[Point]) -> dict[str, AnyArray]:
        """Every variable, (n_points, ...)."""
        return self.values_of(Columns.of(self.balance, points), self.further(points))

    def values_of(self, points: Columns, further: Mapping[str, AnyArray] = MappingProxyType({})) -> dict[str, AnyArray]:
        """The same of points in columns, with ``further`` variables."""
        b = self.balance
        x, omega, P = points.x, points.omega, points.inputs.loads
        answers = _Answers(b, points, self.postprocessing)
        force = np.zeros((len(points), b.n_ports, b.L))
        layout = self.layout
        values: dict[str, AnyArray] = {
            name: np.full((len(points), *layout.shape(name)), np.nan)
            for name, declared in layout.variables.items()
            if "contact" in declared.dims
        }
        for k in range(len(b.batches)):
            self._of_batch(k, points, answers, values, force)
        structures = points.inputs.structures
        motion = self.postprocessing.attempt_each(
            "the motion of the outputs",
            lambda at: self.outputs.motion(x[at], force[at], P[at], omega[at], [structures[i] for i in at]),
            len(points), (len(self.outputs), b.L),
        )  # fmt: skip
        outputs = self.outputs.names
        values |= {
            "omega": omega,
            "excitation_frequency": omega * b.problem.load_order,
            "parameter": points.parameter,
            "displacement": motion,
            "amplitude": self.postprocessing.attempt_each(
                "amplitude", lambda at: amplitude(b.harmonics, motion[at]).value, len(points), (len(self.outputs),)
            ),
            "mean": motion[:, :, 0],
            "truncation": self.postprocessing.attempt_each(
                "truncation",
                lambda at: self._truncation(points.at(np.array(at)), motion[at]),
                len(points),
                (),
            ),
            "harmonics_in_use": np.full(len(points), len(b.harmonics.orders), dtype=np.int32),
            "residual": answers.residual,
            "newton_iterations": points.iterations.astype(np.int32),
            "kind": points.kind,
            "branch_part": points.part.astype(np.int32),
            "peak_dof": np.array([outputs.index(p) if p in outputs else -1 for p in points.peak_of], dtype=np.int32),
        }
        for i, adapted in _adapted(points).items():
            values["harmonics_in_use"][i] = adapted.in_use
        if self.stability:
            stability = judged(points.stability, self.postprocessing)
            values |= stability_values(stability, len(layout.labels["rank"]), of_wave=is_wave(b.problem))
        values |= further
        return {name: values[name] for name in layout.variables}

    def further(self, points: Sequence[Point]) -> Mapping[str, AnyArray]:
        """Variables that a subclass adds to the layout."""
        return {}

    def _truncation(self, points: Columns, motion: Array) -> Array:
        """What the harmonics left out would add (n_points,); points with some of the harmonics know it themselves."""
        out, adapted = np.empty(len(points)), _adapted(points)
        for i, solution in adapted.items():
            out[i] = solution.truncation
        others = np.array([i for i in range(len(points)) if i not in adapted], dtype=int)
        some = points.at(others) if adapted else points
        at_states = any(detail.states for detail in some.details)
        asked = Assigned.of([detail.asked for detail in some.details]) if at_states else some.inputs
        out[others] = truncation(self.outputs, some.x, motion[others], some.omega, asked, some.reactions)
        return out

    def _of_batch(self, k: int, points: Columns, answers: _Answers, values: dict[str, AnyArray], force: Array) -> None:
        """Fill in what one batch contributes: variables of its contacts, forces (n_points, n_ports, L)."""
        b, batch = self.balance, self.balance.batches[k]
        at, shape = batch.elements, (batch.count, b.L)
        X = points.x.reshape(len(points), b.n_ports, b.L)
        for i, name in enumerate(batch.law.force_names):
            forces, port = answers.of(k, _force_of(i), shape), batch.ports[i]
            values[f"{name}_force"][:, at] = forces
            port.add(forces[:, port.members], force, 1)
            moved = np.zeros_like(forces)
            moved[:, port.members] = X[:, port.rows]
            values[f"contact_{batch.law.ports[i]}"][:, at] = moved
        values["dissipated_power"][:, at] = points.omega[:, None] * answers.of(
            k, lambda response: response.work, shape[:1]
        )
        surface, place = batch.law.surface_ports, batch.law.ports.index
        along, across = (place(surface[d]) if d in surface else None for d in ("tangential", "normal"))
        given = points.inputs.contacts(k)
        speed = given.speed(np.repeat(points.omega, batch.count))
        values["rubbing_velocity"][:, at] = 0.0 if along is None else speed[along].reshape(-1, batch.count)
        for name, number in (("rubbing_motion", along), ("normal_motion", across)):
            values[name][:, at] = 0.0 if number is None else given.motion[number].reshape(-1, *shape)
        for s, (name, state) in enumerate(zip(state_names(b.problem), b.states, strict=True)):
            if state.batch == k:
                values[name][:, at] = _stack([detail.states[s].values for detail in points.details], shape[:1])
        for name, variable in law_variables(batch.law).items():
            get = (_values_of if variable.source in batch.law.values else _detail_of)(variable.source)
            shown = (batch.count, *values[name].shape[2:])
            unknown = np.full((len(points), *shown), np.nan)
            values[name][:, at] = self.postprocessing.attempt(name, partial(answers.of, k, get, shown), unknown)

    def record(self, point: Point) -> Mapping[str, AnyArray]:
        """Every variable of one point."""
        return {name: value[0] for name, value in self.values([point]).items()}


def unknowns(table: ResultTable, problem: Problem, point: int) -> Array:
    """The unknowns of the balance of a problem at a point of its results, (n_ports, L)."""
    motions = {
        name: table[f"contact_{name}"].to_numpy()[point] for batch in problem.batches for name in batch.law.ports
    }
    out = np.zeros((len(problem.port_directions), problem.harmonics.size))
    for batch in problem.batches:
        for name, port in zip(batch.law.ports, batch.ports, strict=True):
            out[port.rows] = motions[name][batch.elements][port.members]
    return out


def contact_states(table: ResultTable, balance: Balance, point: int) -> Array | None:
    """Values of the contact states (n_states,) at a point of results; None where there are none."""
    names = state_names(balance.problem)
    if not names or any(name not in table for name in names):
        return None
    places = [balance.batches[state.batch].elements for state in balance.states]
    states = np.concatenate([table[name].to_numpy()[point][at] for name, at in zip(names, places, strict=True)])
    return states if np.all(np.isfinite(states)) else None


def _adapted(points: Columns) -> dict[int, Adapted]:
    """Adapted harmonics by number of the point, of those that use part of the set."""
    return {i: detail.adapted for i, detail in enumerate(points.details) if detail.adapted is not None}


class _Answers:
    """Responses of the laws at points (n,); interpolated points, which have none, are evaluated here in one batch.

    ``residual`` (n,) are the relative residuals. Where a law fails at an interpolated point its values are nan.
    """

    def __init__(self, balance: Balance, points: Columns, postprocessing: Postprocessing) -> None:
        self._count, self.residual = len(points), points.residual.copy()
        self._solved = [i for i, detail in enumerate(points.details) if detail.responses]
        self._each = [points.details[i].responses for i in self._solved]
        self._known: list[tuple[list[int], Sequence[Response]]] = []
        others = sorted(set(range(len(points))) - set(self._solved))

        def ask(at: list[int]) -> Array:
            together = Together(balance, points.x[at], points.omega[at], points.inputs.at(at))
            residual = together.relative_residuals()
            self._known.append((at, together.responses))
            return residual

        if others:
            what = "what contacts do at interpolated points"
            self.residual[others] = postprocessing.attempt_each(
                what, lambda at: ask([others[i] for i in at]), len(others), ()
            )

    def of(self, k: int, get: Callable[[Response], Array], shape: tuple[int, ...]) -> Array:
        """Something of the responses of batch ``k``, of ``shape`` each, at all points (n, *shape)."""
        out = np.full((self._count, *shape), np.nan)
        out[self._solved] = _stack([get(responses[k]) for responses in self._each], shape)
        for at, responses in self._known:
            out[at] = get(responses[k]).reshape(-1, *shape)
        return out


def _force_of(i: int) -> Callable[[Response], Array]:
    return lambda response: response.force[i]


def _values_of(name: str) -> Callable[[Response], Array]:
    return lambda response: response.values[name]


def _detail_of(name: str) -> Callable[[Response], Array]:
    return lambda response: np.asarray(getattr(response.detail, name))


def _stack(arrays: Sequence[Array], shape: tuple[int, ...]) -> Array:
    return np.array(arrays, dtype=float).reshape(len(arrays), *shape)
