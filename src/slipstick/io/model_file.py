"""One imported model in one HDF5 file (model.h5): matrices, dof map, sets, and the mesh where there is one."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError
from slipstick.fem.axis import Axis
from slipstick.fem.cyclic import CyclicSymmetry
from slipstick.fem.interfaces import PretensionSection, SurfacePair
from slipstick.fem.load_steps import LoadStep
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.model import ImportedModel
from slipstick.io.hdf5 import created, opened, own_node, require_own
from slipstick.replacing import HDF5, writing
from slipstick.typing import Sparse

if TYPE_CHECKING:
    import h5py


MODEL_FORMAT = "slipstick model"
VERSION = 3
"""Since 2 some degrees of freedom may depend on others, since 3 it may be a sector; others are of version 1."""

_MATRIX = ("data", "indices", "indptr")
_MAP = ("dof_nodes", "dof_components", "node_ids", "coordinates", "constrained")
_DEPENDENT = "dependent"
_SIDES = ("low", "high")

_INTERFACES = ("contact_pairs", "pretension_sections", "load_steps")


def save_model(model: ImportedModel, path: Path) -> Path:
    """Write a model; an existing file is replaced only when the new one is whole.

    Raises
    ------
    InputError
        If the file cannot be written, or there is one that is no HDF5 file.
    """
    path = Path(path)
    with writing(path, HDF5) as part, created(part) as (file, _):
        _write(file, model)
    return path


def _write(file: h5py.Group, model: ImportedModel) -> None:
    version = 3 if model.symmetry is not None else 1 if model.dependence is None else 2
    file.attrs.update(format=MODEL_FORMAT, version=version, source=model.source, units=model.units)
    file.attrs["speed"] = model.speed
    file.attrs["notes"], file.attrs["warnings"] = json.dumps(model.notes), json.dumps(model.warnings)
    file.attrs["materials"] = json.dumps({name: vars(material) for name, material in model.materials.items()})
    if model.shortenings:
        file.attrs["shortenings"] = json.dumps(model.shortenings)
    for name in _INTERFACES:
        if known := getattr(model, name):  # an attribute holds 64 kB at most
            text = json.dumps({key: asdict(part) for key, part in known.items()})
            file[name] = np.frombuffer(text.encode(), dtype=np.uint8)
    for name in "KMC":
        matrix = getattr(model, name)
        if matrix is not None:
            for part in _MATRIX:
                file[f"{name}/{part}"] = getattr(matrix, part)
    for name in _MAP:
        file[name] = getattr(model, name)
    if model.dependence is not None:
        file[_DEPENDENT] = model.dependent
        for part in _MATRIX:
            file[f"dependence/{part}"] = getattr(model.dependence, part)
    _write_group(file, "node_sets", model.node_sets)
    if model.mesh is not None:
        _write_mesh(file.create_group("mesh"), model.mesh)
    if model.symmetry is not None:
        _write_symmetry(file.create_group("symmetry"), model.symmetry)


def _write_symmetry(group: h5py.Group, symmetry: CyclicSymmetry) -> None:
    axis = {name: np.asarray(getattr(symmetry.axis, name)).tolist() for name in ("point", "direction", "zero")}
    group.attrs["sectors"], group.attrs["axis"] = symmetry.sectors, json.dumps(axis)
    for side in _SIDES:
        given = getattr(symmetry, side)
        labels = isinstance(given, np.ndarray)
        group.attrs[side] = "" if labels else json.dumps(given if isinstance(given, str) else list(given))
        if labels:
            group[side] = given
    if symmetry.alone is not None:  # of the same mesh
        _write(group.create_group("alone"), replace(symmetry.alone, mesh=None))


def _write_group(group: h5py.Group, where: str, arrays: Mapping[str, NDArray]) -> None:
    """Arrays under numbers, their names in an attribute: a name may hold any character."""
    inner = group.create_group(where)
    inner.attrs["names"] = json.dumps(list(arrays))
    for number, array in enumerate(arrays.values()):
        inner[str(number)] = array


def _write_mesh(group: h5py.Group, mesh: Mesh) -> None:
    group["nodes"], group["labels"] = mesh.nodes, mesh.labels
    if mesh.temperature is not None:
        group["temperature"] = mesh.temperature
    _write_group(group, "blocks", mesh.blocks)
    _write_group(group, "node_sets", mesh.node_sets)
    _write_group(group, "element_labels", mesh.element_labels or {})
    for where, nested in (
        ("element_sets", mesh.element_sets),
        ("surfaces", {name: surface.faces for name, surface in mesh.surfaces.items()}),
    ):
        inner = group.create_group(where)
        inner.attrs["names"] = json.dumps(list(nested))
        for number, arrays in enumerate(nested.values()):
            _write_group(inner, str(number), arrays)


def load_model(path: Path, *, quiet: bool = False) -> ImportedModel:
    """Read a model written by ``save_model``; its warnings are given as SlipstickWarning unless ``quiet``.

    Raises
    ------
    InputError
        If the file is missing, damaged, of another kind or version, or its parts do not fit together.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    try:
        with opened(path) as file:
            model = _read(file, path)
    except InputError:
        raise
    except (OSError, KeyError, ValueError, TypeError, RuntimeError, AttributeError) as error:
        raise InputError(f"{path.name}: is damaged or not a slipstick model ({error})") from None
    if not quiet:
        model.announce()
    return model


def _read(file: h5py.Group, path: Path) -> ImportedModel:
    if file.attrs.get("format") != MODEL_FORMAT:
        raise InputError(f"{path.name}: is not a slipstick model; make one with: slipstick import FILE -o model.h5")
    if int(file.attrs["version"]) > VERSION:
        raise InputError(f"{path.name}: has format version {file.attrs['version']}, this program reads up to {VERSION}")
    arrays: dict[str, Any] = {name: _array(file, name, path) for name in _MAP}
    n = len(arrays["dof_nodes"])
    materials = {name: Material(**known) for name, known in json.loads(file.attrs["materials"]).items()}
    given: dict[str, Any] = {name: _matrix(file, name, (n, n), path) for name in "KMC" if name in file}
    mesh = _mesh(own_node(file, "mesh"), path) if "mesh" in file else None
    return ImportedModel(
        **given,
        **arrays,
        **_dependence(file, n, path),
        node_sets=_group(file, "node_sets", path),
        source=str(file.attrs["source"]),
        units=str(file.attrs["units"]),
        speed=float(file.attrs.get("speed", 0.0)),
        notes=tuple(map(str, json.loads(file.attrs["notes"]))),
        warnings=tuple(map(str, json.loads(file.attrs.get("warnings", "[]")))),
        mesh=mesh,
        materials=materials,
        contact_pairs=_interfaces(file, "contact_pairs", path),
        pretension_sections=_interfaces(file, "pretension_sections", path),
        shortenings=tuple(map(str, json.loads(file.attrs.get("shortenings", "[]")))),
        load_steps={name: LoadStep.of(known) for name, known in _table(file, "load_steps", path).items()},
        symmetry=_symmetry(own_node(file, "symmetry"), mesh, path) if "symmetry" in file else None,
    )


def _table(file: h5py.Group, name: str, path: Path) -> dict[str, Any]:
    """What stands in a file as text: in a data set, or in an attribute of older ones."""
    text = bytes(_array(file, name, path)).decode() if name in file else file.attrs.get(name, "{}")
    return dict(json.loads(text))


def _interfaces(file: h5py.Group, name: str, path: Path) -> dict[str, Any]:
    """Contact pairs or sections of bolts, none in older files; ValueError where a value is of another kind."""
    found: dict[str, Any] = {}
    for key, known in _table(file, name, path).items():
        numbers = [value for value in (known.get("mu"), *(known.get("normal") or ())) if value is not None]
        if not np.all(np.isfinite(np.array(numbers, dtype=float))):
            raise ValueError(f"{name} holds a number that is not finite")
        if name == "contact_pairs":
            words = {part: str(known[part]) for part in ("dependent", "independent", "interaction")}
            mu = None if known["mu"] is None else float(known["mu"])
            found[key] = SurfacePair(**words, mu=mu, card=str(known.get("card", "")))
        else:
            x = known["normal"]
            normal = None if x is None else (float(x[0]), float(x[1]), float(x[2]))
            card = str(known.get("card", ""))
            found[key] = PretensionSection(node=int(known["node"]), normal=normal, card=card)
    return found


def _symmetry(group: h5py.Group, mesh: Mesh | None, path: Path) -> CyclicSymmetry:
    alone = _read(own_node(group, "alone"), path) if "alone" in group else None
    return CyclicSymmetry(
        sectors=int(group.attrs["sectors"]), axis=Axis(**json.loads(group.attrs["axis"])),
        **{side: _array(group, side, path) if side in group else json.loads(group.attrs[side]) for side in _SIDES},
        alone=None if alone is None else replace(alone, mesh=mesh),
    )  # fmt: skip


def _array(group: h5py.Group, name: str, path: Path) -> NDArray:
    """A data set of this file, refused if it is linked from another or larger than the file."""
    data = own_node(group, name)
    require_own(data)
    if data.dtype.kind not in "iuf":
        raise InputError(f"{path.name}: {name} is not an array of numbers; the file is damaged")
    return data[()]


def _dependence(file: h5py.Group, n: int, path: Path) -> dict[str, Any]:
    """Dependent degrees of freedom by the rows, where the file has them."""
    if _DEPENDENT not in file:
        return {}
    dependent = _array(file, _DEPENDENT, path)
    return {"dependent": dependent, "dependence": _matrix(file, "dependence", (len(dependent), n), path)}


def _matrix(file: h5py.Group, name: str, shape: tuple[int, int], path: Path) -> Sparse:
    from scipy.sparse import csr_array

    group = own_node(file, name)
    parts = tuple(_array(group, part, path) for part in _MATRIX)
    matrix = csr_array(parts, shape=shape)
    matrix.check_format(full_check=True)
    if not np.all(np.isfinite(matrix.data)):
        raise InputError(f"{path.name}: {name} holds values that are not finite")
    return matrix


def _group(group: h5py.Group, where: str, path: Path) -> dict[str, NDArray]:
    inner = own_node(group, where)
    return {str(name): _array(inner, str(i), path) for i, name in enumerate(json.loads(inner.attrs["names"]))}


def _nested(group: h5py.Group, where: str, path: Path) -> dict[str, dict[str, NDArray]]:
    inner = own_node(group, where)
    return {str(name): _group(inner, str(i), path) for i, name in enumerate(json.loads(inner.attrs["names"]))}


def _mesh(group: h5py.Group, path: Path) -> Mesh:
    return Mesh(
        nodes=_array(group, "nodes", path),
        blocks=_group(group, "blocks", path),
        node_sets=_group(group, "node_sets", path),
        element_sets=_nested(group, "element_sets", path),
        surfaces={name: Surface(faces=faces) for name, faces in _nested(group, "surfaces", path).items()},
        node_labels=_array(group, "labels", path),
        element_labels=_group(group, "element_labels", path) or None,
        temperature=_array(group, "temperature", path) if "temperature" in group else None,
    )


def is_model(path: Path) -> bool:
    """Whether a file begins as a model file of slipstick."""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return bool(file.attrs.get("format") == MODEL_FORMAT)
    except (OSError, KeyError, ValueError, RuntimeError):
        return False
