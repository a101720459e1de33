"""What is to be computed: a structure, its rubbing contacts, its loads and the harmonics kept."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from numbers import Real as Number
from types import MappingProxyType, SimpleNamespace
from typing import Any, Protocol, runtime_checkable

import numpy as np
from scipy import sparse

from slipstick.balance.base_motion import LoadColumns, load_columns
from slipstick.balance.checks import problem_faults
from slipstick.balance.contact_words import shown_quantities
from slipstick.balance.contacts import PER_AREA, ContactPair, prescribed
from slipstick.balance.inputs import SURFACE, ContactInputs, Inputs
from slipstick.balance.layout import Batch, batches_of
from slipstick.balance.loads import Load
from slipstick.balance.parameters import FACTORS, Parts, Target, changed, mean_per_area, parameter_target
from slipstick.balance.states import pairs_at_start
from slipstick.balance.support import Support, support_of
from slipstick.contact.rest import REST
from slipstick.contact.rubbing import common_period
from slipstick.errors import Fault, InputError
from slipstick.faults import (
    Gathering,
    names,
    number,
    one,
    several,
    shown,
    text,
    warn,
    whole,
    wrong,
)
from slipstick.html import dofs_words, html_table, some
from slipstick.state.contact_state import ContactState, StateModel
from slipstick.state.thermal.model import ThermalModel
from slipstick.structure.protocol import Structure
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, Matrix, Orders, Real
from slipstick.units import Units, is_modal_coordinate

MOST_OUTPUTS = 100
"""Default number of outputs of a structure with more dofs."""

DENSE_DIRECTIONS = 2**18
"""Entries (2 MB) up to which a matrix of directions is a dense array."""
_FEW_COLUMNS = 64
"""Columns up to which it is a dense array of any size."""


@runtime_checkable
class Preloaded(Protocol):
    """A state from which vibration begins: what ``ss.preload`` returns."""

    def applied(self, contacts: Sequence[ContactPair], loads: Sequence[Load]) -> tuple[list[ContactPair], list[Load]]:
        """Contacts and loads of the vibration."""


@dataclass(frozen=True, init=False)
class Problem:
    """Steady periodic vibration of a structure with friction contacts under rubbing motion (THEORY.md sections 1, 9).

    Parameters
    ----------
    structure
        Anything that is a ``Structure``.
    contacts, loads
        The contacts and the loads; a single one will do.
    harmonics
        Harmonics of the fundamental frequency kept in the balance; orders such as ``[0, 1, 3]``, or a count such as 10
        for ``0..10``, will do.
    outputs
        Names of the dofs in the results; by default all of at most 100, else the first 100 with
        those that are loaded or in contact; coordinates of modes ("mode 1") only where they are named.
    period_ratio
        ``T_p / T_u = j1 / j2``, period of the excitation over that of the rubbing motion. Harmonics of loads and of
        rubbing motions count their own frequency; ``omega`` is always the principal one.
    title
        Written on results.
    units
        Names of the units of length, force, time and temperature, such as ``{"length": "mm", "time": "s"}``: labels of
        results, figures and messages. Nothing is converted; numbers are of one consistent system in any case. Those
        of an imported model are taken where none are given, and others are refused.
    load, friction
        Factors on all loads and on all friction coefficients: the parameters "load" and "friction".
    thermal
        How friction heats the contacts and what that does to mu, kt, kn: these then stand for the values at the
        background temperature and are taken from the curves. None: nothing depends on temperature.
    states
        What contacts carry besides: models of your own, each a ``slipstick.state.contact_state.StateModel``.
    told
        Warnings that analyses of this problem gave already, or of the one it is a copy of: none is given twice. None:
        none is given at all; who builds it so shows ``slipstick.balance.physics_checks.problem_warnings``.
    preload
        What ``ss.preload`` returns: the vibration begins from that state. Its static loads take the place of those
        given here, and bolts have the length they were given.

    Raises
    ------
    InputError
        With one sentence for each fault: what is of another kind, or names what is not there. What can be computed but
        is suspicious is reported by each analysis, before it computes; a problem by itself warns of nothing.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    >>> damper = ss.ContactPair(name="damper", contact=law, tangential="x", rubbing=ss.RubbingMotion(velocity=10.0))
    >>> problem = ss.Problem(structure, contacts=damper, loads=ss.Load(dof="x", sin=100.0), harmonics=10)
    >>> problem.with_parameter("damper.mu", 0.5).parameter("damper.mu")
    0.5
    """

    structure: Structure
    contacts: Sequence[ContactPair]
    loads: Sequence[Load]
    harmonics: Harmonics
    outputs: Sequence[str] | None
    period_ratio: tuple[int, int]
    title: str
    units: Units
    load: float
    friction: float
    thermal: ThermalModel | None
    told: frozenset[str] | None = field(repr=False, compare=False)
    states: Sequence[StateModel] = ()

    def __init__(
        self,
        structure: Structure,
        *,
        contacts: ContactPair | Iterable[ContactPair] = (),
        loads: Load | Iterable[Load] = (),
        harmonics: Orders = 5,
        outputs: str | Iterable[str] | None = None,
        period_ratio: Sequence[int] = (1, 1),
        title: str = "",
        units: Units | Mapping[str, str] = MappingProxyType({}),
        load: Real = 1.0,
        friction: Real = 1.0,
        thermal: ThermalModel | None = None,
        states: StateModel | Iterable[StateModel] = (),
        told: Iterable[str] | None = frozenset(),
        preload: Preloaded | None = None,
    ) -> None:
        if preload is not None:
            contacts, loads = _preloaded(preload, contacts, loads)
        arguments = {
            "structure": structure, "contacts": contacts, "loads": loads, "harmonics": harmonics, "outputs": outputs,
            "period_ratio": period_ratio, "title": title, "units": units, "load": load, "friction": friction,
            "thermal": thermal, "states": states, "told": told,
        }  # fmt: skip
        for name, value in arguments.items():
            object.__setattr__(self, name, value)
        values, faults = _right_kinds(self)
        for name, value in values.items():
            object.__setattr__(self, name, value)
        wrong = {str(name) for fault in faults for name in fault.where[:1]}
        if self.outputs is None and "structure" not in wrong:
            object.__setattr__(self, "outputs", tuple(self._default_outputs()))
        faults += problem_faults(self, wrong)
        if faults:
            raise InputError(faults)
        for state in self.contact_states if self.batches else ():
            object.__setattr__(self, "contacts", pairs_at_start(self.contacts, self.batches[state.batch], state))

    def preloaded(self, preload: Preloaded) -> Problem:
        """A copy whose vibration begins from the state that ``ss.preload`` found."""
        contacts, loads = _preloaded(preload, self.contacts, self.loads)
        return replace(self, contacts=contacts, loads=loads)

    def _repr_html_(self) -> str:
        return problem_html(self)

    def warn(self, sentences: Sequence[str]) -> None:
        """Give those warnings of an analysis that were not given yet."""
        if self.told is not None:
            new = [sentence for sentence in dict.fromkeys(sentences) if sentence not in self.told]
            object.__setattr__(self, "told", self.told | set(new))
            warn(new)

    def _default_outputs(self) -> list[str]:
        """The first dofs, and those beyond them that are loaded or in contact, in the order of the structure.

        Coordinates of modes are left out where there are other dofs: they are no motion of a place.
        """
        wanted = {load.dof for load in self.loads}
        wanted |= {dof for pair in self.contacts for dof in pair.dofs}
        places = [dof for dof in self.structure.dofs if not is_modal_coordinate(dof)] or self.structure.dofs
        return [dof for i, dof in enumerate(places) if i < MOST_OUTPUTS or dof in wanted]

    @property
    def batches(self) -> tuple[Batch, ...]:
        """The contacts by kind of law, as they are computed."""
        return self._placed[0]

    @property
    def port_directions(self) -> list[Mapping[str, float]]:
        """Direction cosines of every contact port, batch by batch and port by port."""
        return self._placed[1]

    @cached_property
    def _placed(self) -> tuple[tuple[Batch, ...], list[Mapping[str, float]]]:
        return batches_of(self.contacts)

    @cached_property
    def elements(self) -> tuple[str, ...]:
        """Names of the contacts, those of one pair with many each by its own."""
        return tuple(name for pair in self.contacts for name in pair.elements)

    @property
    def preloaded_elements(self) -> frozenset[str]:
        """Names of the contacts whose motions at rest load steps have found."""
        known = (pair for pair in self.contacts if pair.contact.values.get(REST) is not None)
        return frozenset(name for pair in known for name in pair.elements)

    @cached_property
    def contact_states(self) -> tuple[ContactState, ...]:
        """What contacts carry beside motion, each state for those of one kind of law; slow ones first."""
        models = [*([] if self.thermal is None else [self.thermal]), *self.states]
        laws = [batch.law for batch in self.batches]
        names = [[self.elements[e] for e in batch.numbers] for batch in self.batches]
        states = [state for model in models for state in model.of(laws, names)]
        return tuple(sorted(states, key=lambda state: not state.slow))

    @cached_property
    def orders(self) -> tuple[int, int]:
        """Harmonics of the fundamental frequency on which excitation and rubbing motion sit [THEORY.md (1.2)]."""
        return common_period(*self.period_ratio)

    @cached_property
    def support(self) -> Support | None:
        """What holds a structure in harmonic 0 whose stiffness is singular; None where it is held by itself."""
        return support_of(self)

    @property
    def supported_structure(self) -> Structure:
        """The structure as its contacts hold it in harmonic 0."""
        return self.structure if self.support is None else self.support.structure

    @property
    def load_order(self) -> int:
        """Harmonic of the fundamental frequency on which the excitation sits."""
        return self.orders[0]

    @property
    def rubbing_order(self) -> int:
        """Harmonic of the fundamental frequency on which the rubbing motion sits."""
        return self.orders[1]

    @cached_property
    def load_columns(self) -> LoadColumns:
        """What the loads act on, each once."""
        return load_columns(self)

    def narrowed(self, harmonics: Harmonics) -> Problem:
        """The same with some of its harmonics: what loads and rubbing motions are on others is left out.

        It is not stated anew, so nothing is checked again or warned of; ``load_columns`` stay, loaded or not.
        """
        kept = set(harmonics.orders)
        loads = tuple(load for load in self.loads if load.harmonic * self.load_order in kept)
        contacts = tuple(
            pair
            if all(m * self.rubbing_order in kept for m in pair.rubbing.orders)
            else replace(pair, rubbing=pair.rubbing.narrowed(kept, self.rubbing_order))
            for pair in self.contacts
        )
        self.load_columns  # noqa: B018  made once, for the copy too
        return self.copied(harmonics=harmonics, loads=loads, contacts=contacts, told=None)

    def copied(self, **fields: Any) -> Problem:
        """A copy with other values of fields that are known to be right, on the same structure, ports and columns."""
        new = copy(self)
        new.__dict__.pop("inputs", None)
        for name, value in fields.items():
            object.__setattr__(new, name, value)
        return new

    def load_coefficients(self) -> Array:
        """Coefficients of the loads on ``load_columns``, (n, L), factor included: forces, or motions of supports."""
        P = np.zeros((len(self.load_columns.places), self.harmonics.size))
        for load in self.loads:
            row, order = self.load_columns.row(load), load.harmonic * self.load_order
            P[row, self.harmonics.index(order, "c")] += load.cos
            if order:
                P[row, self.harmonics.index(order, "s")] += load.sin
        return self.load * P

    @cached_property
    def inputs(self) -> Inputs:
        """All numbers of contacts and loads, by batch."""
        moving = [prescribed(pair, self.harmonics, self.rubbing_order) for pair in self.contacts]
        return Inputs(
            batches=tuple(self._contact_inputs(batch, moving) for batch in self.batches), P=self.load_coefficients()
        )

    def _contact_inputs(self, batch: Batch, moving: Sequence[Mapping[str, Array]]) -> ContactInputs:
        factor = {parameter: getattr(self, name) for name, parameter in batch.law.factors.items()}
        values = {
            name: factor.get(name, 1.0) * np.array([self.contacts[p].values(name)[k] for p, k in batch.members])
            for name in batch.law.values
        }
        surface = {
            name: np.ascontiguousarray(np.stack([moving[p][name][:, k] for p, k in batch.members], axis=1))
            for name in SURFACE
        }
        return ContactInputs(values=values, **surface)

    def contact_values(self, name: str) -> Array:
        """A parameter of every contact, (n_contacts,), with the factor on it; nan for laws that do not have it."""
        out = np.full(len(self.elements), np.nan)
        for batch, contact_inputs in zip(self.batches, self.inputs.batches, strict=True):
            if name in contact_inputs.values:
                out[batch.elements] = contact_inputs.values[name]
        return out

    @property
    def relative(self) -> bool:
        """Whether a support moves: all motion is then relative to it."""
        return any(load.base is not None for load in self.loads)

    def direction_matrix(self, directions: Iterable[Mapping[str, float]]) -> Matrix:
        """Direction cosines on all dofs of the structure, (n_dofs, n_directions); sparse where there are many."""
        return direction_vectors(self.structure.dofs, list(directions))

    def parameter_target(self, name: str) -> Target:
        """What a named parameter such as "tip.velocity", "load.x.phase" or "load" is; InputError if there is none."""
        return self._target(self, name)

    def _target(self, parts: Parts, name: str) -> Target:
        """The same in parts of which some are changed already."""
        target = parameter_target(parts, name)
        for state in self.contact_states if target.members else ():
            fault = state.parameter_fault(name, target.quantity, target.places(self.batches[state.batch]))
            if fault is not None:
                raise InputError(fault)
        return target

    def parameter(self, name: str) -> float:
        """Value of a named parameter; of several contacts, the mean."""
        target = self.parameter_target(name)
        if target.load is not None:
            return target.load.value(target.quantity)
        if target.structure:
            return self.structure.every_value[target.quantity]
        if not target.members:
            return float(getattr(self, target.quantity))
        if target.quantity.endswith(PER_AREA):
            return mean_per_area(self.contacts, target)
        values = [self.contacts[p].values(target.quantity) for p, k in target.members]
        return float(np.mean([v[k] for v, (_, k) in zip(values, target.members, strict=True)]))

    def with_parameter(self, name: str, value: float) -> Problem:
        """A copy with a named parameter changed; raises InputError where the value is not allowed."""
        return replace(self, **self._changed([(name, value)]))

    def at_parameter(self, name: str, value: float) -> Problem:
        """As ``with_parameter`` on the way along a curve: gives no warning."""
        return replace(self, told=None, **self._changed([(name, value)]))

    def at_parameters(self, values: Mapping[str, float]) -> Problem:
        """The same with several, set one after the other: what is allowed is judged of all together."""
        return replace(self, told=None, **self._changed(values.items()))

    def _changed(self, values: Iterable[tuple[str, float]]) -> dict[str, Any]:
        parts = {name: getattr(self, name) for name in ("contacts", "loads", "structure")}
        new: dict[str, Any] = {}
        for name, value in values:
            now = SimpleNamespace(**{**parts, **new})
            new |= changed(now, self._target(now, name), name, number(name, value))
        return new


def _preloaded(preload: object, contacts: Any, loads: Any) -> tuple[list[ContactPair], list[Load]]:
    """Contacts and loads as a preload leaves them."""
    checks = Gathering()
    state = checks.take(one, "preload", preload, Preloaded, "what ss.preload returns")
    pairs = checks.take(several, "contacts", contacts, ContactPair, "an ss.ContactPair")
    acting = checks.take(several, "loads", loads, Load, "an ss.Load")
    checks.end()
    assert state is not None
    return state.applied(pairs or (), acting or ())


def _right_kinds(problem: Problem) -> tuple[dict[str, Any], list[Fault]]:
    """The fields in the form that is computed with, and what is of another kind; of lists, what is right stays."""
    checks, structure = Gathering(), problem.structure
    if not isinstance(structure, Structure):
        expected = "one such as ss.MatrixStructure(M=..., K=..., dofs=...)"
        like = hasattr(structure, "project") and not isinstance(structure, type)
        remedy = "derive its class from ss.models.Structure" if like else ""
        checks.faults.append(Fault("structure", found=shown(structure), expected=expected, remedy=remedy))
    values: dict[str, Any] = {
        "contacts": checks.take(several, "contacts", problem.contacts, ContactPair, "an ss.ContactPair"),
        "loads": checks.take(several, "loads", problem.loads, Load, "an ss.Load"),
        "harmonics": checks.take(Harmonics.of, problem.harmonics),
        "period_ratio": checks.take(_ratio, problem.period_ratio),
        "title": checks.take(text, "title", problem.title),
        "units": checks.take(_units, problem),
    }
    for factor, on in FACTORS.items():
        values[factor] = checks.take(number, factor, getattr(problem, factor), f"a number, the factor on {on}")
    checks.faults[:] = [_not_exchanged(problem, fault) for fault in checks.faults]
    if problem.outputs is not None:
        values["outputs"] = checks.take(names, "outputs", problem.outputs)
    if problem.thermal is not None:
        checks.take(one, "thermal", problem.thermal, ThermalModel, "an ss.ThermalModel or None")
    states = checks.take(several, "states", problem.states, StateModel, "a StateModel")
    values["states"] = states
    if problem.told is not None:
        values["told"] = checks.take(names, "told", problem.told, "warnings given already, or None")
        values["told"] = frozenset(values["told"] or ())
    for name, kind in (("contacts", ContactPair), ("loads", Load)):
        if values[name] is None:
            mixed = getattr(problem, name)
            values[name] = tuple(x for x in mixed if isinstance(x, kind)) if isinstance(mixed, list | tuple) else ()
    return {name: value for name, value in values.items() if value is not None}, checks.faults


def _not_exchanged(problem: Problem, fault: Fault) -> Fault:
    """The same fault, with what to do where the loads were given as the factor on them, or that as the loads."""
    for name, kind, remedy in (
        ("load", Load, "give loads as loads="),
        ("loads", Number, "give a factor on all loads as load="),
    ):
        value = getattr(problem, name)
        items = value if isinstance(value, list | tuple) else (value,)
        if fault.where[:1] == (name,) and any(isinstance(item, kind) for item in items):
            return replace(fault, remedy=remedy)
    return fault


def _units(problem: Problem) -> Units:
    """Those given; where these name none, those of the structure, if it knows any."""
    known = problem.structure.units if isinstance(problem.structure, Structure) else None
    return Units.of(problem.units).filled(known)


def _ratio(period_ratio: Any) -> tuple[int, int]:
    ratio = tuple(period_ratio) if isinstance(period_ratio, tuple | list) else ()
    if len(ratio) != 2:
        raise wrong("period_ratio", period_ratio, "two whole numbers >= 1 such as (3, 2)")
    first, second = (whole(("period_ratio", i), part, 1) for i, part in enumerate(ratio))
    return first, second


def direction_vectors(dofs: Sequence[str], directions: Sequence[Mapping[str, float]]) -> Any:
    """Direction cosines as columns, (n_dofs, n_directions): a scipy sparse array above ``DENSE_DIRECTIONS`` entries."""
    place = {name: i for i, name in enumerate(dofs)}
    shape = len(place), len(directions)
    if shape[1] > _FEW_COLUMNS and shape[0] * shape[1] > DENSE_DIRECTIONS:
        entries = [
            (place[name], column, cosine)
            for column, cosines in enumerate(directions)
            for name, cosine in cosines.items()
        ]
        rows, numbers, values = zip(*entries, strict=True)
        return sparse.csc_array((np.array(values, dtype=float), (rows, numbers)), shape=shape)
    columns = np.zeros(shape)
    for column, cosines in enumerate(directions):
        for name, cosine in cosines.items():
            columns[place[name], column] += cosine
    return columns


def problem_html(problem: Problem) -> str:
    """A small table of what is to be computed."""
    return html_table(f"Problem{': ' if problem.title else ''}{problem.title}", _rows(problem))


def _rows(problem: Problem) -> Iterator[tuple[str, object]]:
    structure, units = problem.structure, problem.units
    yield "structure", f"{type(structure).__name__}, {dofs_words(len(structure.dofs))}: {some(structure.dofs)}"
    natural = np.asarray(structure.natural_frequencies, dtype=float)
    if natural.size:
        yield "undamped natural frequencies", f"{some((f'{w:.5g}' for w in natural), 4)} {units.angular}"
    for pair in problem.contacts[:1]:
        kinds = dict.fromkeys(type(each.contact).__name__ for each in problem.contacts)
        yield "contacts", f"{some(problem.elements)} ({some(kinds)}); first: {_numbers(pair)}"
    for state in problem.contact_states:
        yield state.has, some(state.names)
    if problem.loads:
        yield "loads", some((f"{load.target} (harmonic {load.harmonic})" for load in problem.loads), 4)
    if problem.relative:
        yield "motion", "relative to the moving support"
    unknowns = sum(pair.n_ports for pair in problem.contacts) * problem.harmonics.size
    yield "harmonics", f"{some(problem.harmonics.orders, 14)}; {unknowns} unknowns"
    yield "outputs", some(problem.outputs or ())


def _numbers(pair: ContactPair) -> str:
    """The parameters of a contact, those of its rubbing motion included."""
    names = [*shown_quantities(pair, 0), *(name for name in pair.quantities if pair.rubbing.is_component(name))]
    values = {name: float(np.asarray(pair.values(name))[0]) for name in names}
    return ", ".join(f"{name} {value:g}" for name, value in values.items())
