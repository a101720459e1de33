"""Models of other finite element codes: ``ss.import_model``, and the reading, comparison and conversion behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array, diags_array

from slipstick.errors import Fault, InputError, Place
from slipstick.faults import Gathering, listed
from slipstick.faults import path as path_of
from slipstick.fem import extras
from slipstick.fem.materials import Material
from slipstick.fem.mesh import user_names
from slipstick.fem.model import ImportedModel
from slipstick.fem.refine import linear_warnings
from slipstick.fem.unit_systems import NOT_STATED, SI, Conversion, conversion, factors_of, looks, material_warnings
from slipstick.importers.deck import Deck
from slipstick.importers.findings import made_of, refused
from slipstick.importers.formats import FORMATS, format_of
from slipstick.importers.grouped import KINDS, MARK, Cells, grouped_model
from slipstick.importers.matrix_model import build_model, place_warnings, support_notes, to_global
from slipstick.importers.mesh_checks import mass_warnings
from slipstick.importers.mesh_model import assemble_mesh
from slipstick.importers.nastran.mesh import holds_solids
from slipstick.importers.roles import MODELS, ImportOptions, Roles, refuse_unread, refuse_unused, roles_of
from slipstick.importers.text_numbers import read_bytes
from slipstick.io.model_file import load_model, save_model
from slipstick.typing import Array, IntArray


def import_model(
    files: Sequence[str | Path] | str | Path,
    *,
    output: str | Path | None = None,
    mass: str | Path | None = None,
    damping: str | Path | None = None,
    dof_map: str | Path | None = None,
    nodes: str | Path | None = None,
    names: Mapping[str, str] | None = None,
    constraints: int | None = None,
    material: Material | None = None,
    conductivity: float | None = None,
    expansion: float | Sequence[Sequence[float]] | None = None,
    reference: float | None = None,
    fixed: str | Sequence[str] = (),
    quadratic: bool = False,
    units: str | None = None,
    scale: Mapping[str, float] | None = None,
    to: str | None = None,
) -> ImportedModel:
    """A finite element model from the files of another code, or from a model file of slipstick.

    Ansys .full, HBMAT (.matrix, .hb with .mapping), .cdb; Nastran .op4 with bulk data, DMIG in .pch; CalculiX .sti with
    .mas and .dof; Abaqus .mtx; MatrixMarket .mtx and .npz with a map file; meshes .inp, .msh, .bdf;
    model.h5.

    Parameters
    ----------
    files
        One file, or several that belong together.
    output
        Where the model is kept as one HDF5 file, which a case file may name; a model there is replaced once the new one
        is whole, a file of another kind never.
    mass, damping, dof_map, nodes, names, constraints, fixed, quadratic, units, scale, to
        What the files do not say: see :class:`ImportOptions`.
    material, conductivity, expansion, reference
        Likewise of materials.

    Returns
    -------
    ImportedModel
        Its ``notes`` say what was left out.

    Raises
    ------
    InputError
        One sentence for each fault of the files.

    Warns
    -----
    SlipstickWarning
        What is approximated or suspicious, as in the model's ``warnings``.

    Examples
    --------
    With a mesh of yours that has the node set ROOT and the surface TIP:

    >>> import slipstick as ss
    >>> steel = ss.Material(young=2.1e11, poisson=0.3, density=7850.0)
    >>> model = ss.import_model("blade.inp", material=steel, fixed="ROOT", units="N, m, kg, s")  # doctest: +SKIP
    >>> body = ss.reduced_body(model, surface="TIP", contacts=4, modes=32)  # doctest: +SKIP
    """
    gathering = Gathering()
    wanted: dict[str, Any] = {
        "mass": mass, "damping": damping, "dof_map": dof_map, "nodes": nodes, "names": {} if names is None else names,
        "constraints": constraints, "material": material, "conductivity": conductivity, "expansion": expansion,
        "reference": reference, "fixed": fixed, "quadratic": quadratic, "units": units, "scale": scale, "to": to,
    }  # fmt: skip
    options = gathering.take(ImportOptions, **wanted)
    place = None if output is None else gathering.take(path_of, "output", output)
    sources = gathering.take(_files, files)
    gathering.end()
    model = read_model(sources or (), options, quiet=True)
    if place is not None:
        save_model(model, place)
    model.announce()
    return model


def _files(files: object) -> tuple[Path, ...]:
    expected = "a file, or a list of files"
    if isinstance(files, str | PathLike):
        return (path_of("files", files, expected),)
    gathering = Gathering()
    paths = [gathering.take(path_of, "files", item, expected) for item in listed("files", files, expected)]
    gathering.end()
    return tuple(path for path in paths if path is not None)


def summary(model: ImportedModel) -> tuple[str, ...]:
    """Sentences on the size of a model, its units, the notes of the import, and parts that are not held."""
    nodes = len(set(model.dof_nodes.tolist()))
    known = "with coordinates" if len(model.node_ids) else "without coordinates"
    sets = f"; sets: {', '.join(user_names(model.node_sets))}" if model.node_sets else ""
    tied = f", {len(model.dependent)} that depend on others" if len(model.dependent) else ""
    held = f"{len(model.constrained)} constrained{tied}"
    head = f"{model.source}: {model.n_dofs} dofs on {nodes} nodes, {known}, {held}{sets}"
    return (head, f"units: {model.units_told}; {_sizes(model)}", *model.notes, *support_notes(model))


def _sizes(model: ImportedModel) -> str:
    """Numbers by which a wrong system of units shows."""
    try:
        along = model.translation("x")
        mass = f"the mass that moves along x is {along @ (model.M @ along):.4g}"
    except InputError:
        mass = "its equations do not let it move along x as a whole"
    if not len(model.node_ids):
        return mass
    return f"{mass}, the largest dimension {np.ptp(model.coordinates, axis=0).max():.4g}"


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
        warnings = material_warnings(model.materials, model.units, model.source)
        model = replace(model, warnings=(*model.warnings, *warnings))
    more = {name: getattr(options, name) for name in ("conductivity", "expansion", "reference")}
    more = {name: value for name, value in more.items() if value is not None}
    if more and model.mesh is None:
        what, remedy = "without a mesh it has no effect", "import the mesh too, or leave it out"
        raise InputError([Fault(name, what, remedy=remedy) for name in more])
    if more:
        model = model.with_properties(**more)
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
    values = {"length": factors.length, "force": factors.force, "time": factors.time, "mass": factors.mass}
    changed = ", ".join(f"{name} {value:.6g}" for name, value in values.items() if value != 1.0)
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
    warnings = [*model.warnings, *(coupling.beside_matrices for coupling in imported.couplings)]
    warnings += [coupling.beside_matrices for coupling in imported.applied]
    warnings += linear_warnings(mesh, model.source, ("tet4",))
    if imported.contact_pairs:
        what = f"the matrices may hold the contact stiffness of {next(iter(imported.contact_pairs))}"
        warnings.append(f"{model.source}: {what} and others: export them without contacts where joints are put")
    notes = (*model.notes, *imported.notes)
    if materials:
        warnings += mass_warnings(model, mesh, material or materials, imported.lumped, imported.held_rows)
    else:
        what = (
            "the mesh has no material: its mass is not compared with that of the matrices; give a material to compare"
        )
        notes = (*notes, f"{model.source}: {what}")
    notes += tuple(f"the mesh assembled here, not the matrices: {sentence}" for sentence in imported.warnings)
    return replace(
        model,
        mesh=mesh,
        materials=materials,
        contact_pairs=imported.contact_pairs,
        pretension_sections=imported.pretension_sections,
        load_steps=imported.load_steps,
        warnings=tuple(warnings),
        notes=notes,
    )


def _weighed(model: ImportedModel, path: Path, options: ImportOptions) -> ImportedModel:
    """The model of matrices, compared with the solids of the bulk data that tells its rows."""
    try:
        beside = read_mesh(path, options.constraints)
    except InputError as error:
        what = f"the mass of the solids is not compared with that of the matrices: {error}"
        return replace(model, notes=(*model.notes, f"{model.source}: {what}"))
    materials = beside.materials if options.material is None else {"all": options.material}
    warnings = list(material_warnings(materials, model.units, model.source))
    if materials and beside.mesh is not None:
        warnings += mass_warnings(model, beside.mesh, options.material or materials, beside.lumped, beside.held_rows)
    return replace(model, warnings=(*model.warnings, *warnings))


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


def converted(model: ImportedModel, factors: Conversion) -> ImportedModel:
    """The model in other units; rotations have none, generalised coordinates are taken for lengths."""
    size = _arms(model.dof_components, factors)
    mesh = model.mesh
    return replace(
        model,
        K=_congruent(model.K, size, factors.stiffness),
        M=_congruent(model.M, size, factors.mass),
        C=None if model.C is None else _congruent(model.C, size, factors.stiffness * factors.time),
        dependence=_dependence(model, size, factors),
        coordinates=factors.length * model.coordinates,
        mesh=None if mesh is None else replace(mesh, nodes=factors.length * mesh.nodes),
        materials={name: factors.material(material) for name, material in model.materials.items()},
        speed=model.speed / factors.time,
        load_steps={name: step.converted(factors) for name, step in model.load_steps.items()},
    )


def _arms(components: IntArray, factors: Conversion) -> Array:
    """Arm of each row: a length for rotations."""
    return np.where((components > 2) & (components < 6), factors.length, 1.0)


def _congruent(matrix: csr_array, size: Array, factor: float) -> csr_array:
    arms = diags_array(size)
    return csr_array(arms @ (factor * matrix) @ arms)


def _dependence(model: ImportedModel, size: Array, factors: Conversion) -> csr_array | None:
    if model.dependence is None:
        return None
    inverse = diags_array(1.0 / _arms(model.dependent[:, 1], factors))
    return csr_array(inverse @ model.dependence @ diags_array(size))


_MESHIO = {
    "tetra": "tet4",
    "tetra10": "tet10",
    "hexahedron": "hex8",
    "hexahedron20": "hex20",
    "wedge": "wedge6",
    "pyramid": "pyramid5",
}
"""Our names of the solids of meshio, where they differ."""

_FAMILIES = ("tetra", "hexahedron", "wedge", "pyramid", "polyhedron")
_DIMENSIONS = ("points", "curves", "surfaces", "volumes")
_GMSH, _INPUT, _FLUENT = "Gmsh", "Abaqus or CalculiX", "Ansys Fluent"


def read_mesh(path: Path, constraints: int | None = None) -> Deck:
    """A mesh with its named groups; materials and supports where the format has them.

    ``constraints`` is the Nastran SPC set in force; not needed where the file has one, or its case control says which.

    Raises
    ------
    InputError
        If the type is not known, the file is damaged or has no solid element.
    """
    known = format_of(path)
    if known is None or known.holds != "mesh":
        suffixes = ", ".join(suffix for known in FORMATS if known.holds == "mesh" for suffix in known.suffixes)
        what = f"mesh files of type '{path.suffix.lower()}' are not known"
        raise refused(path.name, what, remedy=f"known are {suffixes}")
    with made_of(path.name):
        return known.reader(path, constraints) if known.supports else known.reader(path)


def read_by_content(path: Path) -> Deck:
    """Several programs use these suffixes: CalculiX GraphiX writes input files as .msh."""
    suffix = path.suffix.lower()
    begin = read_bytes(path)[:4096]
    if begin.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise refused(path.name, "is text in UTF-16", remedy="save it as plain text (ASCII or UTF-8)")
    kind = _program(begin)
    if kind is None and b"\0" in begin:
        raise refused(path.name, "is no mesh: found a binary file", expected=f"text of {_INPUT}, or Gmsh's .msh")
    if kind is None:
        kind = _GMSH if suffix == ".msh" else _INPUT
    if kind == _FLUENT:
        raise refused(
            path.name, f"is a mesh of {kind}, which is not read", remedy="export it for Abaqus (.inp) or Gmsh"
        )
    usual = _INPUT if suffix == ".inp" else _GMSH
    model = _from_input(path) if kind == _INPUT else _from_gmsh(path)
    if kind != usual:
        model.extra.insert(0, f"{path.name}: is a file of {kind}, and read as that")
    return model


def _program(begin: bytes) -> str | None:
    """The code that wrote a file, by its first line that tells."""
    for line in begin.removeprefix(b"\xef\xbb\xbf").splitlines():
        if line.startswith(b"$MeshFormat"):
            return _GMSH
        if line.startswith(b"*"):
            return _INPUT
        if line.lstrip().startswith(b"("):
            return _FLUENT
        if line.strip():
            return None
    return None


def _from_input(path: Path) -> Deck:
    from slipstick.importers.abaqus.mesh import read_input

    return read_input(path)


def _from_gmsh(path: Path) -> Deck:
    from slipstick.importers.gmsh.mesh_file import read_gmsh

    file = read_gmsh(path)
    model = grouped_model(path.name, file.points, file.cells, file.labels)
    groups = ", ".join(f"{number} of {_DIMENSIONS[dimension]}" for dimension, number in file.unnamed)
    what = f"{path.name}: physical groups without a name are not read: {groups}; name them in Gmsh to use them"
    model.extra += [what] if file.unnamed else []
    return model


def read_by_meshio(path: Path) -> Deck:
    """A mesh of another format that meshio reads."""
    read_bytes(path)
    data = extras.read_by_meshio(path)
    cells = []
    for index, block in enumerate(data.cells):
        if block.type.startswith(_FAMILIES) and block.type not in _MESHIO and block.type not in KINDS:
            raise refused(
                path.name, f"{len(block.data)} solids are of type {block.type}", remedy="mesh with order 1 or 2"
            )
        groups = {
            str(name): np.asarray(sets[index], dtype=np.int64)
            for name, sets in data.cell_sets.items()
            if sets[index] is not None and len(sets[index])
        }
        nodes = np.asarray(block.data, dtype=np.int64)
        cells.append(Cells(kind=_MESHIO.get(block.type, block.type), nodes=nodes, groups=groups))
    for name, chosen in data.point_sets.items():
        nodes = np.asarray(chosen, dtype=np.int64).reshape(-1, 1)
        cells.append(Cells(kind=MARK, nodes=nodes, groups={str(name): np.arange(len(nodes))}))
    return grouped_model(path.name, np.asarray(data.points, dtype=float), cells)
