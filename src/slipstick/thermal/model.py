"""Contacts heated by their own friction: what a problem holds, and forces at the temperature they bring about."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.law import Law, Motion, Response
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, Name, number, numbers, one, shown, suggestion, table, wrong
from slipstick.faults import names as names_of
from slipstick.thermal.equilibrium import Equilibrium, checked, settled
from slipstick.thermal.friction_curve import FrictionCurve, Sampled
from slipstick.thermal.search import ElementEquilibria, SurfaceEquilibria, element_equilibria, surface_equilibria
from slipstick.thermal.tangent import Power, ThermalTangent, power_by_temperature, thermal_tangent
from slipstick.typing import Array, Reals

Parameters = tuple[dict[str, Array], dict[str, Sampled]]


@dataclass(frozen=True, kw_only=True)
class ThermalModel:
    """How the contacts of a problem heat up and what that does to them.

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
        found = Gathering()
        checks: dict[str, tuple[Callable[..., Any], str]] = {
            "curve": (_curve, "ss.FrictionCurve(...), or curves by contact name"),
            "background": (number, "a temperature, or temperatures by contact name"),
            "resistance": (_resistance, "a number, an influence matrix, or numbers by contact name"),
        }
        values = {key: found.take(_each, key, getattr(self, key), *check) for key, check in checks.items()}
        if self.contacts is not None:
            expected = "names of contacts in the order of the influence matrix"
            values["contacts"] = found.take(names_of, ("thermal", "contacts"), self.contacts, expected)
        found.end()
        for key, value in values.items():
            object.__setattr__(self, key, value)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters that some curve gives."""
        curves = self.curve.values() if isinstance(self.curve, Mapping) else (self.curve,)
        return tuple(dict.fromkeys(name for curve in curves for name in curve.names))

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
            (curve, np.array([i for i, own in enumerate(curves) if own is not None and own.content == content]))
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
        given = [(what, name) for what, table in tables.items() if isinstance(table, Mapping) for name in table]
        given += [("contacts", name) for name in self.contacts or ()]
        return [
            Fault(("thermal", what), f"there is no contact {shown(name)}", remedy=suggestion(name, names))
            for what, name in given
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
    found = Gathering()
    each = number if check is _resistance else check
    values = {k: found.take(each, (*name, k), v) for k, v in table(name, value, expected).items()}
    found.end()
    return values


def _resistance(name: Name, value: Any, expected: str) -> float | Array:
    found = numbers(name, value, expected)
    if found.ndim > 2 or found.size == 0:
        raise wrong(name, value, expected)
    return found if found.ndim else float(found)


def _curve(name: Name, value: Any, expected: str = "ss.FrictionCurve(...)") -> FrictionCurve:
    return one(name, value, FrictionCurve, expected)


@dataclass(frozen=True, kw_only=True)
class Heat:
    """Contact forces at the equilibrium temperatures, and everything their consistent tangent needs, n elements."""

    batch: int
    """Which batch of the balance is heated."""
    response: Response
    equilibrium: Equilibrium
    tangent: ThermalTangent
    power: Power
    heated: HeatedContacts

    @property
    def temperature(self) -> Array:
        """Contact temperatures (n,)."""
        return self.equilibrium.temperature

    @property
    def lost(self) -> bool:
        """Whether there is no equilibrium near the start temperature that was given."""
        found = self.equilibrium
        return found.jumped or (found.near and not found.converged)

    @property
    def hot(self) -> tuple[str, ...]:
        """Parameters that some curve gives."""
        return tuple(self.heated.nominal)

    def per_cold(self, name: str) -> Array:
        """Derivative of a parameter by its cold value, (n,)."""
        return self.heated.per_cold(name, self.temperature)


@dataclass(frozen=True, kw_only=True)
class HeatedContacts:
    """A thermal model bound to n contact elements: validated arrays; ``curves`` with the elements each is for.

    ``nominal`` holds mu, kt, kn (n,) of the curves at the background temperature, nan where no curve gives them.
    """

    batch: int = 0
    """Which batch of the balance they are."""
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

    def scales(self, cold: Mapping[str, Array]) -> dict[str, Array]:
        """Factors (n,) on the curves of each parameter: its cold value over the curve's at the background."""
        return {
            name: np.divide(cold[name], own, out=np.ones(len(own)), where=own > 0) for name, own in self.nominal.items()
        }

    def parameters(self, T: Array, cold: Mapping[str, Array], scales: Mapping[str, Array]) -> Parameters:
        """All of mu, kt, kn at T (n,), and those that some curve gives with their slopes; held beyond the limits.

        ``cold`` are the values without heat, ``scales`` is what they make of the curves.
        """
        inside = np.clip(T, *self.limits)
        value = {name: np.array(cold[name], dtype=float) for name in self.nominal}
        slope = {name: np.zeros(T.size) for name in self.nominal}
        for curve, rows in self.curves:
            for name, found in curve.within(inside[rows]).items():
                value[name][rows], slope[name][rows] = found
        held = inside != T
        for name, scale in scales.items():
            # where no curve gives it, the scale is 1 and the value is the cold one
            value[name] *= scale
            slope[name] *= scale
            slope[name][held] = 0.0
        return {**cold, **value}, {name: Sampled(value[name], slope[name]) for name in value}

    def follows(self, name: str, rows: Sequence[int]) -> bool:
        """Whether a curve gives this parameter of one of these elements."""
        return name in self.nominal and bool(np.any(np.isfinite(self.nominal[name][list(rows)])))

    def per_cold(self, name: str, T: Array) -> Array:
        """Derivative of a parameter at T by its cold value, (n,): the curve over its value at the background."""
        ratio = np.ones_like(T)
        inside = np.clip(T, *self.limits)
        for curve, rows in self.curves:
            if name in curve.names:
                own = self.nominal[name][rows]
                ratio[rows] = np.divide(curve.at(inside[rows])[name].value, own, out=np.ones_like(own), where=own > 0)
        return ratio

    def respond(self, law: Law, motion: Motion, cold: Mapping[str, Array], start: Array | None = None) -> Heat:
        """Forces at the temperatures that balance their own power.

        ``cold`` holds the parameters (n,) without heat. ``start`` (n,) is the neighbouring solution, next to which also
        an equilibrium counts that is unstable while the motion is held; cold without it. A temperature outside the
        tables does not raise: see ``Equilibrium.problem``.
        """
        element = _Element(self, law, motion, cold)
        found = settled(element, self.background, self.resistance, self.limits, start, knots=self.knots, hold=True)
        power, sampled = element.at(found.temperature)
        return Heat(
            batch=self.batch,
            response=power.response,
            equilibrium=found,
            tangent=thermal_tangent(self.resistance, found.dpower_dT, power.response, sampled),
            power=power,
            heated=self,
        )

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
    """Power of temperature at one motion, remembering the forces of the last temperatures."""

    def __init__(self, heated: HeatedContacts, law: Law, motion: Motion, cold: Mapping[str, Array]) -> None:
        self.heated, self.law, self.motion, self.cold = heated, law, motion, cold
        self.scales = heated.scales(cold)
        self.last: tuple[Array, Power, dict[str, Sampled]] | None = None

    def at(self, T: Array) -> tuple[Power, dict[str, Sampled]]:
        if self.last is None or not np.array_equal(self.last[0], T):
            values, sampled = self.heated.parameters(T, self.cold, self.scales)
            power = Power(self.law, self.motion, self.law.respond(self.motion, values))
            self.last = (T, power, sampled)
        return self.last[1:]

    def __call__(self, T: Array) -> tuple[Array, Array]:
        power, sampled = self.at(T)
        return power.value, power_by_temperature(power, sampled)
