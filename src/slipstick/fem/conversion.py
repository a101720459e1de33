"""A model in other units: every number by the factor of its dimension."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array, diags_array

from slipstick.fem.imported import ImportedModel
from slipstick.fem.materials import Material
from slipstick.typing import Array, IntArray


@dataclass(frozen=True, kw_only=True)
class Conversion:
    """New number over old number, by dimension; the mass follows.

    >>> inch = Conversion(length=0.0254, force=4.4482216152605)
    >>> round(inch.mass, 3), round(inch.stiffness, 3)
    (175.127, 175.127)
    """

    length: float = 1.0
    force: float = 1.0
    time: float = 1.0

    @property
    def mass(self) -> float:
        """Force time^2/length."""
        return self.force * self.time**2 / self.length

    @property
    def stiffness(self) -> float:
        """Force/length."""
        return self.force / self.length

    def material(self, old: Material) -> Material:
        """A material in the new units."""
        return Material(
            young=old.young * self.force / self.length**2,
            poisson=old.poisson,
            density=old.density * self.mass / self.length**3,
            conductivity=old.conductivity * self.force / self.time,
        )

    @property
    def inverse(self) -> Conversion:
        """From the new units to the old ones."""
        return Conversion(length=1.0 / self.length, force=1.0 / self.force, time=1.0 / self.time)


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
