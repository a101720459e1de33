"""The parametric blade with contact points on its shroud: from dimensions to a reduced body in one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from slipstick.errors import Fault
from slipstick.faults import SMALLEST, Gathering, count_or_numbers, frequency, number, one, whole, wrong
from slipstick.fem.contact_points import ContactPoints
from slipstick.fem.materials import Material
from slipstick.fem.model import elastic_model
from slipstick.fem.retained import Retained, retain, strain_rows
from slipstick.models.blade_mesh import WETTED, BladeShape, blade_mesh, blade_shape
from slipstick.models.reduced_body import ReducedBody, wanted_elements
from slipstick.structure.reduction.data import ReducedData
from slipstick.structure.reduction.reduce import SkinRows, StrainRows, judge_served, modal_structure, reduce_model
from slipstick.structure.reduction.request import Accuracy, Damping, tools
from slipstick.structure.reduction.store import Store
from slipstick.structure.strains import StrainPlaces

if TYPE_CHECKING:
    from slipstick.solve.linear.modes import StageListener

BLADE_STEEL = Material(young=200e9, poisson=0.3, density=7750.0, conductivity=25.0)
"""12 % chromium steel (AISI 403/410 class), the usual steel of turbine blades; SI units, room temperature."""

INCONEL_718 = Material(young=208e9, poisson=0.29, density=8200.0, conductivity=16.2)
"""Aged nickel alloy 718, modulus at 21 C, conductivity at 316 C; SI units."""

_POINTS = ("positions", "normals", "areas", "influence")
_SKIN = ("nodes", "triangles")
_PLACES = ("labels", "positions", "young", "poisson", "nodes")


@dataclass(frozen=True, kw_only=True)
class BladeModel:
    """Dimensions, material and options of a rubbing blade.

    Parameters
    ----------
    shape, material
        Dimensions and mesh size; material.
    contacts
        Number of contacts spread uniformly over the top of the shroud, or their positions on it.
    radius
        Of the contact patches, m; None: half the area of each contact's share of the shroud.
    film
        Convection coefficient on every surface in the gas, W/(m2 K): 200 lies in the range of compressor and cold-end
        turbine blades, 100 to 1000. The root keeps the temperature of the disc.
    modes, up_to
        Number of modes kept; None: as many as their accuracy asks for, also up to a frequency (rad/s) where
        ``up_to`` is set: see ``ss.reduced_body``.
    stress, stress_at
        Elements whose stress is wanted, by number or by surface, and where: see ``ss.reduced_body``.
    """

    shape: BladeShape = field(default_factory=BladeShape)
    material: Material = BLADE_STEEL
    contacts: int | Sequence[Sequence[float]] = 8
    radius: float | None = None
    film: float = 200.0
    modes: int | None = None
    up_to: float | None = None
    stress: str | int | Sequence[str | int] | None = None
    stress_at: str = "elements"

    def __post_init__(self) -> None:
        gathering, length = Gathering(), "a length > 0, or None"
        gathering.take(one, "blade, shape", self.shape, BladeShape, 'a size such as "small", or a BladeShape')
        gathering.take(one, "blade, material", self.material, Material, "an ss.Material")
        values = {
            "contacts": gathering.take(_places, "blade, contacts", self.contacts),
            "radius": gathering.optional(number, "blade, radius", self.radius, length, above=SMALLEST),
            "film": gathering.take(number, "blade, film", self.film, "a convection coefficient >= 0", above=0.0),
            "modes": gathering.optional(whole, "blade, modes", self.modes, 1),
            "up_to": gathering.optional(frequency, "blade, up_to", self.up_to),
            "stress": gathering.take(wanted_elements, self.stress, self.stress_at),
        }
        if self.modes is not None and self.up_to is not None:
            gathering.faults.append(Fault("blade, modes", "both modes and up_to are given", remedy="keep one"))
        gathering.end()
        for name, value in values.items():
            object.__setattr__(self, name, value)


def _places(name: str, value: object) -> int | tuple[tuple[float, ...], ...]:
    """The number of contacts, or their positions."""
    expected = "how many, or positions (n, 3)"
    places = count_or_numbers(name, value, expected)
    if isinstance(places, int):
        return places
    if places.ndim != 2 or places.shape[1] != 3 or not places.size:
        raise wrong(name, value, expected)
    return tuple(tuple(position) for position in places.tolist())


def _check_tools(loss_factor: object, cache: object, listener: object, solver: object) -> None:
    gathering = Gathering()
    gathering.take(number, "loss_factor", loss_factor, "a number >= 0", above=0.0)
    gathering.take(tools, solver, cache, listener)
    gathering.end()


def finite_element_blade(setup: BladeModel) -> Retained:
    """The full model with its retained dofs: contact directions, pressure load, influence matrix."""
    return retain(
        elastic_model(blade_mesh(setup.shape), setup.material, "root"),
        surface="shroud_top",
        contacts=setup.contacts,
        radius=setup.radius,
        pressure={"pressure": "concave"},
        films=dict.fromkeys(WETTED, setup.film),
        cold="root",
    )


def reduced_blade(
    shape: BladeShape | str = "small",
    *,
    material: Material = BLADE_STEEL,
    contacts: int | Sequence[Sequence[float]] = 8,
    radius: float | None = None,
    film: float = 200.0,
    modes: int | None = None,
    up_to: float | None = None,
    stress: str | int | Sequence[str | int] | None = None,
    stress_at: Literal["elements", "nodes"] = "elements",
    loss_factor: float = 0.0,
    cache: str | Path | None = None,
    listener: StageListener | None = None,
    solver: str | None = None,
) -> ReducedBody:
    """The parametric blade with contact points on its shroud, reduced; SI units.

    Load shape "pressure": 1 Pa on the concave side; the influence matrix is that of the whole blade with a cold root.

    Parameters
    ----------
    shape
        "small", "medium" or "large" (about 5 200, 30 000, 104 000 dofs), or dimensions: see
        ``slipstick.models.blade_mesh.blade_shape``.
    material, contacts, radius, film, modes, up_to, stress, stress_at
        See :class:`BladeModel`.
    loss_factor
        Hysteretic; not part of what is stored.
    cache
        Folder in which blades are kept: the same one, made by the same code, is read from there.
    listener
        Hears the progress of the modes.

    Raises
    ------
    InputError
        For an unknown size, dimensions that make no blade, too many contacts.

    Examples
    --------
    >>> import slipstick as ss
    >>> blade = ss.reduced_blade("small", contacts=1, modes=2)
    >>> blade.n_dofs, blade.structure.dofs, round(float(blade.structure.omega[0]), 1)
    (5235, ('c1x', 'c1y', 'c1z'), 1328.8)
    """
    setup = BladeModel(
        shape=blade_shape(shape) if isinstance(shape, str) else shape,
        material=material,
        contacts=contacts,
        radius=radius,
        film=film,
        modes=modes,
        up_to=up_to,
        stress=stress,
        stress_at=stress_at,
    )
    _check_tools(loss_factor, cache, listener, solver)
    began = perf_counter()
    content = (asdict(setup), solver)
    store = Store(cache, "blade", (), content, ("solve", "structure", "fem", "models"))
    made, reused = store.kept(partial(_computed, setup, listener, solver), partial(_Blade.of, setup))
    structure = modal_structure(
        made.data, made.points.dofs, ("pressure",), Damping(loss_factor=loss_factor), made.skin, made.strains
    )
    if reused:
        want = Accuracy(modes=setup.modes, reach=setup.up_to or 0.0)
        judge_served(structure.truncations(1), structure.omega, want, force=False, below=lambda omega: None)
    return ReducedBody(
        structure=structure,
        points=made.points,
        n_dofs=made.n_dofs,
        solver=made.data.solver,
        seconds={"reading the stored blade": perf_counter() - began} if reused else made.data.seconds,
        reused=reused,
        source="parametric blade, SI units",
        full=partial(finite_element_blade, setup),
    )


@dataclass(frozen=True, kw_only=True)
class _Blade:
    """The stored part of a blade: all but its damping."""

    data: ReducedData
    points: ContactPoints
    skin: SkinRows
    strains: StrainRows | None
    n_dofs: int

    def arrays(self) -> dict[str, Any]:
        """Arrays for the store, by name."""
        made = self.data.arrays() | {f"point_{name}": getattr(self.points, name) for name in _POINTS}
        made |= {f"skin_{name}": getattr(self.skin, name) for name in _SKIN}
        if self.strains is not None:
            places = self.strains.places
            made |= {f"strain_{name}": getattr(places, name) for name in _PLACES} | {
                "strain_cells": places.cells["hex8"]
            }
        return {**made, "n_dofs": np.array(self.n_dofs)}

    @classmethod
    def of(cls, setup: BladeModel, arrays: Mapping[str, Any]) -> _Blade | None:
        """A blade from stored arrays; None where they do not fit, or a KeyError."""
        points = ContactPoints(**{name: arrays[f"point_{name}"] for name in _POINTS})
        skin = {name: arrays[f"skin_{name}"] for name in _SKIN}
        strains, n_strains = None, 0
        if setup.stress:
            known = {name: arrays[f"strain_{name}"] for name in _PLACES}
            places = StrainPlaces(at=setup.stress_at, cells={"hex8": arrays["strain_cells"]}, **known)
            strains, n_strains = StrainRows(places=places), 6 * len(places.labels)
        n_seen = 3 * len(skin["nodes"]) + n_strains
        data = ReducedData.of(arrays, len(points.dofs), 1, n_seen, n_strains)
        if data is None:
            return None
        shown = SkinRows(**skin, places=np.repeat(points.positions, 3, axis=0))
        return cls(data=data, points=points, skin=shown, strains=strains, n_dofs=int(arrays["n_dofs"]))


def _computed(setup: BladeModel, listener: StageListener | None, solver: str | None) -> _Blade:
    began = perf_counter()
    whole = finite_element_blade(setup)
    assembled = perf_counter() - began
    request = whole.request
    strains = None
    if setup.stress is not None:
        strains = strain_rows(whole.model, setup.stress, setup.stress_at)
    reduction = reduce_model(
        whole.model.K,
        whole.model.M,
        modes=setup.modes,
        reach=setup.up_to or 0.0,
        strains=strains,
        residuals="written",
        solver=solver,
        listener=listener,
        **request,
    )
    data = replace(reduction.data, seconds={"mesh, matrices and influence": assembled, **reduction.seconds})
    skin, n_dofs, points = request["skin"], reduction.n_full, whole.points
    assert points is not None
    return _Blade(data=data, points=points, skin=skin, strains=strains, n_dofs=n_dofs)
