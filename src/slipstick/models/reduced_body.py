"""A finite element model reduced to what touches, is loaded or is looked at; with contacts on a surface or without."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from slipstick.errors import Fault, InputError, Where
from slipstick.faults import (
    SMALLEST,
    Gathering,
    count_or_numbers,
    frequency,
    names,
    number,
    number_or_numbers,
    one,
    one_or_listed,
    shown,
    suggestion,
    table,
    text,
    truth,
    warn,
    whole,
    wrong,
)
from slipstick.fem.boundary import surface_towards
from slipstick.fem.contact_points import ContactPoints
from slipstick.fem.equations import COMPONENTS
from slipstick.fem.mesh import Mesh, Surface, node_indices, user_names
from slipstick.fem.model import ImportedModel
from slipstick.models.surface_model import ContactModel, skin_rows, strain_rows, with_contacts
from slipstick.structure.matrix_checks import is_symmetric, symmetric_part
from slipstick.structure.reduction.reduce import SkinRows, StrainRows, receptance_error, reduce_model
from slipstick.structure.reduction.request import non_negative, residuals_kind, tools
from slipstick.structure.strains import ELEMENTS, MOST_NUMBER, NODES
from slipstick.typing import Array, Matrix, Reals

if TYPE_CHECKING:
    from slipstick.solve.linear.modes import StageListener
    from slipstick.structure.modal import ModalStructure


@dataclass(frozen=True, kw_only=True)
class FullMatrices:
    """Stiffness and mass (n, n) of the full model and the kept directions (n, n_keep), all sparse."""

    K: Matrix
    M: Matrix
    directions: Matrix


@dataclass(frozen=True, kw_only=True)
class ReducedBody:
    """A reduced finite element model.

    Attributes
    ----------
    structure
        Modes and residuals at the kept dofs: "c1x", "c1y", "c1z", "c2x", ... of the contact points, then others.
    points
        The contact points; None without a surface.
    n_dofs, solver
        Size of the full model and the direct solver used.
    seconds, reused
        Time by stage, and whether the reduction was read from disk.
    source
        Where the model comes from and its units.
    notes, warnings
        Of the imported model: what was left out; what is approximated or suspicious.
    full
        Gives the full model, for comparison; that of a stored reduction may have to be made again.
    """

    structure: ModalStructure
    points: ContactPoints | None = field(repr=False)
    n_dofs: int
    solver: str
    seconds: Mapping[str, float]
    reused: bool
    source: str
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    full: Callable[[], FullMatrices] = field(repr=False)
    between: ClassVar[None] = None
    """It has no neighbours, as a sector has."""

    def modes_below(self, omega: float) -> int | None:
        """How many modes of the full model lie below a frequency, rad/s; one factorisation."""
        from slipstick.structure.reduction.compute import modes_below

        full = self.full()
        return modes_below(full.K, full.M, omega)

    def receptance_errors(self, frequencies: Reals) -> Iterator[tuple[float, float]]:
        """Frequency (rad/s) and relative error of the receptance between the kept dofs; one direct solution each.

        A frequency that is a resonance of the full model is left out.
        """
        full = self.full()
        for omega in np.atleast_1d(np.asarray(frequencies, dtype=float)).tolist():
            try:
                yield omega, receptance_error(self.structure, full.directions, full.K, full.M, omega)
            except InputError:
                continue


def reduced_body(
    model: ImportedModel,
    *,
    surface: str | Surface | Mapping[str, Any] | None = None,
    contacts: int | Reals = 8,
    radius: float | None = None,
    pressure: str | Mapping[str, str] | None = None,
    base: str | Sequence[str] = (),
    films: Mapping[str, float] | None = None,
    cold: str | None = None,
    keep: Sequence[str] = (),
    modes: int | None = None,
    accuracy: float | None = None,
    up_to: float | None = None,
    loss_factor: float = 0.0,
    damping_ratio: float = 0.0,
    force: bool = False,
    residuals: str = "auto",
    stress: str | int | Sequence[str | int] | None = None,
    stress_at: Literal["elements", "nodes"] = "elements",
    cache: str | Path | None = None,
    listener: StageListener | None = None,
) -> ReducedBody:
    """Reduce an imported model to contact points on a surface and to named dofs.

    Parameters
    ----------
    surface
        Where contacts lie: a name, a surface of the mesh, or ``{"direction": (0, 1, 0), "angle": ..., "depth": ...}``
        for the part of the boundary that looks that way; None: no contacts on a surface.
    contacts, radius
        How many points, spread uniformly; or node labels (n,), or positions (n, 3); radius of their patches, by default
        that of half the area of each.
    pressure
        Load shapes ``{name: surface}``: unit pressure into the body; a surface alone is named "pressure".
    base
        Directions "x", "y", "z" in which the support may move: load shapes "base x" ... for ``ss.Load(base="x", ...)``.
        Inertia that couples held and free nodes is left out; it vanishes as the mesh is refined.
    films, cold
        Convection coefficient by surface (or "boundary"), and what stays cold: they give the influence matrix.
    keep
        Dofs of the full model to keep besides, such as "n123y".
    modes, accuracy, up_to
        A number of modes, or as many as bring the receptance to a relative accuracy up to a frequency (rad/s). With
        neither, as many as the estimate of its error asks for: 1e-7 up to ten times the first natural frequency, and
        up to ``up_to`` where it is set; 128 at most.
    loss_factor, damping_ratio
        Hysteretic loss factor; ratio to critical damping.
    force
        Take a reduction that is too coarse for ``up_to``.
    residuals
        "written", "solved" or "auto": how what the modes leave out is applied, see ``reduce``.
    stress, stress_at
        Elements whose strain and stress are wanted of the results (``branch.stress``): "all", or their numbers, names
        of element sets, or of surfaces they have a face on; at their centroids ("elements") or their "nodes". They
        need the mesh and its materials.
    cache
        Folder in which reductions are kept; the same model and options are read from there.

    Raises
    ------
    InputError
        For names and labels that are not there, and models that are not held: one sentence for each.

    Warns
    -----
    SlipstickWarning
        A damping matrix, which real modes do not use; an error above 1e-4 up to ``up_to``.
    """
    gathering = Gathering()
    gathering.take(one, "model", model, ImportedModel, "what ss.import_model returns")
    wanted = _Wanted(
        surface=_surface_table(gathering, surface),
        contacts=contacts,
        radius=gathering.optional(number, "radius", radius, "a length > 0", above=SMALLEST),
        pressure=_pressures(gathering, pressure),
        base=gathering.take(_axes, base) or (),
        films=_films(gathering, films),
        cold=gathering.optional(text, "cold", cold, "the name of a node set or surface"),
        keep=gathering.take(names, "keep", keep) or (),
        modes=gathering.optional(whole, "modes", modes, 1),
        accuracy=gathering.optional(number, "accuracy", accuracy, "a relative error"),
        up_to=gathering.optional(frequency, "up_to", up_to),
    )
    gathering.take(non_negative, "loss_factor", loss_factor)
    gathering.take(number_or_numbers, "damping_ratio", damping_ratio, "a number, or one for each mode")
    gathering.take(truth, "force", force)
    gathering.take(residuals_kind, residuals)
    gathering.take(tools, None, cache, listener)
    elements = gathering.take(wanted_elements, stress, stress_at)
    gathering.end()
    _refuse(model, wanted)
    strains = None if elements is None else _strains(model, elements, stress_at)
    body = None if surface is None else _with_contacts(model, wanted)
    request: dict[str, Any] = (
        {**_kept(model, wanted.keep), "skin": _seen(model, wanted.keep)}
        if body is None
        else _with_kept(body, model, wanted.keep)
    )
    request["load_shapes"] = {**request.get("load_shapes", {}), **_base_shapes(model, wanted.base)}
    if accuracy is not None:
        request |= {"accuracy": accuracy, "frequency_range": (0.0, wanted.up_to)}
    reduction = reduce_model(
        model.K,
        model.M,
        **request,
        dofs=model.dofs,
        modes=wanted.modes,
        reach=wanted.up_to or 0.0,
        loss_factor=loss_factor,
        damping_ratio=damping_ratio,
        force=force,
        cache=cache,
        listener=listener,
        residuals=residuals,
        strains=strains,
    )
    unused = (*_unused(model), *([] if strains is None else _unseen_stress(model)))
    warn(unused)
    reduction.structure.units = model.unit_names
    return ReducedBody(
        structure=reduction.structure,
        points=None if body is None else body.points,
        n_dofs=reduction.n_full,
        solver=reduction.solver,
        seconds=reduction.seconds,
        reused=reduction.reused,
        source=f"{model.source}; units: {model.units_told}",
        notes=model.notes,
        warnings=(*model.warnings, *unused),
        full=partial(FullMatrices, K=model.K, M=model.M, directions=reduction.directions),
    )


@dataclass(frozen=True, kw_only=True)
class _Wanted:
    """What :func:`reduced_body` is asked for, tables instead of their short forms."""

    surface: str | Surface | Mapping[str, Any] | None
    contacts: int | Reals
    radius: float | None
    pressure: Mapping[str, str]
    base: tuple[str, ...]
    films: Mapping[str, float]
    cold: str | None
    keep: tuple[str, ...]
    modes: int | None
    accuracy: float | None
    up_to: float | None


def _surface_table(gathering: Gathering, surface: object) -> str | Surface | Mapping[str, Any] | None:
    if surface is None or isinstance(surface, str | Surface):
        return surface
    return gathering.take(table, "surface", surface, 'the name of a surface, or {"direction": (0, 1, 0)}')


def _pressures(gathering: Gathering, pressure: object) -> dict[str, str]:
    """Surfaces by load shape."""
    pressure = {"pressure": pressure} if isinstance(pressure, str) else pressure
    shapes = gathering.optional(table, "pressure", pressure, "a surface, or surfaces by load shape") or {}
    for name, on in shapes.items():
        gathering.take(text, ("pressure", name), on, "the name of a surface")
    return shapes


def _films(gathering: Gathering, films: object) -> dict[str, float]:
    coefficients = gathering.optional(table, "films", films, "convection coefficients by surface") or {}
    for name, film in coefficients.items():
        gathering.take(number, ("films", name), film, "a convection coefficient >= 0", above=0.0)
    return coefficients


def _axes(axes: object) -> tuple[str, ...]:
    """Directions of a support's motion, each once."""
    directions = names("base", axes, 'a direction "x", "y" or "z", or a list of them')
    for axis in directions:
        if axis not in COMPONENTS[:3]:
            raise wrong("base", axis, 'a direction "x", "y" or "z"')
    return tuple(dict.fromkeys(directions))


def _base_shapes(model: ImportedModel, axes: Sequence[str]) -> dict[str, Array]:
    """``M r`` for translations of the support."""
    return {f"base {axis}": np.asarray(model.M @ model.translation(axis)) for axis in axes}


def _with_contacts(model: ImportedModel, wanted: _Wanted) -> ContactModel:
    assert wanted.surface is not None
    mesh = model.in_mesh("contacts on a surface")
    return with_contacts(
        model,
        surface=_surface(wanted.surface, mesh),
        contacts=_contact_nodes(wanted.contacts, mesh),
        radius=wanted.radius,
        pressures=wanted.pressure,
        films=wanted.films,
        cold=wanted.cold,
    )


def _refuse(model: ImportedModel, wanted: _Wanted) -> None:
    """All that is missing or said twice, at once."""
    faults = [*_request_faults(model, wanted)]
    if wanted.surface is not None and model.mesh is not None:
        faults += _name_faults(model.mesh, wanted)
    if faults:
        raise InputError(faults)


def _request_faults(model: ImportedModel, wanted: _Wanted) -> Iterator[Fault]:
    if model.symmetry is not None and model.symmetry.alone is None:
        what = f"{model.source} is one of {model.symmetry.sectors} sectors of a disc, and its faces are free"
        yield Fault("model", what, remedy="reduce it with ss.reduced_sector")
    if wanted.surface is None:
        if not wanted.keep:
            yield Fault(
                "surface",
                "nothing is kept",
                remedy='give surface = "NAME" for contacts on a surface, or keep = ["n123y"]',
            )
        for key in ("radius", "pressure", "films", "cold"):
            if getattr(wanted, key):
                yield Fault(key, "is given without surface", remedy="give the surface the contacts lie on")
    other = "up_to" if wanted.accuracy is None else "accuracy"
    if wanted.modes is not None and getattr(wanted, other) is not None:
        yield Fault("modes", f"both modes and {other} are given", remedy="keep one")
    if wanted.accuracy is not None and wanted.up_to is None:
        yield Fault("accuracy", "is given without up_to", remedy="give the highest frequency of that accuracy")
    free = {*model.dofs, *model.dependent_dofs} if wanted.keep else set()
    for name in wanted.keep:
        if name not in free:
            yield Fault(
                "keep",
                f"there is no free dof '{name}' in the model",
                remedy=f"names look like {', '.join(model.dofs[:3])}",
            )


def _name_faults(mesh: Mesh, wanted: _Wanted) -> Iterator[Fault]:
    """Surfaces and sets that are not in the mesh."""
    surfaces, sets = user_names(mesh.surfaces), user_names({*mesh.node_sets, *mesh.surfaces})
    named: dict[Where, str] = {("surface",): wanted.surface} if isinstance(wanted.surface, str) else {}
    named |= {("pressure", shape): on for shape, on in wanted.pressure.items()}
    for where, name in named.items():
        if name not in mesh.surfaces:
            yield Fault(where, f"there is no surface '{name}' in the model", remedy=suggestion(name, surfaces))
    for name in wanted.films:
        if name not in mesh.surfaces and name != "boundary":
            yield Fault(
                "films", f"there is no surface '{name}' in the model", remedy=suggestion(name, [*surfaces, "boundary"])
            )
    if wanted.cold is not None and wanted.cold not in {*mesh.node_sets, *mesh.surfaces}:
        yield Fault("cold", f"there is no node set '{wanted.cold}' in the model", remedy=suggestion(wanted.cold, sets))


def _surface(wanted: str | Surface | Mapping[str, Any], mesh: Mesh) -> Surface:
    if isinstance(wanted, Surface):
        return wanted
    if isinstance(wanted, str):
        return mesh.surface(wanted)
    if "direction" not in wanted or set(wanted) - {"direction", "angle", "depth"}:
        raise InputError(
            Fault("surface", found=shown(dict(wanted)), expected="a name, or direction with angle and depth")
        )
    return surface_towards(mesh, **wanted)


def _contact_nodes(wanted: int | Reals, mesh: Mesh) -> Any:
    """How many, node indices of labels, or positions."""
    expected = "how many, node labels (n,), or positions (n, 3)"
    places = count_or_numbers("contacts", wanted, expected)
    if isinstance(places, int):
        return places
    if (places.ndim != 1 and places.shape != (len(places), 3)) or not places.size:
        raise wrong("contacts", wanted, expected)
    if places.ndim == 2:
        return places
    labels = [whole("contacts, node label", label) for label in places]
    return node_indices(mesh.labels, np.array(labels), "contacts")


def _seen(model: ImportedModel, keep: Sequence[str]) -> SkinRows | None:
    """The skin of a model that brought the mesh of its matrices."""
    try:
        return None if model.mesh is None else skin_rows(model, model.dof_positions(keep))
    except InputError:  # rotations, or another mesh: it can be computed, and not seen
        return None


def wanted_elements(stress: Any, at: Any) -> Any:
    """What ``chosen_elements`` takes, or None."""
    if not isinstance(at, str) or at not in (ELEMENTS, NODES):
        raise wrong("stress_at", at, f'"{ELEMENTS}" or "{NODES}"')
    if stress is None:
        return None
    expected = '"all", or numbers of elements, names of element sets or surfaces'
    items = one_or_listed("stress", stress, expected)
    if not items:
        raise wrong("stress", stress, expected)
    return [item if isinstance(item, str) else whole("stress, element number", item, 0, MOST_NUMBER) for item in items]


def _strains(model: ImportedModel, elements: Any, at: str) -> StrainRows:
    """Strains of a model that brought a mesh with materials."""
    missing = "no mesh" if model.mesh is None else "a mesh without materials" if not model.materials else ""
    if missing:
        what = f"{model.source} has {missing}, and stress comes from elements and their material"
        raise InputError(Fault("stress", what, remedy="import the mesh too, with its materials, or leave stress out"))
    model.in_mesh("stress")
    return strain_rows(model, elements, at)


def _unseen_stress(model: ImportedModel) -> Iterator[str]:
    if model.speed:
        yield (
            f"{model.source}: the stress is that of vibration, from the mesh at rest; that of rotation, and what it "
            "changes in the places of the nodes, is not in it: add it to the mean stress"
        )


def _kept(model: ImportedModel, keep: Sequence[str]) -> dict[str, Any]:
    """Dofs to keep, by name where each has its row."""
    if model.dependence is None or not set(keep) & set(model.dependent_dofs):
        return {"keep": keep}
    return {"keep": model.directions(keep), "names": tuple(keep)}


def _with_kept(whole: ContactModel, model: ImportedModel, keep: Sequence[str]) -> dict[str, Any]:
    """The kept directions: those of the contacts, then the dofs asked for by name."""
    if not keep:
        return whole.request
    from scipy.sparse import csc_array, hstack

    directions = csc_array(hstack([whole.directions, model.directions(keep)]))
    request = whole.request
    places = np.concatenate([request["skin"].places, model.dof_positions(keep)])
    skin = replace(request["skin"], places=places)
    return {**request, "keep": directions, "names": (*whole.points.dofs, *keep), "skin": skin}


_ROUNDING = 1e-12
"""Of a skew-symmetric matrix, its symmetric part at most."""


def _unused(model: ImportedModel) -> Iterator[str]:
    if model.C is None or not model.C.nnz:
        return
    if not is_symmetric(model.C):
        yield (
            f"{model.source}: holds Coriolis forces, which a reduction to real modes leaves out; for these make an "
            "ss.MatrixStructure of its matrices and reduce it with ss.models.craig_bampton (in a case file "
            'kind = "matrices" with keep and modes)'
        )
    if abs(symmetric_part(model.C)).max() > _ROUNDING * abs(model.C).max():
        yield (
            f"{model.source}: holds a damping matrix, which a reduction to real modes does not use; give "
            "loss_factor or damping_ratio"
        )
