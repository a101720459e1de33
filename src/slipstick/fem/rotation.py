"""A structure that turns: its static state under centrifugal forces, and the stiffness about it.

In the frame that turns with the structure, at speed s about a unit axis a through a point o, the static displacement u
and the stiffness of small motions about it are those of

    f(u) = Mp (x + u - o),    K = df/du - Mp,    Mp = s^2 int rho N' (1 - a a') N,

with the elastic forces f of large displacements (deformed.py): K holds the centrifugal stress, the change of geometry
and spin softening, and at small strain it is ``K0 + s^2 K1``. Coriolis forces are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import InputError
from slipstick.fem.assembly import mass_values
from slipstick.fem.axis import Axis
from slipstick.fem.deformed import deformed
from slipstick.fem.in_mesh import motion_in_mesh, rows_in_mesh
from slipstick.fem.materials import Materials
from slipstick.fem.mesh import Mesh
from slipstick.fem.sparsity import Pattern, pattern_of
from slipstick.solve.linear.factors import SingularMatrixError
from slipstick.typing import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    from slipstick.fem.imported import ImportedModel

_SMALL_STEP = 1e-7
"""Of the displacement; the iteration converges quadratically, so that the next step would be far below rounding."""
_ITERATIONS = 12
_STEPS = (1, 4, 16)
"""Parts in which the square of the speed is brought up, one after another until a way succeeds."""


@dataclass(frozen=True, kw_only=True)
class Centrifugal:
    """What turning at a speed does.

    Attributes
    ----------
    stiffness
        To be added to that at rest, sparse (n, n), of the rows of the model.
    displacement
        Static, of the nodes of the mesh, (n_nodes, 3).
    strain
        The largest static strain, without sign.
    mass
        Mass of the mesh that moves with the rows, mean over the three directions.
    """

    stiffness: csr_array
    displacement: Array
    strain: float
    mass: float


def centrifugal(model: ImportedModel, speed: float, axis: Axis) -> Centrifugal:
    """What turning at a speed, rad/s, about an axis does.

    Raises
    ------
    InputError
        If the model has no mesh or no material, is not held, or finds no static state at this speed.
    """
    mesh, materials = _meshed(model)
    pattern, along = pattern_of(mesh), np.asarray(axis.direction)
    turning = _Turning(
        model=model,
        mesh=mesh,
        materials=materials,
        pattern=pattern,
        motion=_motion(model, mesh),
        mass=mass_values(mesh, materials, pattern),
        across=np.eye(3) - np.outer(along, along),
        origin=np.asarray(axis.point),
    )
    linear = turning.linear(speed)
    for steps in _STEPS:
        found = turning.followed(linear, speed, steps)
        if found is not None:
            return found
    raise InputError(f"{model.source}: finds no static state at {speed:g} rad/s; check speed, axis and units")


def _meshed(model: ImportedModel) -> tuple[Mesh, Materials]:
    if model.mesh is None or not model.materials:
        what = "mesh" if model.mesh is None else "material of its mesh"
        raise InputError(
            f"{model.source}: forces of rotation need the {what}; import it too, or give matrices at two speeds"
        )
    return model.mesh, model.materials


def _motion(model: ImportedModel, mesh: Mesh) -> csr_array:
    """Motion of all nodes of the mesh (3 n_nodes, n) from that of the rows."""
    from scipy.sparse import csr_array

    what = "forces of rotation"
    free = rows_in_mesh(model, mesh, model.dof_nodes, model.dof_components, what)
    found = motion_in_mesh(model, mesh, free, what)
    if found is not None:
        return found
    return csr_array((np.ones(len(free)), (free, np.arange(len(free)))), shape=(3 * mesh.n_nodes, len(free)))


@dataclass(frozen=True, kw_only=True)
class _Turning:
    """The parts of the equations; ``mass`` of every coupling (n_couplings,), ``across`` takes the axis out."""

    model: ImportedModel
    mesh: Mesh
    materials: Materials
    pattern: Pattern
    motion: csr_array
    mass: Array
    across: Array
    origin: Array

    def linear(self, speed: float) -> Array:
        """The displacement (n,) by the stiffness at rest; InputError where that is singular."""
        residual, _, _ = self._at(np.zeros(self.model.n_dofs), speed**2)
        try:
            return -_solved(self.model.K, residual)
        except SingularMatrixError:
            what = "has rigid-body motion, nothing balances centrifugal forces; constrain it"
            raise InputError(f"{self.model.source}: {what}") from None

    def followed(self, linear: Array, speed: float, steps: int) -> Centrifugal | None:
        """The state at a speed, its square brought up in equal steps; None where Newton's method does not converge."""
        q = linear / steps
        for step in range(1, steps + 1):
            squared = speed**2 * step / steps
            for _ in range(_ITERATIONS):
                residual, stiffness, _ = self._at(q, squared)
                try:
                    change = _solved(self.model.K + stiffness, residual)
                except SingularMatrixError:
                    return None
                q = q - change
                if not np.all(np.isfinite(q)):
                    return None
                if np.abs(change).max() <= _SMALL_STEP * np.abs(q).max():
                    break
            else:
                return None
        _, stiffness, strain = self._at(q, squared)
        return Centrifugal(
            stiffness=stiffness, displacement=self._displacement(q), strain=strain, mass=self._moving_mass()
        )

    def _displacement(self, q: Array) -> Array:
        return np.asarray(self.motion @ q).reshape(-1, 3)

    def _at(self, q: Array, squared: float) -> tuple[Array, csr_array, float]:
        """Residual (n,), stiffness beyond that at rest, and the largest strain."""
        u = self._displacement(q)
        change = deformed(self.mesh, self.materials, self.pattern, u)
        turned = (self.mesh.nodes + u - self.origin) @ self.across
        load = squared * (self.pattern.scalar_matrix(self.mass) @ turned)
        blocks = change.stiffness - squared * self.mass[:, None, None] * self.across
        stiffness = self.motion.T @ self.pattern.vector_matrix(blocks) @ self.motion
        residual = self.model.K @ q + self.motion.T @ (change.force - load).ravel()
        return np.asarray(residual), stiffness, change.strain

    def _moving_mass(self) -> float:
        along = np.asarray(self.motion @ (self.model.dof_components[:, None] == np.arange(3)).astype(float))
        along = along.reshape(-1, 9)
        return float((along * (self.pattern.scalar_matrix(self.mass) @ along)).sum()) / 3.0


def _solved(matrix: csr_array, right: Array) -> Array:
    from slipstick.solve.linear.factorisation import factorise

    if not (np.all(np.isfinite(matrix.data)) and np.all(np.isfinite(right))):
        raise SingularMatrixError("the matrix is not finite")
    return np.asarray(factorise(matrix).solve(right))
