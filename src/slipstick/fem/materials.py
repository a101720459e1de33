"""Isotropic materials, one for the whole mesh or one for each named element set."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import SMALLEST, Gathering, Name, number, shown, suggestion, table, wrong
from slipstick.fem.mesh import Mesh, user_names
from slipstick.typing import Array, IntArray

REQUIRED = ("young", "poisson", "density")
"""Properties that every material of a model needs."""


Table = Sequence[Sequence[float]]
"""Rows of a temperature and a value, temperatures ascending."""

TABULATED = ("young", "poisson", "expansion")
"""Properties that may change with temperature."""


class Isotropic:
    """Constants of elasticity by Young's modulus and Poisson's ratio, numbers or arrays of them."""

    young: Any
    poisson: Any

    @property
    def shear_modulus(self) -> Any:
        """Second Lame parameter, mu = E / (2 (1 + nu))."""
        return self.young / (2.0 * (1.0 + self.poisson))

    @property
    def lame(self) -> Any:
        """First Lame parameter, lambda = E nu / ((1 + nu) (1 - 2 nu))."""
        return self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))


@dataclass(frozen=True, kw_only=True)
class Properties(Isotropic):
    """What a material is at given temperatures: numbers, or arrays (n,)."""

    young: Any
    poisson: Any
    density: float
    conductivity: float


@dataclass(frozen=True, kw_only=True, init=False)
class Material(Isotropic):
    """Isotropic solid in one consistent system of units (SI: Pa, kg/m3, W/(m K)).

    ``young``, ``poisson`` and ``expansion`` may be tables over temperature, ``[(20.0, 2.1e11), (600.0, 1.7e11)]``,
    linear between their rows. Nothing is extrapolated. The attribute of that name is then the value at ``reference``,
    or of the first row where there is no reference within the table.

    Parameters
    ----------
    young, poisson, density, conductivity
        Of the solid.
    expansion
        Secant coefficient of thermal expansion, 1/temperature: ``expansion(T) (T - reference)`` is the free strain.
        None: not known, and no temperature field can act.
    reference
        Temperature from which the expansion counts; of one number it drops out where a body starts from a known
        temperature.
    tables
        The same tables by name, as the attribute holds them.

    Raises
    ------
    InputError
        Unless young > 0, -1 < poisson < 0.5, density >= 0, conductivity >= 0, all finite; for tables without two rows
        of ascending temperatures.

    Examples
    --------
    >>> Material(young=200e9, poisson=0.3, density=7850.0).shear_modulus / 1e9
    76.92307692307692
    >>> hot = Material(young=[(20.0, 2.1e11), (600.0, 1.7e11)], poisson=0.3, expansion=1.2e-5, reference=20.0)
    >>> float(hot.at(310.0).young) / 1e9, round(float(hot.free_strain(120.0)), 6)
    (190.0, 0.0012)
    """

    young: float
    poisson: float
    density: float
    conductivity: float
    expansion: float | None
    reference: float | None
    tables: Mapping[str, Table] = field(hash=False)

    def __init__(
        self,
        *,
        young: float | Table,
        poisson: float | Table,
        density: float = 0.0,
        conductivity: float = 0.0,
        expansion: float | Table | None = None,
        reference: float | None = None,
        tables: Mapping[str, Table] | None = None,
    ) -> None:
        checks = Gathering()
        values: dict[str, Any] = {
            "reference": checks.optional(number, ("material", "reference"), reference, "a temperature"),
            "density": checks.take(number, ("material", "density"), density, "a density >= 0", above=0.0),
            "conductivity": checks.take(
                number, ("material", "conductivity"), conductivity, "a conductivity >= 0", above=0.0
            ),
        }
        given = {"young": young, "poisson": poisson, "expansion": expansion}
        named = {} if tables is None else checks.take(table, ("material", "tables"), tables, "tables by property")
        known = dict(named or {})
        for name in known.keys() - set(TABULATED):
            checks.faults.append(
                Fault(("material", "tables", name), "changes with no temperature", remedy=suggestion(name, TABULATED))
            )
        made: dict[str, Table] = {}
        for name, value in given.items():
            rows = known.get(name)
            if rows is None and isinstance(value, Sequence | np.ndarray) and not isinstance(value, str):
                rows, value = value, None
            if rows is not None:
                made[name] = checks.take(_rows, ("material", name), rows, _PROPERTY[name]) or ()
                if made[name]:
                    at_first = _nominal(made[name], values["reference"])
                    beside = checks.optional(_PROPERTY[name], ("material", name), value)
                    if beside is not None and beside != at_first:
                        what = f"is {shown(value)} beside a table that has {at_first:g}"
                        checks.faults.append(Fault(("material", name), what, remedy="keep one of them"))
                    values[name] = at_first
            elif name == "expansion":
                values[name] = checks.optional(_PROPERTY[name], ("material", name), value)
            else:
                values[name] = checks.take(_PROPERTY[name], ("material", name), value)
        checks.end()
        for name, value in (values | {"tables": made}).items():
            object.__setattr__(self, name, value)

    def but(self, **properties: Any) -> Material:
        """The material with other properties, numbers or tables."""
        return Material(**{name: self.tables.get(name, getattr(self, name)) for name in _PROPERTIES} | properties)

    def at(self, temperature: Array | float) -> Properties:
        """The properties at temperatures (n,).

        Raises
        ------
        InputError
            Where a table does not cover one of them.
        """
        return Properties(
            young=self._at("young", temperature), poisson=self._at("poisson", temperature),
            density=self.density, conductivity=self.conductivity,
        )  # fmt: skip

    def free_strain(self, temperature: Array | float, initial: Array | float | None = None) -> Any:
        """Thermal strain where nothing holds the solid, at temperatures of any shape.

        ``expansion(T) (T - reference)``, less the same of the ``initial`` temperature at which there is no strain: the
        reference where it is left out.

        Raises
        ------
        InputError
            Without a coefficient of expansion or a reference, and where a table does not cover a temperature.
        """
        if self.expansion is None:
            remedy = "give expansion, 1/temperature (0 for a material that does not expand)"
            raise InputError(Fault(("material", "expansion"), "is missing, and the temperature changes", remedy=remedy))
        if self.expansion == 0.0 and "expansion" not in self.tables:
            return np.zeros(np.shape(temperature))
        start: Any = self.reference
        if start is None:
            start = initial if "expansion" not in self.tables else None
        if start is None:
            remedy = "give reference, the temperature from which the expansion counts"
            raise InputError(Fault(("material", "reference"), "is missing, and the temperature changes", remedy=remedy))
        strain = self._at("expansion", temperature) * (np.asarray(temperature) - start)
        if initial is not None and self.reference is not None:
            strain = strain - self._at("expansion", initial) * (np.asarray(initial) - start)
        return strain

    def _at(self, name: str, temperature: Array | float) -> Any:
        """A property at temperatures."""
        if name not in self.tables:
            return getattr(self, name)
        known, values = np.array(self.tables[name], dtype=float).T
        found = np.asarray(temperature, dtype=float)
        outside = (found < known[0]) | (found > known[-1])
        if np.any(outside):
            expected = f"{known[0]:g} to {known[-1]:g}, which its table covers"
            remedy = "give the table more rows: nothing is extrapolated"
            what = f"a temperature of {found[outside].ravel()[0]:g}"
            raise InputError(Fault(("material", name), found=what, expected=expected, remedy=remedy))
        return np.interp(found, known, values)


_PROPERTIES = ("young", "poisson", "density", "conductivity", "expansion", "reference")


def _nominal(rows: Table, reference: float | None) -> float:
    """Of a table: at the reference, or its first row."""
    known, values = np.array(rows, dtype=float).T
    inside = reference is not None and known[0] <= reference <= known[-1]
    return float(np.interp(reference if inside and reference is not None else known[0], known, values))


def _rows(name: Name, rows: Any, check: Callable[[Name, Any], float]) -> Table:
    """Temperatures and values."""
    expected = "rows of a temperature and a value, at least two, temperatures ascending: [(20, 2.1e11), (600, 1.7e11)]"
    try:
        pairs = [tuple(row) for row in rows]
        if len(pairs) < 2 or any(len(pair) != 2 for pair in pairs):
            raise TypeError
    except TypeError:
        raise wrong(name, rows, expected) from None
    checked = tuple((number(name, at, expected), check(name, value)) for at, value in pairs)
    if any(later[0] <= first[0] for first, later in pairwise(checked)):
        raise wrong(name, rows, expected)
    return checked


def _modulus(name: Name, value: Any) -> float:
    return number(name, value, "a modulus > 0", above=SMALLEST)


def _coefficient(name: Name, value: Any) -> float:
    return number(name, value, "a coefficient of expansion, 1/temperature")


def _ratio(name: Name, value: Any) -> float:
    expected = "a ratio between -1 and 0.5, both excluded"
    ratio = number(name, value, expected)
    if not -1.0 < ratio < 0.5:
        raise wrong(name, value, expected)
    return ratio


_PROPERTY: Mapping[str, Callable[[Name, Any], float]] = {
    "young": _modulus, "poisson": _ratio, "expansion": _coefficient
}  # fmt: skip


Materials = Material | Mapping[str, Material]
"""One material, or one for each element set (sets that together hold every element once); "all" is every element."""

EVERY = "all"


def element_values(mesh: Mesh, materials: Materials, value: Callable[[Any], Any]) -> dict[str, Array]:
    """Value of a property for each element, by type: of its material, at the temperature of the element where the mesh
    has one, the mean of its nodes.

    Raises
    ------
    InputError
        If an element set is unknown, an element has no material or two, or a table does not cover a temperature.
    """
    values = {kind: np.zeros(len(block)) for kind, block in mesh.blocks.items()}
    for name, material, members in of_materials(mesh, materials):
        for kind, rows in members.items():
            if mesh.temperature is None or not material.tables:
                values[kind][rows] = value(material)
            else:
                with told_of(name):
                    values[kind][rows] = value(material.at(mesh.temperature[mesh.blocks[kind][rows]].mean(axis=1)))
    return values


@contextmanager
def told_of(name: str) -> Iterator[None]:
    """Faults of a material say the set that it is of."""
    try:
        yield
    except InputError as error:
        raise InputError([fault.below("material").inside("materials", name) for fault in error.faults]) from None


def of_materials(mesh: Mesh, materials: Materials) -> list[tuple[str, Material, Mapping[str, IntArray]]]:
    """Name of the set, material and elements by type, each element once.

    Raises
    ------
    InputError
        If an element set is unknown, or an element has no material or two.
    """
    if isinstance(materials, Material):
        materials = {EVERY: materials}
    if set(materials) == {EVERY} - set(mesh.element_sets):
        return [(EVERY, materials[EVERY], {kind: np.arange(len(block)) for kind, block in mesh.blocks.items()})]
    unknown = sorted(set(materials) - set(mesh.element_sets))
    if unknown:
        known = ", ".join(user_names(mesh.element_sets)) or "none"
        raise InputError(Fault("materials", f"no element set {unknown}", remedy=f"the mesh has: {known}"))
    count = {kind: np.zeros(len(block), dtype=int) for kind, block in mesh.blocks.items()}
    for name in materials:
        for kind, members in mesh.element_sets[name].items():
            count[kind][members] += 1
    for kind, times in count.items():
        if np.any(times != 1):
            label = mesh.element_label(kind, int(np.flatnonzero(times != 1)[0]))
            count_of = "no" if times.min() == 0 else "more than one"
            raise InputError(Fault("materials", f"{kind} element {label} has {count_of} material"))
    return [(name, material, mesh.element_sets[name]) for name, material in materials.items()]
