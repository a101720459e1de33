"""Contacts heated by their own friction: the model of a problem, and forces at the equilibrium temperature."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.law import Law, Motion
from slipstick.errors import Fault, InputError, Outcome
from slipstick.faults import Gathering, Name, number, numbers, one, shown, suggestion, table, wrong
from slipstick.faults import names as names_of
from slipstick.state.contact_state import Carried, ContactState, Rate, Sampled, StateModel, StateVariable
from slipstick.state.thermal.equilibrium import Equilibrium, checked, settled
from slipstick.state.thermal.friction_curve import FrictionCurve
from slipstick.state.thermal.search import ElementEquilibria, SurfaceEquilibria, element_equilibria, surface_equilibria
from slipstick.typing import Array, Reals
from slipstick.units import Units

TEMPERATURE = StateVariable("temperature", "temperature", "contact temperature")


@dataclass(frozen=True, kw_only=True)
class ThermalModel(StateModel):
    """Heating of the contacts of a problem by friction, and their parameters over temperature.

    Parameters
    ----------
    curve
        Parameters of temperature: one curve for all contacts, or curves by contact name. A contact without a curve
        keeps its parameters, but still heats the others.
    background
        Temperature without friction: for all, or by contact name.
    resistance
        Temperature per power (force x length / time, in the units of the problem): one number for every contact,
        numbers by contact name (missing: not heated), or an influence matrix (n, n) in the order of ``contacts``.
    contacts
        Names in the order of the influence matrix; by default the contacts of the problem in their order.

    Examples
    --------
    >>> curve = FrictionCurve(temperature=[25, 400], mu=[0.5, 0.38])
    >>> model = ThermalModel(curve=curve, background=25.0, resistance=8.0)
    >>> model.elements(["tip", "shroud"]).resistance
    array([8., 8.])
    """

    curve: FrictionCurve | Mapping[str, FrictionCurve]
    background: float | Mapping[str, float]
    resistance: Reals | Mapping[str, float]
    contacts: Sequence[str] | None = None

    def __post_init__(self) -> None:
        checks_made = Gathering()
        checks: dict[str, tuple[Callable[..., Any], str]] = {
            "curve": (_curve, "ss.FrictionCurve(...), or curves by contact name"),
            "background": (number, "a temperature, or temperatures by contact name"),
            "resistance": (_resistance, "a number, an influence matrix, or numbers by contact name"),
        }
        values = {key: checks_made.take(_each, key, getattr(self, key), *check) for key, check in checks.items()}
        if self.contacts is not None:
            expected = "names of contacts in the order of the influence matrix"
            values["contacts"] = checks_made.take(names_of, ("thermal", "contacts"), self.contacts, expected)
        checks_made.end()
        for key, value in values.items():
            object.__setattr__(self, key, value)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters that some curve gives."""
        curves = self.curve.values() if isinstance(self.curve, Mapping) else (self.curve,)
        return tuple(dict.fromkeys(name for curve in curves for name in curve.names))

    def of(self, laws: Sequence[Law], names: Sequence[Sequence[str]]) -> list[HeatedContacts]:
        """The contacts of dry friction; without any, those of the first law with a parameter of some curve."""
        curves = set(self.parameters)
        follow = [k for k, law in enumerate(laws) if curves & set(law.values)]
        follow = [k for k in follow if laws[k].coulomb] or follow[:1] or [0]  # others may call a parameter the same
        if len(names) < 2:
            return [self.elements(names[0] if names else ())]
        every = [name for of_law in names for name in of_law]
        faults = self._unknown(every)
        order = list(self.contacts or every)
        matrix = np.asarray(0.0 if isinstance(self.resistance, Mapping) else self.resistance)
        if not faults and matrix.ndim == 2:
            if self.contacts is None:
                faults = [Fault(("thermal", "contacts"), "is missing", expected="the order of the influence matrix")]
            elif matrix.shape == (len(order), len(order)):
                law_of = np.array([next(k for k, its in enumerate(names) if name in its) for name in order])
                if np.any(matrix[law_of[:, None] != law_of]):
                    kinds = "lets contacts of different laws heat each other, which is not supported"
                    faults = [Fault(("thermal", "influence"), kinds, remedy="leave only what each heats by itself")]
        if faults:
            raise InputError(faults)
        return [replace(self._only(names[k], order, matrix).elements(names[k]), batch=k) for k in follow]

    def _only(self, names: Sequence[str], order: list[str], matrix: Array) -> ThermalModel:
        """The model of these contacts alone; ``order`` is that of the influence matrix, where there is one."""
        tables = {key: getattr(self, key) for key in ("curve", "background", "resistance")}
        kept: dict[str, Any] = {
            key: {name: of for name, of in value.items() if name in names} if isinstance(value, Mapping) else value
            for key, value in tables.items()
        }
        if matrix.shape == (len(order), len(order)):
            rows = [order.index(name) for name in names if name in order]
            kept |= {"resistance": matrix[np.ix_(rows, rows)], "contacts": [order[row] for row in rows]}
        return replace(self, **kept)

    def elements(self, names: Sequence[str]) -> HeatedContacts:
        """The model for these contacts, in this order; raises InputError with every fault."""
        faults = self._unknown(names)
        background = _by_name("background", self.background, names, faults)
        resistance = self._resistance(names, faults)
        curves = [self.curve.get(name) if isinstance(self.curve, Mapping) else self.curve for name in names]
        if faults:
            raise InputError(faults)
        limits = np.array([curve.limits if curve is not None else (-np.inf, np.inf) for curve in curves]).reshape(-1, 2)
        T0, R, bounds = checked(background, resistance, (limits[:, 0], limits[:, 1]), names)
        distinct = {curve.content: curve for curve in curves if curve is not None}
        groups = tuple(
            (
                curve,
                np.array(
                    [i for i, curve_of in enumerate(curves) if curve_of is not None and curve_of.content == content]
                ),
            )
            for content, curve in distinct.items()
        )
        nominal: dict[str, Array] = {}
        for curve, rows in groups:
            for name, sampled in curve.at(T0[rows]).items():
                nominal.setdefault(name, np.full(len(names), np.nan))[rows] = sampled.value
        return HeatedContacts(
            names=tuple(names), background=T0, resistance=R, limits=bounds, curves=groups, nominal=nominal
        )

    def _unknown(self, names: Sequence[str]) -> list[Fault]:
        tables = {"curve": self.curve, "background": self.background, "resistance": self.resistance}
        named = [(what, name) for what, table in tables.items() if isinstance(table, Mapping) for name in table]
        named += [("contacts", name) for name in self.contacts or ()]
        return [
            Fault(("thermal", what), f"there is no contact {shown(name)}", remedy=suggestion(name, names))
            for what, name in named
            if name not in names
        ]

    def _resistance(self, names: Sequence[str], faults: list[Fault]) -> Array:
        if isinstance(self.resistance, Mapping):
            return np.array([self.resistance.get(name, 0.0) for name in names])
        matrix = np.asarray(self.resistance)
        if matrix.ndim < 2 or faults:
            return matrix
        order = list(self.contacts or names)
        if matrix.shape != (len(order), len(order)) or len(set(order)) != len(order):
            faults.append(
                Fault(
                    ("thermal", "influence"),
                    found=f"a matrix of shape {matrix.shape} for {len(order)} contacts",
                    expected="one row and one column for each contact",
                )
            )
            return np.zeros(len(names))
        full = np.zeros((len(names), len(names)))
        at = [names.index(name) for name in order]
        full[np.ix_(at, at)] = matrix
        return full


def _by_name(what: str, value: float | Mapping[str, float], names: Sequence[str], faults: list[Fault]) -> Array:
    if not isinstance(value, Mapping):
        return np.full(len(names), value)
    missing = [name for name in names if name not in value]
    if missing:
        faults.append(
            Fault(
                ("thermal", what),
                f"nothing is given for contact {', '.join(missing)}",
                remedy="give it for every contact",
            )
        )
    return np.array([value.get(name, 0.0) for name in names])


def _each(key: str, value: Any, check: Callable[..., Any], expected: str) -> Any:
    """One value for all contacts, or a dict of them by contact name, each checked."""
    name = ("thermal", key)
    if not isinstance(value, Mapping):
        return check(name, value, expected)
    checks = Gathering()
    each = number if check is _resistance else check
    values = {k: checks.take(each, (*name, k), v) for k, v in table(name, value, expected).items()}
    checks.end()
    return values


def _resistance(name: Name, value: Any, expected: str) -> float | Array:
    resistance = numbers(name, value, expected)
    if resistance.ndim > 2 or resistance.size == 0:
        raise wrong(name, value, expected)
    return resistance if resistance.ndim else float(resistance)


def _curve(name: Name, value: Any, expected: str = "ss.FrictionCurve(...)") -> FrictionCurve:
    return one(name, value, FrictionCurve, expected)


@dataclass(frozen=True, kw_only=True)
class Heat(Carried):
    """Temperatures in thermal equilibrium, and the forces there."""

    equilibrium: Equilibrium

    @property
    def power_by_value(self) -> Array:
        """``dEdot/dT`` (n,), zero where the parameters are constant."""
        return self.equilibrium.dpower_dT

    @property
    def lost(self) -> bool:
        """Whether there is no equilibrium near the temperatures of the neighbouring solution."""
        equilibrium = self.equilibrium
        return equilibrium.jumped or (equilibrium.near and not equilibrium.converged)

    def fault(self, units: Units | None = None) -> str | None:
        """One sentence where the equilibrium is no result; with ``units`` of the problem."""
        return self.equilibrium.problem(self.state.names, units)


@dataclass(frozen=True, kw_only=True)
class HeatedContacts(ContactState):
    """A thermal model bound to n contact elements: validated arrays; ``curves`` with the elements each is for.

    ``nominal`` holds mu, kt, kn (n,) of the curves at the background temperature, nan where no curve gives them. The
    parameters of the contacts are values at the background and scale the curves.
    """

    variable = TEMPERATURE
    has = "heated"
    equilibrium_name = "thermal equilibrium"
    extreme_name = "temperature of the hottest contact"
    left = Outcome.OUTSIDE_TABLE.text

    batch: int = 0
    slow: bool = False
    names: tuple[str, ...]
    background: Array
    resistance: Array
    limits: tuple[Array, Array]
    curves: tuple[tuple[FrictionCurve, NDArray[np.intp]], ...]
    nominal: Mapping[str, Array]

    @cached_property
    def knots(self) -> Array:
        """Rows of each element's tables, (k, n), nan where it has fewer or none."""
        most = max((curve.knots.size for curve, _ in self.curves), default=0)
        knots = np.full((most, self.background.size), np.nan)
        for curve, rows in self.curves:
            knots[: curve.knots.size, rows] = curve.knots[:, None]
        return knots

    @property
    def start(self) -> Array:
        """The background."""
        return self.background

    def parameters(self, z: Array, given: Mapping[str, Array]) -> dict[str, Sampled]:
        """mu, kt, kn at the temperatures: the curves, scaled to the cold values."""
        sampled = {name: Sampled(np.array(given[name], dtype=float), np.zeros(z.size)) for name in self.nominal}
        for curve, rows in self.curves:
            for name, values in curve.within(z[rows]).items():
                sampled[name].value[rows], sampled[name].derivative[rows] = values
        for name, (value, slope) in sampled.items():
            scale = self._scale(name, given[name])
            if scale is not None:
                value *= scale
                slope *= scale
        return sampled

    def _scale(self, name: str, given: Array) -> Array | None:
        """Cold value over that of the curve, (n,); None where they are equal."""
        cold = self.nominal[name]  # where no curve gives it, nan: the cold value stays
        if np.array_equal(given, cold):
            return None
        return np.divide(given, cold, out=np.ones(len(cold)), where=cold > 0)

    def by_given(self, name: str, z: Array) -> Array:
        """Derivative of a parameter at temperatures by its cold value, (n,): the curve over its start."""
        ratio = np.ones_like(z)
        inside = np.clip(z, *self.limits)
        for curve, rows in self.curves:
            if name in curve.names:
                cold = self.nominal[name][rows]
                ratio[rows] = np.divide(
                    curve.at(inside[rows])[name].value, cold, out=np.ones_like(cold), where=cold > 0
                )
        return ratio

    def rate(self, z: Array, power: Array) -> Rate:
        """``T_0 + R Edot - T``, in time constants of the body."""
        R, heat = self.resistance, np.maximum(power, 0.0)
        return Rate(self.background + (R * heat if R.ndim == 1 else R @ heat) - z, -np.ones(z.size), R)

    def at_start(self) -> Mapping[str, Array]:
        """Parameters of the curves at the background."""
        return self.nominal

    def follows(self, name: str, rows: Sequence[int]) -> bool:
        """Whether a curve gives this parameter of one of these elements."""
        return name in self.nominal and bool(np.any(np.isfinite(self.nominal[name][list(rows)])))

    def parameter_fault(self, name: str, quantity: str, rows: Sequence[int]) -> Fault | None:
        """Fault of a parameter that a curve gives."""
        if not self.follows(quantity, rows):
            return None
        return Fault(
            statement=f"{name} follows the temperature by its table", remedy="use the factor 'friction' instead"
        )

    def faults(self, law: Law, ports: Sequence[Container[str]]) -> Iterator[Fault]:
        """Contacts whose normal stiffness has a curve while nothing moves along their normal."""
        normal = {law.ports[i] for i, name in law.stiffness_names.items() if name == "kn"}
        for e, (name, present) in enumerate(zip(self.names, ports, strict=True)):
            if self.follows("kn", [e]) and any(p not in present for p in normal & set(law.optional_ports)):
                yield Fault(
                    ("contact", name),
                    "kn depends on temperature but the contact has no normal direction, so its normal load is constant",
                    remedy="give a normal direction, or no table of kn",
                )

    def warnings(self) -> Iterator[str]:
        """Temperatures without effect."""
        if not self.nominal:
            yield (
                "contact temperatures have no effect: neither mu nor kt nor kn is a table over temperature; the "
                "results are those of cold contacts, and temperatures are reported alone"
            )

    def time_fault(self, held: Container[str]) -> Fault | None:
        """Fault of time integration, unless hot parameters are held."""
        if "mu" in held:
            return None
        return Fault(
            "time integration",
            "friction heats these contacts, and heat is not integrated in time",
            remedy="give their hot parameters by held={'mu': ..., 'kt': ..., 'kn': ...}",
        )

    def self_excited_fault(self) -> Fault:
        """Fault of self-excited vibration of heated contacts."""
        return Fault("thermal", "self-excited vibration of heated contacts is not known", remedy="leave it out")

    def settled(self, law: Law, motion: Motion, given: Mapping[str, Array], near: Array | None) -> Heat:
        """Forces at temperatures in equilibrium with the power of friction.

        ``given`` holds the parameters (n,) at the background. From ``near`` (n,), the neighbouring solution, an
        equilibrium counts even where it is unstable at fixed motion; without it the start is cold. A temperature
        outside the tables does not raise: see ``Equilibrium.problem``.
        """
        element = _Element(self, law, motion, given)
        equilibrium = settled(element, self.background, self.resistance, self.limits, near, knots=self.knots, hold=True)
        at = element.at(equilibrium.temperature)
        return Heat(state=self, values=at.values, power=at.power, sampled=at.sampled, equilibrium=equilibrium)

    def all_equilibria(
        self, law: Law, motion: Motion, cold: Mapping[str, Array]
    ) -> list[ElementEquilibria] | SurfaceEquilibria:
        """Every equilibrium at this motion: for each element, or for the surface where the elements heat each other."""
        element = _Element(self, law, motion, cold)
        low, high = np.minimum(self.limits[0], self.background), self.limits[1]
        if self.resistance.ndim == 2:
            return surface_equilibria(element, self.background, self.resistance, limits=(low, high))
        # an element without a curve has one temperature, wherever it lies
        free = ~np.isfinite(high)
        low = np.where(free, self.background, low)
        high = np.where(free, self.background + 2.0 * np.abs(self._rise(element)) + 1.0, high)
        knots = np.unique(np.concatenate([np.empty(0), *(curve.knots for curve, _ in self.curves)]))
        return element_equilibria(element, self.background, self.resistance, limits=(low, high), knots=knots)

    def _rise(self, element: _Element) -> Array:
        return np.asarray(self.resistance * element(self.background)[0])


class _Element:
    """Power as a function of temperature at one motion; keeps the forces of the last temperatures."""

    def __init__(self, heated: HeatedContacts, law: Law, motion: Motion, cold: Mapping[str, Array]) -> None:
        self.heated, self.law, self.motion, self.cold = heated, law, motion, cold
        self.last: Carried | None = None

    def at(self, T: Array) -> Carried:
        if self.last is None or not (self.last.values == T).all():
            self.last = self.heated.at(self.law, self.motion, self.cold, T)
        return self.last

    def __call__(self, T: Array) -> tuple[Array, Array]:
        at = self.at(T)
        return at.power.value, at.power_by_value
