"""Models of other finite element codes: which reader, which file is what, and the way to one model.h5."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from slipstick.errors import InputError
from slipstick.fem.imported import ImportedModel
from slipstick.fem.materials import Material
from slipstick.fem.mesh import user_names
from slipstick.fem.refine import linear_warnings
from slipstick.importers.mesh_checks import mass_warnings
from slipstick.importers.mesh_files import MESH_SUFFIXES, read_mesh
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.importers.raw_model import Nodes, RawModel, build_model, support_notes
from slipstick.importers.text_numbers import read_bytes
from slipstick.io.model_file import load_model, save_model

_MATRICES = (".full", ".matrix", ".hb", ".rsa", ".rua", ".op4", ".pch", ".sti", ".mtx", ".npz")
_MAPS = (".mapping", ".map", ".dof", ".dofs", ".txt", ".csv")
_MODELS = (".h5", ".hdf5")
_BULK = (".bdf", ".nas", ".dat", ".blk")


@dataclass(frozen=True, kw_only=True)
class ImportOptions:
    """What the files do not say.

    Attributes
    ----------
    mass, damping, dof_map, nodes
        Files with the mass matrix, the damping matrix, the map from rows to nodes and directions, and the positions
        (bulk data, or any mesh), where their names do not tell.
    names
        Names of the matrices in a Nastran file, as {"K": "KGG"}, where several would do.
    constraints
        Number of the Nastran SPC set in force.
    material
        Material for a mesh, instead of the file's own.
    conductivity
        Of every material, power/(length temperature), where the files have none.
    fixed
        Node sets or surfaces to hold.
    quadratic
        Put a node in the middle of every edge of a linear mesh.
    units
        Text kept with the model.
    """

    mass: Path | None = None
    damping: Path | None = None
    dof_map: Path | None = None
    nodes: Path | None = None
    names: Mapping[str, str] = field(default_factory=dict)
    constraints: int | None = None
    material: Material | None = None
    conductivity: float | None = None
    fixed: Sequence[str] = ()
    quadratic: bool = False
    units: str | None = None


@dataclass(frozen=True, kw_only=True)
class _Roles:
    """Which file is what."""

    matrices: dict[str, Path]
    dof_map: Path | None
    nodes: Path | None


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
    fixed: str | Sequence[str] = (),
    quadratic: bool = False,
    units: str | None = None,
) -> ImportedModel:
    """A finite element model from the files of another code, or from a model file of our own.

    Ansys .full, HBMAT (.matrix, .hb with .mapping), .cdb; Nastran .op4 with bulk data, DMIG in .pch; CalculiX .sti with
    .mas and .dof; Abaqus .mtx; MatrixMarket .mtx and .npz with a map file; meshes .inp, .msh; model.h5.

    Parameters
    ----------
    files
        One file, or several that belong together.
    output
        Where the model is kept as one HDF5 file, which a case file may name; a file there is replaced once the new one
        is whole.
    mass, damping, dof_map, nodes, names, constraints, material, conductivity, fixed, quadratic, units
        What the files do not say: see :class:`ImportOptions`.

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
        What is approximated or looks wrong, as in the model's ``warnings``.
    """
    options = ImportOptions(
        mass=_path(mass),
        damping=_path(damping),
        dof_map=_path(dof_map),
        nodes=_path(nodes),
        names=names or {},
        constraints=constraints,
        material=material,
        conductivity=conductivity,
        fixed=(fixed,) if isinstance(fixed, str) else tuple(fixed),
        quadratic=quadratic,
        units=units,
    )
    model = read_model(files, options, quiet=True)
    if output is not None:
        save_model(model, Path(output))
    model.announce()
    return model


def _path(given: str | Path | None) -> Path | None:
    return None if given is None else Path(given)


def summary(model: ImportedModel) -> tuple[str, ...]:
    """What came in, its units, the notes of the import, and parts that are not held."""
    nodes = len(set(model.dof_nodes.tolist()))
    known = "with coordinates" if len(model.node_ids) else "without coordinates"
    sets = f"; sets: {', '.join(user_names(model.node_sets))}" if model.node_sets else ""
    head = f"{model.source}: {model.n_dofs} dofs on {nodes} nodes, {known}, {len(model.constrained)} constrained{sets}"
    return (head, f"units: {model.units}; {_sizes(model)}", *model.notes, *support_notes(model))


def _sizes(model: ImportedModel) -> str:
    """Numbers by which a wrong system of units shows."""
    along = (model.dof_components == 0).astype(float)
    mass = f"the mass that moves along x is {along @ (model.M @ along):.4g}"
    if not len(model.node_ids):
        return mass
    return f"{mass}, the largest dimension {np.ptp(model.coordinates, axis=0).max():.4g}"


def read_model(
    files: Sequence[str | Path] | str | Path, options: ImportOptions | None = None, *, quiet: bool = False
) -> ImportedModel:
    """A model from one or several files; the reader follows from the names and the content.

    What is approximated or looks wrong is in ``model.warnings``, and given as SlipstickWarning unless ``quiet``.

    Raises
    ------
    InputError
        One sentence for each fault.
    """
    options = options or ImportOptions()
    model = _read_model(files, options)
    if options.conductivity is not None:
        model = model.conducting(options.conductivity)
    if not quiet:
        model.announce()
    return model


def _read_model(files: Sequence[str | Path] | str | Path, options: ImportOptions) -> ImportedModel:
    paths = [Path(files)] if isinstance(files, (str, Path)) else [Path(file) for file in files]
    if not paths:
        raise InputError("no file to import was given")
    missing = [f"{path}: there is no such file" for path in paths if not path.is_file()]
    if missing:
        raise InputError(missing)
    source = ", ".join(path.name for path in paths)
    roles = _roles(paths, options)
    _refuse_unused(paths, roles, options)
    if not roles.matrices:
        return _without_matrices(paths[0], source, options)
    raw, mesh = _with_positions(_read(roles, options), roles)
    model = build_model(raw, source=source, units=options.units or (mesh.units if mesh else "not stated"))
    if mesh:
        if not any(path.suffix.lower() == ".sti" for path in paths):  # CalculiX writes global directions
            _refuse_rotated(model, mesh)
        model = _with_mesh(model, mesh, options.material)
    return model.fix(list(options.fixed)) if options.fixed else model


def _with_mesh(model: ImportedModel, imported: MeshModel, material: Material | None) -> ImportedModel:
    """The model of matrices with the mesh they came from, and what does not fit between the two."""
    materials = imported.materials if material is None else {"all": material}
    found = [*model.warnings, *(coupling.beside_matrices for coupling in imported.couplings)]
    found += linear_warnings(imported.mesh, model.source, ("tet4",))
    if materials:
        found += mass_warnings(model, imported.mesh, material or materials)
    assembled = (f"the mesh assembled here, not the matrices: {sentence}" for sentence in imported.warnings)
    notes = (*model.notes, *imported.notes, *assembled)
    return replace(model, mesh=imported.mesh, materials=materials, warnings=tuple(found), notes=notes)


def _refuse_rotated(model: ImportedModel, imported: MeshModel) -> None:
    """A row named n12x must be along x."""
    rotated = np.intersect1d(model.dof_nodes, imported.rotated)
    if len(rotated):
        raise InputError(
            f"{model.source}: {len(rotated)} nodes ({rotated[0]}, ...) have rotated directions, and so have the "
            "rows of the matrices; rotate the nodes to the global directions and export again"
        )


def _refuse_unused(paths: Sequence[Path], roles: _Roles, options: ImportOptions) -> None:
    """Every file and every option has an effect, or is refused."""
    told = (options.mass, options.damping, options.dof_map, options.nodes)
    used = {*roles.matrices.values(), roles.dof_map, roles.nodes, *(Path(path) for path in told if path)}
    if not roles.matrices:
        used.add(paths[0])
    beside = {path.with_suffix(suffix) for path in roles.matrices.values() for suffix in (".mas", ".dof")}
    faults = [f"{path.name}: what it is for does not show; leave it out" for path in paths if path not in used | beside]
    if roles.matrices and options.quadratic:
        faults.append("quadratic: the matrices have elements already; import the mesh alone, or mesh it quadratic")
    if roles.matrices and options.material is not None and roles.nodes is None:
        faults.append("material: matrices hold their material already; give it with a mesh, or leave it out")
    if paths[0].suffix.lower() in _MODELS and (options.material is not None or options.quadratic):
        faults.append(f"{paths[0].name}: holds matrices; a material or quadratic has no effect on them: leave it out")
    if faults:
        raise InputError(faults)


def _without_matrices(path: Path, source: str, options: ImportOptions) -> ImportedModel:
    if path.suffix.lower() in _MODELS:
        model = load_model(path, quiet=True)
        model = replace(model, units=options.units or model.units)
        return model.fix(list(options.fixed)) if options.fixed else model
    return assemble_file(path, source, options)


def assemble_file(path: Path, source: str, options: ImportOptions) -> ImportedModel:
    """A mesh file read and assembled with our own elements."""
    return assemble_mesh(
        read_mesh(path),
        source=source,
        material=options.material,
        fixed=options.fixed,
        quadratic=options.quadratic,
        units=options.units,
    )


def _roles(paths: list[Path], options: ImportOptions) -> _Roles:
    """Files by role: told by the options, else by suffix and by the words in the name."""
    matrices: dict[str, Path] = {}
    dof_map, nodes = options.dof_map, options.nodes
    told = {"M": options.mass, "C": options.damping}
    for path in paths:
        suffix = path.suffix.lower()
        if suffix in _MATRICES and path not in told.values():
            role = _role(path)
            if role in matrices and suffix not in (".op4", ".pch"):
                raise InputError(
                    f"{matrices[role].name} and {path.name} both look like the matrix {role}; say which is the mass"
                )
            matrices[role if role not in matrices else f"{role}{len(matrices)}"] = path
        elif suffix in _MAPS and path != dof_map:
            dof_map = path
        elif suffix in (*_BULK, *MESH_SUFFIXES) and matrices_follow(paths):
            nodes = path
    matrices |= {role: Path(path) for role, path in told.items() if path}
    return _Roles(matrices=matrices, dof_map=Path(dof_map) if dof_map else None, nodes=Path(nodes) if nodes else None)


def matrices_follow(paths: Sequence[Path]) -> bool:
    """Whether matrix files are among these, so that a mesh among them is there for its positions."""
    return any(path.suffix.lower() in _MATRICES for path in paths)


def _role(path: Path) -> str:
    """K, M or C by the words in a file name.

    >>> [_role(Path(name)) for name in ("job_STIF1.mtx", "job_MASS1.mtx", "m.mtx", "blade_damping.npz")]
    ['K', 'M', 'M', 'C']
    """
    name = path.stem.lower()
    if re.search(r"mass|(^|[_\-.])m(gg|aa|ff)?\d*$", name):
        return "M"
    return "C" if re.search(r"damp|(^|[_\-.])c\d*$", name) else "K"


def _read(roles: _Roles, options: ImportOptions) -> RawModel:
    first = roles.matrices.get("K") or next(iter(roles.matrices.values()))
    suffix = first.suffix.lower()
    others = [path.name for path in roles.matrices.values() if path != first]
    if others and suffix in (".full", ".sti"):
        raise InputError(f"{first.name}: brings its own mass; leave out {', '.join(others)}")
    if suffix == ".full":
        from slipstick.importers.ansys.full import read_full

        return read_full(first)
    if suffix in (".op4", ".pch"):
        return _nastran(roles, options, suffix)
    if suffix == ".sti":
        from slipstick.importers.abaqus.calculix import read_matrix_storage

        return read_matrix_storage(first)
    if suffix in (".mtx", ".npz"):
        return _plain(roles, first)
    from slipstick.importers.ansys.hbmat import read_hbmat

    return read_hbmat(roles.matrices, roles.dof_map)


def _nastran(roles: _Roles, options: ImportOptions, suffix: str) -> RawModel:
    from slipstick.importers.nastran.matrices import read_dmig, read_op4_model

    files = list(roles.matrices.values())
    bulk = roles.nodes if roles.nodes and roles.nodes.suffix.lower() in _BULK else None
    if suffix == ".pch":
        return read_dmig(files, bulk, names=options.names)
    return read_op4_model(files, bulk, names=options.names, dof_map=roles.dof_map, constraints=options.constraints)


def _plain(roles: _Roles, first: Path) -> RawModel:
    from slipstick.importers.plain import matrices

    if first.suffix.lower() == ".npz" and matrices.is_bundle(first):
        return matrices.read_bundle(first)
    if first.suffix.lower() == ".mtx" and not read_bytes(first)[:14].lower().startswith(b"%%matrixmarket"):
        from slipstick.importers.abaqus.calculix import read_abaqus_matrices
        from slipstick.importers.dof_map import read_dof_map

        if roles.dof_map is None:
            return read_abaqus_matrices(roles.matrices)
        rows, nodes = read_dof_map(roles.dof_map)
        raw = read_abaqus_matrices(roles.matrices, rows)
        return replace(raw, nodes=replace(nodes, held=raw.nodes.held))
    return matrices.read_plain(roles.matrices, roles.dof_map)


def _with_positions(raw: RawModel, roles: _Roles) -> tuple[RawModel, MeshModel | None]:
    """Coordinates and sets from a mesh or bulk data file given besides the matrices, and the mesh."""
    if roles.nodes is None:
        return raw, None
    if roles.nodes.suffix.lower() in _BULK:
        from slipstick.importers.nastran.bulk import read_bulk
        from slipstick.importers.nastran.matrices import told

        if len(raw.nodes.ids):
            return raw, None
        data = read_bulk(roles.nodes)
        nodes = replace(raw.nodes, ids=data.nodes.ids, coordinates=data.nodes.coordinates)
        return replace(raw, nodes=nodes, **told(data)), None
    imported = read_mesh(roles.nodes)
    mesh = imported.mesh
    sets = {name: mesh.labels[part] for name, part in mesh.node_sets.items()}
    nodes = Nodes(ids=mesh.labels, coordinates=mesh.nodes, sets=sets, held=raw.nodes.held)
    return replace(raw, nodes=nodes), imported
