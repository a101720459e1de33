"""What is to be computed: a structure, its rubbing contacts, its loads and the harmonics kept."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from math import atan2, cos, hypot, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.checks import problem_faults
from slipstick.balance.heat import cold_pairs
from slipstick.balance.preflight import problem_warnings
from slipstick.contact.parameters import FrictionContact
from slipstick.contact.rubbing import RubbingMotion, common_period
from slipstick.errors import InputError
from slipstick.faults import (
    Gathering,
    names,
    number,
    one,
    several,
    shown,
    suggestion,
    text,
    warn,
    whole,
    wrong,
)
from slipstick.structure.protocol import Structure
from slipstick.thermal.model import HeatedContacts, ThermalModel
from slipstick.trig.harmonics import Harmonics

Array = NDArray[np.float64]

PARAMETERS = ("velocity", "mu", "kt", "kn", "gap", "normal_load")
"""What can be changed or followed of a contact, as in "tip.velocity"; "*.velocity" means all contacts together."""

FACTORS = ("load", "friction")
"""Factors on all loads and on all friction coefficients."""

MOST_OUTPUTS = 100

_MEMBERS = ("dofs", "load_shapes", "natural_frequencies", "project", "time_equations")


@dataclass(frozen=True, init=False)
class Load:
    """A periodic force ``cos * cos(m tau) + sin * sin(m tau)`` on a dof, or times a load shape of the structure.

    Parameters
    ----------
    dof, shape
        Name of a dof, or of a load shape: one of the two.
    harmonic
        Harmonic ``m`` of the excitation; 0 is a static load, given by ``cos``.
    cos, sin
        Amplitudes, force (0-to-peak).
    amplitude, phase
        Instead of cos and sin: ``amplitude * cos(m tau + phase)``, phase in rad, 0 where it is left out.

    Raises
    ------
    InputError
        For values of another kind, an amplitude together with cos or sin, or a phase without amplitude.

    Examples
    --------
    >>> load = Load(dof="x", amplitude=100.0, phase=-np.pi / 2)
    >>> round(load.cos, 9), load.sin
    (0.0, 100.0)
    """

    dof: str | None
    shape: str | None
    harmonic: int
    cos: float
    sin: float

    def __init__(
        self,
        *,
        dof: str | None = None,
        shape: str | None = None,
        harmonic: int = 1,
        cos: float | None = None,
        sin: float | None = None,
        amplitude: float | None = None,
        phase: float | None = None,
    ) -> None:
        on = dof if dof is not None else shape
        name, found = f"load on {shown(on)}" if on is not None else "load", Gathering()
        given = {"cos": cos, "sin": sin, "amplitude": amplitude, "phase": phase}
        force = {k: found.take(number, f"{name}, {k}", v) for k, v in given.items() if v is not None}
        values: dict[str, Any] = {"harmonic": found.take(whole, f"{name}, harmonic", harmonic)}
        for key, value in (("dof", dof), ("shape", shape)):
            values[key] = None if value is None else found.take(text, f"load, {key}", value, "a name")
        if amplitude is not None and (cos is not None or sin is not None):
            found.problems.append(f"{name}: amplitude is given together with cos or sin; keep one way to say the force")
        if phase is not None and amplitude is None:
            found.problems.append(f"{name}: phase is given without amplitude; give both")
        found.end()
        values |= _parts(force)
        for key, value in values.items():
            object.__setattr__(self, key, value)

    @property
    def target(self) -> str:
        """Name of the dof or load shape."""
        return str(self.dof if self.dof is not None else self.shape)

    @property
    def amplitude(self) -> float:
        """``amplitude`` in ``amplitude * cos(m tau + phase)``, force, >= 0."""
        return hypot(self.cos, self.sin)

    @property
    def phase(self) -> float:
        """``phase`` in ``amplitude * cos(m tau + phase)``, rad, from -pi to pi."""
        return atan2(-self.sin, self.cos)


def _parts(force: Mapping[str, Any]) -> dict[str, float]:
    """Cosine and sine parts of a force said in either way."""
    if "amplitude" not in force:
        return {"cos": force.get("cos", 0.0), "sin": force.get("sin", 0.0)}
    size, phase = force["amplitude"], force.get("phase", 0.0)
    return {"cos": size * cos(phase), "sin": -size * sin(phase) if phase else 0.0}


@dataclass(frozen=True, kw_only=True)
class ContactPair:
    """A friction contact between two directions of the structure, or between one and the ground.

    The relative motion is ``sum cosine * dof``, node 1 minus node 2: the second node's dofs have the opposite sign.

    Parameters
    ----------
    name
        Its name in results, events and parameters.
    contact
        Parameters, scalars.
    tangential
        Direction cosines by dof; a name alone means cosine 1.
    normal
        As ``tangential``, positive where the contact closes; None: a constant normal load ``-kn gap``.
    rubbing
        Motion of the counter surface; none by default.

    Raises
    ------
    InputError
        For values of another kind.
    """

    name: str
    contact: FrictionContact
    tangential: Mapping[str, float] | str
    normal: Mapping[str, float] | str | None = None
    rubbing: RubbingMotion = field(default_factory=RubbingMotion)

    def __post_init__(self) -> None:
        found = Gathering()
        name = found.take(text, "contact, name", self.name, 'a name such as "damper"')
        where = f"contact {shown(name)}"
        values: dict[str, Any] = {"name": name}
        values["contact"] = found.take(one, where, self.contact, FrictionContact, "contact=ss.FrictionContact(...)")
        values["tangential"] = found.take(_cosines, f"{where}, tangential", self.tangential)
        values["normal"] = None if self.normal is None else found.take(_cosines, f"{where}, normal", self.normal)
        rubbing = RubbingMotion() if self.rubbing is None else self.rubbing
        values["rubbing"] = found.take(one, f"{where}, rubbing", rubbing, RubbingMotion, "ss.RubbingMotion(...)")
        found.end()
        for key, value in values.items():
            object.__setattr__(self, key, value)

    @property
    def directions(self) -> tuple[Mapping[str, float], Mapping[str, float] | None]:
        """Direction cosines, tangential and normal."""
        return self.tangential, self.normal  # type: ignore[return-value]

    @property
    def velocity(self) -> float:
        """Constant rubbing velocity, length/time."""
        return float(np.asarray(self.rubbing.velocity))

    def value(self, name: str) -> float:
        """One of ``PARAMETERS``."""
        if name == "velocity":
            return self.velocity
        return float(np.asarray(getattr(self.contact, name)))

    def with_value(self, name: str, value: float) -> ContactPair:
        """A copy with one of ``PARAMETERS`` changed; a normal load becomes a gap at the present ``kn``."""
        if name == "velocity":
            return replace(self, rubbing=replace(self.rubbing, velocity=value))
        if name == "normal_load":
            kn = self.value("kn")
            if value < 0 or (kn == 0 and value != 0):
                raise InputError(
                    f"{self.name}.normal_load: found {value:g} with kn = {kn:g}; expected a load >= 0 and kn > 0"
                )
            return replace(self, contact=replace(self.contact, gap=-value / kn if kn else 0.0))
        return replace(self, contact=replace(self.contact, **{name: value}))


def _cosines(name: str, given: Any) -> dict[str, float]:
    """Direction cosines by dof; a name alone means cosine 1."""
    if isinstance(given, str):
        return {str(given): 1.0}
    expected = 'the name of a dof such as "x", or cosines by dof such as {"x": 1.0, "y": -1.0}'
    if not isinstance(given, Mapping):
        raise wrong(name, given, expected)
    return {text(name, dof, expected): number(f"{name}, {shown(dof)}", cosine) for dof, cosine in given.items()}


@dataclass(frozen=True)
class Problem:
    """Steady periodic vibration of a structure with friction contacts under rubbing motion (THEORY.md sections 1, 9).

    Parameters
    ----------
    structure
        Anything that is a ``Structure``.
    contacts, loads
        The contacts and the loads; a single one will do.
    harmonics
        Harmonics of the principal frequency kept in the balance; orders such as ``[0, 1, 3]``, or a count such as 10
        for ``0..10``, will do.
    outputs
        Names of the dofs in the results; by default all of at most 100, else the first 100 with
        those that are loaded or in contact.
    period_ratio
        ``T_p / T_u = j1 / j2``, period of the excitation over that of the rubbing motion. Harmonics of loads and of
        rubbing motions count their own frequency; ``omega`` is always the principal one.
    title
        Written on results.
    load, friction
        Factors on all loads and on all friction coefficients: the parameters "load" and "friction".
    thermal
        How friction heats the contacts and what that does to mu, kt, kn: these then stand for the values at the
        background temperature and are taken from the curves. None: nothing depends on temperature.
    told
        Warnings that were given already, here or by the problem this one is a copy of. None: none is given, neither
        here nor for a curve; who builds it so shows ``slipstick.balance.preflight.problem_warnings``.

    Raises
    ------
    InputError
        With one sentence for each fault.

    Warns
    -----
    SlipstickWarning
        For what can be computed but looks wrong, one sentence each. A copy (``with_parameter``,
        ``dataclasses.replace``) says only what the original did not.
    """

    structure: Structure
    _: KW_ONLY
    contacts: Sequence[ContactPair] = ()
    loads: Sequence[Load] = ()
    harmonics: Harmonics = field(default_factory=lambda: Harmonics(range(6)))
    outputs: Sequence[str] | None = None
    period_ratio: tuple[int, int] = (1, 1)
    title: str = ""
    load: float = 1.0
    friction: float = 1.0
    thermal: ThermalModel | None = None
    told: frozenset[str] | None = field(default=frozenset(), repr=False, compare=False)

    def __post_init__(self) -> None:
        for name, value in _right_kinds(self).items():
            object.__setattr__(self, name, value)
        if self.outputs is None:
            object.__setattr__(self, "outputs", tuple(self._default_outputs()))
        faults = problem_faults(self)
        if faults:
            raise InputError(faults)
        if self.heated is not None:
            object.__setattr__(self, "contacts", cold_pairs(self.contacts, self.heated))
        if self.told is not None:
            self.warn(problem_warnings(self))

    def warn(self, sentences: Sequence[str]) -> None:
        """Give those warnings that were not given yet."""
        if self.told is not None:
            new = [sentence for sentence in dict.fromkeys(sentences) if sentence not in self.told]
            object.__setattr__(self, "told", self.told | set(new))
            warn(new)

    def _default_outputs(self) -> list[str]:
        """The first dofs, and those beyond them that are loaded or in contact, in the order of the structure."""
        wanted = {load.dof for load in self.loads}
        wanted |= {dof for pair in self.contacts for side in pair.directions for dof in side or ()}
        return [dof for i, dof in enumerate(self.structure.dofs) if i < MOST_OUTPUTS or dof in wanted]

    @cached_property
    def heated(self) -> HeatedContacts | None:
        """The thermal model for the contacts in their order, or None."""
        return None if self.thermal is None else self.thermal.elements([pair.name for pair in self.contacts])

    @cached_property
    def orders(self) -> tuple[int, int]:
        """Harmonics of the principal frequency on which excitation and rubbing motion sit [Eqs. 2, 3]."""
        return common_period(*self.period_ratio)

    @property
    def load_order(self) -> int:
        """Harmonic of the principal frequency on which the excitation sits."""
        return self.orders[0]

    @property
    def rubbing_order(self) -> int:
        """Harmonic of the principal frequency on which the rubbing motion sits."""
        return self.orders[1]

    @cached_property
    def load_targets(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Loaded dofs and load shapes, each once, in order of appearance."""
        dofs = tuple(dict.fromkeys(load.dof for load in self.loads if load.dof is not None))
        shapes = tuple(dict.fromkeys(load.shape for load in self.loads if load.shape is not None and load.dof is None))
        return dofs, shapes

    def load_coefficients(self) -> Array:
        """Coefficients of the loads on ``load_targets`` (dofs, then shapes), (n, L), factor included."""
        dofs, shapes = self.load_targets
        P = np.zeros((len(dofs) + len(shapes), self.harmonics.size))
        for load in self.loads:
            row = dofs.index(load.dof) if load.dof is not None else len(dofs) + shapes.index(load.target)
            order = load.harmonic * self.load_order
            P[row, self.harmonics.index(order, "c")] += load.cos
            if order:
                P[row, self.harmonics.index(order, "s")] += load.sin
        return self.load * P

    def rubbing_coefficients(self) -> Array:
        """Coefficients ``U`` of the periodic rubbing motion, (n_contacts, L)."""
        U = np.zeros((len(self.contacts), self.harmonics.size))
        for row, pair in zip(U, self.contacts, strict=True):
            row[:] = pair.rubbing.coefficients(self.harmonics, self.rubbing_order)
        return U

    def contact_values(self, name: str) -> Array:
        """One of ``PARAMETERS`` of all contacts, (n_contacts,); mu with the friction factor."""
        factor = self.friction if name == "mu" else 1.0
        return np.array([factor * pair.value(name) for pair in self.contacts], dtype=float)

    def direction_matrix(self, directions: Iterable[Mapping[str, float]]) -> Array:
        """Direction cosines on all dofs of the structure, (n_dofs, n_directions)."""
        return direction_vectors(self.structure.dofs, list(directions))

    def parameter_targets(self, name: str) -> tuple[tuple[int, ...], str]:
        """Which contacts a named parameter belongs to, and what it is; ``((), name)`` for the factors."""
        if isinstance(name, str) and name in FACTORS:
            return (), name
        contact, _, quantity = text("parameter", name, 'a name such as "damper.mu"').rpartition(".")
        at = tuple(i for i, pair in enumerate(self.contacts) if contact in (pair.name, "*"))
        if not at or quantity not in PARAMETERS:
            names = [*(pair.name for pair in self.contacts), "*"]
            known = [*(f"{c}.{p}" for c in names for p in PARAMETERS), *FACTORS]
            raise InputError(f"there is no parameter '{name}'; {suggestion(name, known)}")
        if self.heated is not None and self.heated.follows(quantity, at):
            raise InputError(f"{name} follows the temperature by its table; use the factor 'friction' instead")
        return at, quantity

    def parameter(self, name: str) -> float:
        """Value of a named parameter such as "tip.velocity", "*.mu" or "load"; of several contacts, the mean."""
        at, quantity = self.parameter_targets(name)
        if not at:
            return float(getattr(self, quantity))
        return float(np.mean([self.contacts[i].value(quantity) for i in at]))

    def with_parameter(self, name: str, value: float) -> Problem:
        """A copy with a named parameter changed; raises InputError where the value is not allowed."""
        return replace(self, **self._changed(name, value))

    def at_parameter(self, name: str, value: float) -> Problem:
        """As ``with_parameter`` on the way along a curve: says nothing of what looks wrong there."""
        return replace(self, told=None, **self._changed(name, value))

    def _changed(self, name: str, value: float) -> dict[str, Any]:
        at, quantity = self.parameter_targets(name)
        value = number(name, value)
        if not at:
            if quantity == "friction" and value < 0:
                raise InputError(f"friction: found {value:g}; expected a factor >= 0")
            return {quantity: value}
        return {
            "contacts": [pair.with_value(quantity, value) if i in at else pair for i, pair in enumerate(self.contacts)]
        }


def _right_kinds(problem: Problem) -> dict[str, Any]:
    """The fields in the form that is computed with; InputError for everything of another kind."""
    found, structure = Gathering(), problem.structure
    values: dict[str, Any] = {}
    missing = [m for m in _MEMBERS if not hasattr(type(structure), m) and not hasattr(structure, m)]
    if missing or isinstance(structure, type):
        found.problems.append(
            f"structure: found {shown(structure)}; expected one such as ss.MatrixStructure(M=..., K=..., dofs=...)"
        )
    values["contacts"] = found.take(several, "contacts", problem.contacts, ContactPair, "an ss.ContactPair")
    values["loads"] = found.take(several, "loads", problem.loads, Load, "an ss.Load")
    values["harmonics"] = found.take(Harmonics.of, problem.harmonics)
    if problem.outputs is not None:
        values["outputs"] = found.take(names, "outputs", problem.outputs)
    values["period_ratio"] = found.take(_ratio, problem.period_ratio)
    values["title"] = found.take(text, "title", problem.title)
    for factor in FACTORS:
        values[factor] = found.take(number, f"{factor} factor", getattr(problem, factor))
    if problem.thermal is not None:
        found.take(one, "thermal", problem.thermal, ThermalModel, "an ss.ThermalModel or None")
    if problem.told is not None:
        values["told"] = frozenset(problem.told)
    found.end()
    return values


def _ratio(given: Any) -> tuple[int, int]:
    ratio = tuple(given) if isinstance(given, tuple | list) else ()
    if len(ratio) != 2:
        raise wrong("period_ratio", given, "two whole numbers >= 1 such as (3, 2)")
    return whole("period_ratio", ratio[0], 1), whole("period_ratio", ratio[1], 1)


def direction_vectors(dofs: Sequence[str], directions: Sequence[Mapping[str, float]]) -> Array:
    """Direction cosines as columns, (n_dofs, n_directions)."""
    place = {name: i for i, name in enumerate(dofs)}
    columns = np.zeros((len(place), len(directions)))
    for column, cosines in enumerate(directions):
        for name, cosine in cosines.items():
            columns[place[name], column] += cosine
    return columns
