"""The parametric blade with contact points on its shroud: from dimensions to a reduced body in one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from slipstick.errors import Fault
from slipstick.faults import SMALLEST, Gathering, count_or_numbers, frequency, number, one, whole, wrong
from slipstick.fem.contact_points import ContactPoints
from slipstick.fem.kept import Kept, kept, strain_rows
from slipstick.fem.materials import Material
from slipstick.fem.model import elastic_model
from slipstick.models.blade_mesh import WETTED, BladeShape, blade_mesh, blade_shape
from slipstick.models.reduced_body import ReducedBody, wanted_elements
from slipstick.structure.modal import LoadShape, ModalStructure
from slipstick.structure.reduction import store as reduction_store
from slipstick.structure.reduction.reduce import StrainRows, reduce_model
from slipstick.structure.reduction.request import tools
from slipstick.structure.skin import Skin
from slipstick.structure.strains import StrainPlaces, Strains

if TYPE_CHECKING:
    from slipstick.solve.linear.modes import StageListener

BLADE_STEEL = Material(young=200e9, poisson=0.3, density=7750.0, conductivity=25.0)
"""12 % chromium steel (AISI 403/410 class), the usual steel of turbine blades; SI units, room temperature."""

INCONEL_718 = Material(young=208e9, poisson=0.29, density=8200.0, conductivity=16.2)
"""Aged nickel alloy 718, modulus at 21 C, conductivity at 316 C; SI units."""

_STRUCTURE = ("omega", "mode_shapes", "static_compliance", "second_residual")
_POINTS = ("positions", "normals", "areas", "influence")
_SKIN = ("skin_nodes", "skin_triangles", "skin_modes", "skin_static", "skin_pressure")
_PLACES = ("labels", "positions", "young", "poisson", "nodes")
_ROWS = ("cells", "modes", "static", "second", "pressure", "second_pressure")
_STRAINS = tuple(f"strain_{name}" for name in (*_PLACES, *_ROWS))
_LOAD = ("participation", "static_response", "second_response")


@dataclass(frozen=True, kw_only=True)
class BladeModel:
    """What makes a rubbing blade.

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
    """How many contacts, or their positions."""
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


def finite_element_blade(setup: BladeModel) -> Kept:
    """The full model and what is kept of it: contact directions, pressure load, influence matrix."""
    return kept(
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
    path = None if cache is None else Path(cache) / f"blade-{_key(setup, solver)}.npz"
    stored = None if path is None else reduction_store.read(path)
    wanted = {*_STRUCTURE, *_POINTS, *_LOAD, *_SKIN, *(_STRAINS if setup.stress else ()), "n_dofs", "solver"}
    if stored is not None and set(stored) >= wanted:
        return _body(setup, stored, loss_factor, {"reading the stored blade": perf_counter() - began}, reused=True)
    arrays, seconds = _computed(setup, listener, solver)
    if path is not None:
        reduction_store.write(path, arrays)
    return _body(setup, arrays, loss_factor, seconds, reused=False)


def _key(setup: BladeModel, solver: str | None) -> str:
    """Changes with every option and with the code that makes the blade."""
    made_by = reduction_store.code_digest("solve", "structure", "fem", "models")
    return reduction_store.content_key([], [made_by, asdict(setup), solver])


def _computed(
    setup: BladeModel, listener: StageListener | None, solver: str | None
) -> tuple[dict[str, Any], dict[str, float]]:
    began = perf_counter()
    whole = finite_element_blade(setup)
    assembled = perf_counter() - began
    reduction = reduce_model(
        whole.model.K,
        whole.model.M,
        modes=setup.modes,
        reach=setup.up_to or 0.0,
        strains=_strain_rows(setup, whole),
        residuals="written",
        solver=solver,
        listener=listener,
        **whole.request,
    )
    structure, points = reduction.structure, whole.points
    load = structure.shapes["pressure"]
    arrays = {
        **{name: getattr(structure, name) for name in _STRUCTURE},
        **{name: getattr(points, name) for name in _POINTS},
        **{name: np.asarray(getattr(load, name)) for name in _LOAD},
        **_skin_arrays(structure.skin),
        **({} if structure.strains is None else _strain_arrays(structure.strains)),
        "n_dofs": np.array(reduction.n_full),
        "solver": np.array(reduction.solver),
    }
    return arrays, {"mesh, matrices and influence": assembled, **reduction.seconds}


def _body(
    setup: BladeModel, arrays: Mapping[str, Any], loss_factor: float, seconds: Mapping[str, float], *, reused: bool
) -> ReducedBody:
    points = ContactPoints(**{name: arrays[name] for name in _POINTS})
    structure = ModalStructure(
        **{name: arrays[name] for name in _STRUCTURE},
        dofs=points.dofs,
        loss_factor=loss_factor,
        load_shapes={"pressure": LoadShape(**{name: arrays[name] for name in _LOAD})},
        skin=_skin(arrays, points),
        strains=_strains(setup, arrays) if setup.stress else None,
    )
    return ReducedBody(
        structure=structure,
        points=points,
        n_dofs=int(arrays["n_dofs"]),
        solver=str(arrays["solver"]),
        seconds=seconds,
        reused=reused,
        source="parametric blade, SI units",
        full=partial(finite_element_blade, setup),
    )


def _skin_arrays(skin: Skin | None) -> dict[str, Any]:
    assert skin is not None
    shown = {name: getattr(skin, name) for name in ("nodes", "triangles", "modes", "static")}
    return {f"skin_{name}": value for name, value in (shown | {"pressure": skin.loads["pressure"]}).items()}


def _skin(arrays: Mapping[str, Any], points: ContactPoints) -> Skin:
    nodes, triangles, modes, static, pressure = (arrays[name] for name in _SKIN)
    return Skin(
        nodes=nodes, triangles=triangles, modes=modes, static=static, loads={"pressure": pressure},
        places=np.repeat(points.positions, 3, axis=0),
    )  # fmt: skip


def _strain_rows(setup: BladeModel, whole: Kept) -> StrainRows | None:
    if setup.stress is None:
        return None
    return strain_rows(whole.model, setup.stress, setup.stress_at)


def _strain_arrays(strains: Strains) -> dict[str, Any]:
    places = strains.places
    known = {name: getattr(places, name) for name in _PLACES} | {"cells": places.cells["hex8"]}
    known |= {"modes": strains.modes, "static": strains.static, "second": strains.second}
    known |= {"pressure": strains.loads["pressure"], "second_pressure": strains.second_loads["pressure"]}
    return {f"strain_{name}": value for name, value in known.items()}


def _strains(setup: BladeModel, arrays: Mapping[str, Any]) -> Strains:
    known = {name: arrays[f"strain_{name}"] for name in (*_PLACES, *_ROWS)}
    places = {name: known[name] for name in _PLACES}
    return Strains(
        places=StrainPlaces(at=setup.stress_at, cells={"hex8": known["cells"]}, **places),
        modes=known["modes"],
        static=known["static"],
        second=known["second"],
        loads={"pressure": known["pressure"]},
        second_loads={"pressure": known["second_pressure"]},
    )
