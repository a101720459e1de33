"""A model in other units: every number by the factor of its dimension."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array, diags_array

from slipstick.fem.model import ImportedModel
from slipstick.fem.unit_systems import Conversion
from slipstick.typing import Array, IntArray


def converted(model: ImportedModel, factors: Conversion) -> ImportedModel:
    """The model in other units; rotations have none, generalised coordinates are taken for lengths."""
    size = _sizes(model.dof_components, factors)
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
    )


def _sizes(components: IntArray, factors: Conversion) -> Array:
    """Arm of each row: a length for rotations."""
    return np.where((components > 2) & (components < 6), factors.length, 1.0)


def _congruent(matrix: csr_array, size: Array, factor: float) -> csr_array:
    arms = diags_array(size)
    return csr_array(arms @ (factor * matrix) @ arms)


def _dependence(model: ImportedModel, size: Array, factors: Conversion) -> csr_array | None:
    if model.dependence is None:
        return None
    inverse = diags_array(1.0 / _sizes(model.dependent[:, 1], factors))
    return csr_array(inverse @ model.dependence @ diags_array(size))
