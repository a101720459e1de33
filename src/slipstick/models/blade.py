"""The parametric blade with its rubbing contacts, reduced: from dimensions to a structure in one call, kept on disk."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.fem.materials import Material
from slipstick.models.blade_mesh import WETTED, BladeShape, blade
from slipstick.models.surface_model import ContactModel, contact_model, cosines, dof_names
from slipstick.structure.modal import LoadShape, ModalStructure

Array = NDArray[np.float64]

BLADE_STEEL = Material(young=200e9, poisson=0.3, density=7750.0, conductivity=25.0)
"""12 % chromium steel (AISI 403/410 class), the usual steel of turbine blades; SI units, room temperature."""

INCONEL_718 = Material(young=208e9, poisson=0.29, density=8200.0, conductivity=16.2)
"""Aged nickel alloy 718, modulus at 21 C, conductivity at 316 C; SI units."""

_ARRAYS = ("omega", "mode_shapes", "static_compliance", "second_residual", "influence", "positions", "normals", "areas")
_LOAD = ("participation", "static_response", "second_response")
_FORMAT = 1


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
    modes
        Number of modes kept.
    """

    shape: BladeShape = field(default_factory=BladeShape)
    material: Material = BLADE_STEEL
    contacts: int | tuple[tuple[float, float, float], ...] = 8
    radius: float | None = None
    film: float = 200.0
    modes: int = 128


@dataclass(frozen=True, kw_only=True)
class RubbingBlade:
    """A reduced blade.

    Attributes
    ----------
    structure
        Modes and residuals at "c1x", "c1y", "c1z", "c2x", ...; load shape "pressure": 1 Pa on the concave side.
    influence
        Temperature rise per power, (n_contacts, n_contacts), K/W.
    positions, normals, areas
        Of the contacts, (n_contacts, 3), (n_contacts, 3), (n_contacts,), SI units.
    n_dofs, solver
        Size of the finite element model and the direct solver used.
    seconds, reused
        Time by stage, and whether the reduction was read from disk.
    """

    structure: ModalStructure
    influence: Array
    positions: Array
    normals: Array
    areas: Array
    n_dofs: int
    solver: str
    seconds: Mapping[str, float]
    reused: bool

    def tangential(self, direction: tuple[float, float, float]) -> list[dict[str, float]]:
        """Rubbing direction projected on the surface, as direction cosines by dof, one dict a contact.

        Raises
        ------
        InputError
            If the direction is zero or normal to the surface.
        """
        wanted = np.asarray(direction, dtype=float)
        flat = wanted - (self.normals @ wanted)[:, None] * self.normals
        size = np.linalg.norm(flat, axis=1, keepdims=True)
        if not size.min() > 1e-3 * np.linalg.norm(wanted):
            raise InputError(f"rubbing direction {direction} is normal to the surface; give one along it")
        return cosines(flat / size)

    @property
    def normal(self) -> list[dict[str, float]]:
        """Outward normals as direction cosines by dof: a positive motion closes the contact."""
        return cosines(self.normals)


def finite_element_blade(setup: BladeModel) -> ContactModel:
    """The full model: sparse matrices, contact directions, pressure load, influence matrix."""
    return contact_model(
        blade(setup.shape),
        setup.material,
        fixed="root",
        surface="shroud_top",
        contacts=setup.contacts,
        radius=setup.radius,
        pressures={"pressure": "concave"},
        films=dict.fromkeys(WETTED, setup.film),
        cold="root",
    )


def rubbing_blade(
    setup: BladeModel | None = None,
    *,
    loss_factor: float = 0.001,
    cache: str | Path | None = None,
    listener: Callable[[Any], None] | None = None,
    solver: str | None = None,
) -> RubbingBlade:
    """Mesh, assemble and reduce the blade, or read it from the folder ``cache`` where the same blade was made before.

    ``listener`` is given the progress of the modes; ``loss_factor`` (hysteretic) is not part of what is stored.
    """
    from slipstick.structure import reduction_store

    setup = setup or BladeModel()
    began = perf_counter()
    path = None if cache is None else Path(cache) / f"blade-{_key(setup)}.npz"
    stored = None if path is None else reduction_store.read(path)
    if stored is not None and set(stored) >= {*_ARRAYS, *_LOAD, "n_dofs", "solver"}:
        return _blade(stored, loss_factor, {"reading the stored blade": perf_counter() - began}, reused=True)
    arrays, seconds = _computed(setup, listener, solver)
    if path is not None:
        reduction_store.write(path, arrays)
    return _blade(arrays, loss_factor, seconds, reused=False)


def _key(setup: BladeModel) -> str:
    from slipstick import __version__
    from slipstick.structure.reduction_store import content_key

    return content_key([], [_FORMAT, __version__, asdict(setup)])


def _computed(
    setup: BladeModel, listener: Callable[[Any], None] | None, solver: str | None
) -> tuple[dict[str, Any], dict[str, float]]:
    from slipstick.structure.reduction import reduce_model

    began = perf_counter()
    whole = finite_element_blade(setup)
    assembled = perf_counter() - began
    reduction = reduce_model(
        whole.model.K, whole.model.M, modes=setup.modes, solver=solver, listener=listener, **whole.request
    )
    structure = reduction.structure
    load = structure.shapes["pressure"]
    arrays = {
        "omega": structure.omega,
        "mode_shapes": structure.mode_shapes,
        "static_compliance": structure.static_compliance,
        "second_residual": structure.second_residual,
        "influence": whole.influence,
        "positions": whole.patches.positions,
        "normals": whole.patches.normals,
        "areas": whole.patches.areas,
        "n_dofs": np.array(reduction.n_full),
        "solver": np.array(reduction.solver),
        **{name: np.asarray(getattr(load, name)) for name in _LOAD},
    }
    return arrays, {"mesh, matrices and influence": assembled, **reduction.seconds}


def _blade(
    arrays: Mapping[str, Any], loss_factor: float, seconds: Mapping[str, float], *, reused: bool
) -> RubbingBlade:
    structure = ModalStructure(
        omega=arrays["omega"],
        mode_shapes=arrays["mode_shapes"],
        static_compliance=arrays["static_compliance"],
        second_residual=arrays["second_residual"],
        dofs=dof_names(len(arrays["positions"])),
        loss_factor=loss_factor,
        load_shapes={"pressure": LoadShape(**{name: arrays[name] for name in _LOAD})},
    )
    return RubbingBlade(
        structure=structure,
        influence=np.asarray(arrays["influence"]),
        positions=np.asarray(arrays["positions"]),
        normals=np.asarray(arrays["normals"]),
        areas=np.asarray(arrays["areas"]),
        n_dofs=int(arrays["n_dofs"]),
        solver=str(arrays["solver"]),
        seconds=seconds,
        reused=reused,
    )
