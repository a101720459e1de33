"""A model from the files of another code: the reader that fits, positions and mesh beside matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.conversion import converted
from slipstick.fem.materials import Material
from slipstick.fem.model import ImportedModel
from slipstick.fem.refine import linear_warnings
from slipstick.fem.unit_systems import NOT_STATED, SI, Conversion, conversion, factors_of, looks, material_doubts
from slipstick.importers.deck import Deck
from slipstick.importers.findings import refused
from slipstick.importers.formats import format_of
from slipstick.importers.matrix_model import build_model, place_warnings
from slipstick.importers.mesh_checks import mass_warnings
from slipstick.importers.mesh_files import read_mesh
from slipstick.importers.mesh_model import assemble_mesh
from slipstick.importers.nastran.mesh import holds_solids
from slipstick.importers.roles import MODELS, ImportOptions, Roles, refuse_unread, refuse_unused, roles_of
from slipstick.importers.turned import to_global
from slipstick.io.model_file import load_model


def read_model(
    files: Sequence[str | Path] | str | Path, options: ImportOptions | None = None, *, quiet: bool = False
) -> ImportedModel:
    """A model from one or several files; the reader follows from the names and the content.

    What is approximated or suspicious is in ``model.warnings``, and raised as SlipstickWarning unless ``quiet``.

    Raises
    ------
    InputError
        One sentence for each fault.
    """
    options = options or ImportOptions()
    factors = _stated_factors(options)
    model = _read_model(files, options if factors is None else _in_own_units(options, factors))
    if options.to is not None and factors is None:
        factors = _own_factors(model, options)
    if factors is not None:
        model = _in_new_units(model, options, factors)
    first = files if isinstance(files, str | Path) else files[0]
    if Path(first).suffix.lower() not in MODELS:  # a model file has its warnings already
        doubts = material_doubts(model.materials, model.units, model.source)
        model = replace(model, warnings=(*model.warnings, *doubts))
    if options.conductivity is not None:
        if model.mesh is None:
            raise InputError(
                Fault(
                    "conductivity",
                    "without a mesh it has no effect",
                    remedy="import the mesh too, or leave it out",
                )
            )
        model = model.conducting(options.conductivity)
    if not quiet:
        model.announce()
    return model


def _stated_factors(options: ImportOptions) -> Conversion | None:
    """The conversion of the numbers in the files, as far as the options say it."""
    if options.scale is not None and options.to is not None:
        raise InputError(Fault("to", "is given together with scale", remedy="keep one"))
    if options.scale is not None:
        return factors_of(options.scale, "scale")
    return None if options.to is None or options.units is None else conversion(options.units, options.to)


def _own_factors(model: ImportedModel, options: ImportOptions) -> Conversion:
    """The conversion by the units that the file states."""
    if model.units == NOT_STATED or options.material is not None:
        like = looks(model.materials)
        remedy = f'give units = "N, mm, t, s"{f" ({like})" if like else ""}'
        raise InputError(Fault("to", "the units of the files are not stated", remedy=remedy))
    return conversion(model.units, str(options.to))


def _in_own_units(options: ImportOptions, factors: Conversion) -> ImportOptions:
    """Options with the material, which holds after the conversion, in the units of the files."""
    if options.material is None:
        return options
    return replace(options, material=factors.inverse.material(options.material))


def _in_new_units(model: ImportedModel, options: ImportOptions, factors: Conversion) -> ImportedModel:
    told = {"length": factors.length, "force": factors.force, "time": factors.time, "mass": factors.mass}
    changed = ", ".join(f"{name} {value:.6g}" for name, value in told.items() if value != 1.0)
    before = model.units
    note = f"numbers of the files ({before}) multiplied: {changed or 'by 1'}"
    wanted = SI if (options.to or "").strip().upper() == "SI" else options.to
    units = wanted or (before if before == NOT_STATED else f"{before}, multiplied: {changed or 'by 1'}")
    return replace(converted(model, factors), units=units, notes=(*model.notes, note))


def _read_model(files: Sequence[str | Path] | str | Path, options: ImportOptions) -> ImportedModel:
    paths = [Path(files)] if isinstance(files, (str, Path)) else [Path(file) for file in files]
    if not paths:
        raise InputError(Fault(statement="no file to import was given"))
    missing = [Fault(Place(str(path)), "there is no such file") for path in paths if not path.is_file()]
    if missing:
        raise InputError(missing)
    refuse_unread(paths)
    source = ", ".join(path.name for path in paths)
    roles = roles_of(paths, options)
    refuse_unused(paths, roles, options)
    if not roles.matrices:
        return _without_matrices(paths[0], source, options)
    deck = _read(roles, options)
    mesh = _mesh_beside(deck, roles)
    if mesh and mesh.axes:
        deck = _along_global(deck, mesh, paths, source)
    deck.units = options.units or (mesh.units if mesh else NOT_STATED)
    model = build_model(deck, source=source)
    model = replace(model, warnings=(*model.warnings, *place_warnings(model)))
    if mesh:
        model = _with_mesh(model, mesh, options.material)
    elif roles.bulk is not None and holds_solids(roles.bulk):
        model = _weighed(model, roles.bulk, options)
    return model.fix(list(options.fixed)) if options.fixed else model


def _along_global(deck: Deck, mesh: Deck, paths: Sequence[Path], source: str) -> Deck:
    """Rows along global directions: CalculiX writes them so, Ansys along those of the nodes; others are unknown."""
    rows = {known.rows for path in paths if (known := format_of(path)) is not None and known.holds == "matrices"}
    if "nodes" in rows:
        return to_global(deck, {node: axes.T for node, axes in mesh.axes.items()}, source)
    rotated = sorted(set(mesh.axes) & set([] if deck.rows is None else deck.rows[:, 0].tolist()))
    if rotated and "global" not in rows:
        raise refused(
            source,
            f"{len(rotated)} nodes ({rotated[0]}, ...) have rotated directions, and so have the rows of the matrices",
            remedy="rotate the nodes to the global directions and export again",
        )
    return deck


def _with_mesh(model: ImportedModel, imported: Deck, material: Material | None) -> ImportedModel:
    """The model of matrices with the mesh they came from, and what does not fit between the two."""
    mesh = imported.mesh
    assert mesh is not None
    materials = imported.materials if material is None else {"all": material}
    doubts = [*model.warnings, *(coupling.beside_matrices for coupling in imported.couplings)]
    doubts += [coupling.beside_matrices for coupling in imported.applied]
    doubts += linear_warnings(mesh, model.source, ("tet4",))
    notes = (*model.notes, *imported.notes)
    if materials:
        doubts += mass_warnings(model, mesh, material or materials, imported.lumped, imported.held_rows)
    else:
        what = (
            "the mesh has no material: its mass is not compared with that of the matrices; give a material to compare"
        )
        notes = (*notes, f"{model.source}: {what}")
    notes += tuple(f"the mesh assembled here, not the matrices: {sentence}" for sentence in imported.warnings)
    return replace(model, mesh=mesh, materials=materials, warnings=tuple(doubts), notes=notes)


def _weighed(model: ImportedModel, path: Path, options: ImportOptions) -> ImportedModel:
    """The model of matrices, compared with the solids of the bulk data that tells its rows."""
    try:
        beside = read_mesh(path, options.constraints)
    except InputError as error:
        what = f"the mass of the solids is not compared with that of the matrices: {error}"
        return replace(model, notes=(*model.notes, f"{model.source}: {what}"))
    materials = beside.materials if options.material is None else {"all": options.material}
    doubts = list(material_doubts(materials, model.units, model.source))
    if materials and beside.mesh is not None:
        doubts += mass_warnings(model, beside.mesh, options.material or materials, beside.lumped, beside.held_rows)
    return replace(model, warnings=(*model.warnings, *doubts))


def _without_matrices(path: Path, source: str, options: ImportOptions) -> ImportedModel:
    if path.suffix.lower() in MODELS:
        model = load_model(path, quiet=True)
        model = replace(model, units=options.units or model.units)
        return model.fix(list(options.fixed)) if options.fixed else model
    return assemble_file(path, source, options)


def assemble_file(path: Path, source: str, options: ImportOptions) -> ImportedModel:
    """A mesh file read and assembled with the elements of this package."""
    return assemble_mesh(
        read_mesh(path, options.constraints),
        source=source,
        material=options.material,
        fixed=options.fixed,
        quadratic=options.quadratic,
        units=options.units,
    )


def _read(roles: Roles, options: ImportOptions) -> Deck:
    known = format_of(roles.first)
    if known is None or known.holds != "matrices":
        raise refused(roles.first.name, "is no file of matrices", remedy="give it as a mesh")
    others = [path.name for path in roles.matrices.values() if path != roles.first]
    if others and known.whole:
        raise refused(roles.first.name, "brings its own mass", remedy=f"leave out {', '.join(others)}")
    return known.reader(roles, options)


def _mesh_beside(deck: Deck, roles: Roles) -> Deck | None:
    """The mesh of a file beside the matrices, which with bulk data tells where their nodes are."""
    if roles.nodes is None:
        return None
    if roles.bulk is not None:
        from slipstick.importers.nastran.bulk import read_bulk
        from slipstick.importers.nastran.matrices import tell

        if not deck.nodes:
            data = read_bulk(roles.bulk)
            deck.nodes = dict(data.nodes)
            tell(deck, data)
        return None
    imported = read_mesh(roles.nodes)
    deck.mesh = imported.mesh
    return imported
