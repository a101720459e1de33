"""Finite element models of a case file, ``[structure] kind = "fe"``: read, given contacts on a surface, reduced."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.app.body import Body, Comparison, ContactPoints, FullModel, Tell
from slipstick.app.fe_tables import FeTable, MaterialTable
from slipstick.app.paths import inside
from slipstick.app.reducing import CACHE, NEEDED, cache_folder, material_of, reduced
from slipstick.app.sentences import shown, suggestion
from slipstick.errors import InputError
from slipstick.fem.mesh import user_names

if TYPE_CHECKING:
    from slipstick.fem.imported import ImportedModel
    from slipstick.fem.mesh import Mesh, Surface
    from slipstick.fem.model import ElasticModel
    from slipstick.models.surface_model import ContactModel
    from slipstick.structure.reduction import Reduction


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
    from slipstick.importers.import_model import ImportOptions, read_model
    from slipstick.importers.mesh_files import MESH_SUFFIXES
    from slipstick.io.model_file import load_model

    if path.suffix.lower() in MESH_SUFFIXES:
        material = None if table.material is None else material_of(table.material)
        options = ImportOptions(material=material, fixed=table.fixed, to_quadratic=table.quadratic)
        return read_model(path, options, quiet=True)
    faults = [
        f"material.{name}: {path.name} holds matrices with a material already; give conductivity alone"
        for name in NEEDED
        if table.material is not None and getattr(table.material, name) is not None
    ]
    if table.quadratic:
        faults.append(f"quadratic: {path.name} holds matrices already; give --quadratic to 'slipstick import'")
    if faults:
        raise InputError(faults)
    model = load_model(path, quiet=True)
    unknown = [
        f"fixed: there is no node set '{name}' in {path.name}; {suggestion(name, user_names(model.node_sets))}"
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
    from slipstick.models.surface_model import of_import, with_contacts

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
                known = suggestion(name, user_names(mesh.surfaces))
                yield f"{key}: there is no surface '{name}' in {table.file}; {known}"


def _conduction_faults(table: FeTable, mesh: Mesh) -> Iterable[str]:
    for name in table.films:
        if name not in mesh.surfaces and name != "boundary":
            known = suggestion(name, user_names([*mesh.surfaces, "boundary"]))
            yield f"films: there is no surface '{name}' in {table.file}; {known}"
    sets = {*mesh.node_sets, *mesh.surfaces}
    if table.cold is not None and table.cold not in sets:
        yield f"cold: there is no node set '{table.cold}' in {table.file}; {suggestion(table.cold, user_names(sets))}"


def _surface(wanted: Any, mesh: Mesh) -> Surface:
    from slipstick.fem.boundary import surface_towards

    if isinstance(wanted, str):
        return mesh.surface(wanted)
    options = {name: wanted[name] for name in ("angle", "depth") if name in wanted}
    return surface_towards(mesh, wanted["direction"], **options)


def _contact_nodes(wanted: Any, mesh: Mesh) -> Any:
    """How many, node indices of labels, or positions."""
    import numpy as np

    from slipstick.importers.mesh_model import node_indices

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
    reduction: Reduction = reduced(
        tell,
        lambda hear: reduce_model(
            model.K,
            model.M,
            **_request(table, model.dofs, whole),
            dofs=model.dofs,
            **_how_many(table, model.K.shape[0]),
            loss_factor=table.loss_factor,
            damping_ratio=table.damping_ratio,
            force=True,  # judged once range and harmonics are known
            cache=cache_folder(folder),
            listener=hear,
        ),
    )
    return Body(
        structure=reduction.structure,
        force=table.force,
        points=None if whole is None else _contact_points(whole),
        full=FullModel(
            n_dofs=reduction.n_full,
            solver=reduction.solver,
            modes=len(reduction.structure.omega),
            reused=reduction.reused,
            seconds=time.perf_counter() - began,
            note=f"{imported.source}; units: {imported.units}",
            comparison=partial(_compared, reduction, model.K, model.M),
        ),
        notes=imported.notes,
        warnings=(*imported.warnings, *_unused(table, imported)),
    )


def _compared(reduction: Reduction, K: Any, M: Any) -> Comparison:
    return reduction, K, M


def _unused(table: FeTable, imported: ImportedModel) -> Iterable[str]:
    if imported.C is not None and imported.C.nnz:
        yield (
            f"[structure] {table.file} holds a damping matrix, which a reduction to real modes does not use; give "
            "loss_factor or damping_ratio"
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
