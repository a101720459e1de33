"""Centrifugal states kept in a folder, found again by the content of what they were made from."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slipstick.fem.axis import Axis
from slipstick.fem.materials import element_values
from slipstick.fem.rotation import Centrifugal, centrifugal
from slipstick.structure.reduction import store

if TYPE_CHECKING:
    from slipstick.fem.imported import ImportedModel

_PARTS = ("data", "indices", "indptr")
_STATE = ("displacement", "strain", "mass")


def kept_centrifugal(model: ImportedModel, speed: float, axis: Axis, folder: Path | None) -> Centrifugal:
    """``centrifugal``, read from the folder where it was computed before."""
    if folder is None or model.mesh is None or not model.materials:
        return centrifugal(model, speed, axis)
    path = folder / f"speed-{_key(model, speed, axis)}.npz"
    found = _read(path, model.n_dofs, model.mesh.n_nodes)
    if found is not None:
        return found
    made = centrifugal(model, speed, axis)
    arrays = {name: getattr(made.stiffness, name) for name in _PARTS}
    store.write(path, arrays | {name: np.asarray(getattr(made, name)) for name in _STATE})
    return made


def _read(path: Path, size: int, n_nodes: int) -> Centrifugal | None:
    """None where there is none, or what is there is no such state."""
    from scipy.sparse import csr_array

    arrays = store.read(path)
    if arrays is None or set(arrays) != {*_PARTS, *_STATE} or arrays["displacement"].shape != (n_nodes, 3):
        return None
    try:
        stiffness = csr_array(tuple(arrays[name] for name in _PARTS), shape=(size, size))
        stiffness.check_format(full_check=True)
        strain, mass = (float(arrays[name]) for name in ("strain", "mass"))
    except (ValueError, TypeError):
        return None
    return Centrifugal(stiffness=stiffness, displacement=arrays["displacement"], strain=strain, mass=mass)


def _key(model: ImportedModel, speed: float, axis: Axis) -> str:
    """Changes with the model, its mesh and materials, the rotation, and the code."""
    from scipy.sparse import csr_array

    assert model.mesh is not None
    numbers = [model.mesh.nodes, *(block for _, block in model.mesh.items())]
    for of in (lambda m: m.lame, lambda m: m.shear_modulus, lambda m: m.density):
        numbers += [values[None] for values in element_values(model.mesh, model.materials, of).values() if len(values)]
    rows = np.stack([model.dof_nodes, model.dof_components])
    dependence = () if model.dependence is None else (model.dependence, csr_array(model.dependent))
    matrices = (model.K, csr_array(rows), csr_array(model.mesh.labels[None]), *dependence, *map(csr_array, numbers))
    about = [np.asarray(vector).tolist() for vector in (axis.point, axis.direction)]
    return store.content_key(matrices, [speed, about, list(model.mesh.blocks), store.code_digest("solve", "fem")])
