"""Isotropic materials, one for the whole mesh or one for each named element set."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import SMALLEST, Gathering, Name, number, wrong
from slipstick.fem.mesh import Mesh, user_names
from slipstick.typing import Array

REQUIRED = ("young", "poisson", "density")
"""Properties that every material of a model needs."""


@dataclass(frozen=True, kw_only=True)
class Material:
    """Isotropic solid in one consistent system of units (SI: Pa, kg/m3, W/(m K)).

    Raises
    ------
    InputError
        Unless young > 0, -1 < poisson < 0.5, density >= 0, conductivity >= 0, all finite.

    Examples
    --------
    >>> Material(young=200e9, poisson=0.3, density=7850.0).shear_modulus / 1e9
    76.92307692307692
    """

    young: float
    poisson: float
    density: float = 0.0
    conductivity: float = 0.0

    def __post_init__(self) -> None:
        checks = Gathering()
        values = {
            "young": checks.take(number, ("material", "young"), self.young, "a modulus > 0", above=SMALLEST),
            "poisson": checks.take(_ratio, ("material", "poisson"), self.poisson),
            "density": checks.take(number, ("material", "density"), self.density, "a density >= 0", above=0.0),
            "conductivity": checks.take(
                number, ("material", "conductivity"), self.conductivity, "a conductivity >= 0", above=0.0
            ),
        }
        checks.end()
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def shear_modulus(self) -> float:
        """Second Lame parameter, mu = E / (2 (1 + nu))."""
        return self.young / (2.0 * (1.0 + self.poisson))

    @property
    def lame(self) -> float:
        """First Lame parameter, lambda = E nu / ((1 + nu) (1 - 2 nu))."""
        return self.young * self.poisson / ((1.0 + self.poisson) * (1.0 - 2.0 * self.poisson))


def _ratio(name: Name, value: Any) -> float:
    expected = "a ratio between -1 and 0.5, both excluded"
    ratio = number(name, value, expected)
    if not -1.0 < ratio < 0.5:
        raise wrong(name, value, expected)
    return ratio


Materials = Material | Mapping[str, Material]
"""One material, or one for each element set (sets that together hold every element once); "all" is every element."""


def element_values(mesh: Mesh, materials: Materials, value: Callable[[Material], float]) -> dict[str, Array]:
    """Value of a property for each element, by type.

    Raises
    ------
    InputError
        If an element set is unknown, or an element has no material or two.
    """
    if isinstance(materials, Material):
        return {kind: np.full(len(block), value(materials)) for kind, block in mesh.blocks.items()}
    if set(materials) == {"all"} - set(mesh.element_sets):
        return element_values(mesh, materials["all"], value)
    unknown = sorted(set(materials) - set(mesh.element_sets))
    if unknown:
        known = ", ".join(user_names(mesh.element_sets)) or "none"
        raise InputError(Fault("materials", f"no element set {unknown}", remedy=f"the mesh has: {known}"))
    values = {kind: np.zeros(len(block)) for kind, block in mesh.blocks.items()}
    count = {kind: np.zeros(len(block), dtype=int) for kind, block in mesh.blocks.items()}
    for name, material in materials.items():
        for kind, members in mesh.element_sets[name].items():
            values[kind][members] = value(material)
            count[kind][members] += 1
    for kind, times in count.items():
        if np.any(times != 1):
            label = mesh.element_label(kind, int(np.flatnonzero(times != 1)[0]))
            count_of = "no" if times.min() == 0 else "more than one"
            raise InputError(Fault("materials", f"{kind} element {label} has {count_of} material"))
    return values
