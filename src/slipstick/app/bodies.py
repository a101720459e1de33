"""Finite element models of a case file: read or meshed, given contacts on a surface, reduced, kept for the next run."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.app.body import Body, ContactPoints, FullModel, Tell
from slipstick.app.fe_tables import BladeTable, FeTable, MaterialTable
from slipstick.app.paths import inside
from slipstick.app.sentences import shown, suggestion
from slipstick.errors import InputError, SlipstickError

if TYPE_CHECKING:
    from slipstick.fem.contact_model import ContactModel
    from slipstick.fem.imported import ImportedModel
    from slipstick.fem.materials import Material
    from slipstick.fem.mesh import Mesh, Surface
    from slipstick.fem.model import ElasticModel
    from slipstick.fem.rubbing_blade import BladeModel, RubbingBlade
    from slipstick.solve.eigen import Progress
    from slipstick.structure.reduction import Reduction

CACHE = "slipstick-cache"
"""Folder beside the case in which reductions are kept."""

_EVERY = 4.0
_NEEDED = ("young", "poisson", "density")


def cache_folder(folder: Path) -> Path | None:
    """Where reductions are kept; None where the folder of the case cannot be written."""
    own = folder / CACHE
    return own if os.access(own if own.exists() else folder, os.W_OK) else None


def stages(tell: Tell) -> Callable[[Progress], None]:
    """A listener that tells each stage when it begins, and now and then how far it is."""
    last, stage = [time.monotonic()], [""]

    def hear(event: Progress) -> None:
        now = time.monotonic()
        if event.stage != stage[0]:
            tell(f"  {event.stage} ...")
        elif now - last[0] >= _EVERY:
            tell(f"  {event.stage}: {event.done} of {event.total}")
        else:
            return
        last[0], stage[0] = now, event.stage

    return hear


def _reduced(tell: Tell, make: Callable[[Callable[[Progress], None]], Any]) -> Any:
    """A reduction; one that does not succeed is a fault of the case."""
    try:
        return make(stages(tell))
    except InputError:
        raise
    except SlipstickError as error:
        raise InputError(str(error)) from None


# ---------------------------------------------------------------------------------------------- the parametric blade


def blade_body(table: BladeTable, folder: Path, tell: Tell) -> Body:
    """The parametric blade of ``kind = "blade"``.

    Raises
    ------
    InputError
        For an unknown size, dimensions that make no blade, too many contacts.
    """
    from slipstick.fem.rubbing_blade import rubbing_blade

    setup = _blade_model(table)
    cache = cache_folder(folder)
    tell(f"structure: {table.size} blade, from {CACHE} or by mesh, matrices and influence matrix ...")
    began = time.perf_counter()
    blade: RubbingBlade = _reduced(
        tell, lambda hear: rubbing_blade(setup, loss_factor=table.loss_factor, cache=cache, listener=hear)
    )
    return Body(
        structure=blade.structure,
        points=ContactPoints(
            positions=blade.positions, normals=blade.normals, areas=blade.areas, influence=blade.influence
        ),
        full=FullModel(
            n_dofs=blade.n_dofs,
            solver=blade.solver,
            modes=len(blade.structure.omega),
            reused=blade.reused,
            seconds=time.perf_counter() - began,
            note="parametric blade, SI units",
            comparison=lambda: _blade_again(setup, blade),
        ),
    )


def _blade_model(table: BladeTable) -> BladeModel:
    from dataclasses import replace

    from slipstick.fem.blade import ELEMENT_SIZES, blade_shape
    from slipstick.fem.rubbing_blade import BLADE_STEEL, BladeModel

    if table.size not in ELEMENT_SIZES:
        raise InputError(f"size: found {shown(table.size)}; {suggestion(table.size, ELEMENT_SIZES)}")
    dimensions = {name: getattr(table, name) for name in ("height", "chord", "thickness", "twist")}
    shape = replace(blade_shape(table.size), **{name: value for name, value in dimensions.items() if value is not None})
    material = BLADE_STEEL if table.material is None else _material(table.material)
    more = {} if table.modes is None else {"modes": table.modes}
    return BladeModel(
        shape=shape, material=material, contacts=table.contacts, radius=table.radius, film=table.film, **more
    )


def _blade_again(setup: BladeModel, blade: RubbingBlade) -> tuple[Reduction, Any, Any]:
    """The full blade once more, for comparison with the reduction, which may come from disk."""
    import numpy as np

    from slipstick.fem.rubbing_blade import finite_element_blade
    from slipstick.structure.reduction import Reduction

    whole = finite_element_blade(setup)
    reduction = Reduction(
        structure=blade.structure,
        directions=whole.request["keep"],
        n_full=blade.n_dofs,
        solver=blade.solver,
        residuals=np.empty(0),
        complete=None,
        error_estimate=None,
    )
    return reduction, whole.model.K, whole.model.M


def _material(table: MaterialTable) -> Material:
    from slipstick.fem.materials import Material

    given = {name: value for name, value in table.model_dump().items() if value is not None}
    missing = [
        f"material.{name} is missing; a material needs young, poisson and density"
        for name in _NEEDED
        if name not in given
    ]
    if missing:
        raise InputError(missing)
    return Material(**given)


# ------------------------------------------------------------------------------------------------- an imported model


def fe_body(table: FeTable, folder: Path, tell: Tell) -> Body:
    """The finite element model of ``kind = "fe"``.

    Raises
    ------
    InputError
        For files, materials, sets, surfaces and dofs that are not there, and models that are not held.
    """
    path = _path(table.file, folder)
    tell(f"structure: reading {table.file} ...")
    imported = _imported(table, path)
    if table.surface is None:
        return _fe_reduced(table, folder, tell, imported, imported, None)
    whole = _with_contacts(table, imported, tell)
    return _fe_reduced(table, folder, tell, imported, whole.model, whole)


def _path(name: str, folder: Path) -> Path:
    try:
        return inside(folder, name)
    except ValueError as error:
        raise InputError(f"file: found {shown(name)}; {error}") from None


def _imported(table: FeTable, path: Path) -> ImportedModel:
    """A model made by the import, or a mesh assembled here."""
    from slipstick.io.mesh_files import MESH_SUFFIXES
    from slipstick.io.model import ImportOptions, read_model
    from slipstick.io.model_store import load_model

    if path.suffix.lower() in MESH_SUFFIXES:
        material = None if table.material is None else _material(table.material)
        return read_model(path, ImportOptions(material=material, fixed=table.fixed, to_quadratic=table.quadratic))
    faults = [
        f"material.{name}: {path.name} holds matrices with a material already; give conductivity alone"
        for name in _NEEDED
        if table.material is not None and getattr(table.material, name) is not None
    ]
    if table.quadratic:
        faults.append(f"quadratic: {path.name} holds matrices already; give --quadratic to 'slipstick import'")
    if faults:
        raise InputError(faults)
    model = load_model(path)
    unknown = [
        f"fixed: there is no node set '{name}' in {path.name}; {suggestion(name, model.node_sets)}"
        for name in table.fixed
        if name not in model.node_sets
    ]
    if unknown:
        raise InputError(unknown)
    return _conducting(model.fix(list(table.fixed)) if table.fixed else model, table.material)


def _conducting(model: ImportedModel, material: MaterialTable | None) -> ImportedModel:
    """The model with the conductivity of the case file."""
    from dataclasses import replace

    from slipstick.fem.materials import Material

    if material is None or material.conductivity is None:
        return model
    known = model.materials or {"all": Material(young=1.0, poisson=0.0)}
    return replace(model, materials={n: replace(m, conductivity=material.conductivity) for n, m in known.items()})


def _with_contacts(table: FeTable, imported: ImportedModel, tell: Tell) -> ContactModel:
    from slipstick.fem.contact_model import of_import, with_contacts

    model = of_import(imported)
    mesh = model.mesh
    faults = [*_surface_faults(table, mesh), *_conduction_faults(table, mesh)]
    if faults:
        raise InputError(faults)
    tell(f"structure: contacts on the surface{', influence matrix' if table.films or table.cold else ''} ...")
    return with_contacts(
        model,
        surface=_surface(table.surface, mesh),
        contacts=_contact_nodes(table.contacts, mesh),
        radius=table.radius,
        pressures=table.pressure,
        films=table.films,
        cold=table.cold,
    )


def _surface_faults(table: FeTable, mesh: Mesh) -> Iterable[str]:
    named = {"surface": [table.surface] if isinstance(table.surface, str) else []}
    named |= {f"pressure.{shape}": [on] for shape, on in table.pressure.items()}
    for key, names in named.items():
        for name in names:
            if name not in mesh.surfaces:
                yield f"{key}: there is no surface '{name}' in {table.file}; {suggestion(name, mesh.surfaces)}"


def _conduction_faults(table: FeTable, mesh: Mesh) -> Iterable[str]:
    for name in table.films:
        if name not in mesh.surfaces and name != "boundary":
            known = suggestion(name, [*mesh.surfaces, "boundary"])
            yield f"films: there is no surface '{name}' in {table.file}; {known}"
    sets = {*mesh.node_sets, *mesh.surfaces}
    if table.cold is not None and table.cold not in sets:
        yield f"cold: there is no node set '{table.cold}' in {table.file}; {suggestion(table.cold, sorted(sets))}"


def _surface(wanted: Any, mesh: Mesh) -> Surface:
    from slipstick.fem.boundary import surface_towards

    if isinstance(wanted, str):
        return mesh.surface(wanted)
    options = {name: wanted[name] for name in ("angle", "depth") if name in wanted}
    return surface_towards(mesh, wanted["direction"], **options)


def _contact_nodes(wanted: Any, mesh: Mesh) -> Any:
    """How many, node indices of labels, or positions."""
    import numpy as np

    from slipstick.io.mesh_model import node_indices

    if wanted is None or isinstance(wanted, int):
        return 8 if wanted is None else wanted
    if isinstance(wanted[0], int):
        return node_indices(mesh.labels, np.asarray(wanted, dtype=np.int64), "contacts")
    return np.asarray(wanted, dtype=float)


def _fe_reduced(
    table: FeTable,
    folder: Path,
    tell: Tell,
    imported: ImportedModel,
    model: ImportedModel | ElasticModel,
    whole: ContactModel | None,
) -> Body:
    from slipstick.structure.reduction import reduce_model

    tell(f"structure: reducing {model.K.shape[0]} dofs, or reading it from {CACHE} ...")
    began = time.perf_counter()
    reduction: Reduction = _reduced(
        tell,
        lambda hear: reduce_model(
            model.K,
            model.M,
            **_request(table, model.dofs, whole),
            dofs=model.dofs,
            **_how_many(table, model.K.shape[0]),
            loss_factor=table.loss_factor,
            damping_ratio=table.damping_ratio,
            cache=cache_folder(folder),
            listener=hear,
        ),
    )
    return Body(
        structure=reduction.structure,
        points=None if whole is None else _contact_points(whole),
        full=FullModel(
            n_dofs=reduction.n_full,
            solver=reduction.solver,
            modes=len(reduction.structure.omega),
            reused=reduction.reused,
            seconds=time.perf_counter() - began,
            note=f"{imported.source}; units: {imported.units}",
            comparison=lambda: (reduction, model.K, model.M),
        ),
    )


def _contact_points(whole: ContactModel) -> ContactPoints:
    patches = whole.patches
    return ContactPoints(
        positions=patches.positions, normals=patches.normals, areas=patches.areas, influence=whole.influence
    )


def _how_many(table: FeTable, n: int) -> Mapping[str, Any]:
    if table.accuracy is not None:
        assert table.up_to is not None
        return {"accuracy": table.accuracy, "frequency_range": (0.0, table.up_to)}
    return {"modes": table.modes if table.modes is not None else min(128, n)}


def _request(table: FeTable, dofs: Sequence[str], whole: ContactModel | None) -> Mapping[str, Any]:
    """The kept directions: those of the contacts, then the dofs asked for by name."""
    from scipy.sparse import csc_array, hstack

    place = {name: row for row, name in enumerate(dofs)}
    unknown = [
        f"keep: there is no free dof '{name}' in {table.file}; names look like {', '.join(list(dofs)[:3])}"
        for name in table.keep
        if name not in place
    ]
    if unknown:
        raise InputError(unknown)
    if whole is None:
        return {"keep": table.keep}
    request = whole.request
    if not table.keep:
        return request
    rows = [place[name] for name in table.keep]
    units = csc_array(([1.0] * len(rows), (rows, range(len(rows)))), shape=(len(dofs), len(rows)))
    return {**request, "keep": csc_array(hstack([request["keep"], units])), "names": (*request["names"], *table.keep)}
